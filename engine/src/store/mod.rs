//! Bytes under keys in a folder that many processes share, within a limit.
//!
//! ```
//! use spandrel_engine::key::Key;
//! use spandrel_engine::store::{Put, Store};
//! use std::io::Write;
//!
//! # let folder = std::env::temp_dir().join(format!("spandrel-store-example-{}", std::process::id()));
//! let store = Store::open(&folder, 1 << 30)?;
//! let key = Key::of_bytes(b"what the value is made of");
//! assert_eq!(store.bytes(key)?, None);
//! assert_eq!(store.put(key, 2.5, |out| out.write_all(b"the value"))?, Put::Stored);
//! assert_eq!(store.bytes(key)?, Some(b"the value".to_vec()));
//! # std::fs::remove_dir_all(folder).unwrap();
//! # Ok::<(), spandrel_engine::Error>(())
//! ```
//!
//! It knows keys and bytes, and nothing of values. Two objects with one key are interchangeable; the first stays.
//!
//! # The folder
//!
//! ```text
//! FOLDER/spandrel-cache        says that the folder is a cache; one that has other files and not this is refused
//! FOLDER/CACHEDIR.TAG          asks programs that make backups to leave the folder out
//! FOLDER/v1/objects/ab/ab..    the objects: the key's 32 digits, in a folder named by the first two
//! FOLDER/v1/tmp/               what is being written
//! FOLDER/v1/lock-0 to lock-f   held by whoever removes objects of a part
//! ```
//!
//! `v1` is the version of the format. Versions live side by side: each has its own limit and removes its own objects.
//! [`Store::clear`] clears all of them, as nothing else would remove those that no program reads any more.
//!
//! # What is always true
//!
//! - **No byte is given out unchecked.** An object is a header and blocks, each with a checksum that also holds the key
//!   and the block's number (`object.rs`). What fails is removed, and the error says so; to the caller it is a miss.
//! - **An object is whole or not there.** It is written to `tmp`, then renamed. What a killed process leaves in `tmp` is
//!   never read, and removed after a day.
//! - **Nothing waits.** There is one lock for each part, taken by whoever removes objects. Who does not get it goes on.
//!   The system releases it when a process dies.
//! - **Objects may vanish at any time**, by another process or by hand. That is a miss, never an error.
//! - Files are not flushed to the disk (fsync). What a power failure damages is found when it is read.
//!
//! # The limit
//!
//! A part is the objects of one first digit, and has a sixteenth of the limit, its *share*. A put looks at the part of
//! its key with a chance of 16 x bytes / share; the key's last digits decide, which are random. A look removes the worst
//! objects of the part until nine tenths of the share are left, if it was exceeded (`evict.rs`).
//!
//! So looks follow what all processes write together, however many they are and however short they live. (With
//! counters within processes, a thousand that each write little would never look.) Between two looks a part grows by a
//! sixteenth of its share on average. All parts together exceed the limit by less than a sixteenth of it on average, and
//! by more than a quarter with a chance below 10^-12. On top come, each until the next look at its part:
//!
//! - an object for each thread that is writing one, as a look comes after its put;
//! - what was put just as another process ended its look, or by one that was killed before its own;
//! - for a day, what killed processes left in `tmp`.
//!
//! Files count in blocks of 4096 bytes. An object greater than a share is not stored: it would be all of its part.
//! Opening a store looks at nothing; a lower limit takes hold part by part as objects are written.
//!
//! # Sharing
//!
//! Processes of several machines may share a folder, also on NFS. Clocks may differ by less than an hour without effect.
//! Users who share one need permissions (a umask of 002, say) by which each may write into the folders that others made.
//! Only a file's owner can note that it was used: an object that others use ages, is removed, and is made again.

mod evict;
mod folder;
mod object;
mod stats;

use std::io::ErrorKind;
use std::path::Path;

use crate::error::{Error, Result};
use crate::key::Key;
use folder::Folder;
pub use object::{Object, Writer};
pub use stats::{Holding, Stats};

/// A store of bytes under keys, in a folder.
#[derive(Debug)]
pub struct Store {
    folder: Folder,
    limit: u64,
}

/// What became of bytes that were to be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Put {
    /// They are stored.
    Stored,
    /// There is an object of this key already; nothing was written.
    Known,
    /// They are more than [`Store::largest`]; nothing is stored.
    TooLarge,
}

impl Store {
    /// Opens the store in a folder, with a limit in bytes for all processes together; makes the folder if it is not
    /// there. Nothing is stored with a limit of 0, and what is there can be read. A folder that cannot be written is no
    /// error as long as it is a cache.
    ///
    /// # Errors
    /// If the folder cannot be made or read, or has other files in it and is no cache.
    pub fn open(folder: &Path, limit: u64) -> Result<Store> {
        Ok(Store { folder: Folder::make(folder)?, limit })
    }

    /// How many objects the store of a folder has, and more about them. Reads the head of every object.
    ///
    /// # Errors
    /// If the folder is no cache, or cannot be read.
    pub fn stats(folder: &Path) -> Result<Stats> {
        stats::look(&Folder::known(folder)?)
    }

    /// Removes the objects of all versions of the store in a folder, and returns what was removed. What other processes
    /// are writing stays, and so does every file that is not the store's own.
    ///
    /// # Errors
    /// If the folder is no cache, or something in it cannot be removed; the rest is.
    pub fn clear(folder: &Path) -> Result<Holding> {
        stats::clear(&Folder::known(folder)?)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The most bytes on the disk that an object may take: a sixteenth of the limit.
    pub fn largest(&self) -> u64 {
        self.limit / 16
    }

    /// The object of a key, to be read; `None` if there is none. It counts as used now, to an hour.
    ///
    /// # Errors
    /// To the caller every error is a miss with a reason. [`Error::Malformed`]: the object is damaged, and was removed.
    /// [`Error::File`]: it cannot be read.
    pub fn get(&self, key: Key) -> Result<Option<Object>> {
        Object::open(self.folder.object(key), key)
    }

    /// The bytes of a key's object; `None` if there is none.
    ///
    /// # Errors
    /// As those of [`get`](Store::get).
    pub fn bytes(&self, key: Key) -> Result<Option<Vec<u8>>> {
        match self.get(key)?.map(Object::into_bytes).transpose() {
            // Network file systems remove files that another machine is reading.
            Err(Error::File { source, .. }) if is_gone(&source) => Ok(None),
            bytes => bytes,
        }
    }

    /// Stores bytes that took some seconds to make: `contents` writes them. If there is an object of the key, nothing is
    /// called or written.
    ///
    /// # Errors
    /// If they cannot be written, `contents` fails, or the limit cannot be kept because nothing can be removed. Nothing
    /// half written stays. The next put may fail likewise: on a full disk or in a folder that may only be read.
    pub fn put(
        &self,
        key: Key,
        seconds: f64,
        contents: impl FnOnce(&mut Writer) -> std::io::Result<()>,
    ) -> Result<Put> {
        let path = self.folder.object(key);
        let fault = |source: std::io::Error| Error::output(&path, source);
        match std::fs::symlink_metadata(&path) {
            Ok(about) if about.is_file() => return Ok(Put::Known),
            Ok(about) if about.is_dir() => {
                return Err(Error::output(&path, "a folder is in its place: remove it"));
            }
            // A link or a pipe is replaced.
            _ => {}
        }
        if on_disk(object::size(0)) > self.largest() {
            return Ok(Put::TooLarge);
        }
        let mut beside = self.folder.begin().map_err(fault)?;
        let file = beside.file.take().expect("a new file is open");
        let mut writer = Writer::new(file, key, self.largest()).map_err(fault)?;
        let written = contents(&mut writer);
        if writer.is_too_large() {
            return Ok(Put::TooLarge);
        }
        // The file is closed here: other machines see it whole, and some systems do not rename an open one.
        let size = written.and_then(|()| writer.finish(seconds)).map_err(fault)?;
        if !self.folder.place(&beside.path, &path).map_err(fault)? {
            return Ok(Put::Known);
        }
        if is_due(key, on_disk(size), self.largest()) {
            evict::keep_share(&self.folder, part_of(key), self.largest())?;
        }
        Ok(Put::Stored)
    }

    /// Removes the object of a key, such as one whose bytes nobody understands.
    ///
    /// # Errors
    /// If it cannot be removed.
    pub fn remove(&self, key: Key) -> Result<()> {
        removed(&self.folder.object(key)).map(drop)
    }
}

/// The part that a key belongs to: its first digit.
fn part_of(key: Key) -> u8 {
    key.to_bytes()[0] >> 4
}

/// Whether somebody who has written an object looks at its part: with a chance of 16 x bytes / share.
fn is_due(key: Key, size: u64, share: u64) -> bool {
    let [.., a, b, c, d, e, f, g, h] = key.to_bytes();
    let random = u64::from_be_bytes([a, b, c, d, e, f, g, h]);
    u128::from(random) * u128::from(share / 16) < u128::from(size) << 64
}

/// The bytes that a file takes on most disks.
fn on_disk(size: u64) -> u64 {
    size.checked_next_multiple_of(4096).unwrap_or(u64::MAX)
}

/// Whether an error says that a file is not there, or not any more.
fn is_gone(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::StaleNetworkFileHandle
    )
}

/// Removes a file. False if it was not there: another process may have been faster.
fn removed(path: &Path) -> Result<bool> {
    match std::fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(e) if is_gone(&e) => Ok(false),
        Err(e) => Err(Error::output(path, format!("it cannot be removed: {e}"))),
    }
}

#[cfg(test)]
mod tests;
