//! The faces of an object, and the lists of the file that they refer to.

use glam::{DVec3, Vec2, Vec3};
use std::collections::HashMap;

use super::super::super::mesh::Mesh;
use super::super::words::Words;
use crate::error::Result;

/// The file's shared lists.
#[derive(Default)]
pub(super) struct Lists {
    pub(super) points: Vec<DVec3>,
    pub(super) colors: Vec<[f32; 4]>,
    /// The colour of each point, up to the last one that has any; [`NONE`] where there is none.
    color_of: Vec<u32>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
}

impl Lists {
    /// Adds a vertex: a point and, perhaps, a colour. Returns what of it is not shown.
    pub(super) fn vertex(&mut self, words: &mut Words<'_>) -> Result<Option<&'static str>> {
        let point = DVec3::from(words.numbers::<3>()?);
        self.points.push(point);
        let left = words.left();
        if left >= 3 {
            let [r, g, b] = words.numbers::<3>()?;
            // Files may have colours for some of their vertices only.
            self.color_of.resize(self.points.len() - 1, NONE);
            self.color_of.push(self.colors.len() as u32);
            self.colors.push([r as f32, g as f32, b as f32, 1.0]);
        }
        let rest: Vec<&str> = words.collect();
        // A weight counts in curves only.
        Ok(match rest.len() {
            0 | 1 if left < 3 => None,
            0 => None,
            _ => Some("vertices have numbers that are not read"),
        })
    }

    fn color(&self, point: u32) -> Option<[f32; 4]> {
        self.colors.get(*self.color_of.get(point as usize)? as usize).copied()
    }
}

const NONE: u32 = u32::MAX;

/// A corner as the file has it: point, texture coordinates, normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// An object under construction.
#[derive(Default)]
pub(super) struct Part {
    pub(super) name: String,
    corners: Vec<Corner>,
    known: HashMap<Corner, u32>,
    pub(super) faces: Vec<(Vec<u32>, Option<u32>)>,
    pub(super) materials: Vec<String>,
}

impl Part {
    pub(super) fn new(name: &str) -> Part {
        Part { name: name.to_owned(), ..Part::default() }
    }

    /// Adds a face: corners such as `1`, `1/2`, `1//3` or `1/2/3`, from 1, or from -1 backwards. Normals and
    /// texture coordinates that do not exist are left out, and told.
    pub(super) fn face(
        &mut self,
        lists: &Lists,
        words: &mut Words<'_>,
        material: Option<&str>,
    ) -> Result<Option<&'static str>> {
        let mut outline = Vec::new();
        let mut told = None;
        let start = words.clone();
        while let Some(word) = words.next() {
            let mut fields = word.split('/');
            let no_corner =
                || words.fault(word, format!("\"{word}\" is not a corner such as 1/2/3"));
            let mut field =
                |what: &str, count: usize, lost: Option<&'static str>| -> Result<Option<u32>> {
                    let Some(text) = fields.next().filter(|text| !text.is_empty()) else {
                        return Ok(None);
                    };
                    let index: i64 = text.parse().map_err(|_| no_corner())?;
                    // -1 is the last of those so far, not of the whole file.
                    let place = if index < 0 { count as i64 + index } else { index - 1 };
                    if index == 0 || !(0..count as i64).contains(&place) {
                        // Without a point there is no corner, but without a normal there is a flat
                        // one.
                        if lost.is_some() {
                            told = lost;
                            return Ok(None);
                        }
                        let message =
                            format!("{what} {index} does not exist: the file has {count} so far");
                        return Err(words.fault(word, message));
                    }
                    Ok(Some(place as u32))
                };
            let point = field("vertex", lists.points.len(), None)?;
            let no_uv = Some("faces use texture coordinates that do not exist, which are left out");
            let uv = field("texture coordinate", lists.uvs.len(), no_uv)?;
            let no_normal = Some("faces use normals that do not exist, which are left out");
            let normal = field("normal", lists.normals.len(), no_normal)?;
            if fields.next().is_some() {
                return Err(no_corner());
            }
            let point = point.ok_or_else(|| words.fault(word, "a corner without a vertex"))?;
            outline.push(self.corner((point, uv, normal)));
        }
        if outline.len() < 3 {
            let found = outline.len();
            return Err(
                start.fault_here(format!("a face with {found} corners: it needs 3 or more"))
            );
        }
        let front = material.map(|name| {
            let known = self.materials.iter().position(|known| known == name);
            known.unwrap_or_else(|| {
                self.materials.push(name.to_owned());
                self.materials.len() - 1
            }) as u32
        });
        self.faces.push((outline, front));
        Ok(told)
    }

    fn corner(&mut self, corner: Corner) -> u32 {
        let next = self.corners.len() as u32;
        // One vertex for each combination: the format counts points, coordinates and normals apart.
        *self.known.entry(corner).or_insert_with(|| {
            self.corners.push(corner);
            next
        })
    }

    /// Whether all corners of the last face have normals.
    pub(super) fn last_has_normals(&self) -> bool {
        let last = self.faces.last().map_or(&[][..], |(outline, _)| outline);
        last.iter().all(|corner| self.corners[*corner as usize].2.is_some())
    }

    /// Whether some vertex has a colour.
    pub(super) fn has_colors(&self, lists: &Lists) -> bool {
        self.corners.iter().any(|corner| lists.color(corner.0).is_some())
    }

    /// How many faces of some of the materials lack texture coordinates.
    pub(super) fn faces_without_uvs(&self, materials: &[bool]) -> usize {
        let lacks = |(outline, front): &&(Vec<u32>, Option<u32>)| {
            front.is_some_and(|front| materials[front as usize])
                && outline.iter().any(|corner| self.corners[*corner as usize].1.is_none())
        };
        self.faces.iter().filter(lacks).count()
    }

    /// The mesh. Where only some corners have normals the others have none, 0, so that their faces are flat.
    pub(super) fn into_mesh(self, lists: &Lists) -> Result<Mesh> {
        let has_colors = self.has_colors(lists);
        let mut mesh = Mesh { materials: self.materials, ..Mesh::default() };
        let corners = &self.corners;
        mesh.points = corners.iter().map(|c| lists.points[c.0 as usize]).collect();
        if corners.iter().any(|c| c.2.is_some()) {
            let normal =
                |c: &Corner| c.2.map_or(Vec3::ZERO, |normal| lists.normals[normal as usize]);
            mesh.normals = corners.iter().map(normal).collect();
        }
        if corners.iter().any(|c| c.1.is_some()) {
            let uv = |c: &Corner| c.1.map_or(Vec2::ZERO, |uv| lists.uvs[uv as usize]);
            mesh.uvs = corners.iter().map(uv).collect();
        }
        if has_colors {
            let color = |c: &Corner| lists.color(c.0).unwrap_or([1.0; 4]);
            mesh.colors = corners.iter().map(color).collect();
        }
        for (outline, front) in &self.faces {
            mesh.add_polygon(outline, *front)?;
        }
        mesh.validate()?;
        Ok(mesh)
    }
}
