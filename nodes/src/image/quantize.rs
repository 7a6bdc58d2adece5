//! The node `Quantize`: reduces a picture to a palette (\[D], "System overview of RSP").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::color::Color;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture::{self, Dither, Palette};
use spandrel_engine::values::PictureDemand;

/// Shows a picture in a few colours, for displays with a palette. The palette is the picture's own
/// or given.
///
/// Example: `Quantize(image: "picture", colors: 16, dither: Diffused)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Quantize {
    /// The picture.
    pub image: Link<Image>,
    /// How many colours its own palette has, chosen by k-means.
    #[schemars(range(min = 1, max = 256))]
    pub colors: u32,
    /// If given, these colours are used instead; at most 256.
    pub palette: Vec<Color>,
    /// How colours between those of the palette are shown: `None`, `Ordered(strength)` or
    /// `Diffused` (Floyd and Steinberg).
    pub dither: Dither,
}

impl Default for Quantize {
    fn default() -> Quantize {
        let (colors, dither) = (16, Dither::Diffused);
        Quantize { image: Link::default(), colors, palette: Vec::new(), dither }
    }
}

impl Node for Quantize {
    type Output = Image;
    const KIND: &'static str = "Quantize";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["Posterize", "Palette", "Dither", "IndexedColor"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.palette.len() > 256 {
            return Err(FieldError::new("palette", "has at most 256 colours"));
        }
        match self.dither {
            Dither::Ordered(by) if !(0.0..=16.0).contains(&by) => {
                Err(FieldError::new("dither", "Ordered: the strength must be 0 to 16"))
            }
            _ => Ok(()),
        }
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        // The colours are those of all of it.
        upstream.ask(&self.image, wanted.whole());
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let palette = match &self.palette[..] {
            [] => Palette::Own(self.colors),
            given => Palette::Given(given.to_vec()),
        };
        let made = picture::quantize(&inputs.get(&self.image), &palette, self.dither)?;
        wanted.part(made)
    }
}
