//! Shading as a stream of fragments.
//!
//! After visibility nothing touches pixels. A *fragment* is a visible face in a pixel (or, where its
//! shading is the same all over, a face): a point on it and the pixel's share that it covers. Programs
//! run over batches of fragments, as Perlin's Pixel Stream Editor ran over stored pixels. Two traits
//! say who does what:
//!
//! - [`Surfaces`]: what a source knows of its own faces: colour, normal and the rest.
//! - [`Shader`]: a program of the shading stack, which reads columns and changes them.
//!
//! Both declare the columns that they touch, and only those are computed: a picture without lights
//! computes no normal.

mod columns;

pub use columns::Columns;

use glam::{DVec3, Vec3};
use std::any::Any;
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

use crate::camera::View;
use crate::color::Color;
use crate::error::Result;
use crate::key::Key;

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
    /// Scene-linear colour: the surface's own at first, and what the last shader made of it at the
    /// end ([`Columns::COLOR`]).
    pub color: Vec<Color>,
    /// How much of what lies behind is hidden, in [0, 1] ([`Columns::COLOR`]). Surfaces that hide all of
    /// it may leave the column empty.
    pub alpha: Vec<f32>,
    /// Whether lights leave the surface alone ([`Columns::COLOR`]).
    pub unlit: Vec<bool>,
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
            color: Vec::new(),
            alpha: Vec::new(),
            unlit: Vec::new(),
        }
    }

    /// The number of fragments.
    pub fn len(&self) -> usize {
        self.ordinal.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.ordinal.is_empty()
    }

    /// Adds a fragment at a point in pixels with its depth.
    pub fn push(&mut self, ordinal: u32, sees_front: bool, x: f64, y: f64, depth: f64) {
        self.ordinal.push(ordinal);
        self.sees_front.push(sees_front);
        self.x.push(x);
        self.y.push(y);
        self.depth.push(depth);
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
        if wanted.contains(Columns::POSITION) && self.position.is_empty() {
            self.place();
        }
        surfaces.fill(wanted, self);
        if wanted.contains(Columns::COLOR) {
            self.alpha.resize(self.len(), 1.0);
        }
    }
}

/// What a source knows of its faces beyond their geometry on the screen.
pub trait Surfaces: Any + Send + Sync + Debug {
    /// Fills the columns `wanted` (of colour and normal) of a batch of this source's fragments.
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>);

    /// The columns that differ from place to place on a face. Position and depth always do and need
    /// not be named; an unsmoothed face of one colour has none.
    fn varying(&self, ordinal: u32) -> Columns;

    /// The name of the object that a face belongs to, as a path such as `"car/wheel 2"`.
    fn object(&self, ordinal: u32) -> String;

    /// Whether it can fill the columns `wanted`; all can, unless their scene is not there.
    ///
    /// # Errors
    /// If it cannot: what is missing.
    fn offers(&self, _wanted: Columns) -> Result<()> {
        Ok(())
    }

    /// Surfaces that know the faces of both, where neither knows all faces of their scene.
    fn united(&self, _other: &dyn Surfaces) -> Option<Arc<dyn Surfaces>> {
        None
    }

    /// Where it comes from, for files that hold images of it.
    fn origin(&self) -> Option<Origin> {
        None
    }
}

/// Where a source's surfaces come from.
#[derive(Clone, Debug)]
pub struct Origin {
    /// The file.
    pub file: PathBuf,
    /// How it was read, in the words of its reader.
    pub how: serde_json::Value,
    /// Its contents then.
    pub key: Key,
    /// The contents themselves, if they came with the image.
    pub contents: Option<Arc<[u8]>>,
}

/// A program over fragments: one entry of a source's shading stack.
///
/// A shader is what it is saved as: two that are saved alike shade alike, and a span file holds it in this
/// form, under the name of its type. One that holds large data is saved as where to find it.
#[typetag::serde]
pub trait Shader: Send + Sync + Debug {
    /// The columns that it reads.
    fn reads(&self) -> Columns;

    /// Changes the fragments' columns. Every column in [`reads`](Shader::reads), and the colour, is
    /// filled.
    fn shade(&self, fragments: &mut Fragments<'_>);
}
