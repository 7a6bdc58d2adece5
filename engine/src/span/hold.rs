//! Holdout and hold-in: an image seen only where another one is not before it, or only where it is.
//!
//! Opaque faces of the matte cut spans, exactly, at the seam where the two cross. Translucent ones do
//! not cut: their segments stay in the image as *mattes*, which are never seen, and which dim what they
//! hold when fragments are blended. What a matte dims no longer hides what lies behind it, and so becomes
//! a layer itself.

use std::ops::Range;
use std::sync::Arc;

use super::cut;
use super::layer::{self, Segment};
use super::line::{self, Span};
use super::probe::probing;
use super::{Cuts, FaceId, Layers, Lines, Source, SpanImage, Union};
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
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, serde::Deserialize,
)]
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
        let makers = self.probing().cloned().zip(matte.probing().cloned());
        let again = makers.map(|(own, matte)| {
            probing(move |probes| own.probed(probes)?.held(&matte.probed(probes)?, keep))
        });
        Ok(self.held_once(matte, keep)?.with_probing(again))
    }

    fn held_once(&self, matte: &SpanImage, keep: Keep) -> Result<SpanImage> {
        let mut by = KeyHasher::new("matte");
        for source in matte.sources() {
            by.bytes(source.label.as_bytes());
            by.key(source.scene);
        }
        let by = by.finish();
        let is_soft = keep == Keep::Inside || !matte.layers().items().is_empty();
        let own = |source: &Arc<Source>| {
            let mut source = Source::clone(source);
            // A hard matte cuts spans and is done. One that dims is remembered by what it dims.
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
        self.check_mergeable(matte)?;
        let union = Union::of(vec![own, other])?;
        let (this, matte) = (union.bring(0, self), union.bring(1, matte));
        // A limit that ends the matte ends what is held by it, and gives that boundary its slope.
        let limits = this.limits().iter().chain(matte.limits()).copied().collect::<Vec<_>>();
        let this = this.with_limits(limits);
        let cells = this.view().raster().cells();
        let all = this.lines().range();
        let both = |k: u32, out: &mut Vec<cut::Cut>| {
            out.extend_from_slice(this.cuts().line(k));
            out.extend_from_slice(matte.cuts().line(k));
        };
        if keep == Keep::Inside {
            // All of it becomes layers.
            let nothing = Lines::compute(all.clone(), |_, out| {
                out.push(Span { x: 0, face: FaceId::NONE });
            });
            let layers = Layers::compute(all.clone(), |k, out| {
                let start = out.len();
                for image in [&this, &matte] {
                    out.extend_from_slice(image.layers().line(k));
                    each_opaque(image.lines().line(k), cells, |segment| out.push(segment));
                }
                layer::normalize(out, start);
            });
            let cuts = Cuts::compute(all, |k, out| {
                let start = out.len();
                both(k, out);
                cut::normalize(out, start);
            });
            return Ok(this.with_lines(nothing, layers).with_cuts(cuts));
        }
        let merged = Lines::compute(all.clone(), |k, out| {
            let y = this.y(k);
            let (own, matte) = (this.lines().line(k), matte.lines().line(k));
            line::merge(own, matte, cells, |face| this.on_line(face, y), out);
        });
        let held = Lines::compute(all.clone(), |k, out| {
            let start = out.len();
            for span in merged.line(k) {
                let is_matte = span.face.is_some() && this.face(span.face).0.matte.is_some();
                line::push(out, start, span.x, if is_matte { FaceId::NONE } else { span.face });
            }
        });
        // A matte that lies behind all that is opaque holds nothing.
        let mattes = clipped(matte.layers(), &held, &this);
        // Of the image's own layers only the matte's opaque spans cut away: what the image itself
        // hides is gone already.
        let seen = clipped(this.layers(), matte.lines(), &this);
        let layers = Layers::compute(all.clone(), |k, out| {
            let start = out.len();
            out.extend_from_slice(seen.line(k));
            out.extend_from_slice(mattes.line(k));
            divide(held.line(k), mattes.line(k), cells, |range, face, is_under| {
                if is_under && face.is_some() {
                    out.push(Segment { start: range.start, face, end: range.end });
                }
            });
            layer::normalize(out, start);
        });
        let solid = Lines::compute(all.clone(), |k, out| {
            let start = out.len();
            divide(held.line(k), mattes.line(k), cells, |range, face, is_under| {
                line::push(out, start, range.start, if is_under { FaceId::NONE } else { face });
            });
        });
        // The matte is gone, and still its edges bound what it held out.
        let cuts = Cuts::compute(all, |k, out| {
            let start = out.len();
            both(k, out);
            cut::left_by(merged.line(k), held.line(k), layers.line(k), cells, out);
            cut::normalize(out, start);
        });
        Ok(this.with_lines(solid, layers).with_cuts(cuts))
    }
}

/// The segments of `layers` that are seen before the opaque `lines`; ids are those of `image`.
fn clipped(layers: &Layers, lines: &Lines, image: &SpanImage) -> Layers {
    let cells = image.view().raster().cells();
    Layers::compute(layers.range(), |k, out| {
        let y = image.y(k);
        let start = out.len();
        layer::clip(layers.line(k), lines.line(k), cells, |face| image.on_line(face, y), out);
        layer::normalize(out, start);
    })
}

/// The opaque segments of a line.
fn each_opaque(line: &[Span], cells: u32, mut each: impl FnMut(Segment)) {
    for (range, face) in line::segments(line, cells).filter(|(_, face)| face.is_some()) {
        each(Segment { start: range.start, face, end: range.end });
    }
}

/// Divides the spans of a line at the ends of segments: `each` is told whether any segment lies there.
/// Segments are sorted by their first cell.
fn divide(
    line: &[Span],
    segments: &[Segment],
    cells: u32,
    mut each: impl FnMut(Range<u32>, FaceId, bool),
) {
    let mut waiting = segments.iter().peekable();
    // Where the segments that began so far end.
    let mut covered = 0;
    for (range, face) in line::segments(line, cells) {
        let mut x = range.start;
        while x < range.end {
            while let Some(segment) = waiting.next_if(|segment| segment.start <= x) {
                covered = covered.max(segment.end);
            }
            let is_under = x < covered;
            let next = waiting.peek().map_or(range.end, |segment| segment.start);
            let end = if is_under { covered } else { next }.min(range.end);
            each(x..end, face, is_under);
            x = end;
        }
    }
}
