//! Lights as people write them (\[D], "Rendering condition data structure"). They are the nodes of
//! a graph and the entries of a scene's light list.

mod distant;
mod extended;
mod small;

pub use distant::{AmbientLight, ParallelLight, SkyLight, SkySun, SunLight};
pub use extended::{AreaLight, LinearLight, PolyhedralLight};
pub use small::{PointLight, SpotLight};

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use super::sky::SkyModel;
use super::tint::black_body;
use super::{Lamp, Light};
use crate::color::Color;
use crate::error::Error;
use crate::fragment::Environment;
use crate::math;

/// What is wrong with a light, and in which field.
#[derive(Debug)]
pub struct LightFault {
    /// The field.
    pub field: &'static str,
    /// What is wrong with it.
    pub error: Error,
}

impl LightFault {
    fn new(field: &'static str, message: impl std::fmt::Display) -> LightFault {
        LightFault { field, error: Error::invalid(message.to_string()) }
    }

    /// The light that a sky follows is not infinitely far away.
    pub fn no_sun(name: &str) -> LightFault {
        LightFault::new("sun", format!("\"{name}\" is no SunLight or ParallelLight"))
    }
}

impl From<LightFault> for Error {
    fn from(fault: LightFault) -> Error {
        // A file that is missing or damaged is told as such, not as a fault of who names it.
        match fault.error.path() {
            Some(_) => fault.error,
            None => Error::invalid(format!("`{}`: {}", fault.field, fault.error)),
        }
    }
}

type Result<T> = std::result::Result<T, LightFault>;

/// An entry of a scene's light list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightEntry {
    /// From infinitely far.
    ParallelLight(ParallelLight),
    /// The sun of a place and time.
    SunLight(SunLight),
    /// From a point.
    PointLight(PointLight),
    /// From a point into a cone.
    SpotLight(SpotLight),
    /// From a thin tube.
    LinearLight(LinearLight),
    /// From a planar polygon.
    AreaLight(AreaLight),
    /// From a closed body.
    PolyhedralLight(PolyhedralLight),
    /// From the sky.
    SkyLight(SkyLight),
    /// From everywhere.
    AmbientLight(AmbientLight),
}

/// A kind of light, from which a lamp is made.
pub trait MakeLamp {
    /// The lamp. Files are found from `directory`.
    ///
    /// # Errors
    /// If a number is out of range, or a file cannot be read.
    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp>;

    /// A warning about a light that is valid, but perhaps not as intended.
    fn doubt(&self) -> Option<String> {
        None
    }

    /// The name of the light that it takes its sun from, if any.
    fn follows(&self) -> Option<&str> {
        None
    }

    /// Sets the direction to the sun that it follows.
    fn follow(&mut self, _sun: DVec3) {}

    /// Checks that the lamp can be made, without reading files.
    ///
    /// # Errors
    /// The first field that is out of range.
    fn check(&self) -> Result<()> {
        self.lamp("", Path::new("")).map(drop)
    }
}

impl LightEntry {
    fn light(&self) -> &dyn MakeLamp {
        match self {
            LightEntry::ParallelLight(light) => light,
            LightEntry::SunLight(light) => light,
            LightEntry::PointLight(light) => light,
            LightEntry::SpotLight(light) => light,
            LightEntry::LinearLight(light) => light,
            LightEntry::AreaLight(light) => light,
            LightEntry::PolyhedralLight(light) => light,
            LightEntry::SkyLight(light) => light,
            LightEntry::AmbientLight(light) => light,
        }
    }

    /// The name of its kind.
    pub fn kind(&self) -> &'static str {
        match self {
            LightEntry::ParallelLight(_) => "ParallelLight",
            LightEntry::SunLight(_) => "SunLight",
            LightEntry::PointLight(_) => "PointLight",
            LightEntry::SpotLight(_) => "SpotLight",
            LightEntry::LinearLight(_) => "LinearLight",
            LightEntry::AreaLight(_) => "AreaLight",
            LightEntry::PolyhedralLight(_) => "PolyhedralLight",
            LightEntry::SkyLight(_) => "SkyLight",
            LightEntry::AmbientLight(_) => "AmbientLight",
        }
    }

    /// The file that it is made from, to change it.
    pub fn file_mut(&mut self) -> Option<&mut LampFile> {
        match self {
            LightEntry::PointLight(light) => light.lamp.as_mut(),
            LightEntry::SpotLight(light) => light.lamp.as_mut(),
            LightEntry::SkyLight(light) => light.picture.as_mut(),
            _ => None,
        }
    }

    /// Completes the light from the rest of its scene. The environment sets what the light leaves
    /// open. A light of the list gives the direction to the sun that it follows.
    ///
    /// # Errors
    /// If the light that it follows is not a sun.
    pub fn within(
        mut self,
        environment: Option<&Environment>,
        lights: &BTreeMap<String, LightEntry>,
    ) -> Result<LightEntry> {
        let LightEntry::SkyLight(sky) = &mut self else { return Ok(self) };
        let overcast = environment.map(|known| SkyModel::Blend(known.overcast));
        sky.model = sky.model.or(overcast);
        if let Some(name) = sky.follows() {
            let sun = match lights.get(name) {
                Some(LightEntry::SunLight(sun)) => sun.toward()?,
                Some(LightEntry::ParallelLight(light)) => -light.direction,
                Some(_) => return Err(LightFault::no_sun(name)),
                None => {
                    return Err(LightFault::new(
                        "sun",
                        format!("the list has no light \"{name}\""),
                    ));
                }
            };
            sky.follow(sun);
        }
        Ok(self)
    }
}

impl MakeLamp for LightEntry {
    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        self.light().lamp(name, directory)
    }

    fn doubt(&self) -> Option<String> {
        self.light().doubt()
    }

    fn check(&self) -> Result<()> {
        self.light().check()
    }
}

/// A file that a light is made from, relative to the graph's or the scene's file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct LampFile(pub String);

impl JsonSchema for LampFile {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "lamp file".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "x-file": "read" })
    }
}

/// Strength times colour, checked.
fn strength(
    field: &'static str,
    value: f64,
    color: Color,
    temperature: Option<f64>,
) -> Result<Color> {
    if !(value.is_finite() && value >= 0.0) {
        return Err(LightFault::new(field, format!("{value}: must be finite and 0 or more")));
    }
    check_color("color", color)?;
    let glow = temperature.map(black_body).transpose();
    let glow = glow.map_err(|e| LightFault::new("temperature", e))?.unwrap_or(Color::WHITE);
    let strength = color * glow * (value.min(f64::from(f32::MAX)) as f32);
    if !strength.is_finite() {
        return Err(LightFault::new(field, format!("{value}: too much to be shown")));
    }
    Ok(strength)
}

fn check_color(field: &'static str, color: Color) -> Result<()> {
    if color.is_finite() && color.to_array().iter().all(|v| *v >= 0.0) {
        return Ok(());
    }
    Err(LightFault::new(field, "a light's colour must be finite and 0 or more"))
}

fn unit(field: &'static str, direction: DVec3) -> Result<DVec3> {
    let unit = direction.try_normalize();
    unit.ok_or_else(|| LightFault::new(field, "must be finite and have a length"))
}

fn place(field: &'static str, point: DVec3) -> Result<DVec3> {
    if math::is_within_reach(point) {
        return Ok(point);
    }
    Err(LightFault::new(field, format!("must be finite and within {:e} m", math::REACH)))
}

fn lamp(name: &str, on: bool, strength: Color, light: impl Light + 'static) -> Lamp {
    Lamp::new(name, on, strength, Arc::new(light))
}
