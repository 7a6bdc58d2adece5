//! What can go wrong, with the place and the cure.

use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use crate::text::Faults;

/// The engine's errors. Every one names what was wrong and, where a file is to blame, the file and
/// the place in it; the cure is part of the message.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A file cannot be opened or read.
    #[error("{}: {source}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error("{}: cannot be written: {message}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why, and the cure.
        message: String,
    },
    /// A file's contents are not what its format demands.
    #[error("{place}: {message}")]
    Malformed {
        /// Where.
        place: FilePlace,
        /// What is wrong, and the cure.
        message: String,
    },
    /// A text of the project's own is wrong, at one place or more.
    #[error("{0}")]
    Text(Box<Faults>),
    /// A value is outside its range or contradicts another.
    #[error("{0}")]
    Invalid(String),
    /// Two span images cannot meet in one merge.
    #[error("these images cannot be merged: {what} differs, {left} against {right}")]
    Mismatch {
        /// The property that differs, such as "the line plan".
        what: &'static str,
        /// Its value in the first image.
        left: String,
        /// Its value in the other image.
        right: String,
    },
    /// The user asked to stop.
    #[error("stopped on request")]
    Cancelled,
}

/// A result with the engine's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// A file cannot be opened or read.
    pub fn file(path: impl Into<PathBuf>, source: std::io::Error) -> Error {
        Error::File { path: path.into(), source }
    }

    /// A file cannot be written.
    pub fn output(path: impl Into<PathBuf>, message: impl fmt::Display) -> Error {
        Error::Output { path: path.into(), message: message.to_string() }
    }

    /// A fault in a file as a whole.
    pub fn in_file(path: impl Into<PathBuf>, message: impl Into<String>) -> Error {
        let place = FilePlace { path: path.into(), position: Position::Whole };
        Error::Malformed { place, message: message.into() }
    }

    /// A fault in a text file; line and column count from 1, the column in characters.
    pub fn at_line(
        path: impl Into<PathBuf>,
        line: usize,
        column: usize,
        message: impl Into<String>,
    ) -> Error {
        let place = FilePlace { path: path.into(), position: Position::Line { line, column } };
        Error::Malformed { place, message: message.into() }
    }

    /// A fault in a binary file.
    pub fn at_byte(path: impl Into<PathBuf>, byte: u64, message: impl Into<String>) -> Error {
        let place = FilePlace { path: path.into(), position: Position::Byte(byte) };
        Error::Malformed { place, message: message.into() }
    }

    /// A value outside its range.
    pub fn invalid(message: impl Into<String>) -> Error {
        Error::Invalid(message.into())
    }

    /// What is wrong, without the place.
    pub fn message(&self) -> String {
        match self {
            Error::Malformed { message, .. } | Error::Output { message, .. } => message.clone(),
            Error::File { source, .. } => source.to_string(),
            Error::Text(faults) => faults.in_short(),
            other => other.to_string(),
        }
    }

    /// The file that is to blame, if one is.
    pub fn path(&self) -> Option<&Path> {
        match self {
            Error::File { path, .. } | Error::Output { path, .. } => Some(path),
            Error::Malformed { place, .. } => Some(&place.path),
            Error::Text(faults) => Some(&faults.path),
            _ => None,
        }
    }
}

/// The first error of many threads, for who asks later: the rest say the same.
#[derive(Debug, Default)]
pub struct FirstError(Mutex<Option<Error>>);

impl FirstError {
    /// Keeps an error, if there is none yet.
    pub fn keep(&self, error: Error) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }

    /// The value, or nothing: then the error is kept.
    pub fn sift<T>(&self, result: Result<T>) -> Option<T> {
        result.map_err(|error| self.keep(error)).ok()
    }

    /// The first error since the last time.
    pub fn take(&self) -> Option<Error> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// A place in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilePlace {
    /// The file.
    pub path: PathBuf,
    /// Where in it.
    pub position: Position,
}

/// Where in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Position {
    /// Nowhere in particular.
    Whole,
    /// A place in a text, counted from 1, the column in characters.
    Line {
        /// The line.
        line: usize,
        /// The column.
        column: usize,
    },
    /// A byte offset from the start of the file.
    Byte(u64),
}

impl fmt::Display for FilePlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        match self.position {
            Position::Whole => Ok(()),
            Position::Line { line, column } => write!(f, ":{line}:{column}"),
            Position::Byte(byte) => write!(f, ": byte {byte}"),
        }
    }
}
