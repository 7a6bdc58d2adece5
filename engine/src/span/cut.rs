//! Cuts: boundaries whose owner is no longer there.
//!
//! A boundary of a line is an edge of one of the two faces beside it, or the seam of their planes; whoever
//! wants its slope derives it from them. Operations that take faces away would leave boundaries without an
//! owner: what a matte held out ends at the matte's edge, and the matte is not seen. So what takes a face
//! away leaves a *cut* where that face parted the line: the cell, and the face. Together with the
//! [limits](super::SpanImage::limits) of an image, planes that cut it by depth, every boundary has its owner.
//!
//! Cuts decide nothing about what is seen. On a line they are a set, sorted, so that images that are united
//! in any order and any number of times have the same.

use super::line::Span;
use super::{FaceId, Segment};

/// Where a line was parted by a face that is not there any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct Cut {
    /// The boundary: the first cell to its right.
    pub x: u32,
    /// The face whose edge the boundary is, or along whose plane a neighbour was cut.
    pub face: FaceId,
}

/// Brings the cuts of a line, from `from` on, into their one form.
pub fn normalize(cuts: &mut Vec<Cut>, from: usize) {
    cuts[from..].sort_unstable();
    let mut kept = from;
    for i in from..cuts.len() {
        if kept == from || cuts[kept - 1] != cuts[i] {
            cuts[kept] = cuts[i];
            kept += 1;
        }
    }
    cuts.truncate(kept);
}

/// The cuts at a boundary.
pub fn at(cuts: &[Cut], x: u32) -> &[Cut] {
    let from = cuts.partition_point(|cut| cut.x < x);
    let count = cuts[from..].iter().take_while(|cut| cut.x == x).count();
    &cuts[from..from + count]
}

/// The cuts that faces leave which stood on the line `before` and do not stand on the line `after`, where
/// something that is kept ends or begins with them: an opaque span of `after`, or one of `layers`.
/// Appends to `out`, not in order.
pub fn left_by(
    before: &[Span],
    after: &[Span],
    layers: &[Segment],
    cells: u32,
    out: &mut Vec<Cut>,
) {
    // Boundaries of what is kept, from left to right.
    let ends = layers.iter().flat_map(|segment| [segment.start, segment.end]);
    let mut ends: Vec<u32> = after[1..].iter().map(|span| span.x).chain(ends).collect();
    ends.sort_unstable();
    ends.dedup();
    let (mut i, mut j) = (0, 0);
    for x in ends.into_iter().filter(|x| *x > 0 && *x < cells) {
        // The spans that hold the cell to the left of the boundary.
        i += before[i + 1..].partition_point(|span| span.x < x);
        j += after[j + 1..].partition_point(|span| span.x < x);
        // The cell left of the boundary, then the cell right of it.
        for step in [0, 1] {
            let on = |line: &[Span], at: usize| match line.get(at + step) {
                Some(next) if step == 0 || next.x == x => next.face,
                _ => line[at].face,
            };
            let (was, is) = (on(before, i), on(after, j));
            if was.is_some() && was != is {
                out.push(Cut { x, face: was });
            }
        }
    }
}

/// The cuts of a line with other ids.
pub(super) fn renamed(cuts: &[Cut], id: impl Fn(FaceId) -> FaceId, out: &mut Vec<Cut>) {
    let start = out.len();
    out.extend(cuts.iter().map(|cut| Cut { face: id(cut.face), ..*cut }));
    normalize(out, start);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(spans: &[(u32, u32)]) -> Vec<Span> {
        let face = |face: u32| if face == 0 { FaceId::NONE } else { FaceId(face) };
        spans.iter().map(|(x, id)| Span { x: *x, face: face(*id) }).collect()
    }

    #[test]
    fn what_is_taken_away_leaves_its_name_where_it_parted_what_stays() {
        let before = line(&[(0, 1), (10, 2), (20, 3), (30, 0)]);
        let cuts = |after: &[(u32, u32)], layers: &[(u32, u32, u32)]| {
            let segment = |s: &(u32, u32, u32)| Segment { start: s.0, face: FaceId(s.2), end: s.1 };
            let layers: Vec<Segment> = layers.iter().map(segment).collect();
            let mut out = Vec::new();
            left_by(&before, &line(after), &layers, 40, &mut out);
            normalize(&mut out, 0);
            out.iter().map(|cut| (cut.x, cut.face.0)).collect::<Vec<_>>()
        };
        // The second is taken away; the first and the third end with it.
        assert_eq!(cuts(&[(0, 1), (10, 0), (20, 3), (30, 0)], &[]), [(10, 2), (20, 2)]);
        // Nothing is.
        assert_eq!(cuts(&[(0, 1), (10, 2), (20, 3), (30, 0)], &[]), []);
        // Nothing is left.
        assert_eq!(cuts(&[(0, 0)], &[]), []);
        // A layer ends in the middle of what is taken away, at the seam of the two.
        assert_eq!(cuts(&[(0, 1), (10, 0)], &[(3, 25, 9)]), [(10, 2), (25, 3)]);
    }
}
