//! What a scene says of its surroundings.

use serde::{Deserialize, Serialize};

use crate::color::Color;

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
