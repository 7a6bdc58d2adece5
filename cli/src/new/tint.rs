//! A shader: a colour over what lies far away.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::sync::Arc;

/// Mixes a colour into what lies farther from the camera than a distance.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Tint {
    /// The image.
    pub image: Link<SpanImage>,
    /// The colour.
    pub color: Color,
    /// How much of it there is, 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub share: f32,
    /// Where it begins, in metres from the camera.
    #[schemars(range(min = 0.0))]
    pub from: f64,
}

impl Default for Tint {
    fn default() -> Tint {
        Tint { image: Link::default(), color: Color::WHITE, share: 0.5, from: 0.0 }
    }
}

impl Node for Tint {
    type Output = SpanImage;
    const KIND: &'static str = "Tint";
    const GROUP: &'static str = "studio";

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        // The shader is what it is saved as: it does not depend on where its image came from.
        let shader = Tint { image: Link::default(), ..self.clone() };
        inputs.get(&self.image).shaded(Arc::new(shader))
    }
}

#[typetag::serde]
impl Shader for Tint {
    fn reads(&self) -> Columns {
        Columns::COLOR | Columns::DEPTH
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        for i in 0..fragments.len() {
            if fragments.view.distance(fragments.depth[i]) >= self.from {
                let color = fragments.color[i];
                fragments.color[i] = color * (1.0 - self.share) + self.color * self.share;
            }
        }
    }
}
