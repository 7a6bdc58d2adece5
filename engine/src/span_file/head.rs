//! What a file is of.

use serde::{Deserialize, Serialize};
use std::path::Path;

use crate::camera::{Camera, Plane, View};
use crate::error::Result;
use crate::fragment::{Member, Origin, Surfaces};
use crate::key::Key;
use crate::output::relative;
use crate::raster::{LinePlan, Phase, Raster, Rows};
use crate::span::{Held, Source, SpanImage, Stage};

/// The first block, as JSON.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Head {
    /// The program that wrote the file.
    pub(super) writer: String,
    pub(super) camera: Camera,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) lines_per_row: u32,
    pub(super) phase: Phase,
    /// First row, and the row after the last.
    pub(super) rows: [u32; 2],
    /// Planes that cut faces by depth, each as a, b and c.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) limits: Vec<[f64; 3]>,
    #[serde(default)]
    pub(super) scenes: Vec<SceneHead>,
    pub(super) sources: Vec<SourceHead>,
    /// What shaders look around at; those that a world's own stacks name stand before it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) worlds: Vec<WorldHead>,
}

/// What was in the image when a shader was applied to it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct WorldHead {
    pub(super) key: Key,
    pub(super) members: Vec<MemberHead>,
}

/// A scene under a stack.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct MemberHead {
    pub(super) label: String,
    pub(super) scene: Key,
    /// The place of its scene in the list of scenes.
    #[serde(default)]
    pub(super) found_in: Option<usize>,
    #[serde(default)]
    pub(super) stack: Vec<Stage>,
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub(super) is_beside: bool,
}

/// A scene that faces come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct SceneHead {
    /// Relative to the span file's folder, with `/` between names, or absolute.
    pub(super) path: String,
    #[serde(default)]
    pub(super) how: serde_json::Value,
    pub(super) key: Key,
    /// Whether a block holds it.
    #[serde(default)]
    pub(super) embedded: bool,
}

/// A source.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct SourceHead {
    #[serde(flatten)]
    pub(super) member: MemberHead,
    #[serde(default)]
    pub(super) matte: Option<Key>,
    #[serde(default)]
    pub(super) held: Vec<Held>,
}

impl Head {
    pub(super) fn new(frame: &SpanImage, rows: &Rows) -> Head {
        let (view, plan) = (frame.view(), frame.plan());
        let Raster { width, height } = view.raster();
        Head {
            writer: concat!("spandrel ", env!("CARGO_PKG_VERSION")).to_owned(),
            camera: view.camera().clone(),
            width,
            height,
            lines_per_row: plan.per_row,
            phase: plan.phase,
            rows: [rows.start, rows.end],
            limits: frame.limits().iter().map(|limit| [limit.a, limit.b, limit.c]).collect(),
            scenes: Vec::new(),
            sources: Vec::new(),
            worlds: Vec::new(),
        }
    }

    /// The place of a scene in the list, which it is added to.
    fn place_of(&mut self, scene: SceneHead) -> usize {
        let known = self.scenes.iter().position(|known| *known == scene);
        known.unwrap_or_else(|| {
            self.scenes.push(scene);
            self.scenes.len() - 1
        })
    }

    /// Adds the worlds that a stack names; `scene` says where the scene of surfaces comes from.
    pub(super) fn add_worlds(
        &mut self,
        stack: &[Stage],
        scene: &dyn Fn(&dyn Surfaces) -> Option<SceneHead>,
    ) {
        for stage in stack {
            let Stage::Shade(shading) = stage else { continue };
            let Some(world) = shading.world() else { continue };
            if self.worlds.iter().any(|known| known.key == world.key()) {
                continue;
            }
            world.members().iter().for_each(|member| self.add_worlds(&member.stack, scene));
            let members =
                world.members().iter().map(|member| self.member(member, scene(&*member.surfaces)));
            let members = members.collect();
            self.worlds.push(WorldHead { key: world.key(), members });
        }
    }

    /// Adds a source, and the scene that it comes from if that is known.
    pub(super) fn add(&mut self, source: &Source, scene: Option<SceneHead>) {
        let member = self.member(&source.member(), scene);
        self.sources.push(SourceHead { member, matte: source.matte, held: source.held.clone() });
    }

    fn member(&mut self, member: &Member, scene: Option<SceneHead>) -> MemberHead {
        MemberHead {
            label: member.label.clone(),
            scene: member.scene,
            found_in: scene.map(|scene| self.place_of(scene)),
            stack: member.stack.clone(),
            is_beside: member.is_beside,
        }
    }

    pub(super) fn view(&self) -> Result<View> {
        View::new(&self.camera, Raster::new(self.width, self.height)?)
    }

    pub(super) fn plan(&self) -> Result<LinePlan> {
        LinePlan::new(self.lines_per_row, self.phase)
    }

    pub(super) fn rows(&self) -> Rows {
        self.rows[0]..self.rows[1]
    }

    pub(super) fn limits(&self) -> impl Iterator<Item = Plane> + '_ {
        self.limits.iter().map(|[a, b, c]| Plane { a: *a, b: *b, c: *c })
    }
}

impl SceneHead {
    /// A scene as a file in `folder` names it.
    pub(super) fn new(origin: &Origin, folder: &Path, embedded: bool) -> SceneHead {
        let path = relative(&origin.file, folder);
        let names: Vec<_> = path.iter().map(|name| name.to_string_lossy()).collect();
        let path = if path.is_absolute() { path.display().to_string() } else { names.join("/") };
        SceneHead { path, how: origin.how.clone(), key: origin.key, embedded }
    }

    /// The scene as a file in `folder` means it.
    pub(super) fn origin(&self, folder: &Path, contents: Option<std::sync::Arc<[u8]>>) -> Origin {
        let file = folder.join(&self.path);
        Origin { file, how: self.how.clone(), key: self.key, contents }
    }
}
