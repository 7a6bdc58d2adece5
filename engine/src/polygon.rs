//! Polygons in space: what faces and lights made of them share.

use earcut::{Earcut, utils3d::project3d_to_2d};
use glam::DVec3;

/// Twice the area of a polygon times its normal (Newell): right for concave polygons, and the best
/// fit to one that is not planar.
pub fn area_vector(points: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let Some(origin) = points.clone().next() else { return DVec3::ZERO };
    let next = points.clone().skip(1);
    points.zip(next).map(|(p, q)| (p - origin).cross(q - origin)).sum()
}

/// Whether a point of a polygon's plane lies inside it, by the even-odd rule.
pub fn contains(points: impl Iterator<Item = DVec3> + Clone, normal: DVec3, at: DVec3) -> bool {
    let size = normal.abs();
    let drop = (0..3).max_by(|a, b| size[*a].total_cmp(&size[*b])).unwrap_or(2);
    let (u, v) = ((drop + 1) % 3, (drop + 2) % 3);
    let flat = points.map(|p| (p[u] - at[u], p[v] - at[v]));
    let next = flat.clone().skip(1).chain(flat.clone().take(1));
    let crossed = flat.zip(next).filter(|((ax, ay), (bx, by))| {
        (*ay > 0.0) != (*by > 0.0) && (ax * by - ay * bx > 0.0) == (by > ay)
    });
    crossed.count() % 2 == 1
}

/// A polygon with holes in triangles, as places among its points: those of the outline, and then those of
/// the holes, each from one of `holes` on. All run the way round that the outline does.
pub fn triangles(points: &[DVec3], holes: &[u32]) -> Vec<[u32; 3]> {
    let Some(origin) = points.first() else { return Vec::new() };
    let outline = &points[..holes.first().map_or(points.len(), |first| *first as usize)];
    let relative: Vec<[f64; 3]> = points.iter().map(|p| (*p - origin).to_array()).collect();
    let (mut flat, mut indices): (Vec<[f64; 2]>, Vec<u32>) = (Vec::new(), Vec::new());
    if project3d_to_2d(&relative, outline.len(), &mut flat) {
        Earcut::new().earcut(flat.iter().copied(), holes, &mut indices);
    }
    let normal = area_vector(outline.iter().copied());
    let turned = |t: [u32; 3]| {
        let area = area_vector(t.iter().map(|i| points[*i as usize]));
        if area.dot(normal) < 0.0 { [t[0], t[2], t[1]] } else { t }
    };
    indices.chunks_exact(3).map(|t| turned([t[0], t[1], t[2]])).collect()
}
