//! Faces that surfaces have in common with others, such as a scene with itself as it was before an edit or a frame ago.

use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};

use super::Surfaces;
use crate::trace::Casters;

/// Which faces of surfaces others have too: the same in place, shape and look. Both are known by their ordinals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Alike(Vec<u32>);

impl Alike {
    /// Of surfaces with faces below `count`, none.
    pub fn none(count: u32) -> Alike {
        Alike(vec![u32::MAX; count as usize])
    }

    /// Says that a face is one of the others'. Those that are not below the count are left out.
    pub fn set(&mut self, face: u32, was: u32) {
        if let Some(slot) = self.0.get_mut(face as usize) {
            *slot = was;
        }
    }

    /// Which of the others' faces a face is, if it is any.
    pub fn of(&self, face: u32) -> Option<u32> {
        self.0.get(face as usize).copied().filter(|was| *was != u32::MAX)
    }
}

/// Surfaces beside those that were there before.
#[derive(Debug)]
pub(crate) struct Compared {
    now: Weak<dyn Surfaces>,
    was: Weak<dyn Surfaces>,
    alike: Option<Alike>,
    differing: OnceLock<Arc<Casters>>,
}

/// How many pairs are remembered.
const REMEMBERED: usize = 32;

impl Compared {
    /// What two surfaces have in common, found once for all that ask.
    pub(crate) fn of(now: &Arc<dyn Surfaces>, was: &Arc<dyn Surfaces>) -> Arc<Compared> {
        static PAIRS: Mutex<Vec<Arc<Compared>>> = Mutex::new(Vec::new());
        let mut pairs = PAIRS.lock().unwrap_or_else(PoisonError::into_inner);
        let (a, b) = (Arc::downgrade(now), Arc::downgrade(was));
        let is_known = |pair: &&Arc<Compared>| pair.now.ptr_eq(&a) && pair.was.ptr_eq(&b);
        if let Some(known) = pairs.iter().find(is_known) {
            return known.clone();
        }
        // Found under the lock: whoever asks meanwhile waits for it, and does not look for it too.
        let alike = now.alike(&**was);
        let made = Arc::new(Compared { now: a, was: b, alike, differing: OnceLock::new() });
        pairs.retain(|pair| pair.now.strong_count() > 0 && pair.was.strong_count() > 0);
        if pairs.len() >= REMEMBERED {
            pairs.remove(0);
        }
        pairs.push(made.clone());
        made
    }

    /// Which face a face was, if it was there.
    pub(crate) fn was(&self, face: u32) -> Option<u32> {
        self.alike.as_ref()?.of(face)
    }

    /// What only one of the two casts, if both are still there.
    pub(crate) fn differing(&self) -> Option<Arc<Casters>> {
        let (now, was) = (self.now.upgrade()?, self.was.upgrade()?);
        let differing = self.differing.get_or_init(|| {
            let none = Casters::default();
            let [now, was] = [&now, &was].map(|s| s.rays().map_or(&none, |rays| rays.casters()));
            Arc::new(now.differing(was, |face| self.was(face)))
        });
        Some(differing.clone())
    }
}
