//! Surfaces cut by planes.

use glam::DVec3;
use std::collections::HashMap;

use crate::error::Result;
use crate::scene::Mesh;

/// What a plane leaves of a mesh of triangles: all that does not lie on the side to which its normal points. Where it
/// goes through triangles they end on it, and the surface stays open there, its inside seen.
///
/// # Errors
/// None for meshes of triangles with normals at all vertices, or at none.
pub fn clip(mesh: &Mesh, point: DVec3, normal: DVec3) -> Result<Mesh> {
    let distances: Vec<f64> = mesh.points.iter().map(|p| (*p - point).dot(normal)).collect();
    if distances.iter().all(|distance| *distance <= 0.0) {
        return Ok(mesh.clone());
    }
    let mut cut = Mesh::default();
    cut.materials.clone_from(&mesh.materials);
    let mut kept = vec![None; mesh.points.len()];
    let mut between: HashMap<[u32; 2], u32> = HashMap::new();
    let mut outline = Vec::with_capacity(4);
    for face in 0..mesh.face_count() {
        outline.clear();
        let corners = mesh.outline(face);
        for (at, from) in corners.iter().enumerate() {
            let to = corners[(at + 1) % corners.len()];
            let [here, there] = [*from, to].map(|corner| distances[corner as usize]);
            if here <= 0.0 {
                outline.push(*kept[*from as usize].get_or_insert_with(|| {
                    let from = *from as usize;
                    cut.points.push(mesh.points[from]);
                    cut.normals.extend(mesh.normals.get(from));
                    cut.points.len() as u32 - 1
                }));
            }
            if (here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0) {
                let edge = [*from.min(&to), *from.max(&to)];
                outline.push(*between.entry(edge).or_insert_with(|| {
                    // From the same end for both triangles of an edge.
                    let [a, b] = edge.map(|corner| corner as usize);
                    let share = distances[a] / (distances[a] - distances[b]);
                    cut.points.push(mesh.points[a].lerp(mesh.points[b], share));
                    if let (Some(m), Some(n)) = (mesh.normals.get(a), mesh.normals.get(b)) {
                        cut.normals.push(m.lerp(*n, share as f32).normalize_or(*m));
                    }
                    cut.points.len() as u32 - 1
                }));
            }
        }
        let front = mesh.sides(face).front;
        for pair in outline.get(1..).unwrap_or(&[]).windows(2) {
            cut.add_polygon(&[outline[0], pair[0], pair[1]], front)?;
        }
    }
    Ok(cut)
}
