//! The node `Blur`: blurs a finished picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture;
use spandrel_engine::values::PictureDemand;

/// Blurs a picture by a Gaussian, colour and alpha.
///
/// Example: `Blur(image: "picture", radius: 0.01)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Blur {
    /// The picture.
    pub image: Link<Image>,
    /// The standard deviation, as a share of the picture's height. The blur then looks alike at
    /// every size.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub radius: f64,
}

impl Default for Blur {
    fn default() -> Blur {
        Blur { image: Link::default(), radius: 0.005 }
    }
}

impl Node for Blur {
    type Output = Image;
    const KIND: &'static str = "Blur";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["Gaussian", "Defocus", "Soften"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        match (0.0..=1.0).contains(&self.radius) {
            true => Ok(()),
            false => Err(FieldError::new("radius", "must be 0 to 1, as a share of the height")),
        }
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.whole());
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let image = inputs.get(&self.image);
        let blurred = picture::blur(&image, self.radius * f64::from(image.size.1))?;
        wanted.part(blurred)
    }

    fn passes(&self) -> Option<&Link<Image>> {
        (self.radius == 0.0).then_some(&self.image)
    }
}
