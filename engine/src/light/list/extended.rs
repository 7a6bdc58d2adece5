//! Lights from lines and surfaces.

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::Path;

use super::{LightFault, MakeLamp, Result, lamp, place, strength};
use crate::color::Color;
use crate::light::Lamp;
use crate::light::line::Line;
use crate::light::polygon::{Polygon, Surface};

/// Light from a thin tube, such as a fluorescent lamp.
///
/// Example: `LinearLight(from: (-1, 3, 0), to: (1, 3, 0), flux: 3200, temperature: 4000)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LinearLight {
    /// One end, in metres.
    #[schemars(with = "[f64; 3]")]
    pub from: DVec3,
    /// The other end.
    #[schemars(with = "[f64; 3]")]
    pub to: DVec3,
    /// Luminous intensity across its axis, in candela per metre. In other directions it falls with
    /// the sine, as for a tube of equal luminance.
    pub intensity: Option<f64>,
    /// Luminous flux of the whole tube in lumen, instead of the intensity.
    pub flux: Option<f64>,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
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
            return Err(LightFault::new("to", "both ends are in one place: use a PointLight"));
        }
        let (what, value) = match (self.intensity, self.flux) {
            (Some(_), Some(_)) => {
                return Err(LightFault::new("flux", "give `intensity` or `flux`, not both"));
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
///
/// Example: `AreaLight(outline: [(0, 3, 0), (1, 3, 0), (1, 3, 1), (0, 3, 1)], luminance: 2000)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AreaLight {
    /// The polygon's corners in metres, convex or concave. It shines to the side from which they
    /// run counter-clockwise.
    #[schemars(with = "Vec<[f64; 3]>")]
    pub outline: Vec<DVec3>,
    /// Polygons inside it that do not shine.
    #[schemars(with = "Vec<Vec<[f64; 3]>>")]
    pub holes: Vec<Vec<DVec3>>,
    /// Whether it shines to both sides.
    pub two_sided: bool,
    /// Luminance in candela per square metre, equal everywhere and in all directions.
    #[schemars(range(min = 0.0))]
    pub luminance: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
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
        let surface = surface.map_err(|e| LightFault::new(field, e))?;
        let strength = strength("luminance", self.luminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, surface))
    }
}

/// Light from all sides of a closed body, such as a lantern.
///
/// Example: `PolyhedralLight(luminance: 2000)`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PolyhedralLight {
    /// The body's corners, in metres.
    #[schemars(with = "Vec<[f64; 3]>")]
    pub points: Vec<DVec3>,
    /// Its faces, as numbers of points, counter-clockwise seen from outside.
    pub faces: Vec<Vec<u32>>,
    /// Luminance in candela per square metre, equal everywhere and in all directions.
    #[schemars(range(min = 0.0))]
    pub luminance: f64,
    /// The light's colour.
    pub color: Color,
    /// A temperature in kelvin. The light has the colour of a black body at it, times `color`.
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
                LightFault::new("faces", what)
            })
        };
        let polygon = |(at, face): (usize, &Vec<u32>)| {
            let outline = face.iter().map(|i| corner(at, i)).collect::<Result<_>>()?;
            Ok(Polygon { outline, holes: Vec::new() })
        };
        let polygons = self.faces.iter().enumerate().map(polygon).collect::<Result<_>>()?;
        let surface = Surface::of_body(polygons).map_err(|e| LightFault::new("faces", e))?;
        let strength = strength("luminance", self.luminance, self.color, self.temperature)?;
        Ok(lamp(name, self.on, strength, surface))
    }
}
