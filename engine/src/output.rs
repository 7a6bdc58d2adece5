//! Files that are whole or not there: written beside their place, then renamed into it.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::error::{Error, Result};

/// Files that are being written.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is being written: for a program that is told to end at once.
pub fn abandon() {
    for path in std::mem::take(&mut *unfinished()) {
        // Nothing more can be done about a file that cannot be removed.
        let _ = std::fs::remove_file(path);
    }
}

/// A path without the detours through `.` and `..` that can be left out unseen.
pub fn tidy(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut tidy = PathBuf::new();
    for part in path.components() {
        let into = matches!(tidy.components().next_back(), Some(Component::Normal(_)));
        match part {
            Component::CurDir => {}
            Component::ParentDir if into => {
                tidy.pop();
            }
            other => tidy.push(other),
        }
    }
    tidy
}

/// Writes a file: `contents` writes to a file beside it, which then takes its place. If anything
/// fails, the old file stays as it was. Returns the number of bytes.
///
/// # Errors
/// If the file cannot be written, or `contents` fails.
pub fn write(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<u64> {
    let fault = |source: std::io::Error| Error::output(path, source);
    let name = path.file_name().ok_or_else(|| Error::output(path, "this is no file's name"))?;
    let directory = path.parent().filter(|dir| !dir.as_os_str().is_empty());
    if let Some(directory) = directory {
        std::fs::create_dir_all(directory).map_err(|e| Error::output(directory, e))?;
    }
    let mut beside = Beside::new(path, name).map_err(fault)?;
    let mut writer = BufWriter::new(beside.file.take().expect("a new file is open"));
    contents(&mut writer)?;
    writer.flush().map_err(fault)?;
    let file = writer.into_inner().map_err(|e| fault(e.into_error()))?;
    let bytes = file.metadata().map_err(fault)?.len();
    drop(file);
    std::fs::rename(&beside.path, path).map_err(fault)?;
    Ok(bytes)
}

/// A file beside another; removed if it is not renamed.
struct Beside {
    path: PathBuf,
    file: Option<File>,
}

impl Beside {
    fn new(path: &Path, name: &std::ffi::OsStr) -> std::io::Result<Beside> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let mut hidden = std::ffi::OsString::from(".");
            hidden.push(name);
            hidden.push(format!(".{}-{number}.tmp", std::process::id()));
            let path = path.with_file_name(hidden);
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => {
                    unfinished().insert(path.clone());
                    return Ok(Beside { path, file: Some(file) });
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        // After renaming there is nothing to remove.
        let _ = std::fs::remove_file(&self.path);
        unfinished().remove(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("spandrel-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_failure_leaves_the_old_file_and_nothing_else() {
        let folder = folder("output");
        let path = folder.join("a.txt");
        let put = |text: &'static [u8]| {
            move |w: &mut BufWriter<File>| w.write_all(text).map_err(|e| Error::file("", e))
        };
        assert_eq!(write(&path, put(b"old")).unwrap(), 3);
        let failed = write(&path, |w| {
            put(b"half")(w)?;
            Err(Error::invalid("broken"))
        });
        assert!(failed.is_err());
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 1);
        std::fs::remove_dir_all(folder).unwrap();
    }
}
