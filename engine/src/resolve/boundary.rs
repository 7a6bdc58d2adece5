//! Boundaries with their slopes.
//!
//! Where one span ends and the next begins, the boundary is an edge of one of the two faces, or the
//! seam along which their planes meet. Both are functions of the faces and are derived here when a rule
//! wants them; visibility never carries them. Within the strip of its line a boundary runs from an x at
//! the strip's top to an x at its bottom:
//!
//! - an edge is followed up and down no farther than to its nearer end, so that its slope fades where it
//!   stops and the mean over the strip stays the line's own. Following it to each end for itself was
//!   measured worse: by 7 % on a town at four lines per row, by half on a disc of short edges, where
//!   what one side gains and the other loses no longer cancel;
//! - boundaries of a line never cross: those that would are pooled at their mean (isotonic
//!   regression), above and below independently. Limiting each to its neighbour's *middle* instead was
//!   measured to make slivers worse than steps.

use std::collections::HashMap;

use super::stacks::Stacks;
use crate::camera::Plane;
use crate::raster::Raster;
use crate::span::{Edge, Face, FaceId, FaceTable, Role, Span, SpanImage};

/// Corners from which on a face's edges are sorted by line before they are searched.
const MANY: usize = 12;

/// Finds boundaries, line after line; remembers the edges of faces that have many.
pub(super) struct Boundaries<'a> {
    image: &'a SpanImage,
    raster: Raster,
    /// Edges of faces with many, of those that reach the lines `around`.
    edges: HashMap<FaceId, Vec<Edge>>,
    around: (f64, f64),
}

impl<'a> Boundaries<'a> {
    pub(super) fn new(image: &'a SpanImage) -> Boundaries<'a> {
        Boundaries {
            image,
            raster: image.view().raster(),
            edges: HashMap::new(),
            around: (f64::INFINITY, f64::NEG_INFINITY),
        }
    }

    /// The x in pixels at the top and bottom of the strip of line `k`, of the left boundary of every
    /// span but the first. Appends to `top` and `bottom`.
    pub(super) fn of_line(
        &mut self,
        k: u32,
        stacks: &Stacks<'_>,
        top: &mut Vec<f64>,
        bottom: &mut Vec<f64>,
    ) {
        let plan = self.image.plan();
        let (y, half) = (plan.y(k), 0.5 / f64::from(plan.per_row));
        if y < self.around.0 || y >= self.around.1 {
            self.around = (y, y + 1.0);
            self.edges.clear();
        }
        let start = top.len();
        for pair in stacks.spans(k).windows(2) {
            let (above, below) = self.boundary(stacks, &pair[0], &pair[1], y, half);
            top.push(above);
            bottom.push(below);
        }
        let width = f64::from(self.raster.width);
        for list in [top, bottom] {
            list[start..].iter_mut().for_each(|x| *x = x.clamp(0.0, width));
            pool(&mut list[start..]);
        }
    }

    fn boundary(
        &mut self,
        stacks: &Stacks<'_>,
        left: &Span,
        right: &Span,
        y: f64,
        half: f64,
    ) -> (f64, f64) {
        let cell = right.x;
        let (left, right) = (stacks.members(&left.face), stacks.members(&right.face));
        let ends = left.iter().filter(|id| !right.contains(id));
        let begins = right.iter().filter(|id| !left.contains(id));
        for id in ends.chain(begins) {
            if let Some(edge) = self.edge_at(*id, cell, y) {
                // Alike upwards and downwards, so that the line's own x stays the mean.
                let reach = half.min(y - edge.top.y).min(edge.bottom.y - y);
                return (edge.x_at(y - reach), edge.x_at(y + reach));
            }
        }
        let x = self.raster.pixels(cell);
        let slope = self.seam(left, right, x, y).unwrap_or(0.0);
        (x - slope * half, x + slope * half)
    }

    /// The edge of a face that crosses a line at a cell.
    fn edge_at(&mut self, id: FaceId, cell: u32, y: f64) -> Option<Edge> {
        let raster = self.raster;
        let meets = |edge: &Edge| raster.cell(edge.x_at(y)) == cell;
        let (source, face) = self.image.face(id);
        let table = &*source.faces;
        if table.corner_count(face) < MANY && !matches!(face.role, Role::Seal(_)) {
            return table.crossing(face, y).find(meets);
        }
        let around = self.around;
        let edges = self.edges.entry(id).or_insert_with(|| {
            let near = |edge: &Edge| edge.top.y < around.1 && edge.bottom.y > around.0;
            all_edges(table, face).filter(near).collect()
        });
        edges.iter().find(|edge| edge.crosses(y) && meets(edge)).copied()
    }

    /// The slope, in pixels per pixel downwards, of the line along which two faces, of what is seen on
    /// the left and on the right, meet, or along which
    /// the front or back plane cuts one. `None` if it does not pass here: the boundary is no seam.
    fn seam(&self, left: &[FaceId], right: &[FaceId], x: f64, y: f64) -> Option<f64> {
        let plane = |id: &FaceId| self.image.face(*id).1.plane;
        let (front, back) = self.image.view().depth_range();
        let met =
            left.iter().flat_map(|p| right.iter().filter(move |q| *q != p).map(move |q| (p, q)));
        let met = met.map(|(p, q)| (plane(p), plane(q)));
        let limits = [front, back].map(Plane::constant).into_iter();
        let cut =
            limits.flat_map(|limit| left.iter().chain(right).map(move |id| (plane(id), limit)));
        met.chain(cut).find_map(|(p, q)| {
            let (a, b, c) = (p.a - q.a, p.b - q.b, p.c - q.c);
            let meets = -(b * y + c) / a;
            let slope = -b / a;
            ((meets - x).abs() < 1e-3 && slope.is_finite()).then_some(slope)
        })
    }
}

/// The edges that bound a face, with those of its parent for a seal.
fn all_edges<'t>(table: &'t FaceTable, face: &'t Face) -> impl Iterator<Item = Edge> + 't {
    let parent = match face.role {
        Role::Seal(parent) => table.faces().get(parent as usize),
        _ => None,
    };
    table.edges(face).chain(parent.into_iter().flat_map(|parent| table.edges(parent)))
}

/// Makes numbers ascend by pooling neighbours that do not at their mean.
fn pool(list: &mut [f64]) {
    if list.is_sorted() {
        return;
    }
    // Pools from left to right: (sum, count), each pool's mean above the one before.
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for x in list.iter() {
        let mut last = (*x, 1);
        while let Some((sum, count)) = pools.last().copied() {
            if sum * last.1 as f64 <= last.0 * count as f64 {
                break;
            }
            pools.pop();
            last = (last.0 + sum, last.1 + count);
        }
        pools.push(last);
    }
    let means = pools.into_iter().flat_map(|(sum, n)| std::iter::repeat_n(sum / n as f64, n));
    list.iter_mut().zip(means).for_each(|(x, mean)| *x = mean);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boundaries_that_would_cross_meet_at_their_mean() {
        let mut list = [1.0, 3.0, 2.0, 5.0];
        pool(&mut list);
        assert_eq!(list, [1.0, 2.5, 2.5, 5.0]);
        let mut list = [4.0, 3.0, 2.0];
        pool(&mut list);
        assert_eq!(list, [3.0, 3.0, 3.0]);
        let mut list = [1.0, 10.0, 0.0, 1.0];
        pool(&mut list);
        assert!(list.is_sorted(), "{list:?}");
    }
}
