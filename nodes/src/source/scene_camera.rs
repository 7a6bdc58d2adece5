//! The node `SceneCamera`: a camera from a scene file (\[D], "Rendering condition data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::camera::Camera;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::{Error, Result};

/// A camera from a scene file, by its name.
///
/// Example: `SceneCamera(scene: "town", name: "front")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct SceneCamera {
    /// The scene.
    pub scene: Link<Scene>,
    /// The camera's name in the scene. If absent, the scene's only camera.
    pub name: Option<String>,
}

impl Node for SceneCamera {
    type Output = Camera;
    const KIND: &'static str = "SceneCamera";
    const GROUP: &'static str = "source";

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Camera> {
        let scene = inputs.get(&self.scene);
        let names = || {
            scene.cameras.keys().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ")
        };
        let found = match &self.name {
            Some(name) => scene.cameras.get(name),
            None if scene.cameras.len() == 1 => scene.cameras.values().next(),
            None => None,
        };
        found.cloned().ok_or_else(|| {
            let label = &scene.label;
            Error::invalid(match (&self.name, scene.cameras.len()) {
                (_, 0) => format!("the scene {label} has no camera: use a Camera node"),
                (Some(name), _) => {
                    format!("{label} has no camera \"{name}\": set `name` to one of {}", names())
                }
                _ => format!("set `name` to a camera of {label}: {}", names()),
            })
        })
    }
}
