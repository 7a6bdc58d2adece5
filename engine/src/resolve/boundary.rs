//! Boundaries with their slopes.
//!
//! Where one span ends and the next begins, the boundary is an edge of one of the two faces, or the
//! seam along which their planes meet; or an edge of, or a seam with, a face that is not there any more,
//! which a [cut](crate::span::cut) tells; or a [limit](SpanImage::limits) of depth cuts one of them. All are
//! functions of the faces and are derived here when a rule wants them; visibility never carries them. What
//! is none of these, the side of a window, is upright. Within the strip of its line a boundary runs from an x at
//! the strip's top to an x at its bottom:
//!
//! - an edge is followed up and down no farther than to its nearer end, so that its slope fades where it
//!   stops and the mean over the strip stays the line's own. Following it to each end for itself was
//!   measured worse: by 7 % on a town at four lines per row, by half on a disc of short edges, where
//!   what one side gains and the other loses no longer cancel;
//! - boundaries of a line [never cross](crate::span::slopes).

use std::collections::HashMap;

use super::stacks::Stacks;
use crate::camera::Plane;
use crate::raster::Raster;
use crate::span::edges::Side;
use crate::span::slopes::separate;
use crate::span::{Cut, Edge, FaceId, Role, Span, SpanImage, cut};

/// How many edges of the last line are looked at for one of this.
const LOOK_AHEAD: usize = 4;

/// Corners from which on a face's edges are kept for a row.
const MANY: usize = 12;
/// Edges in a row from which on they are sorted along a line before they are searched.
const SORTED: usize = 16;

/// An edge between two faces.
#[derive(Clone, Copy)]
struct Between {
    left: FaceId,
    right: FaceId,
    edge: Edge,
    slope: f64,
}

/// What a boundary is where a line meets it.
#[derive(Clone, Copy)]
pub(super) enum Passing {
    /// An edge with its slope.
    Edge(Edge, f64),
    /// A line without ends: x in pixels, and pixels to the right per pixel downwards.
    Seam(f64, f64),
}

impl Passing {
    /// Where it lies at a height, if it goes on straight, in pixels.
    pub(super) fn x(&self, y: f64, from: f64) -> f64 {
        match self {
            Passing::Edge(edge, slope) => edge.top.x + (y - edge.top.y) * slope,
            Passing::Seam(x, slope) => x + (y - from) * slope,
        }
    }
}

/// Finds boundaries, line after line; remembers the edges of the last line, most of which the next one
/// crosses too, and those of faces that have many.
pub(super) struct Boundaries<'a> {
    image: &'a SpanImage,
    raster: Raster,
    /// The edges found on the last line and on this one, from left to right.
    last: Vec<Between>,
    found: Vec<Between>,
    /// Where in `last` the search goes on.
    cursor: usize,
    /// Edges of faces with many, of those that reach the lines `around`.
    edges: HashMap<FaceId, Near>,
    around: (f64, f64),
}

/// The edges of a face in a row.
struct Near {
    edges: Vec<Edge>,
    /// Of those that cross the line at the height `y`, where, from left to right.
    crossings: Vec<(u32, u32)>,
    y: f64,
}

impl<'a> Boundaries<'a> {
    pub(super) fn new(image: &'a SpanImage) -> Boundaries<'a> {
        Boundaries {
            image,
            raster: image.view().raster(),
            last: Vec::new(),
            found: Vec::new(),
            cursor: 0,
            edges: HashMap::new(),
            around: (f64::INFINITY, f64::NEG_INFINITY),
        }
    }

    /// The x in pixels at the top and bottom of the strip of line `k`, of the left boundary of every
    /// span but the first; beyond the raster's sides where it runs out. Appends to `top` and `bottom`.
    pub(super) fn of_line(
        &mut self,
        k: u32,
        line: &[Span],
        stacks: &Stacks<'_>,
        top: &mut Vec<f64>,
        bottom: &mut Vec<f64>,
    ) {
        let plan = self.image.plan();
        let (y, half) = (plan.y(k), 0.5 / f64::from(plan.per_row));
        self.look_around(y);
        std::mem::swap(&mut self.last, &mut self.found);
        self.found.clear();
        self.cursor = 0;
        let start = top.len();
        let cuts = self.image.cuts().line(k);
        for pair in line.windows(2) {
            let (above, below) = self.boundary(stacks, cuts, &pair[0], &pair[1], y, half);
            top.push(above);
            bottom.push(below);
        }
        let width = f64::from(self.raster.width);
        // A boundary that crosses any other crosses its neighbour: in order at both ends means
        // apart in the whole strip.
        if !(top[start..].is_sorted() && bottom[start..].is_sorted()) {
            let middle = line[1..].iter().map(|span| self.raster.pixels(span.x));
            separate(&middle.collect::<Vec<_>>(), width, &mut top[start..], &mut bottom[start..]);
        }
    }

    fn boundary(
        &mut self,
        stacks: &Stacks<'_>,
        cuts: &[Cut],
        left: &Span,
        right: &Span,
        y: f64,
        half: f64,
    ) -> (f64, f64) {
        let cell = right.x;
        let faces = (left.face, right.face);
        if let Some(known) = self.known(faces, cell, y) {
            self.found.push(known);
            return ends(&known.edge, known.slope, y, half);
        }
        match self.passing(stacks, cuts, faces, cell, y) {
            Passing::Edge(edge, slope) => {
                // Ids of stacks last for a row only.
                if stacks.get(faces.0).is_none() && stacks.get(faces.1).is_none() {
                    self.found.push(Between { left: faces.0, right: faces.1, edge, slope });
                }
                ends(&edge, slope, y, half)
            }
            Passing::Seam(x, slope) => (x - slope * half, x + slope * half),
        }
    }

    /// What parts two faces, or stacks, at a cell of the line at `y`, on which there are the `cuts`.
    pub(super) fn passing(
        &mut self,
        stacks: &Stacks<'_>,
        cuts: &[Cut],
        faces: (FaceId, FaceId),
        cell: u32,
        y: f64,
    ) -> Passing {
        let (left, right) = (stacks.members(&faces.0), stacks.members(&faces.1));
        // Neighbours differ in few: what they begin and end with alike is not searched.
        let (old, new) = differing(left, right);
        let ending = old.iter().filter(|id| !new.contains(id));
        let beginning = new.iter().filter(|id| !old.contains(id));
        let gone = cut::at(cuts, cell).iter().map(|cut| &cut.face);
        let mut owners = ending.chain(beginning).chain(gone.clone());
        // Edges first: they are known by the very cell that visibility rounded them to. Seams are
        // known within a tolerance only.
        if let Some(edge) = owners.clone().find_map(|id| self.edge_at(*id, cell, y, 0)) {
            return Passing::Edge(edge, edge.slope());
        }
        let x = self.raster.pixels(cell);
        let with_gone = || {
            let gone: Vec<FaceId> = gone.clone().copied().collect();
            self.seam(&gone, left, x, y).or_else(|| self.seam(&gone, right, x, y))
        };
        let seam = self.seam(old, right, x, y).or_else(|| self.seam(left, new, x, y));
        if let Some((x, slope)) = seam.or_else(with_gone) {
            return Passing::Seam(x, slope);
        }
        // Where faces were moved after they were rendered, rounding may have gone the other way.
        match owners.find_map(|id| self.edge_at(*id, cell, y, 1)) {
            Some(edge) => Passing::Edge(edge, edge.slope()),
            None => Passing::Seam(x, 0.0),
        }
    }

    /// Forgets edges that are far from a height.
    pub(super) fn look_around(&mut self, y: f64) {
        if y < self.around.0 || y >= self.around.1 {
            self.around = (y.floor(), y.floor() + 1.0);
            self.edges.clear();
        }
    }

    /// The edge that parted two faces on the last line, if this one crosses it at a cell.
    #[inline(always)]
    fn known(&mut self, faces: (FaceId, FaceId), cell: u32, y: f64) -> Option<Between> {
        // Edges keep their order from line to line, so the search goes on where the last one was
        // found. A few that have ended are passed over.
        let near = self.last.get(self.cursor..)?.iter().take(LOOK_AHEAD);
        let at = near.clone().position(|known| (known.left, known.right) == faces)?;
        let known = self.last[self.cursor + at];
        self.cursor += at + 1;
        let meets = || self.raster.cell(known.edge.x_by(known.slope, y)) == cell;
        (known.edge.crosses(y) && meets()).then_some(known)
    }

    /// The edge of a face, or of the one that it lies on, that crosses a line at a cell, or `slack` cells
    /// beside it.
    fn edge_at(&mut self, id: FaceId, cell: u32, y: f64, slack: u32) -> Option<Edge> {
        let raster = self.raster;
        let (source, face) = self.image.face(id);
        let table = &*source.faces;
        let own = if table.corner_count(face) < MANY {
            let meets = |edge: &Edge| raster.cell(edge.x_at(y)).abs_diff(cell) <= slack;
            table.crossing(face, y).find(meets)
        } else {
            let around = self.around;
            let near = self.edges.entry(id).or_insert_with(|| {
                let mut sides: Vec<Side> = Vec::new();
                table.sides_near(face, around.0, around.1, |side| sides.push(side));
                sides.sort_unstable_by_key(|side| side.place);
                let edges = sides.into_iter().map(|side| side.edge).collect();
                Near { edges, crossings: Vec::new(), y: f64::NAN }
            });
            near.at(cell, y, slack, raster)
        };
        own.or_else(|| {
            let Role::Seal(parent) = face.role else { return None };
            let (source, _) = self.image.locate(id);
            self.edge_at(self.image.id(source, parent as usize), cell, y, slack)
        })
    }

    /// Where the line passes along which two faces, of what is seen on the left and on the right, meet,
    /// or along which a limit of depth cuts one; and its slope, in pixels per pixel downwards.
    /// `None` if it does not pass here: the boundary is no seam.
    fn seam(&self, left: &[FaceId], right: &[FaceId], x: f64, y: f64) -> Option<(f64, f64)> {
        let plane = |id: &FaceId| self.image.face(*id).1.plane;
        let (front, back) = self.image.view().depth_range();
        let met =
            left.iter().flat_map(|p| right.iter().filter(move |q| *q != p).map(move |q| (p, q)));
        let met = met.map(|(p, q)| (plane(p), plane(q)));
        let own = [front, back].map(Plane::constant).into_iter();
        let limits = own.chain(self.image.limits().iter().copied());
        let cut =
            limits.flat_map(|limit| left.iter().chain(right).map(move |id| (plane(id), limit)));
        met.chain(cut).find_map(|(p, q)| {
            let (a, b, c) = (p.a - q.a, p.b - q.b, p.c - q.c);
            // Both depths are affine: they are equal where a x + b y + c is 0.
            let meets = -(b * y + c) / a;
            let slope = -b / a;
            // What is left of numbers that nearly cancel: planes that all but coincide meet where the
            // winner rule says, and the direction of their seam is known as well as their difference.
            let size = |p: &Plane| (p.a * x).abs() + (p.b * y).abs() + p.c.abs();
            let doubt = (size(&p) + size(&q)) * (8.0 * f64::EPSILON) / a.abs();
            let is_here = (meets - x).abs() < 1e-3 + doubt && slope.is_finite();
            is_here.then_some((if doubt < 1e-3 { meets } else { x }, slope))
        })
    }
}

impl Near {
    /// The edge that crosses the line at `y` at a cell, or `slack` cells beside it.
    fn at(&mut self, cell: u32, y: f64, slack: u32, raster: Raster) -> Option<Edge> {
        let at = |edge: &Edge| raster.cell(edge.x_at(y));
        if self.edges.len() < SORTED {
            let meets = |edge: &&Edge| edge.crosses(y) && at(edge).abs_diff(cell) <= slack;
            return self.edges.iter().find(meets).copied();
        }
        // Sorted once for a line, and searched for each of its boundaries.
        if self.y != y {
            let crossing = self.edges.iter().zip(0u32..).filter(|(edge, _)| edge.crosses(y));
            self.crossings.clear();
            self.crossings.extend(crossing.map(|(edge, place)| (at(edge), place)));
            self.crossings.sort_unstable();
            self.y = y;
        }
        let least = cell.saturating_sub(slack);
        let (x, place) = *self.crossings.get(self.crossings.partition_point(|c| c.0 < least))?;
        (x <= cell + slack).then(|| self.edges[place as usize])
    }
}

/// What two stacks do not begin and end with alike.
fn differing<'f>(left: &'f [FaceId], right: &'f [FaceId]) -> (&'f [FaceId], &'f [FaceId]) {
    let first = left.iter().zip(right).take_while(|(p, q)| p == q).count();
    let (left, right) = (&left[first..], &right[first..]);
    let last = left.iter().rev().zip(right.iter().rev()).take_while(|(p, q)| p == q).count();
    (&left[..left.len() - last], &right[..right.len() - last])
}

/// The x of an edge at the top and the bottom of a strip: followed alike upwards and downwards, so that
/// the line's own x stays the mean.
#[inline(always)]
fn ends(edge: &Edge, slope: f64, y: f64, half: f64) -> (f64, f64) {
    let reach = half.min(y - edge.top.y).min(edge.bottom.y - y);
    (edge.x_by(slope, y - reach), edge.x_by(slope, y + reach))
}
