//! Holdout and hold-in: an image seen only where another one is not before it, or only where it is.
//!
//! Opaque faces of the matte cut spans, exactly, at the seam where the two cross. Translucent ones do
//! not cut: their segments stay in the image as *mattes*, which are never seen, and which dim what they
//! hold when fragments are blended. What a matte dims no longer hides what lies behind it, and so becomes
//! a layer itself.

use std::sync::Arc;

use super::layer::{self, Segment};
use super::line::{self, Span};
use super::{FaceId, Layers, Lines, Source, SpanImage};
use crate::error::Result;
use crate::key::{Key, KeyHasher};

/// What of an image is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Keep {
    /// What the matte does not hide.
    Outside,
    /// What the matte hides.
    Inside,
}

/// A matte that dims a source.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Held {
    /// Which matte.
    pub by: Key,
    /// Whether the source is seen through the matte only, and not beside it only.
    pub inside: bool,
}

impl SpanImage {
    /// The image, held by a matte: [`Keep::Outside`], what shows past it; [`Keep::Inside`], what it
    /// would hide. Where one surface is seen the two add up to it; of translucent surfaces over each other,
    /// what is held out of the nearer lets more of the farther through, as with deep images.
    ///
    /// # Errors
    /// If the images differ in camera, raster, line plan or rows.
    pub fn held(&self, matte: &SpanImage, keep: Keep) -> Result<SpanImage> {
        let mut by = KeyHasher::new("matte");
        for source in matte.sources() {
            by.bytes(source.label.as_bytes());
            by.key(source.scene);
        }
        let by = by.finish();
        let is_soft = keep == Keep::Inside || !matte.layers().items().is_empty();
        let own = |source: &Arc<Source>| {
            let mut source = Source::clone(source);
            if is_soft {
                source.held.push(Held { by, inside: keep == Keep::Inside });
                source.held.sort_unstable();
                source.held.dedup();
            }
            Arc::new(source)
        };
        let other = |source: &Arc<Source>| {
            Arc::new(Source { matte: source.matte.or(Some(by)), ..Source::clone(source) })
        };
        let own = self.sources().iter().map(own).collect();
        let other = matte.sources().iter().map(other).collect();
        let [this, matte] = SpanImage::in_one_frame([(self, own), (matte, other)])?;
        let held = Lines::compute(this.lines().range(), |k, out| match keep {
            Keep::Outside => outside(&this, &matte, k, out),
            // All of it becomes layers.
            Keep::Inside => out.push(Span { x: 0, face: FaceId::NONE }),
        });
        let layers = Layers::compute(held.range(), |k, out| {
            layers(&this, &matte, keep, k, held.line(k), out);
        });
        let lines = match is_soft {
            true => Lines::compute(held.range(), |k, out| solid(held.line(k), &matte, k, out)),
            false => held,
        };
        Ok(this.with_lines(lines, layers))
    }
}

/// The line `k` of an image where the opaque matte does not hide it.
fn outside(this: &SpanImage, matte: &SpanImage, k: u32, out: &mut Vec<Span>) {
    let cells = this.view().raster().cells();
    let y = this.plan().y(k);
    let start = out.len();
    let mut merged = Vec::new();
    let (a, b) = (this.lines().line(k), matte.lines().line(k));
    line::merge(a, b, cells, |face| this.on_line(face, y), &mut merged);
    for span in &merged {
        let is_matte = span.face.is_some() && this.face(span.face).0.matte.is_some();
        line::push(out, start, span.x, if is_matte { FaceId::NONE } else { span.face });
    }
}

/// The layers of a held line: what was one, what a soft matte lies over, and the matte itself.
fn layers(
    this: &SpanImage,
    matte: &SpanImage,
    keep: Keep,
    k: u32,
    held: &[Span],
    out: &mut Vec<Segment>,
) {
    let cells = this.view().raster().cells();
    let y = this.plan().y(k);
    let on_line = |face| this.on_line(face, y);
    let start = out.len();
    let opaque = |line: &[Span]| -> Vec<Segment> {
        line::segments(line, cells)
            .filter(|(_, face)| face.is_some())
            .map(|(range, face)| Segment { start: range.start, face, end: range.end })
            .collect()
    };
    match keep {
        Keep::Outside => {
            layer::clip(this.layers().line(k), matte.lines().line(k), cells, on_line, out);
            let soft = matte.layers().line(k);
            for segment in opaque(held) {
                for cover in soft {
                    let (low, high) = (segment.start.max(cover.start), segment.end.min(cover.end));
                    if low < high {
                        out.push(Segment { start: low, face: segment.face, end: high });
                    }
                }
            }
            // A matte that lies behind all that is opaque holds nothing.
            layer::clip(soft, held, cells, on_line, out);
        }
        Keep::Inside => {
            out.extend_from_slice(this.layers().line(k));
            out.extend(opaque(this.lines().line(k)));
            out.extend_from_slice(matte.layers().line(k));
            out.extend(opaque(matte.lines().line(k)));
        }
    }
    layer::normalize(out, start);
}

/// A line without the cells that a soft matte lies over.
fn solid(held: &[Span], matte: &SpanImage, k: u32, out: &mut Vec<Span>) {
    let cells = matte.view().raster().cells();
    let start = out.len();
    for (range, face) in line::segments(held, cells) {
        let mut x = range.start;
        for Segment { start: from, end: to, .. } in matte.layers().line(k) {
            let (low, high) = ((*from).clamp(x, range.end), (*to).clamp(x, range.end));
            if low < high {
                if x < low {
                    line::push(out, start, x, face);
                }
                line::push(out, start, low, FaceId::NONE);
                x = high;
            }
        }
        if x < range.end {
            line::push(out, start, x, face);
        }
    }
}
