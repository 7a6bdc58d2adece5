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

/// Whether a point of a polygon's plane lies inside it, by the even-odd rule, or on its outline. Seen along the
/// axis that its normal follows most.
pub fn contains(points: impl Iterator<Item = DVec3> + Clone, normal: DVec3, at: DVec3) -> bool {
    let facing = normal.abs();
    let along = (0..3).max_by(|a, b| facing[*a].total_cmp(&facing[*b])).unwrap_or(1);
    let [u, v] = [(along + 1) % 3, (along + 2) % 3];
    let mut is_inside = false;
    let next = points.clone().skip(1).chain(points.clone().take(1));
    for (a, b) in points.zip(next) {
        let (a, b) = (a - at, b - at);
        let side = a[u] * b[v] - a[v] * b[u];
        let size = (a.abs() + b.abs()).max_element();
        if side.abs() <= 1e-9 * size * size && a[u] * b[u] + a[v] * b[v] <= 0.0 {
            return true;
        }
        if (a[v] > 0.0) != (b[v] > 0.0) && (side > 0.0) == (b[v] > a[v]) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

/// The volume that rings of points enclose, holes among them, below 0 if they run clockwise seen from outside.
/// `None` if they close no body: every edge then belongs to two that run it in opposite directions.
pub fn volume<R: Iterator<Item = DVec3> + Clone>(
    rings: impl Iterator<Item = R> + Clone,
) -> Option<f64> {
    let origin = rings.clone().find_map(|mut ring| ring.next())?;
    let bits = |p: DVec3| p.to_array().map(f64::to_bits);
    let mut edges: Vec<_> = rings
        .clone()
        .flat_map(|ring| {
            let next = ring.clone().skip(1).chain(ring.clone().take(1));
            ring.zip(next).map(|(a, b)| (bits(a), bits(b)))
        })
        .collect();
    edges.sort_unstable();
    let is_closed = edges.iter().all(|(a, b)| edges.binary_search(&(*b, *a)).is_ok())
        && edges.windows(2).all(|pair| pair[0] != pair[1]);
    let cone = |ring: R| {
        let points = ring.map(|point| point - origin);
        points.clone().next().map_or(0.0, |first| first.dot(area_vector(points)))
    };
    is_closed.then(|| rings.map(cone).sum::<f64>() / 6.0)
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
