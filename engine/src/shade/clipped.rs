//! Light that is not in one place, exactly: what a receiver sees of a source is the source without the cones
//! of everything that stands before it, and what is left has a closed form.
//!
//! The cone of a convex piece, seen from the receiver, is bounded by planes through the receiver and the
//! piece's edges and by the piece's own plane: shadow volumes with light and receiver exchanged. Cutting convex
//! parts by planes leaves convex parts, whatever the order, and nothing is counted. The parts of a source
//! behind leaves may become very many; rays then do better.

use glam::DVec3;

use crate::camera::View;
use crate::color::Color;
use crate::fragment::World;
use crate::light::{Light, Receiver};
use crate::shadow;
use crate::trace::{Casters, Shaft, Toward};

/// The most parts of a source that are kept apart.
const MOST_PARTS: usize = 512;

/// A convex part of a source, as seen from the receiver, and how much of its light arrives.
struct Part {
    points: Vec<DVec3>,
    through: f32,
}

/// The irradiance of a receiver that lies on a face with a unit normal `facing`, with everything in the
/// world in the way; `None` if there is too much of it.
pub(super) fn irradiance(
    light: &dyn Light,
    at: &Receiver,
    facing: DVec3,
    world: &World,
    casters: &[(usize, &Casters)],
    view: &View,
) -> Option<Color> {
    let mut sum = Color::BLACK;
    let here = at.position;
    let mut cone = Vec::new();
    for facet in light.facets(at)? {
        // What is behind the face itself is not seen, whatever its interpolated normal says.
        let seen: Vec<DVec3> = facet.iter().map(|point| *point - here).collect();
        let heights: Vec<f64> = seen.iter().map(|point| facing.dot(*point)).collect();
        let (seen, _) = split(&seen, &heights);
        if !is_part(&seen) {
            continue;
        }
        let shaft = shaft(&seen, facing, here);
        let mut parts = vec![Part { points: seen, through: 1.0 }];
        for (member, casters) in casters {
            let surfaces = &*world.members()[*member].surfaces;
            let mut is_too_much = false;
            casters.within(&shaft, |piece| {
                let is_nothing = casters.pieces()[piece].opacity == 0.0;
                if is_nothing || is_too_much || parts.is_empty() {
                    return;
                }
                // Where it differs from place to place how much a piece holds back, parts have no one answer.
                let differs = casters.pieces()[piece].opacity.is_nan();
                let corners = casters.corners(piece, Toward::Point(here));
                let is_outside = |(normal, offset): &(DVec3, f64)| {
                    corners.clone().all(|corner| normal.dot(corner) + offset <= 0.0)
                };
                if shaft.planes.iter().any(is_outside)
                    || shadow::lies_in(casters, piece, (facing, here))
                {
                    return;
                }
                if !cone_of(casters, piece, here, &mut cone) {
                    return;
                }
                // From the end: what is put there is outside of the cone, or what comes through it.
                for i in (0..parts.len()).rev() {
                    if parts[i].meets(&cone) && differs {
                        is_too_much = true;
                        return;
                    }
                    if parts[i].meets(&cone) {
                        let part = parts.swap_remove(i);
                        part.cut(&cone, &mut parts, |point| {
                            let (along, position) = (point, here + point);
                            let met = || shadow::Way { from: here, along, position, width: 0.0 };
                            1.0 - shadow::opacity(surfaces, view, casters, piece, met)
                        });
                    }
                }
                is_too_much = parts.len() > MOST_PARTS;
            });
            if is_too_much {
                return None;
            }
        }
        for Part { points, through } in &parts {
            let points: Vec<DVec3> = points.iter().map(|point| *point + here).collect();
            sum = sum + light.of_facet(&points, at) * *through;
        }
    }
    Some(sum)
}

/// The planes around everything between a receiver and a convex part of a source, which is seen from it at
/// `points`.
fn shaft(points: &[DVec3], facing: DVec3, here: DVec3) -> Shaft {
    let centre = points.iter().sum::<DVec3>() / points.len() as f64;
    // As seen from the receiver: where the sum with an offset is not negative is inside.
    let mut planes = vec![(facing, 0.0)];
    let mut add = |normal: DVec3, offset: f64| {
        let side = normal.dot(centre * 0.5) + offset;
        if side != 0.0 && normal.length() > 0.0 {
            planes.push((normal * side.signum(), offset * side.signum()));
        }
    };
    if let [a, b] = points {
        let across = a.cross(*b);
        add(across.cross(*a), 0.0);
        add(across.cross(*b), 0.0);
        let beyond = across.cross(*b - *a);
        add(beyond, -beyond.dot(*a));
        planes.extend([(across, 0.0), (-across, 0.0)]);
    } else {
        let beyond = (points[1] - points[0]).cross(points[2] - points[0]);
        add(beyond, -beyond.dot(points[0]));
        for (i, point) in points.iter().enumerate() {
            add(point.cross(points[(i + 1) % points.len()]), 0.0);
        }
    }
    let placed = |(normal, offset): (DVec3, f64)| (normal, offset - normal.dot(here));
    Shaft { planes: planes.into_iter().map(placed).collect() }
}

/// The planes of the cone behind a piece as seen from a receiver, the piece's own first; false if it is seen
/// edge-on.
fn cone_of(casters: &Casters, piece: usize, here: DVec3, planes: &mut Vec<(DVec3, f64)>) -> bool {
    planes.clear();
    let toward = Toward::Point(here);
    let normal = casters.normal(piece, toward);
    let mut corners = casters.corners(piece, toward).map(|corner| corner - here);
    let Some(first) = corners.next() else { return false };
    let away = normal.dot(first);
    if away.is_nan() || away.abs() <= 1e-12 * normal.length() * first.length() {
        return false;
    }
    let sign = away.signum();
    // Farther than the piece by more than rounding: the source's own face is not before it.
    let own = normal * sign;
    planes.push((own, -away.abs() * (1.0 + 1e-9)));
    let mut last = first;
    for corner in corners.chain([first]) {
        let side = last.cross(corner) * sign;
        if side != DVec3::ZERO {
            planes.push((side, 0.0));
        }
        last = corner;
    }
    true
}

impl Part {
    /// Whether it reaches into a cone, as far as single planes tell.
    fn meets(&self, cone: &[(DVec3, f64)]) -> bool {
        let is_outside = |plane| self.points.iter().all(|point| side(plane, point) <= 0.0);
        !cone.iter().any(is_outside)
    }

    /// Adds what is left of it without a cone, and what comes through that.
    fn cut(self, cone: &[(DVec3, f64)], left: &mut Vec<Part>, through: impl FnOnce(DVec3) -> f32) {
        let mut rest = self.points;
        for plane in cone {
            if rest.iter().all(|point| side(plane, point) >= 0.0) {
                continue;
            }
            let sides: Vec<f64> = rest.iter().map(|point| side(plane, point)).collect();
            let (inside, outside) = split(&rest, &sides);
            if is_part(&outside) {
                left.push(Part { points: outside, through: self.through });
            }
            rest = inside;
            if !is_part(&rest) {
                return;
            }
        }
        let middle = rest.iter().sum::<DVec3>() / rest.len() as f64;
        let through = self.through * through(middle);
        if through > 0.0 {
            left.push(Part { points: rest, through });
        }
    }
}

/// On which side of a plane a point is.
fn side((normal, offset): &(DVec3, f64), point: &DVec3) -> f64 {
    normal.dot(*point) + offset
}

/// Whether points make a segment or a polygon.
fn is_part(points: &[DVec3]) -> bool {
    points.len() >= 2 && points.iter().any(|point| *point != points[0])
}

/// The parts of a segment or a convex polygon on both sides of a plane.
fn split(points: &[DVec3], sides: &[f64]) -> (Vec<DVec3>, Vec<DVec3>) {
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
