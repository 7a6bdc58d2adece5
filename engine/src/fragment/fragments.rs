//! Fragments, many at a time.

use glam::{DVec2, DVec3, Vec3};
use std::collections::BTreeMap;
use std::sync::Arc;

use super::surfaces::object_name;
use super::{Columns, Finish, LightLayers, PaintedPart, PictureShare, Surfaces};
use crate::camera::View;
use crate::color::Color;
use crate::key::Key;
use crate::texture::TextureFilter;
use crate::trace::{Card, Toward, Turn};

/// A batch of fragments of one source, as a structure of arrays. A column that nobody asked for is
/// empty; all others have [`len`](Fragments::len) entries.
#[derive(Clone, Debug)]
pub struct Fragments<'v> {
    /// The projection under which they are seen.
    pub view: &'v View,
    /// The face, by its number in the source.
    pub ordinal: Vec<u32>,
    /// Whether the face's front is seen.
    pub sees_front: Vec<bool>,
    /// The fragment's point, in pixels from the left.
    pub x: Vec<f64>,
    /// The fragment's point, in pixels from the top.
    pub y: Vec<f64>,
    /// The depth rho at the point.
    pub depth: Vec<f64>,
    /// The point in the world, in metres ([`Columns::POSITION`]).
    pub position: Vec<DVec3>,
    /// The unit normal in world axes, on the side that is seen ([`Columns::NORMAL`]). Interpolated
    /// where the face carries vertex normals.
    pub normal: Vec<Vec3>,
    /// The unit normal of the face itself, on the side that is seen ([`Columns::FACING`]). Empty if the
    /// surfaces do not say; the [`normal`](Fragments::normal) then serves.
    pub facing: Vec<DVec3>,
    /// The cards that turn to whoever looks ([`Columns::FACING`]). Empty if a face of the source does not.
    pub cards: Vec<Card>,
    /// How the surface answers light ([`Columns::FINISH`]). Surfaces that are matt may leave the column empty.
    pub finish: Vec<Finish>,
    /// Scene-linear colour: the surface's own at first, and what the last shader made of it at the
    /// end ([`Columns::COLOR`]).
    pub color: Vec<Color>,
    /// How much of what lies behind is hidden, in [0, 1] ([`Columns::COLOR`]). Surfaces that hide all of
    /// it may leave the column empty.
    pub alpha: Vec<f32>,
    /// Whether lights leave the surface alone ([`Columns::COLOR`]).
    pub unlit: Vec<bool>,
    /// The parts that the colour is the sum of, if anybody wants to know.
    pub layers: Option<LightLayers>,
    /// The place in the object's own space ([`Columns::LOCAL`]). Empty if the surfaces do not say.
    pub local: Vec<Local>,
    /// Texture coordinates ([`Columns::UV`]). Empty if the surfaces do not say.
    pub uv: Vec<Uv>,
    /// The names of objects, with their source's before them ([`Columns::NAMES`]).
    pub names: Vec<Arc<str>>,
    /// The names of materials ([`Columns::MATERIALS`]).
    pub materials: Vec<Arc<str>>,
    /// What shaders made beside colours, by name: three numbers for each fragment. One that no shader made is not
    /// there, and is 0.
    pub channels: BTreeMap<String, Vec<Color>>,
    /// The bundle of each, where its face is divided into domains; empty if none is. See
    /// [`Pictured::divide`](super::Pictured::divide).
    pub bundle: Vec<Option<u32>>,
    /// What pictures show of each, where that was found before: they need not be read. Empty if nothing was.
    pub shown: Vec<Option<PaintedPart>>,
    /// The name of their source.
    pub label: String,
    /// The contents of the scene: others may have its name.
    pub scene: Key,
    /// From where they are seen, if not by the camera.
    pub sight: Option<Sight>,
    /// A pixel's width and height, in pixels of the raster.
    pub pixel: DVec2,
    /// How pictures on surfaces are filtered.
    pub textures: TextureFilter,
}

/// A place in an object's own space.
#[derive(Clone, Copy, Debug, Default)]
pub struct Local {
    /// The point.
    pub point: DVec3,
    /// Its units to a metre.
    pub scale: f64,
}

/// A place in texture coordinates.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uv {
    /// u and v.
    pub at: DVec2,
    /// Their units to a metre, about.
    pub scale: f64,
}

/// How far away what is behind everything stands, in metres along the view axis: nothing is seen beyond.
pub const FAR: f64 = 1e9;

/// The least cosine between a face's normal and a ray for which footprints grow.
const LEAST_ACROSS: f64 = 1e-3;

/// A place where a ray meets a surface.
#[derive(Clone, Copy, Debug)]
pub struct Meeting {
    /// The face, by its number in the source.
    pub ordinal: u32,
    /// Whether it is met on its front.
    pub sees_front: bool,
    /// Where the ray starts, in metres.
    pub from: DVec3,
    /// Where it meets the face.
    pub position: DVec3,
    /// The width of what the ray stands for there, in metres.
    pub width: f32,
}

/// From where fragments are seen that a ray met.
#[derive(Clone, Debug, Default)]
pub struct Sight {
    /// Where the ray starts, in metres.
    pub from: Vec<DVec3>,
    /// How many surfaces the way from the camera has turned at.
    pub turns: u32,
    /// How many surfaces on that way send light to all sides.
    pub bounced: u32,
    /// How many rays one fragment sent, each of which shows its share of what is seen; 0 says as much as 1.
    pub rays: u32,
    /// How much of what is seen counts in the picture, 1 where it is all.
    pub weight: Vec<Color>,
    /// The way that light goes on from the ray's start to the camera, in metres.
    pub before: Vec<f64>,
    /// The width of what the ray stands for where it meets the surface, in metres.
    pub width: Vec<f32>,
}

impl<'v> Fragments<'v> {
    /// An empty batch under a view.
    pub fn new(view: &'v View) -> Fragments<'v> {
        Fragments {
            view,
            ordinal: Vec::new(),
            sees_front: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            depth: Vec::new(),
            position: Vec::new(),
            normal: Vec::new(),
            facing: Vec::new(),
            cards: Vec::new(),
            finish: Vec::new(),
            color: Vec::new(),
            alpha: Vec::new(),
            unlit: Vec::new(),
            layers: None,
            local: Vec::new(),
            uv: Vec::new(),
            names: Vec::new(),
            materials: Vec::new(),
            channels: BTreeMap::new(),
            bundle: Vec::new(),
            shown: Vec::new(),
            label: String::new(),
            scene: Key::default(),
            sight: None,
            pixel: DVec2::ONE,
            textures: TextureFilter::default(),
        }
    }

    /// A batch of one fragment where a ray meets a surface, which is asked about it.
    pub fn one(view: &'v View, met: &Meeting) -> Fragments<'v> {
        let Meeting { ordinal, sees_front, from, position, width } = *met;
        let mut one = Fragments::new(view);
        one.push(ordinal, sees_front, 0.0, 0.0, 0.0);
        one.position.push(position);
        one.textures = TextureFilter::Trilinear;
        let (from, width, weight, before) =
            (vec![from], vec![width], vec![Color::WHITE], vec![0.0]);
        one.sight = Some(Sight { from, weight, before, width, ..Sight::default() });
        one
    }

    /// How much its surface hides of what is behind it at the first fragment.
    pub(super) fn first_alpha(mut self, surfaces: &dyn Surfaces) -> f32 {
        let parts = surfaces.divide(&self);
        if !parts.is_empty() {
            let mut wide = self.parts(&parts);
            wide.fill(Columns::COLOR, surfaces);
            return parts.iter().zip(&wide.alpha).map(|((.., share), alpha)| share * alpha).sum();
        }
        self.fill(Columns::COLOR, surfaces);
        self.alpha.first().copied().unwrap_or(1.0)
    }

    /// The number of fragments.
    pub fn len(&self) -> usize {
        self.ordinal.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ordinal.is_empty()
    }

    /// How many surfaces send light to all sides on the way from them to the camera.
    pub fn bounced(&self) -> u32 {
        self.sight.as_ref().map_or(0, |sight| sight.bounced)
    }

    /// Adds a fragment at a point in pixels with its depth.
    pub fn push(&mut self, ordinal: u32, sees_front: bool, x: f64, y: f64, depth: f64) {
        self.ordinal.push(ordinal);
        self.sees_front.push(sees_front);
        self.x.push(x);
        self.y.push(y);
        self.depth.push(depth);
    }

    /// The unit vector from a fragment to where it is seen from.
    pub fn to_eye(&self, i: usize) -> DVec3 {
        self.to_eye_from(i, self.point(i))
    }

    /// The point of a fragment in the world, in metres, whether or not the column is filled.
    pub fn point(&self, i: usize) -> DVec3 {
        let place = || self.view.world_point(self.x[i], self.y[i], self.depth[i]);
        self.position.get(i).copied().unwrap_or_else(place)
    }

    /// The unit vector from a point on a fragment to where it is seen from.
    pub fn to_eye_from(&self, i: usize, point: DVec3) -> DVec3 {
        match &self.sight {
            Some(sight) => (sight.from[i] - point).normalize_or_zero(),
            None if self.view.is_parallel() => self.view.world_direction(DVec3::Z),
            None => (self.view.camera().position - point).normalize_or_zero(),
        }
    }

    /// From where a fragment at a point is seen, as cards turn to it.
    pub fn seen_from(&self, i: usize, point: DVec3) -> Toward {
        match &self.sight {
            // As the ray met the card: rays turn cards to where they come from, all in one
            // direction.
            Some(sight) => Toward::Direction(sight.from[i] - point),
            None => Toward::eye(self.view),
        }
    }

    /// What becomes of a fragment's card in the light from somewhere, if it is on one.
    pub fn turn(&self, i: usize, light: Toward) -> Option<Turn> {
        let card = self.cards.get(i)?;
        Some(card.turn(self.seen_from(i, self.point(i)), light))
    }

    /// The way on which a fragment is seen: where it starts, its direction, and its length. Parallel rays
    /// start in the plane of the camera.
    pub fn way(&self, i: usize) -> (DVec3, DVec3, f64) {
        if let Some(sight) = &self.sight {
            let way = self.position[i] - sight.from[i];
            return (sight.from[i], way.normalize_or_zero(), way.length());
        }
        let eye = self.view.camera().position;
        let seen = self.view.eye_point(self.x[i], self.y[i], self.depth[i]);
        if self.view.is_parallel() {
            let start = DVec3::new(seen.x, seen.y, 0.0);
            let along = self.view.world_direction(DVec3::NEG_Z);
            return (
                eye + self.view.world_direction(start),
                along,
                self.view.distance(self.depth[i]),
            );
        }
        (eye, self.view.world_direction(seen).normalize_or_zero(), seen.length())
    }

    /// The width across the line of sight of what a fragment stands for, in metres.
    pub fn width(&self, i: usize) -> f64 {
        match &self.sight {
            Some(sight) => f64::from(sight.width[i]),
            None => self.view.pixel_width(self.view.distance(self.depth[i])).0 * self.pixel.x,
        }
    }

    /// By how much the place of a fragment moves along its face, given by its unit normal, from one pixel to the
    /// next on the right and below: its footprint, in metres.
    pub fn footprint(&self, i: usize, position: DVec3, normal: DVec3) -> [DVec3; 2] {
        let view = self.view;
        let (steps, along) = match &self.sight {
            Some(sight) => {
                let along = (position - sight.from[i]).normalize_or(-normal);
                // A ray has no right and no down: any two directions across it serve.
                let (u, v) = along.any_orthonormal_pair();
                ([u, v].map(|side| side * f64::from(sight.width[i])), along)
            }
            None => {
                let width = view.pixel_width(view.distance(self.depth[i])).0;
                let right = view.world_direction(DVec3::X) * (width * self.pixel.x);
                let down = view.world_direction(DVec3::NEG_Y) * (width * self.pixel.y);
                ([right, down], -self.to_eye_from(i, position))
            }
        };
        let across = normal.dot(along);
        // Seen edge-on it would reach to the horizon.
        let across =
            if across.abs() < LEAST_ACROSS { LEAST_ACROSS.copysign(across) } else { across };
        // A step across the way, led along it until it lies in the plane of the face.
        steps.map(|step| step - along * (normal.dot(step) / across))
    }

    /// A batch of parts of these, before any column is filled but positions.
    pub(crate) fn parts(&self, parts: &[PictureShare]) -> Fragments<'v> {
        fn of<T: Clone>(column: &[T], parts: &[PictureShare]) -> Vec<T> {
            if column.is_empty() {
                return Vec::new();
            }
            parts.iter().map(|(at, ..)| column[*at].clone()).collect()
        }
        let sight = self.sight.as_ref().map(|sight| Sight {
            from: of(&sight.from, parts),
            turns: sight.turns,
            bounced: sight.bounced,
            rays: sight.rays,
            weight: of(&sight.weight, parts),
            before: of(&sight.before, parts),
            width: of(&sight.width, parts),
        });
        Fragments {
            ordinal: of(&self.ordinal, parts),
            sees_front: of(&self.sees_front, parts),
            x: of(&self.x, parts),
            y: of(&self.y, parts),
            depth: of(&self.depth, parts),
            position: of(&self.position, parts),
            bundle: parts.iter().map(|(_, bundle, _)| *bundle).collect(),
            layers: self.layers.as_ref().map(|_| LightLayers::default()),
            label: self.label.clone(),
            scene: self.scene,
            sight,
            pixel: self.pixel,
            textures: self.textures,
            ..Fragments::new(self.view)
        }
    }

    /// Takes colour, alpha and layers of parts, each by its share.
    pub(crate) fn unite(&mut self, of: &Fragments<'_>, parts: &[PictureShare]) {
        let count = self.len();
        let mut alpha = vec![0.0f32; count];
        for (part, (at, _, share)) in parts.iter().enumerate() {
            alpha[*at] += of.alpha[part] * share;
        }
        let sums = |colors: &[Color]| {
            let mut sums = vec![Color::BLACK; count];
            for (part, (at, _, share)) in parts.iter().enumerate() {
                if alpha[*at] > 0.0 {
                    // Colours come without alpha here. Weighed by area alone, what is transparent
                    // would tint the rest.
                    let weight = of.alpha[part] * share / alpha[*at];
                    sums[*at] = sums[*at] + colors[part] * weight;
                }
            }
            sums
        };
        self.color = sums(&of.color);
        let channels = of.channels.iter();
        self.channels = channels.map(|(name, values)| (name.clone(), sums(values))).collect();
        if let (Some(own), Some(layers)) = (&mut self.layers, &of.layers) {
            own.clear();
            for (name, colors) in layers.iter() {
                own.layer(name, count).copy_from_slice(&sums(colors));
            }
        }
        self.alpha = alpha;
    }

    /// Takes the fragments to other points, given as x, y and depth; positions follow.
    pub(crate) fn go_to(&mut self, [x, y, depth]: [Vec<f64>; 3]) {
        (self.x, self.y, self.depth) = (x, y, depth);
        if !self.position.is_empty() {
            self.place();
        }
    }

    /// Computes the positions.
    fn place(&mut self) {
        let points = self.x.iter().zip(&self.y).zip(&self.depth);
        self.position =
            points.map(|((&x, &y), &depth)| self.view.world_point(x, y, depth)).collect();
    }

    /// Computes the columns `wanted`: positions here, the rest by the source's surfaces.
    pub fn fill(&mut self, wanted: Columns, surfaces: &dyn Surfaces) {
        if wanted.meets(Columns::POSITION | Columns::TRACED) && self.position.is_empty() {
            self.place();
        }
        surfaces.fill(wanted, self);
        if wanted.contains(Columns::COLOR) {
            self.alpha.resize(self.len(), 1.0);
        }
        if wanted.contains(Columns::FACING) {
            // All or none: a column is as long as the batch.
            let cards: Option<Vec<Card>> =
                self.ordinal.iter().map(|ordinal| surfaces.card(*ordinal)).collect();
            self.cards = cards.unwrap_or_default();
        }
        if wanted.contains(Columns::NAMES) {
            let ordinals = self.ordinal.iter().copied();
            self.names =
                named(ordinals, |at| object_name(&self.label, &surfaces.object(at)).into());
        }
        if wanted.contains(Columns::MATERIALS) {
            let bundle = |i: usize| self.bundle.get(i).copied().flatten();
            let sides = (0..self.len()).map(|i| (self.ordinal[i], self.sees_front[i], bundle(i)));
            self.materials =
                named(sides, |(at, front, bundle)| surfaces.material(at, front, bundle).into());
        }
        if wanted.contains(Columns::FINISH) {
            self.finish.resize(self.len(), Finish::default());
        }
        if let Some(layers) = &mut self.layers {
            layers.layer(LightLayers::REST, self.color.len()).copy_from_slice(&self.color);
        }
    }
}

/// The names of things; those that are alike stand together.
fn named<T: PartialEq + Copy>(
    things: impl Iterator<Item = T>,
    name: impl Fn(T) -> Arc<str>,
) -> Vec<Arc<str>> {
    let mut last: Option<(T, Arc<str>)> = None;
    let one = |thing| {
        let known = last.take().filter(|(known, _)| *known == thing);
        let (_, name) = known.unwrap_or_else(|| (thing, name(thing)));
        last.insert((thing, name)).1.clone()
    };
    things.map(one).collect()
}
