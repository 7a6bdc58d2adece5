//! Where fragments stand: what is kept of them, and what only the lines around them tell.

use std::any::Any;
use std::sync::Arc;
use std::time::Instant;

use super::{Painted, World};
pub use crate::cache::Kept;
use crate::key::Key;
use crate::trace::{Reductions, Toward};

/// What stands around the fragments of a batch: what is kept of them, and what only the lines around them
/// tell.
pub trait Batch {
    /// What was kept under a key, of these very fragments.
    fn kept(&self, _key: Key) -> Option<Kept> {
        None
    }

    /// Keeps something of these fragments that took some seconds to make, as long as there is room.
    fn keep(&self, _key: Key, _value: Kept, _bytes: usize, _seconds: f64) {}

    /// Whether nobody waits for the fragments any more: what is made of them then is thrown away.
    fn is_stopped(&self) -> bool {
        false
    }

    /// What is known already of what pictures show of these fragments: of all on which pictures lie, or nothing.
    fn painted(&self) -> &[Painted] {
        &[]
    }

    /// By fragment, how much of the area that it covers is lit by a source at one place: exact along lines.
    /// `None` if there are no lines around the fragments.
    fn lit(&self, _casting: &Casting<'_>) -> Option<Vec<f32>> {
        None
    }

    /// Counts what was done, by a name that people read.
    fn count(&self, _what: &'static str, _number: u64) {}

    /// The share of its pixel that a fragment covers, 0 to 1.
    fn coverage(&self, _fragment: usize) -> f32 {
        1.0
    }

    /// What a fragment covers of the screen: pieces of lines, in pixels of the raster. Empty if it is but
    /// its point.
    fn pieces(&self, _fragment: usize) -> Vec<LinePiece> {
        Vec::new()
    }
}

impl dyn Batch + '_ {
    /// What was kept under a key, of these very fragments, or else is made now and kept: the value and its bytes.
    pub fn or_made<T: Any + Send + Sync>(
        &self,
        key: Key,
        make: impl FnOnce() -> (T, usize),
    ) -> Arc<T> {
        if let Some(known) = self.kept(key).and_then(|kept| kept.downcast().ok()) {
            return known;
        }
        let clock = Instant::now();
        let (made, bytes) = make();
        let made = Arc::new(made);
        self.keep(key, made.clone() as Kept, bytes, clock.elapsed().as_secs_f64());
        made
    }
}

/// Light from one place, and what stands in its way.
#[derive(Clone, Copy, Debug)]
pub struct Casting<'a> {
    /// Where it comes from.
    pub from: Toward,
    /// What casts shadows.
    pub world: &'a World,
    /// What is left out of the search.
    pub less: Reductions,
}

/// A piece of a line that shows a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePiece {
    /// Its ends, from the left.
    pub x: [f64; 2],
    /// The strip that it stands for, from the top.
    pub y: [f64; 2],
}

/// Fragments that stand nowhere in particular.
pub struct Anywhere;

impl Batch for Anywhere {}
