//! What is kept with the spans of an image from one picture to the next: nothing of it depends on stacks
//! but by its key, so that images which differ in shading alone share it.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use crate::fragment::Kept;
use crate::key::Key;

/// Bytes that are kept with one image, at most.
const LIMIT: usize = 1 << 30;

/// Values by key and part, as long as there is room: what was not asked for the longest goes first.
#[derive(Debug, Default)]
pub struct Memo(Mutex<Entries>);

#[derive(Debug, Default)]
struct Entries {
    by_key: HashMap<Key, Entry>,
    bytes: usize,
    /// Counts requests.
    clock: u64,
}

#[derive(Debug, Default)]
struct Entry {
    parts: HashMap<u32, Kept>,
    bytes: usize,
    used: u64,
}

impl Memo {
    fn entries(&self) -> std::sync::MutexGuard<'_, Entries> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What was kept under a key, of a part.
    pub fn get(&self, key: Key, part: u32) -> Option<Kept> {
        let mut entries = self.entries();
        entries.clock += 1;
        let clock = entries.clock;
        let entry = entries.by_key.get_mut(&key)?;
        entry.used = clock;
        entry.parts.get(&part).cloned()
    }

    /// Keeps a value.
    pub fn put(&self, key: Key, part: u32, value: Kept, bytes: usize) {
        let mut entries = self.entries();
        entries.clock += 1;
        let clock = entries.clock;
        let entry = entries.by_key.entry(key).or_default();
        entry.used = clock;
        if entry.parts.insert(part, value).is_some() {
            return;
        }
        entry.bytes += bytes;
        entries.bytes += bytes;
        while entries.bytes > LIMIT {
            let oldest = entries.by_key.iter().min_by_key(|(_, entry)| entry.used);
            let Some(oldest) = oldest.map(|(key, _)| *key) else { return };
            entries.bytes -= entries.by_key.remove(&oldest).map_or(0, |entry| entry.bytes);
        }
    }

    /// Bytes that are kept.
    pub fn bytes(&self) -> usize {
        self.entries().bytes
    }

    /// How many keys have values, and of how many parts in all.
    pub fn count(&self) -> (usize, usize) {
        let entries = self.entries();
        (entries.by_key.len(), entries.by_key.values().map(|entry| entry.parts.len()).sum())
    }
}
