//! What was solved, as bytes: exact, and worth nothing without the frame that it was solved for.

use crate::span::layer::Segment;
use crate::span::line::Span;
use crate::span::{FaceId, Layers, Lines, SpanImage};

/// The lines and layers of an image that was solved.
pub fn packed(image: &SpanImage) -> Vec<u8> {
    let mut words: Vec<u32> = Vec::new();
    let (lines, layers) = (image.lines(), image.layers());
    let range = lines.range();
    words.extend([range.start, range.end]);
    words.extend(range.clone().map(|k| lines.line(k).len() as u32));
    words.extend(lines.items().iter().flat_map(|span| [span.x, span.face.0]));
    words.extend(range.map(|k| layers.line(k).len() as u32));
    let segments = layers.items().iter();
    words.extend(segments.flat_map(|segment| [segment.start, segment.face.0, segment.end]));
    words.into_iter().flat_map(u32::to_le_bytes).collect()
}

/// The lines and layers of a frame, from what [`packed`] made of them; `None` if they are not such.
pub(super) fn unpacked(frame: &SpanImage, bytes: &[u8]) -> Option<(Lines, Layers)> {
    let (words, []) = bytes.as_chunks::<4>() else { return None };
    let mut words = words.iter().map(|word| u32::from_le_bytes(*word));
    let range = frame.lines().range();
    if (words.next()?, words.next()?) != (range.start, range.end) {
        return None;
    }
    let faces = frame.face_count() as u32;
    let is_face = |face: FaceId| face.0 < faces;
    let mut starts = |left: usize, width: usize| -> Option<(Vec<usize>, Vec<u32>)> {
        let mut starts = vec![0usize];
        for _ in range.clone() {
            let count = words.next()? as usize;
            starts.push(starts[starts.len() - 1].checked_add(count)?);
        }
        let items = starts[starts.len() - 1].checked_mul(width)?;
        // Never more than there is.
        (items <= left).then(|| (starts, words.by_ref().take(items).collect()))
    };
    let left = bytes.len() / 4;
    let (line_starts, spans) = starts(left, 2)?;
    let (layer_starts, segments) = starts(left, 3)?;
    let spans: Vec<Span> = spans
        .as_chunks::<2>()
        .0
        .iter()
        .map(|[x, face]| Span { x: *x, face: FaceId(*face) })
        .collect();
    let segments: Vec<Segment> = segments
        .as_chunks::<3>()
        .0
        .iter()
        .map(|[start, face, end]| Segment { start: *start, face: FaceId(*face), end: *end })
        .collect();
    let is_whole = spans.len() == line_starts[line_starts.len() - 1]
        && segments.len() == layer_starts[layer_starts.len() - 1]
        && words.next().is_none();
    let is_sound = spans.iter().all(|span| !span.face.is_some() || is_face(span.face))
        && segments.iter().all(|segment| is_face(segment.face) && segment.start < segment.end);
    (is_whole && is_sound).then(|| {
        let lines = Lines::from_parts(range.start, line_starts, spans);
        (lines, Layers::from_parts(range.start, layer_starts, segments))
    })
}
