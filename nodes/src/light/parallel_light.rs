use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::shade;
use spandrel_engine::values::LightSource;
use std::sync::Arc;

/// Light from infinitely far, such as the sun's.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ParallelLight {
    /// The direction in which the light travels; its length does not matter.
    #[schemars(with = "[f64; 3]")]
    pub direction: DVec3,
    /// The light's colour.
    pub color: Color,
    /// Its strength: with 1, a white surface that faces the light shows the light's colour.
    #[schemars(range(min = 0.0))]
    pub intensity: f32,
    /// Whether it is on.
    pub on: bool,
}

impl Default for ParallelLight {
    fn default() -> ParallelLight {
        ParallelLight {
            direction: DVec3::new(-1.0, -2.0, -1.0),
            color: Color::WHITE,
            intensity: 1.0,
            on: true,
        }
    }
}

impl Node for ParallelLight {
    type Output = LightSource;
    const KIND: &'static str = "ParallelLight";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] =
        &["DirectLight", "DirectionalLight", "Sun", "DistantLight"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        match self.direction.try_normalize() {
            None => Err(FieldError::new("direction", "a direction must have a length")),
            Some(_) => Ok(()),
        }
    }

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), _: &Inputs<'_>) -> Result<LightSource> {
        let strength = if self.on { self.intensity } else { 0.0 };
        let light = shade::ParallelLight::new(self.direction, self.color * strength)?;
        Ok(LightSource(Arc::new(light)))
    }
}
