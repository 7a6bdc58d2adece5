//! The node `ListPriority`: the display stage of list priority (\[D], "Near-real-time display").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::camera::Camera;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::render::priority::{self, BspTree};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;
use spandrel_engine::visible;

/// Renders a tree's scene to spans by list priority: a traversal of the tree gives the faces their
/// order, and visibility follows from it.
///
/// The spans are those of `Scanline`, bit for bit. The tree is generated once by `BspTree`; each
/// new view is a traversal. Seals, edges, holes, glass, lights and shadows work as they do there.
///
/// Example: `ListPriority(tree: "landscape", camera: "eye")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ListPriority {
    /// The tree.
    pub tree: Link<BspTree>,
    /// The camera.
    pub camera: Link<Camera>,
    /// Where this scene coincides with others, the greater priority is seen, as in `Scanline`.
    #[schemars(range(min = -1000, max = 1000))]
    pub priority: i32,
}

impl Node for ListPriority {
    type Output = SpanImage;
    const KIND: &'static str = "ListPriority";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] = &["Painter", "PaintersAlgorithm", "Bsp"];

    fn demand(&self, _: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.tree, ());
        upstream.ask(&self.camera, ());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let (tree, camera) = (inputs.get(&self.tree), inputs.get(&self.camera));
        wanted.seen(tree.scene(), &camera, self.priority, inputs, |frame| {
            Ok(visible::solve_in_order(frame.clone(), &priority::listed(&tree, frame)))
        })
    }
}
