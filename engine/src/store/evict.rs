//! What is removed when a part has more than its share.
//!
//! As in *GreedyDual-Size* (Cao and Irani 1997), which the cache in memory follows (`../cache.rs`), an object is worth
//! the seconds per byte that it took to make. There a level rises with what is dropped, and older entries sink below it.
//! Processes that share no memory have no such level. So worth is divided by age instead:
//!
//! ```text
//! worth = seconds to make / (bytes on the disk x (hours since the last use + 1))
//! ```
//!
//! What took twice as long to make may be unused for twice as long. The hour is that within which uses are not noted.

use std::fs::{File, TryLockError};
use std::time::{Duration, SystemTime};

use super::folder::{Folder, Found};
use super::object::Header;
use super::{is_gone, on_disk, removed};
use crate::error::{Error, Result};

/// The age at which a file that is being written has lost its process.
const STALE: Duration = Duration::from_secs(24 * 3600);

/// How often a part is looked at again, if others go on filling it.
const ROUNDS: usize = 4;

/// Removes the worst objects of a part that has more bytes than its share. Does nothing if another process is at it.
///
/// # Errors
/// If the part cannot be read, or stays too large because objects cannot be removed.
pub(super) fn keep_share(folder: &Folder, part: u8, share: u64) -> Result<()> {
    let lock = match folder.lock(part) {
        // All was removed by hand.
        Err(e) if is_gone(&e) => return Ok(()),
        lock => lock.map_err(|e| Error::output(folder.path(), e))?,
    };
    match lock.try_lock() {
        Err(TryLockError::WouldBlock) => return Ok(()),
        // Some network file systems have no locks. Two that remove the same objects do no harm.
        Ok(()) | Err(TryLockError::Error(_)) => {}
    }
    // What another user has left is no matter.
    let _ = remove(unfinished(folder, STALE)?);
    // Whoever wrote meanwhile did not get the lock: the last look is after that.
    for _ in 0..ROUNDS {
        let objects = folder.objects(part)?;
        let sizes = objects.iter().map(|object| on_disk(object.size));
        let bytes = sizes.fold(0, u64::saturating_add);
        if bytes <= share {
            break;
        }
        remove_worst(objects, bytes, share)?;
    }
    Ok(())
}

/// Removes objects of a part that has so many bytes until nine tenths of its share are left.
fn remove_worst(objects: Vec<Found>, mut bytes: u64, share: u64) -> Result<()> {
    let now = SystemTime::now();
    let mut by_worth: Vec<(f64, Found)> =
        objects.into_iter().map(|object| (worth_of(&object, now), object)).collect();
    by_worth.sort_by(|(a, one), (b, other)| {
        a.total_cmp(b).then_with(|| one.modified.cmp(&other.modified))
    });
    let mut failure = None;
    for (_, object) in by_worth {
        if bytes <= share - share / 10 {
            break;
        }
        match removed(&object.path) {
            Ok(_) => bytes = bytes.saturating_sub(on_disk(object.size)),
            Err(e) => drop(failure.get_or_insert(e)),
        }
    }
    // Where some may not be removed, others make room.
    if bytes > share { failure.map_or(Ok(()), Err) } else { Ok(()) }
}

/// What an object is worth; less than nothing if its head is damaged.
fn worth_of(object: &Found, now: SystemTime) -> f64 {
    let head = File::open(&object.path).and_then(|mut file| Header::read(&mut file, object.size));
    match head {
        Ok(Ok(head)) => worth(head.seconds, on_disk(object.size), apart(now, object.modified)),
        Ok(Err(_)) => -1.0,
        // Gone, or not to be read by this user: then it is of no use here.
        Err(_) => 0.0,
    }
}

/// What an object is worth that took so many seconds to make, has so many bytes, and was used so long ago.
pub(super) fn worth(seconds: f64, bytes: u64, age: Duration) -> f64 {
    seconds / (bytes as f64 * (age.as_secs_f64() / 3600.0 + 1.0))
}

/// The time between two moments. Clocks of machines differ: what was used in the future was not used lately either.
pub(super) fn apart(a: SystemTime, b: SystemTime) -> Duration {
    a.duration_since(b).unwrap_or_else(|earlier| earlier.duration())
}

/// What is being written, but nobody has written to for some time.
pub(super) fn unfinished(folder: &Folder, age: Duration) -> Result<Vec<Found>> {
    let now = SystemTime::now();
    let mut files = folder.unfinished()?;
    files.retain(|file| now.duration_since(file.modified).is_ok_and(|since| since > age));
    Ok(files)
}

/// Removes files, and returns those that it removed and the first failure.
pub(super) fn remove(files: Vec<Found>) -> (Vec<Found>, Option<Error>) {
    let mut failure = None;
    let mut gone = files;
    gone.retain(|file| {
        removed(&file.path).unwrap_or_else(|error| {
            failure.get_or_insert(error);
            false
        })
    });
    (gone, failure)
}
