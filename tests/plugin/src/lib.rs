//! Kinds of node as a studio would write them, on nothing but the engine and the command line: a
//! shader ([`Contours`]), an image node ([`Vignette`]) and a renderer ([`Spheres`]).

mod contours;
mod spheres;
mod vignette;

pub use contours::Contours;
pub use spheres::Spheres;
pub use vignette::Vignette;

use spandrel_engine::graph::Registry;

/// Adds the studio's kinds of node.
pub fn register(registry: &mut Registry) {
    registry.register::<Contours>().register::<Vignette>().register::<Spheres>();
}
