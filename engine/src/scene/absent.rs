//! Files that give surfaces their colours, and are not there or cannot be read.

use std::path::Path;

use crate::error::{Error, Result};

/// What to do about a file that gives surfaces their colours, and cannot be read.
pub(super) const WITHOUT_PICTURES: &str =
    "put it there, or read the scene with `pictures: false`, which shows it without";

/// Whether a file is there that gives surfaces their colours; `whose` is what the error says of it.
///
/// # Errors
/// If it is not.
pub(super) fn is_there(path: &Path, whose: impl std::fmt::Display) -> Result<()> {
    std::fs::metadata(path).map(drop).map_err(|e| {
        let what = format!("{e} ({whose}): {WITHOUT_PICTURES}");
        Error::file(path, std::io::Error::new(e.kind(), what))
    })
}

/// The fault of a file that gives surfaces their colours, with what to do about it.
pub(super) fn without_pictures(error: Error) -> Error {
    match error.path() {
        Some(path) => Error::in_file(path, format!("{}: {WITHOUT_PICTURES}", error.message())),
        None => error,
    }
}
