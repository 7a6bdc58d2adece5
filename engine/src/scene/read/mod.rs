//! Reading scenes.
//!
//! | format | ends in | up | unit | remarks |
//! |---|---|---|---|---|
//! | glTF 2.0 | `.gltf`, `.glb` | y | 1 m | nodes, meshes, skins, morph targets, cameras, lights, materials; one animation, at a moment |
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
mod reader;
mod stl;
pub mod text;
mod words;

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::document::{Document, Step, Transform};
use super::domains::{Define, Domains};
use super::flat::Scene;
use super::library::{Library, Placed};
use super::shape::Shape;
use crate::error::{Error, Result};
use crate::key::Key;
use crate::open;
use format::Format;
use reader::{METRES, Reader, Space};

pub use super::document::Axis;
pub use super::library::{ReadOptions, Reading};

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
    let mut options = options.clone();
    reader.wants_pictures = options.pictures != Some(false);
    reader.key.bytes(options.for_key().as_bytes());
    let bytes = reader.bytes(path)?;
    // Whatever breaks in a reader, or in a library behind it, is the file's fault.
    let read = open::guarded(|| contents(&mut reader, &bytes, &mut options));
    let (mut document, space) = read.unwrap_or_else(|broke| Err(Error::in_file(path, broke)))?;
    document.moment = options.moment;
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

/// Whether a scene file is another at another [moment](ReadOptions::moment).
///
/// # Errors
/// As [`document`].
pub fn moves(path: &Path) -> Result<bool> {
    some_move(path, &mut HashSet::new())
}

/// The same, of a file that other files may name: those that were looked at are not looked at again.
fn some_move(path: &Path, seen: &mut HashSet<PathBuf>) -> Result<bool> {
    if !seen.insert(path.to_owned()) {
        return Ok(false);
    }
    let mut reader = Reader::new(path);
    let bytes = reader.bytes(path)?;
    match Format::of(&mut reader, &bytes)? {
        Format::Text => {
            let (moves, files) = text::moves(&bytes);
            let folder = path.parent().unwrap_or(Path::new(""));
            // What cannot be read is told by those who need it.
            let mut others = files.iter().map(|file| some_move(&folder.join(file), seen));
            Ok(moves || others.any(|moves| moves.unwrap_or(false)))
        }
        Format::Gltf | Format::Glb => gltf::moves(&mut reader, &bytes),
        _ => Ok(false),
    }
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
    options.apply(&mut scene).map_err(|message| Error::in_file(path, message))?;
    scene.pictures = Some(scene.key_of_pictures());
    scene.origin = Some(bundle::origin(path, plan, options, scene.key));
    Ok(scene)
}

impl ReadOptions {
    /// What is done to a scene that is ready.
    ///
    /// # Errors
    /// If it has none of the objects.
    fn apply(&self, scene: &mut Scene) -> std::result::Result<(), String> {
        if !self.objects.is_empty() {
            scene.keep(&self.objects)?;
        }
        if self.pictures == Some(false) {
            scene.materials.iter_mut().for_each(|material| {
                material.maps.clear();
                let is_picture = |d: &Domains| matches!(d.define, Define::Picture(_));
                material.domains = material.domains.take().filter(|d| !is_picture(d));
            });
            scene.missing.clear();
        }
        Ok(())
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

/// Reads a file's contents by their format.
fn contents(
    reader: &mut Reader,
    bytes: &[u8],
    options: &mut ReadOptions,
) -> Result<(Document, Space)> {
    let city = Space { unit: 1.0, up: Axis::Z };
    let format = Format::of(reader, bytes)?;
    // PLY and STL are either, and look for themselves.
    let is_text = !matches!(format, Format::Ply | Format::Stl | Format::Glb | Format::Binary);
    let text = if is_text { reader.text(bytes)? } else { Cow::Borrowed("") };
    if !options.parameters.is_empty() && !matches!(format, Format::Text) {
        return Err(Error::in_file(
            &reader.path,
            "only scenes in RON have parameters: this file takes none",
        ));
    }
    if options.animation.is_some() && !matches!(format, Format::Gltf | Format::Glb) {
        reader.note("`animation` names one of a glTF file, and this is none: it changes nothing");
    }
    Ok(match format {
        Format::Glb => (gltf::read(reader, bytes, options)?, METRES),
        Format::Gltf => (gltf::read(reader, text.as_bytes(), options)?, METRES),
        Format::Obj => (obj::read(reader, &text)?, METRES),
        Format::Ply => (ply::read(reader, bytes)?, METRES),
        Format::Stl => (stl::read(reader, bytes)?, Space { unit: 0.001, up: Axis::Z }),
        Format::CityJson => (cityjson::read(reader, text.as_bytes(), options.lod)?, city),
        Format::CityGml => (citygml::read(reader, text.as_bytes(), options)?, city),
        Format::Text => {
            let moment = options.moment.unwrap_or_default();
            if options.moment.is_none() && text::moves(bytes).0 {
                reader.about.push("it moves in time; this is frame 1".to_owned());
            }
            let parameters = &options.parameters;
            let document = text::parse_at(&reader.path, text.as_bytes(), moment, parameters)?;
            let told = document.parameters.iter();
            let told: Vec<String> =
                told.map(|(name, value)| format!("{name} ({})", value.text())).collect();
            if !told.is_empty() {
                reader.about.push(format!("its parameters: {}", told.join(", ")));
            }
            (document, METRES)
        }
        Format::Binary => (binary::parse(&reader.path, bytes)?, METRES),
    })
}

impl Scene {
    /// Makes a plan of a document ready, as [`Scene::with_library`] does. Files that it names are read in their
    /// formats.
    ///
    /// # Errors
    /// As [`Scene::with_library`].
    pub fn new(
        document: &Document,
        plan: Option<&str>,
        label: &str,
        key: Key,
        directory: &Path,
    ) -> Result<Scene> {
        Scene::with_library(document, plan, label, key, (directory, &library()))
    }
}

/// The library of scene files.
pub(super) fn library() -> Arc<dyn Library> {
    Arc::new(Formats)
}

/// Scene files in all formats.
#[derive(Debug)]
pub struct Formats;

impl Library for Formats {
    fn document(&self, path: &Path, options: &ReadOptions) -> Result<Reading> {
        document(path, options)
    }

    fn picture(&self, path: &Path, number: u32) -> Result<Vec<u8>> {
        gltf::picture(path, number)
    }

    fn picture_sizes(&self, path: &Path) -> Result<Vec<u64>> {
        gltf::picture_bytes(path)
    }
}
