//! Bands: a few neighbouring lines that are solved together, and where faces meet them.

use std::ops::Range;

use crate::camera::View;
use crate::raster::{LinePlan, Raster};
use crate::span::{DepthRange, Face, FaceTable, OnLine, Ring, Role};

/// Lines in a band. Faces are set up and thrown away once for all of them, and the compiler computes
/// them side by side.
pub(super) const LANES: usize = 8;

/// Neighbouring lines.
#[derive(Clone, Debug)]
pub(super) struct Band {
    /// The number of the first line.
    pub(super) first: u32,
    /// The lines, at most [`LANES`].
    pub(super) count: usize,
    /// Their heights in pixels; infinite where there is no line, or none inside the viewport: no edge
    /// crosses it there.
    pub(super) y: [f64; LANES],
}

impl Band {
    pub(super) fn new(view: &View, plan: LinePlan, lines: &Range<u32>, number: u32) -> Band {
        let first = lines.start + number * LANES as u32;
        let count = (lines.end - first).min(LANES as u32) as usize;
        let [_, top, _, bottom] = view.window();
        let y = std::array::from_fn(|lane| {
            let y = plan.y(first + lane as u32);
            let seen = lane < count && y >= top && y <= bottom;
            if seen { y } else { f64::INFINITY }
        });
        Band { first, count, y }
    }
}

/// Where one face meets each line of a band, in cells; an end before its start means nowhere.
#[derive(Clone, Debug)]
pub(super) struct Reach {
    pub(super) start: [u32; LANES],
    pub(super) end: [u32; LANES],
}

/// Where a ring that no line crosses more than twice meets the lines of a band.
#[inline(always)]
pub(super) fn reach(ring: Ring<'_>, band: &Band, raster: Raster) -> Reach {
    let mut low = [f64::INFINITY; LANES];
    let mut high = [f64::NEG_INFINITY; LANES];
    for edge in ring.edges() {
        let slope = edge.slope();
        let (left, right) = (edge.top.x.min(edge.bottom.x), edge.top.x.max(edge.bottom.x));
        for lane in 0..LANES {
            // The same operations in the same order as `Edge::x_at`.
            let y = band.y[lane];
            let x = (edge.top.x + (y - edge.top.y) * slope).max(left).min(right);
            let crosses = edge.top.y <= y && y < edge.bottom.y;
            low[lane] = if crosses && x < low[lane] { x } else { low[lane] };
            high[lane] = if crosses && x > high[lane] { x } else { high[lane] };
        }
    }
    Reach {
        start: low.map(|x| raster.cell(x)),
        // Nowhere: an end before the start.
        end: high.map(|x| raster.cell(x)),
    }
}

/// The segments of any face on a line, from left to right, in cells.
pub(super) fn segments(table: &FaceTable, face: &Face, y: f64, raster: Raster) -> Vec<Range<u32>> {
    match face.role {
        Role::Stroke => {
            let rings = table.rings(face).map(|ring| crossings(ring, y, raster));
            rings.fold(Vec::new(), |all, ring| unite(&all, &ring))
        }
        Role::Face => {
            let mut rings = table.rings(face).map(|ring| crossings(ring, y, raster));
            let outline = rings.next().unwrap_or_default();
            if outline.is_empty() {
                return outline;
            }
            rings.fold(outline, |rest, hole| subtract(&rest, &hole))
        }
        Role::Seal(parent) => {
            let mut rings = table.rings(face).map(|ring| crossings(ring, y, raster));
            let seal = rings.next().unwrap_or_default();
            if seal.is_empty() {
                return seal;
            }
            let parent = &table.faces()[parent as usize];
            intersect(&seal, &segments(table, parent, y, raster))
        }
    }
}

/// The inside of a ring on a line, by the even-odd rule.
fn crossings(ring: Ring<'_>, y: f64, raster: Raster) -> Vec<Range<u32>> {
    let mut cells: Vec<u32> = ring.crossing(y).map(|edge| raster.cell(edge.x_at(y))).collect();
    cells.sort_unstable();
    cells.chunks_exact(2).filter(|pair| pair[0] < pair[1]).map(|pair| pair[0]..pair[1]).collect()
}

/// Combines two lists of segments: where `keep(in a, in b)`.
fn combine(
    a: &[Range<u32>],
    b: &[Range<u32>],
    keep: impl Fn(bool, bool) -> bool,
) -> Vec<Range<u32>> {
    let ends = |list: &[Range<u32>], which: usize| -> Vec<(u32, usize)> {
        list.iter().flat_map(|r| [(r.start, which), (r.end, which)]).collect()
    };
    let mut events = ends(a, 0);
    events.extend(ends(b, 1));
    events.sort_unstable();
    let mut inside = [false; 2];
    let mut open = None;
    let mut out = Vec::new();
    for (i, (x, which)) in events.iter().enumerate() {
        inside[*which] = !inside[*which];
        if events.get(i + 1).is_some_and(|next| next.0 == *x) {
            continue;
        }
        match (open, keep(inside[0], inside[1])) {
            (None, true) => open = Some(*x),
            (Some(start), false) => {
                out.push(start..*x);
                open = None;
            }
            _ => {}
        }
    }
    out
}

fn unite(a: &[Range<u32>], b: &[Range<u32>]) -> Vec<Range<u32>> {
    combine(a, b, |a, b| a || b)
}

fn subtract(a: &[Range<u32>], b: &[Range<u32>]) -> Vec<Range<u32>> {
    combine(a, b, |a, b| a && !b)
}

fn intersect(a: &[Range<u32>], b: &[Range<u32>]) -> Vec<Range<u32>> {
    combine(a, b, |a, b| a && b)
}

/// The limits of what is seen: the viewport's sides in cells, and the front and back planes.
#[derive(Clone, Debug)]
pub(super) struct Limits {
    cells: Range<u32>,
    /// Whether the viewport is narrower than the raster.
    narrow: bool,
    depths: DepthRange,
}

impl Limits {
    pub(super) fn new(view: &View) -> Limits {
        let raster = view.raster();
        let [left, _, right, _] = view.window();
        let cells = raster.cell(left)..raster.cell(right);
        let (front, back) = view.depth_range();
        let front = front.is_finite().then_some(front);
        let back = view.camera().back.is_some().then_some(back);
        let narrow = cells != (0..raster.cells());
        Limits { narrow, cells, depths: DepthRange { front, back } }
    }

    /// Whether nothing is ever cut.
    pub(super) fn are_open(&self) -> bool {
        !self.narrow && self.depths.is_open()
    }

    /// The part of a segment that is seen.
    pub(super) fn cut(
        &self,
        segment: Range<u32>,
        face: &OnLine,
        y: f64,
        raster: Raster,
    ) -> Range<u32> {
        let inside = segment.start.max(self.cells.start)..segment.end.min(self.cells.end);
        self.depths.cut(inside, face, y, raster)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_combine_as_sets() {
        let (a, b) = (vec![0..10, 20..30], vec![5..25, 30..40]);
        assert_eq!(unite(&a, &b), vec![0..40]);
        assert_eq!(subtract(&a, &b), vec![0..5, 25..30]);
        assert_eq!(intersect(&a, &b), vec![5..10, 20..25]);
        assert_eq!(subtract(&a, &a), vec![]);
        assert_eq!(unite(&a, &[]), a);
    }
}
