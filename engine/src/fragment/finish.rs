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
    /// Light on its back comes through to all sides, as leaves and paper let it: as a share of what `color` and `diffuse`
    /// would send back of it, each in [0, 1]. It casts the same shadow.
    #[serde(skip_serializing_if = "is_black")]
    pub transmit: Color,
    /// What shines on it.
    #[serde(skip_serializing_if = "is_matt")]
    pub gloss: Gloss,
    /// The luminance with which it glows by itself, in cd/m2.
    pub glow: Color,
    /// Whether it glows with the light of a lamp: that is counted where it comes from, and nothing receives its glow.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_lamp: bool,
    /// Whether its normal is the face's own, whatever its vertices say.
    pub flat: bool,
    /// What rays show of it, if any are followed: \[N]'s reserved mark.
    pub optics: Option<Optics>,
}

/// What of its surroundings a surface shows: \[D]'s reflective and refractive coefficients.
///
/// The front of its faces is its outside. What it mirrors takes the place of its own colour; what comes
/// through it is added.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Optics {
    /// Share of light mirrored, each in [0, 1]; with `fresnel`, of what that law says.
    pub reflect: Color,
    /// Share of light let through, each in [0, 1]; with `fresnel`, of what is not mirrored.
    pub refract: Color,
    /// The index of refraction of its inside against its outside, 0.1 to 10. 1 bends nothing.
    pub index: f32,
    /// Whether shares follow Fresnel's law for light that is not polarised: little is mirrored straight on,
    /// everything at grazing angles.
    pub fresnel: bool,
    /// What its inside takes of light, per metre and natural: exp(-absorb w) is left after w metres.
    pub absorb: Color,
}

impl Default for Optics {
    fn default() -> Optics {
        let (reflect, refract, absorb) = (Color::WHITE, Color::BLACK, Color::BLACK);
        Optics { reflect, refract, index: 1.5, fresnel: true, absorb }
    }
}

impl Optics {
    fn check(&self) -> Result<()> {
        let shares = [("reflect", self.reflect), ("refract", self.refract)];
        for (what, color) in shares {
            if !color.to_array().iter().all(|share| (0.0..=1.0).contains(share)) {
                return Err(Error::invalid(format!("{what} must be 0 to 1")));
            }
        }
        let sums = (self.reflect + self.refract).to_array();
        if !self.fresnel && sums.iter().any(|sum| *sum > 1.0) {
            return Err(Error::invalid("reflect and refract are more than 1 together"));
        }
        if !(0.1..=10.0).contains(&self.index) {
            return Err(Error::invalid(format!("index is {}: must be 0.1 to 10", self.index)));
        }
        if !self.absorb.is_finite() || self.absorb.to_array().iter().any(|v| *v < 0.0) {
            return Err(Error::invalid("absorb must be finite and 0 or more"));
        }
        Ok(())
    }
}

impl Finish {
    /// Whether it looks different from different places.
    pub fn shines(&self) -> bool {
        self.gloss != Gloss::None
    }

    /// Whether light on its back comes through.
    pub fn transmits(&self) -> bool {
        self.transmit != Color::BLACK
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
        if !self.transmit.to_array().iter().all(|share| (0.0..=1.0).contains(share)) {
            return Err(Error::invalid("transmit must be 0 to 1"));
        }
        if !(self.ambient.is_finite() && self.ambient >= 0.0) {
            return Err(Error::invalid(format!("ambient is {}: must be 0 or more", self.ambient)));
        }
        if !self.glow.is_finite() || self.glow.to_array().iter().any(|v| *v < 0.0) {
            return Err(Error::invalid("glow must be finite and 0 or more"));
        }
        if let Some(optics) = &self.optics {
            optics.check()?;
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

fn is_black(color: &Color) -> bool {
    *color == Color::BLACK
}

/// Matt surfaces say nothing of gloss: RON has another `None`.
fn is_matt(gloss: &Gloss) -> bool {
    *gloss == Gloss::None
}

impl Default for Finish {
    fn default() -> Finish {
        let (gloss, glow) = (Gloss::None, Color::BLACK);
        Finish {
            ambient: 1.0,
            diffuse: 1.0,
            transmit: Color::BLACK,
            gloss,
            glow,
            is_lamp: false,
            flat: false,
            optics: None,
        }
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
