//! A shader.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;
use std::sync::Arc;

/// Draws lines of equal height on all surfaces, as on a map.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Contours {
    /// The image.
    pub image: Link<SpanImage>,
    /// Height from line to line, in metres.
    #[schemars(range(min = 0.001))]
    pub interval: f64,
    /// Share of the interval that a line takes.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub width: f64,
    /// The lines' colour.
    pub color: Color,
}

impl Default for Contours {
    fn default() -> Contours {
        Contours { image: Link::default(), interval: 1.0, width: 0.1, color: Color::BLACK }
    }
}

impl Node for Contours {
    type Output = SpanImage;
    const KIND: &'static str = "Contours";
    const GROUP: &'static str = "studio";

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        // What it is does not depend on where its image came from.
        let shader = Contours { image: Link::default(), ..self.clone() };
        inputs.get(&self.image).shaded(Arc::new(shader))
    }
}

#[typetag::serde]
impl Shader for Contours {
    fn reads(&self) -> Columns {
        Columns::COLOR | Columns::POSITION
    }

    fn shade(&self, fragments: &mut Fragments<'_>, _: &Around<'_>) {
        for (color, position) in fragments.color.iter_mut().zip(&fragments.position) {
            let phase = (position.y / self.interval).rem_euclid(1.0);
            if phase < self.width {
                *color = self.color;
            }
        }
    }
}
