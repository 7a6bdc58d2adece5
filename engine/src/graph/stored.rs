//! Results on disk, shared by processes: found by what they are made of, before anything is made.
//!
//! A value's *recipe* is known before it is made: the program's build, the kind of node and its parameters, what is asked
//! of it, the contents of the files that it names, and the recipes of its inputs. Under it lies a *record*: which other
//! files were read on the way, of all inputs, with their contents, what was said on the way, and the value's key. If these
//! files are what they were, the value lies under the recipe and them. So a picture is found without evaluating anything
//! that it is made of, and its warnings with it.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use super::ask::Remark;
use super::registry::Packing;
use super::value::AnyValue;
use crate::key::{Key, KeyHasher};
use crate::open;
use crate::store::{Put, Store};

/// The files that a value was made of, with their contents; none for those that were looked for and not there.
pub(super) type Files = BTreeMap<PathBuf, Option<Key>>;

/// What a value was made of, and what was said on the way, by which node.
#[derive(Clone, Debug, Default)]
pub(super) struct Past {
    pub(super) files: Files,
    pub(super) said: BTreeSet<(String, Remark)>,
}

impl Past {
    /// Adds what another value was made of.
    pub(super) fn add(&mut self, other: &Past) {
        self.files.extend(other.files.iter().map(|(path, contents)| (path.clone(), *contents)));
        self.said.extend(other.said.iter().cloned());
    }
}

/// Results on disk.
#[derive(Debug)]
pub struct Stored {
    store: Store,
    build: Key,
    /// Whether it was told that nothing can be stored.
    is_told: AtomicBool,
    /// Whether it was told that something is too large.
    is_large_told: AtomicBool,
}

/// What is known of a stored value.
#[derive(Serialize, Deserialize)]
struct Record {
    key: Key,
    /// Files as seen from the graph's folder, where they lie in it.
    files: Vec<(PathBuf, Option<Key>)>,
    said: BTreeSet<(String, Remark)>,
}

impl Stored {
    /// The results of a program, of which every build has its own.
    pub fn new(store: Store, build: Key) -> Stored {
        Stored {
            store,
            build,
            is_told: AtomicBool::default(),
            is_large_told: AtomicBool::default(),
        }
    }

    /// The key of what is stored of a kind, under another key.
    fn of(&self, domain: &str, key: Key) -> Key {
        KeyHasher::new(domain).key(self.build).key(key).finish()
    }

    /// The bytes of a part of a node's work, and what the node said while it made them.
    pub(super) fn part(&self, key: Key, tell: &dyn Fn(&Remark)) -> Option<(Vec<u8>, Vec<Remark>)> {
        let said = self.read(self.of("stored words", key), tell)?;
        let said = serde_json::from_slice(&said).ok()?;
        Some((self.read(self.of("stored part", key), tell)?, said))
    }

    /// Takes the bytes of a part of a node's work away: they are not what they should be.
    pub(super) fn refuse(&self, key: Key) {
        // Whoever cannot remove it makes it anew every time.
        let _ = self.store.remove(self.of("stored part", key));
    }

    /// Stores a part of a node's work.
    pub(super) fn put_part(
        &self,
        key: Key,
        seconds: f64,
        (bytes, said): (&[u8], &[Remark]),
        tell: &dyn Fn(&Remark),
    ) {
        let Ok(said) = serde_json::to_vec(said) else { return };
        if self.write(self.of("stored part", key), seconds, bytes, tell) {
            self.write(self.of("stored words", key), seconds, &said, tell);
        }
    }

    /// The value of a recipe, and what it was made of.
    pub(super) fn value(
        &self,
        recipe: Key,
        packing: Packing,
        folder: &Path,
        tell: &dyn Fn(&Remark),
    ) -> Option<(AnyValue, Past)> {
        let record = self.read(self.of("stored record", recipe), tell)?;
        let record: Record = serde_json::from_slice(&record).ok()?;
        let files = record.files.into_iter().map(|(path, contents)| (folder.join(path), contents));
        let files: Files = files.collect();
        if files.iter().any(|(path, was)| open::contents(path) != *was) {
            return None;
        }
        let key = self.value_key(recipe, &files, folder);
        let bytes = self.read(key, tell)?;
        let Some(mut value) = (packing.unpack)(&bytes) else {
            let _ = self.store.remove(key);
            return None;
        };
        value.key = Some(record.key);
        Some((value, Past { files, said: record.said }))
    }

    /// Stores the value of a recipe.
    pub(super) fn put_value(
        &self,
        recipe: Key,
        (value, packing): (&AnyValue, Packing),
        (past, folder): (&Past, &Path),
        seconds: f64,
        tell: &dyn Fn(&Remark),
    ) {
        let (Some(bytes), Some(key)) = ((packing.pack)(value), value.key) else { return };
        let at = self.value_key(recipe, &past.files, folder);
        // What lay there was not found, or is damaged.
        let _ = self.store.remove(at);
        if !self.write(at, seconds, &bytes, tell) {
            return;
        }
        let seen = |path: &PathBuf| path.strip_prefix(folder).unwrap_or(path).to_owned();
        let files = past.files.iter().map(|(path, contents)| (seen(path), *contents)).collect();
        let record = Record { key, files, said: past.said.clone() };
        let Ok(record) = serde_json::to_vec(&record) else { return };
        let at = self.of("stored record", recipe);
        // An older one is of other files.
        if self.store.bytes(at).ok().flatten().is_some_and(|known| known != record) {
            let _ = self.store.remove(at);
        }
        self.write(at, seconds, &record, tell);
    }

    fn value_key(&self, recipe: Key, files: &Files, folder: &Path) -> Key {
        let mut key = KeyHasher::new("stored value");
        key.key(self.build).key(recipe);
        for (path, contents) in files {
            key.value(path.strip_prefix(folder).unwrap_or(path)).value(contents);
        }
        key.finish()
    }

    fn read(&self, key: Key, tell: &dyn Fn(&Remark)) -> Option<Vec<u8>> {
        self.store.bytes(key).unwrap_or_else(|error| {
            tell(&Remark::Warning(error.to_string()));
            None
        })
    }

    fn write(&self, key: Key, seconds: f64, bytes: &[u8], tell: &dyn Fn(&Remark)) -> bool {
        match self.store.put(key, seconds, |out| out.write_all(bytes)) {
            Ok(Put::TooLarge) => {
                if !self.is_large_told.swap(true, Ordering::Relaxed) {
                    let (megabytes, most) = (bytes.len() >> 20, self.store.largest() >> 20);
                    tell(&Remark::Note(format!(
                        "a result of {megabytes} MiB is not stored: of this cache's size the most is {most} MiB"
                    )));
                }
                false
            }
            Ok(Put::Stored | Put::Known) => true,
            Err(error) => {
                if !self.is_told.swap(true, Ordering::Relaxed) {
                    tell(&Remark::Warning(format!("{error}: nothing can be stored")));
                }
                false
            }
        }
    }
}
