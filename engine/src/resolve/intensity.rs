//! The intensity of faces that are shaded alike all over (\[N], "Image data structure", item 2).

use glam::DVec2;
use rayon::prelude::*;

use crate::fragment::{Anywhere, Fragments};
use crate::span::image::{Intensities, Paint};
use crate::span::{FaceId, Seen, SpanImage};
use crate::watch::Watch;
use std::sync::Arc;

/// Fragments shaded in one batch.
const BATCH: usize = 4096;

/// The intensities of an image: computed once, kept with it.
pub(super) fn of(image: &SpanImage) -> Arc<Intensities> {
    image.intensities().get_or_init(|| Arc::new(compute(image, false))).clone()
}

/// The intensities of all faces, each at [its own place](FaceTable::place), whatever part of the picture is computed.
pub(super) fn of_all(image: &SpanImage) -> Arc<Intensities> {
    Arc::new(compute(image, true))
}

fn compute(image: &SpanImage, all: bool) -> Intensities {
    let mut seen = Seen::new(image.face_count());
    seen.add(image);
    let visible: Vec<_> = seen.faces().collect();
    let mut paints = vec![None; image.face_count()];
    let watch = Watch::current();
    let shade = |batch| if watch.is_stopped() { Vec::new() } else { shade(image, batch, all) };
    let shaded: Vec<(FaceId, Paint)> = visible
        // Ids ascend, so faces of one source stand together. A shader is given those of one source.
        .par_chunk_by(|a, b| image.locate(a.0).0 == image.locate(b.0).0)
        .flat_map(|of_source| of_source.par_chunks(BATCH).map(&shade))
        .flatten_iter()
        .collect();
    for (face, paint) in shaded {
        paints[face.0 as usize] = Some(paint);
    }
    Intensities::new(paints)
}

/// Shades the faces of one source, all or those that are alike all over.
fn shade(image: &SpanImage, batch: &[(FaceId, u32, u32)], all: bool) -> Vec<(FaceId, Paint)> {
    let Some((first, ..)) = batch.first() else { return Vec::new() };
    let (source, _) = image.face(*first);
    let mut fragments = Fragments::new(image.view());
    let mut faces = Vec::new();
    for (id, k, cell) in batch {
        let (_, face) = image.face(*id);
        // [N] stores an intensity at each intersection; of a face that looks the same all over, one
        // place stands for all.
        if all || source.shades_alike(face.ordinal) {
            let seen = DVec2::new(image.view().raster().pixels(*cell), image.plan().y(*k));
            let own = || source.faces.place(face, image.view().raster()).unwrap_or(seen);
            let DVec2 { x, y } = if all { own() } else { seen };
            fragments.push(face.ordinal, face.sees_front, x, y, face.plane.depth(x, y));
            faces.push(*id);
        }
    }
    source.shade(&mut fragments, &Anywhere);
    let paints = fragments.color.into_iter().zip(fragments.alpha);
    faces.into_iter().zip(paints.map(|(color, alpha)| Paint { color, alpha })).collect()
}
