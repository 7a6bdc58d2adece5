//! Visible surfaces: the solver below all renderers of faces.
//!
//! The scan-line method of both papers, \[N] and \[D] "Shading display with shadow": faces are sorted
//! into buckets by y, and every line finds the visible one among the faces that it meets. "Visible" is
//! the winner rule of [`crate::span::order`], the same that merges images, so that rendering clusters
//! apart and merging them gives the same bits as rendering them together.
//!
//! It knows faces on the screen and nothing of scenes: renderers make faces of them.
//!
//! Reading path: `clip` (what reaches far beyond the screen), `band` (where a face meets lines), `tiles` (the
//! visible part of all), `again` (what is as it was), [`probe`] (the same anywhere, on demand).

mod again;
mod band;
mod bins;
pub(crate) mod clip;
pub mod probe;
pub mod stored;
mod tiles;

use std::sync::OnceLock;
use std::time::Instant;

use crate::error::Result;
use crate::span::probe::probing;
use crate::span::{FaceId, Layers, Lines, SpanImage};
use crate::watch::Watch;
use again::Before;
use band::Limits;
use probe::FaceIndex;

/// What is seen of a frame's faces on its lines and, if its plan is to be probed, on any others. Lines that show what
/// they did in the frame of these scenes that was solved last are taken from it.
pub fn solve(frame: SpanImage) -> SpanImage {
    solve_all(frame, Listed::All)
}

/// Solves as [`solve`] does, bit for bit, and looks at faces in an order: all of the frame's, best from the nearest to
/// the farthest, which is fastest.
pub fn solve_in_order(frame: SpanImage, order: &[FaceId]) -> SpanImage {
    solve_all(frame, Listed::InOrder(order))
}

/// Solves as [`solve`] does if a frame had no other faces than these. Probes find all.
pub fn solve_among(frame: SpanImage, faces: &[FaceId]) -> SpanImage {
    let (lines, layers) = tiles::solve(&frame, Listed::Among(faces), None);
    solved(frame, lines, layers)
}

/// The faces that a solver looks at.
#[derive(Clone, Copy)]
enum Listed<'a> {
    /// All of the frame.
    All,
    /// All of the frame, in this order.
    InOrder(&'a [FaceId]),
    /// Only these.
    Among(&'a [FaceId]),
}

fn solve_all(frame: SpanImage, listed: Listed<'_>) -> SpanImage {
    let (clock, watch) = (Instant::now(), Watch::current());
    let before = Before::of(&frame, &watch);
    let (lines, layers) = tiles::solve(&frame, listed, before.as_ref());
    let image = solved(frame, lines, layers);
    again::keep(&image, &watch, clock.elapsed().as_secs_f64());
    image
}

/// What [`solve`] made of a frame, from the bytes that were [stored](stored::packed) of it; `None` if they are not its.
pub fn restore(frame: &SpanImage, bytes: &[u8]) -> Option<SpanImage> {
    let (lines, layers) = stored::unpacked(frame, bytes)?;
    Some(solved(frame.clone(), lines, layers))
}

fn solved(frame: SpanImage, lines: Lines, layers: Layers) -> SpanImage {
    let again = frame.plan().probed.then(|| {
        let (nowhere, index) = (frame.clone(), OnceLock::new());
        probing(move |probes| {
            let index = index.get_or_init(|| FaceIndex::new(&nowhere));
            Ok(probe::solve(&nowhere, index, probes))
        })
    });
    frame.with_lines(lines, layers).with_probing(again)
}

/// Solves as [`solve`] does, line by line and without any cleverness: all segments of a line, halved
/// and merged. Slow; what the fast way is tested against.
///
/// # Errors
/// If the work is stopped.
pub fn solve_by_merging(frame: &SpanImage) -> Result<SpanImage> {
    let raster = frame.view().raster();
    let limits = Limits::new(frame.view());
    let [_, top, _, bottom] = frame.view().window();
    frame.solved(|y, _, found| {
        if y < top || y > bottom {
            return Ok(());
        }
        for (at, source) in frame.sources().iter().enumerate() {
            for (place, face) in source.faces.faces().iter().enumerate() {
                let id = frame.id(at, place);
                for segment in band::segments(&source.faces, face, y, raster) {
                    let seen = limits.cut(segment, &frame.on_line(id, y), y, raster);
                    if !seen.is_empty() {
                        found.push(id, seen, face.is_translucent);
                    }
                }
            }
        }
        Ok(())
    })
}
