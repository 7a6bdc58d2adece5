//! Meshes: an object's faces over shared vertices. Curved surfaces are triangles whose vertices carry
//! normals (\[N], "Image data structure").

use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;

use super::face::{Back, EdgeStyle, Face, Outline, Seal, Sides};
use crate::error::{Error, Result};

/// An object's faces over shared vertices.
///
/// Vertices are points in metres in the object's space; normals, texture coordinates and colours are
/// either absent or given for every vertex. A face is reached by its index; removing one moves those
/// after it down.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The vertices' places.
    pub points: Vec<DVec3>,
    /// The vertices' normals; empty where faces are flat.
    pub normals: Vec<Vec3>,
    /// The vertices' texture coordinates, v upwards; or empty.
    pub uvs: Vec<Vec2>,
    /// The vertices' scene-linear colours with alpha, which multiply the material's; or empty.
    pub colors: Vec<[f32; 4]>,
    /// The materials that the faces' indices mean, by name in the document.
    pub materials: Vec<String>,
    pub(super) faces: Vec<Stored>,
    pub(super) corners: Vec<u32>,
    /// What only few faces have.
    pub(super) details: BTreeMap<u32, Details>,
}

/// A face in the pool: its outline, and the front's material.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored {
    first: u32,
    len: u32,
    front: Option<u32>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Details {
    holes: Vec<Outline>,
    seals: Vec<Seal>,
    back: Back,
    edge: Option<EdgeStyle>,
}

impl PartialEq for Mesh {
    fn eq(&self, other: &Mesh) -> bool {
        self.points == other.points
            && self.normals == other.normals
            && self.uvs == other.uvs
            && self.colors == other.colors
            && self.materials == other.materials
            && self.faces.len() == other.faces.len()
            && self.details == other.details
            && (0..self.faces.len()).all(|at| {
                self.outline(at) == other.outline(at)
                    && self.faces[at].front == other.faces[at].front
            })
    }
}

impl Mesh {
    /// Adds a vertex and returns its index. Only for meshes without normals, coordinates and colours;
    /// others fill the public lists.
    pub fn add_point(&mut self, point: impl Into<DVec3>) -> u32 {
        self.points.push(point.into());
        self.points.len() as u32 - 1
    }

    /// The number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// Adds a face and returns its index.
    ///
    /// # Errors
    /// If a polygon has fewer than three corners or a corner is not a vertex of the mesh.
    pub fn add_face(&mut self, face: Face) -> Result<usize> {
        self.check(&face)?;
        let stored = self.store(&face.outline, face.sides.front);
        self.faces.push(stored);
        let at = self.faces.len() - 1;
        self.set_details(at, face);
        Ok(at)
    }

    /// Adds a plain polygon: no holes, no seals, both sides alike.
    ///
    /// # Errors
    /// As [`add_face`](Mesh::add_face).
    pub fn add_polygon(&mut self, outline: &[u32], front: Option<u32>) -> Result<usize> {
        self.check_outline(outline)?;
        let stored = self.store(outline, front);
        self.faces.push(stored);
        Ok(self.faces.len() - 1)
    }

    /// Makes room for so many more faces, and corners of all of them.
    pub fn reserve(&mut self, faces: usize, corners: usize) {
        self.faces.reserve_exact(faces);
        self.corners.reserve_exact(corners);
    }

    /// A face as a value.
    pub fn face(&self, at: usize) -> Option<Face> {
        let stored = self.faces.get(at)?;
        let Details { holes, seals, back, edge } = self.details(at).cloned().unwrap_or_default();
        let outline = self.outline(at).to_vec();
        Some(Face { outline, holes, seals, sides: Sides { front: stored.front, back }, edge })
    }

    /// All faces, in order, as values.
    pub fn faces(&self) -> impl Iterator<Item = Face> + '_ {
        (0..self.faces.len()).filter_map(|at| self.face(at))
    }

    /// Replaces a face.
    ///
    /// # Errors
    /// As [`add_face`](Mesh::add_face), or if there is no such face.
    pub fn set_face(&mut self, at: usize, face: Face) -> Result<()> {
        if at >= self.faces.len() {
            return Err(Error::invalid(format!("no face {at}: the mesh has {}", self.faces.len())));
        }
        self.check(&face)?;
        self.faces[at] = self.store(&face.outline, face.sides.front);
        self.set_details(at, face);
        Ok(())
    }

    /// Removes a face and returns it; those after it move down by one.
    pub fn remove_face(&mut self, at: usize) -> Option<Face> {
        let face = self.face(at)?;
        self.faces.remove(at);
        let old = std::mem::take(&mut self.details);
        let keep = old.into_iter().filter(|(i, _)| *i as usize != at);
        self.details = keep.map(|(i, d)| (if i as usize > at { i - 1 } else { i }, d)).collect();
        Some(face)
    }

    /// The outline of a face.
    pub fn outline(&self, at: usize) -> &[u32] {
        let Stored { first, len, .. } = self.faces[at];
        &self.corners[first as usize..(first + len) as usize]
    }

    /// A face's holes.
    pub fn holes(&self, at: usize) -> &[Outline] {
        self.details(at).map_or(&[], |details| &details.holes)
    }

    /// A face's seals.
    pub fn seals(&self, at: usize) -> &[Seal] {
        self.details(at).map_or(&[], |details| &details.seals)
    }

    /// A face's attributes.
    pub fn sides(&self, at: usize) -> Sides {
        let back = self.details(at).map_or(Back::Same, |details| details.back);
        Sides { front: self.faces[at].front, back }
    }

    /// How a face's edges are drawn.
    pub fn edge(&self, at: usize) -> Option<EdgeStyle> {
        self.details(at).and_then(|details| details.edge)
    }

    /// Whether any face has seals or drawn edges, so that it makes more than one entry in a span
    /// image's table.
    pub fn has_parts(&self) -> bool {
        self.details.values().any(|details| !details.seals.is_empty() || details.edge.is_some())
    }

    /// Bytes held, about.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.points)
            + size_of_val(&*self.normals)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.colors)
            + size_of_val(&*self.faces)
            + size_of_val(&*self.corners)
            + self.details.len() * size_of::<Details>()
    }

    /// Puts a mesh's vertices and faces behind this one's. Lists that only one of them has are dropped.
    ///
    /// # Errors
    /// If the mesh would have 2^32 vertices or more.
    pub fn append(&mut self, other: &Mesh) -> Result<()> {
        let offset = u32::try_from(self.points.len())
            .ok()
            .filter(|o| o.checked_add(other.points.len() as u32).is_some())
            .ok_or_else(|| Error::invalid("a mesh with more than 2^32 vertices"))?;
        let palette: Vec<u32> = other.materials.iter().map(|name| self.material(name)).collect();
        let both = |a: usize, b: usize| (self.points.is_empty() || a > 0) && b > 0;
        let keeps = (
            both(self.normals.len(), other.normals.len()),
            both(self.uvs.len(), other.uvs.len()),
            both(self.colors.len(), other.colors.len()),
        );
        self.points.extend_from_slice(&other.points);
        join(&mut self.normals, &other.normals, keeps.0);
        join(&mut self.uvs, &other.uvs, keeps.1);
        join(&mut self.colors, &other.colors, keeps.2);
        let moved = |outline: &Outline| outline.iter().map(|i| i + offset).collect::<Outline>();
        let renamed = |i: u32| palette.get(i as usize).copied().unwrap_or(i);
        let sides = |sides: Sides| Sides {
            front: sides.front.map(renamed),
            back: match sides.back {
                Back::Material(i) => Back::Material(renamed(i)),
                other => other,
            },
        };
        for face in other.faces() {
            self.add_face(Face {
                outline: moved(&face.outline),
                holes: face.holes.iter().map(moved).collect(),
                seals: face
                    .seals
                    .iter()
                    .map(|s| Seal {
                        outline: moved(&s.outline),
                        sides: sides(s.sides),
                        edge: s.edge,
                    })
                    .collect(),
                sides: sides(face.sides),
                edge: face.edge,
            })?;
        }
        Ok(())
    }

    /// The index of a material in this mesh, added if it is new.
    pub fn material(&mut self, name: &str) -> u32 {
        let known = self.materials.iter().position(|known| known == name);
        known.unwrap_or_else(|| {
            self.materials.push(name.to_owned());
            self.materials.len() - 1
        }) as u32
    }

    /// Checks what the types cannot say.
    ///
    /// # Errors
    /// If a number is not finite or a list is neither empty nor as long as the points.
    pub fn validate(&self) -> Result<()> {
        let n = self.points.len();
        for (name, len) in [
            ("normals", self.normals.len()),
            ("uvs", self.uvs.len()),
            ("colors", self.colors.len()),
        ] {
            if len != 0 && len != n {
                return Err(Error::invalid(format!(
                    "{len} {name} for {n} points: give all or none"
                )));
            }
        }
        if let Some(at) = self.points.iter().position(|p| !p.is_finite()) {
            return Err(Error::invalid(format!("vertex {at} has a coordinate that is not finite")));
        }
        let finite = self.normals.iter().all(|v| v.is_finite())
            && self.uvs.iter().all(|v| v.is_finite())
            && self.colors.iter().all(|c| c.iter().all(|v| v.is_finite()));
        if !finite {
            return Err(Error::invalid("a vertex has a normal, uv or colour that is not finite"));
        }
        Ok(())
    }

    fn store(&mut self, outline: &[u32], front: Option<u32>) -> Stored {
        let first = self.corners.len() as u32;
        self.corners.extend_from_slice(outline);
        Stored { first, len: outline.len() as u32, front }
    }

    /// Whether a face is a plain polygon: no holes, no seals, no drawn edges, both sides alike.
    pub fn is_plain(&self, at: usize) -> bool {
        self.details(at).is_none()
    }

    fn details(&self, at: usize) -> Option<&Details> {
        if self.details.is_empty() { None } else { self.details.get(&(at as u32)) }
    }

    fn set_details(&mut self, at: usize, face: Face) {
        let Face { holes, seals, sides, edge, .. } = face;
        let details = Details { holes, seals, back: sides.back, edge };
        if details == Details::default() {
            self.details.remove(&(at as u32));
        } else {
            self.details.insert(at as u32, details);
        }
    }

    fn check(&self, face: &Face) -> Result<()> {
        self.check_outline(&face.outline)?;
        face.holes.iter().try_for_each(|hole| self.check_outline(hole))?;
        face.seals.iter().try_for_each(|seal| self.check_outline(&seal.outline))?;
        let edges = face.seals.iter().map(|seal| seal.edge).chain([face.edge]).flatten();
        for edge in edges {
            if !(edge.width > 0.0 && edge.width <= 1e4 && edge.color.is_finite()) {
                return Err(Error::invalid(format!(
                    "an edge {} pixels wide: the width must be above 0 and at most 10000",
                    edge.width
                )));
            }
        }
        Ok(())
    }

    fn check_outline(&self, outline: &[u32]) -> Result<()> {
        if outline.len() < 3 {
            return Err(Error::invalid(format!(
                "a polygon with {} corners: it needs at least 3",
                outline.len()
            )));
        }
        let n = self.points.len();
        match outline.iter().find(|corner| **corner as usize >= n) {
            Some(bad) => Err(Error::invalid(format!("corner {bad} of a mesh with {n} vertices"))),
            None => Ok(()),
        }
    }
}

fn join<T: Clone>(into: &mut Vec<T>, from: &[T], keep: bool) {
    if keep { into.extend_from_slice(from) } else { into.clear() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> Mesh {
        let mut mesh = Mesh::default();
        for (x, y) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            mesh.add_point([x, y, 0.0]);
        }
        mesh
    }

    #[test]
    fn faces_are_built_read_changed_and_removed() {
        let mut mesh = square();
        let seal = Seal { outline: vec![0, 1, 2], ..Seal::default() };
        let plain = Face { outline: vec![0, 1, 2, 3], ..Face::default() };
        let sealed = Face { seals: vec![seal], ..plain.clone() };
        assert_eq!(mesh.add_face(plain.clone()).unwrap(), 0);
        assert_eq!(mesh.add_face(sealed.clone()).unwrap(), 1);
        assert_eq!(mesh.add_polygon(&[0, 1, 3], Some(2)).unwrap(), 2);
        assert_eq!(mesh.face(1), Some(sealed.clone()));
        mesh.set_face(0, sealed.clone()).unwrap();
        assert_eq!(mesh.remove_face(1), Some(sealed.clone()));
        assert_eq!(mesh.faces().collect::<Vec<_>>()[0], sealed);
        assert_eq!(mesh.sides(1).front, Some(2));
        assert!(mesh.set_face(7, plain).is_err());
    }

    #[test]
    fn polygons_that_cannot_be_are_refused() {
        let mut mesh = square();
        assert!(mesh.add_polygon(&[0, 1], None).is_err());
        assert!(mesh.add_polygon(&[0, 1, 4], None).is_err());
        let hole = Face { outline: vec![0, 1, 2], holes: vec![vec![0, 1, 9]], ..Face::default() };
        assert!(mesh.add_face(hole).is_err());
    }
}
