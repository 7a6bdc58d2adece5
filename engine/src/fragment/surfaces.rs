//! What a source knows of its own faces.

use glam::DVec3;
use std::any::Any;
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

use super::{Alike, Columns, Environment, Fragments, Meeting, PictureSet, PictureShare};
use crate::camera::View;
use crate::error::{Error, Result};
use crate::key::Key;
use crate::trace::{Card, Casters};

/// What a source knows of its faces beyond their geometry on the screen: how they look, and by whom else it can be
/// asked.
pub trait Surfaces: Any + Send + Sync + Debug {
    /// Fills the columns `wanted` (of colour, normal, facing and finish) of a batch of this source's
    /// fragments. Facing and finish may be left empty.
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>);

    /// The columns that differ from place to place on a face. Position and depth always do and need
    /// not be named; an unsmoothed face of one colour has none.
    fn varying(&self, ordinal: u32) -> Columns;

    /// The name of the object that a face belongs to, as a path such as `"car/wheel 2"`.
    fn object(&self, ordinal: u32) -> String;

    /// The name of the material that is seen of a face, or of its bundle where it is divided; empty if it has none.
    fn material(&self, _ordinal: u32, _sees_front: bool, _bundle: Option<u32>) -> String {
        String::new()
    }

    /// Whether it can fill the columns `wanted`; all can, unless their scene is not there.
    ///
    /// # Errors
    /// If it cannot: what is missing.
    fn offers(&self, _wanted: Columns) -> Result<()> {
        Ok(())
    }

    /// What went wrong while columns were filled, since this was asked last: a picture that cannot be read.
    fn fault(&self) -> Option<Error> {
        None
    }

    /// The face that rays see which meet nothing, if there is one, and how far away it stands: of several the nearest
    /// comes first.
    fn beyond(&self) -> Option<(u32, f64)> {
        None
    }

    /// Its faces for rays and shadows; `None` if they cast no shadows and are not met by rays.
    fn rays(&self) -> Option<&dyn RayTarget> {
        None
    }

    /// The pictures that lie on its faces; `None` if no face has any.
    fn pictures(&self) -> Option<&dyn Pictured> {
        None
    }

    /// Which of its faces others had too: what was made of these is made of them. `None` if it does not know.
    fn alike(&self, _before: &dyn Surfaces) -> Option<Alike> {
        None
    }

    /// Where its faces come from, if it knows.
    fn provenance(&self) -> Option<&dyn Provenance> {
        None
    }
}

/// Faces as rays and shadows meet them, as they stand in the world.
pub trait RayTarget {
    /// The faces, numbered as fragments number them.
    fn casters(&self) -> &Casters;

    /// The card that a face is, if it turns to whoever looks at it.
    fn card(&self, _ordinal: u32) -> Option<Card> {
        None
    }

    /// Whether a face may let light through that falls on its back ([`Finish::transmit`](crate::fragment::Finish)).
    fn transmits(&self, _ordinal: u32) -> bool {
        false
    }

    /// The part of one of the [casters'](RayTarget::casters) faces that is seen at a point from the front or
    /// the back: the face or a seal on it. `None` if it is not there from that side.
    fn met(&self, face: u32, _sees_front: bool, _point: DVec3) -> Option<u32> {
        Some(face)
    }

    /// How much a face hides of what is behind it where a ray meets it, in [0, 1]; `None` if its colour tells.
    fn alpha_at(&self, _met: &Meeting) -> Option<f32> {
        None
    }
}

/// Pictures on faces (\[N], "Texture mapping"; \[D], "Attribute mapping").
pub trait Pictured {
    /// The pictures, in sets: of more than memory holds, only those of a few sets are there at once. Every face that
    /// is [divided](Pictured::divide) has a set, be it without pictures.
    fn picture_sets(&self) -> Vec<PictureSet>;

    /// The number of the set of pictures that lies on a face, if one does.
    fn picture_set(&self, ordinal: u32, sees_front: bool) -> Option<u32>;

    /// Where fragments lie on faces that are divided into domains: all of them as parts. Empty if no face is.
    fn divide(&self, fragments: &Fragments<'_>) -> Vec<PictureShare>;
}

/// Where faces come from.
pub trait Provenance {
    /// The names of all objects and of all materials of the scene, seen or not, if they are known.
    fn names(&self) -> Option<[Vec<String>; 2]> {
        None
    }

    /// Which part of which of its object's faces one is, if it knows.
    fn part(&self, _ordinal: u32) -> Option<FacePart> {
        None
    }

    /// What the scene says of its surroundings: what nodes take where they are told nothing.
    fn environment(&self) -> Option<&Environment> {
        None
    }

    /// The file, for files that hold images of the faces.
    fn origin(&self) -> Option<Origin> {
        None
    }

    /// Surfaces that know the faces of both, where neither knows all faces of their scene.
    fn united(&self, _other: &dyn Surfaces) -> Option<Arc<dyn Surfaces>> {
        None
    }
}

/// A part of a face of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FacePart {
    /// The face's number in its object, from 0.
    pub face: u32,
    /// The seal's number on it, if it is a seal or belongs to one.
    pub seal: Option<u32>,
    /// Whether it is a drawn edge.
    pub is_edge: bool,
}

impl dyn Surfaces {
    /// The card that a face is, if it turns to whoever looks at it.
    pub fn card(&self, ordinal: u32) -> Option<Card> {
        self.rays()?.card(ordinal)
    }

    /// Whether a face may let light through that falls on its back.
    pub fn transmits(&self, ordinal: u32) -> bool {
        self.rays().is_some_and(|rays| rays.transmits(ordinal))
    }

    /// How much a face hides of what is behind it where a ray meets it, in [0, 1].
    pub fn alpha_at(&self, view: &View, met: &Meeting) -> f32 {
        let known = self.rays().and_then(|rays| rays.alpha_at(met));
        known.unwrap_or_else(|| Fragments::one(view, met).first_alpha(self))
    }

    /// Where fragments lie on faces that are divided into domains: all of them as parts. Empty if no face is.
    pub fn divide(&self, fragments: &Fragments<'_>) -> Vec<PictureShare> {
        self.pictures().map_or_else(Vec::new, |pictures| pictures.divide(fragments))
    }

    /// The number of the set of pictures that lies on a face, if one does.
    pub fn picture_set(&self, ordinal: u32, sees_front: bool) -> Option<u32> {
        self.pictures()?.picture_set(ordinal, sees_front)
    }

    /// The file that the faces come from.
    pub fn origin(&self) -> Option<Origin> {
        self.provenance()?.origin()
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

/// The name of an object of a source: `"cars.glb/truck/wheel"`.
pub fn object_name(label: &str, path: &str) -> String {
    if path.is_empty() { label.to_owned() } else { format!("{label}/{path}") }
}
