//! The union of shadows on a line, and the slopes of their ends.

use super::{Dark, End};
use crate::span::slopes;

/// Ends nearer than this, in pixels, are one: what rounding parts.
const TOUCHING: f64 = 1e-9;

/// Unites the shadows of a line face by face, so that none overlap and there is no end where as much light
/// arrives on both sides.
pub(super) fn unite(line: &mut Vec<Dark>) {
    if line.len() < 2 {
        return;
    }
    line.sort_unstable_by(|a, b| {
        let key = |dark: &Dark| (dark.face, dark.start.x);
        let ((face, x), (other_face, other_x)) = (key(a), key(b));
        face.cmp(&other_face)
            .then(x.total_cmp(&other_x))
            // The rest makes the order, and so the ends and products below, independent of how casters
            // were found.
            .then(b.end.x.total_cmp(&a.end.x))
            .then(a.through.total_cmp(&b.through))
            .then(a.start.slope.total_cmp(&b.start.slope))
            .then(a.end.slope.total_cmp(&b.end.slope))
    });
    // Where all casters are opaque, intervals need only be joined.
    if line.iter().all(|dark| dark.through == 0.0) {
        let mut kept = 0;
        for i in 1..line.len() {
            let next = line[i];
            let last = &mut line[kept];
            if last.face == next.face && next.start.x <= last.end.x + TOUCHING {
                if next.end.x > last.end.x {
                    last.end = next.end;
                }
            } else {
                kept += 1;
                line[kept] = next;
            }
        }
        line.truncate(kept + 1);
        return;
    }
    // Where translucent casters lie over each other their shares multiply.
    let mut all: Vec<Dark> = Vec::new();
    for of_face in line.chunk_by(|a, b| a.face == b.face) {
        let mut ends: Vec<End> = of_face.iter().flat_map(|dark| [dark.start, dark.end]).collect();
        ends.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.slope.total_cmp(&b.slope)));
        // Between two neighbouring ends no caster begins or ends, and as much light arrives
        // everywhere.
        ends.dedup_by(|a, b| a.x - b.x <= TOUCHING);
        let (mut active, mut next): (Vec<&Dark>, usize) = (Vec::new(), 0);
        for pair in ends.windows(2) {
            let middle = (pair[0].x + pair[1].x) / 2.0;
            while let Some(dark) = of_face.get(next).filter(|dark| dark.start.x <= middle) {
                active.push(dark);
                next += 1;
            }
            active.retain(|dark| middle < dark.end.x);
            let through: f32 = active.iter().map(|dark| dark.through).product();
            let (face, start, end) = (of_face[0].face, pair[0], pair[1]);
            match all.last_mut() {
                _ if through == 1.0 => {}
                Some(last) if (last.face, last.through, last.end) == (face, through, start) => {
                    last.end = end;
                }
                _ => all.push(Dark { face, start, end, through }),
            }
        }
    }
    *line = all;
}

/// Flattens the slopes of the ends of a face's shadows so that, within half a strip up and down, they
/// neither meet nor leave that one of the face's `spans` that they lie in, in pixels. What is lost above is lost below,
/// so that areas stay.
pub(super) fn settle(mut dark: &mut [Dark], spans: &[[f64; 2]], half: f64) {
    let is_upright = |dark: &Dark| dark.start.slope == 0.0 && dark.end.slope == 0.0;
    if dark.iter().all(is_upright) {
        return;
    }
    let (mut middle, mut top, mut bottom) = (Vec::new(), Vec::new(), Vec::new());
    while let Some(first) = dark.first() {
        let around = spans.iter().find(|[_, right]| first.start.x < *right);
        let [left, right] = *around.unwrap_or(&[first.start.x, first.end.x]);
        let count = dark.iter().take_while(|dark| dark.start.x < right).count().max(1);
        let (inside, rest) = dark.split_at_mut(count);
        dark = rest;
        // The sides of the span, and between them all ends; two shadows that touch share one.
        let wall = |x| End { x, slope: 0.0 };
        let mut ends: Vec<End> = vec![wall(left.min(inside[0].start.x))];
        for Dark { start, end, .. } in inside.iter() {
            if start.x > ends[ends.len() - 1].x || ends.len() == 1 {
                ends.push(*start);
            }
            ends.push(*end);
        }
        ends.push(wall(right.max(ends[ends.len() - 1].x)));
        middle.clear();
        middle.extend(ends.iter().map(|end| end.x));
        top.clear();
        top.extend(ends.iter().map(|end| end.x - end.slope * half));
        bottom.clear();
        bottom.extend(ends.iter().map(|end| end.x + end.slope * half));
        // The walls are upright, so nothing moves them: an end that would cross one is turned until
        // it does not.
        slopes::separate(&middle, f64::INFINITY, &mut top, &mut bottom);
        let slope = |at: usize| (bottom[at] - top[at]) / (2.0 * half);
        let mut at = 0;
        for Dark { start, end, .. } in inside {
            if start.x > ends[at].x || at == 0 {
                at += 1;
            }
            start.slope = slope(at);
            at += 1;
            end.slope = slope(at);
        }
    }
}
