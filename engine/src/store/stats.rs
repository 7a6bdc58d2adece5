//! What a store holds; and removing all of it.

use std::fs::File;
use std::time::{Duration, SystemTime};

use super::evict::{remove, unfinished};
use super::folder::{Folder, Found};
use super::object::Header;
use super::on_disk;
use crate::error::Result;

/// What is being written when a store is cleared was written to within this time.
const IN_WORK: Duration = Duration::from_secs(3600);

/// Objects of a store, counted.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Holding {
    /// How many there are.
    pub objects: u64,
    /// The bytes that they take on the disk.
    pub bytes: u64,
    /// The seconds that they took to make.
    pub seconds: f64,
    /// When the one was used that was not for longest, to an hour.
    pub oldest: Option<SystemTime>,
    /// When one was used last, to an hour.
    pub newest: Option<SystemTime>,
}

/// What a store holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stats {
    /// Objects by the first digit of their keys.
    pub parts: [Holding; 16],
    /// What is being written, or was when a process died.
    pub unfinished: Holding,
    /// Objects of other versions of the format. What they took to make is not known.
    pub other_versions: Holding,
}

impl Stats {
    /// All objects that can be read.
    pub fn all(&self) -> Holding {
        let mut all = Holding::default();
        self.parts.iter().for_each(|part| all.join(part));
        all
    }
}

impl Holding {
    fn add(&mut self, file: &Found, seconds: f64) {
        let used = Some(file.modified);
        let bytes = on_disk(file.size);
        self.join(&Holding { objects: 1, bytes, seconds, oldest: used, newest: used });
    }

    fn join(&mut self, other: &Holding) {
        self.objects += other.objects;
        self.bytes = self.bytes.saturating_add(other.bytes);
        self.seconds += other.seconds;
        self.oldest = [self.oldest, other.oldest].into_iter().flatten().min();
        self.newest = self.newest.max(other.newest);
    }
}

pub(super) fn look(folder: &Folder) -> Result<Stats> {
    let mut stats = Stats::default();
    for (part, holding) in (0..).zip(&mut stats.parts) {
        for file in folder.objects(part)? {
            let head = File::open(&file.path).and_then(|mut f| Header::read(&mut f, file.size));
            // A damaged one takes its bytes until it is asked for.
            let seconds = head.ok().and_then(Result::ok).map_or(0.0, |head| head.seconds);
            holding.add(&file, seconds);
        }
    }
    for file in folder.unfinished()? {
        stats.unfinished.add(&file, 0.0);
    }
    for other in folder.other_versions()? {
        for part in 0..16 {
            for file in other.objects(part)? {
                stats.other_versions.add(&file, 0.0);
            }
        }
    }
    Ok(stats)
}

pub(super) fn clear(folder: &Folder) -> Result<Holding> {
    let mut files = Vec::new();
    for version in [folder.clone()].into_iter().chain(folder.other_versions()?) {
        files.extend(unfinished(&version, IN_WORK)?);
        for part in 0..16 {
            files.extend(version.objects(part)?);
        }
    }
    let (gone, failure) = remove(files);
    let mut cleared = Holding::default();
    gone.iter().for_each(|file| cleared.add(file, 0.0));
    failure.map_or(Ok(cleared), Err)
}
