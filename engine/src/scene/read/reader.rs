//! A file being read: what all readers share.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use super::super::document::Axis;
use crate::error::{Error, Result};
use crate::key::KeyHasher;
use crate::open;

/// A file being read: its bytes, those of files that it names, and remarks.
pub(super) struct Reader {
    pub(super) path: PathBuf,
    pub(super) key: KeyHasher,
    pub(super) notes: Vec<String>,
    pub(super) about: Vec<String>,
    pub(super) missing: Vec<(PathBuf, String)>,
    /// Whether what needs time is found too.
    pub(super) examines: bool,
    /// Whether it is told that surfaces do not look as they should.
    pub(super) wants_pictures: bool,
    /// Where the file has degrees, the origin on the plane that it is laid on.
    pub(super) degrees: Option<[f64; 3]>,
}

/// What a format says where the options do not.
pub(super) struct Space {
    pub(super) unit: f64,
    pub(super) up: Axis,
}

pub(super) const METRES: Space = Space { unit: 1.0, up: Axis::Y };

impl Reader {
    pub(super) fn new(path: &Path) -> Reader {
        Reader {
            path: path.to_owned(),
            key: KeyHasher::new("scene file"),
            notes: Vec::new(),
            about: Vec::new(),
            missing: Vec::new(),
            examines: false,
            wants_pictures: true,
            degrees: None,
        }
    }

    /// Reads a file and adds its contents to the key.
    pub(super) fn bytes(&mut self, path: &Path) -> Result<Vec<u8>> {
        let bytes = open::bytes(path)?;
        self.key.bytes(&bytes);
        Ok(bytes)
    }

    /// Bytes of the file as text; what is doubtful in it is noted.
    pub(super) fn text<'b>(&mut self, bytes: &'b [u8]) -> Result<Cow<'b, str>> {
        let open::Text { text, note } = open::text(&self.path, bytes)?;
        if let Some(note) = note {
            self.note(note);
        }
        Ok(text)
    }

    /// Reads a file that this one names, if there is one.
    pub(super) fn sibling(&mut self, name: &str) -> Result<(PathBuf, Vec<u8>)> {
        let path = self.path.parent().unwrap_or(Path::new("")).join(name);
        let bytes = self.bytes(&path)?;
        Ok((path, bytes))
    }

    /// Remarks on something doubtful.
    pub(super) fn note(&mut self, message: impl std::fmt::Display) {
        let note = format!("{}: {message}", self.path.display());
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    /// The file's name without its ending.
    pub(super) fn stem(&self) -> String {
        let name = self.path.file_name().and_then(|name| name.to_str()).unwrap_or("scene");
        name.split('.').next().unwrap_or(name).to_owned()
    }

    pub(super) fn fault(&self, message: impl Into<String>) -> Error {
        Error::in_file(&self.path, message)
    }
}

/// Something that is left out or changed: how often, and the first.
#[derive(Default)]
pub(super) struct LeftOut {
    count: usize,
    first: String,
}

impl LeftOut {
    pub(super) fn add(&mut self, which: impl FnOnce() -> String) {
        if self.count == 0 {
            self.first = which();
        }
        self.count += 1;
    }

    /// Remarks on it, if it happened.
    pub(super) fn tell(&self, reader: &mut Reader, what: &str) {
        if self.count > 0 {
            reader.note(format!("{} {what}; the first: {}", self.count, self.first));
        }
    }
}

/// Makes names of siblings unique by numbering those that repeat.
#[derive(Default)]
pub(super) struct Names {
    counts: HashMap<String, u32>,
    taken: HashSet<String>,
}

impl Names {
    pub(super) fn unique(&mut self, name: &str) -> String {
        let name = name.trim().replace('/', "_");
        let mut unique = name.clone();
        while !self.taken.insert(unique.clone()) {
            let count = self.counts.entry(name.clone()).or_insert(1);
            *count += 1;
            unique = format!("{name}#{count}");
        }
        unique
    }
}
