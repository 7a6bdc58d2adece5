//! The node `Over`: composites two pictures by alpha (\[D], "Applications", fig. 15).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture::{self, Operator};
use spandrel_engine::values::PictureDemand;

/// Composites one picture over another by alpha, such as a cut-out photograph over a finished
/// picture. The other channels are those of the back.
///
/// Example: `Over(front: "title", back: "picture")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Over {
    /// The picture in front.
    pub front: Link<Image>,
    /// The picture behind it, of the same size.
    pub back: Link<Image>,
    /// Porter and Duff's operator. `Over`: the front over the back. `In`: the front where the back
    /// is. `Out`: the front where the back is not. `Atop`: the front where the back is, and the
    /// back elsewhere. `Xor`: each where the other is not. `Plus`: the sum.
    pub operator: Operator,
}

impl Node for Over {
    type Output = Image;
    const KIND: &'static str = "Over";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["Merge", "AlphaOver", "Composite", "Atop", "Plus"];

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.front, wanted.clone());
        upstream.ask(&self.back, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        picture::composite(&inputs.get(&self.front), &inputs.get(&self.back), self.operator)
    }
}
