//! Probes of a rendered image: lines of any height over a few cells, solved on demand.
//!
//! Faces are kept by row of the raster. A probe's neighbours in a window share the search: faces that
//! meet it come from front to back, and those that lie behind one which covers all of it are left out.
//! What is left is solved by halving and merging, the winner rule's plain form; so a probe has the
//! bits that a line at its height would have.

use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::band::{self, Limits};
use super::bins::{BinEntry, Bins};
use crate::raster::{MAX_SIDE, Raster};
use crate::span::edges::{MANY, Occupied};
use crate::span::{
    Candidates, Face, FaceId, Layers, Lines, Probe, Role, Segment, Source, Span, SpanImage,
};

/// The faces of an image's sources by row of the raster.
#[derive(Debug)]
pub struct FaceIndex {
    rows: Bins,
}

/// A part of the raster.
struct ProbeArea {
    cells: Range<u32>,
    /// Its upper and its lower end in pixels from the top.
    y: [f64; 2],
}

impl FaceIndex {
    /// The faces that reach into rows of the raster; those that reach into several are told several
    /// times.
    pub fn faces(&self, rows: Range<u32>) -> impl Iterator<Item = FaceId> + '_ {
        rows.flat_map(|row| self.rows.band(row).iter().map(|entry| entry.face))
    }

    /// The index of all faces that an image's sources have.
    pub fn new(image: &SpanImage) -> FaceIndex {
        let height = image.view().raster().height;
        let row = |y: f64| y.clamp(0.0, f64::from(MAX_SIDE)) as u32;
        let rows = |top: f64, bottom: f64| {
            // Clamped, a face above the raster would seem to reach into row 0.
            if bottom < 0.0 { (0, 0) } else { (row(top), (row(bottom) + 1).min(height)) }
        };
        FaceIndex { rows: Bins::new(image, None, height as usize, |_| true, rows) }
    }

    /// For each area of a row the faces that may be seen in it, translucent ones too. Areas need not be
    /// apart, but must be sorted by their first cell.
    fn candidates(&self, image: &SpanImage, row: u32, areas: &[ProbeArea]) -> Vec<Vec<FaceId>> {
        let raster = image.view().raster();
        let mut found: Vec<Vec<BinEntry>> = vec![Vec::new(); areas.len()];
        let widest = areas.iter().map(|area| area.cells.len() as u64).max().unwrap_or(0);
        for entry in self.rows.band(row) {
            let first = u64::from(entry.columns.0) << raster.fraction_bits();
            let end = (u64::from(entry.columns.1) + 1) << raster.fraction_bits();
            // No area is wider than `widest`, so all that begin this much farther left end before
            // the face.
            let from = areas.partition_point(|area| u64::from(area.cells.start) + widest <= first);
            for (area, found) in areas.iter().zip(&mut found).skip(from) {
                if u64::from(area.cells.start) >= end {
                    break;
                }
                if u64::from(area.cells.end) > first {
                    found.push(*entry);
                }
            }
        }
        let y = [f64::from(row), f64::from(row) + 1.0];
        // Probes may lie a little beyond their row.
        let ends =
            |[low, high]: [f64; 2], area: &ProbeArea| [low.min(area.y[0]), high.max(area.y[1])];
        let y = areas.iter().fold(y, ends);
        let mut inside = Inside { raster, y, known: HashMap::new() };
        let areas = areas.iter().zip(found);
        areas.map(|(area, faces)| nearest(image, area, faces, &mut inside)).collect()
    }
}

/// What is known of faces with many edges in a row: where these are, and where on the row's middle the
/// face is.
struct Inside {
    raster: Raster,
    /// The row's ends.
    y: [f64; 2],
    known: HashMap<FaceId, (Occupied, Vec<Range<u32>>)>,
}

impl Inside {
    /// Whether a face covers all of an area: no edge of it meets the area, and it is there.
    fn covers(
        &mut self,
        source: &Source,
        face: &Face,
        id: FaceId,
        x: [f64; 2],
        y: [f64; 2],
    ) -> bool {
        // Boundaries are rounded to cells.
        let near = 1e-4;
        // A cell is 3e-5 of a pixel at most, in a raster of 65536.
        let (left, right) = (x[0] - near, x[1] + near);
        let (table, raster) = (&*source.faces, self.raster);
        // Without an edge in the area the face covers all of it or nothing, and one point tells
        // which.
        let middle = raster.cell((x[0] + x[1]) / 2.0);
        let segments = |y: [f64; 2]| band::segments(table, face, (y[0] + y[1]) / 2.0, raster);
        if table.corner_count(face) < MANY {
            let mut reached = table.edges(face).filter_map(|edge| edge.reach(y[0], y[1]));
            return !reached.any(|(from, to)| from <= right && to >= left)
                && segments(y).iter().any(|segment| segment.contains(&middle));
        }
        let known = self.known.entry(id);
        let (occupied, inside) =
            known.or_insert_with(|| (table.occupied(face, self.y[0], self.y[1]), segments(self.y)));
        let at = inside.partition_point(|segment| segment.end <= middle);
        !occupied.meets(left, right) && inside.get(at).is_some_and(|s| s.contains(&middle))
    }
}

/// The faces of an area without those that lie behind one that covers all of it.
fn nearest(
    image: &SpanImage,
    area: &ProbeArea,
    mut faces: Vec<BinEntry>,
    inside: &mut Inside,
) -> Vec<FaceId> {
    faces.sort_unstable_by(|a, b| b.nearest.total_cmp(&a.nearest));
    let raster = image.view().raster();
    let x = [raster.pixels(area.cells.start), raster.pixels(area.cells.end)];
    let is_open = Limits::new(image.view()).are_open();
    let mut kept: Vec<(FaceId, f64)> = Vec::new();
    let mut bound = f64::NEG_INFINITY;
    for entry in faces {
        // All that follow are farther still.
        if f64::from(entry.nearest) < bound {
            break;
        }
        let (source, face) = image.face(entry.face);
        let plane = face.plane;
        let size = plane.a.abs() * x[1] + plane.b.abs() * area.y[1].abs() + plane.c.abs();
        let doubt = size * 1e-13 + plane.a.abs() / raster.cells_per_pixel();
        let (least, most) = plane.range(x, area.y);
        if most + doubt < bound {
            continue;
        }
        kept.push((entry.face, most + doubt));
        // A limit of depth may end a face where it has no edge, and a seal may end at an edge of
        // its face. Neither is asked.
        let may_hide = is_open && !face.is_translucent && face.role == Role::Face;
        if may_hide && inside.covers(source, face, entry.face, x, area.y) {
            bound = bound.max(least - doubt);
        }
    }
    // The bound grew on the way: what was kept early may lie behind it.
    kept.into_iter().filter(|(_, near)| *near >= bound).map(|(id, _)| id).collect()
}

/// Solves probes of a frame.
pub(super) fn solve(frame: &SpanImage, index: &FaceIndex, probes: &Arc<[Probe]>) -> SpanImage {
    // Neighbours in a row over the same cells are one window.
    let last = frame.view().raster().height - 1;
    let row = |probe: &Probe| (probe.y.max(0.0) as u32).min(last);
    let windows: Vec<Range<usize>> = probes
        .chunk_by(|a, b| a.cells == b.cells && row(a) == row(b))
        .scan(0, |first, chunk| {
            let range = *first..*first + chunk.len();
            *first = range.end;
            Some(range)
        })
        .collect();
    let mut order: Vec<usize> = (0..windows.len()).collect();
    let key = |window: &usize| {
        let probe = &probes[windows[*window].start];
        (row(probe), probe.cells.start)
    };
    // Row by row, from left to right: the candidates of a row are found for all its windows at
    // once.
    order.sort_by_key(key);
    let area = |window: &usize| {
        let probes = &probes[windows[*window].clone()];
        let ends = |[low, high]: [f64; 2], probe: &Probe| [low.min(probe.y), high.max(probe.y)];
        let y = probes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], ends);
        ProbeArea { cells: probes[0].cells.clone(), y }
    };
    let rows: Vec<&[usize]> = order.chunk_by(|a, b| key(a).0 == key(b).0).collect();
    let solver = Solver { frame, raster: frame.view().raster(), limits: Limits::new(frame.view()) };
    let solved: Vec<(usize, Vec<Solved>)> = rows
        .into_par_iter()
        .flat_map_iter(|row| {
            let areas: Vec<ProbeArea> = row.iter().map(area).collect();
            let found = index.candidates(frame, key(&row[0]).0, &areas);
            let each = row.iter().zip(found).map(|(window, faces)| {
                let probes = &probes[windows[*window].clone()];
                (*window, probes.iter().map(|probe| solver.line(probe, &faces)).collect())
            });
            each.collect::<Vec<_>>()
        })
        .collect();
    let mut lines: Vec<Option<Solved>> = probes.iter().map(|_| None).collect();
    for (window, solved) in solved {
        for (at, line) in windows[window].clone().zip(solved) {
            lines[at] = Some(line);
        }
    }
    let line = |k: u32| lines[k as usize].as_ref().expect("every probe is in a window");
    let all = 0..probes.len() as u32;
    let spans = Lines::compute(all.clone(), |k, out| out.extend_from_slice(&line(k).0));
    let layers = Layers::compute(all, |k, out| out.extend_from_slice(&line(k).1));
    frame.on_probes(probes).with_lines(spans, layers)
}

/// The spans and the layers of a probe.
type Solved = (Vec<Span>, Vec<Segment>);

struct Solver<'a> {
    frame: &'a SpanImage,
    raster: Raster,
    limits: Limits,
}

impl Solver<'_> {
    fn line(&self, probe: &Probe, faces: &[FaceId]) -> Solved {
        let y = probe.y;
        let [_, top, _, bottom] = self.frame.view().window();
        let mut found = Candidates::new(self.frame, probe.cells.clone());
        if y >= top && y <= bottom {
            for id in faces {
                let (source, face) = self.frame.face(*id);
                let mut add = |segment: Range<u32>| {
                    let within =
                        segment.start.max(probe.cells.start)..segment.end.min(probe.cells.end);
                    if within.is_empty() {
                        return;
                    }
                    let on_line = self.frame.on_line(*id, y);
                    let seen = self.limits.cut(within, &on_line, y, self.raster);
                    if !seen.is_empty() {
                        found.push(*id, seen, face.is_translucent);
                    }
                };
                // As `band::reach` does for all lines of a band.
                if face.is_monotone {
                    let mut x = (f64::INFINITY, f64::NEG_INFINITY);
                    for edge in source.faces.outline(face).crossing(y) {
                        let at = edge.x_at(y);
                        x = (x.0.min(at), x.1.max(at));
                    }
                    if x.0 <= x.1 {
                        add(self.raster.cell(x.0)..self.raster.cell(x.1));
                    }
                } else {
                    band::segments(&source.faces, face, y, self.raster).into_iter().for_each(add);
                }
            }
        }
        found.seen(y)
    }
}
