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

/// Whether a path stands for the standard output: its name is `-`, which may have an ending that says the
/// format, as in `-.png`.
pub fn is_standard(path: &Path) -> bool {
    path.file_stem().is_some_and(|stem| stem == "-")
}

/// Where a path leads: through links as far as there are files, the rest without detours. Paths of one file are
/// equal.
pub fn real(path: &Path) -> PathBuf {
    let path = followed(path).unwrap_or_else(|_| path.to_owned());
    let whole = std::path::absolute(&path).map_or(path, |whole| tidy(&whole));
    let mut missing = Vec::new();
    for known in whole.ancestors() {
        if let Ok(known) = std::fs::canonicalize(known) {
            return known.join(missing.iter().rev().collect::<PathBuf>());
        }
        missing.extend(known.file_name());
    }
    whole
}

/// A path as seen from a folder, if one leads to the other. It leads through links as far as there are files, so that
/// `..` in it means what it says.
pub fn relative(path: &Path, folder: &Path) -> PathBuf {
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let (path, folder) = (real(path), real(folder));
    let names = |path: &Path| -> Vec<PathBuf> {
        path.components().map(|part| PathBuf::from(part.as_os_str())).collect()
    };
    let (to, from) = (names(&path), names(&folder));
    let shared = to.iter().zip(&from).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return path;
    }
    let up = std::iter::repeat_n(PathBuf::from(".."), from.len() - shared);
    up.chain(to[shared..].iter().cloned()).collect()
}

/// What a path's links lead to at last, there or not.
fn followed(path: &Path) -> std::io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..40 {
        match std::fs::read_link(&path) {
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(std::io::Error::other("its links lead in a circle"))
}

/// Whether a name can be one of a file that is written: it is no folder, and it has nothing in it that another
/// program would have replaced, `~` or the number of a frame. A part of the path that is there is as it should be.
///
/// # Errors
/// What is wrong with it, and the cure.
pub fn check_name(path: &Path) -> Result<(), String> {
    if is_standard(path) {
        return Ok(());
    }
    if path.is_dir() {
        return Err("it is a folder: name a file in it".to_owned());
    }
    let mut at = PathBuf::new();
    for part in path.components() {
        at.push(part);
        let name = part.as_os_str().to_string_lossy();
        let is_there = std::fs::symlink_metadata(&at).is_ok();
        if is_there || !matches!(part, std::path::Component::Normal(_)) {
            continue;
        }
        if name.starts_with('~') && at != path {
            return Err(format!(
                "there is no folder `{name}`, which a shell replaces only where a word begins with it: write the \
                 whole path, or $HOME"
            ));
        }
        if let Some(place) = placeholder(&name) {
            return Err(format!(
                "nothing is put in place of `{place}`: write the name itself; a script that renders frames names \
                 the file of each"
            ));
        }
    }
    Ok(())
}

/// The first part of a name that other programs replace: `####`, `@@@@`, `%04d`, `{size}`, `<frame>`, `$F4`.
fn placeholder(name: &str) -> Option<&str> {
    let length = |c: char, rest: &str| -> Option<usize> {
        match c {
            '#' | '@' => Some(rest.find(|other| other != c).unwrap_or(rest.len())),
            '%' => {
                let digits = rest[1..].find(|c: char| !c.is_ascii_digit())?;
                let after = rest[1 + digits..].strip_prefix('d')?;
                (!after.starts_with(char::is_alphabetic)).then_some(digits + 2)
            }
            '$' => {
                let word = rest[1..].find(|c: char| !c.is_alphanumeric()).unwrap_or(rest.len() - 1);
                rest[1..].starts_with(char::is_alphabetic).then_some(1 + word)
            }
            '{' => rest.find('}').map(|end| end + 1),
            '<' => rest.find('>').map(|end| end + 1),
            _ => None,
        }
    };
    name.char_indices().find_map(|(at, c)| {
        let rest = &name[at..];
        length(c, rest).filter(|length| *length > 1).map(|length| &rest[..length])
    })
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
        let target = followed(path).map_err(|e| fault(&e))?;
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
struct Beside {
    path: PathBuf,
    file: Option<File>,
}

impl Beside {
    fn new(path: &Path) -> std::io::Result<Beside> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        // A long name would be too long with what is added to it.
        let name: String =
            path.file_name().unwrap_or_default().to_string_lossy().chars().take(40).collect();
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let hidden = format!(".{name}.{}-{number}.tmp", std::process::id());
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

    #[test]
    fn paths_are_seen_from_the_files_folder() {
        let seen = |path: &str, folder: &str| relative(Path::new(path), Path::new(folder));
        assert_eq!(seen("/a/b/c.ron", "/a/b"), Path::new("c.ron"));
        assert_eq!(seen("/a/b/c.ron", "/a/x/y"), Path::new("../../b/c.ron"));
        assert_eq!(seen("a/../c.ron", ""), Path::new("c.ron"));
    }

    #[test]
    fn names_have_nothing_that_would_be_replaced() {
        let folder = folder("names");
        std::fs::create_dir_all(folder.join("{here}")).unwrap();
        for (name, word) in [
            ("a.####.png", "`####`"),
            ("a.%04d.png", "`%04d`"),
            ("a.%d.png", "`%d`"),
            ("{size}/a.png", "`{size}`"),
            ("é{frame:04}.png", "`{frame:04}`"),
            ("a.<UDIM>.exr", "`<UDIM>`"),
            ("a.$F4.exr", "`$F4`"),
            ("~/a.png", "no folder `~`"),
            ("~me/a.png", "no folder `~me`"),
            ("{here}", "a folder"),
        ] {
            let said = check_name(&folder.join(name)).unwrap_err();
            assert!(said.contains(word), "{name}: {said}");
        }
        for name in [
            "a.png",
            "no.#1.png",
            "100%done.png",
            "é%.png",
            "{here}/a.png",
            "~.png",
            "$.png",
            "-.png",
        ] {
            assert_eq!(check_name(&folder.join(name)), Ok(()), "{name}");
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
