//! Surfaces of equal value by tetrahedral cells (\[D], "Applications", after its references 24 and 25).
//!
//! Each cell of the grid is divided into six tetrahedra around its diagonal, alike in all cells, so that neighbours
//! share their edges. On each edge whose ends lie on different sides of the level there is one vertex, where the field
//! that is linear along each axis has the level: on the diagonals too, where values that go straight from end to end
//! would make the surface of a noisy scan a twentieth larger than it is. A tetrahedron has no triangle, one, or two. The surface is
//! closed, but for where it leaves the grid or meets samples that are no numbers, and no edge has more than two
//! triangles.
//!
//! Nothing is looked up: a point of the grid has a byte that tells which of its seven edges to points further on carry
//! vertices, and the number of a vertex is a count of bits.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Volume;
use crate::error::{Error, Result};
use crate::scene::Mesh;
use crate::watch::Watch;

/// Which side of a surface is inside.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, schemars::JsonSchema,
)]
pub enum Inside {
    /// Where values are the level or more.
    #[default]
    Above,
    /// Where values are the level or less, as in the negative lobe of an orbital.
    Below,
}

/// A vertex keeps this share of its edge away from its ends, so that no triangle loses its area where a sample is the
/// level itself, and the surface stays one on which every edge has two triangles.
const APART: f64 = 1e-6;

/// The tetrahedra of a cell around its diagonal from corner 0 to corner 7 (bits x, y, z), all turned alike. Of the two
/// ends of each edge one has the bits of the other and more.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]];

/// The surface on which a volume has a value, in the volume's own coordinates: triangles that are seen from outside
/// counter-clockwise, with normals by the field's gradient.
///
/// # Errors
/// If the level is not finite, or there are more than 2^32 vertices.
pub fn isosurface(volume: &Volume, level: f64, inside: Inside) -> Result<Mesh> {
    if !level.is_finite() {
        return Err(Error::invalid("the level of a surface must be finite"));
    }
    let watch = Watch::current();
    let field = Field { volume, level, inside };
    let [columns, rows, layers] = volume.counts;
    let mut marks = vec![0u8; volume.samples.len()];
    marks
        .par_chunks_mut(columns)
        .enumerate()
        .try_for_each(|(row, marks)| watch.check().map(|()| field.mark(row, marks)))?;
    // The number of each row's first vertex.
    let counts: Vec<u64> = marks.par_chunks(columns).map(count).collect();
    let mut first = Vec::with_capacity(counts.len());
    let mut total = 0u64;
    for count in counts {
        first.push(total as u32);
        total += count;
    }
    if total > u64::from(u32::MAX) {
        return Err(Error::invalid(format!("a surface of {total} vertices: at most 2^32")));
    }
    let vertices: Vec<(Vec<DVec3>, Vec<Vec3>)> = (0..layers)
        .into_par_iter()
        .map(|layer| watch.check().map(|()| field.vertices(layer, &marks)))
        .collect::<Result<_>>()?;
    let known = Known { marks: &marks, first: &first, columns, rows };
    let triangles: Vec<Vec<[u32; 3]>> = (0..layers - 1)
        .into_par_iter()
        .map(|layer| watch.check().map(|()| field.triangles(layer, &known)))
        .collect::<Result<_>>()?;
    let mut mesh = Mesh::default();
    mesh.points.reserve_exact(total as usize);
    mesh.normals.reserve_exact(total as usize);
    for (points, normals) in vertices {
        mesh.points.extend(points);
        mesh.normals.extend(normals);
    }
    let count = triangles.iter().map(Vec::len).sum();
    mesh.reserve(count, 3 * count);
    for triangle in triangles.iter().flatten() {
        mesh.add_polygon(triangle, None)?;
    }
    Ok(mesh)
}

fn count(marks: &[u8]) -> u64 {
    marks.iter().map(|mark| u64::from(mark.count_ones())).sum()
}

struct Field<'v> {
    volume: &'v Volume,
    level: f64,
    inside: Inside,
}

impl Field<'_> {
    fn is_inside(&self, sample: f32) -> bool {
        match self.inside {
            Inside::Above => f64::from(sample) >= self.level,
            Inside::Below => f64::from(sample) <= self.level,
        }
    }

    /// Which of the seven edges from each point of a row carry vertices: bit d - 1 for that to the corner d.
    fn mark(&self, row: usize, marks: &mut [u8]) {
        let Volume { counts: [columns, rows, layers], samples, .. } = self.volume;
        let (columns, rows) = (*columns, *rows);
        let (y, z) = (row % rows, row / rows);
        let start = row * columns;
        // A row further on that is not there is this one: no edge to it is taken.
        let (down, deep) = (y + 1 < rows, z + 1 < *layers);
        let offsets: [usize; 4] = std::array::from_fn(|at| {
            start
                + if down && at & 1 != 0 { columns } else { 0 }
                + if deep && at & 2 != 0 { columns * rows } else { 0 }
        });
        let allowed = |bits: u8| (bits & 2 == 0 || down) && (bits & 4 == 0 || deep);
        let there: u8 = (1..8u8).filter(|d| allowed(*d)).map(|d| 1 << (d - 1)).sum();
        // Which of the four points at x are inside, as bits.
        let column = |x: usize| -> usize {
            (0..4).map(|at| usize::from(self.is_inside(samples[offsets[at] + x])) << at).sum()
        };
        let is_missing = |x: usize, at: usize| samples[offsets[at] + x].is_nan();
        let mut here = column(0);
        for (x, to) in marks.iter_mut().enumerate() {
            let (right, there) = match x + 1 < columns {
                true => (x + 1, there),
                // Bits of the edges with d even.
                false => (x, there & 0b010_1010),
            };
            let next = if right == x { here } else { column(right) };
            // Nothing is between points of one side.
            if (here | next) != 0 && (here & next) != 15 && !is_missing(x, 0) {
                let mut mark = 0;
                for d in 1..8usize {
                    let (end, x) = if d & 1 != 0 { (next, right) } else { (here, x) };
                    let differs = (end >> (d >> 1) ^ here) & 1 != 0;
                    mark |= u8::from(differs && !is_missing(x, d >> 1)) << (d - 1);
                }
                *to = mark & there;
            }
            here = next;
        }
    }

    fn vertices(&self, layer: usize, marks: &[u8]) -> (Vec<DVec3>, Vec<Vec3>) {
        let [columns, rows, _] = self.volume.counts;
        let (mut points, mut normals) = (Vec::new(), Vec::new());
        // The gradient in space by that along the axes.
        let slopes = self.volume.steps.inverse().transpose();
        let outwards = if self.inside == Inside::Above { -1.0 } else { 1.0 };
        for y in 0..rows {
            let start = (layer * rows + y) * columns;
            for x in (0..columns).filter(|x| marks[start + x] != 0) {
                let from = [x, y, layer];
                let (p, m) = (self.volume.place(from), self.gradient(from));
                for d in (1..8usize).filter(|d| marks[start + x] >> (d - 1) & 1 != 0) {
                    let to = [x + (d & 1), y + (d >> 1 & 1), layer + (d >> 2)];
                    let share = self.share(from, d);
                    let (q, n) = (self.volume.place(to), self.gradient(to));
                    points.push(p + (q - p) * share);
                    let along = slopes * (m + (n - m) * share) * outwards;
                    // Where the field is flat on both sides, from the side where it is inside.
                    let straight =
                        (q - p) * if self.is_inside(self.sample(from)) { 1.0 } else { -1.0 };
                    let normal = along.try_normalize().unwrap_or(straight.normalize());
                    normals.push(normal.as_vec3());
                }
            }
        }
        (points, normals)
    }

    fn sample(&self, at: [usize; 3]) -> f32 {
        self.volume.samples[self.volume.index(at)]
    }

    /// How far along the edge from a point to the corner d of its cell the field has the level. Between samples it is
    /// linear along each axis, so that it bends along a diagonal: where it is met more than once, one place is taken.
    fn share(&self, [x, y, z]: [usize; 3], d: usize) -> f64 {
        // The sums over the corners that the edge has 0, 1, 2 or 3 axes from its start.
        let mut sums = [0.0; 4];
        for corner in (0..=d).filter(|corner| corner & !d == 0) {
            let at = [x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2)];
            sums[corner.count_ones() as usize] += f64::from(self.sample(at)) - self.level;
        }
        let [a, b, c, e] = sums;
        let axes = d.count_ones();
        let field = |t: f64| {
            let s = 1.0 - t;
            ((a * s + b * t) * s + c * t * t) * s + e * t * t * t
        };
        let straight = a / (a - sums[axes as usize]);
        let share = match axes {
            1 => straight,
            2 => root_of_second_degree(a, b, c),
            _ => root(field, straight),
        };
        // Beside a sample that is no number it goes straight; infinite ends leave the middle.
        let share = if share.is_nan() { straight } else { share };
        if share.is_nan() { 0.5 } else { share.clamp(APART, 1.0 - APART) }
    }

    /// The gradient along the axes, by the neighbours that are there and are numbers.
    fn gradient(&self, at: [usize; 3]) -> DVec3 {
        let value = |at: [usize; 3]| f64::from(self.volume.samples[self.volume.index(at)]);
        let counts = self.volume.counts;
        if (0..3).all(|axis| at[axis] > 0 && at[axis] + 1 < counts[axis]) {
            let (samples, middle) = (&self.volume.samples, self.volume.index(at));
            let apart = [1, counts[0], counts[0] * counts[1]];
            let slopes =
                apart.map(|by| f64::from(samples[middle + by]) - f64::from(samples[middle - by]));
            let slopes = DVec3::from_array(slopes) / 2.0;
            if slopes.is_finite() {
                return slopes;
            }
        }
        let here = value(at);
        DVec3::from_array(std::array::from_fn(|axis| {
            let beside = |by: isize| {
                let there =
                    at[axis].checked_add_signed(by).filter(|i| *i < self.volume.counts[axis]);
                there.map(|i| {
                    let mut beside = at;
                    beside[axis] = i;
                    value(beside)
                })
            };
            let slope = |a: f64, b: f64| Some(b - a).filter(|slope| slope.is_finite());
            let before = beside(-1).and_then(|value| slope(value, here));
            let after = beside(1).and_then(|value| slope(here, value));
            match (before, after) {
                (Some(a), Some(b)) => (a + b) / 2.0,
                (a, b) => a.or(b).unwrap_or(0.0),
            }
        }))
    }

    fn triangles(&self, layer: usize, known: &Known<'_>) -> Vec<[u32; 3]> {
        let samples = &self.volume.samples;
        let [columns, rows, _] = self.volume.counts;
        let mut triangles = Vec::new();
        let turned = self.is_turned();
        for y in 0..rows - 1 {
            let mut cursor = known.rows_at(y, layer);
            let starts: [usize; 4] =
                std::array::from_fn(|at| known.row(y + (at & 1), layer + (at >> 1)) * columns);
            let column = |x: usize| -> u8 {
                (0..4).map(|at| u8::from(self.is_inside(samples[starts[at] + x])) << (2 * at)).sum()
            };
            let mut left = column(0);
            for x in 0..columns - 1 {
                // Nothing crosses a cell whose corners lie on one side: then none of its edges has a vertex.
                let right = column(x + 1);
                let sides = left | right << 1;
                left = right;
                if sides != 0 && sides != 255 {
                    let missing = |c: usize| samples[starts[c >> 1] + x + (c & 1)].is_nan();
                    for tetrahedron in &TETRAHEDRA {
                        if !tetrahedron.iter().any(|c| missing(*c)) {
                            cursor.cut(x, tetrahedron, sides, turned, &mut triangles);
                        }
                    }
                }
                cursor.advance(x);
            }
        }
        triangles
    }

    /// Whether the grid is mirrored, so that triangles turn the other way.
    fn is_turned(&self) -> bool {
        self.volume.steps.determinant() < 0.0
    }
}

/// Where a s^2 + b s t + c t^2 with s = 1 - t is 0, for a and c of different signs.
fn root_of_second_degree(a: f64, b: f64, c: f64) -> f64 {
    // In r = t / s: c r^2 + b r + a, whose roots have different signs. The positive one, without cancelling.
    let root = (b * b - 4.0 * a * c).sqrt();
    let [above, below] =
        if (b > 0.0) == (c > 0.0) { [-2.0 * a, b.abs() + root] } else { [b.abs() + root, 2.0 * c] };
    let (above, below) = (above.abs(), below.abs());
    above / (above + below)
}

/// Where a field that has different signs at 0 and 1 is 0, from a guess on: by secants, and by halves where these do
/// not help. The guess itself if the field is no number.
fn root(field: impl Fn(f64) -> f64, guess: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    let (mut at_low, mut at_high) = (field(low), field(high));
    let mut at = guess;
    for _ in 0..60 {
        let value = field(at);
        if value == 0.0 || !value.is_finite() {
            break;
        }
        let before = high - low;
        if (value > 0.0) == (at_low > 0.0) {
            (low, at_low) = (at, value);
        } else {
            (high, at_high) = (at, value);
        }
        let secant = low + (high - low) * (at_low / (at_low - at_high));
        at = if high - low > 0.5 * before { (low + high) / 2.0 } else { secant };
        if (at - low).min(high - at) < 1e-7 {
            break;
        }
    }
    at
}

/// Which edges carry vertices, and the numbers of these.
struct Known<'m> {
    marks: &'m [u8],
    first: &'m [u32],
    columns: usize,
    rows: usize,
}

impl<'m> Known<'m> {
    fn row(&self, y: usize, z: usize) -> usize {
        z * self.rows + y
    }

    fn rows_at(&self, y: usize, z: usize) -> Cursor<'m> {
        let rows: [usize; 4] = std::array::from_fn(|at| self.row(y + (at & 1), z + (at >> 1)));
        let marks = rows.map(|row| &self.marks[row * self.columns..(row + 1) * self.columns]);
        let before = rows.map(|row| self.first[row]);
        Cursor { marks, before }
    }
}

/// A cell that goes along four rows.
struct Cursor<'m> {
    marks: [&'m [u8]; 4],
    /// The number of the first vertex of each row's point on the cell's left.
    before: [u32; 4],
}

impl Cursor<'_> {
    /// The vertex on the edge between two corners, of which the first has no bit that the second has not.
    fn vertex(&self, x: usize, a: usize, b: usize) -> u32 {
        let (row, right) = (a >> 1, a & 1);
        let marks = self.marks[row];
        let start = self.before[row] + if right == 1 { marks[x].count_ones() } else { 0 };
        let below = marks[x + right] & ((1u8 << ((a ^ b) - 1)) - 1);
        start + below.count_ones()
    }

    fn cut(
        &self,
        x: usize,
        corners: &[usize; 4],
        sides: u8,
        turned: bool,
        triangles: &mut Vec<[u32; 3]>,
    ) {
        let is_inside = |at: usize| sides >> corners[at] & 1 != 0;
        let vertex = |a: usize, b: usize| {
            let (a, b) = (corners[a], corners[b]);
            self.vertex(x, a.min(b), a.max(b))
        };
        let code: u32 = (0..4).filter(|at| is_inside(*at)).map(|at| 1 << at).sum();
        let mut add = |[a, b, c]: [u32; 3]| {
            triangles.push(if turned { [a, c, b] } else { [a, b, c] });
        };
        // The other three corners of a tetrahedron, seen from one of them so that they turn counter-clockwise from
        // outside.
        const OTHERS: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
        let one = |at: usize| OTHERS[at].map(|other| vertex(at, other));
        match code {
            1 | 2 | 4 | 8 => add(one(code.trailing_zeros() as usize)),
            7 | 11 | 13 | 14 => {
                let [a, b, c] = one((15 - code).trailing_zeros() as usize);
                add([a, c, b]);
            }
            3 | 5 | 6 | 9 | 10 | 12 => {
                // Two are inside: p and q; the other two, r and s, such that (p, q, r, s) is turned as (0, 1, 2, 3).
                let [p, q, r, s] = match code {
                    3 => [0, 1, 2, 3],
                    5 => [0, 2, 3, 1],
                    9 => [0, 3, 1, 2],
                    6 => [1, 2, 0, 3],
                    10 => [1, 3, 2, 0],
                    _ => [2, 3, 0, 1],
                };
                let quad = [vertex(p, s), vertex(q, s), vertex(q, r), vertex(p, r)];
                add([quad[0], quad[1], quad[2]]);
                add([quad[0], quad[2], quad[3]]);
            }
            _ => {}
        }
    }

    fn advance(&mut self, x: usize) {
        for (before, marks) in self.before.iter_mut().zip(self.marks) {
            *before += marks[x].count_ones();
        }
    }
}
