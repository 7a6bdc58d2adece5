//! Kinds of node as a studio would write them, on nothing but [`spandrel_engine::plugin`]: a shader ([`Contours`]), an
//! image node ([`Vignette`]), renderers ([`Spheres`], [`Discs`]), a light ([`FalloffLight`]) and a reader of scenes
//! ([`ReadBlocks`]).

mod blocks;
mod contours;
mod discs;
mod falloff;
mod spheres;
mod vignette;

/// What `spandrel new` begins a studio's program with.
#[path = "../../../cli/src/new/tint.rs"]
pub mod tint;

pub use blocks::ReadBlocks;
pub use contours::Contours;
pub use discs::Discs;
pub use falloff::FalloffLight;
pub use spheres::Spheres;
pub use tint::Tint;
pub use vignette::Vignette;

use spandrel_engine::plugin::Registry;

/// Adds the studio's kinds of node.
pub fn register(registry: &mut Registry) {
    registry
        .register::<Contours>()
        .register::<Vignette>()
        .register::<Spheres>()
        .register::<Discs>();
    registry.register::<FalloffLight>().register::<ReadBlocks>().register::<Tint>();
}
