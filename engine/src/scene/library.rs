//! What a scene takes from files: those who make it ready know no formats.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::{Axis, Document, Transform};
use crate::error::{Error, Result};
use crate::key::Key;
use crate::moment::Moment;
use crate::text::AnyValue;

/// Reads the files that documents name.
pub trait Library: Debug + Send + Sync {
    /// A scene file.
    ///
    /// # Errors
    /// If it cannot be read.
    fn document(&self, path: &Path, options: &ReadOptions) -> Result<Reading>;

    /// The bytes of a picture that a scene file holds, by its number there.
    ///
    /// # Errors
    /// If it cannot be read, or holds no such picture.
    fn picture(&self, path: &Path, number: u32) -> Result<Vec<u8>>;

    /// The most bytes that each of the pictures of a scene file takes as a map; 0 for those that are not to be read.
    ///
    /// # Errors
    /// If it cannot be read.
    fn picture_sizes(&self, path: &Path) -> Result<Vec<u64>>;
}

/// A library without files, for documents that name none.
#[derive(Debug)]
pub struct NoFiles;

impl NoFiles {
    fn none<T>(path: &Path) -> Result<T> {
        Err(Error::in_file(path, "a scene that a program makes names no files"))
    }
}

impl Library for NoFiles {
    fn document(&self, path: &Path, _: &ReadOptions) -> Result<Reading> {
        NoFiles::none(path)
    }

    fn picture(&self, path: &Path, _: u32) -> Result<Vec<u8>> {
        NoFiles::none(path)
    }

    fn picture_sizes(&self, path: &Path) -> Result<Vec<u64>> {
        NoFiles::none(path)
    }
}

/// How to read a file; what is absent is as the format says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReadOptions {
    /// Metres per unit of the file.
    pub unit: Option<f64>,
    /// The axis that is up.
    pub up: Option<Axis>,
    /// A point of the file's space that becomes the origin: for coordinates far from it. Where a file has degrees,
    /// latitude, longitude and height.
    pub origin: Option<[f64; 3]>,
    /// Gives meshes without normals smooth ones, where faces meet at less than this angle in degrees.
    pub crease: Option<f64>,
    /// Whether surfaces show their pictures; they do if nothing is said.
    pub pictures: Option<bool>,
    /// The level of detail in which a city's buildings are shown, such as 1 or 2.2, or the nearest coarser one that a
    /// building has. A whole number means the finest of its refinements too. Absent, each building's finest.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lod: Option<f64>,
    /// The moment at which a file that [moves](super::read::moves) is read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub moment: Option<Moment>,
    /// The name of the animation that a glTF file plays; absent, its first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub animation: Option<String>,
    /// The objects that are taken, by patterns of their paths; absent, all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<String>,
    /// What the parameters of a scene's text are, by name; those that are not here are as the text has them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, AnyValue>,
}

/// What was read from a file.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The model.
    pub document: Arc<Document>,
    /// The contents of the file and those that it names, and how they were read.
    pub key: Key,
    /// What is doubtful in the file and was taken as well as could be.
    pub notes: Vec<String>,
    /// What `info` tells of the file beside its contents, such as its levels of detail.
    pub about: Vec<String>,
    /// Libraries of materials that surfaces need and that cannot be read, and why.
    pub missing: Vec<(PathBuf, String)>,
    /// How the file's space became the world.
    pub(super) placed: Placed,
}

/// How a file's space became the world.
#[derive(Clone, Debug, Default)]
pub(super) enum Placed {
    /// As it was.
    #[default]
    Same,
    /// By steps.
    By(Transform),
    /// From degrees, around a latitude, longitude and height.
    Around([f64; 3]),
}

impl Reading {
    /// The point of the file's own space that lies at a point of the world, as [`ReadOptions::origin`] takes it. For
    /// a file in degrees, it is right at the height of the point above the origin that it was read around.
    pub fn in_file(&self, world: DVec3) -> [f64; 3] {
        match &self.placed {
            Placed::Same => world.to_array(),
            Placed::By(steps) => steps.to_matrix().inverse().transform_point3(world).to_array(),
            Placed::Around([latitude, longitude, height]) => {
                [*latitude, *longitude, height + world.y]
            }
        }
    }
}

impl ReadOptions {
    /// The options as keys have them, and with these the files of spans that were written before: it stays as it is,
    /// and what comes later appears only where somebody asks for it.
    pub(super) fn for_key(&self) -> String {
        fn text<T: Serialize>(value: &Option<T>) -> String {
            let value = value.as_ref().and_then(|value| serde_json::to_string(value).ok());
            value.map_or("None".to_owned(), |value| format!("Some({value})"))
        }
        fn later<T: Serialize>(name: &str, value: &Option<T>) -> String {
            value.as_ref().map_or(String::new(), |_| format!(", {name}: {}", text(value)))
        }
        let ReadOptions { unit, up, origin, crease, pictures, lod, .. } = self;
        let ReadOptions { moment, animation, objects, parameters, .. } = self;
        let objects = (!objects.is_empty()).then_some(objects);
        let parameters = (!parameters.is_empty()).then_some(parameters);
        let later = [
            later("lod", lod),
            later("moment", moment),
            later("animation", animation),
            later("objects", &objects),
            later("parameters", &parameters),
        ]
        .concat();
        format!(
            "ReadOptions {{ unit: {}, up: {}, origin: {}, crease: {}, pictures: {}{later} }}",
            text(unit),
            text(up),
            text(origin),
            text(crease),
            text(pictures)
        )
    }
}
