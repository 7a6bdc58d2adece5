//! All that a studio's own nodes need, in one place.
//!
//! A node is a struct: links and parameters are its fields, their documentation is its manual, and
//! [`Node`] says what it asks of its links and what it makes of them. A program registers the kinds that it wants, those of
//! the library and its own, and runs the same command line. `spandrel new NAME` writes such a program, ready to be
//! built.
//!
//! | to add | write | makes | example |
//! |---|---|---|---|
//! | an image node | a [`Node`] | an [`Image`] | `tests/plugin/src/vignette.rs` |
//! | a shader | a [`Node`] that puts a [`Shader`] on the stacks of an image, by [`SpanImage::shaded`] | a [`SpanImage`] | `tests/plugin/src/contours.rs` |
//! | a span node | a [`Node`] that merges, cuts, moves ([`SpanImage`] has the operations) | a [`SpanImage`] | `nodes/src/span/holdout.rs` |
//! | a renderer | a [`Node`] that declares faces to a [`SpanWriter`] and has a [`LineRenderer`] find them on lines, and [`Surfaces`] that know their colours and normals | a [`SpanImage`] | `tests/plugin/src/discs.rs` |
//! | a renderer that knows but some lines | the same, with the segments written to the [`SpanWriter`]; nothing divides its pixels | a [`SpanImage`] | `tests/plugin/src/spheres.rs` |
//! | a light | a [`Node`] that makes [`Lamps`] of a [`Light`] | [`Lamps`] | `tests/plugin/src/falloff.rs` |
//! | a reader of scenes | a [`Node`] that reads a file by [`read_bytes`] and builds a [`Document`] | a [`Scene`] | `tests/plugin/src/blocks.rs` |
//!
//! # What holds for all of them
//!
//! - **Demand comes first.** [`Node::demand`] is told what is wanted of the node and [asks](Upstream::ask) its links for
//!   what it needs. A link that is not asked for is not computed. [`Node::evaluate`] then [gets](Inputs::get) what was
//!   asked for.
//! - **Nobody writes keys.** A value is known by the node's kind, its parameters, its inputs and the files that were
//!   read. Read files by [`read_bytes`] and [`read_text`]: they are remembered, and a changed file is read again. A node
//!   that needs a link's *name* has a [`NamedLink`].
//! - **Shaders, lights and surfaces are what they are saved as.** They derive `Serialize` and `Deserialize`, and
//!   `#[typetag::serde]` stands on their `impl`. Two that are saved alike are alike.
//! - **Long work can be stopped.** Ask [`Inputs::watch`] every few milliseconds whether it [is
//!   stopped](Watch::is_stopped), and leave early if it is.
//! - **Time needs nothing of a node.** Its fields may be curves and expressions; it is told what they are. A node that
//!   reads something that moves says so by [`Node::moves`], and [`Inputs::moment`] tells it when. One that needs its
//!   input at several moments [asks](Upstream::ask_at) for them.
//! - **What takes long may be stored.** With [`Node::STORED`], what a node makes is kept on disk where the user wants
//!   that; its [`Value`] says how it becomes bytes. [`Inputs::remembered`] stores a part of the work.
//! - **Surfaces say who else may ask them.** [`Surfaces`] alone have a colour. [`Surfaces::rays`] lets them cast shadows
//!   and be met by rays ([`RayTarget`]), [`Surfaces::pictures`] divides the reading of many pictures ([`Pictured`]),
//!   [`Surfaces::provenance`] knows names and files ([`Provenance`]).
//! - **Errors say what is wrong and the cure.** [`Node::check`] finds what types and ranges cannot say, before anything
//!   is computed; its [`FieldError`] is shown at the field's place in the graph.
//! - **Pictures do not depend on the machine.** Use [`math`] for sines, powers and logarithms.
//!
//! # A node in a page
//!
//! ```
//! use schemars::JsonSchema;
//! use serde::{Deserialize, Serialize};
//! use spandrel_engine::plugin::*;
//!
//! /// Swaps a picture's left and right.
//! #[derive(Serialize, Deserialize, JsonSchema, Default)]
//! #[serde(deny_unknown_fields, default)]
//! pub struct Flop {
//!     /// The picture.
//!     pub image: Link<Image>,
//! }
//!
//! impl Node for Flop {
//!     type Output = Image;
//!     const KIND: &'static str = "Flop";
//!     const GROUP: &'static str = "studio";
//!
//!     fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
//!         // A window of the result is another window of the input: the whole is simpler.
//!         upstream.ask(&self.image, wanted.whole());
//!         Ok(())
//!     }
//!
//!     fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
//!         let mut image = Image::clone(&inputs.get(&self.image));
//!         let width = image.window.width as usize;
//!         for name in ["R", "G", "B", "A"] {
//!             let Some(values) = image.float(name) else { continue };
//!             let flopped = values.chunks(width).flat_map(|row| row.iter().rev().copied()).collect();
//!             image.insert(name, Samples::Float(flopped))?;
//!         }
//!         wanted.part(image)
//!     }
//! }
//!
//! let mut registry = Registry::new();
//! registry.register::<Flop>();
//! assert!(registry.kind("Flop").is_some());
//! ```

pub use crate::camera::{Camera, Plane, View};
pub use crate::color::Color;
pub use crate::error::{Error, Result};
pub use crate::fragment::{
    Around, Columns, Fragments, LightLayers, Pictured, Provenance, RayTarget, Shader, Surfaces,
};
pub use crate::graph::node::FieldError;
pub use crate::graph::{
    Demand, InFile, Inputs, Link, NamedLink, Node, OutFile, Registry, Upstream, Value,
};
pub use crate::image::{Channel, Image, Samples, Window};
pub use crate::key::Key;
pub use crate::light::{Body, Lamp, Light, Receiver, Sample};
pub use crate::math;
pub use crate::moment::Moment;
pub use crate::open::{bytes as read_bytes, text as read_text};
pub use crate::raster::{LinePlan, Raster};
pub use crate::scene::{Document, Material, Mesh, Object, Plan, Scene, Shape, Step, Transform};
pub use crate::span::{Candidates, FaceHead, FaceId, LineRenderer, Role, SpanImage, SpanWriter};
pub use crate::trace::{Casters, CastersBuilder, Toward};
pub use crate::values::{Delivery, Lamps, Override, PictureDemand, SpanDemand};
pub use crate::volume::{Inside, Volume, isosurface};
pub use crate::watch::Watch;
