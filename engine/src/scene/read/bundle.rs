//! Scenes found again, and scenes with all files that they name in one run of bytes: what a span file
//! knows of the scenes behind its faces.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::super::document::{Document, VERSION};
use super::super::library::{Placed, ReadOptions, Reading};
use super::library;
use crate::error::{Error, Result};
use crate::fragment::Origin;
use crate::key::Key;
use crate::scene::Scene;

/// How a scene was read.
#[derive(Default, Serialize, Deserialize)]
#[serde(default)]
struct How {
    plan: Option<String>,
    #[serde(flatten)]
    options: ReadOptions,
}

/// A scene's document and those that it names.
#[derive(Serialize, Deserialize)]
struct Bundle {
    version: u32,
    directory: PathBuf,
    key: Key,
    document: Document,
    files: Vec<(PathBuf, String, Key, Document)>,
    /// Libraries of materials that could not be read, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    missing: Vec<(PathBuf, String)>,
}

/// Where a scene comes from.
pub(super) fn origin(path: &Path, plan: Option<&str>, options: &ReadOptions, key: Key) -> Origin {
    let how = How { plan: plan.map(str::to_owned), options: options.clone() };
    let how = serde_json::to_value(how).unwrap_or_default();
    Origin { file: path.to_owned(), how, key, contents: None }
}

/// A scene where it comes from: from the contents that came with it or, without, from its file.
///
/// # Errors
/// If it cannot be read, or is not what it was.
pub fn find(origin: &Origin, label: &str) -> Result<Scene> {
    let how = how(origin)?;
    let mut scene = match &origin.contents {
        None => {
            // A pipe or a device named by a file would be waited for.
            let about =
                std::fs::metadata(&origin.file).map_err(|e| Error::file(&origin.file, e))?;
            if !about.is_file() {
                return Err(Error::in_file(&origin.file, "it is no file"));
            }
            super::scene(&origin.file, how.plan.as_deref(), label, &how.options)?
        }
        Some(contents) => unpack(origin, contents, &how, label)?,
    };
    if scene.key != origin.key {
        return Err(Error::in_file(
            &origin.file,
            "the scene is not what it was when its spans were written",
        ));
    }
    scene.origin = Some(origin.clone());
    Ok(scene)
}

/// The contents of a scene's files as one run of bytes.
///
/// # Errors
/// If they cannot be read, or are not what they were.
pub fn pack(origin: &Origin) -> Result<Arc<[u8]>> {
    if let Some(contents) = &origin.contents {
        return Ok(contents.clone());
    }
    let How { plan, options } = how(origin)?;
    let reading = super::document(&origin.file, &options)?;
    let directory = origin.file.parent().unwrap_or(Path::new(""));
    let (plan, document) = (plan.as_deref(), &reading.document);
    let (scene, files) = Scene::with_files(
        document,
        plan,
        "",
        reading.key,
        (directory, &library()),
        BTreeMap::new(),
    )?;
    if scene.key != origin.key {
        return Err(Error::in_file(&origin.file, "the scene has changed since it was rendered"));
    }
    let files = files
        .into_iter()
        .map(|((path, how), reading)| (path, how, reading.key, Document::clone(&reading.document)));
    let bundle = Bundle {
        version: VERSION,
        directory: directory.to_owned(),
        key: reading.key,
        document: Document::clone(document),
        files: files.collect(),
        missing: reading.missing.into_iter().chain(scene.missing).collect(),
    };
    let bytes = rmp_serde::to_vec_named(&bundle)
        .map_err(|e| Error::in_file(&origin.file, e.to_string()))?;
    Ok(bytes.into())
}

fn unpack(origin: &Origin, contents: &[u8], how: &How, label: &str) -> Result<Scene> {
    let fault =
        |message: String| Error::in_file(&origin.file, format!("the scene within: {message}"));
    let bundle: Bundle = rmp_serde::from_slice(contents).map_err(|e| fault(e.to_string()))?;
    if bundle.version != VERSION {
        let version = bundle.version;
        return Err(fault(format!("scene version {version}: this program reads {VERSION}")));
    }
    let file = |(path, how, key, document): (PathBuf, String, Key, Document)| {
        let document = Arc::new(document);
        let (notes, about, missing) = (Vec::new(), Vec::new(), Vec::new());
        ((path, how), Reading { document, key, notes, about, missing, placed: Placed::Same })
    };
    let files = bundle.files.into_iter().map(file).collect();
    let Bundle { document, directory, key, missing, .. } = bundle;
    let plan = how.plan.as_deref();
    let scene = Scene::with_files(&document, plan, label, key, (&directory, &library()), files);
    let (mut scene, _) = scene.map_err(|error| fault(error.to_string()))?;
    scene.missing = missing;
    how.options.apply(&mut scene).map_err(fault)?;
    Ok(scene)
}

fn how(origin: &Origin) -> Result<How> {
    let how = serde_json::from_value(origin.how.clone());
    how.map_err(|e| Error::in_file(&origin.file, format!("how it was read is not understood: {e}")))
}
