//! What a point sees of a convex polygon behind others: the polygon without their cones.
//!
//! The cone of a convex piece, seen from a point, is bounded by planes through the point and the piece's
//! edges and by the piece's own plane. Cutting convex parts by planes leaves convex parts, whatever the
//! order, and nothing is counted. All points here are relative to the one that sees.

use glam::DVec3;

/// The space behind a piece: where all planes, a normal and an offset each, are above 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct Cone(Vec<(DVec3, f64)>);

impl Cone {
    /// Makes it the cone of a piece with a normal; false if the piece is seen edge-on, and hides nothing.
    pub(crate) fn behind(
        &mut self,
        normal: DVec3,
        mut corners: impl Iterator<Item = DVec3>,
    ) -> bool {
        let planes = &mut self.0;
        planes.clear();
        let Some(first) = corners.next() else { return false };
        let away = normal.dot(first);
        if away.is_nan() || away.abs() <= 1e-12 * normal.length() * first.length() {
            return false;
        }
        let sign = away.signum();
        // Farther than the piece by more than rounding: a face is not before itself.
        planes.push((normal * sign, -away.abs() * (1.0 + 1e-9)));
        let mut last = first;
        // Each side plane holds the eye and an edge: its offset is 0.
        for corner in corners.chain([first]) {
            let side = last.cross(corner) * sign;
            if side != DVec3::ZERO {
                planes.push((side, 0.0));
            }
            last = corner;
        }
        true
    }

    /// Whether a convex part reaches into it, as far as single planes tell.
    pub(crate) fn meets(&self, part: &[DVec3]) -> bool {
        // It may say yes where no single plane separates the two. Then the cut finds nothing
        // inside.
        let is_outside = |plane| part.iter().all(|point| side(plane, point) <= 0.0);
        !self.0.iter().any(is_outside)
    }

    /// Cuts a convex part: `left` gets what lies outside of the cone; what lies inside, if anything, is returned.
    pub(crate) fn cut(
        &self,
        part: Vec<DVec3>,
        mut left: impl FnMut(Vec<DVec3>),
    ) -> Option<Vec<DVec3>> {
        let mut rest = part;
        for plane in &self.0 {
            if rest.iter().all(|point| side(plane, point) >= 0.0) {
                continue;
            }
            let sides: Vec<f64> = rest.iter().map(|point| side(plane, point)).collect();
            let (inside, outside) = split(&rest, &sides);
            if is_part(&outside) {
                // Outside of this plane is outside of the cone: only the rest is cut by the planes
                // that follow.
                left(outside);
            }
            rest = inside;
            if !is_part(&rest) {
                return None;
            }
        }
        Some(rest)
    }
}

/// On which side of a plane a point is.
fn side((normal, offset): &(DVec3, f64), point: &DVec3) -> f64 {
    normal.dot(*point) + offset
}

/// Whether points make a segment or a polygon.
pub(crate) fn is_part(points: &[DVec3]) -> bool {
    points.len() >= 2 && points.iter().any(|point| *point != points[0])
}

/// The parts of a segment or a convex polygon on both sides of a plane, on which side each corner is being given:
/// that where it is not below 0, and that where it is not above.
pub(crate) fn split(points: &[DVec3], sides: &[f64]) -> (Vec<DVec3>, Vec<DVec3>) {
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    let count = points.len();
    for i in 0..count {
        let (point, side) = (points[i], sides[i]);
        if side >= 0.0 {
            inside.push(point);
        }
        if side <= 0.0 {
            outside.push(point);
        }
        // A segment has one edge.
        let next = (i + 1) % count;
        let is_edge = count > 2 || i == 0;
        if is_edge && side * sides[next] < 0.0 {
            let point = point + (points[next] - point) * (side / (side - sides[next]));
            inside.push(point);
            outside.push(point);
        }
    }
    (inside, outside)
}
