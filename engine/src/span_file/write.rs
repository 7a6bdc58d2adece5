//! Writing span files.

use rayon::prelude::*;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io::Write;
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::block::{self, BlockKind, Packed};
use super::faces;
use super::head::{Head, SceneHead};
use super::lines::Encoder;
use super::stored::{StoredLook, looks, varies};
use crate::error::{Error, Result};
use crate::fragment::{Anywhere, Columns, Fragments, Origin, Surfaces};
use crate::key::Key;
use crate::output;
use crate::raster::Rows;
use crate::scene::read::bundle;
use crate::span::{Cut, Seen, Segment, Source, Span, SpanImage, Stage};

/// Lines in a block: what is read at once where one of them is wanted.
const BLOCK_LINES: u32 = 256;
/// A block is closed early when its lines take more bytes than this.
const BLOCK_BYTES: usize = 1 << 22;

/// What of the scenes goes into a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scenes {
    /// Where they are and a hash of what they are; those that came within a span file stay within.
    #[default]
    ByPath,
    /// All that they hold.
    Embedded,
    /// Nothing: lights find no normals any more.
    Left,
}

/// How a file is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// What of the scenes goes into it.
    pub scenes: Scenes,
    /// Whether faces are stored as they are shaded, \[N]'s stored intensities, and not as they are by
    /// themselves with what shades them. Nothing shades them again then but what acts on colour and depth.
    pub shaded: bool,
}

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Written {
    /// Bytes of the file.
    pub bytes: u64,
    /// Opaque spans, background included.
    pub spans: u64,
    /// Segments of translucent faces.
    pub segments: u64,
    /// Faces.
    pub faces: u64,
    /// Faces whose colour differs from place to place, of which one place's is stored.
    pub varying: u64,
}

/// Writes an image to a file, whole or not at all.
///
/// # Errors
/// If the file cannot be written, a scene that should be embedded is not what it was, or colours that should
/// be stored need a scene that is not there.
pub fn write(image: &SpanImage, path: &Path, options: Options) -> Result<Written> {
    let mut written = Written::default();
    let bytes = output::write(path, |out| {
        let mut writer = Writer::new(out, path, image, image.rows(), options)?;
        writer.lines(image)?;
        written = writer.finish()?;
        Ok(())
    })?;
    Ok(Written { bytes, ..written })
}

/// Writes a file part by part, rows after rows.
pub(super) struct Writer<'w, W: Write> {
    out: &'w mut W,
    path: &'w Path,
    /// The image's sources; its lines are not looked at.
    frame: SpanImage,
    options: Options,
    seen: Seen,
    /// The next line to come.
    next: u32,
    blocks: u32,
    written: Written,
}

impl<'w, W: Write> Writer<'w, W> {
    /// Begins a file of the rows `rows` with the sources of `frame`.
    pub(super) fn new(
        out: &'w mut W,
        path: &'w Path,
        frame: &SpanImage,
        rows: Rows,
        options: Options,
    ) -> Result<Writer<'w, W>> {
        let mut head = Head::new(frame, &rows);
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut contents: BTreeMap<usize, Arc<[u8]>> = BTreeMap::new();
        let scene = |surfaces: &dyn Surfaces| {
            let origin = surfaces.origin().filter(|_| options.scenes != Scenes::Left)?;
            let embeds = options.scenes == Scenes::Embedded || origin.contents.is_some();
            Some((SceneHead::new(&origin, folder, embeds), origin))
        };
        let origins: RefCell<Vec<(SceneHead, Origin)>> = RefCell::default();
        for source in frame.sources() {
            if options.shaded {
                source.surfaces.offers(source.reads())?;
                head.add(&baked(source), None);
                continue;
            }
            let found = scene(&*source.surfaces);
            if options.scenes == Scenes::Embedded && found.is_none() {
                let label = &source.label;
                return Err(Error::invalid(format!(
                    "\"{label}\" comes from no scene file, so that there is nothing to embed: write it \
                     with `scenes: ByPath`"
                )));
            }
            head.add(source, found.map(|(scene, _)| scene));
            head.add_worlds(&source.stack, &|surfaces| {
                let (found, origin) = scene(surfaces)?;
                origins.borrow_mut().push((found.clone(), origin));
                Some(found)
            });
            origins.borrow_mut().extend(scene(&*source.surfaces));
        }
        for (scene, origin) in origins.into_inner() {
            // Sources of one scene share it: its contents are embedded once.
            let place = head.scenes.iter().position(|known| *known == scene);
            if let Some(place) =
                place.filter(|place| scene.embedded && !contents.contains_key(place))
            {
                contents.insert(place, bundle::pack(&origin)?);
            }
        }
        let mut writer = Writer {
            out,
            path,
            frame: frame.clone(),
            options,
            seen: Seen::new(frame.face_count()),
            next: frame.plan().lines(&rows).start,
            blocks: 0,
            written: Written::default(),
        };
        let text = serde_json::to_vec_pretty(&head)
            .map_err(|e| Error::output(path, format!("its head cannot be written: {e}")))?;
        block::write_preface(writer.out).map_err(|e| Error::output(path, e))?;
        writer.put(&Packed::new(BlockKind::Head, 0, 0, text)?)?;
        for (place, contents) in contents {
            writer.put(&Packed::new(BlockKind::Scene, place as u32, 0, contents.to_vec())?)?;
        }
        Ok(writer)
    }

    fn put(&mut self, packed: &Packed) -> Result<()> {
        self.blocks += 1;
        packed.write(self.out).map_err(|e| Error::output(self.path, e))
    }

    /// Writes the lines of an image that are not written yet; it has the sources of the frame, and rows that
    /// follow those before.
    pub(super) fn lines(&mut self, image: &SpanImage) -> Result<()> {
        self.seen.add(image);
        let all = self.next..image.lines().range().end;
        self.next = all.end;
        let count = all.end.saturating_sub(all.start).div_ceil(BLOCK_LINES);
        let runs: Vec<Range<u32>> = (0..count)
            .map(|i| all.start + i * BLOCK_LINES)
            .map(|first| first..all.end.min(first + BLOCK_LINES))
            .collect();
        let packed: Vec<Vec<Packed>> =
            runs.into_par_iter().map(|run| pack(image, run)).collect::<Result<_>>()?;
        packed.iter().flatten().try_for_each(|packed| self.put(packed))?;
        for k in all {
            self.written.spans += image.lines().line(k).len() as u64;
            self.written.segments += image.layers().line(k).len() as u64;
        }
        Ok(())
    }

    /// Writes the faces that were seen, and the end.
    pub(super) fn finish(mut self) -> Result<Written> {
        // Faces follow the lines, as only the lines tell which of them are seen.
        for at in 0..self.frame.sources().len() {
            let (frame, seen, shaded) = (&self.frame, &self.seen, self.options.shaded);
            let places = seen.places(frame, at);
            let chunks: Vec<(Packed, usize)> = places
                .par_chunks(faces::CHUNK)
                .map(|places| {
                    let table = &frame.sources()[at].faces;
                    let looks = looks_of(frame, seen, at, places, shaded);
                    let varying = looks.iter().filter(|look| look.varies).count();
                    let raw = faces::encode(table, places, frame.id(at, 0).0, &looks);
                    let packed =
                        Packed::new(BlockKind::Faces, at as u32, places.len() as u32, raw)?;
                    Ok((packed, varying))
                })
                .collect::<Result<_>>()?;
            self.written.faces += places.len() as u64;
            for (packed, varying) in chunks {
                self.written.varying += varying as u64;
                self.put(&packed)?;
            }
        }
        let end = Packed::new(BlockKind::End, self.blocks, 0, Vec::new())?;
        end.write(self.out).map_err(|e| Error::output(self.path, e))?;
        Ok(self.written)
    }
}

/// What faces of a source look like, each where it is seen: by themselves, or shaded.
fn looks_of(
    frame: &SpanImage,
    seen: &Seen,
    at: usize,
    places: &[u32],
    shaded: bool,
) -> Vec<StoredLook> {
    let source = &frame.sources()[at];
    let raster = frame.view().raster();
    let mut fragments = Fragments::new(frame.view());
    for place in places {
        let face = &source.faces.faces()[*place as usize];
        let (x, y) = match seen.at(frame.id(at, *place as usize)) {
            Some((k, cell)) => (raster.pixels(cell), frame.plan().y(k)),
            // A face of which only seals are seen.
            None => source.faces.rings(face).next().map_or((0.0, 0.0), |ring| ring.point(0).into()),
        };
        fragments.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
    }
    let object = |ordinal| source.surfaces.object(ordinal);
    if shaded {
        source.shade(&mut fragments, &Anywhere);
        // The stored colour is lit, and no light is to be added to it again.
        fragments.unlit = vec![true; fragments.len()];
        let differs = |ordinal| !source.shades_alike(ordinal) || varies(&*source.surfaces, ordinal);
        looks(&fragments, differs, object)
    } else {
        source.fill(Columns::COLOR, &mut fragments);
        looks(&fragments, |ordinal| varies(&*source.surfaces, ordinal), object)
    }
}

/// A source whose colours are those that its stack made.
fn baked(source: &Source) -> Source {
    let done = source.stack.iter().map(Stage::key).chain([Key::default()]);
    Source { stack: done.map(Stage::Kept).collect(), ..source.clone() }
}

/// Packs lines into one block, or more if they are long.
fn pack(image: &SpanImage, run: Range<u32>) -> Result<Vec<Packed>> {
    let mut packed = Vec::new();
    let mut first = run.start;
    // New encoders for each block: no block needs the last line of another to be read.
    let new = || (Encoder::<Span>::new(), Encoder::<Segment>::new(), Encoder::<Cut>::new());
    let (mut spans, mut layers, mut cuts) = new();
    let has_cuts = !image.cuts().items().is_empty();
    for k in run.clone() {
        spans.line(image.lines().line(k));
        layers.line(image.layers().line(k));
        cuts.line(image.cuts().line(k));
        // Bytes are known only after a line, so that a block may exceed the limit by one.
        if k + 1 == run.end || spans.bytes() + layers.bytes() + cuts.bytes() > BLOCK_BYTES {
            let mut raw = Vec::new();
            spans.finish(&mut raw);
            layers.finish(&mut raw);
            if has_cuts {
                cuts.finish(&mut raw);
            }
            packed.push(Packed::new(BlockKind::Lines, first, k + 1 - first, raw)?);
            (spans, layers, cuts) = new();
            first = k + 1;
        }
    }
    Ok(packed)
}
