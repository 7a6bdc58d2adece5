//! What pictures show of fragments, found before these are shaded.

use super::{Columns, Finish, Fragments};
use crate::color::Color;
use crate::key::Key;
use glam::Vec3;

/// A part of a fragment: the fragment's place in its batch, the bundle of the attribute domain that it lies in, if its
/// face is divided, and its share of the fragment.
pub type PictureShare = (usize, Option<u32>, f32);

/// Pictures that are needed at once: those of one material, with the trigger pattern and the bundles of its domains.
#[derive(Clone, Debug, Default)]
pub struct PictureSet {
    /// Its number among those of its surfaces.
    pub number: u32,
    /// The pictures, and the bytes that each takes at most.
    pub pictures: Vec<(Key, u64)>,
}

/// What a part of a fragment looks like with the pictures that lie on it.
#[derive(Clone, Copy, Debug)]
pub struct PaintedPart {
    /// Its colour.
    pub color: Color,
    /// How much it hides.
    pub alpha: f32,
    /// The unit normal on the side that is seen, if anything reads it.
    pub normal: Option<Vec3>,
    /// How it answers light, if pictures change that and anything reads it.
    pub finish: Option<Finish>,
}

/// What pictures show of some fragments of a batch.
#[derive(Debug, Default)]
pub struct Painted {
    parts: Vec<PictureShare>,
    color: Vec<Color>,
    alpha: Vec<f32>,
    normal: Vec<Vec3>,
    finish: Vec<Finish>,
}

impl Painted {
    /// The columns that pictures may change.
    pub const COLUMNS: [Columns; 3] = [Columns::COLOR, Columns::NORMAL, Columns::FINISH];

    /// Takes the columns of a batch of parts.
    pub(super) fn of(parts: Vec<PictureShare>, fragments: Fragments<'_>) -> Painted {
        let Fragments { color, alpha, normal, finish, .. } = fragments;
        // Most pictures are colours alone.
        let is_alike = finish.windows(2).all(|pair| pair[0] == pair[1]);
        let finish = if is_alike { finish.into_iter().take(1).collect() } else { finish };
        Painted { parts, color, alpha, normal, finish }
    }

    fn shown(&self, row: usize) -> PaintedPart {
        PaintedPart {
            color: self.color[row],
            alpha: self.alpha[row],
            normal: self.normal.get(row).copied(),
            finish: self.finish.get(row).or(self.finish.first()).copied(),
        }
    }

    /// The parts of all fragments of a batch and what is known of each. The parts are empty if no fragment has more
    /// than one.
    pub(super) fn spread(
        all: &[Painted],
        count: usize,
    ) -> (Vec<PictureShare>, Vec<Option<PaintedPart>>) {
        let mut by_fragment: Vec<Vec<(PictureShare, PaintedPart)>> = vec![Vec::new(); count];
        for painted in all {
            for (row, part) in painted.parts.iter().enumerate() {
                by_fragment[part.0].push((*part, painted.shown(row)));
            }
        }
        let is_divided = by_fragment.iter().flatten().any(|((_, bundle, _), _)| bundle.is_some());
        let mut parts = Vec::with_capacity(count);
        let mut shown = Vec::with_capacity(count);
        for (at, known) in by_fragment.into_iter().enumerate() {
            if known.is_empty() {
                parts.push((at, None, 1.0));
                shown.push(None);
            }
            for (part, look) in known {
                parts.push(part);
                shown.push(Some(look));
            }
        }
        if !is_divided {
            parts.clear();
        }
        (parts, shown)
    }
}
