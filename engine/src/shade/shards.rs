//! What many threads make and share.

use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Mutex, PoisonError};

const SHARDS: usize = 64;

/// What is known by keys, in parts that are locked one by one.
#[derive(Debug)]
pub(super) struct Shards<K, T>(Vec<Mutex<HashMap<K, T>>>);

impl<K, T> Default for Shards<K, T> {
    fn default() -> Shards<K, T> {
        Shards((0..SHARDS).map(|_| Mutex::default()).collect())
    }
}

impl<K: Copy + Eq + Hash, T: Clone> Shards<K, T> {
    /// What is known under a key; made without a lock, as it may ask for others. Who makes it meanwhile makes the same.
    pub(super) fn or_made(&self, key: K, make: impl FnOnce() -> T) -> T {
        let mut hasher = DefaultHasher::new();
        key.hash(&mut hasher);
        let shard = &self.0[hasher.finish() as usize % SHARDS];
        if let Some(known) = shard.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return known.clone();
        }
        let made = make();
        shard.lock().unwrap_or_else(PoisonError::into_inner).entry(key).or_insert(made).clone()
    }
}
