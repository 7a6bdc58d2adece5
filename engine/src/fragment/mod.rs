//! Shading as a stream of fragments.
//!
//! After visibility nothing touches pixels. A *fragment* is a visible face in a pixel (or, where its
//! shading is the same all over, a face): a point on it and the pixel's share that it covers. Programs
//! run over batches of fragments, as Perlin's Pixel Stream Editor ran over stored pixels. Two traits
//! say who does what:
//!
//! - [`Surfaces`]: what a source knows of its own faces: colour, normal and the rest.
//! - [`Shader`]: a program of the [shading stack](stack), which reads columns and changes them.
//!
//! Both declare the columns that they touch, and only those are computed: a picture without lights
//! computes no normal. What a shader may know beside its fragments is [`Around`] them: the [`World`] of
//! everything that could cast a shadow on them or be mirrored in them, and what is kept of them from one
//! picture to the next.

mod alike;
mod batch;
mod columns;
mod environment;
mod finish;
mod fragments;
mod layers;
mod painted;
mod shader;
pub mod stack;
mod surfaces;
mod world;

pub use alike::Alike;
pub(crate) use alike::Compared;
pub use batch::{Anywhere, Batch, Casting, Kept, LinePiece};
pub use columns::Columns;
pub use environment::Environment;
pub use finish::{Finish, Gloss, Optics};
pub use fragments::{FAR, Fragments, Local, Meeting, Sight, Uv};
pub use layers::LightLayers;
pub use painted::{Painted, PaintedPart, PictureSet, PictureShare};
pub use shader::{Around, Hiding, Shader};
pub use stack::{Placement, Shading, Stage};
pub use surfaces::{FacePart, Origin, Pictured, Provenance, RayTarget, Surfaces, object_name};
pub use world::{Member, World, beyond};
