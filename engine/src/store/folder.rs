//! Where the files of a store are, and whether a folder is one.

use std::fs::{DirEntry, File, Metadata};
use std::hash::{BuildHasher, Hasher};
use std::io::{ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

use super::is_gone;
use crate::error::{Error, Result};
use crate::key::Key;
use crate::output::Beside;

/// The version of the format.
pub(super) const VERSION: u64 = 1;

const MARK: &str = "spandrel-cache";
const MARK_TEXT: &str =
    "A cache of Spandrel. What is in it can be made again, and may be removed at any time.\n";

/// <https://bford.info/cachedir/>
const TAG: &str = "CACHEDIR.TAG";
const TAG_TEXT: &str = "Signature: 8a477f597d28d172789f06886806bc55\n# A cache of Spandrel.\n";

/// The folder of a store.
#[derive(Clone, Debug)]
pub(super) struct Folder {
    path: PathBuf,
    version: u64,
}

/// A file of the store.
#[derive(Debug)]
pub(super) struct Found {
    pub(super) path: PathBuf,
    pub(super) size: u64,
    pub(super) modified: SystemTime,
}

impl Folder {
    /// A folder that is a cache, or becomes one.
    pub(super) fn make(path: &Path) -> Result<Folder> {
        std::fs::create_dir_all(path).map_err(|e| match path.metadata() {
            Ok(about) if !about.is_dir() => Error::output(path, "it is a file: name a folder"),
            _ => Error::output(path, e),
        })?;
        if !is_marked(path)? {
            let mut others = std::fs::read_dir(path).map_err(|e| Error::file(path, e))?;
            // Where another process makes the same cache, the mark is there before all else.
            if others.next().is_some() && !is_marked(path)? {
                return Err(foreign(path, "name one that is empty or not there"));
            }
            mark(path)?;
        }
        Ok(Folder { path: path.to_owned(), version: VERSION })
    }

    /// A folder that is a cache.
    pub(super) fn known(path: &Path) -> Result<Folder> {
        std::fs::read_dir(path).map_err(|e| Error::file(path, e))?;
        if !is_marked(path)? {
            return Err(foreign(path, "name one that Spandrel has made"));
        }
        Ok(Folder { path: path.to_owned(), version: VERSION })
    }

    /// The same folder for the other versions of the format that have files in it.
    pub(super) fn other_versions(&self) -> Result<Vec<Folder>> {
        let entries = entries(&self.path)?;
        let versions = entries.iter().filter_map(|entry| {
            let name = entry.file_name();
            let version: u64 = name.to_str()?.strip_prefix('v')?.parse().ok()?;
            (name == *format!("v{version}") && version != VERSION).then_some(version)
        });
        Ok(versions.map(|version| Folder { path: self.path.clone(), version }).collect())
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    fn root(&self) -> PathBuf {
        self.path.join(format!("v{}", self.version))
    }

    /// The file of a key's object.
    pub(super) fn object(&self, key: Key) -> PathBuf {
        let name = format!("{key:?}");
        self.root().join("objects").join(&name[..2]).join(name)
    }

    fn unfinished_folder(&self) -> PathBuf {
        self.root().join("tmp")
    }

    /// The objects of a part.
    pub(super) fn objects(&self, part: u8) -> Result<Vec<Found>> {
        let mut objects = Vec::new();
        for digit in 0..16 {
            let start = format!("{part:x}{digit:x}");
            let is_own = |name: &str| {
                name.len() == 32 && name.starts_with(&start) && name.bytes().all(is_hexadecimal)
            };
            objects.extend(files(&self.root().join("objects").join(&start), is_own)?);
        }
        Ok(objects)
    }

    /// What is being written, or was when a process died.
    pub(super) fn unfinished(&self) -> Result<Vec<Found>> {
        // As `begin` names them.
        let is_own = |name: &str| {
            let process = name.strip_prefix('.').and_then(|name| name.get(..16));
            process.is_some_and(|process| process.bytes().all(is_hexadecimal))
                && name.ends_with(".tmp")
        };
        files(&self.unfinished_folder(), is_own)
    }

    /// The file that whoever removes objects of a part locks; for reading and writing, as network file systems demand.
    pub(super) fn lock(&self, part: u8) -> std::io::Result<File> {
        let mut options = File::options();
        options.read(true).write(true).create(true).truncate(false);
        options.open(self.root().join(format!("lock-{part:x}")))
    }

    /// A new file for an object.
    pub(super) fn begin(&self) -> std::io::Result<Beside> {
        // Processes on two machines, or in two containers, may have the same number.
        static PROCESS: OnceLock<u64> = OnceLock::new();
        let process = PROCESS.get_or_init(|| {
            let mut hasher = std::hash::RandomState::new().build_hasher();
            let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
            hasher.write_u128(now.unwrap_or_default().as_nanos());
            hasher.finish()
        });
        let folder = self.unfinished_folder();
        self.within(&folder, || Beside::new(&folder.join(format!("{process:016x}"))))
    }

    /// Renames a finished file to an object; false if there is one already.
    pub(super) fn place(&self, from: &Path, object: &Path) -> std::io::Result<bool> {
        // Somebody on another machine may be reading the one that is there.
        if std::fs::symlink_metadata(object).is_ok_and(|about| about.is_file()) {
            return Ok(false);
        }
        let folder = object.parent().expect("an object is in a folder");
        self.within(folder, || std::fs::rename(from, object))?;
        Ok(true)
    }

    /// Does something in a folder of the store that may have to be made. The store's own folder is not made again: it
    /// would lack its mark.
    fn within<T>(&self, folder: &Path, act: impl Fn() -> std::io::Result<T>) -> std::io::Result<T> {
        match act() {
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            done => return done,
        }
        let ancestors: Vec<&Path> =
            folder.ancestors().take_while(|folder| *folder != self.path).collect();
        for folder in ancestors.into_iter().rev() {
            match std::fs::create_dir(folder) {
                Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(e),
                _ => {}
            }
        }
        act()
    }
}

fn foreign(path: &Path, cure: &str) -> Error {
    Error::in_file(
        path,
        format!("this folder is no cache of Spandrel, which has a file {MARK}: {cure}"),
    )
}

/// Whether a folder has the mark of a cache. One that is not whole counts: another process may be writing it.
fn is_marked(folder: &Path) -> Result<bool> {
    let path = folder.join(MARK);
    match path.symlink_metadata() {
        Ok(about) if about.is_file() => {}
        Err(e) if !is_gone(&e) => return Err(Error::file(path, e)),
        _ => return Ok(false),
    }
    let mut text = Vec::new();
    let file = File::open(&path).map_err(|e| Error::file(&path, e))?;
    file.take(4096).read_to_end(&mut text).map_err(|e| Error::file(&path, e))?;
    Ok(MARK_TEXT.as_bytes().starts_with(&text))
}

/// Makes a folder a cache.
fn mark(folder: &Path) -> Result<()> {
    let written = |name: &str, text: &str| {
        let mut file = File::options().write(true).create_new(true).open(folder.join(name))?;
        file.write_all(text.as_bytes())
    };
    match written(MARK, MARK_TEXT) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(Error::output(folder, e)),
        _ => {}
    }
    // Programs that make backups can do without.
    let _ = written(TAG, TAG_TEXT);
    Ok(())
}

fn is_hexadecimal(digit: u8) -> bool {
    matches!(digit, b'0'..=b'9' | b'a'..=b'f')
}

/// What is in a folder; nothing if it is not there.
fn entries(folder: &Path) -> Result<Vec<DirEntry>> {
    match std::fs::read_dir(folder).and_then(Iterator::collect) {
        Err(e) if is_gone(&e) => Ok(Vec::new()),
        entries => entries.map_err(|e| Error::file(folder, e)),
    }
}

/// The files of a folder whose names are the store's own. Links, folders and pipes are not among them.
fn files(folder: &Path, is_own: impl Fn(&str) -> bool) -> Result<Vec<Found>> {
    let mut files = Vec::new();
    for entry in entries(folder)? {
        if !entry.file_name().to_str().is_some_and(&is_own) {
            continue;
        }
        let path = entry.path();
        // Unlike what the path leads to, this is of a link itself.
        match entry.metadata() {
            Ok(about) if about.is_file() => files.push(found(path, &about)),
            Err(e) if !is_gone(&e) => return Err(Error::file(path, e)),
            _ => {}
        }
    }
    Ok(files)
}

fn found(path: PathBuf, about: &Metadata) -> Found {
    // A system without such times has objects of one age.
    let modified = about.modified().unwrap_or(SystemTime::UNIX_EPOCH);
    Found { path, size: about.len(), modified }
}
