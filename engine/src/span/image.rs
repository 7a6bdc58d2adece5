//! All lines of a picture, and the merge of pictures.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::sync::{Arc, OnceLock};

use super::cut::{self, Cut};
use super::layer::{self, Segment};
use super::line::Span;
use super::per_line::PerLine;
use super::{Face, FaceId, OnLine, Probe, Probing, Source, Stage, Union};
use crate::cache::{Shelf, cache};
use crate::camera::{Plane, View};
use crate::color::{Color, ValueKind};
use crate::error::{Error, Result};
use crate::fragment::{Columns, Environment, Member, Shader, Shading, World, object_name};
use crate::raster::{LinePlan, Rows};

/// The opaque spans of a range of rows.
pub type Lines = PerLine<Span>;

/// The segments of translucent faces of a range of rows.
pub type Layers = PerLine<Segment>;

/// The boundaries of a range of rows whose faces are not there any more.
pub type Cuts = PerLine<Cut>;

/// A picture as spans: the visible segments of every line of a range of rows, with their faces, and
/// the sources that the faces come from.
///
/// The one image format between renderers, merges and shaders. A value: operations return new images,
/// which share what did not change.
#[derive(Clone, Debug)]
pub struct SpanImage {
    view: View,
    plan: LinePlan,
    rows: Rows,
    /// If its lines are probes, which; then `plan` and `rows` say nothing of them.
    probes: Option<Arc<[Probe]>>,
    probing: Option<Arc<dyn Probing>>,
    /// In the order of [`Source::order`], without doubles.
    sources: Vec<Arc<Source>>,
    /// The id of each source's first face.
    bases: Vec<u32>,
    lines: Arc<Lines>,
    layers: Arc<Layers>,
    cuts: Arc<Cuts>,
    /// Sorted by their bits, without doubles.
    limits: Arc<[Plane]>,
    intensities: OnceLock<Arc<Intensities>>,
    /// What is kept of these very lines and faces, whatever their stacks.
    memo: Arc<Shelf>,
}

impl SpanImage {
    /// An image on which nothing is seen: the identity of [`merge`](SpanImage::merge).
    pub fn empty(view: View, plan: LinePlan, rows: Rows) -> SpanImage {
        let make = {
            let view = view.clone();
            move |probes: &Arc<[Probe]>| {
                let lines = 0..probes.len() as u32;
                let nothing = SpanImage::with_nothing(view.clone(), plan, 0..0, lines);
                Ok(SpanImage { probes: Some(probes.clone()), ..nothing })
            }
        };
        let lines = plan.lines(&rows);
        SpanImage::with_nothing(view, plan, rows, lines).with_probing(Some(Arc::new(make)))
    }

    fn with_nothing(view: View, plan: LinePlan, rows: Rows, lines: Range<u32>) -> SpanImage {
        let background = |_, out: &mut Vec<Span>| out.push(Span { x: 0, face: FaceId::NONE });
        SpanImage {
            view,
            plan,
            rows,
            probes: None,
            probing: None,
            sources: Vec::new(),
            bases: Vec::new(),
            lines: Arc::new(Lines::compute(lines.clone(), background)),
            layers: Arc::new(Layers::empty(lines.clone())),
            cuts: Arc::new(Cuts::empty(lines)),
            limits: Arc::default(),
            intensities: OnceLock::new(),
            memo: Arc::new(cache().shelf()),
        }
    }

    /// An image of sources on which nothing is seen yet.
    ///
    /// # Errors
    /// If the sources have more faces than ids (2^32 - 1).
    pub fn frame(
        view: View,
        plan: LinePlan,
        rows: Rows,
        sources: Vec<Source>,
    ) -> Result<SpanImage> {
        let lines = plan.lines(&rows);
        let empty = SpanImage::with_nothing(view, plan, rows, lines);
        let union = Union::of(vec![sources.into_iter().map(Arc::new).collect()])?;
        Ok(union.frame(&empty))
    }

    /// The image with other lines and layers, whose ids are this one's. Layers must be visible, in
    /// their [one form](super::layer).
    #[must_use]
    pub fn with_lines(self, lines: Lines, layers: Layers) -> SpanImage {
        debug_assert_eq!(lines.range(), self.lines.range());
        debug_assert_eq!(layers.range(), lines.range());
        let (lines, layers) = (Arc::new(lines), Arc::new(layers));
        SpanImage {
            lines,
            layers,
            intensities: OnceLock::new(),
            memo: Arc::new(cache().shelf()),
            ..self
        }
    }

    /// The image with other [cuts](super::cut), in their one form.
    pub(crate) fn with_cuts(self, cuts: Cuts) -> SpanImage {
        debug_assert_eq!(cuts.range(), self.lines.range());
        SpanImage { cuts: Arc::new(cuts), ..self }
    }

    /// The image cut by other planes, in any order.
    pub(crate) fn with_limits(self, limits: impl IntoIterator<Item = Plane>) -> SpanImage {
        let bits = |plane: &Plane| [plane.a, plane.b, plane.c].map(f64::to_bits);
        let is_finite = |p: &Plane| p.a.is_finite() && p.b.is_finite() && p.c.is_finite();
        let mut limits: Vec<Plane> = limits.into_iter().filter(is_finite).collect();
        limits.sort_unstable_by_key(bits);
        limits.dedup_by_key(|plane| bits(plane));
        SpanImage { limits: limits.into(), ..self }
    }

    /// The projection.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// The image, which can be [probed](SpanImage::probed) if there is a maker.
    #[must_use]
    pub fn with_probing(self, probing: Option<Arc<dyn Probing>>) -> SpanImage {
        SpanImage { probing, ..self }
    }

    pub(super) fn probing(&self) -> Option<&Arc<dyn Probing>> {
        self.probing.as_ref()
    }

    /// The cells of line `k` that are wanted.
    pub(super) fn wanted(&self, k: u32) -> Range<u32> {
        match &self.probes {
            None => 0..self.view.raster().cells(),
            Some(probes) => probes[k as usize].cells.clone(),
        }
    }

    /// The height of line `k` in pixels from the top of the raster.
    #[inline(always)]
    pub fn y(&self, k: u32) -> f64 {
        match &self.probes {
            None => self.plan.y(k),
            Some(probes) => probes[k as usize].y,
        }
    }

    /// The sources of the image with nothing on lines that are probes.
    #[must_use]
    pub fn on_probes(&self, probes: &Arc<[Probe]>) -> SpanImage {
        let lines = 0..probes.len() as u32;
        let nothing = SpanImage::with_nothing(self.view.clone(), self.plan, 0..0, lines);
        let (sources, bases) = (self.sources.clone(), self.bases.clone());
        let limits = self.limits.clone();
        SpanImage { probes: Some(probes.clone()), sources, bases, limits, ..nothing }
    }

    /// Where the lines lie.
    pub fn plan(&self) -> LinePlan {
        self.plan
    }

    /// The rows that are solved; others are unknown, not empty.
    pub fn rows(&self) -> Rows {
        self.rows.clone()
    }

    /// The sources, in order.
    pub fn sources(&self) -> &[Arc<Source>] {
        &self.sources
    }

    /// The names of all objects, each with its source's before it, and of all materials, seen or not; `None` if a source
    /// does not know its own.
    pub fn names(&self) -> Option<[BTreeSet<String>; 2]> {
        let mut all = [BTreeSet::new(), BTreeSet::new()];
        for source in &self.sources {
            let [objects, materials] = source.surfaces.provenance()?.names()?;
            all[0].extend(objects.iter().map(|path| object_name(&source.label, path)));
            all[1].extend(materials);
        }
        Some(all)
    }

    /// What the scenes say of their surroundings: the first source's whose scene says anything.
    pub fn environment(&self) -> Option<&Environment> {
        self.sources.iter().find_map(|source| source.surfaces.provenance()?.environment())
    }

    /// All that was done to the colours of its sources, the last first.
    pub fn shaders(&self) -> impl Iterator<Item = &dyn Shader> {
        self.sources.iter().flat_map(|source| {
            source.stack.iter().rev().filter_map(|stage| match stage {
                Stage::Shade(shading) => Some(&**shading.shader()),
                Stage::Place(_) | Stage::Kept(_) => None,
            })
        })
    }

    /// The illuminance in lux under which a white surface shows 1, if it is lit.
    pub fn white(&self) -> Option<f32> {
        self.shaders().find_map(Shader::white)
    }

    /// Whether rays start from any of its faces, if they are to be followed.
    pub fn is_mirroring(&self) -> bool {
        let starts = |source: &Arc<Source>| {
            let mut faces = source.faces.faces().iter();
            faces.any(|face| source.surfaces.varying(face.ordinal).contains(Columns::TRACED))
        };
        self.sources.iter().any(starts)
    }

    /// The opaque spans.
    pub fn lines(&self) -> &Lines {
        &self.lines
    }

    /// The segments of translucent faces.
    pub fn layers(&self) -> &Layers {
        &self.layers
    }

    /// Boundaries whose faces are not there any more.
    pub fn cuts(&self) -> &Cuts {
        &self.cuts
    }

    /// Planes that cut faces by depth, beside the front and the back of the camera: those of slices.
    pub fn limits(&self) -> &[Plane] {
        &self.limits
    }

    /// The place of a face's source in [`sources`](SpanImage::sources), and of the face in its table.
    #[inline(always)]
    pub fn locate(&self, face: FaceId) -> (usize, usize) {
        let source = if self.bases.len() == 1 {
            0
        } else {
            self.bases.partition_point(|base| *base <= face.0) - 1
        };
        (source, (face.0 - self.bases[source]) as usize)
    }

    /// A face, and the source that it comes from.
    #[inline(always)]
    pub fn face(&self, face: FaceId) -> (&Source, &Face) {
        let (source, place) = self.locate(face);
        (&self.sources[source], &self.sources[source].faces.faces()[place])
    }

    /// The id of the face at `place` in the table of the source at `source`.
    pub fn id(&self, source: usize, place: usize) -> FaceId {
        FaceId(self.bases[source] + place as u32)
    }

    /// The number of face ids in use.
    pub fn face_count(&self) -> usize {
        self.sources.iter().map(|source| source.faces.faces().len()).sum()
    }

    /// A face as the winner rule sees it on the line at `y` pixels.
    #[inline(always)]
    pub fn on_line(&self, id: FaceId, y: f64) -> OnLine {
        let (_, face) = self.face(id);
        OnLine::new(&face.plane, face.rank, id, y, self.view.raster())
    }

    /// The memo of intensities, which belongs to these sources' stacks and these lines.
    pub(crate) fn intensities(&self) -> &OnceLock<Arc<Intensities>> {
        &self.intensities
    }

    /// Whether all that its shaders look around at is there.
    ///
    /// # Errors
    /// As [`World::check`].
    pub fn check_worlds(&self) -> Result<()> {
        let mut known = Vec::new();
        for stage in self.sources.iter().flat_map(|source| &source.stack) {
            if let Stage::Shade(shading) = stage
                && let Some(world) = shading.world()
                && !known.contains(&world.key())
            {
                world.check()?;
                known.push(world.key());
            }
        }
        Ok(())
    }

    /// What is kept of these lines and faces. Images that differ in shaders alone share it.
    pub fn memo(&self) -> &Shelf {
        &self.memo
    }

    /// Bytes held, shared parts included.
    pub fn bytes(&self) -> usize {
        let spans = self.lines.bytes() + self.layers.bytes() + self.cuts.bytes();
        spans + self.sources.iter().map(|source| source.faces.bytes()).sum::<usize>()
    }

    /// The image with a shader at the end of the stacks of all its sources. Spans are untouched.
    ///
    /// # Errors
    /// If the image has more faces than ids (2^32 - 1).
    pub fn shaded(&self, shader: Arc<dyn Shader>) -> Result<SpanImage> {
        self.shaded_beside(shader, &[])
    }

    /// The same, where rays see the sources of other images too.
    ///
    /// # Errors
    /// If the image has more faces than ids (2^32 - 1), or the shader reads a channel that none before it made.
    pub fn shaded_beside(
        &self,
        shader: Arc<dyn Shader>,
        others: &[&SpanImage],
    ) -> Result<SpanImage> {
        let world = || {
            let beside = |source: &Arc<Source>| Member { is_beside: true, ..source.member() };
            let others = others.iter().flat_map(|image| image.sources.iter().map(beside));
            let own = self.sources.iter().map(|source| source.member());
            Arc::new(World::new(own.chain(others).collect()))
        };
        let made = self.made_channels();
        if let Some(name) = shader.reads_channels().iter().find(|name| !made.contains_key(*name)) {
            let there = made.into_keys().collect::<Vec<_>>().join(", ");
            let there = if there.is_empty() { "none".to_owned() } else { there };
            return Err(Error::invalid(format!(
                "no node before makes the channel \"{name}\": there are {there}"
            )));
        }
        let shading = Shading::new(shader, world);
        let shaded = |source: &Arc<Source>| {
            let mut source = Source::clone(source);
            source.stack.push(Stage::Shade(shading.clone()));
            Arc::new(source)
        };
        let image = self.with_sources(self.sources.iter().map(shaded).collect())?;
        // New keys may order sources anew; else all that is known of the spans stays true.
        let is_same = Arc::ptr_eq(&image.lines, &self.lines);
        Ok(if is_same { SpanImage { memo: self.memo.clone(), ..image } } else { image })
    }

    /// The channels that shaders made beside colours, by name: three numbers if any of them made three.
    pub fn made_channels(&self) -> BTreeMap<String, ValueKind> {
        let stages = self.sources.iter().flat_map(|source| &source.stack);
        let shaders = stages.filter_map(|stage| match stage {
            Stage::Shade(shading) => Some(shading.shader()),
            Stage::Place(_) | Stage::Kept(_) => None,
        });
        let mut made = BTreeMap::new();
        for (name, kind) in shaders.flat_map(|shader| shader.makes_channels()) {
            let known = made.entry(name).or_insert(kind);
            *known = kind.max(*known);
        }
        made
    }

    /// The image with other sources, one for each of its own, with the same faces by place.
    ///
    /// # Errors
    /// If the image has more faces than ids (2^32 - 1).
    pub(super) fn with_sources(&self, sources: Vec<Arc<Source>>) -> Result<SpanImage> {
        // New keys may order the sources anew; assembling puts ids right where they do.
        let image = Union::of(vec![sources.clone()])?.bring(0, self);
        Ok(self.then(image, move |image| image.with_sources(sources.clone())))
    }

    /// All that stands on the lines of this image, with other ids, in `frame`.
    pub(super) fn renamed(
        &self,
        frame: SpanImage,
        id: impl Fn(FaceId) -> FaceId + Sync,
    ) -> SpanImage {
        let all = self.lines.range();
        let lines = Lines::compute(all.clone(), |k, out| {
            out.extend(self.lines.line(k).iter().map(|span| span.renamed(&id)));
        });
        let layers = Layers::compute(all.clone(), |k, out| {
            let start = out.len();
            let renamed = |s: &Segment| Segment { face: id(s.face), ..*s };
            out.extend(self.layers.line(k).iter().map(renamed));
            layer::normalize(out, start);
        });
        let cuts = Cuts::compute(all, |k, out| cut::renamed(self.cuts.line(k), &id, out));
        frame.with_lines(lines, layers).with_cuts(cuts)
    }

    /// The image with the sources that a [`Union`] made of its own.
    pub(super) fn with_sources_of(&self, sources: Vec<Arc<Source>>, bases: Vec<u32>) -> SpanImage {
        let (intensities, memo) = (OnceLock::new(), Arc::new(cache().shelf()));
        SpanImage { sources, bases, probing: None, intensities, memo, ..self.clone() }
    }

    /// The image as an answer to a plan of the same lines, whatever it says of probes.
    pub(crate) fn for_plan(self, plan: LinePlan) -> SpanImage {
        SpanImage { plan, ..self }
    }

    /// The image on other rows, with nothing on them.
    pub(crate) fn over(&self, rows: Rows) -> SpanImage {
        let lines = self.plan.lines(&rows);
        let nothing = SpanImage::with_nothing(self.view.clone(), self.plan, rows, lines);
        let (sources, bases) = (self.sources.clone(), self.bases.clone());
        SpanImage { sources, bases, limits: self.limits.clone(), ..nothing }
    }

    /// Merges images by depth: in every cell of every line the winner of all. Associative, commutative,
    /// idempotent, with the empty image as identity, bit for bit.
    ///
    /// # Errors
    /// If the images differ in camera, raster, line plan or rows, or there are none.
    pub fn merge(images: &[SpanImage]) -> Result<SpanImage> {
        match images {
            [] => Err(Error::invalid("a merge needs at least one image")),
            [only] => Ok(only.clone()),
            _ => Union::new(images)?.merge(images),
        }
    }

    /// Whether two images show the same rows of the same picture.
    pub(super) fn check_mergeable(&self, other: &SpanImage) -> Result<()> {
        let mismatch =
            |what, left: String, right: String| Err(Error::Mismatch { what, left, right });
        if self.view.raster() != other.view.raster() {
            let (left, right) = (self.view.raster(), other.view.raster());
            return mismatch("the raster", left.to_string(), right.to_string());
        }
        if self.view != other.view {
            let [left, right] = self.view.camera().differences(other.view.camera());
            return mismatch("the camera", left, right);
        }
        if self.plan != other.plan {
            return mismatch("the line plan", self.plan.to_string(), other.plan.to_string());
        }
        if self.probes != other.probes {
            let probes = |image: &SpanImage| format!("{} probes", image.lines.range().len());
            return mismatch("the probes", probes(self), probes(other));
        }
        if self.rows != other.rows {
            let rows = |rows: &Rows| format!("rows {} to {}", rows.start, rows.end);
            return mismatch("the range of rows", rows(&self.rows), rows(&other.rows));
        }
        Ok(())
    }
}

/// What shading makes of a fragment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    /// Its colour, scene-linear, as if nothing shone through.
    pub color: Color,
    /// How much of what lies behind it hides, in [0, 1].
    pub alpha: f32,
}

/// By face id, the paint of every visible face that is shaded alike all over: \[N]'s stored
/// intensities.
#[derive(Debug, Default)]
pub struct Intensities(Vec<Option<Paint>>);

impl Intensities {
    /// Intensities by face id.
    pub(crate) fn new(paints: Vec<Option<Paint>>) -> Intensities {
        Intensities(paints)
    }

    /// The intensity of a face, if it is shaded alike all over and visible.
    #[inline(always)]
    pub fn of(&self, face: FaceId) -> Option<Paint> {
        self.0[face.0 as usize]
    }
}

impl PartialEq for SpanImage {
    /// Equal in every bit of every span, and in the order and identity of all sources.
    fn eq(&self, other: &SpanImage) -> bool {
        self.check_mergeable(other).is_ok()
            && self.sources.len() == other.sources.len()
            && self.sources.iter().zip(&other.sources).all(|(a, b)| a.order(b) == Ordering::Equal)
            && self.bases == other.bases
            && self.lines == other.lines
            && self.layers == other.layers
            && self.cuts == other.cuts
            && self.limits == other.limits
    }
}
