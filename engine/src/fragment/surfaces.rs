//! What a source knows of its own faces.

use glam::DVec3;
use std::any::Any;
use std::fmt::Debug;
use std::path::PathBuf;
use std::sync::Arc;

use super::{Columns, Environment, Fragments, Meeting, PictureSet, Share};
use crate::camera::View;
use crate::error::{Error, Result};
use crate::key::Key;
use crate::trace::{Card, Casters};

/// What a source knows of its faces beyond their geometry on the screen.
pub trait Surfaces: Any + Send + Sync + Debug {
    /// Fills the columns `wanted` (of colour, normal, facing and finish) of a batch of this source's
    /// fragments. Facing and finish may be left empty.
    fn fill(&self, wanted: Columns, fragments: &mut Fragments<'_>);

    /// Where fragments lie on faces that are divided into domains (\[D], "Attribute mapping"): all of them as
    /// parts. Empty if no face is.
    fn divide(&self, _fragments: &Fragments<'_>) -> Vec<Share> {
        Vec::new()
    }

    /// The pictures that lie on its faces, in sets: of more than memory holds, only those of a few sets are there at
    /// once (\[N], "Texture mapping"). Every face that is [divided](Surfaces::divide) has a set, be it without pictures.
    fn picture_sets(&self) -> Vec<PictureSet> {
        Vec::new()
    }

    /// The number of the set of pictures that lies on a face, if one does.
    fn picture_set(&self, _ordinal: u32, _sees_front: bool) -> Option<u32> {
        None
    }

    /// The columns that differ from place to place on a face. Position and depth always do and need
    /// not be named; an unsmoothed face of one colour has none.
    fn varying(&self, ordinal: u32) -> Columns;

    /// Its faces as they stand in the world, numbered as fragments number them; `None` if they cast no
    /// shadows and are not met by rays.
    fn casters(&self) -> Option<&Casters> {
        None
    }

    /// Whether it casts shadows, without looking further.
    fn casts(&self) -> bool {
        false
    }

    /// The card that a face is, if it turns to whoever looks at it.
    fn card(&self, _ordinal: u32) -> Option<Card> {
        None
    }

    /// The part of one of its [casters'](Surfaces::casters) faces that is seen at a point from the front or
    /// the back: the face or a seal on it. `None` if it is not there from that side.
    fn met(&self, face: u32, _sees_front: bool, _point: DVec3) -> Option<u32> {
        Some(face)
    }

    /// How much a face hides of what is behind it where a ray meets it, in [0, 1].
    fn alpha_at(&self, view: &View, met: &Meeting) -> f32 {
        Fragments::one(view, met).first_alpha(self)
    }

    /// The face that rays see which meet nothing, if there is one, and how far away it stands: of several the nearest
    /// comes first.
    fn beyond(&self) -> Option<(u32, f64)> {
        None
    }

    /// The name of the object that a face belongs to, as a path such as `"car/wheel 2"`.
    fn object(&self, ordinal: u32) -> String;

    /// The names of all objects and of all materials of its scene, seen or not, if it knows them.
    fn names(&self) -> Option<[Vec<String>; 2]> {
        None
    }

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

    /// Surfaces that know the faces of both, where neither knows all faces of their scene.
    fn united(&self, _other: &dyn Surfaces) -> Option<Arc<dyn Surfaces>> {
        None
    }

    /// What its scene says of its surroundings: what nodes take where they are told nothing.
    fn environment(&self) -> Option<&Environment> {
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

/// The name of an object of a source: `"cars.glb/truck/wheel"`.
pub fn object_name(label: &str, path: &str) -> String {
    if path.is_empty() { label.to_owned() } else { format!("{label}/{path}") }
}
