//! The node `SceneLights`: lights from a scene's list (\[D], "Rendering condition data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::error::Error;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::light::list::MakeLamp;
use spandrel_engine::scene::Scene;
use spandrel_engine::values::Lamps;

/// The lights of a scene's list: all, or those named. Each keeps its own switch.
///
/// Example: `SceneLights(scene: "town", names: ["sun", "lamp"])`
#[derive(Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SceneLights {
    /// The scene.
    pub scene: Link<Scene>,
    /// The names of the lights to take. If empty, all.
    pub names: Vec<String>,
}

impl Node for SceneLights {
    type Output = Lamps;
    const KIND: &'static str = "SceneLights";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] = &["LightList", "ReadLights", "ImportLights"];

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Lamps> {
        let scene = inputs.get(&self.scene);
        let lights = &scene.lights;
        if let Some(missing) = self.names.iter().find(|name| !lights.contains_key(*name)) {
            let known: Vec<&str> = lights.keys().map(String::as_str).collect();
            let list = if known.is_empty() { "none".to_owned() } else { known.join(", ") };
            return Err(Error::invalid(format!(
                "the scene has no light \"{missing}\": it has {list}"
            )));
        }
        if lights.is_empty() {
            inputs.warn("the scene has no lights");
        }
        let is_meant = |name: &String| self.names.is_empty() || self.names.contains(name);
        let meant = lights.iter().filter(|(name, _)| is_meant(name));
        meant
            .map(|(name, light)| {
                if let Some(doubt) = light.doubt() {
                    inputs.warn(&format!("\"{name}\": {doubt}"));
                }
                Ok(light.lamp(name, &scene.directory)?)
            })
            .collect::<Result<_>>()
            .map(Lamps)
    }
}
