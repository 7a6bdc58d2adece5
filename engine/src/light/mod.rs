//! Light sources: what they send where, without anything in the way.
//!
//! A [`Light`] is of unit strength and white: its strength, colour and switch stand beside it in a
//! [`Lamp`], so that what is computed of it stays true when it is dimmed, coloured or switched. Where a
//! closed form is known, [`Light::irradiance`] is it; [`Light::sample`] gives the same light in parts, each
//! from one place, for shadows and gloss.
//!
//! Strengths are photometric: parallel light in lux, points in candela, lines in candela per metre,
//! surfaces in candela per square metre, skies in the lux that they give to an open horizontal plane.
//!
//! | source | without shadows |
//! |---|---|
//! | [`ParallelLight`](list::ParallelLight), [`SunLight`](list::SunLight) | the cosine |
//! | [`PointLight`](list::PointLight), [`SpotLight`](list::SpotLight) | cosine over distance squared, times the lamp's [distribution](photometry) |
//! | [`LinearLight`](list::LinearLight) | closed form along the segment |
//! | [`AreaLight`](list::AreaLight), [`PolyhedralLight`](list::PolyhedralLight) | Lambert's formula, cut at the horizon |
//! | [`SkyLight`](list::SkyLight) | closed form if uniform, else a table over normals; a [picture](panorama), by a table |
//! | [`AmbientLight`](list::AmbientLight) | two half-spaces |

pub mod line;
pub mod list;
mod normals;
pub mod panorama;
pub mod photometry;
pub mod point;
pub mod polygon;
pub mod seen;
pub mod sky;
pub mod sun;
pub mod tint;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::fmt::Debug;
use std::sync::{Arc, OnceLock};

use crate::color::Color;
use crate::key::Key;
use crate::trace::Toward;

/// A point of a surface that receives light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Where it is, in metres.
    pub position: DVec3,
    /// The unit normal on the side that is lit.
    pub normal: DVec3,
}

/// Part of a source's light, from one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Where it comes from.
    pub toward: Toward,
    /// The irradiance that the whole source would give if all of it were as this part: the mean over all
    /// samples is the source's.
    pub irradiance: Color,
}

/// A source of unit strength. It is what it is saved as, like a
/// [`Shader`](crate::fragment::Shader).
#[typetag::serde]
pub trait Light: Send + Sync + Debug {
    /// The one place that all light comes from, if it does: its shadows are sharp. Of a [disc](Light::disc),
    /// its middle.
    fn toward(&self) -> Option<Toward>;

    /// If it is a disc that is seen alike from everywhere, such as the sun's: the unit vector to its middle, and its
    /// radius in radians. Shadow volumes take its middle; shadows that are cut or found by rays are soft.
    fn disc(&self) -> Option<(DVec3, f64)> {
        None
    }

    /// Whether nothing can stand in its way.
    fn is_everywhere(&self) -> bool {
        false
    }

    /// Whether its samples are enough for gloss to mirror it. A sky is mirrored by rays.
    fn is_mirrored(&self) -> bool {
        true
    }

    /// What can be seen of it; tubes have a radius in metres, what has no extent nothing.
    fn body(&self, _radius: f64) -> Option<Body> {
        None
    }

    /// What is seen of a sky in a direction, a unit vector, in cd/m2; `None` if it is none.
    fn luminance(&self, _direction: DVec3) -> Option<Color> {
        None
    }

    /// The unit vector to the sun that a sky has been made for, if it has one.
    fn sun(&self) -> Option<DVec3> {
        None
    }

    /// The irradiance of a receiver with nothing in the way, in lux.
    fn irradiance(&self, at: &Receiver) -> Color;

    /// Convex parts that are all that the receiver sees of it, polygons or segments, if they have a closed form.
    fn facets(&self, _at: &Receiver) -> Option<Vec<Vec<DVec3>>> {
        None
    }

    /// The irradiance that a convex part of one of its facets gives, in lux.
    fn of_facet(&self, _points: &[DVec3], _at: &Receiver) -> Color {
        Color::BLACK
    }

    /// A part of the source, chosen by two numbers in [0, 1).
    fn sample(&self, at: &Receiver, choice: DVec2) -> Sample;
}

/// What can be seen of a source: polygons that glow.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its faces.
    pub polygons: Vec<polygon::Polygon>,
    /// Their luminance in cd/m2 if the source is of unit strength.
    pub luminance: f64,
    /// Whether they glow on their backs too.
    pub two_sided: bool,
    /// Whether they are in the way of light, as surfaces are that it comes from.
    pub casts: bool,
}

/// A light with its name, strength and switch.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Lamp {
    /// What it is called: the name of its layer.
    pub name: String,
    /// Whether it is on.
    pub on: bool,
    /// What its unit light is multiplied by.
    pub strength: Color,
    /// The light.
    pub light: Arc<dyn Light>,
    #[serde(skip)]
    key: OnceLock<Key>,
}

impl Lamp {
    /// A lamp. One that is off has no strength, so that all of them are alike.
    pub fn new(name: impl Into<String>, on: bool, strength: Color, light: Arc<dyn Light>) -> Lamp {
        let strength = if on { strength } else { Color::BLACK };
        Lamp { name: name.into(), on, strength, light, key: OnceLock::new() }
    }

    /// The same lamp under another name.
    #[must_use]
    pub fn named(&self, name: impl Into<String>) -> Lamp {
        Lamp { name: name.into(), ..self.clone() }
    }

    /// The same lamp with a share of its strength.
    #[must_use]
    pub fn dimmed(&self, share: f32) -> Lamp {
        Lamp { strength: self.strength * share, ..self.clone() }
    }

    /// What its light is, whatever its strength.
    pub fn key(&self) -> Key {
        *self.key.get_or_init(|| Key::of(&*self.light))
    }

    /// Whether it gives any light.
    pub fn shines(&self) -> bool {
        self.on && self.strength != Color::BLACK
    }
}
