//! The files that a document names: pictures, trigger patterns, lamps, other scenes. All paths are as seen from the
//! document's own file.

use std::path::Path;

use super::document::{Document, Object};
use super::domains::Define;
use super::material::Picture;
use super::read::gltf;
use super::shape::Shape;
use crate::error::Result;

/// A file that a document names.
#[derive(Debug)]
pub enum Named<'d> {
    /// A picture on a surface: its own file, or one in a scene's.
    Picture(&'d mut Picture),
    /// The picture of a trigger pattern.
    Pattern(&'d mut String),
    /// What a light is made from.
    Lamp(&'d mut String),
    /// A scene.
    Scene(&'d mut String),
}

impl Named<'_> {
    /// Its path; none of a picture that is computed.
    pub fn path_mut(&mut self) -> Option<&mut String> {
        match self {
            Named::Picture(picture) => picture.path_mut(),
            Named::Pattern(path) | Named::Lamp(path) | Named::Scene(path) => Some(path),
        }
    }
}

impl Document {
    /// Shows every file that the document names to `visit`, which may change it.
    ///
    /// # Errors
    /// The first of `visit`.
    pub fn visit_files(&mut self, visit: &mut dyn FnMut(Named<'_>) -> Result<()>) -> Result<()> {
        for material in self.materials.values_mut() {
            for map in material.maps.values_mut() {
                visit(Named::Picture(&mut map.picture))?;
            }
            if let Some(Define::Picture(path)) = material.domains.as_mut().map(|d| &mut d.define) {
                visit(Named::Pattern(path))?;
            }
        }
        for plan in &mut self.plans {
            for light in plan.lights.values_mut() {
                if let Some(file) = light.file_mut() {
                    visit(Named::Lamp(&mut file.0))?;
                }
            }
            let definitions = plan.definitions.values_mut();
            for object in definitions.chain([&mut plan.root]) {
                visit_object(object, visit)?;
            }
        }
        Ok(())
    }
}

fn visit_object(object: &mut Object, visit: &mut dyn FnMut(Named<'_>) -> Result<()>) -> Result<()> {
    match &mut object.shape {
        Shape::File { path, .. } => visit(Named::Scene(path))?,
        Shape::Array { of, .. } => visit_object(of, visit)?,
        _ => {}
    }
    object.children.iter_mut().try_for_each(|child| visit_object(child, visit))
}

/// The bytes of a picture that a scene file holds, PNG or JPEG, by its number.
///
/// # Errors
/// If there is none.
pub fn held(path: &Path, number: u32) -> Result<Vec<u8>> {
    gltf::picture(path, number)
}
