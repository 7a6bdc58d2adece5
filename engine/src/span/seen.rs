//! Which faces are seen, and where.

use std::sync::Arc;

use super::cut::Cut;
use super::face::Role;
use super::layer::Segment;
use super::line;
use super::{FaceId, Source, SpanImage};
use crate::error::Result;

/// Of every face of an image, a place where it is seen.
#[derive(Clone, Debug)]
pub struct Seen(Vec<Option<(u32, u32)>>);

impl Seen {
    /// Nothing seen yet, of `faces` faces.
    pub fn new(faces: usize) -> Seen {
        Seen(vec![None; faces])
    }

    /// Adds what is seen in an image, each face in the middle of its first segment; and what is not
    /// seen but parts what is, where it does so first.
    pub fn add(&mut self, image: &SpanImage) {
        let cells = image.view().raster().cells();
        for k in image.lines().range() {
            for (range, face) in line::segments(image.lines().line(k), cells) {
                if face.is_some() {
                    let middle = range.start + (range.end - range.start) / 2;
                    self.0[face.0 as usize].get_or_insert((k, middle));
                }
            }
            for Segment { start, face, end } in image.layers().line(k) {
                self.0[face.0 as usize].get_or_insert((k, start + (end - start) / 2));
            }
            for Cut { x, face } in image.cuts().line(k) {
                self.0[face.0 as usize].get_or_insert((k, *x));
            }
        }
    }

    /// Every face that is seen, by ascending id, with a line and a cell of it.
    pub fn faces(&self) -> impl Iterator<Item = (FaceId, u32, u32)> + '_ {
        let known = self.0.iter().enumerate();
        known.filter_map(|(id, at)| at.map(|(k, x)| (FaceId(id as u32), k, x)))
    }

    /// Where a face is seen.
    pub fn at(&self, face: FaceId) -> Option<(u32, u32)> {
        self.0[face.0 as usize]
    }

    /// The places, in the table of the source at `at`, of the faces that are seen and those that seals among
    /// them lie on.
    pub fn places(&self, image: &SpanImage, at: usize) -> Vec<u32> {
        let faces = image.sources()[at].faces.faces();
        let mut keep: Vec<bool> =
            (0..faces.len()).map(|place| self.at(image.id(at, place)).is_some()).collect();
        for (place, face) in faces.iter().enumerate() {
            if let Role::Seal(parent) = face.role
                && keep[place]
            {
                // A seal is cut by the rings of its face, and may end at an edge of it.
                keep[parent as usize] = true;
            }
        }
        (0..faces.len() as u32).filter(|place| keep[*place as usize]).collect()
    }
}

impl SpanImage {
    /// The same picture without the faces that are not seen: what a file holds of it. Merging first or
    /// pruning first makes no difference.
    ///
    /// # Errors
    /// None that an image can cause.
    pub fn pruned(&self) -> Result<SpanImage> {
        let mut seen = Seen::new(self.face_count());
        seen.add(self);
        let mut sources = Vec::new();
        let mut ids = vec![FaceId::NONE; self.face_count()];
        let mut next = 0;
        for (at, source) in self.sources().iter().enumerate() {
            let keep = seen.places(self, at);
            for place in &keep {
                ids[self.id(at, *place as usize).0 as usize] = FaceId(next);
                next += 1;
            }
            let faces = Arc::new(source.faces.only(&keep)?);
            sources.push(Source { faces, ..Source::clone(source) });
        }
        // New ids ascend as the old ones did, so ties are decided as before.
        let frame = SpanImage::frame(self.view().clone(), self.plan(), self.rows(), sources)?;
        let frame = frame.with_limits(self.limits().iter().copied());
        Ok(self.renamed(frame, |face| ids[face.0 as usize]))
    }
}
