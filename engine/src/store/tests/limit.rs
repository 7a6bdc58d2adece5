//! The limit, and what is removed to hold it.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::*;

#[test]
fn what_is_dear_or_was_used_lately_stays() {
    let hours = |n| HOUR * n;
    // Twice as dear and unused for twice as long are the same.
    assert_eq!(evict::worth(2.0, 4096, hours(3)), evict::worth(1.0, 4096, hours(1)));
    assert_eq!(evict::worth(2.0, 8192, hours(3)), evict::worth(1.0, 4096, hours(3)));
    let scratch = Scratch::new("worth");
    // A share is ten files of a block each; all that is put is looked at.
    let store = scratch.store(16 * 10 * 4096);
    let keys: Vec<Key> = keys_of_part(5).take(11).collect();
    for (i, key) in keys.iter().enumerate().take(10) {
        put(&store, *key, if i < 3 { 1000.0 } else { 1.0 }, b"");
        make_older(&file(&store, *key), hours(if i < 6 { 20 } else { 2 }));
    }
    assert_eq!(held(&store, 5..6), 10 * 4096, "as many as there may be");
    std::fs::write(file(&store, keys[2]), "damaged").unwrap();
    put(&store, keys[10], 1.0, b"");
    let stays: Vec<usize> = (0..11).filter(|i| file(&store, keys[*i]).exists()).collect();
    // Nine tenths are left: the damaged one goes, and one of those that were cheap and are old.
    assert_eq!(stays.len(), 9, "{stays:?}");
    assert!([0, 1, 6, 7, 8, 9, 10].iter().all(|i| stays.contains(i)), "{stays:?}");
    for key in keys_of_part(5).skip(11).take(60) {
        put(&store, key, 1.0, b"");
    }
    let dear = keys[..2].iter().all(|key| file(&store, *key).exists());
    assert!(dear && !file(&store, keys[9]).exists());
}

#[test]
fn a_use_is_noted_once_an_hour() {
    let scratch = Scratch::new("touch");
    let store = scratch.store(1 << 30);
    let path = file(&store, key(1));
    put(&store, key(1), 1.0, b"one");
    make_older(&path, HOUR / 2);
    store.get(key(1)).unwrap();
    assert!(age(&path) > HOUR / 3, "it was used half an hour ago");
    make_older(&path, HOUR * 2);
    store.get(key(1)).unwrap();
    assert!(age(&path) < HOUR / 3);
    // A clock that was wrong is put right.
    let future = SystemTime::now() + HOUR * 1000;
    std::fs::File::options().write(true).open(&path).unwrap().set_modified(future).unwrap();
    store.get(key(1)).unwrap();
    assert!(age(&path) < HOUR / 3);
}

#[test]
fn looks_are_as_frequent_as_bytes_are_written() {
    let share = 1 << 20;
    for size in [0u64, 4096, 1 << 15, 1 << 16, 1 << 20] {
        let looks = (0..20_000).filter(|n| is_due(key(*n), size, share)).count() as f64;
        let chance = (size as f64 * 16.0 / share as f64).min(1.0);
        assert!((looks / 20_000.0 - chance).abs() < 0.01, "{size}: {looks}");
    }
}

#[test]
fn many_writers_hold_the_limit() {
    let scratch = Scratch::new("limit");
    let limit = 16 << 20;
    let store = scratch.store(limit);
    let (most, is_done) = (AtomicU64::new(0), AtomicBool::new(false));
    let bytes = vec![3; 28 << 10];
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_done.load(Ordering::Relaxed) {
                most.fetch_max(held(&store, 0..16), Ordering::Relaxed);
            }
        });
        let writers: Vec<_> = (0..8u64)
            .map(|thread| {
                let (bytes, scratch) = (&bytes, &scratch);
                scope.spawn(move || {
                    for i in 0..500 {
                        // As processes that write once: nothing but the folder is shared.
                        let store = scratch.store(limit);
                        let length = (i * 397 % bytes.len() as u64) as usize;
                        let key = key(thread << 32 | i);
                        let stored = put(&store, key, i as f64, &bytes[..length]);
                        assert_eq!(stored, Put::Stored);
                        // Another may have removed it, and nobody may have changed it.
                        let read = store.bytes(key).unwrap();
                        assert!(read.is_none_or(|read| read == bytes[..length]));
                    }
                })
            })
            .collect();
        writers.into_iter().for_each(|writer| writer.join().unwrap());
        is_done.store(true, Ordering::Relaxed);
    });
    let (most, now) = (most.into_inner(), held(&store, 0..16));
    assert!(most <= limit / 4 * 5, "{most}");
    assert!(now >= limit / 4 * 3, "not more than needed is removed: {now}");
    assert_eq!(store.folder.unfinished().unwrap().len(), 0);
}

#[test]
fn nobody_waits_for_a_lock() {
    let scratch = Scratch::new("lock");
    let store = scratch.store(16 * 10 * 4096);
    let mut keys = keys_of_part(3);
    put(&store, keys.next().unwrap(), 1.0, b"");
    let lock = store.folder.lock(3).unwrap();
    lock.lock().unwrap();
    keys.by_ref().take(20).for_each(|key| assert_eq!(put(&store, key, 1.0, b""), Put::Stored));
    assert_eq!(held(&store, 3..4), 21 * 4096, "another is at it");
    drop(lock);
    put(&store, keys.next().unwrap(), 1.0, b"");
    assert_eq!(held(&store, 3..4), 9 * 4096);
}
