//! Light that is not in one place, exactly: what a receiver sees of a source is the source without the cones
//! of everything that stands before it, and what is left has a closed form.
//!
//! Cones (`polygon::Cone`) are shadow volumes with light and receiver exchanged. The parts of a source
//! behind leaves may become very many; rays then do better.

use glam::DVec3;

use crate::camera::View;
use crate::color::Color;
use crate::fragment::World;
use crate::light::{Light, Receiver};
use crate::polygon::{Cone, is_part, split};
use crate::shadow;
use crate::trace::{Casters, Shaft, Toward};

/// The most parts of a source that are kept apart.
const MOST_PARTS: usize = 512;

/// A convex part of a source, as seen from the receiver, and how much of its light arrives.
struct SourcePart {
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
    let mut cone = Cone::default();
    for facet in light.facets(at)? {
        // What is behind the face itself is not seen, whatever its interpolated normal says.
        let seen: Vec<DVec3> = facet.iter().map(|point| *point - here).collect();
        let heights: Vec<f64> = seen.iter().map(|point| facing.dot(*point)).collect();
        let (seen, _) = split(&seen, &heights);
        if !is_part(&seen) {
            continue;
        }
        // Only what reaches into the space between receiver and facet can stand in the way.
        let shaft = shaft(&seen, facing, here);
        let mut parts = vec![SourcePart { points: seen, through: 1.0 }];
        for (member, casters) in casters {
            let surfaces = &*world.members()[*member].surfaces;
            let is_too_much = casters.any_within(&shaft, |piece| {
                let is_nothing = casters.pieces()[piece].opacity == 0.0;
                if is_nothing || parts.is_empty() {
                    return false;
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
                    return false;
                }
                let normal = casters.normal(piece, Toward::Point(here));
                if !cone.behind(normal, corners.map(|corner| corner - here)) {
                    return false;
                }
                // From the end: what is put there is outside of the cone, or what comes through it.
                for i in (0..parts.len()).rev() {
                    if !cone.meets(&parts[i].points) {
                        continue;
                    }
                    if differs {
                        return true;
                    }
                    let SourcePart { points, through } = parts.swap_remove(i);
                    let inside =
                        cone.cut(points, |points| parts.push(SourcePart { points, through }));
                    let Some(points) = inside else { continue };
                    let along = points.iter().sum::<DVec3>() / points.len() as f64;
                    let position = here + along;
                    let met = || shadow::Way { from: here, along, position, width: 0.0 };
                    let through =
                        through * (1.0 - shadow::opacity(surfaces, view, casters, piece, met));
                    if through > 0.0 {
                        parts.push(SourcePart { points, through });
                    }
                }
                parts.len() > MOST_PARTS
            });
            if is_too_much {
                return None;
            }
        }
        for SourcePart { points, through } in &parts {
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
        // Half way to the source is surely inside, and tells which side is meant.
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
        // From a point a segment is seen through a triangle: a shaft without thickness.
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
