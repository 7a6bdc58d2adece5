//! Shaders: programs over fragments.

mod beyond;
pub mod bounces;
mod clipped;
mod direct;
pub mod display;
pub mod fog;
mod follow;
mod gloss;
pub mod illuminate;
mod openings;
mod pattern;
pub mod picture;
mod plane;
pub mod recolor;
mod recorded;
mod records;
mod reflected;
mod shards;
pub mod stream;
pub mod trace;

pub use bounces::{Bounces, Gather};
pub use display::{Display, DisplayView};
pub use fog::{Fog, FogHeight, FogLaw};
pub use illuminate::{Illuminate, Shadows};
pub use picture::{PictureColors, PictureFrame};
pub use recolor::Recolor;
pub use stream::Stream;
pub use trace::Trace;
