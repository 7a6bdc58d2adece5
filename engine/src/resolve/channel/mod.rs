//! How the channels of a picture are made: one file each.
//!
//! A channel says what it [needs](Needs), which values it has for each pixel, and how it takes what passes:
//! fragments with the share that they have of their pixel, the face that covers most of it, and how far its
//! coverage may be off. What comes for all channels alike, gathering, shading and blending, is the
//! [painter](super::paint)'s.

mod color;
mod doubt;
mod id;
mod light;
mod made;
mod normal;
mod position;
mod z;

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::{BitOr, Range};

use crate::fragment::{Columns, Fragments};
use crate::image::{Channel, Samples};
use crate::key::Key;
use crate::span::image::Paint;
use crate::span::{FaceId, SpanImage};

/// What channels are made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize)]
pub(super) struct Needs {
    /// Fragments, shaded.
    pub(super) shaded: bool,
    /// Of shaded fragments, what comes from which light.
    pub(super) lights: bool,
    /// Something that only fragments have, and not faces that are shaded alike all over.
    pub(super) fragments: bool,
    /// The face that covers most of each pixel.
    pub(super) most: bool,
    /// Normals of that face.
    pub(super) normals: bool,
    /// How far coverage may be off.
    pub(super) estimates: bool,
}

impl BitOr for Needs {
    type Output = Needs;

    fn bitor(self, other: Needs) -> Needs {
        Needs {
            shaded: self.shaded | other.shaded,
            lights: self.lights | other.lights,
            fragments: self.fragments | other.fragments,
            most: self.most | other.most,
            normals: self.normals | other.normals,
            estimates: self.estimates | other.estimates,
        }
    }
}

/// A channel, or one of a group, that is being made. What it is not told of it does not need.
pub(super) trait Maker: Send + Sync {
    /// What it is made of.
    fn needs(&self) -> Needs;

    /// The names of its values, and the samples that they are kept in, one for each of so many pixels.
    fn values(&self, pixels: usize) -> Vec<(String, Samples)>;

    /// Takes a fragment that has a share of a pixel, already weighted by its alpha.
    fn fragment(
        &self,
        _to: &mut Values<'_>,
        _pixel: usize,
        _fragments: &Fragments<'_>,
        _i: usize,
        _weight: f32,
    ) {
    }

    /// Takes a batch of fragments with their pixels and the shares that they cover.
    fn batch(&self, to: &mut Values<'_>, pixels: &[(u32, f32)], fragments: &Fragments<'_>) {
        for (i, (pixel, area)) in pixels.iter().enumerate() {
            self.fragment(to, *pixel as usize, fragments, i, area * fragments.alpha[i]);
        }
    }

    /// Takes a run of pixels of which a face that is shaded alike all over covers a share.
    fn alike(&self, _to: &mut Values<'_>, _pixels: Range<usize>, _paint: Paint, _area: f32) {}

    /// Takes the faces that cover most of the pixels.
    fn most(&self, _to: &mut Values<'_>, _most: &mut Most<'_>) {}

    /// Takes by how much coverage may be off.
    fn estimates(&self, _to: &mut Values<'_>, _errors: &[f32]) {}
}

/// The values of a channel over a run of rows, zero at first.
#[derive(Default)]
pub(super) struct Values<'p> {
    pub(super) floats: Vec<&'p mut [f32]>,
    pub(super) ids: Vec<&'p mut [u32]>,
}

impl Values<'_> {
    /// Zero already, but written: a fresh page that is read before it is written costs a fault more and, with
    /// several threads, an interrupt of all processors. Measured: half of the time.
    pub(super) fn clear(&mut self) {
        self.floats.iter_mut().for_each(|values| values.fill(0.0));
    }
}

/// A point on a face.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) face: FaceId,
    pub(super) x: f64,
    pub(super) y: f64,
}

/// The faces that cover most of the pixels of a run of rows.
pub(super) struct Most<'a> {
    pub(super) image: &'a SpanImage,
    /// The pixels in which there is one.
    pub(super) nearest: Vec<Nearest>,
    /// The others.
    pub(super) empty: Vec<usize>,
    /// Ids of objects by source and ordinal.
    objects: &'a mut HashMap<(usize, u32), u32>,
    /// What ids mean.
    pub(super) names: BTreeMap<u32, String>,
}

/// Where the face that covers most of a pixel is shaded.
pub(super) struct Nearest {
    pub(super) pixel: usize,
    pub(super) source: usize,
    pub(super) ordinal: u32,
    pub(super) sees_front: bool,
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) depth: f64,
}

impl<'a> Most<'a> {
    /// Of an image, from the points of each pixel.
    pub(super) fn of(
        image: &'a SpanImage,
        points: impl Iterator<Item = Point>,
        objects: &'a mut HashMap<(usize, u32), u32>,
    ) -> Most<'a> {
        let mut most =
            Most { image, nearest: Vec::new(), empty: Vec::new(), objects, names: BTreeMap::new() };
        for (pixel, Point { face, x, y }) in points.enumerate() {
            if !face.is_some() {
                most.empty.push(pixel);
                continue;
            }
            let (source, place) = image.locate(face);
            let face = &image.sources()[source].faces.faces()[place];
            let (ordinal, sees_front) = (face.ordinal, face.sees_front);
            let depth = face.plane.depth(x, y);
            most.nearest.push(Nearest { pixel, source, ordinal, sees_front, x, y, depth });
        }
        most
    }

    /// The id of the object that a face belongs to: a hash of its name, the same in every frame.
    fn object(&mut self, source: usize, ordinal: u32) -> u32 {
        let known = &self.image.sources()[source];
        let named = || Key::id_of_name(&known.object(ordinal));
        let id = *self.objects.entry((source, ordinal)).or_insert_with(named);
        self.names.entry(id).or_insert_with(|| known.object(ordinal));
        id
    }
}

/// The makers of channels of an image's picture.
pub(super) fn makers(image: &SpanImage, channels: &BTreeSet<Channel>) -> Vec<Box<dyn Maker>> {
    let mut names = Names::default();
    let mut makers: Vec<Box<dyn Maker>> = Vec::new();
    // It is called so whatever lights are called.
    if channels.contains(&Channel::LightError) {
        makers.push(Box::new(light::error(&mut names)));
    }
    for channel in channels {
        match channel {
            Channel::Color => makers.push(Box::new(color::Colors)),
            Channel::Z => makers.push(Box::new(z::Distances)),
            Channel::N => makers.push(Box::new(normal::Normals)),
            Channel::P => makers.push(Box::new(position::Positions)),
            Channel::Id => makers.push(Box::new(id::Ids)),
            Channel::Light => {
                let lights = light::of(image, &mut names);
                makers.extend(lights.into_iter().map(|light| Box::new(light) as Box<dyn Maker>));
            }
            Channel::Made => {
                let made = made::of(image, &mut names);
                makers.extend(made.into_iter().map(|made| Box::new(made) as Box<dyn Maker>));
            }
            Channel::Error => makers.push(Box::new(doubt::Estimates)),
            // One was made before, the other only pictures that were read have.
            Channel::LightError | Channel::Others => {}
        }
    }
    makers
}

/// The columns that must be had of sources whose faces are all known, for channels to be made.
pub(super) fn columns(needs: Needs, reads: Columns) -> Columns {
    let shading = if needs.shaded { reads } else { Columns::NONE };
    let normals = if needs.normals { Columns::NORMAL } else { Columns::NONE };
    shading | normals
}

/// Names of layers as compositors take them: letters, digits and `_`, no two alike.
#[derive(Default)]
struct Names(Vec<String>);

impl Names {
    /// A name that no other has: the given one, or with a number behind it.
    fn unique(&mut self, name: &str) -> String {
        let numbered = |n: usize| if n == 1 { name.to_owned() } else { format!("{name}_{n}") };
        let free = (1..).map(numbered).find(|name| !self.0.contains(name)).unwrap_or_default();
        self.0.push(free.clone());
        free
    }
}

/// Three float values by names behind a layer's.
fn three(layer: &str, axes: [&str; 3], pixels: usize) -> Vec<(String, Samples)> {
    let dot = if layer.is_empty() { "" } else { "." };
    let one = |axis| (format!("{layer}{dot}{axis}"), Samples::Float(vec![0.0; pixels]));
    axes.map(one).into()
}
