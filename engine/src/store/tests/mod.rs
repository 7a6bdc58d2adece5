//! What a store promises, tried.

mod contents;
mod folders;
mod limit;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::*;

const HOUR: Duration = Duration::from_secs(3600);

/// A folder that is removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let name = format!("spandrel-store-{name}-{}", std::process::id());
        let folder = std::env::temp_dir().join(name);
        let _ = std::fs::remove_dir_all(&folder);
        Scratch(folder)
    }

    fn store(&self, limit: u64) -> Store {
        Store::open(&self.0, limit).unwrap()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn key(number: u64) -> Key {
    Key::of_bytes(&number.to_le_bytes())
}

fn keys_of_part(part: u8) -> impl Iterator<Item = Key> {
    (0..).map(key).filter(move |key| part_of(*key) == part)
}

fn put(store: &Store, key: Key, seconds: f64, bytes: &[u8]) -> Put {
    store.put(key, seconds, |out| out.write_all(bytes)).unwrap()
}

fn file(store: &Store, key: Key) -> PathBuf {
    store.folder.object(key)
}

fn make_older(path: &Path, age: Duration) {
    let file = std::fs::File::options().write(true).open(path).unwrap();
    file.set_modified(SystemTime::now() - age).unwrap();
}

fn age(path: &Path) -> Duration {
    evict::apart(SystemTime::now(), std::fs::metadata(path).unwrap().modified().unwrap())
}

/// The bytes of a part, or of all.
fn held(store: &Store, parts: std::ops::Range<u8>) -> u64 {
    let objects = parts.flat_map(|part| store.folder.objects(part).unwrap());
    objects.map(|object| on_disk(object.size)).sum()
}

/// What is said of an object that is no good.
fn said(store: &Store, key: Key) -> String {
    store.bytes(key).map(|bytes| bytes.is_some()).unwrap_err().to_string()
}
