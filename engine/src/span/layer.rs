//! Translucent faces: a set of segments on every line, beside the opaque spans.
//!
//! A face that lets through what lies behind it hides nothing and so takes no part in the merge of
//! opaque spans. Its segments are kept as a *set*, clipped by the opaque winners with the same winner
//! rule, united when images merge, and ordered by depth only when pixels are made. Sets are
//! associative where lists in order are not. A picture without translucent faces pays nothing.
//!
//! On a line the set has one form: a face's segments are apart and as long as they can be, all sorted
//! by first cell and face.

use std::ops::Range;

use super::line::{self, Span};
use super::{FaceId, OnLine};

/// A segment of a translucent face on a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(C)]
pub struct Segment {
    /// First cell, inclusive.
    pub start: u32,
    /// The face.
    pub face: FaceId,
    /// Last cell, exclusive.
    pub end: u32,
}

/// Appends the visible parts of segments: the cells in which their face wins against the opaque `line`.
pub fn clip(
    segments: &[Segment],
    line: &[Span],
    cells: u32,
    on_line: impl Fn(FaceId) -> OnLine,
    out: &mut Vec<Segment>,
) {
    for segment in segments {
        let face = on_line(segment.face);
        let first = line.partition_point(|span| span.x <= segment.start).saturating_sub(1);
        for (range, opaque) in line::segments(&line[first..], cells) {
            let shared = range.start.max(segment.start)..range.end.min(segment.end);
            if range.start >= segment.end {
                break;
            }
            if shared.is_empty() {
                continue;
            }
            let seen = if opaque.is_some() {
                let division = face.divide(&on_line(opaque), shared.clone());
                match division.first_wins_left {
                    true => shared.start..division.boundary,
                    false => division.boundary..shared.end,
                }
            } else {
                shared
            };
            if !seen.is_empty() {
                out.push(Segment { start: seen.start, face: segment.face, end: seen.end });
            }
        }
    }
}

/// Brings the segments of a line, from `from` on, into their one form.
pub fn normalize(segments: &mut Vec<Segment>, from: usize) {
    segments[from..].sort_unstable_by_key(|segment| (segment.face, segment.start));
    let mut kept = from;
    for i in from..segments.len() {
        let next = segments[i];
        match segments[from..kept].last_mut() {
            Some(last) if last.face == next.face && last.end >= next.start => {
                last.end = last.end.max(next.end);
            }
            _ => {
                segments[kept] = next;
                kept += 1;
            }
        }
    }
    segments.truncate(kept);
    segments[from..].sort_unstable();
}

/// What is seen through: cells in which the same faces lie over each other in the same order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Stack {
    /// The cells.
    pub cells: Range<u32>,
    /// The translucent faces, the nearest first.
    pub layers: Vec<FaceId>,
    /// The opaque face behind them, or none.
    pub opaque: FaceId,
}

/// A segment that is seen where the line is looked at.
struct SeenSegment {
    face: OnLine,
    end: u32,
    /// The one behind it, and the cell at which that comes before it; beyond all if it does not before one ends.
    behind: FaceId,
    until: u32,
}

/// Divides a line into stacks, from left to right. Where two layers cross, a new stack begins.
///
/// Layers are kept in their order from one stack to the next: only what begins, ends or crosses is looked at again.
pub fn stacks(
    line: &[Span],
    segments: &[Segment],
    cells: u32,
    on_line: impl Fn(FaceId) -> OnLine,
    mut each: impl FnMut(Stack),
) {
    let mut seen: Vec<SeenSegment> = Vec::new();
    let mut waiting = segments.iter().peekable();
    for (range, opaque) in line::segments(line, cells) {
        let mut x = range.start;
        while x < range.end {
            let crosses = seen.iter().any(|layer| layer.until <= x);
            seen.retain(|layer| layer.end > x);
            if crosses {
                seen.sort_by(|a, b| b.face.compare(&a.face, x));
            }
            while let Some(segment) = waiting.next_if(|segment| segment.start <= x) {
                let (face, end) = (on_line(segment.face), segment.end);
                let at = seen.partition_point(|layer| layer.face.compare(&face, x).is_gt());
                seen.insert(at, SeenSegment { face, end, behind: FaceId::NONE, until: u32::MAX });
            }
            look_behind(&mut seen, x);
            let next = waiting.peek().map_or(range.end, |segment| segment.start.min(range.end));
            let end = seen.iter().fold(next, |end, layer| end.min(layer.end).min(layer.until));
            let layers = seen.iter().map(|layer| layer.face.face()).collect();
            each(Stack { cells: x..end, layers, opaque });
            x = end;
        }
    }
}

/// Finds where layers, in their order at `x`, are crossed by those that have come to be behind them.
fn look_behind(seen: &mut [SeenSegment], x: u32) {
    for i in 0..seen.len() {
        let next = seen.get(i + 1).map_or(FaceId::NONE, |next| next.face.face());
        if seen[i].behind != next {
            let until = seen.get(i + 1).map_or(u32::MAX, |next| {
                let end = seen[i].end.min(next.end);
                let boundary = seen[i].face.divide(&next.face, x..end).boundary;
                if boundary < end { boundary } else { u32::MAX }
            });
            (seen[i].behind, seen[i].until) = (next, until);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(start: u32, end: u32, face: u32) -> Segment {
        Segment { start, face: FaceId(face), end }
    }

    #[test]
    fn sets_have_one_form() {
        let mut a = vec![segment(5, 9, 1), segment(0, 3, 2), segment(2, 5, 1), segment(8, 12, 1)];
        normalize(&mut a, 0);
        assert_eq!(a, [segment(0, 3, 2), segment(2, 12, 1)]);
        let before = a.clone();
        a.extend_from_slice(&before);
        normalize(&mut a, 0);
        assert_eq!(a, before);
    }
}
