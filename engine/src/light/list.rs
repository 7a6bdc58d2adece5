//! Lights as people write them: the nodes of a graph and the entries of a scene's light list (\[D],
//! "Rendering condition data") are these.

use glam::{DMat3, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

use super::line::Line;
use super::photometry::Photometry;
use super::point::{Beam, Parallel, Point};
use super::polygon::{Polygon, Surface};
use super::sky::{Ambient, Sky, SkyModel};
use super::sun::{self, Moment};
use super::tint::black_body;
use super::{Lamp, Light};
use crate::color::Color;
use crate::error::Error;
use crate::math;

/// What is wrong with a light, and in which of its fields.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The field.
    pub field: &'static str,
    /// What is wrong with it.
    pub message: String,
}

impl Fault {
    fn new(field: &'static str, message: impl std::fmt::Display) -> Fault {
        Fault { field, message: message.to_string() }
    }
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Error {
        Error::invalid(format!("`{}`: {}", fault.field, fault.message))
    }
}

type Result<T> = std::result::Result<T, Fault>;

/// An entry of a scene's light list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Entry {
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

/// What a kind of light is made of.
pub trait MakeLamp {
    /// The lamp. Files are found from `directory`.
    ///
    /// # Errors
    /// If a number is out of range, or a file cannot be read.
    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp>;

    /// The file that it reads, if any.
    fn file(&self) -> Option<&str> {
        None
    }
}

impl Entry {
    fn light(&self) -> &dyn MakeLamp {
        match self {
            Entry::ParallelLight(light) => light,
            Entry::SunLight(light) => light,
            Entry::PointLight(light) => light,
            Entry::SpotLight(light) => light,
            Entry::LinearLight(light) => light,
            Entry::AreaLight(light) => light,
            Entry::PolyhedralLight(light) => light,
            Entry::SkyLight(light) => light,
            Entry::AmbientLight(light) => light,
        }
    }
}

impl MakeLamp for Entry {
    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        self.light().lamp(name, directory)
    }

    fn file(&self) -> Option<&str> {
        self.light().file()
    }
}

/// A file of photometry; relative to the graph's or the scene's file.
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
        return Err(Fault::new(field, format!("{value}: must be finite and 0 or more")));
    }
    check_color("color", color)?;
    let glow = temperature.map(black_body).transpose();
    let glow = glow.map_err(|e| Fault::new("temperature", e))?.unwrap_or(Color::WHITE);
    let strength = color * glow * (value.min(f64::from(f32::MAX)) as f32);
    if !strength.is_finite() {
        return Err(Fault::new(field, format!("{value}: too much to be shown")));
    }
    Ok(strength)
}

fn check_color(field: &'static str, color: Color) -> Result<()> {
    if color.is_finite() && color.to_array().iter().all(|v| *v >= 0.0) {
        return Ok(());
    }
    Err(Fault::new(field, "a light's colour must be finite and 0 or more"))
}

fn unit(field: &'static str, direction: DVec3) -> Result<DVec3> {
    let unit = direction.try_normalize();
    unit.ok_or_else(|| Fault::new(field, "must be finite and have a length"))
}

fn place(field: &'static str, point: DVec3) -> Result<DVec3> {
    if point.is_finite() { Ok(point) } else { Err(Fault::new(field, "must be finite")) }
}

fn lamp(name: &str, on: bool, strength: Color, light: impl Light + 'static) -> Lamp {
    Lamp::new(name, on, strength, Arc::new(light))
}

/// Light from infinitely far, in one direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ParallelLight {
    /// The direction in which the light travels; its length does not matter.
    #[schemars(with = "[f64; 3]")]
    pub direction: DVec3,
    /// Illuminance of what faces it, in lux. A white surface then shows this over the `white` of its
    /// `Illuminate`.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for ParallelLight {
    fn default() -> ParallelLight {
        ParallelLight {
            direction: DVec3::new(-1.0, -2.0, -1.0),
            illuminance: 1.0,
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
        Ok(lamp(name, self.on, strength, Parallel { toward }))
    }
}

/// The sun, by place and time. Below the horizon it gives no light.
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
    /// Where north is: degrees clockwise, seen from above, from -z.
    pub north: f64,
    /// Illuminance of what faces it, in lux; absent, that of a clear day (IES): 127500 beyond the air.
    pub illuminance: Option<f64>,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
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
            return Err(Fault::new("north", "must be finite"));
        }
        let moment = Moment::parse(&self.time).map_err(|e| Fault::new("time", e))?;
        let direction = sun::direction(moment, self.latitude, self.longitude, self.north);
        direction.map_err(|e| Fault::new("latitude", e))
    }
}

impl MakeLamp for SunLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let toward = self.toward()?;
        let is_up = toward.y > 0.0;
        let lux = self.illuminance.unwrap_or_else(|| sun::illuminance(toward));
        let strength = strength("illuminance", lux, self.color, self.temperature)?;
        Ok(lamp(name, self.on && is_up, strength, Parallel { toward: unit("time", toward)? }))
    }
}

/// A lamp so small that all its light comes from one point, to all sides or as a file of photometry has
/// it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PointLight {
    /// Where it is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// Luminous intensity in candela; with a `lamp`, the factor of what was measured, 1 if absent.
    pub intensity: Option<f64>,
    /// Luminous flux in lumen, instead of the intensity.
    pub flux: Option<f64>,
    /// A measured lamp: an IES LM-63 or EULUMDAT file.
    pub lamp: Option<LampFile>,
    /// Where the lamp is aimed: the direction of gamma 0, or of the beam. Straight down if absent.
    #[schemars(with = "Option<[f64; 3]>")]
    pub aim: Option<DVec3>,
    /// Turns the lamp about its aim, in degrees, clockwise seen from the lamp. At 0 a lamp that is aimed
    /// down has its plane C0 to +x and C90 to -z; one that is aimed elsewhere has its C90, or up, as high
    /// as can be.
    pub rotation: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
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
            rotation: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

/// From the world's axes to those of a lamp: right, up, and along its aim.
fn lamp_frame(aim: DVec3, rotation: f64) -> Result<DMat3> {
    if !rotation.is_finite() {
        return Err(Fault::new("rotation", "must be finite"));
    }
    let aim = unit("aim", aim)?;
    let above = [DVec3::Y, DVec3::NEG_Z].map(|up| up - aim * up.dot(aim));
    let above = if above[0].length() > 1e-6 { above[0] } else { above[1] }.normalize();
    let right = aim.cross(above);
    let (sin, cos) = (math::sin(rotation.to_radians()), math::cos(rotation.to_radians()));
    let (right, above) = (right * cos - above * sin, above * cos + right * sin);
    Ok(DMat3::from_cols(right, above, aim).transpose())
}

impl MakeLamp for PointLight {
    fn file(&self) -> Option<&str> {
        self.lamp.as_ref().map(|file| file.0.as_str())
    }

    fn lamp(&self, name: &str, directory: &Path) -> Result<Lamp> {
        let position = place("position", self.position)?;
        if self.intensity.is_some() && self.flux.is_some() {
            return Err(Fault::new("flux", "give `intensity` or `flux`, not both"));
        }
        let (beam, whole) = match &self.lamp {
            Some(LampFile(file)) => {
                let photometry = Photometry::read(&directory.join(file));
                let photometry = photometry.map_err(|e| Fault::new("lamp", e))?;
                let frame = lamp_frame(self.aim.unwrap_or(DVec3::NEG_Y), self.rotation)?;
                let whole = if self.flux.is_some() { photometry.flux() } else { 1.0 };
                (Beam::Measured { frame, photometry: Box::new(photometry) }, whole)
            }
            None => (Beam::All, 4.0 * std::f64::consts::PI),
        };
        let (what, value) = match (self.intensity, self.flux) {
            (_, Some(flux)) if whole > 0.0 => ("flux", flux / whole),
            (_, Some(_)) => {
                return Err(Fault::new("flux", "the lamp has none that could be scaled"));
            }
            (intensity, None) => ("intensity", intensity.unwrap_or(1.0)),
        };
        let strength = strength(what, value, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, Point { position, beam }))
    }
}

/// Light from a point into a cone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpotLight {
    /// Where it is, in metres.
    #[schemars(with = "[f64; 3]")]
    pub position: DVec3,
    /// The direction in which it points; its length does not matter.
    #[schemars(with = "[f64; 3]")]
    pub direction: DVec3,
    /// Half the cone's angle in degrees: beyond it there is no light.
    #[schemars(range(min = 0.001, max = 180.0))]
    pub angle: f64,
    /// Half the angle of the inner cone, in degrees, within which the light is whole; smooth from there to
    /// `angle`. Absent, two thirds of that. As large as `angle`, the edge is hard, and not antialiased.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub inner_angle: Option<f64>,
    /// Luminous intensity on the axis, in candela.
    #[schemars(range(min = 0.0))]
    pub intensity: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
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
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for SpotLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let angle = self.angle;
        let inner = self.inner_angle.unwrap_or(angle * 2.0 / 3.0);
        if !(angle > 0.0 && angle <= 180.0 && (0.0..=angle).contains(&inner)) {
            let what = "must be 0 to `angle`, which is above 0 and up to 180";
            return Err(Fault::new(
                "inner_angle",
                format!("{inner} and an angle of {angle}: {what}"),
            ));
        }
        let position = place("position", self.position)?;
        let axis = unit("direction", self.direction)?;
        let beam = Beam::Cone { axis, outer: angle.to_radians(), inner: inner.to_radians() };
        let strength = strength("intensity", self.intensity, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, Point { position, beam }))
    }
}

/// Light from a thin tube, such as a fluorescent lamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LinearLight {
    /// One end, in metres.
    #[schemars(with = "[f64; 3]")]
    pub from: DVec3,
    /// The other end.
    #[schemars(with = "[f64; 3]")]
    pub to: DVec3,
    /// Luminous intensity across its axis in candela per metre. In other directions it falls with the
    /// sine, as a tube of equal luminance has it.
    pub intensity: Option<f64>,
    /// Luminous flux of all of it in lumen, instead of the intensity.
    pub flux: Option<f64>,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for LinearLight {
    fn default() -> LinearLight {
        LinearLight {
            from: DVec3::new(-0.5, 0.0, 0.0),
            to: DVec3::new(0.5, 0.0, 0.0),
            intensity: None,
            flux: None,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for LinearLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let ends = [place("from", self.from)?, place("to", self.to)?];
        let length = ends[0].distance(ends[1]);
        if length.is_nan() || length <= 0.0 {
            return Err(Fault::new("to", "both ends are in one place: use a PointLight"));
        }
        let (what, value) = match (self.intensity, self.flux) {
            (Some(_), Some(_)) => {
                return Err(Fault::new("flux", "give `intensity` or `flux`, not both"));
            }
            // The integral of the sine over all directions is pi squared.
            (None, Some(flux)) => {
                ("flux", flux / (length * std::f64::consts::PI * std::f64::consts::PI))
            }
            (intensity, None) => ("intensity", intensity.unwrap_or(1.0)),
        };
        let strength = strength(what, value, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, Line { ends }))
    }
}

/// Light from a planar polygon, such as a panel or a window.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AreaLight {
    /// The polygon's corners in metres, convex or concave. It shines to the side from which they run
    /// counter-clockwise.
    #[schemars(with = "Vec<[f64; 3]>")]
    pub outline: Vec<DVec3>,
    /// Polygons inside it that do not shine.
    #[schemars(with = "Vec<Vec<[f64; 3]>>")]
    pub holes: Vec<Vec<DVec3>>,
    /// Whether it shines to both sides.
    pub two_sided: bool,
    /// Luminance in candela per square metre, equal all over and in all directions.
    #[schemars(range(min = 0.0))]
    pub luminance: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for AreaLight {
    fn default() -> AreaLight {
        let corner = |x: f64, z: f64| DVec3::new(x, 0.0, z);
        AreaLight {
            outline: vec![
                corner(-0.5, -0.5),
                corner(0.5, -0.5),
                corner(0.5, 0.5),
                corner(-0.5, 0.5),
            ],
            holes: Vec::new(),
            two_sided: false,
            luminance: 1.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for AreaLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let polygon = Polygon { outline: self.outline.clone(), holes: self.holes.clone() };
        let surface = Surface::new(vec![polygon], self.two_sided);
        let field = if self.holes.is_empty() { "outline" } else { "holes" };
        let surface = surface.map_err(|e| Fault::new(field, e))?;
        let strength = strength("luminance", self.luminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, surface))
    }
}

/// Light from all sides of a closed body, such as a lantern.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PolyhedralLight {
    /// The body's corners, in metres.
    #[schemars(with = "Vec<[f64; 3]>")]
    pub points: Vec<DVec3>,
    /// Its faces, as numbers of points, counter-clockwise seen from outside.
    pub faces: Vec<Vec<u32>>,
    /// Luminance in candela per square metre, equal all over and in all directions.
    #[schemars(range(min = 0.0))]
    pub luminance: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for PolyhedralLight {
    fn default() -> PolyhedralLight {
        let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z) * 0.5;
        let points = vec![
            corner(-1.0, -1.0, -1.0),
            corner(1.0, -1.0, -1.0),
            corner(1.0, -1.0, 1.0),
            corner(-1.0, -1.0, 1.0),
            corner(0.0, 1.0, 0.0),
        ];
        let faces =
            vec![vec![0, 1, 2, 3], vec![1, 0, 4], vec![2, 1, 4], vec![3, 2, 4], vec![0, 3, 4]];
        PolyhedralLight {
            points,
            faces,
            luminance: 1.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for PolyhedralLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let corner = |face: usize, i: &u32| {
            self.points.get(*i as usize).copied().ok_or_else(|| {
                let count = self.points.len();
                let what = format!("face {face} names the point {i}: there are {count}, from 0");
                Fault::new("faces", what)
            })
        };
        let polygon = |(at, face): (usize, &Vec<u32>)| {
            let outline = face.iter().map(|i| corner(at, i)).collect::<Result<_>>()?;
            Ok(Polygon { outline, holes: Vec::new() })
        };
        let polygons = self.faces.iter().enumerate().map(polygon).collect::<Result<_>>()?;
        let surface = Surface::of_body(polygons).map_err(|e| Fault::new("faces", e))?;
        let strength = strength("luminance", self.luminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, surface))
    }
}

/// Light from the whole sky, and what the ground sends back of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SkyLight {
    /// How its luminance is spread: `Uniform`, `Overcast`, `Intermediate`, `Clear`, `General(1)` to
    /// `General(15)` (the types of CIE S 011, ISO 15469), or `Blend(0.3)` from clear, 0, to overcast, 1.
    pub model: SkyModel,
    /// Illuminance that it gives to an open horizontal plane, in lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// The direction to the sun, for the skies that have one; its own light is a SunLight or
    /// ParallelLight.
    #[schemars(with = "[f64; 3]")]
    pub sun: DVec3,
    /// Share of the sky's light that the ground below all sends back.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub ground: f64,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
    pub temperature: Option<f64>,
    /// Whether it is on.
    pub on: bool,
}

impl Default for SkyLight {
    fn default() -> SkyLight {
        SkyLight {
            model: SkyModel::Overcast,
            illuminance: 1.0,
            sun: DVec3::new(1.0, 2.0, 1.0),
            ground: 0.0,
            color: Color::WHITE,
            temperature: None,
            on: true,
        }
    }
}

impl MakeLamp for SkyLight {
    fn lamp(&self, name: &str, _: &Path) -> Result<Lamp> {
        let sun = unit("sun", self.sun)?;
        let sky = Sky::new(self.model, sun, self.ground).map_err(|e| {
            let needs_sun = !matches!(self.model, SkyModel::Uniform | SkyModel::Overcast);
            Fault::new(if needs_sun && sun.y < 0.0 { "sun" } else { "model" }, e)
        })?;
        let strength = strength("illuminance", self.illuminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, sky))
    }
}

/// Light that is everywhere, and casts no shadow: a stand-in for all light that is reflected many times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AmbientLight {
    /// Illuminance of what faces up, in lux.
    #[schemars(range(min = 0.0))]
    pub illuminance: f64,
    /// What comes from below, as a share of that.
    pub below: Color,
    /// The light's colour.
    pub color: Color,
    /// The temperature in kelvin of a black body whose colour it has, times `color`.
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
