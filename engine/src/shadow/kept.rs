//! Shadows from one picture to the next (\[N]: "the compositing is done by recalculating only moving elements").
//!
//! Of some lines of a view, in the light from one place, what was found last is kept: patch by patch, what each scene
//! casts. A patch is known by where its face lies and by what is seen of it, not by its number. What a scene casts on it
//! is as before if the scene is, or if what differs in it does not reach between the patch and the light. Shadows are
//! the same bits whether they are found or kept: each list depends on nothing but its patch and the scene.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::Dark;
use crate::cache::Shelf;
use crate::fragment::{Casting, Compared, Member, Surfaces, World};
use crate::key::{Key, KeyHasher};
use crate::span::SpanImage;
use crate::trace::{Casters, Shaft, Toward};
use crate::watch::Watch;

/// What scenes cast on some lines.
#[derive(Default)]
pub(super) struct Cast {
    /// What cast: its name, and its faces.
    casters: Vec<(String, Arc<dyn Surfaces>)>,
    /// The number of each patch.
    patches: HashMap<Key, usize>,
    /// Patch by patch, for each scene, where its shadows end.
    ends: Vec<u32>,
    /// Lines, and parts of them, whatever face they name.
    shadows: Vec<(u32, Dark)>,
    /// Where the shadows of each face stand among those that are united.
    faces: HashMap<Key, Range<u32>>,
    united: Vec<(u32, Dark)>,
}

/// What was cast before, and what of it still is.
pub(super) struct Known {
    before: Arc<Cast>,
    /// Of each scene that casts now.
    casters: Vec<WasCaster>,
}

/// What a scene was before.
enum WasCaster {
    /// It was not there.
    New,
    /// The same, with a number.
    Same(usize),
    /// Another, with a number; and what differs.
    Other(usize, Arc<Casters>),
}

/// What images have in common, and a light, for shadows in one to be those in the other.
pub(super) fn key(image: &SpanImage, casting: &Casting<'_>) -> Key {
    let Casting { from, world, less } = casting;
    let mut key = KeyHasher::new("shadows");
    let from = match from {
        Toward::Direction(way) => (0u8, way.to_array()),
        Toward::Point(place) => (1, place.to_array()),
    };
    let (view, plan) = (image.view(), image.plan());
    key.value(&from).value(less).value(view.camera()).value(&(view.raster(), plan));
    // Worlds of the same scenes, of which one may have moved.
    for (at, _) in world.casters() {
        key.bytes(world.members()[at].label.as_bytes());
    }
    key.finish()
}

impl Cast {
    /// What the scenes of a world cast, when nothing has been looked for yet.
    pub(super) fn new(world: &World) -> Cast {
        let member = |at: usize| {
            let Member { label, surfaces, .. } = &world.members()[at];
            (label.clone(), surfaces.clone())
        };
        let casters = world.casters().map(|(at, _)| member(at)).collect();
        Cast { casters, ..Cast::default() }
    }

    /// How many shadows there are so far.
    pub(super) fn count(&self) -> usize {
        self.shadows.len()
    }

    /// What all scenes cast on the patches since there were so many shadows.
    pub(super) fn since(&self, count: usize) -> &[(u32, Dark)] {
        &self.shadows[count..]
    }

    /// Ends a face, of which these are the shadows of all scenes united.
    pub(super) fn end_face(
        &mut self,
        key: Key,
        shadows: impl Iterator<Item = (u32, Dark)>,
    ) -> &[(u32, Dark)] {
        let first = self.united.len();
        self.united.extend(shadows);
        self.faces.insert(key, first as u32..self.united.len() as u32);
        &self.united[first..]
    }

    /// Begins a patch.
    pub(super) fn begin(&mut self, patch: Key) {
        let number = self.ends.len() / self.casters.len().max(1);
        self.patches.insert(patch, number);
    }

    /// Ends what the next scene casts on the patch.
    pub(super) fn end(&mut self, shadows: impl Iterator<Item = (u32, Dark)>) {
        self.shadows.extend(shadows);
        self.ends.push(self.shadows.len() as u32);
    }

    fn start(&self, list: usize) -> usize {
        list.checked_sub(1).map_or(0, |before| self.ends[before] as usize)
    }

    /// What a scene casts on a patch, by their numbers.
    fn list(&self, patch: usize, caster: usize) -> &[(u32, Dark)] {
        let list = patch * self.casters.len() + caster;
        &self.shadows[self.start(list)..self.ends[list] as usize]
    }

    /// Keeps it for the next picture.
    pub(super) fn keep(mut self, (key, chunk): (Key, u32), watch: &Watch, seconds: f64) {
        let Some(shelf) = Shelf::of_work(watch).filter(|_| !watch.is_stopped()) else { return };
        self.shadows.shrink_to_fit();
        self.united.shrink_to_fit();
        let entry = size_of::<(Key, Range<u32>)>() + 1;
        let bytes = size_of_val(&*self.shadows)
            + size_of_val(&*self.united)
            + size_of_val(&*self.ends)
            + (self.patches.capacity() + self.faces.capacity()) * entry;
        shelf.renew((key, chunk), Arc::new(self), bytes, seconds);
    }
}

impl Known {
    /// The shadows on a face, if those on each of its patches are as they were.
    pub(super) fn face(&self, key: Key) -> Option<&[(u32, Dark)]> {
        let Range { start, end } = self.before.faces.get(&key)?.clone();
        Some(&self.before.united[start as usize..end as usize])
    }

    /// What was cast last on a chunk of lines.
    pub(super) fn of((key, chunk): (Key, u32), world: &World, watch: &Watch) -> Option<Known> {
        let before = Shelf::of_work(watch)?.get(key, chunk)?;
        let before: Arc<Cast> = before.downcast().ok()?;
        let casters = world.casters().map(|(at, _)| {
            let now = &world.members()[at];
            let found = before.casters.iter().position(|(label, ..)| *label == now.label);
            let Some(number) = found else { return WasCaster::New };
            let (_, surfaces) = &before.casters[number];
            if Arc::ptr_eq(surfaces, &now.surfaces) {
                return WasCaster::Same(number);
            }
            let differing = Compared::of(&now.surfaces, surfaces).differing();
            differing.map_or(WasCaster::New, |differing| WasCaster::Other(number, differing))
        });
        let casters = casters.collect();
        Some(Known { before, casters })
    }

    /// The number that a patch had.
    pub(super) fn patch(&self, key: Key) -> Option<usize> {
        self.before.patches.get(&key).copied()
    }

    /// What a scene casts on a patch, if that is as it was.
    pub(super) fn list(
        &self,
        patch: usize,
        caster: usize,
        shaft: &Shaft,
    ) -> Option<&[(u32, Dark)]> {
        match &self.casters[caster] {
            WasCaster::New => None,
            WasCaster::Same(number) => Some(self.before.list(patch, *number)),
            WasCaster::Other(number, differing) => {
                let is_reached = differing.any_within(shaft, |_| true);
                (!is_reached).then(|| self.before.list(patch, *number))
            }
        }
    }
}
