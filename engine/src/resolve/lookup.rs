//! Display by a look-up table (\[D], "System overview of RSP", displays with a color lookup table; "Near-real-time
//! display").
//!
//! Each pixel is a number of the table. Each attribute (the material of a face or seal, or the edges drawn with it) owns a
//! part of the table: its colour from dark to bright, in equal steps on the screen. So a change of its colour changes
//! table entries only, [`Display::set_color`]: no face is looked at, and no pixel.

use glam::DVec3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::Arc;

use crate::camera::View;
use crate::color::{Color, decode_srgb, encode_srgb};
use crate::error::{Error, Result};
use crate::fragment::{Anywhere, Columns, Fragments};
use crate::image::{Coded, Codes, Coding, Image, Layout, Samples, Window};
use crate::span::{FaceId, Seen, SpanImage};
use crate::text::nearest;
use crate::watch::Watch;

/// The entries of a table.
const ENTRIES: usize = 256;

/// The most entries that a part has if nobody says how many.
const MOST: usize = 64;

/// Rows that are looked at together.
const ROWS: u32 = 16;

/// What makes faces bright.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Brightness {
    /// A light at the eye: the cosine between the normal and the way to the eye.
    #[default]
    Head,
    /// What the image's shaders make of a face, beside its own colour.
    Shaded,
}

/// A part of the table.
#[derive(Clone, Debug, PartialEq)]
pub struct TablePart {
    /// The material's name, or the object's where it has none.
    pub name: String,
    /// The scene.
    pub scene: String,
    /// Whether it is of drawn edges.
    pub is_edge: bool,
    /// The number of its first entry.
    pub first: usize,
    /// How many entries it has.
    pub entries: usize,
    /// Its colour where it is brightest.
    pub color: Color,
}

/// A picture as numbers of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Display {
    size: (u32, u32),
    numbers: Vec<u8>,
    table: Vec<[u8; 4]>,
    parts: Vec<TablePart>,
}

/// What is seen in a pixel.
#[derive(Clone, Copy)]
struct Spot {
    /// The number of its part.
    part: u32,
    /// How bright it is as coded for the screen, in [0, 1].
    level: f32,
    color: Color,
}

/// An attribute, and whether lights change it.
#[derive(Clone)]
struct Attribute {
    name: String,
    scene: String,
    is_edge: bool,
    is_lit: bool,
}

impl Display {
    /// What is seen in the middle of each pixel of an image's raster, on the line that is nearest to it, with `entries`
    /// to each attribute or, if that is not said, as many as there is room for, up to 64. Entry 0 is for what nothing
    /// covers. What is translucent is left out.
    ///
    /// # Errors
    /// If there are more attributes than entries, or not all rows of the image are there.
    pub fn new(image: &SpanImage, by: Brightness, entries: Option<u32>) -> Result<Display> {
        let raster = image.view().raster();
        if image.rows() != (0..raster.height) {
            return Err(Error::invalid("a display needs all rows of the image"));
        }
        let (attributes, faces) = attributes(image, by);
        let (count, room) = (attributes.len(), ENTRIES - 1);
        let each = entries.map_or(MOST.min(room / count.max(1)), |entries| entries as usize);
        let wanted: usize = attributes.iter().map(|a| if a.is_lit { each } else { 1 }).sum();
        if count > room || wanted > room || each == 0 {
            return Err(Error::invalid(format!(
                "{count} attributes with {each} entries each: a table has {room}, beside that of the background; \
                 give fewer `entries`, or display fewer materials"
            )));
        }
        let watch = Watch::current();
        let bands = raster.height.div_ceil(ROWS);
        let spots: Vec<Vec<Option<Spot>>> = (0..bands)
            .into_par_iter()
            .map(|band| {
                watch.check()?;
                let rows = band * ROWS..raster.height.min((band + 1) * ROWS);
                Ok(spots(image, rows, by, &faces))
            })
            .collect::<Result<_>>()?;
        let spots = || spots.iter().flatten();
        let colors = mean_colors(spots().flatten(), count);
        let mut parts = Vec::with_capacity(count);
        let mut first = 1;
        for (Attribute { name, scene, is_edge, is_lit }, color) in
            attributes.into_iter().zip(colors)
        {
            let entries = if is_lit { each } else { 1 };
            parts.push(TablePart { name, scene, is_edge, first, entries, color });
            first += entries;
        }
        let number = |spot: &Option<Spot>| {
            spot.map_or(0, |spot| {
                let part = &parts[spot.part as usize];
                let step = (spot.level * part.entries as f32) as usize;
                (part.first + step.min(part.entries - 1)) as u8
            })
        };
        let numbers = spots().map(number).collect();
        let mut table = vec![[0; 4]];
        parts.iter().for_each(|part| table.extend(part.ramp()));
        Ok(Display { size: (raster.width, raster.height), numbers, table, parts })
    }

    /// The parts of the table.
    pub fn parts(&self) -> &[TablePart] {
        &self.parts
    }

    /// The table: red, green, blue and alpha of each entry, as the screen has them.
    pub fn table(&self) -> &[[u8; 4]] {
        &self.table
    }

    /// The number of each pixel's entry, row by row from the top.
    pub fn numbers(&self) -> &[u8] {
        &self.numbers
    }

    /// Gives another colour to a material wherever it is, but for its drawn edges: entries of the table change, and
    /// nothing else.
    ///
    /// # Errors
    /// If no part has this name; the names that there are.
    pub fn set_color(&mut self, name: &str, color: Color) -> Result<()> {
        let mut is_there = false;
        for part in self.parts.iter_mut().filter(|part| part.name == name && !part.is_edge) {
            part.color = color;
            self.table[part.first..part.first + part.entries].copy_from_slice(&part.ramp());
            is_there = true;
        }
        if is_there {
            return Ok(());
        }
        let faces = || self.parts.iter().filter(|part| !part.is_edge);
        let names = || faces().map(|part| part.name.as_str());
        let near = nearest(name, names());
        let cure = near.map_or_else(
            || {
                let all: Vec<String> = names().map(|name| format!("\"{name}\"")).collect();
                format!("there are {}", all.join(", "))
            },
            |near| format!("did you mean \"{near}\"?"),
        );
        Err(Error::invalid(format!("no attribute \"{name}\" is displayed: {cure}")))
    }

    /// The picture, whose pixels are numbers of its colours: written as PNG it stays so.
    ///
    /// # Errors
    /// None.
    pub fn picture(&self) -> Result<Image> {
        let (width, height) = self.size;
        let coded = Arc::new(Coded {
            size: self.size,
            layout: Layout::Palette(self.table.clone()),
            codes: Codes::Bytes(self.numbers.clone()),
            coding: Coding::srgb(),
        });
        let mut image = Image::new(self.size, Window::whole(width, height));
        for (channel, name) in ["R", "G", "B", "A"].into_iter().enumerate() {
            image.insert(name, Samples::of_coded(&coded, channel))?;
        }
        Ok(image)
    }
}

impl TablePart {
    /// Its entries: its colour in equal steps on the screen, each the middle of its step.
    fn ramp(&self) -> Vec<[u8; 4]> {
        let entry = |step: usize| {
            let level = match self.entries {
                1 => 1.0,
                entries => decode_srgb((step as f32 + 0.5) / entries as f32),
            };
            let [r, g, b] =
                self.color.to_array().map(|v| (encode_srgb(v * level) * 255.0).round() as u8);
            [r, g, b, 255]
        };
        (0..self.entries).map(entry).collect()
    }
}

/// What is known of a face before pixels are looked at.
#[derive(Clone, Copy)]
struct Known {
    /// The number of its attribute.
    part: u32,
    /// Its colour and its normal under a light at the eye, if they are the same all over.
    alike: Option<(Color, DVec3)>,
}

/// The attributes of what is seen, in the order of faces, and what is known of each face that is displayed.
fn attributes(image: &SpanImage, by: Brightness) -> (Vec<Attribute>, Vec<Option<Known>>) {
    let mut seen = Seen::new(image.face_count());
    seen.add(image);
    let mut numbers: HashMap<(usize, String, bool), u32> = HashMap::new();
    let mut attributes = Vec::new();
    let mut faces = vec![None; image.face_count()];
    let raster = image.view().raster();
    // Of each source the faces that are alike all over, each at one place.
    let mut alike: Vec<(Fragments<'_>, Vec<FaceId>)> =
        image.sources().iter().map(|_| (Fragments::new(image.view()), Vec::new())).collect();
    for (id, line, cell) in seen.faces() {
        let (at, _) = image.locate(id);
        let (source, face) = image.face(id);
        if face.is_translucent {
            continue;
        }
        let surfaces = &source.surfaces;
        let part = surfaces.provenance().and_then(|provenance| provenance.part(face.ordinal));
        let is_edge = part.is_some_and(|part| part.is_edge);
        let mut name = surfaces.material(face.ordinal, face.sees_front, None);
        if name.is_empty() {
            name = surfaces.object(face.ordinal);
        }
        let number = *numbers.entry((at, name.clone(), is_edge)).or_insert_with(|| {
            let mut one = Fragments::new(image.view());
            one.push(face.ordinal, face.sees_front, 0.0, 0.0, face.plane.depth(0.0, 0.0));
            source.fill(Columns::COLOR, &mut one);
            let unlit = one.unlit.first().is_some_and(|unlit| *unlit);
            let is_lit = by == Brightness::Shaded || !(unlit || is_edge);
            attributes.push(Attribute { name, scene: source.label.clone(), is_edge, is_lit });
            attributes.len() as u32 - 1
        });
        faces[id.0 as usize] = Some(Known { part: number, alike: None });
        let differs = surfaces.varying(face.ordinal).meets(Columns::COLOR | Columns::NORMAL);
        if by == Brightness::Head && !differs {
            let (x, y) = (raster.pixels(cell), image.plan().y(line));
            let (fragments, ids) = &mut alike[at];
            fragments.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
            ids.push(id);
        }
    }
    for (source, (mut fragments, ids)) in image.sources().iter().zip(alike) {
        if ids.is_empty() {
            continue;
        }
        source.fill(Columns::COLOR | Columns::NORMAL, &mut fragments);
        for (i, id) in ids.into_iter().enumerate() {
            let found = (fragments.color[i], fragments.normal[i].as_dvec3());
            if let Some(known) = &mut faces[id.0 as usize] {
                known.alike = Some(found);
            }
        }
    }
    (attributes, faces)
}

/// The unit vector from what is seen at (x, y) pixels to the eye.
fn to_eye(view: &View, x: f64, y: f64) -> DVec3 {
    if view.is_parallel() {
        view.world_direction(DVec3::Z)
    } else {
        -view.world_direction(view.eye_point(x, y, 1.0)).normalize()
    }
}

/// What is seen in the middle of the pixels of some rows.
fn spots(
    image: &SpanImage,
    rows: std::ops::Range<u32>,
    by: Brightness,
    faces: &[Option<Known>],
) -> Vec<Option<Spot>> {
    let (raster, plan) = (image.view().raster(), image.plan());
    let mut found = vec![None; rows.len() * raster.width as usize];
    // A shader is given fragments of one source.
    let mut batches: HashMap<usize, (Fragments<'_>, Vec<(usize, u32)>)> = HashMap::new();
    for row in rows.clone() {
        let middle = f64::from(row) + 0.5;
        let off = |line: &u32| (plan.y(*line) - middle).abs();
        let lines = plan.lines(&(row..row + 1));
        let Some(line) = lines.min_by(|a, b| off(a).total_cmp(&off(b))) else { continue };
        let spans = image.lines().line(line);
        let mut at = 0;
        for column in 0..raster.width {
            let x = f64::from(column) + 0.5;
            let cell = raster.cell(x);
            while spans.get(at + 1).is_some_and(|next| next.x <= cell) {
                at += 1;
            }
            let face = spans[at].face;
            let known = if face.is_some() { faces[face.0 as usize] } else { None };
            let Some(Known { part, alike }) = known else { continue };
            let place = (row - rows.start) as usize * raster.width as usize + column as usize;
            let y = plan.y(line);
            if let Some((color, normal)) = alike {
                let bright = normal.dot(to_eye(image.view(), x, y)).abs() as f32;
                found[place] = Some(Spot { part, level: encode_srgb(bright.min(1.0)), color });
                continue;
            }
            let batch = batches.entry(image.locate(face).0);
            let (fragments, places) =
                batch.or_insert_with(|| (Fragments::new(image.view()), Vec::new()));
            let (_, known) = image.face(face);
            fragments.push(known.ordinal, known.sees_front, x, y, known.plane.depth(x, y));
            places.push((place, part));
        }
    }
    for (at, (mut fragments, places)) in batches {
        let source = &image.sources()[at];
        source.fill(Columns::COLOR | Columns::NORMAL | Columns::POSITION, &mut fragments);
        let colors = fragments.color.clone();
        let bright: Vec<f32> = match by {
            Brightness::Head => { 0..places.len() }
                .map(|i| fragments.normal[i].as_dvec3().dot(fragments.to_eye(i)).abs() as f32)
                .collect(),
            Brightness::Shaded => {
                source.shade(&mut fragments, &Anywhere);
                let own = colors.iter().zip(&fragments.color);
                own.map(|(own, shaded)| shaded.luminance() / own.luminance().max(1e-9)).collect()
            }
        };
        for (((place, part), color), bright) in places.into_iter().zip(colors).zip(bright) {
            let level = if bright.is_finite() { encode_srgb(bright.clamp(0.0, 1.0)) } else { 1.0 };
            found[place] = Some(Spot { part, level, color });
        }
    }
    found
}

/// The colour of each part: what all its pixels have, or their mean.
fn mean_colors<'s>(spots: impl Iterator<Item = &'s Spot>, count: usize) -> Vec<Color> {
    let mut sums = vec![(None, true, [0.0f64; 3], 0u64); count];
    for spot in spots {
        let (first, are_same, sum, pixels) = &mut sums[spot.part as usize];
        *are_same &= *first.get_or_insert(spot.color) == spot.color;
        for (sum, value) in sum.iter_mut().zip(spot.color.to_array()) {
            *sum += f64::from(value);
        }
        *pixels += 1;
    }
    let color = |(first, are_same, sum, pixels): (Option<Color>, bool, [f64; 3], u64)| match first {
        Some(color) if are_same => color,
        _ => {
            let [r, g, b] = sum.map(|sum| (sum / pixels.max(1) as f64) as f32);
            Color { r, g, b }
        }
    };
    sums.into_iter().map(color).collect()
}
