//! Span images written by renderers of other people.

use std::ops::Range;
use std::sync::Arc;

use super::{FaceHead, FaceId, FaceTableBuilder, LineRenderer, Source, SpanImage};
use crate::camera::View;
use crate::error::{Error, Result};
use crate::fragment::Surfaces;
use crate::key::Key;
use crate::raster::{LinePlan, Rows};

/// Builds a [`SpanImage`] from any program's visible or *candidate* segments: where several cover a
/// cell, the winner rule of [`order`](super::order) decides, as in a merge.
///
/// Such an image holds its lines and no more: it cannot be [probed](super::probe), and rules that divide
/// pixels leave it, and what it is merged into, as it is. A program that knows its segments at any height
/// [renders](SpanWriter::render) them instead.
///
/// ```
/// # use spandrel_engine::{camera::{Camera, Plane, View}, key::Key, raster::*, span::*};
/// # use spandrel_engine::fragment::*;
/// # #[derive(Debug)] struct Plain;
/// # impl Surfaces for Plain {
/// #     fn fill(&self, _: Columns, _: &mut Fragments<'_>) {}
/// #     fn varying(&self, _: u32) -> Columns { Columns::NONE }
/// #     fn object(&self, _: u32) -> String { "wall".into() }
/// # }
/// # fn main() -> spandrel_engine::Result<()> {
/// let view = View::new(&Camera::default(), Raster::new(640, 480)?)?;
/// let plan = LinePlan::new(4, Phase::Centre)?;
/// let mut writer = SpanWriter::new(view, plan, 0..480);
/// let head = FaceHead {
///     ordinal: 0,
///     plane: Plane::constant(0.1), // a wall 10 m away
///     rank: 0,
///     role: Role::Face,
///     sees_front: true,
///     is_translucent: false,
/// };
/// let wall = writer.face(head, &[])?;
/// for line in writer.lines() {
///     writer.segment(line, 100.0..200.5, wall)?;
/// }
/// let image = writer.finish("walls", Key::of("walls"), std::sync::Arc::new(Plain))?;
/// # Ok(()) }
/// ```
#[derive(Debug)]
pub struct SpanWriter {
    view: View,
    plan: LinePlan,
    rows: Rows,
    faces: FaceTableBuilder,
    count: u32,
    segments: Vec<Vec<(Range<u32>, FaceId)>>,
}

impl SpanWriter {
    /// Starts an image of the rows `rows`.
    pub fn new(view: View, plan: LinePlan, rows: Rows) -> SpanWriter {
        let lines = plan.lines(&rows).len();
        SpanWriter {
            view,
            plan,
            rows,
            faces: FaceTableBuilder::new(),
            count: 0,
            segments: vec![Vec::new(); lines],
        }
    }

    /// The lines to write. Line `k` lies at [`LinePlan::y`] pixels from the top.
    pub fn lines(&self) -> Range<u32> {
        self.plan.lines(&self.rows)
    }

    /// Declares a face, with its outline on the screen in pixels if it is known: edges are then
    /// integrated with their slope (the `Sloped` rule); without, as steps.
    ///
    /// # Errors
    /// As [`FaceTableBuilder::face`].
    pub fn face(&mut self, head: FaceHead, outline: &[glam::DVec2]) -> Result<FaceId> {
        let first = self.faces.points(outline.iter().copied())?;
        let ring: Vec<u32> = (first..first + outline.len() as u32).collect();
        let place = self.faces.face(head, [&ring[..]])?;
        self.count = place + 1;
        Ok(FaceId(place))
    }

    /// Adds a segment of a face, in pixels from the left, to a line. Parts outside the raster are cut
    /// off.
    ///
    /// # Errors
    /// If the line is not one of [`lines`](SpanWriter::lines), the face is unknown, or an end is NaN.
    pub fn segment(&mut self, line: u32, pixels: Range<f64>, face: FaceId) -> Result<()> {
        if face.0 >= self.count {
            return Err(Error::invalid(format!(
                "a segment of face {}, which is not declared",
                face.0
            )));
        }
        if pixels.start.is_nan() || pixels.end.is_nan() {
            return Err(Error::invalid(format!(
                "a segment on line {line} with an end that is NaN"
            )));
        }
        let first = self.lines().start;
        let Some(segments) =
            line.checked_sub(first).and_then(|i| self.segments.get_mut(i as usize))
        else {
            return Err(Error::invalid(format!("line {line} is not one of {:?}", self.lines())));
        };
        let raster = self.view.raster();
        // The only rounding, before any comparison, as in the renderer.
        let cells = raster.cell(pixels.start)..raster.cell(pixels.end);
        if !cells.is_empty() {
            segments.push((cells, face));
        }
        Ok(())
    }

    /// The finished image: one source, named `label`, whose contents `scene` identifies.
    ///
    /// # Errors
    /// If there are more faces than ids (2^32 - 1).
    pub fn finish(self, label: &str, scene: Key, surfaces: Arc<dyn Surfaces>) -> Result<SpanImage> {
        let first = self.lines().start;
        let (segments, frame) = self.frame(label, scene, surfaces)?;
        frame.solved(|_, k, found| {
            let all = &segments[(k - first) as usize];
            all.iter().for_each(|(cells, face)| found.add_cells(*face, cells.clone()));
            Ok(())
        })
    }

    /// The image as [`finish`](SpanWriter::finish) makes it, with the segments that a renderer finds for the faces that
    /// were declared, in place of written ones. Such an image can be [probed](super::probe).
    ///
    /// # Errors
    /// As [`finish`](SpanWriter::finish), and the renderer's.
    pub fn render(
        self,
        label: &str,
        scene: Key,
        surfaces: Arc<dyn Surfaces>,
        renderer: impl LineRenderer,
    ) -> Result<SpanImage> {
        self.frame(label, scene, surfaces)?.1.rendered(Arc::new(renderer))
    }

    /// The segments that were written, and the image without them.
    fn frame(self, label: &str, scene: Key, surfaces: Arc<dyn Surfaces>) -> Result<Written> {
        let SpanWriter { view, plan, rows, faces, segments, .. } = self;
        let source = Source {
            label: label.to_owned(),
            scene,
            surfaces,
            stack: Vec::new(),
            matte: None,
            held: Vec::new(),
            faces: Arc::new(faces.finish()),
        };
        Ok((segments, SpanImage::frame(view, plan, rows, vec![source])?))
    }
}

/// The segments by line, and the image that they are to be in.
type Written = (Vec<Vec<(Range<u32>, FaceId)>>, SpanImage);
