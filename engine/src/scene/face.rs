//! Faces, seals and holes (\[D], "Geometry data structure").
//!
//! A face is a polygon, convex or concave, with any number of *holes*, areas that are always
//! transparent, and *seals*, areas with attributes of their own that are seen over the face. A mesh
//! is the list of an object's faces over shared vertices; curved surfaces are triangles whose vertices
//! carry normals (\[N], "Image data structure").
//!
//! What the papers leave open, decided here and tested:
//! - The face is inside its outline by the even-odd rule and outside every hole; an outline that
//!   crosses itself, or a hole that crosses it or another hole, follows from that.
//! - A hole is transparent even under a seal. A seal is cut at its face's outline.
//! - Of overlapping seals the later is seen.
//! - A seal lies in its face's plane, whatever its own points say.

use serde::{Deserialize, Serialize};

use crate::color::Color;

/// A polygon as indices of a mesh's vertices, three or more, counter-clockwise seen from the front. A
/// hole or seal may run either way.
pub type Outline = Vec<u32>;

/// A face: what a mesh stores, as a value.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Face {
    /// The polygon.
    pub outline: Outline,
    /// Areas inside it that are transparent.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub holes: Vec<Outline>,
    /// Areas inside it with attributes of their own. The later is seen over the earlier.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub seals: Vec<Seal>,
    /// What its sides look like.
    #[serde(skip_serializing_if = "Sides::is_default")]
    pub sides: Sides,
    /// How its edges are drawn, and those of its holes. Absent: not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge: Option<EdgeStyle>,
}

/// An area on a face, seen over it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Seal {
    /// The polygon, in the face's plane.
    pub outline: Outline,
    /// What its sides look like.
    #[serde(skip_serializing_if = "Sides::is_default")]
    pub sides: Sides,
    /// How its edges are drawn. Absent: not.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edge: Option<EdgeStyle>,
}

/// The attributes of the two sides of a face or seal, as indices of the mesh's materials.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sides {
    /// The front's material; absent, the object's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front: Option<u32>,
    /// The back.
    #[serde(skip_serializing_if = "Back::is_default")]
    pub back: Back,
}

impl Sides {
    fn is_default(&self) -> bool {
        *self == Sides::default()
    }
}

/// The back of a face or seal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Back {
    /// Looks as the front.
    #[default]
    Same,
    /// Has a material of its own.
    Material(u32),
}

impl Back {
    fn is_default(&self) -> bool {
        *self == Back::default()
    }
}

/// How edges are drawn: as lines on the picture, antialiased, at the face's depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EdgeStyle {
    /// Scene-linear colour, not lit.
    pub color: Color,
    /// Width in pixels of the raster that visibility is solved for, above 0.
    pub width: f32,
}

impl Default for EdgeStyle {
    fn default() -> EdgeStyle {
        EdgeStyle { color: Color::BLACK, width: 1.0 }
    }
}
