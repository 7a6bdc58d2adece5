//! The node `Wireframe`: a scene as lines (\[D], "Geometry data structure": edge attributes).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::scene::Scene;
use spandrel_engine::scene::face::EdgeStyle;
use spandrel_engine::scene::wire::{HiddenLines, Wire};

/// Makes a scene of the edges of another: of all its faces, holes and seals, for any renderer. Lines
/// have a width in pixels and their place in depth, so that they merge with everything else.
///
/// Example: `Wireframe(scene: "assets/solids.ron", width: 1.5, hidden: Dimmed(0.7))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Wireframe {
    /// The scene.
    pub scene: Link<Scene>,
    /// The lines' width, in pixels of the raster that visibility is solved for.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub width: f32,
    /// The lines' colour; no light changes it.
    pub color: Color,
    /// The colour of faces between lines; no light changes it.
    pub fill: Color,
    /// What becomes of lines behind faces: they are left out (`LeftOut`), `Shown`, or `Dimmed(0.7)`:
    /// each face before them takes away this share of them, and shows as much of its `fill`.
    pub hidden: HiddenLines,
}

impl Default for Wireframe {
    fn default() -> Wireframe {
        Wireframe {
            scene: Link::default(),
            width: 1.0,
            color: Color::BLACK,
            fill: Color::WHITE,
            hidden: HiddenLines::LeftOut,
        }
    }
}

impl Node for Wireframe {
    type Output = Scene;
    const KIND: &'static str = "Wireframe";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] = &["Wire", "WireFrame", "Lines", "HiddenLine"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        match self.hidden {
            HiddenLines::Dimmed(share) if !(share > 0.0 && share < 1.0) => {
                Err(FieldError::new("hidden", "`Dimmed` takes a share above 0 and below 1"))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.scene, ());
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Scene> {
        let Wireframe { width, color, fill, hidden, .. } = *self;
        let edge = EdgeStyle { width, color };
        inputs.get(&self.scene).wire_frame(&Wire { edge, fill, hidden })
    }
}
