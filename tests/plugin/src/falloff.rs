//! A light.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::sync::Arc;

/// A point whose light weakens evenly and ends at a distance, as lights of old games do.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FalloffLight {
    /// Where it is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// Illuminance close to it, in lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: f32,
    /// Where it ends, in metres.
    #[schemars(range(min = 0.001))]
    pub range: f64,
    /// Its colour.
    pub color: Color,
    /// Whether it is on.
    pub on: bool,
}

impl Default for FalloffLight {
    fn default() -> FalloffLight {
        let color = Color::WHITE;
        FalloffLight { position: DVec3::ZERO, illuminance: 1.0, range: 10.0, color, on: true }
    }
}

impl Node for FalloffLight {
    type Output = Lamps;
    const KIND: &'static str = "FalloffLight";
    const GROUP: &'static str = "studio";

    fn demand(&self, (): &(), _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, (): &(), _: &Inputs<'_>) -> Result<Lamps> {
        // Strength, colour and switch stand beside the light of strength 1: to dim it computes nothing anew.
        let light = Falloff { position: self.position, range: self.range };
        let strength = self.color * self.illuminance;
        Ok(Lamps(vec![Lamp::new("", self.on, strength, Arc::new(light))]))
    }
}

/// It at strength 1.
#[derive(Debug, Serialize, Deserialize)]
struct Falloff {
    position: DVec3,
    range: f64,
}

#[typetag::serde(name = "StudioFalloff")]
impl Light for Falloff {
    fn toward(&self) -> Option<Toward> {
        // All of it comes from one place, so that shadow volumes are exact.
        Some(Toward::Point(self.position))
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        let way = self.position - at.position;
        let distance = way.length();
        let cosine = at.normal.dot(way / distance).max(0.0);
        let left = (1.0 - distance / self.range).max(0.0);
        Color::grey(if distance > 0.0 { (cosine * left) as f32 } else { 0.0 })
    }

    fn sample(&self, at: &Receiver, _: DVec2) -> Sample {
        Sample { toward: Toward::Point(self.position), irradiance: self.irradiance(at) }
    }
}
