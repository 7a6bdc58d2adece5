//! Bicubic Bezier patches.

use glam::{DVec3, Vec2};

use super::within;
use crate::error::Result;
use crate::scene::mesh::Mesh;

/// A patch as triangles with the surface's own normals, and s and t as texture coordinates.
pub(super) fn bicubic(points: &[[DVec3; 4]; 4], divisions: [u32; 2]) -> Result<Mesh> {
    let [columns, rows] = [
        within("divisions.0", divisions[0], 1..=1024)?,
        within("divisions.1", divisions[1], 1..=1024)?,
    ];
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        for i in 0..=columns {
            let (s, t) = (f64::from(i) / f64::from(columns), f64::from(j) / f64::from(rows));
            mesh.points.push(point(points, s, t));
            mesh.normals.push(normal(points, s, t).as_vec3());
            mesh.uvs.push(Vec2::new(s as f32, t as f32));
        }
    }
    let vertex = |i: u32, j: u32| j * (columns + 1) + i;
    for j in 0..rows {
        for i in 0..columns {
            let (a, b) = (vertex(i, j), vertex(i + 1, j));
            let (c, d) = (vertex(i + 1, j + 1), vertex(i, j + 1));
            mesh.add_polygon(&[a, b, c], None)?;
            mesh.add_polygon(&[a, c, d], None)?;
        }
    }
    mesh.validate()?;
    Ok(mesh)
}

/// The cubic Bernstein polynomials at `t`, and their derivatives.
fn bernstein(t: f64) -> ([f64; 4], [f64; 4]) {
    let u = 1.0 - t;
    (
        [u * u * u, 3.0 * u * u * t, 3.0 * u * t * t, t * t * t],
        [-3.0 * u * u, 3.0 * u * (u - 2.0 * t), 3.0 * t * (2.0 * u - t), 3.0 * t * t],
    )
}

fn combine(points: &[[DVec3; 4]; 4], along_s: [f64; 4], along_t: [f64; 4]) -> DVec3 {
    let row = |row: &[DVec3; 4]| row.iter().zip(along_s).map(|(p, w)| *p * w).sum::<DVec3>();
    points.iter().zip(along_t).map(|(points, w)| row(points) * w).sum()
}

fn point(points: &[[DVec3; 4]; 4], s: f64, t: f64) -> DVec3 {
    combine(points, bernstein(s).0, bernstein(t).0)
}

fn normal(points: &[[DVec3; 4]; 4], s: f64, t: f64) -> DVec3 {
    let at = |s: f64, t: f64| {
        let ((bs, ds), (bt, dt)) = (bernstein(s), bernstein(t));
        combine(points, ds, bt).cross(combine(points, bs, dt)).try_normalize()
    };
    // Where an edge has collapsed to a point a tangent vanishes: look just inside.
    let inside = |v: f64| v + (0.5 - v) * 1e-4;
    at(s, t).or_else(|| at(inside(s), inside(t))).unwrap_or(DVec3::Z)
}
