//! Shapes: what an object's faces are made from. Primitives become faces when the scene is made
//! ready; curved ones become triangles with a normal at each vertex.
//!
//! Every primitive has a fixed place. Solids on the ground stand on y = 0, centred on the y axis;
//! spheres and tori are centred on the origin.

mod patch;
mod profile;
mod solid;
mod terrain;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

use super::document::Object;
use super::face::{Outline, Seal, Sides};
use super::mesh::Mesh;
use crate::error::{Error, Result};
use crate::text::AnyValue;

/// What an object is made of. Lengths are in metres, angles in degrees.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Shape {
    /// Nothing of its own: a group.
    #[default]
    Group,
    /// Faces given one by one.
    Faces(Mesh),
    /// One face by its corners.
    Polygon {
        /// The corners, counter-clockwise seen from the front.
        outline: Vec<DVec3>,
        /// Transparent areas.
        #[serde(default)]
        holes: Vec<Vec<DVec3>>,
        /// Areas of other materials, the later over the earlier.
        #[serde(default)]
        seals: Vec<Patch>,
    },
    /// A box on the ground.
    Box {
        /// Width along x, height along y, depth along z.
        size: [f64; 3],
    },
    /// A polygon in the ground plane, raised.
    Prism {
        /// Its corners (x, z), in either direction.
        outline: Vec<[f64; 2]>,
        /// Shafts through it.
        #[serde(default)]
        holes: Vec<Vec<[f64; 2]>>,
        /// Height along y.
        height: f64,
    },
    /// A cylinder on the ground.
    Cylinder {
        /// Radius.
        radius: f64,
        /// Height along y.
        height: f64,
        /// Sides of its polygon, 3 or more.
        #[serde(default = "segments")]
        segments: u32,
        /// Whether its side is shaded as round, by interpolated normals.
        #[serde(default = "yes")]
        smooth: bool,
    },
    /// A cone or frustum on the ground.
    Cone {
        /// Radius on the ground.
        radius: f64,
        /// Radius at the top.
        #[serde(default)]
        top_radius: f64,
        /// Height along y.
        height: f64,
        /// Sides of its polygon, 3 or more.
        #[serde(default = "segments")]
        segments: u32,
        /// Whether its side is shaded as round.
        #[serde(default = "yes")]
        smooth: bool,
    },
    /// A sphere about the origin.
    Sphere {
        /// Radius.
        radius: f64,
        /// Sides around the equator, 3 or more; half as many from pole to pole.
        #[serde(default = "segments")]
        segments: u32,
    },
    /// A torus about the y axis, centred on the origin.
    Torus {
        /// Radius of the circle in the middle of the tube.
        radius: f64,
        /// Radius of the tube.
        tube: f64,
        /// Sides around the axis, 3 or more; half as many around the tube.
        #[serde(default = "segments")]
        segments: u32,
    },
    /// A profile turned about the y axis.
    Revolve {
        /// Points (distance from the axis, height). From bottom to top, the surface faces outwards.
        profile: Vec<[f64; 2]>,
        /// Sides around the axis, 3 or more for a full turn.
        #[serde(default = "segments")]
        segments: u32,
        /// How far it is turned, above 0 and at most 360.
        #[serde(default = "full_turn")]
        angle: f64,
        /// Whether the profile is shaded as a smooth curve; the turn always is.
        #[serde(default)]
        smooth: bool,
    },
    /// A profile drawn along a path.
    Sweep {
        /// Points (right, up) of the profile, counter-clockwise looking along the path.
        profile: Vec<[f64; 2]>,
        /// The path.
        path: Vec<DVec3>,
        /// Whether the profile is a closed outline (with ends) or an open strip.
        #[serde(default = "yes")]
        closed: bool,
        /// Whether the path returns to its start.
        #[serde(default)]
        ring: bool,
    },
    /// A bicubic Bezier patch; texture coordinates are its parameters s and t.
    Patch {
        /// Control points: four rows along t of four along s.
        points: [[DVec3; 4]; 4],
        /// Divisions along s and t, 1 to 1024.
        #[serde(default = "divisions")]
        divisions: [u32; 2],
    },
    /// Heights over a grid in the ground plane, centred.
    HeightField {
        /// Rows of heights. The first row is at the least z; each starts at the least x.
        heights: Vec<Vec<f64>>,
        /// Extent along x and z.
        size: [f64; 2],
        /// Whether it is shaded as a smooth surface.
        #[serde(default = "yes")]
        smooth: bool,
    },
    /// Fractal hills in the ground plane, by midpoint displacement.
    Terrain {
        /// Extent along x and z.
        size: [f64; 2],
        /// Half the greatest height difference of the first division.
        height: f64,
        /// The share of the displacement that remains after each halving, in (0, 1): 0.5 gives
        /// smooth hills.
        #[serde(default = "roughness")]
        roughness: f64,
        /// Halvings of the grid, 1 to 11.
        #[serde(default = "levels")]
        levels: u32,
        /// The seed that selects the hills.
        #[serde(default)]
        seed: u64,
        /// Whether it is shaded as a smooth surface.
        #[serde(default)]
        smooth: bool,
    },
    /// Everything that a scene file shows, in any format that can be read.
    File {
        /// The file, relative to the one that names it.
        path: String,
        /// The plan in it.
        #[serde(default)]
        plan: Option<String>,
        /// Metres per unit of the file. If absent, what the format says.
        #[serde(default)]
        unit: Option<f64>,
        /// The axis that points up in the file. If absent, what the format says.
        #[serde(default)]
        up: Option<super::document::Axis>,
        /// What the parameters of a scene in RON are, by name. If absent, as the file has them.
        #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
        parameters: BTreeMap<String, AnyValue>,
    },
    /// One of the plan's definitions.
    Instance(String),
    /// An object repeated along x, y and z.
    Array {
        /// The object.
        of: std::boxed::Box<Object>,
        /// How often along x, y, z.
        count: [u32; 3],
        /// The distance from one to the next along x, y, z.
        step: [f64; 3],
    },
}

/// A seal of a [`Shape::Polygon`].
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Patch {
    /// Its corners, in the polygon's plane.
    pub outline: Vec<DVec3>,
    /// Its material.
    pub material: Option<String>,
}

fn segments() -> u32 {
    32
}
fn divisions() -> [u32; 2] {
    [8, 8]
}
fn yes() -> bool {
    true
}
fn full_turn() -> f64 {
    360.0
}
fn roughness() -> f64 {
    0.5
}
fn levels() -> u32 {
    6
}

impl Shape {
    /// The faces of a shape that has faces of its own.
    ///
    /// # Errors
    /// If a parameter is out of range, or if the shape stands for other objects ([`Shape::File`],
    /// [`Shape::Instance`], [`Shape::Array`]).
    pub fn mesh(&self) -> Result<Mesh> {
        match self {
            Shape::Group => Ok(Mesh::default()),
            Shape::Faces(mesh) => Ok(mesh.clone()),
            Shape::Polygon { outline, holes, seals } => polygon(outline, holes, seals),
            Shape::Box { size } => solid::cuboid(*size),
            Shape::Prism { outline, holes, height } => solid::prism(outline, holes, *height),
            Shape::Cylinder { radius, height, segments, smooth } => {
                solid::frustum(*radius, *radius, *height, *segments, *smooth)
            }
            Shape::Cone { radius, top_radius, height, segments, smooth } => {
                solid::frustum(*radius, *top_radius, *height, *segments, *smooth)
            }
            Shape::Sphere { radius, segments } => solid::sphere(*radius, *segments),
            Shape::Torus { radius, tube, segments } => solid::torus(*radius, *tube, *segments),
            Shape::Revolve { profile, segments, angle, smooth } => {
                profile::revolve(profile, *segments, *angle, *smooth)
            }
            Shape::Sweep { profile, path, closed, ring } => {
                profile::sweep(profile, path, *closed, *ring)
            }
            Shape::Patch { points, divisions } => patch::bicubic(points, *divisions),
            Shape::HeightField { heights, size, smooth } => {
                terrain::height_field(heights, *size, *smooth)
            }
            Shape::Terrain { size, height, roughness, levels, seed, smooth } => {
                let heights = terrain::displaced(*height, *roughness, *levels, *seed)?;
                terrain::height_field(&heights, *size, *smooth)
            }
            Shape::File { .. } | Shape::Instance(_) | Shape::Array { .. } => {
                Err(Error::invalid("an instance, array or file has no faces of its own"))
            }
        }
    }
}

fn polygon(outline: &[DVec3], holes: &[Vec<DVec3>], seals: &[Patch]) -> Result<Mesh> {
    let mut mesh = Mesh::default();
    let ring = |mesh: &mut Mesh, points: &[DVec3]| -> Outline {
        points.iter().map(|point| mesh.add_point(*point)).collect()
    };
    let mut face = super::face::Face { outline: ring(&mut mesh, outline), ..Default::default() };
    for hole in holes {
        face.holes.push(ring(&mut mesh, hole));
    }
    for seal in seals {
        let front = seal.material.as_ref().map(|name| mesh.material(name));
        let sides = Sides { front, ..Sides::default() };
        face.seals.push(Seal { outline: ring(&mut mesh, &seal.outline), sides, edge: None });
    }
    mesh.add_face(face)?;
    mesh.validate()?;
    Ok(mesh)
}

/// A length, which must be a positive number.
fn positive(name: &str, value: f64) -> Result<f64> {
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(Error::invalid(format!("`{name}` is {value}: must be a number above 0")))
    }
}

/// A count within a range.
fn within(name: &str, value: u32, range: std::ops::RangeInclusive<u32>) -> Result<u32> {
    if range.contains(&value) {
        Ok(value)
    } else {
        let (low, high) = (range.start(), range.end());
        Err(Error::invalid(format!("`{name}` is {value}: must be {low} to {high}")))
    }
}

/// The most sides of a round shape.
const MAX_SEGMENTS: u32 = 4096;
