//! One line: a row of cells, run-length coded, and the merge of two lines.
//!
//! A line is a slice of [`Span`]s. Each runs from its `x` to the next one's, the last to the end of
//! the raster. The first begins at cell 0; neighbours differ in face; background is a span too. So a
//! line has exactly one form, and equal pictures are equal bytes.

use std::ops::Range;

use super::FaceId;
use super::order::OnLine;

/// A visible segment: its first cell and its face. It ends where the next begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(C)]
pub struct Span {
    /// First cell, inclusive, from the left border of the raster.
    pub x: u32,
    /// The face seen, or [`FaceId::NONE`].
    pub face: FaceId,
}

impl Span {
    /// The span with another face; background stays.
    pub(super) fn renamed(&self, id: impl Fn(FaceId) -> FaceId) -> Span {
        let face = if self.face.is_some() { id(self.face) } else { FaceId::NONE };
        Span { x: self.x, face }
    }
}

/// The segments of a line with their ends: `(cells, face)` from left to right.
pub fn segments(line: &[Span], cells: u32) -> impl Iterator<Item = (Range<u32>, FaceId)> + '_ {
    let ends = line.iter().skip(1).map(|span| span.x).chain(std::iter::once(cells));
    line.iter().zip(ends).map(|(span, end)| (span.x..end, span.face))
}

/// Appends a segment to a line under construction, keeping it run-length coded.
#[inline(always)]
pub fn push(line: &mut Vec<Span>, start: usize, x: u32, face: FaceId) {
    match line.get(start..).and_then(<[Span]>::last) {
        Some(last) if last.face == face => {}
        _ => line.push(Span { x, face }),
    }
}

/// Merges two lines by depth: in every cell the winner of the two. Appends to `out`.
///
/// This is the composition of span buffers of \[N], figs. 4 to 6: over each *sample span*, between
/// consecutive boundaries of either input, each input shows one face, and the two do not cross, cross
/// or overlap. `on_line` gives a face's depth on this line.
pub fn merge(
    a: &[Span],
    b: &[Span],
    cells: u32,
    on_line: impl Fn(FaceId) -> OnLine,
    out: &mut Vec<Span>,
) {
    let start = out.len();
    let (mut i, mut j, mut x) = (0, 0, 0);
    // What a face is on this line is found out once for a span, and only where it meets another.
    let (mut on_line_a, mut on_line_b): (Option<OnLine>, Option<OnLine>) = (None, None);
    while x < cells {
        let end_a = a.get(i + 1).map_or(cells, |span| span.x);
        let end_b = b.get(j + 1).map_or(cells, |span| span.x);
        let end = end_a.min(end_b);
        let (face_a, face_b) = (a[i].face, b[j].face);
        // [N] puts background on a plane far behind everything. Here it is the absence of a face:
        // no depth, however small, can lie behind it.
        if face_b == FaceId::NONE || face_a == face_b {
            push(out, start, x, face_a);
        } else if face_a == FaceId::NONE {
            push(out, start, x, face_b);
        } else {
            let a = on_line_a.get_or_insert_with(|| on_line(face_a));
            let division = a.divide(on_line_b.get_or_insert_with(|| on_line(face_b)), x..end);
            let (left, right) =
                if division.first_wins_left { (face_a, face_b) } else { (face_b, face_a) };
            push(out, start, x, left);
            if division.boundary < end {
                push(out, start, division.boundary, right);
            }
        }
        if end_a == end {
            (i, on_line_a) = (i + 1, None);
        }
        if end_b == end {
            (j, on_line_b) = (j + 1, None);
        }
        x = end;
    }
}

/// The visible part of any segments on a line, the upper envelope under the winner rule, appended to
/// `out`: halves are solved and merged, O(K alpha(K) log K) for K segments where comparing all pairs
/// takes K^2 (\[N], "Compositing 3D images").
pub fn envelope(
    segments: &[(Range<u32>, FaceId)],
    cells: u32,
    on_line: &impl Fn(FaceId) -> OnLine,
    out: &mut Vec<Span>,
) {
    match segments {
        [] => out.push(Span { x: 0, face: FaceId::NONE }),
        [(range, face)] => {
            let start = out.len();
            if range.start > 0 || range.is_empty() {
                out.push(Span { x: 0, face: FaceId::NONE });
            }
            if !range.is_empty() {
                push(out, start, range.start, *face);
                if range.end < cells {
                    push(out, start, range.end, FaceId::NONE);
                }
            }
        }
        _ => {
            // Divided anywhere the line would be the same, as "nearer" is a total order.
            let (front, back) = segments.split_at(segments.len() / 2);
            let (mut a, mut b) = (Vec::new(), Vec::new());
            envelope(front, cells, on_line, &mut a);
            envelope(back, cells, on_line, &mut b);
            merge(&a, &b, cells, on_line, out);
        }
    }
}
