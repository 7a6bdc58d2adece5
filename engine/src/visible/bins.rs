//! Which faces meet which band.
//!
//! The y-bucket sort of the scan-line method, done once for all lines of a band by counting. What a
//! band is told of a face, its columns and its nearest depth, is enough to throw most of the hidden
//! ones away without a look at the face itself: reading a face's plane and corners is a miss of the
//! cache each, and on large scenes these were measured to be half of the time.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;

use super::band::LANES;
use crate::raster::Raster;
use crate::span::{Face, FaceId, FaceTable, Source, SpanImage};

/// Steps of depth by which a band's faces are ordered.
const DEPTHS: usize = 256;

/// A face that may meet a band.
#[derive(Clone, Copy, Debug)]
pub(super) struct BinEntry {
    pub(super) face: FaceId,
    /// No part of it is nearer, on any line, in any cell.
    pub(super) nearest: f32,
    /// The first and the last pixel that it may cover.
    pub(super) columns: (u16, u16),
}

/// Faces by band.
#[derive(Debug)]
pub(super) struct Bins {
    starts: Vec<usize>,
    entries: Vec<BinEntry>,
}

/// A face's bands, half-open.
pub(super) type Bands = (u32, u32);

/// The bands of lines that are met between two heights, in pixels: none by what lies between two lines.
pub(super) fn met(frame: &SpanImage, lines: &Range<u32>, (top, bottom): (f64, f64)) -> Bands {
    let line_at = |y: f64| frame.plan().first_at_or_below(y).clamp(lines.start, lines.end);
    let (first, last) = (line_at(top) - lines.start, line_at(bottom) - lines.start);
    let is_met = first < last;
    if is_met { (first / LANES as u32, last.div_ceil(LANES as u32)) } else { (0, 0) }
}

impl Bins {
    /// The faces of a frame that are meant, by band, in a given order or in that of their sources; `bands` says which of
    /// them, half-open, a face meets that reaches from one height to another, in pixels.
    pub(super) fn new(
        frame: &SpanImage,
        order: Option<&[FaceId]>,
        count: usize,
        is_meant: impl Fn(&Face) -> bool + Sync,
        bands: impl Fn(f64, f64) -> Bands + Sync,
    ) -> Bins {
        let entry = |table: &FaceTable, face: &Face, id: FaceId| {
            let (top, bottom) = table.extent(face);
            let (first, end) = if is_meant(face) { bands(top, bottom) } else { (0, 0) };
            (first < end).then(|| ((first, end), BinEntry::new(table, face, id, frame)))
        };
        let faces: Vec<(Bands, BinEntry)> = match order {
            Some(order) => {
                let listed = order.par_iter().with_min_len(4096).filter_map(|id| {
                    let (source, face) = frame.face(*id);
                    entry(&source.faces, face, *id)
                });
                listed.collect()
            }
            None => {
                let sources = frame.sources().iter().enumerate();
                let of_source = |(source, known): (usize, &Arc<Source>)| {
                    let faces = known.faces.faces().par_iter().with_min_len(4096).enumerate();
                    let entries = faces.filter_map(|(place, face)| {
                        entry(&known.faces, face, frame.id(source, place))
                    });
                    entries.collect::<Vec<_>>()
                };
                sources.flat_map(of_source).collect()
            }
        };
        // A sort by counting: how many faces each band has, from there where each band's begin, and
        // then each face into its places.
        let mut starts = vec![0; count + 1];
        for (bands, _) in &faces {
            for band in bands.0..bands.1 {
                starts[band as usize + 1] += 1;
            }
        }
        for band in 1..=count {
            starts[band] += starts[band - 1];
        }
        let nothing = BinEntry { face: FaceId::NONE, nearest: 0.0, columns: (0, 0) };
        let mut entries = vec![nothing; starts[count]];
        // Every thread looks at all faces, and deals out those of its own bands.
        let share = count.div_ceil(rayon::current_num_threads()).max(1);
        let mut rest = &mut entries[..];
        let mut parts = Vec::new();
        for first in (0..count).step_by(share) {
            let last = (first + share).min(count);
            let (part, tail) = rest.split_at_mut(starts[last] - starts[first]);
            parts.push((first, last, part));
            rest = tail;
        }
        // No thread writes where another does, and within a band faces keep their order, however
        // many threads there are.
        parts.into_par_iter().for_each(|(first, last, part)| {
            let mut next: Vec<usize> =
                starts[first..last].iter().map(|start| start - starts[first]).collect();
            for (bands, entry) in &faces {
                for band in (bands.0 as usize).max(first)..(bands.1 as usize).min(last) {
                    let place = &mut next[band - first];
                    part[*place] = *entry;
                    *place += 1;
                }
            }
        });
        Bins { starts, entries }
    }

    /// The faces that may meet a band.
    pub(super) fn band(&self, number: u32) -> &[BinEntry] {
        let number = number as usize;
        &self.entries[self.starts[number]..self.starts[number + 1]]
    }
}

impl BinEntry {
    fn new(table: &FaceTable, face: &Face, id: FaceId, frame: &SpanImage) -> BinEntry {
        let raster: Raster = frame.view().raster();
        let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut nearest = f64::NEG_INFINITY;
        let plane = face.plane;
        for point in table.rings(face).flat_map(|ring| ring.points()) {
            left = left.min(point.x);
            right = right.max(point.x);
            let (p, q) = (plane.a * point.x, plane.b * point.y);
            // Rounding, and cells whose centre lies a little beyond the outline.
            let doubt = (p.abs() + q.abs() + plane.c.abs()) * 1e-14
                + plane.a.abs() / raster.cells_per_pixel();
            nearest = nearest.max(p + q + plane.c + doubt);
        }
        // One pixel more on either side: boundaries are rounded to cells.
        let last = f64::from(raster.width - 1);
        let column = |x: f64| x.clamp(0.0, last) as u16;
        BinEntry {
            face: id,
            // The bound must not fall below the depth when it is rounded to 32 bits.
            nearest: (nearest as f32).next_up(),
            columns: (column(left - 1.0), column(right + 1.0)),
        }
    }
}

/// Puts a band's faces roughly in order from front to back, by one counting pass over their nearest
/// depths, so that what is hidden finds its occluder already there. The order is a matter of speed
/// alone: it changes no bit of the result.
pub(super) fn sort_front_to_back(entries: &[BinEntry], sorted: &mut Vec<BinEntry>) {
    sorted.clear();
    sorted.extend_from_slice(entries);
    let orders = entries.iter().map(|entry| ordered(entry.nearest));
    let low = orders.clone().min().unwrap_or(0);
    let high = orders.max().unwrap_or(0);
    let range = i64::from(high) - i64::from(low) + 1;
    let step = |entry: &BinEntry| {
        let below = i64::from(high) - i64::from(ordered(entry.nearest));
        // Steps are even in the bits of a depth, so nearly even in its logarithm: one face close to
        // the eye does not push all others into the last step.
        (below * DEPTHS as i64 / range) as usize
    };
    let mut places = [0; DEPTHS + 1];
    for entry in entries {
        places[step(entry) + 1] += 1;
    }
    for i in 1..places.len() {
        places[i] += places[i - 1];
    }
    for entry in entries {
        let place = &mut places[step(entry)];
        sorted[*place] = *entry;
        *place += 1;
    }
}

/// A number's bits as an integer that orders as the number does.
fn ordered(value: f32) -> i32 {
    let bits = value.to_bits() as i32;
    // By their bits, numbers below zero order backwards. All bits but the sign are turned over.
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}
