//! Lines from segments: what renderers find on a line, and what of it is seen.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

use super::layer::{self, Segment};
use super::line::{self, Span};
use super::probe::probing;
use super::{FaceId, Layers, Lines, SpanImage};
use crate::error::{Error, Result};
use crate::raster::Raster;
use crate::watch::Watch;

/// A program that knows where its faces are on a line of any height. Its images can be
/// [probed](SpanImage::probed), so that `Adaptive` and `Exact` hold for them too.
pub trait LineRenderer: Send + Sync + 'static {
    /// Adds the segments of a frame's faces on a line, in any order. They need not be visible: where several cover a
    /// cell, the winner rule of [`order`](super::order) decides, as in a merge. `y` is the line's height in pixels from
    /// the top of the raster; nothing is wanted but [`Candidates::pixels`].
    ///
    /// # Errors
    /// If the line cannot be rendered.
    fn line(&self, frame: &SpanImage, y: f64, found: &mut Candidates<'_>) -> Result<()>;
}

/// The segments that were found on a line.
pub struct Candidates<'a> {
    frame: &'a SpanImage,
    raster: Raster,
    cells: Range<u32>,
    opaque: Vec<(Range<u32>, FaceId)>,
    translucent: Vec<Segment>,
}

impl<'a> Candidates<'a> {
    /// None yet, of a frame's faces over some cells.
    pub(crate) fn new(frame: &'a SpanImage, cells: Range<u32>) -> Candidates<'a> {
        let raster = frame.view().raster();
        Candidates { frame, raster, cells, opaque: Vec::new(), translucent: Vec::new() }
    }

    /// The pixels that are wanted, from the left of the raster.
    pub fn pixels(&self) -> Range<f64> {
        self.raster.pixels(self.cells.start)..self.raster.pixels(self.cells.end)
    }

    /// Adds a segment of a face, in pixels from the left of the raster. What reaches beyond the wanted pixels is cut
    /// off.
    ///
    /// # Errors
    /// If an end is NaN.
    pub fn add(&mut self, face: FaceId, pixels: Range<f64>) -> Result<()> {
        if pixels.start.is_nan() || pixels.end.is_nan() {
            return Err(Error::invalid(format!("a segment of face {} ends at NaN", face.0)));
        }
        self.add_cells(face, self.raster.cell(pixels.start)..self.raster.cell(pixels.end));
        Ok(())
    }

    /// Adds a segment by its cells.
    pub(crate) fn add_cells(&mut self, face: FaceId, cells: Range<u32>) {
        let within = cells.start.max(self.cells.start)..cells.end.min(self.cells.end);
        if !within.is_empty() {
            self.push(face, within, self.frame.face(face).1.is_translucent);
        }
    }

    /// Adds a segment within the cells that are wanted, of a face that is known.
    pub(crate) fn push(&mut self, face: FaceId, cells: Range<u32>, is_translucent: bool) {
        match is_translucent {
            true => self.translucent.push(Segment { start: cells.start, face, end: cells.end }),
            false => self.opaque.push((cells, face)),
        }
    }

    /// What is seen of them on a line at a height: the opaque spans, and the translucent layers before them.
    pub(crate) fn seen(self, y: f64) -> (Vec<Span>, Vec<Segment>) {
        let Candidates { frame, raster, opaque, translucent, .. } = self;
        let on_line = |face| frame.on_line(face, y);
        let (mut spans, mut layers) = (Vec::new(), Vec::new());
        line::envelope(&opaque, raster.cells(), &on_line, &mut spans);
        layer::clip(&translucent, &spans, raster.cells(), on_line, &mut layers);
        layer::normalize(&mut layers, 0);
        (spans, layers)
    }
}

impl SpanImage {
    /// The image with what a renderer finds on its lines and, if its plan is to be probed, on any others.
    ///
    /// # Errors
    /// As the renderer's.
    pub fn rendered(self, renderer: Arc<dyn LineRenderer>) -> Result<SpanImage> {
        let find = move |frame: SpanImage| {
            let line = |y, _, found: &mut Candidates<'_>| renderer.line(&frame, y, found);
            frame.solved(line)
        };
        let image = find(self.clone())?;
        let is_probed = self.plan().probed;
        let again = is_probed.then(|| probing(move |probes| find(self.on_probes(probes))));
        Ok(image.with_probing(again))
    }

    /// The image with the segments that are found on its lines; these are told by their heights and numbers.
    pub(crate) fn solved(
        &self,
        find: impl Fn(f64, u32, &mut Candidates<'_>) -> Result<()> + Sync,
    ) -> Result<SpanImage> {
        let range = self.lines().range();
        let watch = Watch::current();
        watch.begin(range.len());
        let seen = range.clone().into_par_iter().map(|k| {
            watch.check()?;
            watch.step();
            let mut found = Candidates::new(self, self.wanted(k));
            find(self.y(k), k, &mut found)?;
            Ok(found.seen(self.y(k)))
        });
        let seen: Vec<(Vec<Span>, Vec<Segment>)> = seen.collect::<Result<_>>()?;
        let at = |k: u32| &seen[(k - range.start) as usize];
        let lines = Lines::compute(range.clone(), |k, out| out.extend_from_slice(&at(k).0));
        let layers = Layers::compute(range.clone(), |k, out| out.extend_from_slice(&at(k).1));
        Ok(self.clone().with_lines(lines, layers))
    }
}
