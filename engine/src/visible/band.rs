//! Bands: a few neighbouring lines that are solved together, and where faces meet them.

use std::ops::Range;

use crate::camera::View;
use crate::raster::{LinePlan, Raster};
use crate::span::edges::Side;
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
pub(super) struct BandReach {
    pub(super) start: [u32; LANES],
    pub(super) end: [u32; LANES],
}

/// Where a ring that no line crosses more than twice meets the lines of a band.
#[inline(always)]
pub(super) fn reach(ring: Ring<'_>, band: &Band, raster: Raster) -> BandReach {
    let mut low = [f64::INFINITY; LANES];
    let mut high = [f64::NEG_INFINITY; LANES];
    for edge in ring.edges() {
        let slope = edge.slope();
        let (left, right) = (edge.top.x.min(edge.bottom.x), edge.top.x.max(edge.bottom.x));
        for lane in 0..LANES {
            // The same operations in the same order as `Edge::x_at`.
            // Other ways to find a boundary use that one, and all must round to the same cell.
            let y = band.y[lane];
            let x = (edge.top.x + (y - edge.top.y) * slope).max(left).min(right);
            // No branch: the compiler makes selections of these, all lanes at once. Of a ring that
            // is crossed twice the least and the greatest x are the two crossings.
            let crosses = edge.top.y <= y && y < edge.bottom.y;
            low[lane] = if crosses && x < low[lane] { x } else { low[lane] };
            high[lane] = if crosses && x > high[lane] { x } else { high[lane] };
        }
    }
    BandReach {
        start: low.map(|x| raster.cell(x)),
        // Nowhere: an end before the start.
        end: high.map(|x| raster.cell(x)),
    }
}

/// What a ring says of what is inside of it.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Region {
    /// The face may be there.
    Outline,
    /// The face is not there.
    Hole,
    /// The seal may be there.
    Seal,
    /// The drawn edge is there.
    Stroke,
}

/// The segments of any face on a line, from left to right, in cells: the outline by the even-odd rule,
/// less all holes together; of a seal what of that lies in it; of a drawn edge the union of its rings.
pub(super) fn segments(table: &FaceTable, face: &Face, y: f64, raster: Raster) -> Vec<Range<u32>> {
    let mut found: Vec<(Region, u32, u32)> = Vec::new();
    let mut cross = |face: &Face, region: fn(u32) -> Region| {
        table.sides_near(face, y, y, |Side { ring, edge, .. }| {
            if edge.crosses(y) {
                found.push((region(ring), ring, raster.cell(edge.x_at(y))));
            }
        });
    };
    let of_face = |ring| if ring == 0 { Region::Outline } else { Region::Hole };
    match face.role {
        Role::Face => cross(face, of_face),
        Role::Stroke => cross(face, |_| Region::Stroke),
        // A seal ends where its face ends or has a hole, so the face's rings count too.
        Role::Seal(parent) => {
            cross(face, |_| Region::Seal);
            cross(&table.faces()[parent as usize], of_face);
        }
    }
    // Regions and rings apart, each from left to right. A closed ring crosses a line an even number
    // of times, so that no pair below mixes two rings.
    found.sort_unstable();
    let pairs = || found.chunks_exact(2).filter(|pair| pair[0].2 < pair[1].2);
    let is_plain = found.last().is_none_or(|last| (last.0, last.1) == (Region::Outline, 0));
    if is_plain && face.role == Role::Face {
        return pairs().map(|pair| pair[0].2..pair[1].2).collect();
    }
    // Every ring begins and ends where it is crossed, by turns; regions of several rings are counted.
    let ends = pairs().flat_map(|pair| [(pair[0].2, pair[0].0, 1), (pair[1].2, pair[1].0, -1)]);
    let mut ends: Vec<(u32, Region, i32)> = ends.collect();
    ends.sort_unstable();
    let mut inside = [0; 4];
    let mut open = None;
    let mut out = Vec::new();
    for (i, (x, region, step)) in ends.iter().enumerate() {
        inside[*region as usize] += step;
        // All that begins or ends in one cell is counted before anything is decided: rings that
        // touch leave no segment without cells.
        if ends.get(i + 1).is_some_and(|next| next.0 == *x) {
            continue;
        }
        let [outline, holes, seal, stroke] = inside.map(|count| count > 0);
        let is_there = match face.role {
            Role::Face => outline && !holes,
            Role::Seal(_) => outline && !holes && seal,
            Role::Stroke => stroke,
        };
        match (open, is_there) {
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
        // Where the front is the eye itself, or nothing limits the back, there is nothing to cut.
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
    use crate::camera::Plane;
    use crate::span::{FaceHead, FaceTableBuilder};
    use glam::DVec2;

    /// The segments at the height .5 of a face with rectangles, given by their sides, as its rings.
    fn of(rings: &[(f64, f64)], seal: Option<(f64, f64)>, role: Role) -> Vec<(f64, f64)> {
        let raster = Raster::new(64, 1).unwrap();
        let mut table = FaceTableBuilder::new();
        let mut rectangle = |(left, right): (f64, f64)| {
            let corners = [(left, 0.0), (right, 0.0), (right, 1.0), (left, 1.0)];
            let first = table.points(corners.map(|(x, y)| DVec2::new(x, y))).unwrap();
            [first, first + 1, first + 2, first + 3]
        };
        let of_face: Vec<[u32; 4]> = rings.iter().copied().map(&mut rectangle).collect();
        let of_seal = seal.map(&mut rectangle);
        let head = |ordinal, role| {
            let (plane, rank) = (Plane::constant(1.0), ordinal);
            FaceHead { ordinal, plane, rank, role, sees_front: true, is_translucent: false }
        };
        table.face(head(0, role), of_face.iter().map(|ring| &ring[..])).unwrap();
        if let Some(ring) = of_seal {
            table.face(head(1, Role::Seal(0)), [&ring[..]]).unwrap();
        }
        let table = table.finish();
        let face = table.faces().last().unwrap();
        let found = segments(&table, face, 0.5, raster).into_iter();
        found.map(|cells| (raster.pixels(cells.start), raster.pixels(cells.end))).collect()
    }

    #[test]
    fn a_face_is_its_outline_less_all_of_its_holes() {
        let of_face = |rings: &[(f64, f64)]| of(rings, None, Role::Face);
        assert_eq!(of_face(&[(0.0, 10.0)]), [(0.0, 10.0)]);
        assert_eq!(of_face(&[(0.0, 10.0), (2.0, 3.0)]), [(0.0, 2.0), (3.0, 10.0)]);
        // Holes that overlap are one, and one that reaches beyond the outline ends with it.
        let overlapping = [(0.0, 10.0), (2.0, 4.0), (3.0, 5.0), (3.5, 3.7), (9.0, 12.0)];
        assert_eq!(of_face(&overlapping), [(0.0, 2.0), (5.0, 9.0)]);
        assert_eq!(of_face(&[(1.0, 2.0), (0.0, 9.0)]), []);
        // Rings that touch.
        assert_eq!(of_face(&[(0.0, 10.0), (2.0, 4.0), (4.0, 6.0)]), [(0.0, 2.0), (6.0, 10.0)]);
    }

    #[test]
    fn a_seal_is_cut_to_its_face_and_strokes_are_one() {
        let rings = [(0.0, 10.0), (2.0, 4.0), (3.0, 5.0)];
        assert_eq!(of(&rings, Some((3.0, 12.0)), Role::Face), [(5.0, 10.0)]);
        assert_eq!(of(&rings, Some((1.0, 9.0)), Role::Face), [(1.0, 2.0), (5.0, 9.0)]);
        assert_eq!(
            of(&[(0.0, 2.0), (1.0, 3.0), (5.0, 6.0)], None, Role::Stroke),
            [(0.0, 3.0), (5.0, 6.0)]
        );
    }
}
