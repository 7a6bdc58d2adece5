//! The node `DepthSlice`: a range of depth of an image of spans.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::{DepthRange, SpanImage};
use spandrel_engine::values::SpanDemand;

/// Keeps what is between two distances along the view axis. Faces that reach beyond them are cut
/// there, antialiased. What is hidden behind the nearest opaque faces is not in the image, so it
/// cannot appear.
///
/// Example: `DepthSlice(image: "town", near: 14, far: 16)`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct DepthSlice {
    /// The image.
    pub image: Link<SpanImage>,
    /// The nearest distance, in metres. If absent, from the eye.
    pub near: Option<f64>,
    /// The farthest distance, in metres. If absent, to infinity.
    pub far: Option<f64>,
}

impl Node for DepthSlice {
    type Output = SpanImage;
    const KIND: &'static str = "DepthSlice";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] = &["DeepSlice", "DeepCropZ", "ZSlice"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        match (self.near, self.far) {
            (Some(near), Some(far)) if near > far => {
                Err(FieldError::new("far", format!("{far} is nearer than `near`, {near}")))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let image = inputs.get(&self.image);
        let view = image.view();
        // Before the eye of a perspective camera there is no distance below 0.
        let near = self.near.filter(|near| view.is_parallel() || *near > 0.0);
        let range = DepthRange {
            front: near.map(|near| view.depth(near)),
            back: self.far.map(|far| view.depth(far)),
        };
        Ok(image.sliced(range))
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        (self.near.is_none() && self.far.is_none()).then_some(&self.image)
    }
}
