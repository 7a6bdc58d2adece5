//! Normals for meshes that come without: smooth where faces meet at a small angle, creased elsewhere.

use glam::DVec3;
use std::collections::HashMap;

use super::face::Outline;
use super::mesh::Mesh;
use crate::math;
use crate::polygon::area_vector;

impl Mesh {
    /// Gives every vertex a normal: the mean, by area, of the faces around it that meet the vertex's
    /// own face at less than `crease` degrees. Vertices on creases are doubled. A mesh that has normals
    /// keeps them.
    pub fn smooth(&mut self, crease: f64) {
        if !self.normals.is_empty() || self.points.is_empty() {
            return;
        }
        let cos = math::cos(crease.to_radians());
        // The length is the area, so that sums of these are weighted by it.
        let areas: Vec<DVec3> = (0..self.face_count())
            .map(|at| area_vector(self.outline(at).iter().map(|c| self.points[*c as usize])))
            .collect();
        let normals: Vec<DVec3> = areas.iter().map(|a| a.normalize_or_zero()).collect();
        // By place, not by number: seams of textures double vertices, and shading must not show
        // them.
        let place = |corner: u32| self.points[corner as usize].to_array().map(f64::to_bits);
        let mut around: HashMap<[u64; 3], Vec<usize>> = HashMap::new();
        for at in 0..self.face_count() {
            for corner in self.outline(at) {
                around.entry(place(*corner)).or_default().push(at);
            }
        }

        let mut smooth = Mesh { materials: self.materials.clone(), ..Mesh::default() };
        let mut known: HashMap<(u32, [u32; 3]), u32> = HashMap::new();
        let mut vertex = |smooth: &mut Mesh, corner: u32, normal: DVec3| -> u32 {
            let normal = normal.as_vec3();
            let next = smooth.points.len() as u32;
            // Faces with the same mean share a vertex. On a crease each side gets its own.
            *known.entry((corner, normal.to_array().map(f32::to_bits))).or_insert_with(|| {
                let i = corner as usize;
                smooth.points.push(self.points[i]);
                smooth.normals.push(normal);
                smooth.uvs.extend(self.uvs.get(i));
                smooth.colors.extend(self.colors.get(i));
                next
            })
        };
        for at in 0..self.face_count() {
            let own = normals[at];
            let mean = |corner: u32| -> DVec3 {
                let near =
                    around[&place(corner)].iter().filter(|other| normals[**other].dot(own) >= cos);
                near.map(|other| areas[*other]).sum::<DVec3>().try_normalize().unwrap_or(own)
            };
            let Some(mut face) = self.face(at) else { continue };
            face.outline = face.outline.iter().map(|c| vertex(&mut smooth, *c, mean(*c))).collect();
            // Only outlines meet other faces. Within a face, its own normal holds.
            let mut flat = |ring: &Outline| -> Outline {
                ring.iter().map(|c| vertex(&mut smooth, *c, own)).collect()
            };
            face.holes = face.holes.iter().map(&mut flat).collect();
            for seal in &mut face.seals {
                seal.outline = flat(&seal.outline);
            }
            // The face was one of a mesh with the same vertices.
            smooth.add_face(face).expect("corners were just added");
        }
        *self = smooth;
    }
}

#[cfg(test)]
mod tests {
    use super::super::shape::Shape;

    #[test]
    fn edges_sharper_than_the_crease_stay_sharp() {
        let cube = Shape::Box { size: [1.0, 1.0, 1.0] }.mesh().unwrap();
        let (mut sharp, mut round) = (cube.clone(), cube);
        sharp.smooth(60.0);
        round.smooth(100.0);
        assert_eq!(sharp.points.len(), 24);
        assert_eq!(round.points.len(), 8);
        for at in 0..6 {
            let corner = round.outline(at)[0] as usize;
            let (normal, point) = (round.normals[corner], round.points[corner]);
            assert!((normal.length() - 1.0).abs() < 1e-6);
            assert!(normal.as_dvec3().dot(point - glam::DVec3::new(0.0, 0.5, 0.0)) > 0.8);
        }
    }
}
