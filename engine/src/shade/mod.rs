//! Shaders: programs over fragments.

mod clipped;
pub mod fog;
mod gloss;
pub mod illuminate;
mod pattern;
pub mod picture;
pub mod recolor;
pub mod stream;
pub mod trace;

pub use fog::{Fog, FogHeight, FogLaw};
pub use illuminate::{Illuminate, Shadows};
pub use picture::{PictureColors, PictureFrame};
pub use recolor::Recolor;
pub use stream::Stream;
pub use trace::Trace;
