//! The node `Panorama`: makes a panorama of what is behind a scene.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::raster::Raster;
use spandrel_engine::render::background;
use spandrel_engine::resolve::Rule;
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{PictureDemand, SpanDemand};

/// Makes a panorama of what is behind a scene, seen in all directions. It shows the `Background`s
/// of an image of spans over each other, with everything that programs drew on them. The panorama
/// is twice as wide as high. Its middle faces -z and its top is the zenith. `PanoramaLight` lights
/// with it; `Background(by: Direction)` shows it.
///
/// Link a `Background`, or a node that shades or merges it. Images that are moved, or read from a
/// file of spans, have lines of their own, so no panorama can be made of them.
///
/// Example: `Panorama(image: "clouds", rows: 256)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Panorama {
    /// The spans.
    pub image: Link<SpanImage>,
    /// Rows of the panorama.
    #[schemars(range(min = 8, max = 4096))]
    pub rows: u32,
}

impl Default for Panorama {
    fn default() -> Panorama {
        Panorama { image: Link::default(), rows: 256 }
    }
}

impl Node for Panorama {
    type Output = Image;
    const KIND: &'static str = "Panorama";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] =
        &["LatLong", "Equirectangular", "EnvironmentMap", "SphericalCamera"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        Ok(())
    }

    fn demand(&self, _: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        // What stands behind has no lines of its own: the fewest will do.
        let (raster, plan) = (Raster::new(2, 1)?, Rule::Sloped(1).plan()?);
        upstream.ask(&self.image, SpanDemand { raster, plan, rows: 0..1, layered: false });
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let image = inputs.get(&self.image);
        wanted.part(background::panorama(&image, self.rows)?)
    }
}
