//! Meshes in files: readable in text; in binary, plain polygons are flat lists.

use glam::{DVec3, Vec2, Vec3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::face::Face;
use super::mesh::Mesh;
use crate::error::{Error, Result};

/// A mesh as files hold it: readable as text; binary files hold the outlines as two flat lists.
#[derive(Default, Serialize, Deserialize)]
#[serde(rename = "Faces", deny_unknown_fields, default)]
struct InFile {
    points: Vec<DVec3>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    normals: Vec<Vec3>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    uvs: Vec<Vec2>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    colors: Vec<[f32; 4]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    materials: Vec<String>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    faces: Vec<Face>,
    /// Plain polygons: their corners one after another, their lengths, their materials plus one. A
    /// length of 0 stands for the next of `faces`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    corners: Vec<u32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    lengths: Vec<u32>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    fronts: Vec<u32>,
}

impl Serialize for Mesh {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut file = InFile {
            points: self.points.clone(),
            normals: self.normals.clone(),
            uvs: self.uvs.clone(),
            colors: self.colors.clone(),
            materials: self.materials.clone(),
            ..InFile::default()
        };
        let flat = !serializer.is_human_readable();
        for at in 0..self.face_count() {
            if flat && self.is_plain(at) {
                file.corners.extend_from_slice(self.outline(at));
                file.lengths.push(self.outline(at).len() as u32);
                file.fronts.push(self.sides(at).front.map_or(0, |front| front + 1));
            } else {
                file.faces.extend(self.face(at));
                if flat {
                    file.lengths.push(0);
                    file.fronts.push(0);
                }
            }
        }
        file.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Mesh {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Mesh, D::Error> {
        let file = InFile::deserialize(deserializer)?;
        file.into_mesh().map_err(serde::de::Error::custom)
    }
}

impl InFile {
    fn into_mesh(self) -> Result<Mesh> {
        let InFile { points, normals, uvs, colors, materials, faces, corners, lengths, fronts } =
            self;
        let mut mesh = Mesh { points, normals, uvs, colors, materials, ..Mesh::default() };
        let mut faces = faces.into_iter();
        let mut rest = &corners[..];
        if lengths.len() != fronts.len() {
            return Err(Error::invalid("the lists `lengths` and `fronts` differ in length"));
        }
        for (length, front) in lengths.into_iter().zip(fronts) {
            if length == 0 {
                let face = faces.next().ok_or_else(|| Error::invalid("`faces` ends too soon"))?;
                mesh.add_face(face)?;
            } else {
                let (outline, tail) = rest
                    .split_at_checked(length as usize)
                    .ok_or_else(|| Error::invalid("the list `corners` ends too soon"))?;
                mesh.add_polygon(outline, front.checked_sub(1))?;
                rest = tail;
            }
        }
        for face in faces {
            mesh.add_face(face)?;
        }
        mesh.validate()?;
        Ok(mesh)
    }
}
