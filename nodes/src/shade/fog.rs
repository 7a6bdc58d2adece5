use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::Lines;
use std::sync::Arc;

/// Fog, by the distance of each visible surface, before anything is resolved: a wire in front of a far
/// mountain keeps its own fog. The background is left as it is.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Fog {
    /// The image.
    pub image: Link<SpanImage>,
    /// Share of light lost per metre: after a way of 1 / density, 37 % are left. With 0 the image is
    /// returned as it is.
    #[schemars(range(min = 0.0))]
    pub density: f32,
    /// The fog's own colour.
    pub color: Color,
    /// The way in metres that is free of fog.
    #[schemars(range(min = 0.0))]
    pub start: f32,
}

impl Default for Fog {
    fn default() -> Fog {
        Fog { image: Link::default(), density: 0.01, color: Color::grey(0.6), start: 0.0 }
    }
}

impl Node for Fog {
    type Output = SpanImage;
    const KIND: &'static str = "Fog";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["Mist", "Haze", "DepthFog", "Atmosphere"];

    fn demand(&self, wanted: &Lines, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &Lines, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let fog = shade::Fog { density: self.density, color: self.color, start: self.start };
        inputs.get(&self.image).shaded(Arc::new(fog))
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        (self.density == 0.0).then_some(&self.image)
    }
}
