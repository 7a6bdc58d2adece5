//! What is hidden behind layers that let nothing through, found before lines are divided into stacks.
//!
//! A line on which a thousand cards lie over each other has a stack for each that begins or ends and for each two
//! that cross, and each names all of them: their number grows with the cube. Nearly all of it is never seen. So where
//! layers are many, those of a row are looked through first, pixel by pixel: from the nearest on, each that covers
//! the pixel whole is asked how much it hides. What lies behind all of them where next to nothing is let through,
//! and what hides nothing there itself and stays so, takes no part in the row.

use glam::DVec2;
use std::ops::Range;

use super::rule::Framing;
use crate::fragment::{Columns, Fragments, Hiding, Stage};
use crate::span::layer::Segment;
use crate::span::{FaceId, Source, SpanImage};

/// Layers over a pixel that are taken as they are.
const FEW: usize = 8;

/// What is behind layers that let less than this through is not shaded.
const LEAST_THROUGH: f32 = 1e-4;

/// Pixels of the picture to one of the raster, either way, beyond which layers are taken as they are.
const MOST_SCALE: f64 = 16.0;

/// The layers of the row at hand that are not seen.
pub(super) struct Hidden<'a> {
    image: &'a SpanImage,
    framing: &'a Framing,
    /// The first column that a pixel of the picture may show: a filter reaches beyond it.
    first: i64,
    /// The cells between the pixels of a row, from the first column on.
    borders: Vec<u32>,
    /// By source, whether what hides nothing by itself stays so.
    stays_clear: Vec<bool>,
    /// The row at hand.
    row: u32,
    /// What was looked through for it: the rows in which its lines lie.
    looked: Vec<RowSearch>,
}

/// What is not seen in a row.
struct RowSearch {
    row: i64,
    /// By pixel, the faces that are not seen in it, in their order.
    unseen: Vec<Vec<FaceId>>,
}

/// A face in a pixel.
#[derive(Clone, Copy)]
struct HiddenFace {
    column: u32,
    face: FaceId,
    /// The least and the greatest depth rho of it there.
    least: f64,
    most: f64,
    /// The lines of the row on which it covers the pixel whole.
    whole: u32,
}

/// A pixel that is being looked through.
struct Column {
    /// Its faces, the nearest first by where each is farthest.
    faces: Range<usize>,
    /// The next of them to be asked.
    next: usize,
    through: f32,
    /// The depth behind which nothing is seen.
    end: f64,
    unseen: Vec<FaceId>,
}

impl<'a> Hidden<'a> {
    /// For the rows of a picture. `None` if what surfaces hide does not stay hidden, as something is done to them.
    pub(super) fn new(image: &'a SpanImage, framing: &'a Framing) -> Option<Hidden<'a>> {
        let hiding = |source: &Source| {
            let does = source.stack.iter().map(|stage| match stage {
                Stage::Shade(shading) => shading.shader().hiding(),
                Stage::Place(_) | Stage::Kept(_) => Hiding::Keeps,
            });
            let is_held = source.matte.is_some() || !source.held.is_empty();
            // A matte dims what it holds, and what it holds then lets through what was hidden.
            if is_held { Hiding::Changes } else { does.max().unwrap_or(Hiding::Keeps) }
        };
        let all: Vec<Hiding> = image.sources().iter().map(|source| hiding(source)).collect();
        if all.contains(&Hiding::Changes) {
            return None;
        }
        let stays_clear = all.into_iter().map(|hiding| hiding == Hiding::Keeps).collect();
        let raster = image.view().raster();
        let beyond = (framing.filter.radius() - 0.5).ceil() as i64;
        let first = i64::from(framing.columns.start) - beyond;
        let border = |column: i64| raster.cell((column as f64 - framing.pan.x) / framing.scale.x);
        let borders = (first..=i64::from(framing.columns.end) + beyond).map(border).collect();
        let looked = Vec::new();
        Some(Hidden { image, framing, first, borders, stays_clear, row: 0, looked })
    }

    /// The row of the picture in which a line at `y` is looked through: the one at hand if its strip reaches into it,
    /// else, for a filter that reaches beyond, the nearest that it does.
    fn row_of(&self, y: f64) -> i64 {
        let Framing { scale, pan, .. } = self.framing;
        let half = 0.5 / f64::from(self.image.plan().per_row) * scale.y;
        let place = y * scale.y + pan.y;
        let (first, last) = ((place - half).floor(), (place + half).ceil() - 1.0);
        f64::from(self.row).clamp(first, last.max(first)) as i64
    }

    /// Looks through the layers of a row, given by its lines.
    pub(super) fn look(&mut self, row: u32, lines: &[u32]) {
        self.row = row;
        self.looked.clear();
        let scale = self.framing.scale.x;
        let is_deep = |k: &u32| self.image.layers().line(*k).len() > FEW;
        if !lines.iter().any(is_deep) || !(1.0 / MOST_SCALE..=MOST_SCALE).contains(&scale) {
            return;
        }
        let mut of_rows: Vec<(i64, u32)> =
            lines.iter().map(|k| (self.row_of(self.image.y(*k)), *k)).collect();
        of_rows.sort_unstable();
        for of_row in of_rows.chunk_by(|a, b| a.0 == b.0) {
            let lines: Vec<u32> = of_row.iter().map(|(_, k)| *k).collect();
            let unseen = self.unseen(of_row[0].0, &lines);
            if unseen.iter().any(|faces| !faces.is_empty()) {
                self.looked.push(RowSearch { row: of_row[0].0, unseen });
            }
        }
    }

    /// By pixel of a row, the faces that are not seen in it, as lines of it tell.
    fn unseen(&self, row: i64, lines: &[u32]) -> Vec<Vec<FaceId>> {
        let mut entries = self.entries(lines);
        let mut columns: Vec<(u32, Column)> = Vec::new();
        let mut first = 0;
        for of_column in entries.chunk_by_mut(|a, b| a.column == b.column) {
            let faces = first..first + of_column.len();
            first = faces.end;
            if faces.len() > FEW {
                of_column
                    .sort_unstable_by(|a, b| b.least.total_cmp(&a.least).then(a.face.cmp(&b.face)));
                let next = faces.start;
                let end = f64::NEG_INFINITY;
                let column = Column { faces, next, through: 1.0, end, unseen: Vec::new() };
                columns.push((of_column[0].column, column));
            }
        }
        let count = lines.len() as u32;
        // One face of each pixel in a round: surfaces are asked in batches, and no farther than
        // each pixel needs.
        while self.ask(row, count, &entries, &mut columns) {}
        let mut unseen = vec![Vec::new(); self.borders.len() - 1];
        for (at, mut column) in columns {
            // Faces were asked in the order of their least depths, of which `end` is the last. So
            // what is nowhere nearer than `end` lies behind every one that was asked.
            let behind = entries[column.faces].iter().filter(|entry| entry.most < column.end);
            column.unseen.extend(behind.map(|entry| entry.face));
            column.unseen.sort_unstable();
            column.unseen.dedup();
            unseen[at as usize] = column.unseen;
        }
        unseen
    }

    /// The faces of layers in the pixels of a row, by pixel.
    fn entries(&self, lines: &[u32]) -> Vec<HiddenFace> {
        let Hidden { image, borders, .. } = self;
        let raster = image.view().raster();
        let half = 0.5 / f64::from(image.plan().per_row);
        let mut entries = Vec::new();
        for k in lines {
            let y = image.y(*k);
            for Segment { start, face, end } in image.layers().line(*k) {
                let plane = image.face(*face).1.plane;
                let from = borders.partition_point(|border| border <= start).saturating_sub(1);
                for (column, pair) in borders.windows(2).enumerate().skip(from) {
                    let [left, right] = [pair[0], pair[1]];
                    if left >= *end {
                        break;
                    }
                    if left == right || right <= *start {
                        continue;
                    }
                    let x = [raster.pixels(left), raster.pixels(right)];
                    // Over the strip that the line stands for: a face that leans changes its depth
                    // within it.
                    let (least, most) = plane.range(x, [y - half, y + half]);
                    let whole = u32::from(*start <= left && *end >= right);
                    let column = column as u32;
                    entries.push(HiddenFace { column, face: *face, least, most, whole });
                }
            }
        }
        entries.sort_unstable_by_key(|entry| (entry.column, entry.face));
        entries.dedup_by(|next, kept| {
            let is_same = (next.column, next.face) == (kept.column, kept.face);
            if is_same {
                kept.least = kept.least.min(next.least);
                kept.most = kept.most.max(next.most);
                kept.whole += next.whole;
            }
            is_same
        });
        entries
    }

    /// Asks the next face of each pixel that is not done how much it hides. False if all are done.
    fn ask(
        &self,
        row: i64,
        lines: u32,
        entries: &[HiddenFace],
        columns: &mut [(u32, Column)],
    ) -> bool {
        let Hidden { image, framing, .. } = self;
        let mut batches: Vec<(Fragments<'_>, Vec<usize>)> = Vec::new();
        batches.resize_with(image.sources().len(), || (Fragments::new(image.view()), Vec::new()));
        let mut is_any = false;
        for (number, (at, column)) in columns.iter_mut().enumerate() {
            if column.through < LEAST_THROUGH {
                continue;
            }
            let rest = entries[column.next..column.faces.end].iter();
            // A face that leaves a part of the pixel open hides nothing for certain, and is passed
            // over.
            let Some(skipped) = rest.clone().position(|entry| entry.whole == lines) else {
                column.next = column.faces.end;
                continue;
            };
            column.next += skipped;
            let (source, place) = image.locate(entries[column.next].face);
            let face = &image.sources()[source].faces.faces()[place];
            let middle = DVec2::new((self.first + i64::from(*at)) as f64, row as f64) + 0.5;
            let DVec2 { x, y } = (middle - framing.pan) / framing.scale;
            let (batch, numbers) = &mut batches[source];
            batch.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
            numbers.push(number);
            is_any = true;
        }
        for (source, (mut batch, numbers)) in batches.into_iter().enumerate() {
            if numbers.is_empty() {
                continue;
            }
            batch.pixel = DVec2::ONE / framing.scale;
            batch.textures = framing.textures;
            image.sources()[source].fill(Columns::COLOR, &mut batch);
            for (number, alpha) in numbers.into_iter().zip(batch.alpha) {
                let (_, column) = &mut columns[number];
                let entry = &entries[column.next];
                column.next += 1;
                if alpha < LEAST_THROUGH {
                    if self.stays_clear[source] {
                        column.unseen.push(entry.face);
                    }
                    continue;
                }
                column.through *= 1.0 - alpha;
                if column.through < LEAST_THROUGH {
                    column.end = entry.least;
                }
            }
        }
        is_any
    }

    /// The segments of a line at `y` of the row at hand, or pieces of them, that are seen. Appends to `out`.
    pub(super) fn seen(&self, y: f64, segments: &[Segment], out: &mut Vec<Segment>) {
        let row = self.row_of(y);
        let Some(RowSearch { unseen, .. }) = self.looked.iter().find(|looked| looked.row == row)
        else {
            out.extend_from_slice(segments);
            return;
        };
        for segment in segments {
            let Segment { start, face, end } = *segment;
            // From where on it is seen.
            let mut from = start;
            let first = self.borders.partition_point(|border| *border <= start).saturating_sub(1);
            for (column, unseen) in unseen.iter().enumerate().skip(first) {
                let [left, right] = [self.borders[column], self.borders[column + 1]];
                if left >= end {
                    break;
                }
                if right > start && unseen.binary_search(&face).is_ok() {
                    if from < left {
                        out.push(Segment { start: from, face, end: left });
                    }
                    from = right.max(from);
                }
            }
            if from < end {
                out.push(Segment { start: from, face, end });
            }
        }
        out.sort_unstable();
    }
}
