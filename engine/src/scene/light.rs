//! What a scene file says of light: \[D]'s light list and environment record.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::color::Color;

/// A light of a scene's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// Whether it is on.
    pub on: bool,
    /// Its colour, scene-linear.
    pub color: Color,
    /// What kind of light it is.
    pub kind: LightKind,
}

impl Default for Light {
    fn default() -> Light {
        let kind = LightKind::Parallel { direction: DVec3::NEG_Y, illuminance: 1.0 };
        Light { on: true, color: Color::WHITE, kind }
    }
}

/// The kinds of light of a scene's list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum LightKind {
    /// From infinitely far: the sun.
    Parallel {
        /// The direction in which light travels.
        direction: DVec3,
        /// Illuminance of a surface that faces it, in lux.
        illuminance: f64,
    },
    /// From a point to all sides.
    Point {
        /// Where it is, in metres.
        position: DVec3,
        /// Luminous intensity in candela.
        intensity: f64,
    },
    /// From a point into a cone.
    Spot {
        /// Where it is, in metres.
        position: DVec3,
        /// The direction in which it points.
        direction: DVec3,
        /// Luminous intensity on the axis, in candela.
        intensity: f64,
        /// Half the cone's angle, in degrees.
        angle: f64,
        /// Half the angle of the inner cone, where intensity begins to fall off, in degrees.
        inner_angle: f64,
    },
}

/// \[D]'s environment record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Environment {
    /// Light that is everywhere, scene-linear.
    pub ambient: Color,
    /// What is seen where nothing is, scene-linear.
    pub background: Color,
    /// Share of light lost to fog per metre, 0 or more.
    pub fog: f64,
    /// Cloud cover of the sky: 0 clear, 1 overcast.
    pub overcast: f64,
    /// Whether lights cast shadows.
    pub shadows: bool,
}

impl Default for Environment {
    fn default() -> Environment {
        Environment {
            ambient: Color::BLACK,
            background: Color::BLACK,
            fog: 0.0,
            overcast: 0.0,
            shadows: true,
        }
    }
}
