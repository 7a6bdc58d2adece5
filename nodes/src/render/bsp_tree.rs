//! The node `BspTree`: the first of the four stages of list priority (\[D], "BSP tree for interactive use").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::render::priority::{BspTree as Tree, Roots};
use spandrel_engine::scene::Scene;

/// Generates a tree that gives a scene's faces their order for any eye, for `ListPriority`.
///
/// It depends on the scene alone: cameras and lights change without it. It is kept in memory for all
/// frames, and with `--cache` for later runs. For some objects of a scene, choose them with
/// `ReadScene(objects: ..)`.
///
/// Example: `BspTree(scene: "assets/solids.ron")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct BspTree {
    /// The scene.
    pub scene: Link<Scene>,
}

impl Node for BspTree {
    type Output = Tree;
    const KIND: &'static str = "BspTree";
    const GROUP: &'static str = "render";
    const ALIASES: &'static [&'static str] = &["Tree", "PriorityTree"];

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Tree> {
        let scene = inputs.get(&self.scene);
        inputs.remembered(
            |bytes| Tree::unpacked(&scene, bytes),
            || Tree::generate(scene.clone(), Roots::Best),
            Tree::packed,
        )
    }
}
