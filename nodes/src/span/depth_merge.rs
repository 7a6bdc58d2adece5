//! The node `DepthMerge`: merges images of spans (\[N], "Compositing 3D images").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;

/// Merges span images by depth: the nearest surface is seen everywhere. Any number of images in any
/// order give the same result, bit for bit. Surfaces that cross are cut where they meet.
///
/// Example: `DepthMerge(inputs: ["buildings", "cars", "trees"])`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct DepthMerge {
    /// The images. All must be seen through the same camera.
    pub inputs: Vec<Link<SpanImage>>,
}

impl Node for DepthMerge {
    type Output = SpanImage;
    const KIND: &'static str = "DepthMerge";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] = &["DeepMerge", "ZMerge", "ZCombine", "Merge"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        match self.inputs.len() {
            0 => Err(FieldError::new("inputs", "give at least one image to merge")),
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        self.inputs.iter().for_each(|input| upstream.ask(input, wanted.clone()));
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let rows = |input: &Link<SpanImage>| inputs.get(input).of_rows(&wanted.rows);
        let images: Vec<SpanImage> = self.inputs.iter().map(rows).collect();
        SpanImage::merge(&images)
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        match &self.inputs[..] {
            [only] => Some(only),
            _ => None,
        }
    }
}
