use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{LightSource, Lines};
use std::sync::Arc;

/// Lights the surfaces of an image by any number of lights and a light that is everywhere. Flat faces
/// have one intensity all over under parallel light, curved ones are smooth. Surfaces whose material is
/// unlit stay as they are.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Illuminate {
    /// The image.
    pub image: Link<SpanImage>,
    /// The lights.
    pub lights: Vec<Link<LightSource>>,
    /// Light from above: what a white surface that faces straight up shows without any other light.
    pub ambient: Color,
    /// Light from below: what a white surface that faces straight down shows. Absent, the same as
    /// `ambient`, and every surface gets the same.
    pub ground: Option<Color>,
}

impl Default for Illuminate {
    fn default() -> Illuminate {
        Illuminate {
            image: Link::default(),
            lights: Vec::new(),
            ambient: Color::grey(0.1),
            ground: None,
        }
    }
}

impl Node for Illuminate {
    type Output = SpanImage;
    const KIND: &'static str = "Illuminate";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["ReLight", "Lighting", "Shade"];

    fn demand(&self, wanted: &Lines, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        self.lights.iter().for_each(|light| upstream.ask(light, ()));
        Ok(())
    }

    fn evaluate(&self, _: &Lines, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let shader = shade::Illuminate {
            lights: self.lights.iter().map(|light| inputs.get(light).0.clone()).collect(),
            sky: self.ambient,
            ground: self.ground.unwrap_or(self.ambient),
        };
        inputs.get(&self.image).shaded(Arc::new(shader))
    }
}
