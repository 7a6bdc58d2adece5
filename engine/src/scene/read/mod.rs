//! Reading scenes.
//!
//! | format | ends in | up | unit | remarks |
//! |---|---|---|---|---|
//! | glTF 2.0 | `.gltf`, `.glb` | y | 1 m | nodes, meshes, cameras, lights, materials; animations are not played |
//! | Wavefront | `.obj` (+ `.mtl`) | y | 1 m | polygons stay polygons; objects, groups, vertex colours; textures by reference |
//! | Stanford | `.ply` | y | 1 m | text and both binary forms |
//! | Stereolithography | `.stl` | z | 1 mm | text and binary; the vertices of triangles are shared |
//! | CityJSON 1.0 to 2.0 | `.json`, `.jsonl` by lines | z | 1 m | interior rings become holes; textures by reference |
//! | CityGML 1.0 to 3.0 | `.gml`, `.xml` | z | 1 m | as CityJSON; positions in degrees are laid on a plane |
//! | own, text | `.ron` | y | 1 m | the whole model; see [`text`] |
//! | own, binary | `.scene` | y | 1 m | the whole model; see [`binary`] |
//!
//! The endings are a hint: a file is what its first bytes say, under any name. Text may be UTF-8, UTF-16 or Latin-1,
//! with any ends of lines.
//!
//! All are right-handed. What the tables say of up and unit is what the format's own specification
//! says or, where it says nothing, what its files usually mean; [`ReadOptions`] overrides it. The
//! conversion is the root object's transform: points stay as the file has them.

pub mod binary;
pub mod bundle;
mod citygml;
mod cityjson;
mod colors;
mod format;
pub(in crate::scene) mod gltf;
mod mtl;
mod obj;
mod ply;
mod stl;
pub mod text;
mod words;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::{Document, Step, Transform};
use super::domains::{Define, Domains};
use super::flat::Scene;
use super::shape::Shape;
use crate::error::{Error, Result};
use crate::key::{Key, KeyHasher};
use crate::open;
use format::Format;

/// An axis of a file's space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Axis {
    /// The second coordinate.
    Y,
    /// The third.
    Z,
}

/// How to read a file; what is absent is as the format says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// Libraries of materials that surfaces need and that are not there.
    pub missing: Vec<PathBuf>,
    /// How the file's space became the world.
    placed: Placed,
}

/// How a file's space became the world.
#[derive(Clone, Debug, Default)]
enum Placed {
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

/// A file being read: its bytes, those of files that it names, and remarks.
struct Reader {
    path: PathBuf,
    key: KeyHasher,
    notes: Vec<String>,
    about: Vec<String>,
    missing: Vec<PathBuf>,
    /// Whether what needs time is found too.
    examines: bool,
    /// Whether it is told that surfaces do not look as they should.
    wants_pictures: bool,
    /// Where the file has degrees, the origin on the plane that it is laid on.
    degrees: Option<[f64; 3]>,
}

/// What a format says where the options do not.
struct Space {
    unit: f64,
    up: Axis,
}

const METRES: Space = Space { unit: 1.0, up: Axis::Y };

/// Reads a scene file of any known format.
///
/// # Errors
/// If the file cannot be read, its format is unknown, or its contents are faulty; the error names the
/// file and the place in it.
pub fn document(path: &Path, options: &ReadOptions) -> Result<Reading> {
    read(Reader::new(path), path, options)
}

/// The same, and what is wrong with it that needs time to find, in [`about`](Reading::about).
///
/// # Errors
/// As [`document`].
pub fn examined(path: &Path, options: &ReadOptions) -> Result<Reading> {
    read(Reader { examines: true, ..Reader::new(path) }, path, options)
}

fn read(mut reader: Reader, path: &Path, options: &ReadOptions) -> Result<Reading> {
    check(options)?;
    let mut options = *options;
    reader.wants_pictures = options.pictures != Some(false);
    reader.key.bytes(options.for_key().as_bytes());
    let bytes = reader.bytes(path)?;
    // Whatever breaks in a reader, or in a library behind it, is the file's fault.
    let read = open::guarded(|| reader.read(&bytes, &mut options));
    let (mut document, space) = read.unwrap_or_else(|broke| Err(Error::in_file(path, broke)))?;
    let steps = place(&mut document, &options, &space);
    let stays = |plan: &super::Plan| !plan.cameras.is_empty() || !plan.lights.is_empty();
    if !steps.is_empty() && document.plans.iter().any(stays) {
        reader.note(
            "`unit`, `up` and `origin` move what is seen, and not the file's cameras and lights: they stay where \
             the file has them",
        );
    }
    if let Some(angle) = options.crease {
        smooth(&mut document, angle);
    }
    let Reader { key, notes, about, missing, degrees, .. } = reader;
    let placed = degrees.map_or(Placed::By(Transform(steps)), Placed::Around);
    let (document, key) = (Arc::new(document), key.finish());
    Ok(Reading { document, key, notes, about, missing, placed })
}

/// Reads a scene file and makes a plan of it ready.
///
/// # Errors
/// As [`document`] and [`Scene::new`].
pub fn scene(path: &Path, plan: Option<&str>, label: &str, options: &ReadOptions) -> Result<Scene> {
    let reading = document(path, options)?;
    let directory = path.parent().unwrap_or(Path::new(""));
    let scene = Scene::new(&reading.document, plan, label, reading.key, directory);
    let mut scene = scene.map_err(|error| match error {
        Error::Invalid(message) => Error::in_file(path, message),
        other => other,
    })?;
    scene.notes.splice(0..0, reading.notes);
    scene.missing.splice(0..0, reading.missing);
    options.apply(&mut scene);
    scene.pictures = Some(scene.key_of_pictures());
    scene.origin = Some(bundle::origin(path, plan, options, scene.key));
    Ok(scene)
}

impl ReadOptions {
    /// The options as keys have them, and with these the files of spans that were written before: it stays as it is,
    /// and what comes later appears only where somebody asks for it.
    fn for_key(&self) -> String {
        fn text<T: Serialize>(value: &Option<T>) -> String {
            let value = value.as_ref().and_then(|value| serde_json::to_string(value).ok());
            value.map_or("None".to_owned(), |value| format!("Some({value})"))
        }
        let ReadOptions { unit, up, origin, crease, pictures, lod } = self;
        let lod = lod.map_or(String::new(), |level| format!(", lod: {}", text(&Some(level))));
        format!(
            "ReadOptions {{ unit: {}, up: {}, origin: {}, crease: {}, pictures: {}{lod} }}",
            text(unit),
            text(up),
            text(origin),
            text(crease),
            text(pictures)
        )
    }

    /// What is done to a scene that is ready.
    fn apply(&self, scene: &mut Scene) {
        if self.pictures == Some(false) {
            scene.materials.iter_mut().for_each(|material| {
                material.maps.clear();
                let is_picture = |d: &Domains| matches!(d.define, Define::Picture(_));
                material.domains = material.domains.take().filter(|d| !is_picture(d));
            });
            scene.missing.clear();
        }
    }
}

fn check(options: &ReadOptions) -> Result<()> {
    if options.unit.is_some_and(|unit| !(unit > 0.0 && unit.is_finite())) {
        return Err(Error::invalid("`unit` is metres per unit of the file: a number above 0"));
    }
    if options.crease.is_some_and(|angle| !(0.0..=180.0).contains(&angle)) {
        return Err(Error::invalid("`crease` is an angle: 0 to 180 degrees"));
    }
    if options.lod.is_some_and(|lod| !(0.0..=9.0).contains(&lod)) {
        return Err(Error::invalid("`lod` is a level of detail: 0 to 9, such as 2 or 2.2"));
    }
    if options.origin.is_some_and(|origin| origin.iter().any(|v| !v.is_finite())) {
        return Err(Error::invalid("`origin` has a number that is not finite"));
    }
    Ok(())
}

/// Brings the file's space to metres, y up, by the root objects' transforms; returns the steps.
fn place(document: &mut Document, options: &ReadOptions, space: &Space) -> Vec<Step> {
    let mut steps = Vec::new();
    if let Some([x, y, z]) = options.origin {
        steps.push(Step::Move(-x, -y, -z));
    }
    if options.up.unwrap_or(space.up) == Axis::Z {
        steps.push(Step::TurnX(-90.0));
    }
    let unit = options.unit.unwrap_or(space.unit);
    if unit != 1.0 {
        steps.push(Step::Scale(unit));
    }
    for plan in &mut document.plans {
        plan.root.transform.0.extend_from_slice(&steps);
    }
    steps
}

fn smooth(document: &mut Document, angle: f64) {
    fn visit(object: &mut super::Object, angle: f64) {
        if let Shape::Faces(mesh) = &mut object.shape {
            mesh.smooth(angle);
        }
        object.children.iter_mut().for_each(|child| visit(child, angle));
    }
    for plan in &mut document.plans {
        visit(&mut plan.root, angle);
        plan.definitions.values_mut().for_each(|object| visit(object, angle));
    }
}

impl Reader {
    fn new(path: &Path) -> Reader {
        Reader {
            path: path.to_owned(),
            key: KeyHasher::new("scene file"),
            notes: Vec::new(),
            about: Vec::new(),
            missing: Vec::new(),
            examines: false,
            wants_pictures: true,
            degrees: None,
        }
    }

    /// Reads the file's contents by their format.
    fn read(&mut self, bytes: &[u8], options: &mut ReadOptions) -> Result<(Document, Space)> {
        let city = Space { unit: 1.0, up: Axis::Z };
        let format = Format::of(self, bytes)?;
        // PLY and STL are either, and look for themselves.
        let is_text = !matches!(format, Format::Ply | Format::Stl | Format::Glb | Format::Binary);
        let text = if is_text { self.text(bytes)? } else { Cow::Borrowed("") };
        Ok(match format {
            Format::Glb => (gltf::read(self, bytes)?, METRES),
            Format::Gltf => (gltf::read(self, text.as_bytes())?, METRES),
            Format::Obj => (obj::read(self, &text)?, METRES),
            Format::Ply => (ply::read(self, bytes)?, METRES),
            Format::Stl => (stl::read(self, bytes)?, Space { unit: 0.001, up: Axis::Z }),
            Format::CityJson => (cityjson::read(self, text.as_bytes(), options.lod)?, city),
            Format::CityGml => (citygml::read(self, text.as_bytes(), options)?, city),
            Format::Text => (text::parse(&self.path, text.as_bytes())?, METRES),
            Format::Binary => (binary::parse(&self.path, bytes)?, METRES),
        })
    }

    /// Reads a file and adds its contents to the key.
    fn bytes(&mut self, path: &Path) -> Result<Vec<u8>> {
        let bytes = open::bytes(path)?;
        self.key.bytes(&bytes);
        Ok(bytes)
    }

    /// Bytes of the file as text; what is doubtful in it is noted.
    fn text<'b>(&mut self, bytes: &'b [u8]) -> Result<Cow<'b, str>> {
        let open::Text { text, note } = open::text(&self.path, bytes)?;
        if let Some(note) = note {
            self.note(note);
        }
        Ok(text)
    }

    /// Reads a file that this one names, if there is one.
    fn sibling(&mut self, name: &str) -> Result<(PathBuf, Vec<u8>)> {
        let path = self.path.parent().unwrap_or(Path::new("")).join(name);
        let bytes = self.bytes(&path)?;
        Ok((path, bytes))
    }

    /// Remarks on something doubtful.
    fn note(&mut self, message: impl std::fmt::Display) {
        let note = format!("{}: {message}", self.path.display());
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// The file's name without its ending.
    fn stem(&self) -> String {
        let name = self.path.file_name().and_then(|name| name.to_str()).unwrap_or("scene");
        name.split('.').next().unwrap_or(name).to_owned()
    }

    fn fault(&self, message: impl Into<String>) -> Error {
        Error::in_file(&self.path, message)
    }
}

/// Something that is left out or changed: how often, and the first.
#[derive(Default)]
struct LeftOut {
    count: usize,
    first: String,
}

impl LeftOut {
    fn add(&mut self, which: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = which();
        }
        self.count += 1;
    }

    /// Remarks on it, if it happened.
    fn tell(&self, reader: &mut Reader, what: &str) {
        if self.count > 0 {
            reader.note(format!("{} {what}; the first: {}", self.count, self.first));
        }
    }
}

/// Makes names of siblings unique by numbering those that repeat.
#[derive(Default)]
struct Names {
    counts: HashMap<String, u32>,
    taken: HashSet<String>,
}

impl Names {
    fn unique(&mut self, name: &str) -> String {
        let name = name.trim().replace('/', "_");
        let mut unique = name.clone();
        while !self.taken.insert(unique.clone()) {
            let count = self.counts.entry(name.clone()).or_insert(1);
            *count += 1;
            unique = format!("{name}#{count}");
        }
        unique
    }
}
