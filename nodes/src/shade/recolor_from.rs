//! The node `RecolorFrom`: puts a painted picture back onto surfaces.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::shade::{PictureColors, PictureFrame};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::{Override, PictureDemand, SpanDemand};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Gives the surfaces of an image the colours of a flat picture of it. A picture that was graded or
/// painted in another program goes back onto the surfaces, and merges and hides as they do. A
/// picture of another size is stretched over the image, as if projected from the camera. Where it
/// has no pixels, surfaces are black. Lights that follow act on these colours as on any others, so
/// recolour after lighting, or light after recolouring, but not both. A span file holds the picture
/// too.
///
/// Example: `RecolorFrom(image: "town", picture: "painted.png")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct RecolorFrom {
    /// The image.
    pub image: Link<SpanImage>,
    /// The picture.
    pub picture: Link<Image>,
}

impl Node for RecolorFrom {
    type Output = SpanImage;
    const KIND: &'static str = "RecolorFrom";
    const GROUP: &'static str = "shade";
    const ALIASES: &'static [&'static str] = &["DeepRecolor", "DeepFromImage", "Project3D"];

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        let size = Some((wanted.raster.width, wanted.raster.height));
        let changed = Override { size, ..Override::default() };
        upstream.ask(
            &self.picture,
            PictureDemand { channels: BTreeSet::from([Channel::Color]), changed },
        );
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let picture = inputs.get(&self.picture);
        let window = picture.window;
        let frame = PictureFrame {
            size: picture.size,
            corner: (window.x, window.y),
            part: (window.width, window.height),
        };
        let colors = PictureColors::new(frame, picture.pixels())?;
        inputs.get(&self.image).shaded(Arc::new(colors))
    }
}
