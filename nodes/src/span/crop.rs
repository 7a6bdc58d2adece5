//! The node `Crop`: a window of an image of spans.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;

/// Keeps what an image shows inside a window. Outside it, nothing is seen.
///
/// Example: `Crop(image: "town", window: (0.6, 0.3, 0.4, 0.6))`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Crop {
    /// The image.
    pub image: Link<SpanImage>,
    /// Left, top, width and height, as shares of the picture from 0 to 1. The window is then the
    /// same at every size.
    #[schemars(extend("x-parts" = ["left", "top", "width", "height"]))]
    pub window: (f64, f64, f64, f64),
}

impl Default for Crop {
    fn default() -> Crop {
        Crop { image: Link::default(), window: (0.0, 0.0, 1.0, 1.0) }
    }
}

impl Node for Crop {
    type Output = SpanImage;
    const KIND: &'static str = "Crop";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] = &["DeepCrop", "Window", "Region"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let (.., width, height) = self.window;
        if width > 0.0 && height > 0.0 {
            return Ok(());
        }
        Err(FieldError::new("window", "give left, top, width and height; the last two above 0"))
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let (left, top, width, height) = self.window;
        let (w, h) = (f64::from(wanted.raster.width), f64::from(wanted.raster.height));
        let image = inputs.get(&self.image);
        Ok(image.cropped(left * w..(left + width) * w, top * h..(top + height) * h))
    }
}
