//! What can be made again, kept within a limit of bytes.
//!
//! One cache serves the process: the values that a graph's nodes made, and what images keep of themselves
//! from one picture to the next. Whatever is in use counts first; what is kept has the rest of the limit.
//! What goes first is decided by *GreedyDual-Size* (Cao and Irani 1997): an entry is worth the seconds per
//! byte that it took to make, above a level that rises to the worth of whatever was dropped last. Of two
//! entries that were as dear, the one that was not used for longer goes; of two that were used together,
//! the cheaper one.

use std::any::Any;
use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use crate::key::Key;
use crate::watch::Watch;

/// Something that is kept.
pub type Kept = Arc<dyn Any + Send + Sync>;

/// Keeps items within a limit of bytes.
#[derive(Debug)]
pub struct Cache(Mutex<CacheState>);

#[derive(Debug)]
struct CacheState {
    limit: usize,
    /// Bytes that are kept.
    kept: usize,
    /// Bytes that are in use, and the most that they were.
    used: usize,
    most_used: usize,
    /// The most bytes that were kept and in use at once.
    most: usize,
    level: f64,
    /// Counts requests, and shelves.
    clock: u64,
    shelves: HashMap<u64, HashMap<(Key, u32), Entry>>,
    /// Entries by worth, as the bits of a number that is not negative, and by the request that came last.
    order: BTreeMap<(u64, u64), (u64, Key, u32)>,
}

#[derive(Debug)]
struct Entry {
    item: Kept,
    bytes: usize,
    seconds_per_byte: f64,
    /// Its place in the order.
    place: (u64, u64),
}

/// A part of a cache with one owner, with which its contents go.
#[derive(Debug)]
pub struct Shelf {
    cache: Arc<Cache>,
    number: u64,
    /// When unused items were dropped last, as the cache counts requests.
    swept: AtomicU64,
}

/// Bytes in use, until this is dropped.
#[derive(Debug)]
pub struct InUse {
    cache: Arc<Cache>,
    bytes: usize,
}

/// What a cache holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CacheReport {
    /// Bytes that are kept.
    pub kept: usize,
    /// Bytes that are in use.
    pub used: usize,
    /// The most bytes that were in use at once.
    pub most_used: usize,
    /// The most bytes that were kept and in use at once.
    pub most: usize,
}

/// The cache of this process; its limit is a quarter of the machine's memory unless somebody says otherwise.
pub fn cache() -> &'static Arc<Cache> {
    static CACHE: OnceLock<Arc<Cache>> = OnceLock::new();
    CACHE.get_or_init(|| {
        let limit = crate::machine::memory().map_or(4 << 30, |memory| memory / 4);
        Cache::new(usize::try_from(limit).unwrap_or(usize::MAX))
    })
}

impl Cache {
    /// An empty cache with a limit in bytes.
    pub fn new(limit: usize) -> Arc<Cache> {
        Arc::new(Cache(Mutex::new(CacheState {
            limit,
            kept: 0,
            used: 0,
            most_used: 0,
            most: 0,
            level: 0.0,
            clock: 0,
            shelves: HashMap::new(),
            order: BTreeMap::new(),
        })))
    }

    fn held(&self) -> MutexGuard<'_, CacheState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the limit in bytes; what is too much is dropped.
    pub fn set_limit(&self, limit: usize) {
        let mut held = self.held();
        held.limit = limit;
        let out = held.make_room();
        drop(held);
        drop(out);
    }

    /// The limit in bytes.
    pub fn limit(&self) -> usize {
        self.held().limit
    }

    /// What it holds.
    pub fn report(&self) -> CacheReport {
        let held = self.held();
        let CacheState { kept, used, most_used, most, .. } = *held;
        CacheReport { kept, used, most_used, most }
    }

    /// A shelf with nothing on it.
    pub fn shelf(self: &Arc<Cache>) -> Shelf {
        let mut held = self.held();
        held.clock += 1;
        Shelf { cache: self.clone(), number: held.clock, swept: AtomicU64::new(held.clock) }
    }

    /// Counts bytes that are in use, for which kept ones make room.
    pub fn in_use(self: &Arc<Cache>, bytes: usize) -> InUse {
        let mut held = self.held();
        held.used += bytes;
        let out = held.make_room();
        held.most_used = held.most_used.max(held.used);
        held.most = held.most.max(held.used + held.kept);
        drop(held);
        drop(out);
        InUse { cache: self.clone(), bytes }
    }
}

impl Drop for InUse {
    fn drop(&mut self) {
        self.cache.held().used -= self.bytes;
    }
}

impl CacheState {
    /// Takes away what is too much. It is to be dropped where nothing is locked: it may own a shelf.
    #[must_use]
    fn make_room(&mut self) -> Vec<Entry> {
        let mut out = Vec::new();
        while self.kept > 0 && self.kept + self.used > self.limit {
            let Some((place, (shelf, key, part))) = self.order.pop_first() else { break };
            // The level rises to the worth of what goes. Those that are used from now on stand
            // above it, and what was dear but is not used any more sinks below them.
            self.level = f64::from_bits(place.0);
            let items = self.shelves.get_mut(&shelf);
            if let Some(entry) = items.and_then(|items| items.remove(&(key, part))) {
                self.kept -= entry.bytes;
                out.push(entry);
            }
        }
        out
    }

    /// The place of an entry that is used now.
    fn place(&mut self, seconds_per_byte: f64) -> (u64, u64) {
        self.clock += 1;
        ((self.level + seconds_per_byte).to_bits(), self.clock)
    }
}

impl Shelf {
    /// The shelf on which the work at hand finds what work before it left: pictures of which parts may serve again. None
    /// where nobody keeps any.
    pub(crate) fn of_work(watch: &Watch) -> Option<Arc<Shelf>> {
        watch.kept()
    }

    /// Keeps an item instead of what is kept under its key, unless it would take the place of much else. What was made
    /// quickly because much of it was known is as dear as that was.
    pub(crate) fn renew(&self, (key, part): (Key, u32), item: Kept, bytes: usize, seconds: f64) {
        let before = self.remove(key, part).unwrap_or(0.0);
        if bytes <= self.cache.limit() / 8 {
            self.put(key, part, item, bytes, seconds.max(before));
        }
    }

    /// What is kept under a key, of a part.
    pub fn get(&self, key: Key, part: u32) -> Option<Kept> {
        let mut held = self.cache.held();
        let entry = held.shelves.get(&self.number)?.get(&(key, part))?;
        let (old, rate) = (entry.place, entry.seconds_per_byte);
        // Used again: its worth counts from the level that there is now.
        let place = held.place(rate);
        held.order.remove(&old);
        held.order.insert(place, (self.number, key, part));
        let entry = held.shelves.get_mut(&self.number)?.get_mut(&(key, part))?;
        entry.place = place;
        Some(entry.item.clone())
    }

    /// Keeps an item that took some seconds to make, as long as there is room. What is kept under the same key stays.
    pub fn put(&self, key: Key, part: u32, item: Kept, bytes: usize, seconds: f64) {
        let mut held = self.cache.held();
        if held.shelves.get(&self.number).is_some_and(|items| items.contains_key(&(key, part))) {
            return;
        }
        let seconds_per_byte = seconds.max(0.0) / bytes.max(1) as f64;
        let place = held.place(seconds_per_byte);
        held.order.insert(place, (self.number, key, part));
        let entry = Entry { item, bytes, seconds_per_byte, place };
        held.shelves.entry(self.number).or_default().insert((key, part), entry);
        held.kept += bytes;
        let out = held.make_room();
        held.most = held.most.max(held.used + held.kept);
        drop(held);
        drop(out);
    }

    /// What is kept under a key, of a part, or else is made: the item and its bytes. What was made under a watch that
    /// [was stopped](Watch::is_stopped) is not kept.
    pub fn or_made<T: Any + Send + Sync>(
        &self,
        (key, part): (Key, u32),
        watch: &Watch,
        make: impl FnOnce() -> (T, usize),
    ) -> Arc<T> {
        if let Some(known) = self.get(key, part).and_then(|item| item.downcast().ok()) {
            return known;
        }
        // Made without a lock: two threads may make the same at once, and the first to end is kept.
        let clock = Instant::now();
        let (made, bytes) = make();
        let made = Arc::new(made);
        if !watch.is_stopped() {
            self.put(key, part, made.clone(), bytes, clock.elapsed().as_secs_f64());
        }
        made
    }

    /// Drops what is kept under a key, of a part; returns the seconds that it took to make.
    pub fn remove(&self, key: Key, part: u32) -> Option<f64> {
        let mut held = self.cache.held();
        let entry = held.shelves.get_mut(&self.number)?.remove(&(key, part))?;
        held.kept -= entry.bytes;
        held.order.remove(&entry.place);
        drop(held);
        let seconds = entry.seconds_per_byte * entry.bytes as f64;
        // It may own a shelf, whose end takes the lock.
        drop(entry);
        Some(seconds)
    }

    /// Drops what nobody asked for or put here since this was called last.
    pub fn drop_unused(&self) {
        let mut held = self.cache.held();
        held.clock += 1;
        let last = self.swept.swap(held.clock, Ordering::Relaxed);
        let items = held.shelves.get(&self.number).into_iter().flatten();
        let old: Vec<(Key, u32)> =
            items.filter(|(_, entry)| entry.place.1 < last).map(|(key, _)| *key).collect();
        drop(held);
        for (key, part) in old {
            let _ = self.remove(key, part);
        }
    }

    /// Bytes that are kept.
    pub fn bytes(&self) -> usize {
        let held = self.cache.held();
        let items = held.shelves.get(&self.number).into_iter().flat_map(HashMap::values);
        items.map(|entry| entry.bytes).sum()
    }

    /// How many keys have items, and of how many parts in all.
    pub fn count(&self) -> (usize, usize) {
        let held = self.cache.held();
        let Some(items) = held.shelves.get(&self.number) else { return (0, 0) };
        let keys: std::collections::HashSet<Key> = items.keys().map(|(key, _)| *key).collect();
        (keys.len(), items.len())
    }
}

impl Drop for Shelf {
    fn drop(&mut self) {
        let mut held = self.cache.held();
        let items = held.shelves.remove(&self.number).unwrap_or_default();
        for entry in items.values() {
            held.kept -= entry.bytes;
            held.order.remove(&entry.place);
        }
        drop(held);
        // What is kept may hold shelves of its own.
        drop(items);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(number: u8) -> Key {
        Key::of_bytes(&[number])
    }

    fn kept(shelf: &Shelf, numbers: std::ops::Range<u8>) -> Vec<u8> {
        let held = shelf.cache.held();
        let items = held.shelves.get(&shelf.number);
        numbers.filter(|n| items.is_some_and(|items| items.contains_key(&(key(*n), 0)))).collect()
    }

    #[test]
    fn what_was_used_least_recently_and_cost_least_goes_first() {
        let cache = Cache::new(30);
        let shelf = cache.shelf();
        let put = |n: u8, seconds: f64| shelf.put(key(n), 0, Arc::new(n), 10, seconds);
        (0..3).for_each(|n| put(n, 1.0));
        assert_eq!(shelf.get(key(0), 0).and_then(|n| n.downcast().ok()), Some(Arc::new(0u8)));
        put(3, 1.0);
        assert_eq!(kept(&shelf, 0..4), [0, 2, 3], "1 was used least recently");
        put(4, 1000.0);
        (5..8).for_each(|n| put(n, 1.0));
        assert_eq!(kept(&shelf, 0..8), [4, 6, 7], "4 was dear");
        // Dear as it was, it does not stay for ever.
        for round in 0..5000u32 {
            put((8 + round % 200) as u8, 1.0);
        }
        assert!(!kept(&shelf, 0..8).contains(&4));
        assert_eq!((shelf.bytes(), cache.report().kept), (30, 30));
    }

    #[test]
    fn what_is_not_used_any_more_is_dropped() {
        let cache = Cache::new(100);
        let shelf = cache.shelf();
        (0..3).for_each(|n| shelf.put(key(n), 0, Arc::new(n), 10, 1.0));
        shelf.drop_unused();
        assert_eq!(kept(&shelf, 0..3), [0, 1, 2]);
        shelf.get(key(1), 0);
        shelf.drop_unused();
        assert_eq!((kept(&shelf, 0..3), cache.report().kept), (vec![1], 10));
    }

    #[test]
    fn what_is_in_use_comes_first_and_shelves_take_their_items_along() {
        let cache = Cache::new(30);
        let (shelf, other) = (cache.shelf(), cache.shelf());
        shelf.put(key(0), 0, Arc::new(()), 10, 1.0);
        other.put(key(0), 0, Arc::new(()), 10, 1.0);
        other.put(key(1), 7, Arc::new(()), 40, 1.0);
        assert_eq!((shelf.count(), other.count()), ((1, 1), (1, 1)), "40 are more than all");
        let used = cache.in_use(15);
        assert_eq!((shelf.count(), other.count()), ((0, 0), (1, 1)));
        assert_eq!(cache.report().used, 15);
        drop(used);
        drop(other);
        assert_eq!(cache.report(), CacheReport { kept: 0, used: 0, most_used: 15, most: 25 });
    }
}
