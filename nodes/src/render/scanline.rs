//! The node `Scanline`: the scan-line renderer (\[D], "Shading display with shadow"; it stores what
//! \[N], "Image data structure", lists).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::camera::Camera;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;
use spandrel_engine::visible;

/// Renders a scene to spans by the scan-line method: the visible part of every face on every line,
/// exactly. Concave faces, holes, seals and faces that cross each other need no preparation.
///
/// The number of lines is not set here. It comes from the node that resolves or writes the image.
///
/// Example: `Scanline(scene: "assets/solids.ron", camera: "eye")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Scanline {
    /// The scene.
    pub scene: Link<Scene>,
    /// The camera.
    pub camera: Link<Camera>,
    /// Where this scene coincides with others, the greater priority is seen. Each step is a
    /// sixteen-millionth of the distance: more than rounding, less than can be seen.
    #[schemars(range(min = -1000, max = 1000))]
    pub priority: i32,
}

impl Node for Scanline {
    type Output = SpanImage;
    const KIND: &'static str = "Scanline";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] = &["ScanlineRender", "Render", "Renderer"];

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        upstream.ask(&self.camera, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let (scene, camera) = (inputs.get(&self.scene), inputs.get(&self.camera));
        wanted
            .seen(&scene, &camera, self.priority, inputs, |frame| Ok(visible::solve(frame.clone())))
    }
}
