//! Boxes, prisms, and what comes from turning simple profiles.

use glam::DVec3;

use super::profile::{Strip, turn};
use super::{MAX_SEGMENTS, positive, within};
use crate::error::{Error, Result};
use crate::math;
use crate::scene::face::Face;
use crate::scene::mesh::Mesh;

/// A box on the ground, centred on the y axis.
pub(super) fn cuboid(size: [f64; 3]) -> Result<Mesh> {
    let [x, y, z] =
        [positive("size.0", size[0])?, positive("size.1", size[1])?, positive("size.2", size[2])?];
    let (x, z) = (x / 2.0, z / 2.0);
    // A box has no code of its own: its faces come in the order of a prism's.
    prism(&[[-x, -z], [x, -z], [x, z], [-x, z]], &[], y)
}

/// A polygon of the ground plane, raised to `height`, with shafts.
pub(super) fn prism(outline: &[[f64; 2]], holes: &[Vec<[f64; 2]>], height: f64) -> Result<Mesh> {
    positive("height", height)?;
    let mut mesh = Mesh::default();
    let (mut top, mut bottom) = (Face::default(), Face::default());
    let rings = std::iter::once(outline).chain(holes.iter().map(Vec::as_slice));
    for (at, ring) in rings.enumerate() {
        if ring.len() < 3 {
            return Err(Error::invalid(format!(
                "an outline with {} corners: it needs 3",
                ring.len()
            )));
        }
        // Seen from above, with x to the right and z towards the reader, outlines run counter-clockwise
        // and shafts clockwise, so that all walls face the open.
        let clockwise = signed_area(ring) > 0.0;
        let mut corners: Vec<[f64; 2]> = ring.to_vec();
        // Whatever way round they were given.
        if clockwise == (at == 0) {
            corners.reverse();
        }
        let low: Vec<u32> = corners.iter().map(|c| mesh.add_point([c[0], 0.0, c[1]])).collect();
        let high: Vec<u32> = corners.iter().map(|c| mesh.add_point([c[0], height, c[1]])).collect();
        for i in 0..corners.len() {
            let j = (i + 1) % corners.len();
            mesh.add_polygon(&[low[i], low[j], high[j], high[i]], None)?;
        }
        let underside: Vec<u32> = low.into_iter().rev().collect();
        if at == 0 {
            (top.outline, bottom.outline) = (high, underside);
        } else {
            top.holes.push(high);
            bottom.holes.push(underside);
        }
    }
    mesh.add_face(top)?;
    mesh.add_face(bottom)?;
    mesh.validate()?;
    Ok(mesh)
}

/// Twice the area of a polygon (x, z), positive if it runs clockwise seen from above.
fn signed_area(ring: &[[f64; 2]]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum()
}

/// A cylinder, cone or frustum on the ground.
pub(super) fn frustum(
    radius: f64,
    top: f64,
    height: f64,
    segments: u32,
    smooth: bool,
) -> Result<Mesh> {
    positive("height", height)?;
    within("segments", segments, 3..=MAX_SEGMENTS)?;
    if !(radius >= 0.0 && top >= 0.0 && radius + top > 0.0 && (radius + top).is_finite()) {
        return Err(Error::invalid(format!(
            "radii {radius} and {top}: neither may be below 0, nor both 0"
        )));
    }
    if !smooth {
        let mut mesh = Mesh::default();
        flat_frustum(&mut mesh, radius, top, height, segments)?;
        return Ok(mesh);
    }
    // Across the side: (top - radius, height) turned by a quarter.
    let slant = DVec3::new(height, radius - top, 0.0).normalize();
    let side = Strip::straight([radius, 0.0], [top, height], [slant.x, slant.y]);
    let mut strips = vec![side];
    if radius > 0.0 {
        strips.push(Strip::straight([0.0, 0.0], [radius, 0.0], [0.0, -1.0]));
    }
    if top > 0.0 {
        strips.push(Strip::straight([top, height], [0.0, height], [0.0, 1.0]));
    }
    turn(&strips, segments, 360.0)
}

fn flat_frustum(mesh: &mut Mesh, radius: f64, top: f64, height: f64, segments: u32) -> Result<()> {
    let ring = |mesh: &mut Mesh, radius: f64, y: f64| -> Vec<u32> {
        if radius == 0.0 {
            return vec![mesh.add_point([0.0, y, 0.0])];
        }
        let angle = |i: u32| f64::from(i) / f64::from(segments) * std::f64::consts::TAU;
        let point = |i| [radius * math::cos(angle(i)), y, -radius * math::sin(angle(i))];
        (0..segments).map(|i| mesh.add_point(point(i))).collect()
    };
    let (low, high) = (ring(mesh, radius, 0.0), ring(mesh, top, height));
    let at = |ring: &[u32], i: usize| ring[i % ring.len()];
    for i in 0..segments as usize {
        let mut quad = vec![at(&low, i), at(&low, i + 1), at(&high, i + 1), at(&high, i)];
        // At the tip of a cone two corners are one.
        quad.dedup();
        if quad.first() == quad.last() {
            quad.pop();
        }
        mesh.add_polygon(&quad, None)?;
    }
    if high.len() > 1 {
        mesh.add_polygon(&high, None)?;
    }
    if low.len() > 1 {
        let underside: Vec<u32> = low.into_iter().rev().collect();
        mesh.add_polygon(&underside, None)?;
    }
    Ok(())
}

/// A ball about the origin.
pub(super) fn sphere(radius: f64, segments: u32) -> Result<Mesh> {
    positive("radius", radius)?;
    within("segments", segments, 3..=MAX_SEGMENTS)?;
    let rings = (segments / 2).max(2);
    let angle = |i: u32| (f64::from(i) / f64::from(rings) - 0.5) * std::f64::consts::PI;
    let normal = |i: u32| match i {
        // Exact at the poles, where the cosine of a rounded angle is not 0: triangles end in one
        // point.
        0 => [0.0, -1.0],
        i if i == rings => [0.0, 1.0],
        i => [math::cos(angle(i)), math::sin(angle(i))],
    };
    let point = |i: u32| normal(i).map(|v| v * radius);
    let strips: Vec<Strip> = (0..rings)
        .map(|i| Strip { from: point(i), to: point(i + 1), normals: [normal(i), normal(i + 1)] })
        .collect();
    turn(&strips, segments, 360.0)
}

/// A ring about the y axis.
pub(super) fn torus(radius: f64, tube: f64, segments: u32) -> Result<Mesh> {
    positive("radius", radius)?;
    positive("tube", tube)?;
    if tube > radius {
        return Err(Error::invalid(format!(
            "`tube` is {tube}: must not exceed `radius`, {radius}"
        )));
    }
    within("segments", segments, 3..=MAX_SEGMENTS)?;
    let rings = (segments / 2).max(3);
    let normal = |i: u32| {
        // The last ring is the first, bit for bit: the torus is closed.
        let angle = f64::from(i % rings) / f64::from(rings) * std::f64::consts::TAU;
        [math::cos(angle), math::sin(angle)]
    };
    let point = |i: u32| [radius + tube * normal(i)[0], tube * normal(i)[1]];
    let strips: Vec<Strip> = (0..rings)
        .map(|i| Strip { from: point(i), to: point(i + 1), normals: [normal(i), normal(i + 1)] })
        .collect();
    turn(&strips, segments, 360.0)
}
