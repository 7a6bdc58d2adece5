//! Lights from a point.

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

use super::{LampFile, LightFault, MakeLamp, Result, lamp, place, strength, unit};
use crate::color::Color;
use crate::light::Lamp;
use crate::light::photometry::Photometry;
use crate::light::point::{Beam, Measured, Point};
use crate::math;

/// A lamp so small that all its light comes from one point. It shines equally to all sides, or as a
/// photometric file says.
///
/// Example: `PointLight(position: (2, 3, 1), flux: 800, temperature: 2700)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PointLight {
    /// Where it is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// Luminous intensity in candela. With a `lamp`, the factor for the measured values, 1 if
    /// absent.
    pub intensity: Option<f64>,
    /// Luminous flux in lumen, instead of the intensity.
    pub flux: Option<f64>,
    /// A measured lamp: an IES LM-63 or EULUMDAT file.
    pub lamp: Option<LampFile>,
    /// Where the lamp is aimed: the direction of gamma 0, or of the beam. If absent, straight down.
    #[schemars(with = "Option<[f64; 3]>")]
    pub aim: Option<DVec3>,
    /// The direction from the lamp to its plane C90 at a rotation of 0, as nearly as the aim
    /// allows. If absent, upwards; a lamp aimed straight down or up has its C90 towards -z (and its
    /// C0 towards +x). Set it for a lamp that swings through straight down; otherwise the lamp
    /// turns around there.
    #[schemars(with = "Option<[f64; 3]>")]
    pub up: Option<DVec3>,
    /// Turns the lamp about its aim, in degrees, clockwise seen from the lamp.
    pub rotation: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for PointLight {
    fn default() -> PointLight {
        PointLight {
            position: DVec3::ZERO,
            intensity: None,
            flux: None,
            lamp: None,
            aim: None,
            up: None,
            rotation: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

/// From the world's axes to those of a lamp: right, up, and along its aim.
fn lamp_frame(aim: DVec3, up: Option<DVec3>, rotation: f64) -> Result<DMat3> {
    if !rotation.is_finite() {
        return Err(LightFault::new("rotation", "must be finite"));
    }
    let aim = unit("aim", aim)?;
    let across = |up: DVec3| Some(up - aim * up.dot(aim)).filter(|up| up.length() > 1e-6);
    let above = match up {
        Some(up) => across(unit("up", up)?).ok_or_else(|| {
            LightFault::new("up", "lies along the lamp's aim: give another direction")
        })?,
        None => across(DVec3::Y).or_else(|| across(DVec3::NEG_Z)).unwrap_or(DVec3::X),
    };
    let above = above.normalize();
    // Seen along the aim, with what is above up.
    let right = aim.cross(above);
    let (sin, cos) = (math::sin(rotation.to_radians()), math::cos(rotation.to_radians()));
    let (right, above) = (right * cos - above * sin, above * cos + right * sin);
    Ok(DMat3::from_cols(right, above, aim).transpose())
}

/// A lamp from a photometric file.
fn measured(LampFile(file): &LampFile, directory: &Path, frame: DMat3) -> Result<Measured> {
    let photometry = Photometry::read(&directory.join(file));
    let photometry = photometry.map_err(|error| LightFault { field: "lamp", error })?;
    Ok(Measured { frame, photometry: Box::new(photometry) })
}

impl MakeLamp for PointLight {
    fn check(&self) -> Result<()> {
        // The numbers alone: files are read when the light is made.
        PointLight { lamp: None, ..self.clone() }.lamp("", Path::new("")).map(drop)
    }

    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        let position = place("position", self.position)?;
        let frame = lamp_frame(self.aim.unwrap_or(DVec3::NEG_Y), self.up, self.rotation)?;
        if self.intensity.is_some() && self.flux.is_some() {
            return Err(LightFault::new("flux", "give `intensity` or `flux`, not both"));
        }
        let (beam, whole) = match &self.lamp {
            Some(file) => {
                let of = measured(file, directory, frame)?;
                let whole = if self.flux.is_some() { of.photometry.flux() } else { 1.0 };
                (Beam::Measured(of), whole)
            }
            // One candela all round is 4 pi lumen.
            None => (Beam::All, 4.0 * std::f64::consts::PI),
        };
        let (what, value) = match (self.intensity, self.flux) {
            (_, Some(flux)) if whole > 0.0 => ("flux", flux / whole),
            (_, Some(_)) => {
                return Err(LightFault::new("flux", "the lamp has none that could be scaled"));
            }
            (intensity, None) => ("intensity", intensity.unwrap_or(1.0)),
        };
        let strength = strength(what, value, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, Point { position, beam }))
    }
}

/// Light from a point into a cone.
///
/// Example: `SpotLight(position: (0, 4, 0), direction: (0, -1, -0.3), angle: 50, intensity: 900)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpotLight {
    /// Where it is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// The direction in which it points; its length does not matter.
    #[schemars(with = "[f64; 3]")]
    pub direction: DVec3,
    /// Half the cone's angle, in degrees. Outside the cone there is no light.
    #[schemars(range(min = 0.001, max = 180.0))]
    pub angle: f64,
    /// Half the angle of the inner cone, in degrees. Inside it the light is full; from there it
    /// falls smoothly to `angle`. If absent, two thirds of `angle`. If equal to `angle`, the edge
    /// is hard and not antialiased.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub inner_angle: Option<f64>,
    /// Luminous intensity on the axis, in candela. With a `lamp`, the factor for the measured
    /// values.
    #[schemars(range(min = 0.0))]
    pub intensity: f64,
    /// A measured lamp, an IES LM-63 or EULUMDAT file, aimed along `direction`. Only its light
    /// inside the cone is seen; 180 degrees lets all of it through.
    pub lamp: Option<LampFile>,
    /// As `up` of PointLight, for a measured lamp.
    #[schemars(with = "Option<[f64; 3]>")]
    pub up: Option<DVec3>,
    /// As `rotation` of PointLight, for a measured lamp.
    pub rotation: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for SpotLight {
    fn default() -> SpotLight {
        SpotLight {
            position: DVec3::ZERO,
            direction: DVec3::NEG_Y,
            angle: 45.0,
            inner_angle: None,
            intensity: 1.0,
            lamp: None,
            up: None,
            rotation: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for SpotLight {
    fn check(&self) -> Result<()> {
        SpotLight { lamp: None, ..self.clone() }.lamp("", Path::new("")).map(drop)
    }

    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        let angle = self.angle;
        let inner = self.inner_angle.unwrap_or(angle * 2.0 / 3.0);
        if !(angle > 0.0 && angle <= 180.0 && (0.0..=angle).contains(&inner)) {
            let what = "must be 0 to `angle`, which is above 0 and up to 180";
            return Err(LightFault::new(
                "inner_angle",
                format!("{inner} and an angle of {angle}: {what}"),
            ));
        }
        let position = place("position", self.position)?;
        let axis = unit("direction", self.direction)?;
        let frame = lamp_frame(self.direction, self.up, self.rotation)?;
        let of = self.lamp.as_ref().map(|file| measured(file, directory, frame)).transpose()?;
        let (outer, inner) = (angle.to_radians(), inner.to_radians());
        let beam = Beam::Cone { axis, outer, inner, of };
        let strength = strength("intensity", self.intensity, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, Point { position, beam }))
    }
}
