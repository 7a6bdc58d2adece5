//! Spandrel's engine.

pub mod camera;
pub mod color;
pub mod error;
pub mod fragment;
pub mod graph;
pub mod image;
pub mod key;
pub mod math;
pub mod output;
pub mod raster;
pub mod resolve;
pub mod scene;
pub mod shade;
pub mod span;
pub mod visible;

pub use error::{Error, Result};
pub mod values;
