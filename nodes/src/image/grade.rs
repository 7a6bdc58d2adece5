//! The node `Grade`: changes the colours of a finished picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture;
use spandrel_engine::values::PictureDemand;

/// Changes the colours of a picture. The steps, in order: times 2 ^ `exposure`, times `multiply`,
/// plus `add`, to the power 1 / `gamma`, then `saturation`. `Recolor` and `Stream` grade object by
/// object, before anything is resolved.
///
/// Example: `Grade(image: "picture", exposure: 0.5, saturation: 0.9)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Grade {
    /// The picture.
    pub image: Link<Image>,
    /// Stops: 1 makes the picture twice as bright.
    pub exposure: f32,
    /// The factor for each component.
    pub multiply: Color,
    /// Added to each component.
    pub add: Color,
    /// Above 1, values below 1 become brighter.
    pub gamma: Color,
    /// 0 makes grey, 1 changes nothing.
    pub saturation: f32,
}

impl Default for Grade {
    fn default() -> Grade {
        let (multiply, add, gamma) = (Color::WHITE, Color::BLACK, Color::WHITE);
        Grade { image: Link::default(), exposure: 0.0, multiply, add, gamma, saturation: 1.0 }
    }
}

impl Node for Grade {
    type Output = Image;
    const KIND: &'static str = "Grade";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] =
        &["ColorCorrect", "Exposure", "Gamma", "Saturation", "CDL"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if !self.gamma.to_array().iter().all(|v| (0.01..=100.0).contains(v)) {
            return Err(FieldError::new("gamma", "must be 0.01 to 100"));
        }
        if !(-64.0..=64.0).contains(&self.exposure) {
            return Err(FieldError::new("exposure", "must be -64 to 64 stops"));
        }
        Ok(())
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let Grade { exposure, multiply, add, gamma, saturation, .. } = *self;
        picture::Grade { exposure, multiply, add, gamma, saturation }
            .apply(&inputs.get(&self.image))
    }
}
