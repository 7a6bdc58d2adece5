//! All lines of a picture, and the merge of pictures.

use rayon::prelude::*;
use std::cmp::Ordering;
use std::sync::{Arc, OnceLock};

use super::line::{self, Span};
use super::{Face, FaceId, OnLine, Source};
use crate::camera::View;
use crate::color::Color;
use crate::error::{Error, Result};
use crate::fragment::Shader;
use crate::raster::{LinePlan, Rows};

/// The lines of a range of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lines {
    first: u32,
    /// Where each line begins in `spans`; one more entry than lines.
    starts: Vec<usize>,
    spans: Vec<Span>,
}

impl Lines {
    /// Computes the lines `lines`, in parallel, by a function that appends one line's spans.
    pub fn compute(lines: std::ops::Range<u32>, one: impl Fn(u32, &mut Vec<Span>) + Sync) -> Lines {
        const CHUNK: u32 = 64;
        let chunks = lines.end.saturating_sub(lines.start).div_ceil(CHUNK);
        let parts: Vec<Lines> = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let first = lines.start + chunk * CHUNK;
                let mut part = Lines { first, starts: vec![0], spans: Vec::new() };
                for k in first..lines.end.min(first + CHUNK) {
                    one(k, &mut part.spans);
                    part.starts.push(part.spans.len());
                }
                part
            })
            .collect();
        Lines::join(lines.start, parts)
    }

    /// Joins runs of consecutive lines. `parts` must be in order and without gaps.
    pub fn join(first: u32, parts: Vec<Lines>) -> Lines {
        let lines: usize = parts.iter().map(|part| part.starts.len() - 1).sum();
        let spans: usize = parts.iter().map(|part| part.spans.len()).sum();
        let mut all = Lines {
            first,
            starts: Vec::with_capacity(lines + 1),
            spans: Vec::with_capacity(spans),
        };
        all.starts.push(0);
        for part in parts {
            let offset = all.spans.len();
            all.starts.extend(part.starts[1..].iter().map(|start| start + offset));
            all.spans.extend_from_slice(&part.spans);
        }
        all
    }

    /// Lines from their spans, one after another; `starts` has one more entry than there are lines.
    pub fn from_parts(first: u32, starts: Vec<usize>, spans: Vec<Span>) -> Lines {
        debug_assert!(starts.first() == Some(&0) && starts.last() == Some(&spans.len()));
        Lines { first, starts, spans }
    }

    /// The numbers of the lines held.
    pub fn range(&self) -> std::ops::Range<u32> {
        self.first..self.first + (self.starts.len() - 1) as u32
    }

    /// The spans of line `k`, which must be in [`range`](Lines::range).
    #[inline]
    pub fn line(&self, k: u32) -> &[Span] {
        let i = (k - self.first) as usize;
        &self.spans[self.starts[i]..self.starts[i + 1]]
    }

    /// All spans, line after line.
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.spans) + size_of_val(&*self.starts)
    }
}

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
    /// In the order of [`Source::order`], without doubles.
    sources: Vec<Arc<Source>>,
    /// The id of each source's first face.
    bases: Vec<u32>,
    lines: Arc<Lines>,
    intensities: OnceLock<Arc<Intensities>>,
}

impl SpanImage {
    /// An image of one source. `lines` holds the lines of `rows`; face ids are places in the source's
    /// table.
    pub fn new(view: View, plan: LinePlan, rows: Rows, source: Source, lines: Lines) -> SpanImage {
        debug_assert_eq!(lines.range(), plan.lines(&rows));
        SpanImage {
            view,
            plan,
            rows,
            sources: vec![Arc::new(source)],
            bases: vec![0],
            lines: Arc::new(lines),
            intensities: OnceLock::new(),
        }
    }

    /// An image on which nothing is seen: the identity of [`merge`](SpanImage::merge).
    pub fn empty(view: View, plan: LinePlan, rows: Rows) -> SpanImage {
        let background = |_, out: &mut Vec<Span>| out.push(Span { x: 0, face: FaceId::NONE });
        let lines = Arc::new(Lines::compute(plan.lines(&rows), background));
        SpanImage {
            view,
            plan,
            rows,
            sources: Vec::new(),
            bases: Vec::new(),
            lines,
            intensities: OnceLock::new(),
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
        let empty = SpanImage::empty(view, plan, rows);
        let sources = sources.into_iter().map(|source| vec![Arc::new(source)]).collect();
        assemble(std::slice::from_ref(&empty), sources).map(|(frame, _)| frame)
    }

    /// The image with other lines, whose ids are this one's.
    #[must_use]
    pub fn with_lines(self, lines: Lines) -> SpanImage {
        debug_assert_eq!(lines.range(), self.plan.lines(&self.rows));
        SpanImage { lines: Arc::new(lines), intensities: OnceLock::new(), ..self }
    }

    /// The projection.
    pub fn view(&self) -> &View {
        &self.view
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

    /// The lines.
    pub fn lines(&self) -> &Lines {
        &self.lines
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

    /// Bytes held, shared parts included.
    pub fn bytes(&self) -> usize {
        self.lines.bytes() + self.sources.iter().map(|source| source.faces.bytes()).sum::<usize>()
    }

    /// The image with a shader at the end of the stacks of all its sources. Spans are untouched.
    ///
    /// # Errors
    /// If the image has more faces than ids (2^32 - 1).
    pub fn shaded(&self, shader: Arc<dyn Shader>) -> Result<SpanImage> {
        let sources = self.sources.iter().map(|source| {
            let mut source = Source::clone(source);
            source.stack.push(shader.clone());
            Arc::new(source)
        });
        // The new keys may order the sources anew; assembling puts ids right where they do.
        assemble(std::slice::from_ref(self), sources.map(|source| vec![source]).collect())
            .map(|(image, _)| image)
    }

    /// Merges images by depth: in every cell of every line the winner of all. Associative, commutative,
    /// idempotent, with the empty image as identity, bit for bit.
    ///
    /// # Errors
    /// If the images differ in camera, raster, line plan or rows, or there are none.
    pub fn merge(images: &[SpanImage]) -> Result<SpanImage> {
        let Some((first, others)) = images.split_first() else {
            return Err(Error::invalid("a merge needs at least one image"));
        };
        for other in others {
            first.check_mergeable(other)?;
        }
        if others.is_empty() {
            return Ok(first.clone());
        }
        let all = images.iter().flat_map(|image| image.sources.iter().map(|s| vec![s.clone()]));
        let (frame, places) = assemble(images, all.collect())?;
        let cells = frame.view.raster().cells();
        let lines = Lines::compute(frame.plan.lines(&frame.rows), |k, out| {
            let y = frame.plan.y(k);
            let on_line = |face| frame.on_line(face, y);
            let layers: Vec<Vec<Span>> =
                images.iter().zip(&places).map(|(image, map)| map.renamed(image, k)).collect();
            merge_layers(&layers, cells, &on_line, out);
        });
        Ok(SpanImage { lines: Arc::new(lines), ..frame })
    }

    fn check_mergeable(&self, other: &SpanImage) -> Result<()> {
        let mismatch =
            |what, left: String, right: String| Err(Error::Mismatch { what, left, right });
        if self.view.raster() != other.view.raster() {
            let (left, right) = (self.view.raster(), other.view.raster());
            return mismatch("the raster", left.to_string(), right.to_string());
        }
        if self.view != other.view {
            let camera = |image: &SpanImage| format!("{:?}", image.view.camera());
            return mismatch("the camera", camera(self), camera(other));
        }
        if self.plan != other.plan {
            return mismatch("the line plan", self.plan.to_string(), other.plan.to_string());
        }
        if self.rows != other.rows {
            let rows = |rows: &Rows| format!("rows {} to {}", rows.start, rows.end);
            return mismatch("the range of rows", rows(&self.rows), rows(&other.rows));
        }
        Ok(())
    }
}

/// By face id, the colour of every visible face that is shaded alike all over: \[N]'s stored
/// intensities.
#[derive(Debug, Default)]
pub struct Intensities(Vec<Option<Color>>);

impl Intensities {
    /// Intensities by face id.
    pub(crate) fn new(colors: Vec<Option<Color>>) -> Intensities {
        Intensities(colors)
    }

    /// The intensity of a face, if it is shaded alike all over and visible.
    #[inline(always)]
    pub fn of(&self, face: FaceId) -> Option<Color> {
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
    }
}

/// Merges any number of lines, halves first, so that no line is copied more than log K times.
fn merge_layers(
    layers: &[Vec<Span>],
    cells: u32,
    on_line: &impl Fn(FaceId) -> OnLine,
    out: &mut Vec<Span>,
) {
    match layers {
        [] => out.push(Span { x: 0, face: FaceId::NONE }),
        [only] => out.extend_from_slice(only),
        [a, b] => line::merge(a, b, cells, on_line, out),
        _ => {
            let (front, back) = layers.split_at(layers.len() / 2);
            let (mut a, mut b) = (Vec::new(), Vec::new());
            merge_layers(front, cells, on_line, &mut a);
            merge_layers(back, cells, on_line, &mut b);
            line::merge(&a, &b, cells, on_line, out);
        }
    }
}

/// Where the faces of an image stand in another: by source, the new id of its first face and, if its
/// table was united with another, of each.
struct Places(Vec<(u32, Option<Vec<u32>>)>);

impl Places {
    fn renamed(&self, image: &SpanImage, k: u32) -> Vec<Span> {
        let rename = |span: &Span| {
            if !span.face.is_some() {
                return *span;
            }
            let (source, place) = image.locate(span.face);
            let (base, table) = &self.0[source];
            let place = table.as_ref().map_or(place as u32, |table| table[place]);
            Span { x: span.x, face: FaceId(base + place) }
        };
        image.lines.line(k).iter().map(rename).collect()
    }
}

/// Brings the sources of images into their order, without doubles, and the first image's lines to the
/// new ids. `sources` lists a replacement for every source of every image in turn.
fn assemble(
    images: &[SpanImage],
    sources: Vec<Vec<Arc<Source>>>,
) -> Result<(SpanImage, Vec<Places>)> {
    let mut slots: Vec<(usize, Arc<Source>)> = sources.into_iter().flatten().enumerate().collect();
    let count = slots.len();
    slots.sort_by(|a, b| a.1.order(&b.1).then(a.0.cmp(&b.0)));

    // Unite the tables of equal sources; `tables[old]` tells where each face of a source went.
    let mut united: Vec<Arc<Source>> = Vec::new();
    let mut place_of: Vec<(usize, Option<Vec<u32>>)> = vec![(0, None); count];
    let mut members: Vec<usize> = Vec::new();
    for (old, source) in slots {
        match united.last_mut().filter(|last| last.order(&source) == Ordering::Equal) {
            Some(last) => {
                let (both, [before, added]) = last.unite(&source)?;
                if let Some(before) = before {
                    for member in &members {
                        let table = &mut place_of[*member].1;
                        *table = Some(match table.take() {
                            None => before.clone(),
                            Some(old) => old.iter().map(|place| before[*place as usize]).collect(),
                        });
                    }
                }
                *last = Arc::new(both);
                place_of[old].1 = added;
                members.push(old);
            }
            None => {
                united.push(source);
                members = vec![old];
            }
        }
        place_of[old].0 = united.len() - 1;
    }

    let mut bases = Vec::with_capacity(united.len());
    let mut total = 0u64;
    for source in &united {
        bases.push(total as u32);
        total += source.faces.faces().len() as u64;
        if total >= u64::from(u32::MAX) {
            return Err(Error::invalid("more than 2^32 faces in one image: merge fewer clusters"));
        }
    }

    let mut place_of = place_of.into_iter();
    let places: Vec<Places> = images
        .iter()
        .map(|image| {
            let own = place_of.by_ref().take(image.sources.len());
            Places(own.map(|(slot, table)| (bases[slot], table)).collect())
        })
        .collect();

    let first = &images[0];
    let stays = places[0]
        .0
        .iter()
        .zip(&first.bases)
        .all(|((base, table), old)| base == old && table.is_none());
    let lines = if stays || images.len() > 1 {
        first.lines.clone()
    } else {
        let rename = |k, out: &mut Vec<Span>| out.extend(places[0].renamed(first, k));
        Arc::new(Lines::compute(first.lines.range(), rename))
    };
    let frame = SpanImage {
        view: first.view.clone(),
        plan: first.plan,
        rows: first.rows.clone(),
        sources: united,
        bases,
        lines,
        intensities: OnceLock::new(),
    };
    Ok((frame, places))
}
