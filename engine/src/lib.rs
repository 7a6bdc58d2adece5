//! Spandrel's engine.

pub mod camera;
pub mod color;
pub mod error;
pub mod fragment;
pub mod key;
pub mod math;
pub mod raster;
pub mod span;

pub use error::{Error, Result};
pub mod scene;
pub mod visible;
