//! The node `Recolor`: changes colours surface by surface.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;
use std::sync::Arc;

/// Changes the colours of an image, surface by surface, before anything is resolved. One cluster
/// can be graded before it is merged with others, and its edges have no fringe.
///
/// Example: `Recolor(image: "slice", multiply: (1.5, 1.0, 0.6))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Recolor {
    /// The image.
    pub image: Link<SpanImage>,
    /// The factor for the colour, scene-linear.
    pub multiply: Color,
    /// Added to the colour, after that.
    pub add: Color,
    /// 0 makes grey, 1 changes nothing, more is more colourful.
    #[schemars(range(min = 0.0))]
    pub saturation: f32,
}

impl Default for Recolor {
    fn default() -> Recolor {
        let image = Link::default();
        Recolor { image, multiply: Color::WHITE, add: Color::grey(0.0), saturation: 1.0 }
    }
}

impl Node for Recolor {
    type Output = SpanImage;
    const KIND: &'static str = "Recolor";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["Grade", "ColorCorrect", "DeepGrade"];

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let Recolor { multiply, add, saturation, .. } = *self;
        let shader = shade::Recolor { multiply, add, saturation };
        inputs.get(&self.image).shaded(Arc::new(shader))
    }
}
