//! The intensity of faces that are shaded alike all over (\[N], "Image data structure", item 2).

use rayon::prelude::*;

use crate::fragment::Fragments;
use crate::span::image::{Intensities, Paint};
use crate::span::{FaceId, Segment, SpanImage, line};
use std::sync::Arc;

/// Fragments shaded in one batch.
const BATCH: usize = 4096;

/// The intensities of an image: computed once, kept with it.
pub(super) fn of(image: &SpanImage) -> &Intensities {
    image.intensities().get_or_init(|| Arc::new(compute(image)))
}

fn compute(image: &SpanImage) -> Intensities {
    let visible = visible_points(image);
    let mut paints = vec![None; image.face_count()];
    let shaded: Vec<(FaceId, Paint)> = visible
        .par_chunk_by(|a, b| image.locate(a.0).0 == image.locate(b.0).0)
        .flat_map(|of_source| of_source.par_chunks(BATCH).map(|batch| shade(image, batch)))
        .flatten_iter()
        .collect();
    for (face, paint) in shaded {
        paints[face.0 as usize] = Some(paint);
    }
    Intensities::new(paints)
}

/// Every visible face, ascending, with a line and cell at which it is seen.
fn visible_points(image: &SpanImage) -> Vec<(FaceId, u32, u32)> {
    let cells = image.view().raster().cells();
    let mut at: Vec<Option<(u32, u32)>> = vec![None; image.face_count()];
    for k in image.lines().range() {
        for (range, face) in line::segments(image.lines().line(k), cells) {
            if face.is_some() {
                at[face.0 as usize].get_or_insert((k, range.start + (range.end - range.start) / 2));
            }
        }
        for Segment { start, face, end } in image.layers().line(k) {
            at[face.0 as usize].get_or_insert((k, start + (end - start) / 2));
        }
    }
    let known = at.into_iter().enumerate();
    known.filter_map(|(id, at)| at.map(|(k, x)| (FaceId(id as u32), k, x))).collect()
}

/// Shades the faces of one source that are alike all over.
fn shade(image: &SpanImage, batch: &[(FaceId, u32, u32)]) -> Vec<(FaceId, Paint)> {
    let Some((first, ..)) = batch.first() else { return Vec::new() };
    let (source, _) = image.face(*first);
    let mut fragments = Fragments::new(image.view());
    let mut faces = Vec::new();
    for (id, k, cell) in batch {
        let (_, face) = image.face(*id);
        if source.shades_alike(face.ordinal) {
            let (x, y) = (image.view().raster().pixels(*cell), image.plan().y(*k));
            fragments.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
            faces.push(*id);
        }
    }
    source.shade(&mut fragments);
    let paints = fragments.color.into_iter().zip(fragments.alpha);
    faces.into_iter().zip(paints.map(|(color, alpha)| Paint { color, alpha })).collect()
}
