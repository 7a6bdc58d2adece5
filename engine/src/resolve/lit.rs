//! What of a fragment is lit by a light at one place: the lines' own answer, exact along x.

use std::borrow::Cow;
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::hidden::Hidden;
use super::rule::{Framing, LineShare, Rule, shares};
use super::strip::left_of;
use crate::fragment::{Casting, LinePiece, World};
use crate::key::{Key, KeyHasher};
use crate::raster::Rows;
use crate::shadow::{self, Dark, Patches};
use crate::span::layer::Segment;
use crate::span::{FaceId, SpanImage};
use crate::trace::Toward;
use crate::watch::Watch;

/// How far beside a pixel what its face is lit by is looked for where no line meets it there, in pixels of the raster
/// and at most in pixels of the picture.
const REACH: (u32, u32) = (64, 1 << 14);

/// Rows of the raster whose shadows are found together.
const CHUNK: u32 = 8;

/// Where a fragment stands in the picture.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    pub(super) row: u32,
    pub(super) column: u32,
    pub(super) face: FaceId,
    /// Whether its face covers all of its pixel.
    pub(super) is_whole: bool,
}

/// The shadows of the rows of a band, light by light.
pub(super) struct BandShadows<'a> {
    image: &'a SpanImage,
    rule: Rule,
    framing: &'a Framing,
    /// The columns of the whole picture.
    whole: Range<u32>,
    /// How far beside a pixel what counts for it may lie.
    reach: u32,
    /// The columns of which shadows are known: those that are computed, and what may count for them.
    columns: Range<u32>,
    rows: RefCell<HashMap<(Key, u32), Arc<ShadowRow>>>,
    watch: Watch,
}

/// The shadows of a row of the picture.
#[derive(Default)]
struct ShadowRow {
    shares: Vec<LineShare>,
    /// By share, the layers of its line, sorted by face, if anything is dark.
    layers: Vec<Vec<Segment>>,
    /// What of a pixel is dark on a face, by column and face.
    dark: Vec<LitPart>,
    /// Where the parts of each column begin, and the end.
    columns: Vec<u32>,
}

/// A part of a pixel, on a face.
#[derive(Clone, Copy)]
struct LitPart {
    column: u32,
    face: FaceId,
    dark: f32,
}

impl<'a> BandShadows<'a> {
    pub(super) fn new(
        image: &'a SpanImage,
        rule: Rule,
        framing: &'a Framing,
        watch: &Watch,
    ) -> BandShadows<'a> {
        let width = Framing::size(image.view().raster(), framing.scale).map_or(0, |size| size.0);
        let whole = 0..width.max(framing.columns.end);
        let reach = (f64::from(REACH.0) * framing.scale.x.max(1.0)).min(f64::from(REACH.1)) as u32;
        let columns = around(&framing.columns, reach, &whole);
        let (rows, watch) = (RefCell::default(), watch.clone());
        BandShadows { image, rule, framing, whole, reach, columns, rows, watch }
    }

    /// Forgets what belongs to no row of `rows`.
    pub(super) fn forget_all_but(&self, rows: &Rows) {
        self.rows.borrow_mut().retain(|(_, row), _| rows.contains(row));
    }

    /// By spot, the share of its face in its pixel that is lit.
    pub(super) fn lit(&self, spots: &[Spot], casting: &Casting<'_>) -> Vec<f32> {
        let key = self.key(casting);
        let mut lit = Vec::with_capacity(spots.len());
        // Spots come row by row, so that a row is looked up once.
        let mut known: Option<(u32, Arc<ShadowRow>)> = None;
        for spot in spots {
            let row = match known.take().filter(|(row, _)| *row == spot.row) {
                Some(known) => known.1,
                None => self.row(spot.row, key, casting),
            };
            lit.push(self.of(&row, spot));
            known = Some((spot.row, row));
        }
        lit
    }

    fn of(&self, row: &ShadowRow, spot: &Spot) -> f32 {
        if row.dark.is_empty() {
            return 1.0;
        }
        let first = self.columns.start;
        let dark = |columns: &Range<u32>| {
            let ends = [columns.start, columns.end].map(|c| row.columns[(c - first) as usize]);
            let parts = &row.dark[ends[0] as usize..ends[1] as usize];
            parts.iter().filter(|part| part.face == spot.face).map(|part| part.dark).sum::<f32>()
        };
        let mut columns = spot.column..spot.column + 1;
        if spot.is_whole {
            return (1.0 - dark(&columns)).clamp(0.0, 1.0);
        }
        // By its slopes a face may reach into a pixel where no line meets it: then what it is beside counts, the same
        // whatever part of the picture is computed.
        let mut beside = 0;
        loop {
            let total = self.covers(row, spot.face, &columns);
            if total > 0.0 {
                return (1.0 - dark(&columns) / total).clamp(0.0, 1.0);
            }
            if beside == self.reach {
                return 1.0;
            }
            // By doubling: a few looks, however far the face's nearest line is.
            beside = (2 * beside + 1).min(self.reach);
            columns = around(&(spot.column..spot.column + 1), beside, &self.whole);
        }
    }

    /// What a spot covers of the raster: its whole pixel, or pieces of lines, where the face is for certain.
    pub(super) fn pieces(&self, spot: &Spot) -> Vec<LinePiece> {
        let Framing { scale, pan, .. } = self.framing;
        let x = self.back(spot.column..spot.column + 1);
        if spot.is_whole {
            let y = [spot.row, spot.row + 1].map(|row| (f64::from(row) - pan.y) / scale.y);
            return vec![LinePiece { x, y }];
        }
        let mut pieces = Vec::new();
        for share in self.shares(spot.row) {
            let Some(k) = share.line else { continue };
            self.each_part((k, self.layers_of(k, spot.face)), spot.face, x, |x| {
                pieces.push(LinePiece { x, y: [self.image.y(k); 2] })
            });
        }
        pieces
    }

    /// By line of its row, what a spot covers there: a point in pixels of the raster, and a weight.
    pub(super) fn by_line(&self, spot: &Spot) -> Vec<([f64; 2], f64)> {
        let x = self.back(spot.column..spot.column + 1);
        let mut lines = Vec::new();
        for share in self.shares(spot.row) {
            let Some(k) = share.line else { continue };
            let (mut length, mut middle) = (0.0, 0.0);
            self.each_part((k, self.layers_of(k, spot.face)), spot.face, x, |[from, to]| {
                length += to - from;
                middle += (to - from) * (from + to) / 2.0;
            });
            if length > 0.0 && share.weight != 0.0 {
                lines.push(([middle / length, self.image.y(k)], length * share.weight.abs()));
            }
        }
        lines
    }

    /// How much of some pixels the lines of their row give to a face.
    fn covers(&self, row: &ShadowRow, face: FaceId, columns: &Range<u32>) -> f32 {
        let x = self.back(columns.clone());
        let mut total = 0.0;
        for (share, layers) in row.shares.iter().zip(&row.layers) {
            let Some(k) = share.line else { continue };
            let first = layers.partition_point(|segment| segment.face < face);
            let layers = layers[first..].iter().take_while(|segment| segment.face == face);
            self.each_part((k, layers), face, x, |[from, to]| total += (to - from) * share.weight);
        }
        (total * self.framing.scale.x) as f32
    }

    /// Columns of the picture in pixels of the raster.
    fn back(&self, columns: Range<u32>) -> [f64; 2] {
        let Framing { scale, pan, .. } = self.framing;
        [columns.start, columns.end].map(|x| (f64::from(x) - pan.x) / scale.x)
    }

    /// The layers of a face on a line.
    fn layers_of(&self, k: u32, face: FaceId) -> impl Iterator<Item = &Segment> {
        self.image.layers().line(k).iter().filter(move |segment| segment.face == face)
    }

    /// Visits the parts of a line, and of a face's layers on it, between two places in pixels of the raster, that show
    /// the face.
    fn each_part<'s>(
        &self,
        (k, layers): (u32, impl Iterator<Item = &'s Segment>),
        face: FaceId,
        x: [f64; 2],
        mut visit: impl FnMut([f64; 2]),
    ) {
        let raster = self.image.view().raster();
        let mut cut = |start: u32, end: u32| {
            let part = [raster.pixels(start).max(x[0]), raster.pixels(end).min(x[1])];
            if part[0] < part[1] {
                visit(part);
            }
        };
        let line = self.image.lines().line(k);
        let first = line.partition_point(|span| raster.pixels(span.x) <= x[0]).max(1) - 1;
        for (i, span) in line.iter().enumerate().skip(first) {
            if raster.pixels(span.x) >= x[1] {
                break;
            }
            if span.face == face {
                cut(span.x, line.get(i + 1).map_or(raster.cells(), |span| span.x));
            }
        }
        layers.for_each(|s| cut(s.start, s.end));
    }

    /// The lines of a row of the picture.
    fn shares(&self, row: u32) -> Vec<LineShare> {
        let plan = self.image.plan();
        let all = plan.lines(&(0..self.image.view().raster().height));
        shares(self.rule, plan, self.framing, row, all.end)
    }

    fn row(&self, row: u32, key: Key, casting: &Casting<'_>) -> Arc<ShadowRow> {
        if let Some(known) = self.rows.borrow().get(&(key, row)) {
            return known.clone();
        }
        let shares = self.shares(row);
        let mut parts = Vec::new();
        let per_chunk = CHUNK * self.image.plan().per_row;
        // Chunks begin at multiples of their lines from the raster's top, so that pictures of other
        // windows and scales share them.
        let mut chunk: Option<(u32, Arc<shadow::Lines>)> = None;
        for share in &shares {
            let Some(k) = share.line else { continue };
            let lines = match chunk.take().filter(|(at, _)| *at == k / per_chunk) {
                Some((_, lines)) => lines,
                None => self.chunk(k / per_chunk, key, casting),
            };
            let range = self.image.lines().range();
            let first = (k / per_chunk * per_chunk).max(range.start);
            for shadow in &lines[(k - first) as usize] {
                self.add(shadow, share, &mut parts);
            }
            chunk = Some((k / per_chunk, lines));
        }
        let (dark, columns) = by_column(&parts, &self.columns);
        let by_face = |share: &LineShare| {
            let line = share.line.map_or(&[][..], |k| self.image.layers().line(k));
            let mut layers = line.to_vec();
            layers.sort_unstable_by_key(|segment| (segment.face, segment.start));
            layers
        };
        // Where nothing is dark nobody asks what a face covers.
        let asked = if dark.is_empty() { &[][..] } else { &shares[..] };
        let layers = asked.iter().map(by_face).collect();
        let made = Arc::new(ShadowRow { shares, layers, dark, columns });
        self.rows.borrow_mut().insert((key, row), made.clone());
        made
    }

    /// The shadows of a chunk of lines, kept with the image.
    fn chunk(&self, at: u32, key: Key, casting: &Casting<'_>) -> Arc<shadow::Lines> {
        let memo = self.image.memo();
        memo.or_made((key, at), &self.watch, || {
            let per_chunk = CHUNK * self.image.plan().per_row;
            let range = self.image.lines().range();
            let lines = (at * per_chunk).max(range.start)..((at + 1) * per_chunk).min(range.end);
            let of_world = self.patches_key(casting.world);
            // What receives is the same for all lights of a world, and is found once.
            let patches = memo.or_made((of_world, at), &self.watch, || {
                let layers = self.seen_layers(lines.clone());
                let of = |k: u32| &*layers[(k - lines.start) as usize];
                let patches = Patches::new(self.image, casting.world, lines.clone(), of);
                let bytes = patches.bytes();
                (patches, bytes)
            });
            let cast = shadow::cast(self.image, &patches, casting, (at, lines), &self.watch);
            let bytes = cast.iter().map(|line| size_of_val(&**line) + size_of_val(line)).sum();
            (cast, bytes)
        })
    }

    /// Whether layers that are hidden in the pixels of the raster need no shadow: where they are not enlarged, so
    /// that what they let through stays as small as it is.
    fn leaves_out(&self) -> bool {
        self.framing.scale.max_element() <= 1.0
    }

    /// What the patches that receive the shadows of a world are known by.
    fn patches_key(&self, world: &World) -> Key {
        let mut key = KeyHasher::new("patches");
        key.key(world.geometry()).value(&self.leaves_out());
        key.finish()
    }

    /// What the shadows of a light in a world are known by.
    fn key(&self, Casting { from, world, .. }: &Casting<'_>) -> Key {
        let mut key = KeyHasher::new("shadows");
        let (kind, place) = match from {
            Toward::Direction(direction) => (0u8, direction),
            Toward::Point(point) => (1, point),
        };
        key.bytes(&[kind]).value(&place.to_array()).key(self.patches_key(world));
        key.finish()
    }

    /// The layers of lines, those left out that need no shadow.
    fn seen_layers(&self, lines: Range<u32>) -> Vec<Cow<'_, [Segment]>> {
        let layers = self.image.layers();
        let mut seen: Vec<Cow<'_, [Segment]>> =
            lines.clone().map(|k| Cow::Borrowed(layers.line(k))).collect();
        let whole = Framing::whole(self.image.view().raster());
        let hidden = self.leaves_out().then(|| Hidden::new(self.image, &whole));
        if let Some(mut hidden) = hidden.flatten() {
            let per_row = self.image.plan().per_row;
            let all: Vec<u32> = lines.clone().collect();
            for of_row in all.chunk_by(|a, b| a / per_row == b / per_row) {
                hidden.look(of_row[0] / per_row, of_row);
                for k in of_row {
                    let mut pieces = Vec::new();
                    hidden.seen(self.image.y(*k), layers.line(*k), &mut pieces);
                    seen[(k - lines.start) as usize] = Cow::Owned(pieces);
                }
            }
        }
        seen
    }

    /// Adds the part of a shadow that a share of its line's strip has to the pixels that it touches.
    fn add(&self, shadow: &Dark, share: &LineShare, parts: &mut Vec<LitPart>) {
        let (Framing { scale, pan, .. }, columns) = (self.framing, &self.columns);
        let n = f64::from(self.image.plan().per_row);
        // How far above and below its line the share's strip reaches, in pixels of the raster.
        let (from, to) = match self.rule {
            // Sampled lines are taken as they are.
            Rule::Sampled(..) => (0.0, 0.0),
            _ => ((share.strip.0 - 0.5) / n, (share.strip.1 - 0.5) / n),
        };
        let place = |end: shadow::End, off: f64| (end.x + end.slope * off) * scale.x + pan.x;
        let (start, end) = (
            [place(shadow.start, from), place(shadow.start, to)],
            [place(shadow.end, from), place(shadow.end, to)],
        );
        let (low, high) = (start[0].min(start[1]), end[0].max(end[1]));
        let (first, last) = (f64::from(columns.start), f64::from(columns.end));
        let (low, high) = (low.clamp(first, last), high.clamp(first, last));
        let weight = share.weight * f64::from(1.0 - shadow.through);
        for column in low as u32..(high.ceil() as u32).min(columns.end) {
            let left = |[top, bottom]: [f64; 2]| {
                left_of(top - f64::from(column), bottom - f64::from(column), 1.0)
            };
            // As covers are found: what lies left of the end, less what lies left of the start.
            let part = left(end) - left(start);
            if part <= 0.0 {
                continue;
            }
            let dark = (part * weight) as f32;
            parts.push(LitPart { column, face: shadow.face, dark });
        }
    }
}

/// Columns and some beside them, of those that there are.
fn around(columns: &Range<u32>, beside: u32, whole: &Range<u32>) -> Range<u32> {
    let start = columns.start.saturating_sub(beside).max(whole.start);
    start..columns.end.saturating_add(beside).min(whole.end)
}

/// Parts by column, those of one face in one column added up; and where each column's begin.
fn by_column(parts: &[LitPart], columns: &Range<u32>) -> (Vec<LitPart>, Vec<u32>) {
    let mut begins = vec![0u32; columns.len() + 1];
    let at = |part: &LitPart| (part.column - columns.start) as usize;
    parts.iter().for_each(|part| begins[at(part) + 1] += 1);
    for i in 0..columns.len() {
        begins[i + 1] += begins[i];
    }
    let nothing = LitPart { column: 0, face: FaceId::NONE, dark: 0.0 };
    let mut sorted = vec![nothing; parts.len()];
    let mut next = begins.clone();
    for part in parts {
        let slot = &mut next[at(part)];
        sorted[*slot as usize] = *part;
        *slot += 1;
    }
    let (mut kept, mut ends) = (Vec::new(), vec![0u32]);
    for column in 0..columns.len() {
        let first = kept.len();
        for part in &sorted[begins[column] as usize..begins[column + 1] as usize] {
            match kept[first..].iter_mut().find(|known: &&mut LitPart| known.face == part.face) {
                Some(known) => known.dark += part.dark,
                None => kept.push(*part),
            }
        }
        ends.push(kept.len() as u32);
    }
    (kept, ends)
}
