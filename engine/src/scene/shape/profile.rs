//! Profiles turned about an axis and drawn along a path.

use glam::{DVec3, Vec3};

use super::{MAX_SEGMENTS, positive, within};
use crate::error::{Error, Result};
use crate::math;
use crate::scene::mesh::Mesh;

/// A piece of a profile (distance from the axis, height), with the outward normals at its ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Strip {
    pub(super) from: [f64; 2],
    pub(super) to: [f64; 2],
    pub(super) normals: [[f64; 2]; 2],
}

impl Strip {
    pub(super) fn straight(from: [f64; 2], to: [f64; 2], normal: [f64; 2]) -> Strip {
        Strip { from, to, normals: [normal, normal] }
    }
}

/// Turns strips about the y axis by `angle` degrees: triangles (and, where shading stays exact,
/// quadrilaterals) with a normal at each vertex.
pub(super) fn turn(strips: &[Strip], segments: u32, angle: f64) -> Result<Mesh> {
    let mut mesh = Mesh::default();
    let full = angle == 360.0;
    let at = |i: u32| {
        // After a whole turn the sine is not quite 0 again; the first column is taken anew.
        let i = if full { i % segments } else { i };
        let angle = (f64::from(i) / f64::from(segments) * angle).to_radians();
        (math::cos(angle), -math::sin(angle))
    };
    for strip in strips {
        let first = mesh.points.len() as u32;
        let ends = [(strip.from, strip.normals[0]), (strip.to, strip.normals[1])];
        let columns = if full { segments } else { segments + 1 };
        for i in 0..columns {
            let (cos, sin) = at(i);
            for (point, normal) in ends {
                mesh.points.push(DVec3::new(point[0] * cos, point[1], point[0] * sin));
                let normal = DVec3::new(normal[0] * cos, normal[1], normal[0] * sin);
                mesh.normals.push(normal.as_vec3());
            }
        }
        let vertex = |i: u32, end: u32| first + 2 * (i % columns) + end;
        for i in 0..segments {
            let (a, b) = (vertex(i, 0), vertex(i + 1, 0));
            let (c, d) = (vertex(i + 1, 1), vertex(i, 1));
            if strip.from[0] == 0.0 {
                mesh.add_polygon(&[a, c, d], None)?;
            } else if strip.to[0] == 0.0 {
                mesh.add_polygon(&[a, b, c], None)?;
            } else if strip.from[0] == strip.to[0] && strip.normals[0] == strip.normals[1] {
                // Only upright walls have normals that are affine over a quadrilateral.
                mesh.add_polygon(&[a, b, c, d], None)?;
            } else {
                mesh.add_polygon(&[a, b, c], None)?;
                mesh.add_polygon(&[a, c, d], None)?;
            }
        }
    }
    mesh.validate()?;
    Ok(mesh)
}

/// A profile turned about the y axis.
pub(super) fn revolve(
    profile: &[[f64; 2]],
    segments: u32,
    angle: f64,
    smooth: bool,
) -> Result<Mesh> {
    if !(angle > 0.0 && angle <= 360.0) {
        return Err(Error::invalid(format!("`angle` is {angle}: must be above 0 and at most 360")));
    }
    within("segments", segments, if angle == 360.0 { 3 } else { 1 }..=MAX_SEGMENTS)?;
    if profile.len() < 2 || profile.iter().any(|p| p[0] < 0.0) {
        return Err(Error::invalid(
            "a `profile` needs two points or more, none at a distance below 0 from the axis",
        ));
    }
    let mut strips: Vec<Strip> = Vec::new();
    for pair in profile.windows(2) {
        let along = DVec3::new(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1], 0.0);
        if let Some(along) = along.try_normalize() {
            // A profile runs upwards, so its outside is on its right.
            strips.push(Strip::straight(pair[0], pair[1], [along.y, -along.x]));
        }
    }
    if strips.is_empty() {
        return Err(Error::invalid("all points of the `profile` are one"));
    }
    if smooth {
        for i in 1..strips.len() {
            let (before, after) = (strips[i - 1].normals[1], strips[i].normals[0]);
            let sum = DVec3::new(before[0] + after[0], before[1] + after[1], 0.0);
            if let Some(mean) = sum.try_normalize() {
                strips[i - 1].normals[1] = [mean.x, mean.y];
                strips[i].normals[0] = [mean.x, mean.y];
            }
        }
    }
    turn(&strips, segments, angle)
}

/// A profile drawn along a path, mitred at its corners.
pub(super) fn sweep(
    profile: &[[f64; 2]],
    path: &[DVec3],
    closed: bool,
    ring: bool,
) -> Result<Mesh> {
    let needs = if closed { 3 } else { 2 };
    if profile.len() < needs {
        return Err(Error::invalid(format!(
            "a `profile` of {} points: it needs {needs}",
            profile.len()
        )));
    }
    let needs = if ring { 3 } else { 2 };
    let mut path = path.to_vec();
    path.dedup();
    if path.len() < needs {
        return Err(Error::invalid(format!("a `path` of {} points: it needs {needs}", path.len())));
    }
    let n = path.len();
    let direction = |i: usize| -> Result<DVec3> {
        (path[(i + 1) % n] - path[i % n])
            .try_normalize()
            .ok_or_else(|| Error::invalid("two neighbouring points of the `path` are one"))
    };
    let mut mesh = Mesh::default();
    for (i, point) in path.iter().enumerate() {
        let ahead = if ring || i + 1 < n { direction(i)? } else { direction(i - 1)? };
        let behind = if ring || i > 0 { direction((i + n - 1) % n)? } else { ahead };
        // The section lies in the plane that halves the corner; stretched there, walls stay flush.
        let half = (ahead + behind).try_normalize().unwrap_or(ahead);
        let right = half.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
        let up = right.cross(half);
        // At sharp corners the mitre would grow without end.
        let miter = 1.0 / half.dot(ahead).max(0.1);
        // Only the axis in the plane of the bend is stretched.
        let bends_sideways = (ahead - behind).dot(right).abs() >= (ahead - behind).dot(up).abs();
        let (wide, tall) = if bends_sideways { (miter, 1.0) } else { (1.0, miter) };
        for [u, v] in profile {
            mesh.add_point(point + right * (u * wide) + up * (v * tall));
        }
    }
    let m = profile.len();
    let vertex = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let sides = if closed { m } else { m - 1 };
    for i in 0..if ring { n } else { n - 1 } {
        for j in 0..sides {
            let quad = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
            mesh.add_polygon(&quad, None)?;
        }
    }
    if closed && !ring {
        let section = |i: usize| (0..m).map(move |j| vertex(i, j));
        let start: Vec<u32> = section(0).collect();
        let end: Vec<u32> = section(n - 1).rev().collect();
        mesh.add_polygon(&start, None)?;
        mesh.add_polygon(&end, None)?;
    }
    mesh.validate()?;
    Ok(mesh)
}

/// Smooth normals of a grid of points: the mean of its triangles' around each.
pub(super) fn grid_normals(points: &[DVec3], columns: usize) -> Vec<Vec3> {
    let rows = points.len() / columns;
    let mut sums = vec![DVec3::ZERO; points.len()];
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let i = r * columns + c;
            for corner in [[i, i + columns, i + 1], [i + 1, i + columns, i + columns + 1]] {
                let [a, b, d] = corner.map(|k| points[k]);
                // Its length is twice the triangle's area, so large triangles count for more.
                let normal = (b - a).cross(d - a);
                corner.into_iter().for_each(|k| sums[k] += normal);
            }
        }
    }
    sums.into_iter().map(|sum| sum.try_normalize().unwrap_or(DVec3::Y).as_vec3()).collect()
}

/// Checks that a plane extent is positive.
pub(super) fn extent(size: [f64; 2]) -> Result<[f64; 2]> {
    Ok([positive("size.0", size[0])?, positive("size.1", size[1])?])
}
