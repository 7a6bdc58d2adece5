//! The planes of faces: one for all faces of a mesh that lie in it.

use glam::DVec3;
use std::collections::HashMap;

use super::{COPLANARITY, Support, TURNED};
use crate::polygon;
use crate::scene::mesh::Mesh;

/// The noise of double-precision coordinates, as a share of themselves.
const ROUNDED: f64 = 1e-15;

/// Finds the planes of faces, one for all faces that lie in it.
pub(super) fn shared(mesh: &Mesh) -> (Vec<Support>, Vec<u32>) {
    let outline = |at: usize| mesh.outline(at).iter().map(|corner| mesh.points[*corner as usize]);
    // A face's own reach from the middle of the mesh, so that one stray vertex makes no others coplanar, nor does a
    // far origin; buckets by what is usual.
    let centre = median(&mesh.points);
    let far = |p: DVec3| (p - centre).abs().max_element();
    let reach = |at: usize| outline(at).map(far).fold(0.0, f64::max);
    // How coordinates are rounded tells their precision.
    let is_single = |at: usize| outline(at).all(|p| p.as_vec3().as_dvec3() == p);
    let noise = |at: usize| {
        let size = outline(at).map(|p| p.abs().max_element()).fold(0.0, f64::max);
        size * if is_single(at) { COPLANARITY } else { ROUNDED }
    };
    let mut reaches: Vec<f64> = (0..mesh.face_count()).map(reach).collect();
    let middle = reaches.len() / 2;
    let usual = match reaches.is_empty() {
        true => 0.0,
        false => *reaches.select_nth_unstable_by(middle, f64::total_cmp).1,
    };
    // Much wider than the tolerance, so that a plane is seldom near a border; and never 0.
    let width = (usual * COPLANARITY * 1e4).max(1e-300);
    let mut supports: Vec<Support> = Vec::new();
    let mut support_of = Vec::with_capacity(mesh.face_count());
    let mut buckets: HashMap<[i64; 4], Vec<u32>> = HashMap::new();
    // Planes that are one fall into one bucket or into neighbouring ones.
    let bucket = |support: &Support| {
        // Three digits of the normal and the distance from the middle: rough, as the test of the
        // corners below decides.
        let offset = (support.point - centre).dot(support.normal) / width;
        let n = support.normal * 1e3;
        [n.x, n.y, n.z, offset]
    };
    for at in 0..mesh.face_count() {
        let points = || outline(at);
        let normal = polygon::plane_normal(points()).unwrap_or(DVec3::Y);
        let point = point_of(points(), normal);
        // Both: the noise relative to the mesh, and that of coordinates far from the origin.
        let tolerance = COPLANARITY * reach(at) + noise(at);
        let support = Support { point, normal };
        let turned = Support { point, normal: -normal };
        // Two sheets back to back lie in one plane too: the known plane may look the other way.
        let known = [(&support, 0), (&turned, TURNED)].into_iter().find_map(|(support, turned)| {
            let found = neighbours(bucket(support)).find_map(|key| {
                buckets.get(&key)?.iter().copied().find(|candidate| {
                    let other = &supports[*candidate as usize];
                    other.normal.dot(support.normal) > 0.0
                        // Corners, not normals: the normal of a sliver is noise, but its corners
                        // lie where they lie.
                        && points().all(|p| (p - other.point).dot(other.normal).abs() <= tolerance)
                })
            });
            found.map(|index| index | turned)
        });
        let index = known.unwrap_or_else(|| {
            let key = bucket(&support).map(|v| v.floor() as i64);
            let index = supports.len() as u32;
            supports.push(support);
            buckets.entry(key).or_default().push(index);
            index
        });
        support_of.push(index);
    }
    (supports, support_of)
}

/// The middle of points, by coordinate: half of all lie to either side.
fn median(points: &[DVec3]) -> DVec3 {
    let middle = |axis: usize| {
        let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
        let half = values.len() / 2;
        if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(half, f64::total_cmp).1 }
    };
    DVec3::new(middle(0), middle(1), middle(2))
}

/// The point of a face's plane, through the middle of its corners, that lies at the corner nearest to
/// the origin: as exact as can be, where the middle of a face that reaches very far would not be.
fn point_of(points: impl Iterator<Item = DVec3> + Clone, normal: DVec3) -> DVec3 {
    let size = |p: &DVec3| p.abs().max_element();
    let nearest = points.clone().min_by(|p, q| size(p).total_cmp(&size(q)));
    let nearest = nearest.unwrap_or(DVec3::ZERO);
    let count = points.clone().count().max(1) as f64;
    // Differences are small where coordinates are large, so the mean loses no digits.
    let offset = points.map(|p| (p - nearest).dot(normal)).sum::<f64>() / count;
    nearest + normal * offset
}

/// The bucket of a value, and those whose border it is near.
fn neighbours(values: [f64; 4]) -> impl Iterator<Item = [i64; 4]> {
    let near = values.map(|v| {
        let (cell, within) = (v.floor(), v - v.floor());
        // A value within a hundredth of a border may be the other side's, by rounding.
        let other = if within < 0.01 { -1 } else { i64::from(within > 0.99) };
        (cell as i64, other)
    });
    // Each bit says whether an axis is moved to its neighbour. Mostly only mask 0 is left.
    (0..16u32).filter_map(move |mask| {
        let mut key = [0; 4];
        for (i, (cell, other)) in near.iter().enumerate() {
            let moved = mask >> i & 1 == 1;
            if moved && *other == 0 {
                return None;
            }
            key[i] = cell.saturating_add(if moved { *other } else { 0 });
        }
        Some(key)
    })
}
