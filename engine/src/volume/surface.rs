//! Scenes of a volume's surfaces.

use glam::DVec3;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

use super::clip::clip;
use super::decimate::decimate;
use super::{Inside, Volume, isosurface};
use crate::error::{Error, Result};
use crate::key::Key;
use crate::scene::document::{Axis, Document, Object, Plan, Step, Transform};
use crate::scene::{AlphaMode, Material, Mesh, Scene, Shape};
use crate::text;

/// A surface of equal value, and how it looks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Level {
    /// The value.
    pub value: f64,
    /// Where the inside is.
    pub inside: Inside,
    /// How it looks.
    pub material: Material,
}

impl Level {
    /// A surface whose material is written as in a scene, such as `(color: "#d8c9a8")`.
    ///
    /// # Errors
    /// What is wrong with the material.
    pub fn new(value: f64, inside: Inside, material: &str) -> std::result::Result<Level, String> {
        let material: Material = text::options()
            .from_str(material)
            .map_err(|error| format!("the material of {value}: {}", error.code))?;
        if material.alpha < 1.0 && material.alpha_mode == AlphaMode::Opaque {
            return Err(format!(
                "the material of {value} has an alpha of {} that nothing reads: say `alpha_mode: Blend`",
                material.alpha
            ));
        }
        Ok(Level { value, inside, material })
    }
}

/// How surfaces are made of a volume. Lengths and places are in the volume's unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Surface {
    /// The surfaces.
    pub levels: Vec<Level>,
    /// Samples from vertex to vertex of the grid of cells, as in [`Volume::resampled`].
    pub step: f64,
    /// How far a vertex of the whole surface may lie from what is left of it, as in [`decimate`].
    pub error: Option<f64>,
    /// The least and the greatest corner of the box that is kept.
    pub within: Option<[DVec3; 2]>,
    /// Planes, each a point and a direction. What lies on the side to which it points is gone.
    pub cuts: Vec<[DVec3; 2]>,
    /// Whether faces have normals at their vertices.
    pub smooth: bool,
}

impl Default for Surface {
    fn default() -> Surface {
        Surface {
            levels: Vec::new(),
            step: 1.0,
            error: None,
            within: None,
            cuts: Vec::new(),
            smooth: true,
        }
    }
}

impl Surface {
    /// Whether the numbers can be used; else which is wrong, and why.
    ///
    /// # Errors
    /// The name of the number, and what it must be.
    pub fn check(&self) -> std::result::Result<(), (&'static str, String)> {
        if self.levels.iter().any(|level| !level.value.is_finite()) {
            return Err(("levels", "a value must be finite".to_owned()));
        }
        if let Some(twice) = self.levels.iter().enumerate().find_map(|(at, level)| {
            let before = &self.levels[..at];
            before.iter().any(|other| other.value == level.value).then_some(level.value)
        }) {
            return Err(("levels", format!("{twice} is given twice")));
        }
        if !(1.0 / 16.0..=64.0).contains(&self.step) {
            return Err(("step", "must be 1/16 to 64 samples".to_owned()));
        }
        if self.error.is_some_and(|error| !(error > 0.0 && error.is_finite())) {
            return Err(("error", "must be a length above 0".to_owned()));
        }
        let planes = self.planes();
        if !planes.iter().flatten().all(|v| v.is_finite()) {
            return Err(("cuts", "a number of a cut or of `within` is not finite".to_owned()));
        }
        if self.within.is_some_and(|[least, greatest]| !least.cmplt(greatest).all()) {
            let what = "each coordinate of the first corner must be less than that of the second";
            return Err(("within", what.to_owned()));
        }
        if planes.iter().any(|[_, direction]| direction.length_squared() == 0.0) {
            return Err(("cuts", "a direction has no length".to_owned()));
        }
        Ok(())
    }

    /// All planes that cut.
    fn planes(&self) -> Vec<[DVec3; 2]> {
        let sides = self.within.into_iter().flat_map(|[least, greatest]| {
            DVec3::AXES.into_iter().flat_map(move |axis| [[greatest, axis], [least, -axis]])
        });
        sides.chain(self.cuts.iter().copied()).collect()
    }

    /// The meshes of the levels, in their order, in the volume's coordinates.
    ///
    /// # Errors
    /// If a number is out of range, or a surface has too many vertices.
    pub fn meshes(&self, volume: &Volume) -> Result<Vec<Mesh>> {
        self.check().map_err(|(field, what)| Error::invalid(format!("`{field}`: {what}")))?;
        // Samples that stay are not copied.
        let other = (self.step != 1.0).then(|| volume.resampled(self.step)).transpose()?;
        let volume = other.as_ref().unwrap_or(volume);
        let mesh = |level: &Level| {
            let mut mesh = isosurface(volume, level.value, level.inside)?;
            if let Some(error) = self.error {
                mesh = decimate(&mesh, error)?;
            }
            for [point, direction] in self.planes() {
                mesh = clip(&mesh, point, direction)?;
            }
            if !self.smooth {
                mesh.normals.clear();
            }
            Ok(mesh)
        };
        self.levels.iter().map(mesh).collect()
    }

    /// A scene of the levels, each an object called as its value.
    ///
    /// # Errors
    /// As [`meshes`](Surface::meshes) and [`Scene::new`].
    pub fn scene(&self, volume: &Volume, label: &str) -> Result<Scene> {
        let mut notes = Vec::new();
        let mut root = Object { transform: place(volume), ..Object::default() };
        let mut materials = BTreeMap::new();
        for (level, mut mesh) in self.levels.iter().zip(self.meshes(volume)?) {
            let name = level.value.to_string();
            if mesh.face_count() == 0 {
                let range = volume.range().map_or("no numbers".to_owned(), |(low, high)| {
                    format!("values from {low} to {high}")
                });
                notes.push(format!("{label}: nothing is at {name}: the volume has {range}"));
            }
            mesh.materials = vec![name.clone()];
            let faces = mesh.face_count();
            let mut object = Object::new(name.clone(), Shape::Faces(mesh));
            object.material = Some(name.clone());
            if faces > 0 {
                root.children.push(object);
            }
            materials.insert(name, level.material.clone());
        }
        let plan = Plan { name: label.to_owned(), root, ..Plan::default() };
        let document = Document { materials, ..Document::with_plan(plan) };
        let key = Key::of(&("isosurface", volume.key(), self));
        let mut scene = Scene::new(&document, None, label, key, Path::new(""))?;
        scene.notes.extend(notes);
        Ok(scene)
    }
}

/// From a volume's coordinates to the world's.
fn place(volume: &Volume) -> Transform {
    let mut steps = Vec::new();
    if volume.up == Axis::Z {
        steps.push(Step::TurnX(-90.0));
    }
    if volume.unit != 1.0 {
        steps.push(Step::Scale(volume.unit));
    }
    Transform(steps)
}
