//! Span images: what is seen on every line, exactly.
//!
//! A line is a row of cells, run-length coded; in each cell stands the nearest face. Faces carry their
//! plane, so depth is a function and not a sample. [`merge`](SpanImage::merge) of any number of images
//! is the maximum, cell by cell, under the total order of [`order`].
//!
//! Reading path: [`order`] (which face is nearer), [`mod@line`] (a line and the merge of two), [`layer`]
//! (translucent faces), [`face`] (planes and outlines), [`edges`] (outlines by height), [`cut`] (boundaries whose face is gone), [`slopes`] (boundaries that lean), [`image`] (all lines of a picture, and the merge
//! of pictures), [`union`] (ids that mean the same in several pictures), [`probe`] (more lines, where they
//! are wanted), [`renderer`] and [`writer`] (for renderers).

pub mod cut;
pub mod edges;
pub mod edit;
pub mod face;
pub mod hold;
pub mod image;
pub mod layer;
pub mod line;
mod matched;
pub mod order;
pub mod per_line;
pub mod probe;
pub mod renderer;
pub mod seen;
pub mod slopes;
pub mod source;
pub mod union;
pub mod writer;

pub use cut::Cut;
pub use edit::DepthRange;
pub use face::{Edge, Face, FaceHead, FaceId, FaceTable, FaceTableBuilder, Ring, Role};
pub use hold::{Held, Keep};
pub use image::{Cuts, Layers, Lines, SpanImage};
pub use layer::Segment;
pub use line::Span;
pub(crate) use matched::matched;
pub use order::OnLine;
pub use per_line::PerLine;
pub use probe::{Probe, Probing};
pub use renderer::{Candidates, LineRenderer};
pub use seen::Seen;
pub use source::Source;
pub use union::Union;
pub use writer::SpanWriter;

pub use crate::fragment::{Placement, Stage};
