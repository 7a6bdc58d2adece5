//! Height fields, given and fractal.

use glam::DVec3;

use super::profile::{extent, grid_normals};
use super::within;
use crate::error::{Error, Result};
use crate::scene::mesh::Mesh;

/// Heights over a grid, as triangles.
pub(super) fn height_field(heights: &[Vec<f64>], size: [f64; 2], smooth: bool) -> Result<Mesh> {
    let [width, depth] = extent(size)?;
    let rows = heights.len();
    let columns = heights.first().map_or(0, Vec::len);
    if rows < 2 || columns < 2 {
        return Err(Error::invalid("`heights` needs two rows of two numbers or more"));
    }
    if let Some(at) = heights.iter().position(|row| row.len() != columns) {
        let found = heights[at].len();
        return Err(Error::invalid(format!(
            "row {at} of `heights` has {found} numbers, the first has {columns}"
        )));
    }
    let place = |i: usize, n: usize, extent: f64| (i as f64 / (n - 1) as f64 - 0.5) * extent;
    let mut mesh = Mesh::default();
    for (r, row) in heights.iter().enumerate() {
        for (c, height) in row.iter().enumerate() {
            let point = DVec3::new(place(c, columns, width), *height, place(r, rows, depth));
            mesh.points.push(point);
        }
    }
    if smooth {
        mesh.normals = grid_normals(&mesh.points, columns);
    }
    for r in 0..rows - 1 {
        for c in 0..columns - 1 {
            let i = (r * columns + c) as u32;
            let below = i + columns as u32;
            mesh.add_polygon(&[i, below, i + 1], None)?;
            mesh.add_polygon(&[i + 1, below, below + 1], None)?;
        }
    }
    mesh.validate()?;
    Ok(mesh)
}

/// Fractal heights by displaced midpoints (diamond and square), 2^levels + 1 to a side.
pub(super) fn displaced(
    height: f64,
    roughness: f64,
    levels: u32,
    seed: u64,
) -> Result<Vec<Vec<f64>>> {
    within("levels", levels, 1..=11)?;
    if !(roughness > 0.0 && roughness < 1.0 && height.is_finite()) {
        return Err(Error::invalid(format!(
            "`roughness` is {roughness} and `height` {height}: roughness must be between 0 and 1"
        )));
    }
    let n = 1usize << levels;
    let mut heights = vec![vec![0.0; n + 1]; n + 1];
    // By place and not by turn: the order of the loops does not show.
    let random = |x: usize, z: usize| scatter(seed, x as u64, z as u64) * 2.0 - 1.0;
    for (x, z) in [(0, 0), (n, 0), (0, n), (n, n)] {
        heights[z][x] = random(x, z) * height;
    }
    let mut step = n;
    let mut amplitude = height;
    while step > 1 {
        let half = step / 2;
        amplitude *= roughness;
        let mean = |heights: &[Vec<f64>], around: &[(isize, isize)], x: usize, z: usize| {
            let inside = around.iter().filter_map(|(dx, dz)| {
                let (x, z) = (x.checked_add_signed(*dx)?, z.checked_add_signed(*dz)?);
                heights.get(z)?.get(x).copied()
            });
            let (sum, count) = inside.fold((0.0, 0.0), |(sum, n), h| (sum + h, n + 1.0));
            sum / count
        };
        let h = half as isize;
        // Diamonds: the middle of each square, from its corners.
        for z in (half..n).step_by(step) {
            for x in (half..n).step_by(step) {
                let corners = [(-h, -h), (h, -h), (-h, h), (h, h)];
                heights[z][x] = mean(&heights, &corners, x, z) + random(x, z) * amplitude;
            }
        }
        // Squares: the middle of each side, from the three or four points around it.
        for z in (0..=n).step_by(half) {
            let odd = (z / half).is_multiple_of(2);
            for x in (if odd { half } else { 0 }..=n).step_by(step) {
                let sides = [(-h, 0), (h, 0), (0, -h), (0, h)];
                heights[z][x] = mean(&heights, &sides, x, z) + random(x, z) * amplitude;
            }
        }
        step = half;
    }
    Ok(heights)
}

/// A number in [0, 1) that depends on nothing but its arguments (splitmix64).
fn scatter(seed: u64, x: u64, z: u64) -> f64 {
    let mut v =
        seed ^ x.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ z.wrapping_mul(0xc2b2_ae3d_27d4_eb4f);
    v = (v ^ (v >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    v = (v ^ (v >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((v ^ (v >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
