//! What is seen as it was in the frame before (\[N]: "the compositing is done by recalculating only moving elements").
//!
//! Of each cluster over a view the frame that was solved last is kept, as long as one run goes on. Bands of lines that no face meets which came, went
//! or changed are taken from it: bit for bit what they would be, as the winner rule knows nothing but the faces on a line.

use std::ops::Range;
use std::sync::Arc;

use super::band::LANES;
use super::bins::{self, Bands};
use crate::cache::Shelf;
use crate::key::Key;
use crate::span::{FaceId, FaceTable, Layers, Lines, Segment, Span, SpanImage, matched};
use crate::watch::Watch;

/// A frame that was solved before, and what of it another still has.
pub(super) struct Before {
    solved: Arc<SpanImage>,
    /// The ids that its faces have now.
    ids: Vec<FaceId>,
    /// By band, whether any face of it is another.
    changed: Vec<bool>,
}

/// Frames that may have lines in common.
fn key(frame: &SpanImage) -> Key {
    let labels: Vec<&str> = frame.sources().iter().map(|source| &*source.label).collect();
    let (view, rows) = (frame.view(), frame.rows());
    let raster = view.raster();
    Key::of(&(
        "seen",
        view.camera(),
        raster.width,
        raster.height,
        frame.plan(),
        (rows.start, rows.end),
        labels,
    ))
}

/// Keeps what was solved, for the next frame instead of the one before.
pub(super) fn keep(solved: &SpanImage, watch: &Watch, seconds: f64) {
    if let Some(shelf) = Shelf::of_work(watch).filter(|_| !watch.is_stopped()) {
        let (key, bytes) = (key(solved), solved.bytes());
        let solved = solved.clone().with_probing(None);
        shelf.renew((key, 0), Arc::new(solved), bytes, seconds);
    }
}

impl Before {
    /// What was solved last of a cluster like a frame's, if they have anything in common.
    pub(super) fn of(frame: &SpanImage, watch: &Watch) -> Option<Before> {
        let kept = Shelf::of_work(watch)?.get(key(frame), 0)?;
        let solved: Arc<SpanImage> = kept.downcast().ok()?;
        if solved.limits() != frame.limits() || solved.view() != frame.view() {
            return None;
        }
        let lines = frame.plan().lines(&frame.rows());
        let mut ids = vec![FaceId::NONE; solved.face_count()];
        let mut changed = vec![false; lines.len().div_ceil(LANES)];
        let mut change = |table: &FaceTable, place: usize| {
            let (first, end) = bins::met(&solved, &lines, table.extent(&table.faces()[place]));
            changed[first as usize..end as usize].fill(true);
        };
        for (at, (now, was)) in frame.sources().iter().zip(solved.sources()).enumerate() {
            let mut is_gone = vec![true; was.faces.faces().len()];
            for (place, found) in matched(&now.faces, &was.faces).into_iter().enumerate() {
                match found {
                    Some(found) => {
                        is_gone[found as usize] = false;
                        ids[solved.id(at, found as usize).0 as usize] = frame.id(at, place);
                    }
                    None => change(&now.faces, place),
                }
            }
            let gone = is_gone.iter().enumerate().filter(|(_, is_gone)| **is_gone);
            gone.for_each(|(place, _)| change(&was.faces, place));
        }
        Some(Before { solved, ids, changed })
    }

    /// Of bands, half-open, those from the first to the last in which a face is another.
    pub(super) fn changed(&self, (first, end): Bands) -> Bands {
        let is_changed = |band: &u32| self.changed[*band as usize];
        match ((first..end).find(is_changed), (first..end).rfind(is_changed)) {
            (Some(first), Some(last)) => (first, last + 1),
            _ => (0, 0),
        }
    }

    /// The lines of a band, if no face of it is another.
    pub(super) fn band(&self, number: u32, lines: Range<u32>) -> Option<(Lines, Layers)> {
        if self.changed[number as usize] {
            return None;
        }
        let now = |face: FaceId| match face.is_some() {
            true => self.ids[face.0 as usize],
            false => face,
        };
        let (mut spans, mut segments) = (Vec::new(), Vec::new());
        let (mut starts, mut layer_starts) = (vec![0], vec![0]);
        for k in lines.clone() {
            let line = self.solved.lines().line(k).iter();
            spans.extend(line.map(|span| Span { face: now(span.face), ..*span }));
            starts.push(spans.len());
            let layers = self.solved.layers().line(k).iter();
            segments.extend(layers.map(|part| Segment { face: now(part.face), ..*part }));
            layer_starts.push(segments.len());
        }
        let layers = Layers::from_parts(lines.start, layer_starts, segments);
        Some((Lines::from_parts(lines.start, starts, spans), layers))
    }
}
