//! What many threads make and share.

use foldhash::fast::FixedState;
use std::collections::HashMap;
use std::hash::{BuildHasher, Hash};
use std::sync::{Mutex, PoisonError};

const SHARDS: usize = 64;

/// What is known by keys, in parts that are locked one by one.
#[derive(Debug)]
pub(super) struct Shards<K, T>(Vec<Mutex<HashMap<K, T, FixedState>>>);

impl<K, T> Default for Shards<K, T> {
    fn default() -> Shards<K, T> {
        Shards((0..SHARDS).map(|_| Mutex::default()).collect())
    }
}

impl<K: Copy + Eq + Hash, T: Clone> Shards<K, T> {
    /// What is known under a key; made without a lock, as it may ask for others. Who makes it meanwhile makes the same.
    pub(super) fn or_made(&self, key: K, make: impl FnOnce() -> T) -> T {
        // Other bits than those by which a part finds it.
        let shard = &self.0[FixedState::with_seed(1).hash_one(key) as usize % SHARDS];
        if let Some(known) = shard.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let made = make();
        shard.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_insert(made).clone()
    }
}
