//! Materials: what surfaces look like (\[D], "Attribute data structure").

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::domains::Domains;
use crate::color::Color;
use crate::fragment::Finish;
use crate::scene::is_default;
use crate::texture::Mapping;

/// The attributes of a surface. Faces name their materials; a document holds them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Material {
    /// Share of light reflected, scene-linear, each in [0, 1]. For an unlit surface, its radiance.
    pub color: Color,
    /// How much of what is behind is hidden, in [0, 1].
    #[serde(skip_serializing_if = "is_one")]
    pub alpha: f32,
    /// How `alpha` is read.
    #[serde(skip_serializing_if = "is_default")]
    pub alpha_mode: AlphaMode,
    /// Lights do not change it: it shows `color` as it is.
    #[serde(skip_serializing_if = "is_default")]
    pub unlit: bool,
    /// How it reflects light, besides its colour.
    #[serde(skip_serializing_if = "is_default")]
    pub finish: Finish,
    /// It is seen only from the front. From behind, the face is not there.
    #[serde(skip_serializing_if = "is_default")]
    pub one_sided: bool,
    /// It casts shadows.
    #[serde(skip_serializing_if = "is_true")]
    pub casts: bool,
    /// Pictures on the surface, by what they change.
    ///
    /// | name | is | strength |
    /// |---|---|---|
    /// | `color` | a colour, times the material's, and an alpha | how much of it there is |
    /// | `alpha` | numbers, times the material's alpha | the same |
    /// | `normal` | unit vectors, (1, 1, 1) coding 1: right, up, out | of the part that leans sideways |
    /// | `bump` | heights | metres between 0 and 1 |
    /// | `metallic_roughness` | numbers, times roughness (green) and metal (blue) of `Microfacets` | how much of it there is |
    /// | `occlusion` | numbers (red), times light from everywhere | the same |
    /// | `emission` | a colour, times the glow | the same |
    /// | `reflection` | a panorama that is mirrored, whatever the scene | cd/m2 of white |
    /// | `reflect`, `refract` | a colour, times that of the optics | how much of it there is |
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub maps: BTreeMap<String, Map>,
    /// Divides the surface into domains, each of which looks like another material (\[D],
    /// "Attribute mapping"). The material's own colour and maps are not seen. Whether it casts and
    /// is one-sided still counts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub domains: Option<Domains>,
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
            domains: None,
        }
    }
}

impl Material {
    /// Whether part of it is absent: where pictures say so, or all of it.
    pub fn is_cut(&self) -> bool {
        let by_picture = ["color", "alpha"].iter().any(|name| self.maps.contains_key(*name));
        match self.alpha_mode {
            AlphaMode::Opaque => false,
            AlphaMode::Mask(from) => from > 0.0 && (by_picture || self.alpha < from),
            AlphaMode::Blend => by_picture,
        }
    }

    /// Whether anything may be seen through it.
    pub fn lets_through(&self) -> bool {
        self.is_cut() || self.opacity() < 1.0
    }

    /// How much of what is behind is hidden where no vertex or picture says more.
    pub fn opacity(&self) -> f32 {
        match self.alpha_mode {
            AlphaMode::Blend => self.alpha.clamp(0.0, 1.0),
            AlphaMode::Mask(from) if self.alpha < from => 0.0,
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
    /// Alpha is ignored: the surface hides everything behind it.
    #[default]
    Opaque,
    /// All or nothing, at this threshold.
    Mask(f32),
    /// As a share.
    Blend,
}

/// A picture on a surface, and how it is placed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Map {
    /// Where the picture is.
    pub picture: Picture,
    /// How much of it there is: see [`Material::maps`].
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub strength: f32,
    /// How it is placed on the surface.
    #[serde(default, skip_serializing_if = "is_default")]
    pub mapping: Mapping,
}

impl Map {
    /// A picture, placed by the vertices' coordinates.
    pub fn of(picture: Picture) -> Map {
        Map { picture, strength: 1.0, mapping: Mapping::default() }
    }
}

fn one() -> f32 {
    1.0
}

/// Where a picture is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Picture {
    /// In a file; the path is relative to the scene's.
    File(String),
    /// Inside a scene file: the file's path, and the picture's number in it.
    Embedded(String, u32),
    /// Not in a file: this many waves from left to right and from bottom to top, between 0 and 1
    /// (\[D], "functional bump generator").
    Wave(f64, f64),
    /// In a file, whose pixels are taken as sRGB and not turned, whatever the file says about its
    /// colours and orientation. glTF requires this.
    Raw(String),
}

impl Picture {
    /// The picture's own file, relative to the scene's.
    pub fn file(&self) -> Option<&str> {
        match self {
            Picture::File(path) | Picture::Raw(path) => Some(path),
            Picture::Embedded(..) | Picture::Wave(..) => None,
        }
    }

    /// The file that holds it: its own, or a scene's.
    pub(super) fn path_mut(&mut self) -> Option<&mut String> {
        match self {
            Picture::File(path) | Picture::Raw(path) | Picture::Embedded(path, _) => Some(path),
            Picture::Wave(..) => None,
        }
    }
}
