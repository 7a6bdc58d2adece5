//! Files that are whole or not there: written beside their place, then renamed into it.

use std::collections::BTreeSet;
use std::fs::{File, OpenOptions};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

mod paths;

use crate::error::{Error, Result};
pub use paths::{check_name, is_standard, real, relative, tidy};

/// Files that are being written.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Files that were read and may not be replaced; `None` if nobody asked for that.
static KEPT: Mutex<Option<BTreeSet<PathBuf>>> = Mutex::new(None);

fn kept() -> MutexGuard<'static, Option<BTreeSet<PathBuf>>> {
    KEPT.lock().unwrap_or_else(PoisonError::into_inner)
}

/// From now on no file is replaced that this process has read: for a program that makes pictures from other files and
/// then ends.
pub fn keep_inputs() {
    kept().get_or_insert_default();
}

/// Remembers that a file was read.
pub(crate) fn keep(path: &Path) {
    if let Some(kept) = kept().as_mut() {
        kept.insert(real(path));
    }
}

/// Removes what is being written: for a program that is told to end at once.
pub fn abandon() {
    for path in std::mem::take(&mut *unfinished()) {
        // Nothing more can be done about a file that cannot be removed.
        let _ = std::fs::remove_file(path);
    }
}

/// Whether a file can be written, as far as can be told before there is anything to write: makes its folder, and a
/// file beside it that it removes again.
///
/// # Errors
/// If it cannot.
pub fn check(path: &Path) -> Result<()> {
    check_name(path).map_err(|message| Error::output(path, message))?;
    if !is_standard(path) {
        let Target { path: target, is_device } = Target::of(path)?;
        if !is_device {
            Beside::new(&target).map_err(|e| Error::output(path, e))?;
        }
    }
    Ok(())
}

/// Writes a file: `contents` writes to a file beside it, which then takes its place. If anything
/// fails, the old file stays as it was. Where a link stands, what it leads to is replaced, and the link stays. What
/// is no file, such as a device, a pipe or the [standard output](is_standard), gets the contents when they are whole.
/// Returns the number of bytes.
///
/// # Errors
/// If the file cannot be written, or `contents` fails.
pub fn write(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<u64> {
    let fault = |source: std::io::Error| Error::output(path, source);
    if is_standard(path) {
        return pass_on(path, contents, &mut std::io::stdout().lock());
    }
    let target = Target::of(path)?;
    if kept().as_ref().is_some_and(|kept| kept.contains(&real(&target.path))) {
        return Err(Error::output(path, "it is one of the files that were read: name another"));
    }
    if target.is_device {
        let mut device = OpenOptions::new().write(true).open(&target.path).map_err(fault)?;
        return pass_on(path, contents, &mut device);
    }
    let mut beside = Beside::new(&target.path).map_err(fault)?;
    let file = filled(path, &mut beside, contents)?;
    let about = file.metadata().map_err(fault)?;
    // Systems that write late, or far away, tell only now that there is no room.
    match file.sync_all() {
        Err(e) if e.kind() != std::io::ErrorKind::Unsupported => return Err(fault(e)),
        _ => {}
    }
    if let Ok(old) = std::fs::metadata(&target.path) {
        // Some file systems have no permissions to set.
        let _ = file.set_permissions(old.permissions());
    }
    // Some systems do not rename an open file.
    drop(file);
    std::fs::rename(&beside.path, &target.path).map_err(fault)?;
    Ok(about.len())
}

/// Writes to a new file, and returns it.
fn filled(
    path: &Path,
    beside: &mut Beside,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> Result<File> {
    let fault = |source: std::io::Error| Error::output(path, source);
    let mut writer = BufWriter::new(beside.file.take().expect("a new file is open"));
    contents(&mut writer)?;
    writer.flush().map_err(fault)?;
    writer.into_inner().map_err(|e| fault(e.into_error()))
}

/// Writes to a file that nobody sees, and when it is whole to where it should go: formats are written with jumps back
/// and forth, which no pipe allows.
fn pass_on(
    path: &Path,
    contents: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
    out: &mut dyn Write,
) -> Result<u64> {
    let fault = |source: std::io::Error| Error::output(path, source);
    let folder = std::env::temp_dir();
    let mut hidden =
        Beside::new(&folder.join("spandrel")).map_err(|e| Error::output(&folder, e))?;
    filled(path, &mut hidden, contents)?;
    let mut file = File::open(&hidden.path).map_err(fault)?;
    let bytes = std::io::copy(&mut file, out).map_err(fault)?;
    out.flush().map_err(fault)?;
    Ok(bytes)
}

/// What is written to in the end.
struct Target {
    path: PathBuf,
    /// It is there, and no file.
    is_device: bool,
}

impl Target {
    /// What a path leads to. Its folder is made.
    fn of(path: &Path) -> Result<Target> {
        let fault = |message: &dyn std::fmt::Display| Error::output(path, message);
        if path.file_name().is_none() {
            return Err(fault(&"this is no file's name"));
        }
        let target = paths::followed(path).map_err(|e| fault(&e))?;
        match std::fs::metadata(&target) {
            Ok(about) if about.is_dir() => Err(fault(&"it is a folder: name a file in it")),
            Ok(about) if about.is_file() && about.permissions().readonly() => {
                Err(fault(&"the file is there and may not be changed (read-only)"))
            }
            Ok(about) => Ok(Target { path: target, is_device: !about.is_file() }),
            Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(fault(&e)),
            Err(_) => {
                let folder = target.parent().filter(|folder| !folder.as_os_str().is_empty());
                if let Some(folder) = folder {
                    std::fs::create_dir_all(folder).map_err(|e| Error::output(folder, e))?;
                }
                Ok(Target { path: target, is_device: false })
            }
        }
    }
}

/// A file beside another; removed if it is not renamed.
#[derive(Debug)]
pub(crate) struct Beside {
    pub(crate) path: PathBuf,
    pub(crate) file: Option<File>,
}

impl Beside {
    /// A new file in the folder of a path, with a hidden name.
    pub(crate) fn new(path: &Path) -> std::io::Result<Beside> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // A long name would be too long with what is added to it.
        let name: String =
            path.file_name().unwrap_or_default().to_string_lossy().chars().take(40).collect();
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let hidden = format!(".{name}.{}-{number}.tmp", std::process::id());
            let path = path.with_file_name(hidden);
            // Never a file that is there: another process may be writing it.
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

    #[cfg(unix)]
    #[test]
    fn a_link_stays_and_what_it_leads_to_is_replaced() {
        let folder = folder("links");
        let put = |w: &mut BufWriter<File>| w.write_all(b"new").map_err(|e| Error::file("", e));
        std::fs::write(folder.join("real"), "old").unwrap();
        let link = |to: &str, name: &str| {
            std::os::unix::fs::symlink(to, folder.join(name)).unwrap();
            folder.join(name)
        };
        let (near, far, open) =
            (link("real", "near"), link("near", "far"), link("deep/lost", "open"));
        write(&far, put).unwrap();
        write(&open, put).unwrap();
        assert!([&near, &far, &open].iter().all(|link| link.is_symlink()));
        assert_eq!(std::fs::read(folder.join("real")).unwrap(), b"new");
        assert_eq!(std::fs::read(folder.join("deep/lost")).unwrap(), b"new");
        let circle = link("circle", "circle");
        assert!(write(&circle, put).unwrap_err().to_string().contains("circle"));
        // A device gets what is whole, and its failure is one; it is not replaced.
        let full = link("/dev/full", "full");
        assert!(write(&full, put).is_err());
        assert!(std::fs::metadata("/dev/full").is_ok_and(|about| !about.is_file()));
        assert_eq!(write(&link("/dev/null", "null"), put).unwrap(), 3);
        assert_eq!(real(&far), real(&folder.join("no/../real")));
        assert_eq!(real(&open), real(&folder.join("deep/lost")));
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_may_not_be_changed_stays_and_long_names_are_names() {
        let folder = folder("kept");
        let put = |w: &mut BufWriter<File>| w.write_all(b"new").map_err(|e| Error::file("", e));
        let path = folder.join("a");
        std::fs::write(&path, "old").unwrap();
        let mut permissions = std::fs::metadata(&path).unwrap().permissions();
        permissions.set_readonly(true);
        std::fs::set_permissions(&path, permissions).unwrap();
        assert!(write(&path, put).unwrap_err().to_string().contains("read-only"));
        assert_eq!(std::fs::read(&path).unwrap(), b"old");
        // 255 bytes are what most systems allow.
        let long = folder.join("ü".repeat(127));
        assert_eq!(write(&long, put).unwrap(), 3);
        assert!(write(&folder.join("x".repeat(300)), put).is_err());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
