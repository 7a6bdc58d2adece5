//! Pictures on surfaces, a few at a time (\[N], "Texture mapping").
//!
//! Rows show faces of all clusters, and so all pictures at once. Where the store of pictures cannot hold them all,
//! fragments find what their pictures show before they are shaded: one set of pictures after the other, as many as
//! there is room for, over all rows; and then the pictures make room for the next.

use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::Painter;
use super::gather::{Gathered, Group};
use crate::fragment::{Painted, PictureSet};
use crate::key::Key;
use crate::raster::Rows;
use crate::span::SpanImage;
use crate::texture::store;

/// What is known of a band of rows before it is shaded.
pub(in crate::resolve) struct Ahead {
    pub(super) gathered: Arc<Gathered>,
    /// By group, what its pictures show.
    painted: Vec<Vec<Painted>>,
}

/// A set of pictures, by its source and its number there.
type SetId = (usize, u32);

impl Ahead {
    /// What pictures show of a group.
    pub(super) fn painted(&self, group: usize) -> &[Painted] {
        self.painted.get(group).map_or(&[], Vec::as_slice)
    }

    /// Gathers all bands of a picture and finds what pictures show of them, if the store cannot hold these all at
    /// once; and how many times that made room. Bands have numbers and rows.
    pub(in crate::resolve) fn of<'a>(
        image: &SpanImage,
        bands: &[(u32, Rows)],
        painter: impl Fn() -> Painter<'a> + Sync,
    ) -> Option<(Vec<Ahead>, u64)> {
        let limit = store().limit() as u64;
        let mut sets = BTreeMap::new();
        for (source, known) in image.sources().iter().enumerate() {
            let Some(pictures) = known.surfaces.pictures() else { continue };
            let of_source = pictures.picture_sets().into_iter();
            sets.extend(of_source.map(|set| ((source, set.number), set)));
        }
        // All fit, seen or not: rows may read them as they come.
        if room(sets.values()) <= limit {
            return None;
        }
        let gather = |painter: &mut Painter<'a>, (band, rows): &(u32, Rows)| {
            let gathered = painter.gathered(*band, rows);
            let mut seen = BTreeSet::new();
            for group in gathered.groups() {
                let sets = (0..group.ordinal.len()).filter_map(|i| group.set(image, i));
                seen.extend(sets.map(|set| (group.source, set)));
            }
            (Ahead { gathered, painted: Vec::new() }, seen)
        };
        let (mut ahead, seen): (Vec<Ahead>, Vec<BTreeSet<SetId>>) =
            bands.par_iter().map_init(&painter, gather).unzip();
        let seen: BTreeSet<SetId> = seen.into_iter().flatten().collect();
        // What is not seen is not read, and the rest may fit.
        sets.retain(|id, _| seen.contains(id));
        if room(sets.values()) <= limit {
            return None;
        }
        let passes = passes(&sets, limit);
        for pass in &passes {
            let pictures = pass.iter().flat_map(|id| &sets[id].pictures);
            store().keep_only(&pictures.map(|(key, _)| *key).collect());
            ahead
                .par_iter_mut()
                .for_each_init(&painter, |painter, band| band.paint(image, painter, pass));
        }
        Some((ahead, passes.len() as u64))
    }

    /// Finds what the pictures of some sets show.
    fn paint(&mut self, image: &SpanImage, painter: &Painter<'_>, pass: &BTreeSet<SetId>) {
        self.painted.resize_with(self.gathered.groups().count(), Vec::new);
        for (group, painted) in self.gathered.groups().zip(&mut self.painted) {
            let is_shown = |i: &usize| {
                group.set(image, *i).is_some_and(|set| pass.contains(&(group.source, set)))
            };
            let which: Vec<usize> = (0..group.ordinal.len()).filter(is_shown).collect();
            if !which.is_empty() {
                let source = &image.sources()[group.source];
                painted.push(source.paint(&painter.fragments(group), &which));
            }
        }
    }
}

impl Group {
    /// The set of pictures that lies on a fragment.
    fn set(&self, image: &SpanImage, i: usize) -> Option<u32> {
        let surfaces = &image.sources()[self.source].surfaces;
        surfaces.picture_set(self.ordinal[i], self.sees_front[i])
    }
}

/// The bytes that sets of pictures take together.
fn room<'s>(sets: impl Iterator<Item = &'s PictureSet>) -> u64 {
    let pictures: BTreeMap<Key, u64> = sets.flat_map(|set| set.pictures.iter().copied()).collect();
    pictures.into_values().fold(0, u64::saturating_add)
}

/// Sets of pictures in their order, as many at a time as there is room for: at least one.
fn passes(sets: &BTreeMap<SetId, PictureSet>, limit: u64) -> Vec<BTreeSet<SetId>> {
    let mut passes: Vec<BTreeSet<SetId>> = Vec::new();
    for id in sets.keys() {
        let has_room = |pass: &&mut BTreeSet<SetId>| {
            room(pass.iter().chain([id]).map(|id| &sets[id])) <= limit
        };
        match passes.last_mut().filter(has_room) {
            Some(pass) => {
                pass.insert(*id);
            }
            None => passes.push(BTreeSet::from([*id])),
        }
    }
    passes
}
