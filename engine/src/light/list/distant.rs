//! Lights from infinitely far, and from everywhere.

use glam::DVec3;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{SeqAccess, Visitor, value::SeqAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize};
use std::borrow::Cow;
use std::fmt;
use std::path::Path;

use super::{LampFile, LightFault, MakeLamp, Result, check_color, lamp, strength, unit};
use crate::color::Color;
use crate::light::Lamp;
use crate::light::panorama::Panorama;
use crate::light::point::{Disc, Parallel};
use crate::light::sky::{Ambient, Sky, SkyModel};
use crate::light::sun::{self, Moment};
use crate::math;

/// Light from infinitely far, in one direction.
///
/// Example: `ParallelLight(direction: (-0.7, -0.4, -0.6), color: "#ffdcaa", illuminance: 0.9)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ParallelLight {
    /// The direction in which the light travels; its length does not matter.
    #[schemars(with = "[f64; 3]")]
    pub direction: DVec3,
    /// Illuminance of a surface facing it, in lux. A white surface then shows this value divided by
    /// `white` of its `Illuminate`.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// The diameter of the light's disc, in degrees. Above 0, shadows are soft where `shadows` is
    /// `Analytic` or `Rays`; `Volumes` uses the middle of the disc.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub angle: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for ParallelLight {
    fn default() -> ParallelLight {
        ParallelLight {
            direction: DVec3::new(-1.0, -2.0, -1.0),
            illuminance: 1.0,
            angle: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for ParallelLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let strength = strength("illuminance", self.illuminance, self.color, self.temperature)?;
        let toward = -unit("direction", self.direction)?;
        far(name, self.on, strength, toward, self.angle)
    }
}

/// A lamp infinitely far away, whose disc has a diameter in degrees.
fn far(name: &str, on: bool, strength: Color, toward: DVec3, angle: f64) -> Result<Lamp> {
    if !(0.0..=10.0).contains(&angle) {
        return Err(LightFault::new("angle", format!("{angle} degrees: must be 0 to 10")));
    }
    let radius = angle.to_radians() / 2.0;
    // Below that it is smaller than rounding.
    if radius < 1e-6 {
        return Ok(lamp(name, on, strength, Parallel { toward }));
    }
    Ok(lamp(name, on, strength, Disc { toward, radius }))
}

/// The sun, by place and time. Below the horizon it gives no light.
///
/// Example: `SunLight(latitude: 34.4, longitude: 132.5, time: "2026-06-21T16:00+09:00")`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SunLight {
    /// Degrees of latitude, north positive.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub latitude: f64,
    /// Degrees of longitude, east positive.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub longitude: f64,
    /// The time, as `2026-06-21T12:00+09:00`.
    pub time: String,
    /// Where north is: degrees clockwise from -z, seen from above.
    pub north: f64,
    /// Illuminance of a surface facing it, in lux. If absent, that of a clear day (IES): 127500
    /// above the atmosphere.
    pub illuminance: Option<f64>,
    /// The diameter of its disc, in degrees. Shadows are soft where `shadows` is `Analytic` or
    /// `Rays`; `Volumes` uses the middle of the disc.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub angle: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for SunLight {
    fn default() -> SunLight {
        SunLight {
            latitude: 34.4,
            longitude: 132.5,
            time: "2026-06-21T12:00+09:00".to_owned(),
            north: 0.0,
            illuminance: None,
            angle: 0.533,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl SunLight {
    /// The unit vector to the sun.
    ///
    /// # Errors
    /// If there is no such place or time.
    pub fn toward(&self) -> Result<DVec3> {
        if !self.north.is_finite() {
            return Err(LightFault::new("north", "must be finite"));
        }
        let moment = Moment::parse(&self.time).map_err(|e| LightFault::new("time", e))?;
        let direction = sun::direction(moment, self.latitude, self.longitude, self.north);
        direction.map_err(|e| LightFault::new("latitude", e))
    }
}

impl MakeLamp for SunLight {
    fn doubt(&self) -> Option<String> {
        let toward = self.toward().ok().filter(|toward| self.on && toward.y <= 0.0)?;
        let below = math::acos(toward.y.clamp(-1.0, 1.0)).to_degrees() - 90.0;
        Some(format!(
            "at {} the sun stands {below:.1} degrees below the horizon, and gives no light",
            self.time
        ))
    }

    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let toward = self.toward()?;
        let is_up = toward.y > 0.0;
        let lux = self.illuminance.unwrap_or_else(|| sun::illuminance(toward));
        let strength = strength("illuminance", lux, self.color, self.temperature)?;
        far(name, self.on && is_up, strength, unit("time", toward)?, self.angle)
    }
}

/// Light from the whole sky, and the part of it that the ground reflects.
///
/// Example: `SkyLight(model: Clear, sun: "sun", illuminance: 12000)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SkyLight {
    /// How its luminance is distributed: `Uniform`, `Overcast`, `Intermediate`, `Clear`,
    /// `General(1)` to `General(15)` (the types of CIE S 011, ISO 15469), or `Blend(0.3)`, from
    /// clear, 0, to overcast, 1. If absent in a scene's light list, the blend given by `overcast`
    /// of its `environment`; otherwise `Overcast`.
    pub model: Option<SkyModel>,
    /// A panorama of all directions instead of a model (.hdr, .exr, .png). It is twice as wide as
    /// high; its top is the zenith and its middle faces -z. The sun and the ground are then the
    /// picture's own.
    pub picture: Option<LampFile>,
    /// Turns the picture, in degrees clockwise seen from above.
    pub turn: f64,
    /// Illuminance that it gives to an open horizontal plane, in lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// For skies with a sun: a SunLight or ParallelLight that the sky follows, or the direction to
    /// the sun. The sun's own light comes from that light.
    pub sun: SkySun,
    /// Share of the sky's light that the ground below reflects.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub ground: f64,
    /// The light's colour, times the sky's own. `Clear`, `General(11)` to `General(15)` and the
    /// clear share of `Blend` are blue, paler at the horizon; all others are grey.
    pub color: Color,
    /// A temperature in kelvin. The whole sky has the colour of a black body at it, times `color`,
    /// instead of its own.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

/// Where the sun of a sky is.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum SkySun {
    /// In a direction; its length does not matter.
    Toward(DVec3),
    /// Where a light is, by its name: a node of the graph, or a light of the same list.
    Of(String),
}

impl<'de> Deserialize<'de> for SkySun {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<SkySun, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = SkySun;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a SunLight, or a direction such as (1, 2, 1)")
            }

            fn visit_str<E>(self, name: &str) -> std::result::Result<SkySun, E> {
                Ok(SkySun::Of(name.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> std::result::Result<SkySun, A::Error> {
                DVec3::deserialize(SeqAccessDeserializer::new(seq)).map(SkySun::Toward)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl JsonSchema for SkySun {
    fn schema_name() -> Cow<'static, str> {
        "sun".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = json_schema!({ "type": "number" });
        json_schema!({ "anyOf": [
            { "type": "string", "x-link": "Light" },
            { "type": "array", "prefixItems": [number, number, number] },
        ] })
    }
}

impl Default for SkyLight {
    fn default() -> SkyLight {
        SkyLight {
            model: None,
            picture: None,
            turn: 0.0,
            illuminance: 1.0,
            sun: SkySun::Toward(DVec3::new(1.0, 2.0, 1.0)),
            ground: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for SkyLight {
    fn check(&self) -> Result<()> {
        let sun = match self.sun {
            SkySun::Toward(sun) => sun,
            // Where that light stands is not known here: any place above the horizon will do.
            SkySun::Of(_) => DVec3::Y,
        };
        let known = SkyLight { picture: None, sun: SkySun::Toward(sun), ..self.clone() };
        known.lamp("", Path::new("")).map(drop)
    }

    fn follows(&self) -> Option<&str> {
        match &self.sun {
            SkySun::Toward(_) => None,
            SkySun::Of(name) => Some(name),
        }
    }

    fn follow(&mut self, sun: DVec3) {
        self.sun = SkySun::Toward(sun);
    }

    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        if !(-360.0..=360.0).contains(&self.turn) {
            return Err(LightFault::new(
                "turn",
                format!("{}: must be -360 to 360 degrees", self.turn),
            ));
        }
        if let Some(LampFile(file)) = &self.picture {
            let panorama = Panorama::read(&directory.join(file), self.turn.to_radians());
            let panorama = panorama.map_err(|error| LightFault { field: "picture", error })?;
            let strength = strength("illuminance", self.illuminance, self.color, self.temperature)?;
            return Ok(lamp(name, self.on, strength, panorama));
        }
        let sun = match &self.sun {
            SkySun::Toward(sun) => unit("sun", *sun)?,
            SkySun::Of(name) => {
                return Err(LightFault::new(
                    "sun",
                    format!("where \"{name}\" stands is not known here"),
                ));
            }
        };
        let model = self.model.unwrap_or(SkyModel::Overcast);
        let sky = Sky::new(model, sun, self.ground).map_err(|e| {
            let needs_sun = !matches!(model, SkyModel::Uniform | SkyModel::Overcast);
            LightFault::new(if needs_sun && sun.y < 0.0 { "sun" } else { "model" }, e)
        })?;
        // A temperature is the colour of the whole sky, in place of its blue.
        let sky = if self.temperature.is_none() { sky.colored() } else { sky };
        let strength = strength("illuminance", self.illuminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, sky))
    }
}

/// Light from everywhere, without shadows. It stands for all light that is reflected many times.
///
/// Example: `AmbientLight(illuminance: 40)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AmbientLight {
    /// Illuminance of a surface facing up, in lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// The light from below, as a share of that.
    pub below: Color,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for AmbientLight {
    fn default() -> AmbientLight {
        AmbientLight {
            illuminance: 0.1,
            below: Color::WHITE,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for AmbientLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let strength = strength("illuminance", self.illuminance, self.color, self.temperature)?;
        check_color("below", self.below)?;
        Ok(lamp(name, self.on, strength, Ambient { above: Color::WHITE, below: self.below }))
    }
}
