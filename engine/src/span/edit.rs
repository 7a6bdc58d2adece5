//! Operations on one image: a slice of its depths, a window of it, its depths or its place changed.
//!
//! What a span image does not hold, what lies behind the nearest opaque face, cannot appear: a slice
//! that takes away the front shows nothing where the front was.

use glam::DVec2;
use std::ops::Range;
use std::sync::Arc;

use super::cut::{self, Cut};
use super::layer::{self, Segment};
use super::line::{self, Span};
use super::probe::probing;
use super::{Cuts, FaceId, FaceTable, Layers, Lines, OnLine, Placement, Probe, Source};
use super::{SpanImage, Stage};
use crate::camera::Plane;
use crate::error::{Error, Result};
use crate::raster::{Raster, Rows};

/// The depths between two planes of constant depth, the ends included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DepthRange {
    /// The greatest depth rho, of the front; none is unlimited.
    pub front: Option<f64>,
    /// The least depth rho, of the back; none is unlimited.
    pub back: Option<f64>,
}

impl DepthRange {
    /// Whether nothing is ever cut.
    pub fn is_open(&self) -> bool {
        self.front.is_none() && self.back.is_none()
    }

    /// The part of `cells` in which a face lies in the range. A plane is crossed at most once, exactly
    /// at a cell.
    pub fn cut(&self, cells: Range<u32>, face: &OnLine, y: f64, raster: Raster) -> Range<u32> {
        let mut seen = cells;
        // Faces at the very depth of a plane are seen: they lose against the front, win over the back.
        let limit = |depth: f64, rank: u32, id: FaceId| {
            OnLine::new(&Plane::constant(depth), rank, id, y, raster)
        };
        let front = self.front.map(|depth| limit(depth, u32::MAX, FaceId::NONE));
        let back = self.back.map(|depth| limit(depth, 0, FaceId(0)));
        for (limit, face_wins) in [(front, false), (back, true)] {
            let Some(limit) = limit.filter(|_| !seen.is_empty()) else { continue };
            let division = face.divide(&limit, seen.clone());
            // What is kept is the side on which the face beats the back, or is beaten by the front.
            if division.first_wins_left == face_wins {
                seen.end = division.boundary;
            } else {
                seen.start = division.boundary;
            }
        }
        seen
    }
}

impl SpanImage {
    /// What lies in a range of depths; elsewhere nothing is seen.
    #[must_use]
    pub fn sliced(&self, range: DepthRange) -> SpanImage {
        let raster = self.view().raster();
        let sliced = self.restricted(|k, cells, face| {
            let y = self.y(k);
            range.cut(cells, &self.on_line(face, y), y, raster)
        });
        // The planes are remembered: boundaries that they make have their slopes from them.
        let planes = range.front.into_iter().chain(range.back).map(Plane::constant);
        let sliced = sliced.with_limits(planes.chain(self.limits().iter().copied()));
        self.then(sliced, move |image| Ok(image.sliced(range)))
    }

    /// What is seen in a window, in pixels; elsewhere nothing is.
    #[must_use]
    pub fn cropped(&self, columns: Range<f64>, rows: Range<f64>) -> SpanImage {
        let raster = self.view().raster();
        let window = raster.cell(columns.start)..raster.cell(columns.end);
        let cropped = self.restricted(|k, cells, _| {
            let inside = rows.contains(&self.y(k));
            let seen = cells.start.max(window.start)..cells.end.min(window.end);
            if inside { seen } else { 0..0 }
        });
        self.then(cropped, move |image| Ok(image.cropped(columns.clone(), rows.clone())))
    }

    /// Every segment cut to a part of it.
    fn restricted(&self, part: impl Fn(u32, Range<u32>, FaceId) -> Range<u32> + Sync) -> SpanImage {
        let cells = self.view().raster().cells();
        let lines = Lines::compute(self.lines().range(), |k, out| {
            let start = out.len();
            for (range, face) in line::segments(self.lines().line(k), cells) {
                let seen = if face.is_some() { part(k, range.clone(), face) } else { 0..0 };
                if seen.is_empty() {
                    line::push(out, start, range.start, FaceId::NONE);
                    continue;
                }
                if range.start < seen.start {
                    line::push(out, start, range.start, FaceId::NONE);
                }
                line::push(out, start, seen.start, face);
                if seen.end < range.end {
                    line::push(out, start, seen.end, FaceId::NONE);
                }
            }
        });
        let layers = Layers::compute(self.layers().range(), |k, out| {
            let start = out.len();
            for Segment { start, face, end } in self.layers().line(k) {
                let seen = part(k, *start..*end, *face);
                if !seen.is_empty() {
                    out.push(Segment { start: seen.start, face: *face, end: seen.end });
                }
            }
            layer::normalize(out, start);
        });
        // What is cut away goes on parting what it was before.
        let cuts = Cuts::compute(self.cuts().range(), |k, out| {
            let start = out.len();
            out.extend_from_slice(self.cuts().line(k));
            cut::left_by(self.lines().line(k), lines.line(k), layers.line(k), cells, out);
            cut::normalize(out, start);
        });
        self.clone().with_lines(lines, layers).with_cuts(cuts)
    }

    /// The image with all depths changed: distances divided by `scale`, and `offset` added to the
    /// reciprocal of the distance (for parallel cameras: moved nearer by `offset` metres). Both leave
    /// planes plane, and the order of depths as it was; an offset of the distance itself would not.
    /// What comes to lie beyond infinity is no longer seen.
    ///
    /// # Errors
    /// If the scale is not above 0, or a number is not finite.
    pub fn with_depths(&self, scale: f64, offset: f64) -> Result<SpanImage> {
        if !(scale > 0.0 && scale.is_finite() && offset.is_finite()) {
            return Err(Error::invalid(format!(
                "depths scaled by {scale} and moved by {offset}: the scale must be above 0"
            )));
        }
        let parallel = self.view().is_parallel();
        let scale = if parallel { 1.0 / scale } else { scale };
        let image = self.placed(Placement { x: 0.0, y: 0.0, scale, offset })?;
        // The least normal number: what comes to lie at infinity or beyond is cut. Depths of
        // parallel cameras have no such end.
        let back = if parallel { None } else { Some(f64::MIN_POSITIVE) };
        Ok(image.sliced(DepthRange { front: None, back }))
    }

    /// The image moved right by `x` pixels and down by `lines` lines, on the given rows; what leaves the
    /// raster is cut off. Surfaces look as they did; the camera stays, so that shaders
    /// from here on see positions where the picture now shows them.
    ///
    /// # Errors
    /// If the move is not finite.
    pub fn moved(&self, x: f64, lines: i64, rows: Rows) -> Result<SpanImage> {
        let raster = self.view().raster();
        if !x.is_finite() {
            return Err(Error::invalid(format!("a move of {x} pixels")));
        }
        if x.abs() > f64::from(raster.width) {
            return Ok(SpanImage::empty(self.view().clone(), self.plan(), rows));
        }
        // A whole number of cells: boundaries that were rounded once are not rounded again.
        let step = (x * raster.cells_per_pixel()).round();
        let placement = Placement {
            x: step / raster.cells_per_pixel(),
            y: lines as f64 / f64::from(self.plan().per_row),
            scale: 1.0,
            offset: 0.0,
        };
        let image = self.placed(placement)?;
        let source = |k: u32| {
            let from = i64::from(k) - lines;
            u32::try_from(from).ok().filter(|from| image.lines().range().contains(from))
        };
        let moved = image.shifted(image.over(rows), step as i64, source);
        let again = image.probing().cloned().map(|own| {
            // The sources are moved already; the lines are those that move to the probes.
            probing(move |probes| {
                let back = |cell| shift(cell, -step as i64, raster.cells());
                let from = |probe: &Probe| Probe {
                    y: probe.y - placement.y,
                    cells: back(probe.cells.start)..back(probe.cells.end),
                };
                let image = own.probed(&probes.iter().map(from).collect())?;
                Ok(image.shifted(image.on_probes(probes), step as i64, Some))
            })
        });
        Ok(moved.with_probing(again))
    }

    /// The image's rows that are named: others may have asked for more.
    #[must_use]
    pub fn of_rows(&self, rows: &Rows) -> SpanImage {
        if *rows == self.rows() {
            return self.clone();
        }
        let held = self.lines().range();
        let same = |k: u32| held.contains(&k).then_some(k);
        self.shifted(self.over(rows.clone()), 0, same).with_probing(self.probing().cloned())
    }

    /// The lines `source` of this image moved right by `step` cells, in `frame`.
    fn shifted(
        &self,
        frame: SpanImage,
        step: i64,
        source: impl Fn(u32) -> Option<u32> + Sync,
    ) -> SpanImage {
        let cells = self.view().raster().cells();
        let shifted = |cell| shift(cell, step, cells);
        let spans = Lines::compute(frame.lines().range(), |k, out| {
            let start = out.len();
            out.push(Span { x: 0, face: FaceId::NONE });
            let Some(from) = source(k) else { return };
            let spans = self.lines().line(from).iter();
            out.extend(spans.map(|span| Span { x: shifted(span.x), face: span.face }));
            // Spans that left the raster have no cells any more, and go below.
            out.push(Span { x: shifted(cells), face: FaceId::NONE });
            tidy(out, start, cells);
        });
        let layers = Layers::compute(frame.layers().range(), |k, out| {
            let start = out.len();
            let Some(from) = source(k) else { return };
            for Segment { start, face, end } in self.layers().line(from) {
                let (start, end) = (shifted(*start), shifted(*end));
                if start < end {
                    out.push(Segment { start, face: *face, end });
                }
            }
            layer::normalize(out, start);
        });
        let cuts = Cuts::compute(frame.cuts().range(), |k, out| {
            let Some(from) = source(k) else { return };
            let moved = self.cuts().line(from).iter().map(|cut| Cut { x: shifted(cut.x), ..*cut });
            out.extend(moved.filter(|cut| cut.x > 0 && cut.x < cells));
        });
        frame.with_lines(spans, layers).with_cuts(cuts)
    }

    /// The image with all faces moved; lines are as they were.
    fn placed(&self, placement: Placement) -> Result<SpanImage> {
        let by = DVec2::new(placement.x, placement.y);
        let plane = |plane: &Plane| placement.plane(plane);
        let source = |source: &Arc<Source>| -> Result<Arc<Source>> {
            let mut moved = Source::clone(source);
            moved.faces = Arc::new(FaceTable::changed(&source.faces, plane, |point| point + by)?);
            moved.stack.push(Stage::Place(placement));
            Ok(Arc::new(moved))
        };
        let sources = self.sources().iter().map(source).collect::<Result<Vec<_>>>()?;
        // What cut faces by depth is placed with them.
        let (front, back) = self.view().depth_range();
        let own = [front, back].map(Plane::constant);
        let limits: Vec<Plane> = own.iter().chain(self.limits()).map(plane).collect();
        let limits = limits.into_iter().filter(|limit| !own.contains(limit));
        Ok(self.with_sources(sources)?.with_limits(limits))
    }
}

/// A cell moved right, not beyond the raster's `cells`.
fn shift(cell: u32, step: i64, cells: u32) -> u32 {
    (i64::from(cell) + step).clamp(0, i64::from(cells)) as u32
}

/// Removes spans of no length, and joins neighbours of one face.
fn tidy(out: &mut Vec<Span>, start: usize, cells: u32) {
    let mut kept = start;
    for i in start..out.len() {
        let span = out[i];
        if span.x == out.get(i + 1).map_or(cells, |next| next.x) {
            continue;
        }
        if kept == start || out[kept - 1].face != span.face {
            out[kept] = span;
            kept += 1;
        }
    }
    out.truncate(kept);
}
