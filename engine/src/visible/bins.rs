//! Which faces meet which band, the nearest first.
//!
//! The y-bucket sort of the scan-line method, done once for all lines of a band by counting. Within a
//! band faces come roughly from front to back, by one more counting pass over their nearest depths, so
//! that what is hidden finds its occluder already there. The order is a matter of speed alone: it
//! changes no bit of the result.

use rayon::prelude::*;
use std::ops::Range;

use super::band::LANES;
use crate::span::{FaceId, SpanImage};

/// Steps of depth by which faces are ordered.
const DEPTHS: usize = 1024;

/// Faces by band.
pub(super) struct Bins {
    starts: Vec<u32>,
    faces: Vec<FaceId>,
}

/// A face's bands and nearest depth.
#[derive(Clone, Copy)]
struct Entry {
    bands: (u32, u32),
    depth: i32,
}

impl Bins {
    pub(super) fn new(frame: &SpanImage, lines: &Range<u32>) -> Bins {
        let plan = frame.plan();
        let count = (lines.len() as u32).div_ceil(LANES as u32);
        let band_of = |k: u32| k.clamp(lines.start, lines.end) - lines.start;
        let entries: Vec<Entry> = frame
            .sources()
            .iter()
            .flat_map(|source| {
                let table = &source.faces;
                let entry = |face| {
                    let (mut top, mut bottom) = (f64::INFINITY, f64::NEG_INFINITY);
                    let mut nearest = f64::NEG_INFINITY;
                    for ring in table.rings(face) {
                        for point in ring.points() {
                            top = top.min(point.y);
                            bottom = bottom.max(point.y);
                            nearest = nearest.max(face.plane.depth(point.x, point.y));
                        }
                    }
                    let first = band_of(plan.first_at_or_below(top));
                    let last = band_of(plan.first_at_or_below(bottom));
                    let bands = (first / LANES as u32, last.div_ceil(LANES as u32));
                    let bands = if first < last { bands } else { (0, 0) };
                    Entry { bands, depth: ordered(nearest as f32) }
                };
                table.faces().par_iter().with_min_len(4096).map(entry).collect::<Vec<_>>()
            })
            .collect();
        let order = front_to_back(&entries);
        let mut starts = vec![0u32; count as usize + 2];
        for entry in &entries {
            for band in entry.bands.0..entry.bands.1 {
                starts[band as usize + 2] += 1;
            }
        }
        for band in 2..starts.len() {
            starts[band] += starts[band - 1];
        }
        let mut faces = vec![FaceId::NONE; starts[starts.len() - 1] as usize];
        for face in order {
            let Entry { bands, .. } = entries[face as usize];
            for band in bands.0..bands.1 {
                let next = &mut starts[band as usize + 1];
                faces[*next as usize] = FaceId(face);
                *next += 1;
            }
        }
        Bins { starts, faces }
    }

    /// The faces that may meet a band, roughly from front to back.
    pub(super) fn band(&self, number: u32) -> &[FaceId] {
        let number = number as usize;
        &self.faces[self.starts[number] as usize..self.starts[number + 1] as usize]
    }
}

/// A number's bits as an integer that orders as the number does.
fn ordered(value: f32) -> i32 {
    let bits = value.to_bits() as i32;
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

/// The faces by falling depth, to within a step.
fn front_to_back(entries: &[Entry]) -> Vec<u32> {
    let low = entries.iter().map(|entry| entry.depth).min().unwrap_or(0);
    let high = entries.iter().map(|entry| entry.depth).max().unwrap_or(0);
    let range = i64::from(high) - i64::from(low) + 1;
    let step = |entry: &Entry| {
        ((i64::from(high) - i64::from(entry.depth)) * DEPTHS as i64 / range) as usize
    };
    let mut starts = vec![0u32; DEPTHS + 1];
    for entry in entries {
        starts[step(entry) + 1] += 1;
    }
    for i in 1..starts.len() {
        starts[i] += starts[i - 1];
    }
    let mut order = vec![0u32; entries.len()];
    for (face, entry) in entries.iter().enumerate() {
        let next = &mut starts[step(entry)];
        order[*next as usize] = face as u32;
        *next += 1;
    }
    order
}
