//! The node `DepthScale`: brings an image nearer or farther.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;

/// Brings an image nearer or farther than it was rendered, for merging. Every distance is
/// multiplied by `distance`, and `nearer` is added to its reciprocal. Both keep planes plane, so
/// merges stay exact. There is no offset of the distance itself, because it would bend planes.
///
/// Example: `DepthScale(image: "moved", distance: 0.94)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DepthScale {
    /// The image.
    pub image: Link<SpanImage>,
    /// The factor for all distances, above 0.
    #[schemars(range(min = 1e-9, max = 1e9))]
    pub distance: f64,
    /// Added to 1 / distance, in 1 / metre. With a parallel camera, subtracted from the distance,
    /// in metres.
    pub nearer: f64,
}

impl Default for DepthScale {
    fn default() -> DepthScale {
        DepthScale { image: Link::default(), distance: 1.0, nearer: 0.0 }
    }
}

impl Node for DepthScale {
    type Output = SpanImage;
    const KIND: &'static str = "DepthScale";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] =
        &["DeepTransformZ", "DepthOffset", "ZOffset", "ZScale"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.distance > 0.0 {
            return Ok(());
        }
        Err(FieldError::new("distance", format!("{} is not above 0", self.distance)))
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        inputs.get(&self.image).with_depths(1.0 / self.distance, self.nearer)
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        (self.distance == 1.0 && self.nearer == 0.0).then_some(&self.image)
    }
}
