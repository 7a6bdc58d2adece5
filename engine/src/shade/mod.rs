//! Shaders and lights: programs over fragments.

pub mod fog;
pub mod illuminate;
pub mod light;
pub mod picture;
pub mod recolor;

pub use fog::Fog;
pub use illuminate::Illuminate;
pub use light::{Light, ParallelLight};
pub use picture::{PictureColors, PictureFrame};
pub use recolor::Recolor;
