//! Light from the sky: the hemisphere (\[N], "skylight"), and the ground below it; and light that is
//! everywhere.

use glam::{DVec2, DVec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::OnceLock;

use super::normals::ByNormal;
use super::tint::ClearSky;
use super::{Light, Receiver, Sample};
use crate::color::Color;
use crate::error::{Error, Result};
use crate::math;
use crate::trace::Toward;

/// Rows and columns of equal solid angle into which the dome is divided to be summed.
const ROWS: usize = 48;
const COLUMNS: usize = 192;

/// How the luminance of the sky is spread.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum SkyModel {
    /// Equal all over.
    Uniform,
    /// CIE overcast (Moon and Spencer): three times as bright at the zenith as at the horizon.
    #[default]
    Overcast,
    /// CIE intermediate (Nakamura): a hazy sun.
    Intermediate,
    /// CIE clear (Kittler): bright around the sun and at the horizon. Type 12 of the general sky.
    Clear,
    /// The CIE general sky's types, 1 to 15 (ISO 15469).
    General(u32),
    /// From clear, 0, to overcast, 1: the mixture of both.
    Blend(f64),
}

/// The sky over an open plane, which receives 1 lux of it, and the ground.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Sky {
    model: SkyModel,
    /// The unit vector to the sun.
    sun: DVec3,
    /// The share of the light that the ground sends back to what faces it.
    ground: f64,
    /// Whether it is as blue as a cloudless sky, where it is one.
    is_colored: bool,
    #[serde(skip)]
    tables: OnceLock<Tables>,
}

#[derive(Clone, Debug)]
struct Tables {
    /// The model's luminances are relative: the factor that makes 1 lux of them.
    scale: f64,
    /// What an open plane receives of the clear sky, in the model's units.
    clear: f64,
    /// The colours of what is cloudless of it.
    cloudless: Option<ClearSky>,
    /// What an open plane receives, 1 lux.
    horizontal: Color,
    /// By normal, the irradiance with nothing in the way, if it is not in closed form.
    irradiance: Option<ByNormal<[f32; 3]>>,
}

impl Sky {
    /// A grey sky with the sun in a direction, a unit vector, and a ground that reflects a share of it.
    ///
    /// # Errors
    /// If the model's number or the reflectance is out of range, or the model needs a sun and it is below
    /// the horizon.
    pub fn new(model: SkyModel, sun: DVec3, ground: f64) -> Result<Sky> {
        match model {
            SkyModel::General(kind) if !(1..=15).contains(&kind) => {
                return Err(Error::invalid(format!(
                    "the CIE general sky has the types 1 to 15, not {kind}"
                )));
            }
            SkyModel::Blend(share) if !(0.0..=1.0).contains(&share) => {
                return Err(Error::invalid(format!(
                    "a sky between clear (0) and overcast (1), not {share}"
                )));
            }
            _ => {}
        }
        let Some(sun) = sun.try_normalize() else {
            return Err(Error::invalid("the direction of the sun must have a length"));
        };
        let needs_sun = !matches!(model, SkyModel::Uniform | SkyModel::Overcast);
        if needs_sun && sun.y < 0.0 {
            return Err(Error::invalid(
                "the sun is below the horizon: of the night, only the Uniform and Overcast skies are known",
            ));
        }
        if !(0.0..=1.0).contains(&ground) {
            return Err(Error::invalid(format!(
                "a ground reflectance of {ground}: must be 0 to 1"
            )));
        }
        Ok(Sky { model, sun, ground, is_colored: false, tables: OnceLock::new() })
    }

    /// The same sky in colour: `Clear`, `General(11)` to `General(15)` and the clear share of `Blend` are
    /// [blue](ClearSky), as bright as before.
    #[must_use]
    pub fn colored(self) -> Sky {
        Sky { is_colored: true, tables: OnceLock::new(), ..self }
    }

    /// The luminance in a direction, a unit vector, in cd/m2.
    pub fn luminance(&self, direction: DVec3) -> f64 {
        if direction.y < 0.0 {
            return self.ground / PI;
        }
        let tables = self.tables();
        let parts = relative(self.model, direction, self.sun, tables.clear);
        (parts.cloudless + parts.cloudy) * tables.scale
    }

    /// The luminance in a direction, a unit vector, in cd/m2, in colour.
    pub fn color(&self, direction: DVec3) -> Color {
        let tables = self.tables();
        if direction.y < 0.0 {
            return tables.horizontal * (self.ground / PI) as f32;
        }
        let parts = relative(self.model, direction, self.sun, tables.clear);
        parts.color(tables.cloudless.as_ref(), direction) * tables.scale as f32
    }

    fn is_uniform(&self) -> bool {
        self.model == SkyModel::Uniform
    }

    fn tables(&self) -> &Tables {
        self.tables.get_or_init(|| {
            let cells = ROWS * COLUMNS;
            let solid = TAU / cells as f64;
            // Asked once: a blend needs it for each direction.
            let clear = horizontal_of_clear(math::acos(self.sun.y.clamp(-1.0, 1.0)));
            let is_cloudless = match self.model {
                SkyModel::Clear | SkyModel::General(11..=15) => true,
                SkyModel::Blend(share) => share < 1.0,
                SkyModel::Uniform
                | SkyModel::Overcast
                | SkyModel::Intermediate
                | SkyModel::General(_) => false,
            };
            let cloudless = (self.is_colored && is_cloudless).then(|| ClearSky::new(self.sun));
            // Four points of each cell.
            let mut horizontal = 0.0;
            let mut colors = DVec3::ZERO;
            let mut upper = vec![DVec3::ZERO; cells];
            for (i, cell) in upper.iter_mut().enumerate() {
                for part in 0..4 {
                    let within = DVec2::new(f64::from(part % 2), f64::from(part / 2)) / 2.0 + 0.25;
                    let direction = place(i, within);
                    let parts = relative(self.model, direction, self.sun, clear);
                    let light = (parts.cloudless + parts.cloudy) * solid / 4.0;
                    let color = parts.color(cloudless.as_ref(), direction).to_array();
                    let color = DVec3::from(color.map(f64::from)) * solid / 4.0;
                    // By the model's luminance, not the colour's, so that colour changes no lux.
                    horizontal += light * direction.y;
                    colors += color * direction.y;
                    *cell += color;
                }
            }
            let scale = 1.0 / horizontal;
            let color = |of: DVec3| of.to_array().map(|v| v as f32);
            let [r, g, b] = color(colors * scale);
            let horizontal = Color::new(r, g, b);
            let irradiance = (!self.is_uniform()).then(|| {
                let dome: Vec<(DVec3, DVec3)> =
                    (0..cells).map(|i| (place(i, DVec2::splat(0.5)), upper[i] * scale)).collect();
                ByNormal::new(|normal| {
                    // Only the upper half: the ground is in closed form, as it is uniform.
                    let received = dome.iter().map(|(d, l)| *l * d.dot(normal).max(0.0));
                    color(received.sum::<DVec3>())
                })
            });
            Tables { scale, clear, cloudless, horizontal, irradiance }
        })
    }
}

/// A direction of a cell; rows of equal height are of equal solid angle.
fn place(at: usize, within: DVec2) -> DVec3 {
    let y = ((at / COLUMNS) as f64 + within.y) / ROWS as f64;
    let round = ((at % COLUMNS) as f64 + within.x) / COLUMNS as f64 * TAU;
    let r = (1.0 - y * y).max(0.0).sqrt();
    DVec3::new(r * math::cos(round), y, r * math::sin(round))
}

/// A luminance above the horizon, in a model's own units, in its two parts.
#[derive(Clone, Copy, Debug)]
struct Parts {
    cloudless: f64,
    cloudy: f64,
}

impl Parts {
    fn color(self, cloudless: Option<&ClearSky>, direction: DVec3) -> Color {
        match cloudless {
            Some(sky) => {
                sky.color(direction) * self.cloudless as f32 + Color::grey(self.cloudy as f32)
            }
            None => Color::grey((self.cloudless + self.cloudy) as f32),
        }
    }
}

/// The luminance of a model above the horizon.
fn relative(model: SkyModel, direction: DVec3, sun: DVec3, clear: f64) -> Parts {
    let cloudless = |cloudless: f64| Parts { cloudless, cloudy: 0.0 };
    let cloudy = |cloudy: f64| Parts { cloudless: 0.0, cloudy };
    let up = direction.y.max(0.0);
    let from_sun = math::acos(direction.dot(sun).clamp(-1.0, 1.0));
    let sun_zenith = math::acos(sun.y.clamp(-1.0, 1.0));
    match model {
        SkyModel::Uniform => cloudy(1.0),
        SkyModel::Overcast => cloudy((1.0 + 2.0 * up) / 3.0),
        SkyModel::Clear => cloudless(general(12, up, from_sun, sun_zenith)),
        SkyModel::General(kind @ 11..) => cloudless(general(kind, up, from_sun, sun_zenith)),
        SkyModel::General(kind) => cloudy(general(kind, up, from_sun, sun_zenith)),
        SkyModel::Intermediate => {
            let (altitude, sun_altitude) = (FRAC_PI_2 - math::acos(up), FRAC_PI_2 - sun_zenith);
            let gradation = 1.35
                * (math::sin(3.59 * altitude - 0.009) + 2.31)
                * math::sin(2.60 * sun_altitude + 0.316)
                + altitude
                + 4.799;
            let haze = 0.563 * ((sun_altitude - 0.008) * (altitude + 1.059) + 0.812);
            cloudy(gradation / 2.326 * math::exp(-from_sun * haze))
        }
        SkyModel::Blend(share) => {
            // Both as they are over an open plane, so that the share is one of light.
            let bright = general(12, up, from_sun, sun_zenith) / clear;
            // An overcast sky with a zenith of 1 gives an open plane 7 pi / 9.
            let dull = (1.0 + 2.0 * up) / 3.0 / (7.0 * PI / 9.0);
            Parts { cloudless: bright * (1.0 - share), cloudy: dull * share }
        }
    }
}

/// What an open plane receives of the clear sky's relative luminance.
fn horizontal_of_clear(sun_zenith: f64) -> f64 {
    let sun = DVec3::new(math::sin(sun_zenith), math::cos(sun_zenith), 0.0);
    let cells = 24 * 48;
    let sum = (0..cells).map(|i| {
        let y = (f64::from(i / 48) + 0.5) / 24.0;
        let round = (f64::from(i % 48) + 0.5) / 48.0 * TAU;
        let r = (1.0 - y * y).sqrt();
        let d = DVec3::new(r * math::cos(round), y, r * math::sin(round));
        general(12, y, math::acos(d.dot(sun).clamp(-1.0, 1.0)), sun_zenith) * y
    });
    sum.sum::<f64>() * TAU / f64::from(cells)
}

/// The CIE general sky: gradation from horizon to zenith, and the indicatrix around the sun.
fn general(kind: u32, up: f64, from_sun: f64, sun_zenith: f64) -> f64 {
    const GRADATION: [(f64, f64); 6] =
        [(4.0, -0.70), (1.1, -0.8), (0.0, -1.0), (-1.0, -0.55), (-1.0, -0.32), (-1.0, -0.15)];
    const INDICATRIX: [(f64, f64, f64); 6] = [
        (0.0, -1.0, 0.0),
        (2.0, -1.5, 0.15),
        (5.0, -2.5, 0.30),
        (10.0, -3.0, 0.45),
        (16.0, -3.0, 0.30),
        (24.0, -2.8, 0.15),
    ];
    // ISO 15469, table 1: which gradation and which indicatrix.
    const TYPES: [(usize, usize); 15] = [
        (0, 0),
        (0, 1),
        (1, 0),
        (1, 1),
        (2, 0),
        (2, 1),
        (2, 2),
        (2, 3),
        (3, 1),
        (3, 2),
        (3, 3),
        (4, 3),
        (4, 4),
        (5, 4),
        (5, 5),
    ];
    let (gradation, indicatrix) = TYPES[(kind.clamp(1, 15) - 1) as usize];
    let (a, b) = GRADATION[gradation];
    let (c, d, e) = INDICATRIX[indicatrix];
    let phi = |up: f64| if up > 0.0 { 1.0 + a * math::exp(b / up) } else { 1.0 };
    let f = |angle: f64| {
        let cosine = math::cos(angle);
        1.0 + c * (math::exp(d * angle) - math::exp(d * FRAC_PI_2)) + e * cosine * cosine
    };
    // Relative to the zenith, which is 1.
    f(from_sun) * phi(up) / (f(sun_zenith) * phi(1.0))
}

#[typetag::serde(name = "Sky")]
impl Light for Sky {
    fn toward(&self) -> Option<Toward> {
        None
    }

    fn sun(&self) -> Option<DVec3> {
        (!matches!(self.model, SkyModel::Uniform | SkyModel::Overcast)).then_some(self.sun)
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        let up = at.normal.y.clamp(-1.0, 1.0);
        let tables = self.tables();
        // The ground is uniform: a plane sees the share (1 - cosine) / 2 of it.
        let below = tables.horizontal * (self.ground * (1.0 - up) / 2.0) as f32;
        let above = match &tables.irradiance {
            None => Color::grey(((1.0 + up) / 2.0) as f32),
            Some(table) => {
                let [r, g, b] = table.at(at.normal);
                Color::new(r, g, b)
            }
        };
        above + below
    }

    fn is_mirrored(&self) -> bool {
        false
    }

    fn luminance(&self, direction: DVec3) -> Option<Color> {
        Some(self.color(direction))
    }

    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample {
        let direction = cosine_spread(at.normal, choice);
        // As often as each gives of the light of a grey sky.
        let irradiance = self.color(direction) * PI as f32;
        Sample { toward: Toward::Direction(direction), irradiance }
    }
}

/// A direction before a plane, as often as its cosine with the normal, chosen by two numbers in [0, 1).
fn cosine_spread(normal: DVec3, choice: DVec2) -> DVec3 {
    let round = choice.x * TAU;
    // Malley: points spread evenly over a disc, raised to the hemisphere.
    let (across, up) = (choice.y.sqrt(), (1.0 - choice.y).sqrt());
    let (u, v) = normal.any_orthonormal_pair();
    (u * math::cos(round) + v * math::sin(round)) * across + normal * up
}

/// Light that is everywhere: of two uniform half-spaces, with nothing in the way.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Ambient {
    /// The illuminance in lux of what faces up.
    pub above: Color,
    /// The illuminance in lux of what faces down.
    pub below: Color,
}

#[typetag::serde(name = "Ambient")]
impl Light for Ambient {
    fn toward(&self) -> Option<Toward> {
        None
    }

    fn is_everywhere(&self) -> bool {
        true
    }

    fn irradiance(&self, at: &Receiver) -> Color {
        self.below.mix(self.above, (0.5 + 0.5 * at.normal.y) as f32)
    }

    fn sample(&self, at: &Receiver, _: DVec2) -> Sample {
        Sample { toward: Toward::Direction(at.normal), irradiance: self.irradiance(at) }
    }
}
