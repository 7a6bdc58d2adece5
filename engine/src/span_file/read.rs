//! Reading span files.

use rayon::prelude::*;
use std::collections::HashMap;
use std::fs::File;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use super::block::{self, Block, BlockKind, MAX_LINES};
use super::column::Bytes;
use super::faces::Faces;
use super::head::{Head, MemberHead};
use super::lines;
use super::scenes::{Found, SceneState, Search, Sought, find_surfaces};
use super::stored::{Looks, Stored};
use crate::camera::View;
use crate::error::{Error, Result};
use crate::fragment::{Member, Stage, World};
use crate::key::Key;
use crate::raster::{LinePlan, Phase, Raster, Rows};
use crate::span::{Cut, Cuts, FaceId, Layers, Lines, Segment, Source, Span, SpanImage, layer};
use crate::watch::Watch;

/// About how many lines are held at once where a file is read part by part.
const STEP_LINES: u32 = 2048;
/// About how many bytes of unpacked lines are held at once.
const STEP_BYTES: u64 = 1 << 25;

/// A span file that is open: all of its faces, and its lines where they are asked for.
#[derive(Debug)]
pub struct SpanFile {
    path: PathBuf,
    file: Mutex<File>,
    head: Head,
    /// All blocks but the last.
    blocks: Vec<Block>,
    /// Those that hold lines, in order.
    lines: Vec<Block>,
    /// The sources, and nothing seen.
    frame: SpanImage,
    /// By ascending number in the file, the ids of faces.
    ids: Vec<(u32, FaceId)>,
    scenes: Vec<SceneState>,
    varying: usize,
}

impl SpanFile {
    /// Opens a file and reads its scenes, or finds them where they were or, by their names, in the folder
    /// `scenes`. Of a scene that is not there or not what it was, depth and the stored colours remain.
    ///
    /// # Errors
    /// If the file cannot be read or is damaged; the error names the block.
    pub fn open(path: &Path, scenes: Option<&Path>) -> Result<SpanFile> {
        SpanFile::read_tables(path, Search::Also(scenes))
    }

    /// Opens a file and leaves its scenes alone: enough to merge and to write it.
    ///
    /// # Errors
    /// As [`open`](SpanFile::open).
    pub fn open_without_scenes(path: &Path) -> Result<SpanFile> {
        SpanFile::read_tables(path, Search::Nothing)
    }

    fn read_tables(path: &Path, search: Search<'_>) -> Result<SpanFile> {
        let (mut file, blocks, head) = open_head(path)?;
        let first = &blocks[0];
        let in_head = |error: Error| first.fault(path, error);
        let (view, plan, rows) =
            (head.view().map_err(in_head)?, head.plan().map_err(in_head)?, head.rows());
        if rows.start > rows.end || rows.end > head.height {
            return Err(first.fault(path, format!("the rows {rows:?} are not within the picture")));
        }
        let lines = line_blocks(path, &blocks, plan.lines(&rows))?;
        let (tables, ids) = read_faces(path, &mut file, &blocks, head.sources.len())?;
        let of_sources = head.sources.iter().zip(&tables);
        let of_sources =
            of_sources.map(|(s, faces)| (&*s.member.label, s.member.found_in, faces.looks.last()));
        let members = head.worlds.iter().flat_map(|world| &world.members);
        let members = members.map(|member| (&*member.label, member.found_in, None));
        let sought: Vec<Sought<'_>> = of_sources.chain(members).collect();
        let (found, scenes) = find_surfaces(path, &mut file, &blocks, &head, &sought, search)?;
        let mut found = found.into_iter();
        let surfaces: Vec<Found> = found.by_ref().take(head.sources.len()).collect();
        let worlds = worlds(&head, found).map_err(in_head)?;
        let varying = tables.iter().map(|faces| faces.looks.varying()).sum();

        let mut sources: Vec<(usize, Source)> = Vec::new();
        for (at, ((about, surfaces), faces)) in
            head.sources.iter().zip(surfaces).zip(tables).enumerate()
        {
            let (table, looks) = faces.finish();
            let surfaces = match surfaces {
                Found::Scene(surfaces) => surfaces,
                Found::Nothing(origin, why) => Arc::new(Stored { looks, origin, why }),
            };
            let source = Source {
                label: about.member.label.clone(),
                scene: about.member.scene,
                surfaces,
                stack: in_worlds(&about.member.stack, &worlds),
                matte: about.matte,
                held: about.held.clone(),
                faces: Arc::new(table),
            };
            sources.push((at, source));
        }
        // Other programs may write sources in any order; an image has them in one.
        sources.sort_by(|a, b| a.1.order(&b.1));
        // No two sources of an image are equal: a merge would have united them.
        if let Some(pair) = sources.windows(2).find(|pair| pair[0].1.order(&pair[1].1).is_eq()) {
            return Err(
                first.fault(path, format!("the source \"{}\" is there twice", pair[0].1.label))
            );
        }
        let mut place_of = vec![0; sources.len()];
        sources.iter().enumerate().for_each(|(place, (at, _))| place_of[*at] = place);
        let sources = sources.into_iter().map(|(_, source)| source).collect();
        // The sources alone, over no rows: lines are read when they are asked for.
        let frame =
            SpanImage::frame(view, plan, rows.start..rows.start, sources).map_err(in_head)?;
        let frame = frame.with_limits(head.limits());
        let ids =
            ids.into_iter().map(|(number, at, place)| (number, frame.id(place_of[at], place)));
        let ids = ids.collect();
        let (path, file) = (path.to_owned(), Mutex::new(file));
        Ok(SpanFile { path, file, head, blocks, lines, frame, ids, scenes, varying })
    }

    /// The projection.
    pub fn view(&self) -> &View {
        self.frame.view()
    }

    /// Where its lines lie.
    pub fn plan(&self) -> LinePlan {
        self.frame.plan()
    }

    /// The rows that it holds.
    pub fn rows(&self) -> Rows {
        self.head.rows()
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The program that wrote it.
    pub fn writer(&self) -> &str {
        &self.head.writer
    }

    /// The image's sources, with nothing seen of them.
    pub fn frame(&self) -> &SpanImage {
        &self.frame
    }

    /// The scenes that it names.
    pub fn scenes(&self) -> &[SceneState] {
        &self.scenes
    }

    /// Faces whose colour differs from place to place: of them the file knows the colour of one place.
    pub fn varying(&self) -> usize {
        self.varying
    }

    /// Bytes in the file of the head, the scenes, the lines and the faces.
    pub fn bytes(&self) -> [u64; 4] {
        let kinds = [BlockKind::Head, BlockKind::Scene, BlockKind::Lines, BlockKind::Faces];
        kinds.map(|kind| self.blocks.iter().filter(|b| b.kind == kind).map(|b| b.stored).sum())
    }

    /// The rows of files that hold the same, in parts that are small enough to be held: of some two
    /// thousand lines each, and fewer where lines are long.
    pub fn parts(files: &[&SpanFile]) -> Vec<Rows> {
        let Some(first) = files.first() else { return Vec::new() };
        let (rows, n) = (first.rows(), first.plan().per_row);
        let bytes_of = |row: u32| -> u64 {
            let at = row * n;
            let of_file = |file: &&SpanFile| {
                let place = file.lines.partition_point(|block| block.a + block.b <= at);
                let block = file.lines.get(place);
                // A row's share of the block that its first line lies in.
                block.map_or(0, |block| block.raw * u64::from(n) / u64::from(block.b))
            };
            files.iter().map(of_file).sum()
        };
        let mut parts = Vec::new();
        let (mut start, mut bytes) = (rows.start, 0);
        for row in rows.clone() {
            let more = bytes_of(row);
            if row > start && ((row + 1 - start) * n > STEP_LINES || bytes + more > STEP_BYTES) {
                parts.push(start..row);
                (start, bytes) = (row, 0);
            }
            bytes += more;
        }
        parts.push(start..rows.end);
        parts
    }

    /// Reads the rows `rows`.
    ///
    /// # Errors
    /// If the file does not hold them, or is damaged; the error names the block.
    pub fn read(&self, rows: Rows) -> Result<SpanImage> {
        let held = self.rows();
        if rows.start < held.start || rows.end > held.end || rows.start > rows.end {
            let message = format!("the rows {rows:?} are asked for, and it holds {held:?}");
            return Err(Error::in_file(&self.path, message));
        }
        let wanted = self.plan().lines(&rows);
        let meets = |block: &&Block| block.a < wanted.end && wanted.start < block.a + block.b;
        let watch = Watch::current();
        let mut bodies: Vec<(Block, Vec<u8>)> = Vec::new();
        {
            // One thread reads, as there is one place in the file. Then all unpack side by side.
            let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
            for block in self.lines.iter().filter(meets) {
                watch.check()?;
                bodies.push((*block, block.read(&self.path, &mut file)?));
            }
        }
        let parts: Vec<(Lines, (Layers, Cuts))> = bodies
            .into_par_iter()
            .map(|(block, body)| {
                watch.check()?;
                let raw = block.unpack(&self.path, body)?;
                self.decode(&block, &raw, &wanted).map_err(|fault| block.fault(&self.path, fault))
            })
            .collect::<Result<_>>()?;
        let (spans, beside): (Vec<Lines>, Vec<(Layers, Cuts)>) = parts.into_iter().unzip();
        let (layers, cuts) = beside.into_iter().unzip();
        let (spans, layers) =
            (Lines::join(wanted.start, spans), Layers::join(wanted.start, layers));
        let frame = self.frame.over(rows).with_lines(spans, layers);
        Ok(frame.with_cuts(Cuts::join(wanted.start, cuts)))
    }

    /// Reads the rows `rows` for whoever solves at `raster` and asks for the lines of `plan`.
    ///
    /// # Errors
    /// If the file has other lines, or as [`read`](SpanFile::read).
    pub fn deliver(&self, raster: Raster, plan: LinePlan, rows: Rows) -> Result<SpanImage> {
        check_asked(&self.path, (self.view().raster(), self.plan()), (raster, plan))?;
        Ok(self.read(rows)?.for_plan(plan))
    }

    /// Whether a file can [deliver](SpanFile::deliver) lines of `plan` at `raster`; reads its head only.
    ///
    /// # Errors
    /// If it cannot, or is no span file.
    pub fn check(path: &Path, raster: Raster, plan: LinePlan) -> Result<()> {
        let (_, blocks, head) = open_head(path)?;
        let in_head = |error: Error| blocks[0].fault(path, error);
        let own = head.view().map_err(in_head)?.raster();
        check_asked(path, (own, head.plan().map_err(in_head)?), (raster, plan))
    }

    /// The lines of a block that are wanted.
    fn decode(
        &self,
        block: &Block,
        raw: &[u8],
        wanted: &Range<u32>,
    ) -> Result<(Lines, (Layers, Cuts)), String> {
        let cells = self.view().raster().cells();
        let face = |number: u32| {
            let at = self.ids.binary_search_by_key(&number, |(number, _)| *number).ok()?;
            Some(self.ids[at].1)
        };
        let mut bytes = Bytes::new(raw);
        let spans = lines::decode::<Span>(&mut bytes, block.b, cells, face)?;
        if let Some(empty) = spans.0.windows(2).position(|pair| pair[0] == pair[1]) {
            return Err(format!("its line {empty} has no span"));
        }
        let layers = lines::decode::<Segment>(&mut bytes, block.b, cells, face)?;
        let cuts = match bytes.left() {
            // Images without cuts are written without them.
            0 => (vec![0; block.b as usize + 1], Vec::new()),
            _ => lines::decode::<Cut>(&mut bytes, block.b, cells, face)?,
        };
        bytes.end()?;
        let from = wanted.start.max(block.a) - block.a;
        let to = wanted.end.min(block.a + block.b) - block.a;
        let (first, run) = (block.a + from, from as usize..to as usize);
        let spans = cut(first, spans, &run);
        let layers = cut(first, layers, &run);
        let cuts = cut(first, cuts, &run);
        // Sources may stand in another order here than in the file, and so may faces.
        let layers = match layers.items() {
            [] => layers,
            _ => Layers::compute(layers.range(), |k, out| {
                let start = out.len();
                out.extend_from_slice(layers.line(k));
                layer::normalize(out, start);
            }),
        };
        let cuts = match cuts.items() {
            [] => cuts,
            _ => Cuts::compute(cuts.range(), |k, out| {
                let start = out.len();
                out.extend_from_slice(cuts.line(k));
                crate::span::cut::normalize(out, start);
            }),
        };
        Ok((spans, (layers, cuts)))
    }
}

/// The worlds of a file, whose scenes were found in their order.
fn worlds(head: &Head, found: impl Iterator<Item = Found>) -> Result<HashMap<Key, Arc<World>>> {
    let mut found = found;
    let mut worlds = HashMap::new();
    for about in &head.worlds {
        let mut member = |member: &MemberHead| Member {
            label: member.label.clone(),
            scene: member.scene,
            surfaces: match found.next() {
                Some(Found::Scene(surfaces)) => surfaces,
                Some(Found::Nothing(origin, why)) => {
                    Arc::new(Stored { looks: Looks::default(), origin, why })
                }
                None => Arc::new(Stored::default()),
            },
            stack: in_worlds(&member.stack, &worlds),
            is_beside: member.is_beside,
        };
        let world = World::new(about.members.iter().map(&mut member).collect());
        if world.key() != about.key {
            return Err(Error::invalid(
                "what a shader looks around at is not what it says that it is",
            ));
        }
        worlds.insert(about.key, Arc::new(world));
    }
    Ok(worlds)
}

/// A stack whose shaders have their worlds.
fn in_worlds(stack: &[Stage], worlds: &HashMap<Key, Arc<World>>) -> Vec<Stage> {
    let stage = |stage: &Stage| match stage {
        Stage::Shade(shading) => {
            let world = shading.world().and_then(|world| worlds.get(&world.key()));
            Stage::Shade(match world {
                Some(world) => shading.with_world(world.clone()),
                None => shading.clone(),
            })
        }
        stage => stage.clone(),
    };
    stack.iter().map(stage).collect()
}

/// The blocks that hold the lines `all`, in order and without a gap.
fn line_blocks(path: &Path, blocks: &[Block], all: Range<u32>) -> Result<Vec<Block>> {
    let mut lines: Vec<Block> = Vec::new();
    let mut next = all.start;
    for block in blocks.iter().filter(|block| block.kind == BlockKind::Lines) {
        if block.a != next || !(1..=MAX_LINES).contains(&block.b) {
            let message =
                format!("line {next} should come next, and at most {MAX_LINES} lines in a block");
            return Err(block.fault(path, message));
        }
        let end = block.a.checked_add(block.b);
        next = end.ok_or_else(|| block.fault(path, "it has too many lines"))?;
        lines.push(*block);
    }
    if next != all.end {
        let message = format!("its lines end with {next}, not {}: write it again", all.end);
        return Err(Error::in_file(path, message));
    }
    Ok(lines)
}

/// Opens a file and reads its first block: what it is of. There is at least that block.
fn open_head(path: &Path) -> Result<(File, Vec<Block>, Head)> {
    let mut file = File::open(path).map_err(|e| Error::file(path, e))?;
    let blocks = block::scan(path, &mut file)?;
    let first = blocks.first().filter(|block| block.kind == BlockKind::Head);
    let first = first.ok_or_else(|| Error::at_byte(path, 16, "the first block is not \"head\""))?;
    if let Some(second) = blocks[1..].iter().find(|block| block.kind == BlockKind::Head) {
        return Err(second.fault(path, "it is there twice"));
    }
    let text = first.unpack(path, first.read(path, &mut file)?)?;
    let head: Head = serde_json::from_slice(&text).map_err(|e| first.fault(path, e))?;
    Ok((file, blocks, head))
}

/// Whether what a file holds is what is asked for.
fn check_asked(path: &Path, own: (Raster, LinePlan), asked: (Raster, LinePlan)) -> Result<()> {
    let ((has, plan), (raster, wanted)) = (own, asked);
    let wanted = LinePlan { probed: false, ..wanted };
    if (has, plan) == (raster, wanted) {
        return Ok(());
    }
    let n = plan.per_row;
    let rule = match plan.phase {
        Phase::Centre => format!("`Sloped({n})` or `Sampled({n}, Box)`"),
        Phase::Border => format!("`Sampled({n}, Trapezoid)`"),
    };
    let message = format!(
        "it holds {has} with {plan}, and {raster} with {wanted} are asked for: ask for the size ({}, {}) \
         and the lines {rule}, or write it anew",
        has.width, has.height
    );
    Err(Error::in_file(path, message))
}

/// Some lines of many.
fn cut<T: Copy + Send + Sync>(
    first: u32,
    (starts, items): (Vec<usize>, Vec<T>),
    run: &Range<usize>,
) -> crate::span::PerLine<T> {
    let (from, to) = (starts[run.start], starts[run.end]);
    if (from, to) == (0, items.len()) && starts.len() == run.len() + 1 {
        return crate::span::PerLine::from_parts(first, starts, items);
    }
    let starts = starts[run.start..=run.end].iter().map(|start| start - from).collect();
    crate::span::PerLine::from_parts(first, starts, items[from..to].to_vec())
}

/// The faces of all sources, and by ascending number in the file their source and place.
#[expect(clippy::type_complexity, reason = "read in one place, taken apart in one place")]
fn read_faces(
    path: &Path,
    file: &mut File,
    blocks: &[Block],
    sources: usize,
) -> Result<(Vec<Faces>, Vec<(u32, usize, usize)>)> {
    let mut tables: Vec<Faces> = (0..sources).map(|_| Faces::default()).collect();
    let mut ids: Vec<(u32, usize, usize)> = Vec::new();
    for block in blocks.iter().filter(|block| block.kind == BlockKind::Faces) {
        let at = block.a as usize;
        let body = block.read(path, file)?;
        let raw = block.unpack(path, body)?;
        let faces =
            tables.get_mut(at).ok_or_else(|| block.fault(path, "there is no such source"))?;
        let known = faces.ids.len();
        faces.read(&raw, block.b).map_err(|fault| block.fault(path, fault))?;
        let added = faces.ids[known..].iter().enumerate();
        ids.extend(added.map(|(i, id)| (*id, at, known + i)));
    }
    ids.sort_unstable();
    if let Some(pair) = ids.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(Error::in_file(
            path,
            format!("two of its faces have the number {}", pair[0].0),
        ));
    }
    Ok((tables, ids))
}
