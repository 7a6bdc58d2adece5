//! Pictures on surfaces: kept as pyramids, within a limit of bytes, and filtered by what a pixel covers of
//! them (\[N], "Texture mapping"; \[D], "Attribute mapping", processes 2 and 3).

mod cover;
mod filter;
mod mapping;
mod pyramid;
mod store;

pub use cover::is_in;
pub use filter::{Footprint, Sample, TextureFilter, Wrap};
pub use mapping::{By, Mapping, SurfacePoint};
pub use pyramid::{Level, Meaning, pyramid};
pub use store::{Opened, PictureSource, Store, StoreReport, store};
