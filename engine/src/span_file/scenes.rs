//! The scenes behind the faces of a file: within it, where they were, or not there.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::block::{Block, BlockKind};
use super::head::{Head, SceneHead};
use crate::error::{Error, Result};
use crate::fragment::{Origin, Surfaces};
use crate::scene::SceneSurfaces;
use crate::scene::read::bundle;

/// A scene that a file names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SceneState {
    /// Where it is, or was.
    pub path: PathBuf,
    /// Whether the file holds it.
    pub embedded: bool,
    /// Why it is not there, if it is not.
    pub missing: Option<String>,
}

/// Where scenes are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Search<'p> {
    /// Nowhere.
    Nothing,
    /// Where they were and, by their names, in this folder.
    Also(Option<&'p Path>),
}

/// What is known of a source's surfaces.
pub(super) enum Found {
    Scene(Arc<dyn Surfaces>),
    Nothing(Option<Origin>, String),
}

/// A scene that somebody wants: its label, its place in the list, and the greatest number of a face that is
/// named in it.
pub(super) type Sought<'h> = (&'h str, Option<usize>, Option<u32>);

/// The surfaces of all scenes that are sought, and what became of the scenes of the list.
pub(super) fn find_surfaces(
    path: &Path,
    file: &mut File,
    blocks: &[Block],
    head: &Head,
    sought: &[Sought<'_>],
    search: Search<'_>,
) -> Result<(Vec<Found>, Vec<SceneState>)> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut contents: Vec<Option<Arc<[u8]>>> = vec![None; head.scenes.len()];
    for block in blocks.iter().filter(|block| block.kind == BlockKind::Scene) {
        let slot = contents.get_mut(block.a as usize);
        let slot = slot.ok_or_else(|| block.fault(path, "there is no such scene in the head"))?;
        *slot = Some(block.unpack(path, block.read(path, file)?)?.into());
    }
    let origin = |(scene, bytes): (&SceneHead, Option<Arc<[u8]>>)| {
        let mut origin = scene.origin(folder, bytes);
        if let Search::Also(Some(folder)) = search
            && let Some(name) = origin.file.file_name()
            && !origin.file.exists()
        {
            origin.file = folder.join(name);
        }
        origin
    };
    let origins: Vec<Origin> = head.scenes.iter().zip(contents).map(origin).collect();
    let mut states: Vec<SceneState> = origins
        .iter()
        .map(|origin| SceneState {
            path: origin.file.clone(),
            embedded: origin.contents.is_some(),
            missing: None,
        })
        .collect();
    type Read = Result<Arc<SceneSurfaces>, String>;
    let mut known: Vec<((usize, &str), Read)> = Vec::new();
    let mut found = Vec::new();
    for (label, found_in, last) in sought {
        let (label, last) = (*label, *last);
        let Some(at) = *found_in else {
            let why = format!("\"{label}\" was written without its scene");
            found.push(Found::Nothing(None, why));
            continue;
        };
        let origin = origins.get(at).ok_or_else(|| {
            Error::in_file(
                path,
                format!("the source \"{label}\" is of the scene {at}, which is not listed"),
            )
        })?;
        let scene = match known.iter().find(|(id, _)| *id == (at, label)) {
            Some((_, scene)) => scene.clone(),
            None => {
                let scene = match search {
                    Search::Also(_) => {
                        let scene = bundle::find(origin, label).map_err(|e| e.to_string());
                        scene.map(|scene| Arc::new(SceneSurfaces::new(Arc::new(scene))))
                    }
                    Search::Nothing => Err("scenes were not asked for".to_owned()),
                };
                known.push(((at, label), scene.clone()));
                scene
            }
        };
        let scene =
            scene.and_then(|scene| match last.is_none_or(|n| n < scene.scene().part_count()) {
                true => Ok(scene),
                false => {
                    let file = origin.file.display();
                    Err(format!("{file}: the scene has fewer faces than its spans name"))
                }
            });
        match scene {
            Ok(scene) => found.push(Found::Scene(scene)),
            Err(error) => {
                let why = format!("the scene of \"{label}\" cannot be used ({error})");
                if search != Search::Nothing {
                    states[at].missing = Some(error);
                }
                found.push(Found::Nothing(Some(origin.clone()), why));
            }
        }
    }
    Ok((found, states))
}
