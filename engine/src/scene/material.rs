//! What surfaces look like.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use crate::color::Color;
use crate::fragment::Finish;
use crate::scene::is_default;

/// The attributes of a surface. Faces name their materials; a document holds them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Share of light reflected, scene-linear, each in [0, 1]; for an unlit surface, its radiance.
    pub color: Color,
    /// How much of what lies behind is hidden, in [0, 1].
    #[serde(skip_serializing_if = "is_one")]
    pub alpha: f32,
    /// How `alpha` is read.
    #[serde(skip_serializing_if = "is_default")]
    pub alpha_mode: AlphaMode,
    /// Lights leave it alone: it shows `color` as it is.
    #[serde(skip_serializing_if = "is_default")]
    pub unlit: bool,
    /// How it answers light beside its colour.
    #[serde(skip_serializing_if = "is_default")]
    pub finish: Finish,
    /// It is seen from the front only; from behind the face is not there.
    #[serde(skip_serializing_if = "is_default")]
    pub one_sided: bool,
    /// It casts shadows.
    #[serde(skip_serializing_if = "is_true")]
    pub casts: bool,
    /// Pictures by what they replace or modulate, such as `"color"` or `"normal"`.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub maps: BTreeMap<String, Map>,
}

impl Default for Material {
    fn default() -> Material {
        Material {
            color: Color::grey(0.8),
            alpha: 1.0,
            alpha_mode: AlphaMode::Opaque,
            unlit: false,
            finish: Finish::default(),
            one_sided: false,
            casts: true,
            maps: BTreeMap::new(),
        }
    }
}

impl Material {
    /// How much of what lies behind is hidden where no vertex or picture says more.
    pub fn opacity(&self) -> f32 {
        match self.alpha_mode {
            AlphaMode::Blend => self.alpha.clamp(0.0, 1.0),
            AlphaMode::Opaque | AlphaMode::Mask(_) => 1.0,
        }
    }
}

fn is_true(value: &bool) -> bool {
    *value
}

fn is_one(value: &f32) -> bool {
    *value == 1.0
}

/// How alpha is read (the three modes of glTF).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum AlphaMode {
    /// It is not: the surface hides all that is behind it.
    #[default]
    Opaque,
    /// Either whole or nothing, at this threshold.
    Mask(f32),
    /// As a share.
    Blend,
}

/// A reference to a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Where the picture is.
    pub picture: Picture,
    /// Which set of the mesh's texture coordinates places it.
    #[serde(default, skip_serializing_if = "is_default")]
    pub uv_set: u32,
}

/// Where a picture is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Picture {
    /// In a file; the path is relative to the scene's.
    File(String),
    /// Inside a scene file: the file's path, and the picture's number in it.
    Embedded(String, u32),
}
