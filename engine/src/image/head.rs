//! What a picture's file says of itself, before it is decoded.

use super::exr::Layers;
use super::format::Format;

/// What a picture's file says of it.
#[derive(Clone, Debug)]
pub struct Head {
    /// The format.
    pub format: Format,
    /// Columns and rows of the whole.
    pub size: (u32, u32),
    /// What its samples are, such as "8 bits, red green blue".
    pub samples: String,
    /// The bytes that it takes when all of it is decoded.
    pub bytes: u64,
    /// The bytes that it takes as a map on a surface, with all of its smaller sizes.
    pub mapped: u64,
    /// Its layers, if it may have some.
    pub layers: Option<Layers>,
    /// What whoever uses it wants to know: its colour space, how it is held, what is left out.
    pub notes: Vec<String>,
}
