//! Polygons in space: what faces and lights made of them share.

mod cone;
mod region;

pub(crate) use cone::{Cone, is_part, split};
use glam::DVec3;
pub(crate) use region::{Area, Corner, areas, triangles};

/// Twice the area of a polygon times its normal (Newell): right for concave polygons, and the best
/// fit to one that is not planar.
pub(crate) fn area_vector(points: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let Some(origin) = points.clone().next() else { return DVec3::ZERO };
    let next = points.clone().skip(1);
    // From the first corner, so that a far origin costs no digits. The last edge ends there and
    // adds nothing.
    points.zip(next).map(|(p, q)| (p - origin).cross(q - origin)).sum()
}

/// The unit normal of a polygon's plane, to its front. An outline that crosses itself may enclose as
/// much one way round as the other; its plane then is that of its widest corner. `None` if all points
/// lie on a line.
pub(crate) fn plane_normal(points: impl Iterator<Item = DVec3> + Clone) -> Option<DVec3> {
    let area = area_vector(points.clone());
    let origin = points.clone().next()?;
    let reach = points.clone().map(|p| (p - origin).length_squared()).fold(0.0, f64::max);
    if area.length() > 1e-12 * reach {
        return area.try_normalize();
    }
    let far = points.clone().max_by(|p, q| {
        let from = |p: &DVec3| (*p - origin).length_squared();
        from(p).total_cmp(&from(q))
    })?;
    let corner = |p: DVec3| (far - origin).cross(p - origin);
    let widest =
        points.map(corner).max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?;
    if widest.length() > 1e-12 * reach { widest.try_normalize() } else { None }
}

/// Whether a point of a polygon's plane lies inside it, by the even-odd rule, or on its outline. Seen along the
/// axis that its normal follows most.
pub(crate) fn contains(
    points: impl Iterator<Item = DVec3> + Clone,
    normal: DVec3,
    at: DVec3,
) -> bool {
    let facing = normal.abs();
    // Dropping the largest axis of the normal shrinks the polygon least.
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
        // Half open in v: a corner at the height of the point counts for one of its edges.
        if (a[v] > 0.0) != (b[v] > 0.0) && (side > 0.0) == (b[v] > a[v]) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

/// The volume that rings of points enclose, holes among them, below 0 if they run clockwise seen from outside.
/// `None` if they close no body: every edge then belongs to two that run it in opposite directions.
pub(crate) fn volume<R: Iterator<Item = DVec3> + Clone>(
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
    // Each edge has its reverse, and none comes twice.
    let is_closed = edges.iter().all(|(a, b)| edges.binary_search(&(*b, *a)).is_ok())
        && edges.windows(2).all(|pair| pair[0] != pair[1]);
    let cone = |ring: R| {
        let points = ring.map(|point| point - origin);
        points.clone().next().map_or(0.0, |first| first.dot(area_vector(points)))
    };
    is_closed.then(|| rings.map(cone).sum::<f64>() / 6.0)
}
