//! Real files that nobody here made: scenes, photographs, damaged files. They are no part of the
//! project; tests that need them skip, and say so, where they are absent.

use std::io::Write;
use std::path::{Path, PathBuf};

/// The folder of real data: `SPANDREL_DATA`, or `../shared/data` beside the repository.
pub fn folder() -> Option<PathBuf> {
    let repository = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let folder = std::env::var_os("SPANDREL_DATA")
        .map_or_else(|| repository.join("../shared/data"), PathBuf::from);
    folder.is_dir().then(|| folder.canonicalize().unwrap_or(folder))
}

/// A file or folder of the real data; `None`, with a line on the standard error, if it is absent.
pub fn find(name: &str) -> Option<PathBuf> {
    let found = folder().map(|folder| folder.join(name)).filter(|path| path.exists());
    if found.is_none() {
        // Not `eprintln!`, which tests that pass swallow.
        let line = format!("SKIPPED: no real data at {name} (set SPANDREL_DATA to the folder)\n");
        std::io::stderr().write_all(line.as_bytes()).ok();
    }
    found
}

/// All files below a folder with one of some endings, sorted.
pub fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            let name = path.to_string_lossy().to_lowercase();
            if path.is_dir() {
                open.push(path);
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}
