//! Scenes: the geometry, the surfaces and the cameras that files describe.
//!
//! Reading path: [`face`] and [`mesh`] (polygons with holes and seals), [`document`] (plans and the
//! tree of objects, what files hold), [`shape`] (primitives), [`geometry`] (meshes made ready),
//! [`flat`] (a plan made ready: what renderers take), [`read`] (formats).

mod absent;
mod divide;
pub mod document;
mod domains;
pub mod examine;
pub mod face;
pub mod files;
pub mod flat;
mod flatten;
pub mod geometry;
mod lamps;
pub mod library;
mod maps;
pub mod material;
pub mod mesh;
mod mesh_file;
pub mod read;
pub mod shape;
mod shell;
mod smooth;
pub mod surfaces;
pub mod wire;

pub use crate::fragment::Environment;
pub use document::{Display, Document, Object, Plan, Step, Transform};
pub use domains::{Define, Domains};
pub use face::{Back, EdgeStyle, Face, Seal, Sides};
pub use flat::{Instance, Scene};
pub use geometry::{Geometry, Part};
pub use material::{AlphaMode, Map, Material, Picture};
pub use mesh::Mesh;
pub use shape::Shape;
pub use surfaces::SceneSurfaces;

/// Whether a value is its type's default, so that files need not say it.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
