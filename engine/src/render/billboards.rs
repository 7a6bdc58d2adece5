//! Trees from photographs (\[N]): cut-out pictures on upright cards that turn to whoever looks at them.
//!
//! For the picture each card is turned to the eye; for shadows to each light, or to each sample of a sky or an
//! area source; for reflections along each ray. A card turns about the foot of its subject: the middle of what is
//! lowest in the picture.

use glam::{DVec2, DVec3, Vec3};
use std::path::Path;
use std::sync::{Arc, OnceLock};

use crate::camera::View;
use crate::color::Color;
use crate::error::{Error, FirstError, Result};
use crate::fragment::{Columns, Finish, Fragments, Meeting, Provenance, RayTarget, Surfaces};
use crate::image::texels::Texels;
use crate::image::{Coded, Codes, Coding, Image, Layout};
use crate::key::KeyHasher;
use crate::math;
use crate::polygon;
use crate::raster::{LinePlan, Rows};
use crate::render::scanline::{self, Cluster};
use crate::scene::{AlphaMode, Document, Face, Material, Mesh, Object, Plan, Scene, Shape, Sides};
use crate::span::SpanImage;
use crate::texture::{Footprint, Level, Meaning, Opened, PictureSource, Wrap, pyramid, store};
use crate::trace::{Card, Casters, CastersBuilder, Toward, Turned};

/// What is less than this hides nothing: noise of a matte has no size.
const LEAST_ALPHA: f32 = 0.05;

/// A cut-out picture, and where its subject is.
#[derive(Debug)]
pub struct Subject {
    source: PictureSource,
    /// Columns over rows.
    aspect: f64,
    /// Its least and greatest place in the picture, u to the right and v upwards.
    low: DVec2,
    high: DVec2,
    /// Where it stands, to the right.
    foot: f64,
    /// How much it hides, for shadows: the picture, and what is left of it at a half of its size and so on.
    alphas: Vec<Level>,
    /// Whether the picture is opaque everywhere: its card is a rectangle.
    pub is_opaque: bool,
}

/// How much a level of a picture hides at a place, between its texels; nothing beside it.
fn alpha_of(level: &Level, place: DVec2) -> f32 {
    let (width, height) = (f64::from(level.width), f64::from(level.height));
    let (x, y) = (place.x * width - 0.5, (1.0 - place.y) * height - 0.5);
    let (left, top) = (x.floor(), y.floor());
    let (u, v) = ((x - left) as f32, (y - top) as f32);
    let texel = |i: f64, j: f64| {
        let (x, y) = (left + i, top + j);
        let is_inside = x >= 0.0 && y >= 0.0 && x < width && y < height;
        if is_inside { level.texel(x as u32, y as u32)[3] } else { 0.0 }
    };
    let upper = texel(0.0, 0.0) * (1.0 - u) + texel(1.0, 0.0) * u;
    let lower = texel(0.0, 1.0) * (1.0 - u) + texel(1.0, 1.0) * u;
    upper * (1.0 - v) + lower * v
}

impl Subject {
    /// The subject of a picture: all that is not transparent.
    ///
    /// # Errors
    /// If nothing is in the picture.
    pub fn new(image: &Arc<Image>) -> Result<Subject> {
        let (source, is_opaque) = PictureSource::of(image)?;
        let image = image.whole();
        let (width, height) = image.size;
        let (mut low, mut high) = ((u32::MAX, u32::MAX), (0, 0));
        let there: Vec<f32> = image.pixels().map(|[.., a]| a.max(0.0)).collect();
        for (at, alpha) in there.iter().enumerate() {
            if *alpha > LEAST_ALPHA {
                let (x, y) = (at as u32 % width, at as u32 / width);
                low = (low.0.min(x), low.1.min(y));
                high = (high.0.max(x + 1), high.1.max(y + 1));
            }
        }
        if low.0 == u32::MAX {
            return Err(Error::invalid("nothing is in the picture: it is transparent everywhere"));
        }
        // The middle of the lowest twentieth.
        let first = high.1 - ((high.1 - low.1) / 20).max(1);
        let (mut sum, mut weight) = (0.0, 0.0);
        for y in first..high.1 {
            for x in 0..width {
                let alpha = f64::from(there[(y * width + x) as usize]);
                sum += alpha * (f64::from(x) + 0.5);
                weight += alpha;
            }
        }
        let (w, h) = (f64::from(width), f64::from(height));
        let byte = |alpha: &f32| [0, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8];
        let codes = Codes::Bytes(there.iter().flat_map(byte).collect());
        let coding = Coding::srgb();
        let coded = Coded { size: image.size, layout: Layout::GreyAlpha, codes, coding };
        let alphas = pyramid(Texels::coded(coded), Meaning::Numbers);
        Ok(Subject {
            alphas,
            is_opaque,
            source,
            aspect: w / h,
            low: DVec2::new(f64::from(low.0) / w, 1.0 - f64::from(high.1) / h),
            high: DVec2::new(f64::from(high.0) / w, 1.0 - f64::from(low.1) / h),
            foot: sum / weight / w,
        })
    }

    /// Its middle in the picture: where it turns, half way up.
    fn middle(&self) -> DVec2 {
        DVec2::new(self.foot, (self.low.y + self.high.y) / 2.0)
    }

    /// What a way along a card is in the picture.
    fn step(&self, tree: &Tree, scale: f64, turned: &Turned, way: DVec3) -> DVec2 {
        let sign = if tree.mirrored { -1.0 } else { 1.0 };
        let right = way.dot(turned.right) * sign / (scale * self.aspect);
        DVec2::new(right, way.dot(turned.up) / scale)
    }

    /// Metres to the height of the picture, if the subject is so high.
    fn scale(&self, height: f64) -> f64 {
        height / (self.high.y - self.low.y)
    }
}

/// A subject, placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tree {
    /// The number of its picture.
    pub picture: u32,
    /// Where it stands, in metres.
    pub foot: DVec3,
    /// How high it is, in metres, above 0.
    pub height: f64,
    /// Whether right and left are exchanged.
    pub mirrored: bool,
}

/// How trees are shown.
#[derive(Clone, Debug)]
pub struct BillboardsOptions {
    /// What they are called.
    pub label: String,
    /// What the photographs' colours are multiplied by.
    pub color: Color,
    /// Whether lights light them; else they show the photograph as it is.
    pub lit: bool,
    /// How round they are in the light, in \[0, 1]: at 1 as a crown is, at 0 as flat as their cards.
    pub crown: f32,
    /// How much of the light from behind comes through their leaves, as a share of what these send back.
    pub transmit: Color,
}

#[derive(Debug)]
struct Billboards {
    subjects: Vec<Subject>,
    trees: Vec<Tree>,
    cards: Vec<Card>,
    stand: BillboardsOptions,
    casters: OnceLock<Casters>,
    fault: FirstError,
}

/// The image of trees as a view shows them.
///
/// # Errors
/// If a tree has no picture, or a number is not finite.
pub fn image(
    subjects: Vec<Subject>,
    trees: Vec<Tree>,
    stand: BillboardsOptions,
    view: &View,
    plan: LinePlan,
    rows: Rows,
) -> Result<SpanImage> {
    let mut key = KeyHasher::new("billboards");
    subjects.iter().for_each(|subject| {
        key.key(subject.source.key);
    });
    key.value(&(stand.color, stand.lit, stand.crown, stand.transmit));
    let mut cards = Vec::with_capacity(trees.len());
    for (number, tree) in trees.iter().enumerate() {
        let Some(subject) = subjects.get(tree.picture as usize) else {
            return Err(Error::invalid(format!(
                "tree {number} has picture {}, and there are {}",
                tree.picture,
                subjects.len()
            )));
        };
        let is_sound = tree.foot.is_finite() && tree.height.is_finite() && tree.height > 0.0;
        if !is_sound {
            let (foot, height) = (tree.foot, tree.height);
            return Err(Error::invalid(format!(
                "tree {number} stands at {foot} and is {height} m high: must be finite, and above 0"
            )));
        }
        let scale = subject.scale(tree.height);
        // The wider side counts for both, as a card turns about the foot.
        let side = (subject.foot - subject.low.x).max(subject.high.x - subject.foot);
        let half_width = (side * subject.aspect * scale).max(tree.height * 1e-6);
        cards.push(Card { foot: tree.foot, half_width, height: tree.height });
        key.value(&(tree.picture, tree.foot.to_array(), tree.height, tree.mirrored));
    }
    let key = key.finish();
    let scene =
        Scene::new(&document(&cards, Toward::eye(view))?, None, &stand.label, key, Path::new(""))?;
    let (casters, fault) = (OnceLock::new(), FirstError::default());
    let surfaces = Arc::new(Billboards { subjects, trees, cards, stand, casters, fault });
    let surfaces: Option<Arc<dyn Surfaces>> = Some(surfaces);
    let cluster = Cluster { surfaces, ..Arc::new(scene).into() };
    scanline::render(&[cluster], view, plan, rows)
}

/// The cards as faces that let through what lies behind them.
fn document(cards: &[Card], toward: Toward) -> Result<Document> {
    let mut mesh = Mesh::default();
    for card in cards {
        let outline = card.corners(toward).into_iter().map(|p| mesh.add_point(p)).collect();
        let sides = Sides { front: Some(0), ..Sides::default() };
        mesh.add_face(Face { outline, sides, ..Face::default() })?;
    }
    mesh.materials.push("card".to_owned());
    let root = Object::new("cards", Shape::Faces(mesh));
    let mut document = Document::with_plan(Plan { root, ..Plan::default() });
    // Any alpha below 1 will do: the true one is the picture's.
    let card = Material { alpha: 0.5, alpha_mode: AlphaMode::Blend, ..Material::default() };
    document.materials.insert("card".to_owned(), card);
    Ok(document)
}

impl Billboards {
    /// How the card of a fragment is turned there, and its normal towards who sees it.
    fn turned(&self, fragments: &Fragments<'_>, i: usize) -> (Turned, DVec3) {
        let toward = fragments.seen_from(i, fragments.point(i));
        let turned = self.cards[fragments.ordinal[i] as usize].turned(toward);
        (turned, turned.right.cross(turned.up))
    }

    /// The normal of a fragment: as of a ball that fills the card, as far as the crown is round.
    fn normal(&self, fragments: &Fragments<'_>, i: usize, facing: DVec3) -> DVec3 {
        // Leaves lie all ways: what is seen of them is open to the sky as well.
        let flat = (facing + DVec3::Y).normalize_or(facing);
        let round = f64::from(self.stand.crown);
        if round <= 0.0 {
            return flat;
        }
        let card = &self.cards[fragments.ordinal[i] as usize];
        let (Turned { middle, right, up }, _) = self.turned(fragments, i);
        let way = fragments.point(i) - middle;
        let place = DVec2::new(way.dot(right) / card.half_width, way.dot(up) / card.height * 2.0);
        let place = place.clamp_length_max(1.0);
        let out = (1.0 - place.length_squared()).max(0.0).sqrt();
        let ball = right * place.x + up * place.y + facing * out;
        flat.lerp(ball, round).normalize_or(flat)
    }

    /// What a fragment covers of its picture.
    fn footprint(&self, fragments: &Fragments<'_>, i: usize) -> Footprint {
        let number = fragments.ordinal[i] as usize;
        let (tree, card) = (&self.trees[number], &self.cards[number]);
        let subject = &self.subjects[tree.picture as usize];
        let (turned, normal) = self.turned(fragments, i);
        let position = fragments.point(i);
        let scale = subject.scale(card.height);
        let of = |way: DVec3| subject.step(tree, scale, &turned, way);
        let [right, down] = fragments.footprint(i, position, normal).map(of);
        Footprint { at: subject.middle() + of(position - turned.middle), right, down }
    }
}

impl Surfaces for Billboards {
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>) {
        let mut opened: Vec<Option<Opened<'_>>> = Vec::new();
        opened.resize_with(self.subjects.len(), || None);
        for i in 0..fragments.len() {
            if wanted.contains(Columns::COLOR) {
                let picture = self.trees[fragments.ordinal[i] as usize].picture as usize;
                if opened[picture].is_none() {
                    let found = store().open(&self.subjects[picture].source);
                    opened[picture] = self.fault.sift(found);
                }
                let seen = opened[picture].as_ref().and_then(|picture| {
                    let footprint = self.footprint(fragments, i);
                    let seen = footprint.see(picture, fragments.textures, [Wrap::Nothing; 2]);
                    self.fault.sift(seen)
                });
                let [r, g, b, a, _] = seen.unwrap_or_default();
                let straight = if a > 0.0 { 1.0 / a } else { 0.0 };
                fragments.color.push(Color::new(r, g, b) * straight * self.stand.color);
                fragments.alpha.push(a.clamp(0.0, 1.0));
                fragments.unlit.push(!self.stand.lit);
            }
            if wanted.contains(Columns::FINISH) {
                let transmit = self.stand.transmit;
                fragments.finish.push(Finish { transmit, ..Finish::default() });
            }
            if wanted.meets(Columns::NORMAL | Columns::FACING) {
                let (_, facing) = self.turned(fragments, i);
                if wanted.contains(Columns::FACING) {
                    fragments.facing.push(facing);
                }
                if wanted.contains(Columns::NORMAL) {
                    fragments.normal.push(self.normal(fragments, i, facing).as_vec3());
                }
            }
        }
        debug_assert!(fragments.normal.iter().all(|n: &Vec3| n.is_finite()));
    }

    fn varying(&self, _: u32) -> Columns {
        match self.stand.crown > 0.0 {
            true => Columns::COLOR | Columns::NORMAL,
            false => Columns::COLOR,
        }
    }

    fn object(&self, ordinal: u32) -> String {
        format!("{}/{ordinal}", self.trees[ordinal as usize].picture)
    }

    fn fault(&self) -> Option<Error> {
        self.fault.take()
    }

    fn rays(&self) -> Option<&dyn RayTarget> {
        Some(self)
    }

    fn provenance(&self) -> Option<&dyn Provenance> {
        Some(self)
    }
}

impl RayTarget for Billboards {
    fn casters(&self) -> &Casters {
        let make = || {
            let mut builder = CastersBuilder::default();
            for (number, card) in self.cards.iter().enumerate() {
                builder.card(number as u32, *card);
            }
            builder.finish()
        };
        self.casters.get_or_init(make)
    }

    fn transmits(&self, _: u32) -> bool {
        self.stand.transmit != Color::BLACK
    }

    fn card(&self, ordinal: u32) -> Option<Card> {
        Some(self.cards[ordinal as usize])
    }

    fn alpha_at(&self, met: &Meeting) -> Option<f32> {
        let number = met.ordinal as usize;
        let (tree, card) = (&self.trees[number], &self.cards[number]);
        let subject = &self.subjects[tree.picture as usize];
        let turned = card.turned(Toward::Direction(met.from - met.position));
        let scale = subject.scale(card.height);
        let place =
            subject.middle() + subject.step(tree, scale, &turned, met.position - turned.middle);
        // The level whose texels are as wide as what the way stands for.
        let first = &subject.alphas[0];
        let texels = f64::from(met.width) / scale * f64::from(first.height);
        let level = if texels > 1.0 { math::log2(texels).round() as usize } else { 0 };
        Some(alpha_of(&subject.alphas[level.min(subject.alphas.len() - 1)], place))
    }
}

impl Provenance for Billboards {
    fn names(&self) -> Option<[Vec<String>; 2]> {
        Some([(0..self.trees.len() as u32).map(|at| self.object(at)).collect(), Vec::new()])
    }
}

/// Trees on a polygon on the ground, by chance, always the same for a seed: so many, or as many as find room so
/// far apart.
///
/// # Errors
/// If the polygon has no area, or a number is out of range.
pub fn scatter(
    corners: &[DVec3],
    count: u32,
    apart: f64,
    seed: u64,
    mut plant: impl FnMut(DVec3, &mut Chance),
) -> Result<u32> {
    if !(apart.is_finite() && apart >= 0.0) {
        return Err(Error::invalid(format!("trees {apart} m apart: must be 0 or more")));
    }
    if corners.len() < 3 || !corners.iter().all(|p| p.is_finite()) {
        return Err(Error::invalid("an area has three finite corners or more"));
    }
    let low = corners.iter().fold(DVec3::INFINITY, |low, p| low.min(*p));
    let high = corners.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(*p));
    let size = high - low;
    if size.x <= 0.0 || size.z <= 0.0 {
        return Err(Error::invalid("an area has no width or no depth"));
    }
    let mut chance = Chance::new(seed);
    let cell = |v: f64| (v / apart.max(1e-9)).floor() as i64;
    let mut known: std::collections::HashMap<(i64, i64), Vec<DVec2>> = Default::default();
    let mut planted = 0;
    let mut tries = 0u64;
    // Where there is no room left, it ends all the same.
    while planted < count && tries < 30 * u64::from(count) + 1000 {
        tries += 1;
        let (x, z) = (low.x + size.x * chance.unit(), low.z + size.z * chance.unit());
        let flat = corners.iter().map(|corner| DVec3::new(corner.x, 0.0, corner.z));
        if !polygon::contains(flat, DVec3::Y, DVec3::new(x, 0.0, z)) {
            continue;
        }
        let at = DVec2::new(x, z);
        let (i, j) = (cell(x), cell(z));
        if apart > 0.0 {
            // Cells are as wide as trees are apart: who is too near stands in one of nine.
            let around = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| (i, j)));
            let mut others = around.filter_map(|place| known.get(&place)).flatten();
            if others.any(|other| other.distance(at) < apart) {
                continue;
            }
            known.entry((i, j)).or_default().push(at);
        }
        planted += 1;
        plant(DVec3::new(x, low.y, z), &mut chance);
    }
    Ok(planted)
}

/// Numbers by chance, always the same for a seed.
#[derive(Clone, Debug)]
pub struct Chance(u64);

impl Chance {
    /// The numbers of a seed.
    pub fn new(seed: u64) -> Chance {
        Chance(seed)
    }

    /// The next number, in [0, 1) (SplitMix64).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}
