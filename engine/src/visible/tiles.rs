//! The visible part of all faces: survivors inserted into small tiles.
//!
//! A band of lines is divided along x into *tiles* of a few pixels. A tile holds, for each line, the
//! winners found so far, and a lower bound of their depth. Faces come roughly from front to back; one
//! whose depth over a tile stays below the tile's bound is thrown away before it is looked at line by
//! line. What remains is compared, exactly, with the few segments of the tile.
//!
//! Compared with halving and merging whole lines this was measured as three to four times faster on
//! large scenes, and as faster than sweeping with a list of active edges; all give the same bits,
//! because the winner rule is a total order. Tiles of 4 to 8 pixels are best: wider ones reject less.

use rayon::prelude::*;
use std::ops::Range;

use super::band::{self, Band, LANES, Limits, Reach};
use super::bins::Bins;
use crate::camera::Plane;
use crate::raster::Raster;
use crate::span::line::{self, Span};
use crate::span::{Face, FaceId, FaceTable, Lines, OnLine, SpanImage};

/// Width of a tile in pixels.
const TILE: u32 = 8;
/// Changes after which a tile's bound is computed anew.
const STALE: u32 = 8;

/// Solves all lines of a frame.
pub(super) fn solve(frame: &SpanImage) -> Lines {
    let lines = frame.plan().lines(&frame.rows());
    let bins = Bins::new(frame, &lines);
    let bands = (lines.len() as u32).div_ceil(LANES as u32);
    let parts: Vec<Lines> = (0..bands)
        .into_par_iter()
        .map_init(
            || Solver::new(frame),
            |solver, number| {
                let band = Band::new(frame.view(), frame.plan(), &lines, number);
                solver.solve(&band, bins.band(number))
            },
        )
        .collect();
    Lines::join(lines.start, parts)
}

/// The winners found so far over a few pixels.
struct Tile {
    /// Per line: segments from the tile's first cell.
    lines: [Vec<Span>; LANES],
    /// No winner is farther than this; minus infinity where there is background.
    bound: f64,
    /// Changes since the bound was computed.
    changes: u32,
}

/// Solves bands, one after another.
struct Solver<'a> {
    frame: &'a SpanImage,
    raster: Raster,
    limits: Limits,
    cells_per_tile: u32,
    tiles: Vec<Tile>,
    scratch: Vec<Span>,
}

/// A face about to be inserted.
struct Candidate<'a> {
    face: &'a Face,
    table: &'a FaceTable,
    id: FaceId,
}

impl<'a> Solver<'a> {
    fn new(frame: &'a SpanImage) -> Solver<'a> {
        let raster = frame.view().raster();
        let cells_per_tile = TILE.min(raster.width) << raster.fraction_bits();
        let count = raster.width.div_ceil(TILE);
        let tile = || Tile { lines: Default::default(), bound: f64::NEG_INFINITY, changes: 0 };
        Solver {
            frame,
            raster,
            limits: Limits::new(frame.view()),
            cells_per_tile,
            tiles: (0..count).map(|_| tile()).collect(),
            scratch: Vec::new(),
        }
    }

    fn solve(&mut self, band: &Band, faces: &[FaceId]) -> Lines {
        self.clear();
        for id in faces {
            let (source, face) = self.frame.face(*id);
            let candidate = Candidate { face, table: &source.faces, id: *id };
            if face.is_monotone {
                self.insert_monotone(band, &candidate);
            } else {
                self.insert_any(band, &candidate);
            }
        }
        self.collect(band)
    }

    fn clear(&mut self) {
        for (i, tile) in self.tiles.iter_mut().enumerate() {
            let x = i as u32 * self.cells_per_tile;
            for line in &mut tile.lines {
                line.clear();
                line.push(Span { x, face: FaceId::NONE });
            }
            tile.bound = f64::NEG_INFINITY;
            tile.changes = 0;
        }
    }

    /// A face with one segment to a line, all lines at once.
    fn insert_monotone(&mut self, band: &Band, candidate: &Candidate<'_>) {
        let ring = candidate.table.outline(candidate.face);
        let mut reach = band::reach(ring, band, self.raster);
        let on_line: [OnLine; LANES] = std::array::from_fn(|lane| {
            let y = if band.y[lane].is_finite() { band.y[lane] } else { 0.0 };
            OnLine::new(&candidate.face.plane, candidate.face.rank, candidate.id, y, self.raster)
        });
        if !self.limits.are_open() {
            for (lane, face) in on_line.iter().enumerate() {
                let segment = reach.start[lane]..reach.end[lane];
                if !segment.is_empty() {
                    let seen = self.limits.cut(segment, face, band.y[lane], self.raster);
                    (reach.start[lane], reach.end[lane]) = (seen.start, seen.end);
                }
            }
        }
        self.insert(band, candidate, &on_line, &reach);
    }

    /// A concave face, one with holes, a seal or a drawn edge: line by line, segment by segment.
    fn insert_any(&mut self, band: &Band, candidate: &Candidate<'_>) {
        for lane in 0..band.count {
            let y = band.y[lane];
            if !y.is_finite() {
                continue;
            }
            let Candidate { face, table, id } = candidate;
            let on_line = OnLine::new(&face.plane, face.rank, *id, y, self.raster);
            for segment in band::segments(table, face, y, self.raster) {
                let seen = self.limits.cut(segment, &on_line, y, self.raster);
                if seen.is_empty() {
                    continue;
                }
                let mut reach = Reach { start: [u32::MAX; LANES], end: [0; LANES] };
                (reach.start[lane], reach.end[lane]) = (seen.start, seen.end);
                self.insert(band, candidate, &[on_line; LANES], &reach);
            }
        }
    }

    fn insert(
        &mut self,
        band: &Band,
        candidate: &Candidate<'_>,
        on_line: &[OnLine; LANES],
        reach: &Reach,
    ) {
        let mut start = u32::MAX;
        let mut end = 0;
        for lane in 0..LANES {
            if reach.start[lane] < reach.end[lane] {
                start = start.min(reach.start[lane]);
                end = end.max(reach.end[lane]);
            }
        }
        if start >= end {
            return;
        }
        let (first, last) = (start / self.cells_per_tile, (end - 1) / self.cells_per_tile);
        for number in first..=last {
            let cells = self.cells(number);
            let within = start.max(cells.start)..end.min(cells.end);
            let nearest = nearest(&candidate.face.plane, band, &within, self.raster);
            let tile = &mut self.tiles[number as usize];
            if nearest < tile.bound {
                continue;
            }
            for (lane, new) in on_line.iter().enumerate().take(band.count) {
                let segment = reach.start[lane].max(cells.start)..reach.end[lane].min(cells.end);
                if !segment.is_empty() {
                    let y = band.y[lane];
                    let changed = insert_line(
                        self.frame,
                        &mut tile.lines[lane],
                        &mut self.scratch,
                        &cells,
                        segment,
                        new,
                        y,
                    );
                    tile.changes += u32::from(changed);
                }
            }
            if tile.changes >= STALE {
                tile.bound = farthest(self.frame, band, tile, &cells, self.raster);
                tile.changes = 0;
            }
        }
    }

    fn cells(&self, tile: u32) -> Range<u32> {
        let start = tile * self.cells_per_tile;
        start..start.saturating_add(self.cells_per_tile).min(self.raster.cells())
    }

    fn collect(&self, band: &Band) -> Lines {
        let mut starts = vec![0];
        let mut spans = Vec::new();
        for lane in 0..band.count {
            let start = spans.len();
            for tile in &self.tiles {
                for span in &tile.lines[lane] {
                    line::push(&mut spans, start, span.x, span.face);
                }
            }
            starts.push(spans.len());
        }
        Lines::from_parts(band.first, starts, spans)
    }
}

/// Inserts a segment into a tile's line; returns whether anything changed.
#[inline(always)]
fn insert_line(
    frame: &SpanImage,
    line: &mut Vec<Span>,
    scratch: &mut Vec<Span>,
    tile: &Range<u32>,
    segment: Range<u32>,
    new: &OnLine,
    y: f64,
) -> bool {
    scratch.clear();
    let mut changed = false;
    for i in 0..line.len() {
        let Span { x, face } = line[i];
        let end = line.get(i + 1).map_or(tile.end, |next| next.x);
        let shared = x.max(segment.start)..end.min(segment.end);
        if shared.is_empty() {
            line::push(scratch, 0, x, face);
            continue;
        }
        if x < shared.start {
            line::push(scratch, 0, x, face);
        }
        if !face.is_some() {
            line::push(scratch, 0, shared.start, new.face());
            changed = true;
        } else {
            let old = frame.on_line(face, y);
            let division = new.divide(&old, shared.clone());
            let (left, right) =
                if division.first_wins_left { (new.face(), face) } else { (face, new.face()) };
            line::push(scratch, 0, shared.start, left);
            if division.boundary < shared.end {
                line::push(scratch, 0, division.boundary, right);
                changed = true;
            }
            changed |= division.first_wins_left;
        }
        if shared.end < end {
            line::push(scratch, 0, shared.end, face);
        }
    }
    if changed {
        std::mem::swap(line, scratch);
    }
    changed
}

/// The most that a plane's depth can be over some cells of a band, rounded up.
fn nearest(plane: &Plane, band: &Band, cells: &Range<u32>, raster: Raster) -> f64 {
    let x = if plane.a > 0.0 { cells.end } else { cells.start };
    let y = if plane.b > 0.0 { last_y(band) } else { band.y[0].min(last_y(band)) };
    let (p, q) = (plane.a * raster.pixels(x), plane.b * y);
    p + q + plane.c + (p.abs() + q.abs() + plane.c.abs()) * 1e-14
}

fn last_y(band: &Band) -> f64 {
    band.y.iter().rev().copied().find(|y| y.is_finite()).unwrap_or(0.0)
}

/// The least depth of the winners of a tile, rounded down.
fn farthest(
    frame: &SpanImage,
    band: &Band,
    tile: &Tile,
    cells: &Range<u32>,
    raster: Raster,
) -> f64 {
    let mut bound = f64::INFINITY;
    for lane in 0..band.count {
        let y = band.y[lane];
        if !y.is_finite() {
            continue;
        }
        let line = &tile.lines[lane];
        for (i, span) in line.iter().enumerate() {
            if !span.face.is_some() {
                return f64::NEG_INFINITY;
            }
            let end = line.get(i + 1).map_or(cells.end, |next| next.x);
            let plane = frame.face(span.face).1.plane;
            let x = if plane.a > 0.0 { span.x } else { end };
            let (p, q) = (plane.a * raster.pixels(x), plane.b * y);
            let depth = p + q + plane.c - (p.abs() + q.abs() + plane.c.abs()) * 1e-14;
            bound = bound.min(depth);
        }
    }
    bound
}
