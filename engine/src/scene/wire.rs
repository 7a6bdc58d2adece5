//! Wire frames: the edges of all faces as drawn lines, which are spans with a width.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::Arc;

use super::face::EdgeStyle;
use super::flat::Scene;
use super::geometry::Geometry;
use super::material::{AlphaMode, Material};
use crate::color::Color;
use crate::error::{Error, Result};
use crate::key::Key;

/// What becomes of lines behind faces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum HiddenLines {
    /// They are left out.
    #[default]
    LeftOut,
    /// Each face before them takes away this share of them, above 0 and below 1.
    Dimmed(f32),
    /// They are shown.
    Shown,
}

/// How a wire frame is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Wire {
    /// The lines.
    pub edge: EdgeStyle,
    /// The colour of faces between them, not lit.
    pub fill: Color,
    /// What becomes of lines behind faces.
    pub hidden: HiddenLines,
}

impl Scene {
    /// The same objects, of which edges alone are drawn: those of faces, holes and seals.
    ///
    /// # Errors
    /// If a number is out of range, or the scene would have 2^32 faces and edges.
    pub fn wire_frame(&self, wire: &Wire) -> Result<Scene> {
        let hides = match wire.hidden {
            HiddenLines::LeftOut => 1.0,
            HiddenLines::Shown => 0.0,
            HiddenLines::Dimmed(share) if share > 0.0 && share < 1.0 => share,
            HiddenLines::Dimmed(_) => {
                return Err(Error::invalid("`Dimmed` takes a share above 0 and below 1"));
            }
        };
        let fill = Material {
            color: wire.fill,
            unlit: true,
            casts: false,
            alpha: hides,
            alpha_mode: if hides < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque },
            ..Material::default()
        };
        let mut scene = self.clone();
        scene.materials = vec![fill];
        scene.material_names = vec![String::new()];
        scene.missing.clear();
        scene.pictures = None;
        scene.origin = None;
        scene.key = Key::of(&("wire frame", self.key, wire));
        let mut known: HashMap<*const Geometry, Arc<Geometry>> = HashMap::new();
        let mut parts = 0u64;
        for instance in &mut scene.instances {
            let address = Arc::as_ptr(&instance.geometry);
            let geometry = match known.get(&address) {
                Some(geometry) => geometry.clone(),
                None => {
                    let made = Arc::new(drawn(&instance.geometry, wire)?);
                    known.insert(address, made.clone());
                    made
                }
            };
            instance.first_ordinal = u32::try_from(parts)
                .map_err(|_| Error::invalid("more than 2^32 faces and edges: divide the scene"))?;
            parts += u64::from(geometry.part_count());
            instance.geometry = geometry;
            instance.palette = Arc::new([]);
            instance.material = 0;
        }
        if parts >= u64::from(u32::MAX) {
            return Err(Error::invalid("more than 2^32 faces and edges: divide the scene"));
        }
        Ok(scene)
    }
}

fn drawn(geometry: &Geometry, wire: &Wire) -> Result<Geometry> {
    let mut mesh = geometry.mesh().clone();
    mesh.normals.clear();
    mesh.uvs.clear();
    mesh.colors.clear();
    mesh.materials.clear();
    for number in 0..mesh.face_count() {
        let Some(mut face) = mesh.face(number) else { continue };
        face.edge = Some(wire.edge);
        face.sides = super::Sides::default();
        for seal in &mut face.seals {
            seal.edge = Some(wire.edge);
            seal.sides = super::Sides::default();
        }
        mesh.set_face(number, face)?;
    }
    Geometry::new(&mesh)
}
