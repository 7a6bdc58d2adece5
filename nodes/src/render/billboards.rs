//! The node `Billboards`: trees from photographs, on transparent polygons that turn (\[N], "Texture
//! mapping").

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::camera::{Camera, View};
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::render::billboards::{self, BillboardsOptions, Chance, Subject, Tree};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Override, PictureDemand, SpanDemand};
use spandrel_engine::{Error, Result};
use std::collections::BTreeSet;

/// The most trees in a node.
const MOST: usize = 1_000_000;

/// How round trees are, and how much comes through their leaves, if nobody says: what comes nearest to a tree of 40 956
/// leaves under light from five directions (`tests/README.md`, "Trees").
const CROWN: f32 = 0.5;
const TRANSMIT: f32 = 0.5;

/// Trees, bushes and grass from cut-out photographs, on transparent upright cards. Cards turn to
/// the camera for the picture, to each light for its shadow, and to each mirror for its reflection.
/// A card turns about the foot of the subject in its picture. Seen or lit from more than 60 degrees
/// above, it tilts so that it does not look thin.
///
/// `Matte` cuts out a photograph.
///
/// Example: `Billboards(camera: "eye", pictures: ["oak"], trees: [(0, (-6, 0, -4), 8)])`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Billboards {
    /// The camera.
    pub camera: Link<Camera>,
    /// Cut-out photographs, with alpha.
    pub pictures: Vec<Link<Image>>,
    /// Single trees: the number of the picture (from 0), the place of the foot in metres, and the
    /// height in metres.
    #[schemars(extend("x-parts" = ["subject", "foot", "height"]))]
    pub trees: Vec<(u32, (f64, f64, f64), f64)>,
    /// Rows of trees along lines from point to point.
    pub rows: Vec<Row>,
    /// Trees scattered over areas.
    pub areas: Vec<Area>,
    /// The seed by which heights, places and pictures are chosen.
    pub seed: u64,
    /// Whether lights light the trees. If not, they show the photographs as they are.
    pub lit: bool,
    /// How round they are in the light, 0 to 1: at 1 one side is lit and the other shaded, as on a crown; at 0 they are
    /// as flat as their cards.
    pub crown: f32,
    /// How much of the light from behind comes through the leaves, as a share of what they send back of light from the
    /// front, 0 to 1.
    pub transmit: Color,
    /// The photographs' colours are multiplied by this.
    pub color: Color,
    /// Their name, for `object(..)` in programs: `trees/0/17` is number 17 with picture 0.
    pub name: String,
}

/// Trees along a line.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Row {
    /// Two or more points, in metres.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub along: Vec<(f64, f64, f64)>,
    /// Metres from tree to tree.
    pub every: f64,
    /// The least and the greatest height, in metres.
    #[schemars(extend("x-parts" = ["least", "most"]))]
    pub heights: (f64, f64),
    /// How far a tree may stand from its place, in metres.
    #[serde(default)]
    pub astray: f64,
    /// The numbers of the pictures to choose from. If absent, all.
    #[serde(default)]
    pub pictures: Vec<u32>,
}

/// Trees on a level area.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Area {
    /// Its corners, in metres. Trees stand at the height of the lowest.
    #[schemars(extend("x-parts" = ["x", "y", "z"]))]
    pub corners: Vec<(f64, f64, f64)>,
    /// The number of trees.
    pub count: u32,
    /// The least and the greatest height, in metres.
    #[schemars(extend("x-parts" = ["least", "most"]))]
    pub heights: (f64, f64),
    /// The least distance between trees, in metres. Trees that find no room are left out.
    #[serde(default)]
    pub apart: f64,
    /// The numbers of the pictures to choose from. If absent, all.
    #[serde(default)]
    pub pictures: Vec<u32>,
}

impl Default for Billboards {
    fn default() -> Billboards {
        Billboards {
            camera: Link::default(),
            pictures: Vec::new(),
            trees: Vec::new(),
            rows: Vec::new(),
            areas: Vec::new(),
            seed: 1,
            lit: true,
            crown: CROWN,
            transmit: Color::grey(TRANSMIT),
            color: Color::WHITE,
            name: "trees".to_owned(),
        }
    }
}

impl Billboards {
    fn picks<'a>(
        &self,
        pictures: &'a [u32],
        heights: (f64, f64),
    ) -> impl Fn(DVec3, &mut Chance) -> Tree + 'a {
        let all = self.pictures.len() as u32;
        move |foot, chance| {
            let count = if pictures.is_empty() { all } else { pictures.len() as u32 };
            let number = ((chance.unit() * f64::from(count)) as u32).min(count.saturating_sub(1));
            let picture = pictures.get(number as usize).copied().unwrap_or(number);
            let height = heights.0 + (heights.1 - heights.0) * chance.unit();
            let mirrored = chance.unit() < 0.5;
            Tree { picture, foot, height, mirrored }
        }
    }

    fn planted(&self, inputs: &Inputs<'_>) -> Result<Vec<Tree>> {
        let one = |&(picture, foot, height): &(u32, (f64, f64, f64), f64)| Tree {
            picture,
            foot: foot.into(),
            height,
            mirrored: false,
        };
        let mut trees: Vec<Tree> = self.trees.iter().map(one).collect();
        for (number, row) in self.rows.iter().enumerate() {
            // Each row has chances of its own: changing one leaves the others as they are.
            let mut chance = Chance::new(self.seed ^ (number as u64) << 32);
            let pick = self.picks(&row.pictures, row.heights);
            let mut rest = 0.0;
            for pair in row.along.windows(2) {
                let (from, to) = (DVec3::from(pair[0]), DVec3::from(pair[1]));
                let length = (to - from).length();
                while rest <= length {
                    let off = DVec3::new(chance.unit() - 0.5, 0.0, chance.unit() - 0.5);
                    let foot = from + (to - from) * (rest / length.max(1e-9));
                    trees.push(pick(foot + off * (2.0 * row.astray), &mut chance));
                    rest += row.every;
                    if trees.len() > MOST {
                        return Err(Error::invalid(format!("`rows`: more than {MOST} trees")));
                    }
                }
                // Trees stay evenly apart round the corners of a row.
                rest -= length;
            }
        }
        for (number, area) in self.areas.iter().enumerate() {
            let pick = self.picks(&area.pictures, area.heights);
            let corners: Vec<DVec3> = area.corners.iter().map(|p| DVec3::from(*p)).collect();
            let seed = self.seed.wrapping_add(1) ^ (number as u64 + 1) << 40;
            let plant = |foot, chance: &mut Chance| trees.push(pick(foot, chance));
            let planted = billboards::scatter(&corners, area.count, area.apart, seed, plant)
                .map_err(|error| Error::invalid(format!("area {number}: {error}")))?;
            if planted < area.count {
                let (count, apart) = (area.count, area.apart);
                inputs.warn(&format!(
                    "area {number}: {planted} of {count} trees find room {apart} m apart"
                ));
            }
            if trees.len() > MOST {
                return Err(Error::invalid(format!("`areas`: more than {MOST} trees")));
            }
        }
        Ok(trees)
    }
}

impl Node for Billboards {
    type Output = SpanImage;
    const KIND: &'static str = "Billboards";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] =
        &["Trees", "Cards", "Sprites", "Imposters", "Scatter", "Forest", "Grass"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let has = |heights: (f64, f64)| {
            heights.0 > 0.0 && heights.0 <= heights.1 && heights.1.is_finite()
        };
        if !(0.0..=1.0).contains(&self.crown) {
            return Err(FieldError::new("crown", "must be 0 to 1"));
        }
        if !self.transmit.to_array().iter().all(|share| (0.0..=1.0).contains(share)) {
            return Err(FieldError::new("transmit", "must be 0 to 1"));
        }
        let count = self.pictures.len() as u32;
        let is_planted = !(self.trees.is_empty() && self.rows.is_empty() && self.areas.is_empty());
        if is_planted && count == 0 {
            let what = "give cut-out photographs for what is planted: there are none";
            return Err(FieldError::new("pictures", what));
        }
        let all = self.trees.iter().map(|(picture, ..)| picture);
        let all = all.chain(self.rows.iter().flat_map(|row| &row.pictures));
        let mut all = all.chain(self.areas.iter().flat_map(|area| &area.pictures));
        if let Some(picture) = all.find(|picture| **picture >= count) {
            let what = format!("there is no picture {picture}: there are {count}, from 0 on");
            return Err(FieldError::new("pictures", what));
        }
        for (number, row) in self.rows.iter().enumerate() {
            let points = row.along.iter().all(|p| DVec3::from(*p).is_finite());
            if row.along.len() < 2 || !points {
                let what = format!("row {number}: give two finite points or more");
                return Err(FieldError::new("rows", what));
            }
            if !(row.every > 0.0 && row.every.is_finite() && row.astray.is_finite()) {
                let what = format!("row {number}: `every` must be above 0 metres");
                return Err(FieldError::new("rows", what));
            }
            if !has(row.heights) {
                let what = format!("row {number}: heights must be above 0, and rise");
                return Err(FieldError::new("rows", what));
            }
        }
        for (number, area) in self.areas.iter().enumerate() {
            if !has(area.heights) {
                let what = format!("area {number}: heights must be above 0, and rise");
                return Err(FieldError::new("areas", what));
            }
            if !(area.apart >= 0.0 && area.apart.is_finite()) || area.corners.len() < 3 {
                let what =
                    format!("area {number}: three corners or more, `apart` 0 metres or more");
                return Err(FieldError::new("areas", what));
            }
            if area.count as usize > MOST {
                let what = format!("area {number}: at most {MOST} trees");
                return Err(FieldError::new("areas", what));
            }
        }
        Ok(())
    }

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.camera, ());
        let channels = BTreeSet::from([Channel::Color]);
        let whole = PictureDemand { channels, changed: Override::default() };
        self.pictures.iter().for_each(|picture| upstream.ask(picture, whole.clone()));
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let view = View::new(&inputs.get(&self.camera), wanted.raster)?;
        let trees = self.planted(inputs)?;
        if trees.is_empty() {
            inputs.warn("there are no trees: give `trees`, `rows` or `areas`");
        }
        let subject = |(number, link): (usize, &Link<Image>)| {
            Subject::new(&inputs.get(link))
                .map_err(|error| Error::invalid(format!("picture {number}: {error}")))
        };
        let subjects: Vec<Subject> =
            self.pictures.iter().enumerate().map(subject).collect::<Result<_>>()?;
        for number in (0..subjects.len()).filter(|number| subjects[*number].is_opaque) {
            inputs.warn(&format!(
                "picture {number} is opaque everywhere, so that its cards are rectangles: cut it out with `Matte`, \
                 without `preview`"
            ));
        }
        let stand = BillboardsOptions {
            label: self.name.clone(),
            color: self.color,
            lit: self.lit,
            crown: self.crown,
            transmit: self.transmit,
        };
        billboards::image(subjects, trees, stand, &view, wanted.plan, wanted.rows.clone())
    }
}
