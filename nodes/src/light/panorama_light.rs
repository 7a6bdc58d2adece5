//! The node `PanoramaLight`: lights a scene with a panorama that the graph makes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::light::Lamp;
use spandrel_engine::light::panorama::Panorama;
use spandrel_engine::values::{Lamps, Override, PictureDemand};
use spandrel_engine::{Error, Result};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Lights a scene with a panorama that the graph makes: a sky with clouds by a program
/// (`Panorama`), or a graded picture. Its middle faces -z and its top is the zenith. A file that
/// needs no change can also be the `picture` of a `SkyLight`.
///
/// Example: `PanoramaLight(image: "panorama", illuminance: 12000)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PanoramaLight {
    /// The panorama, twice as wide as high.
    pub image: Link<Image>,
    /// The illuminance that it gives to an open horizontal plane, in lux. If absent, it is as
    /// bright as it is: where the picture is 1, it is as bright as a white surface under `white`
    /// lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: Option<f64>,
    /// Without `illuminance`, the illuminance in lux under which a white surface shows 1.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub white: f64,
    /// Turns it, in degrees clockwise seen from above.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub turn: f64,
    /// Its light is multiplied by this.
    pub color: Color,
    /// Whether it is on.
    pub on: bool,
}

impl Default for PanoramaLight {
    fn default() -> PanoramaLight {
        PanoramaLight {
            image: Link::default(),
            illuminance: None,
            white: 1.0,
            turn: 0.0,
            color: Color::WHITE,
            on: true,
        }
    }
}

impl Node for PanoramaLight {
    type Output = Lamps;
    const KIND: &'static str = "PanoramaLight";
    const GROUP: &'static str = "light";
    const ALIASES: &'static [&'static str] = &["EnvironmentLight", "HdriLight", "ImageBasedLight"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.illuminance.is_some() && self.white.to_bits() != 1f64.to_bits() {
            return Err(FieldError::new(
                "white",
                "says how bright the picture is, and so does `illuminance`",
            ));
        }
        Ok(())
    }

    fn demand(&self, (): &(), upstream: &mut Upstream<'_>) -> Result<()> {
        let channels = BTreeSet::from([Channel::Color]);
        upstream.ask(&self.image, PictureDemand { channels, changed: Override::default() });
        Ok(())
    }

    fn evaluate(&self, (): &(), inputs: &Inputs<'_>) -> Result<Lamps> {
        let (light, open) = Panorama::of(&inputs.get(&self.image), self.turn.to_radians())
            .map_err(|error| Error::invalid(format!("`image`: {error}")))?;
        let lux = self.illuminance.unwrap_or(open * self.white / std::f64::consts::PI);
        let strength = self.color * lux as f32;
        Ok(Lamps(vec![Lamp::new("", self.on, strength, Arc::new(light))]))
    }
}
