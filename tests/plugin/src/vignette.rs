//! An image node.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::plugin::*;

/// Darkens a picture towards its corners.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Vignette {
    /// The picture.
    pub image: Link<Image>,
    /// Share of light lost in the corners.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub strength: f32,
}

impl Default for Vignette {
    fn default() -> Vignette {
        Vignette { image: Link::default(), strength: 0.3 }
    }
}

impl Node for Vignette {
    type Output = Image;
    const KIND: &'static str = "Vignette";
    const GROUP: &'static str = "studio";

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, _: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let mut image = Image::clone(&inputs.get(&self.image));
        let (window, (width, height)) = (image.window, image.size);
        for name in ["R", "G", "B"] {
            let Some(mut values) = image.float(name).map(<[f32]>::to_vec) else { continue };
            for (i, value) in values.iter_mut().enumerate() {
                let (x, y) =
                    (i as u32 % window.width + window.x, i as u32 / window.width + window.y);
                let across = |at: u32, size: u32| (at as f32 + 0.5) / size as f32 * 2.0 - 1.0;
                let (u, v) = (across(x, width), across(y, height));
                *value *= 1.0 - self.strength * (u * u + v * v) / 2.0;
            }
            image.insert(name, Samples::Float(values))?;
        }
        Ok(image)
    }

    fn passes(&self) -> Option<&Link<Image>> {
        (self.strength == 0.0).then_some(&self.image)
    }
}
