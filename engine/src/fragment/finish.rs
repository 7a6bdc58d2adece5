//! How a surface answers light: \[D]'s "optical attribute data", and a gloss.

use serde::{Deserialize, Serialize};

use crate::color::Color;
use crate::error::{Error, Result};

/// The optical coefficients of a surface. Its colour is apart.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Finish {
    /// Share of the light that is everywhere which its colour reflects, usually 1.
    pub ambient: f32,
    /// Share of all other light that its colour reflects to all sides, in [0, 1].
    pub diffuse: f32,
    /// What shines on it.
    pub gloss: Gloss,
    /// The luminance with which it glows by itself, in cd/m2.
    pub glow: Color,
    /// Whether its normal is the face's own, whatever its vertices say.
    pub flat: bool,
}

impl Finish {
    /// Whether it looks different from different places.
    pub fn shines(&self) -> bool {
        self.gloss != Gloss::None
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// The first that is not, and its range.
    pub fn check(&self) -> Result<()> {
        let share = |what: &str, value: f32| match (0.0..=1.0).contains(&value) {
            true => Ok(()),
            false => Err(Error::invalid(format!("{what} is {value}: must be 0 to 1"))),
        };
        share("diffuse", self.diffuse)?;
        if !(self.ambient.is_finite() && self.ambient >= 0.0) {
            return Err(Error::invalid(format!("ambient is {}: must be 0 or more", self.ambient)));
        }
        if !self.glow.is_finite() || self.glow.to_array().iter().any(|v| *v < 0.0) {
            return Err(Error::invalid("glow must be finite and 0 or more"));
        }
        match self.gloss {
            Gloss::None => Ok(()),
            Gloss::Phong { share: mirrored, exponent } => {
                share("the share of Phong", mirrored)?;
                match exponent.is_finite() && exponent >= 1.0 {
                    true => Ok(()),
                    false => Err(Error::invalid(format!(
                        "the exponent of Phong is {exponent}: must be 1 or more"
                    ))),
                }
            }
            Gloss::Microfacets { reflectance, roughness, metal } => {
                share("reflectance", reflectance)?;
                share("roughness", roughness)?;
                share("metal", metal)
            }
        }
    }
}

impl Default for Finish {
    fn default() -> Finish {
        let (gloss, glow) = (Gloss::None, Color::BLACK);
        Finish { ambient: 1.0, diffuse: 1.0, gloss, glow, flat: false }
    }
}

/// How a surface mirrors light sources.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Gloss {
    /// Not at all: Lambert's law only.
    #[default]
    None,
    /// Phong's lobe around the mirrored direction, normalised: what leaves is never more than arrives.
    Phong {
        /// Share that is mirrored, in [0, 1].
        share: f32,
        /// The lobe's exponent, 1 or more.
        exponent: f32,
    },
    /// Microfacets with the distribution of Trowbridge and Reitz (GGX), Smith's shadowing and Schlick's
    /// reflectance, as glTF has them.
    Microfacets {
        /// Reflectance at normal incidence of what is not metal.
        reflectance: f32,
        /// The square of this is the width of the distribution; 0 is a mirror.
        roughness: f32,
        /// 0 for what has a coloured base under a clear gloss, 1 for metal, whose colour is its gloss's.
        metal: f32,
    },
}
