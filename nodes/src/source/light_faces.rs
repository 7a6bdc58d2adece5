//! The node `LightFaces`: makes lights visible, as a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::{Inputs, NamedLink, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::values::Lamps;

/// Makes a scene of the visible parts of lights, to render and merge with others. These are the
/// faces of area and polyhedral lights, and the tubes of linear lights. They glow with their
/// luminance while the light is on. `Illuminate` shows them by its exposure.
///
/// Example: `LightFaces(lights: ["panel", "tube"])`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LightFaces {
    /// The lights.
    pub lights: Vec<NamedLink<Lamps>>,
    /// The radius of tubes, in metres.
    #[schemars(range(min = 1e-6, max = 1e6))]
    pub radius: f64,
}

impl Default for LightFaces {
    fn default() -> LightFaces {
        LightFaces { lights: Vec::new(), radius: 0.013 }
    }
}

impl Node for LightFaces {
    type Output = Scene;
    const KIND: &'static str = "LightFaces";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] = &["VisibleLights", "LightGeometry"];

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        self.lights.iter().for_each(|light| upstream.ask(light, ()));
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Scene> {
        let named = |link| Lamps::named(inputs, link);
        let lamps: Vec<_> = self.lights.iter().flat_map(named).collect();
        Scene::of_lamps("lights", &lamps, self.radius)
    }
}
