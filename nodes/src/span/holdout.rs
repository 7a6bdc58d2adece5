//! The node `Holdout`: shows an image only outside, or only inside, a matte.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::{Keep, SpanImage};
use spandrel_engine::values::SpanDemand;

/// Shows an image only where a matte is not in front of it, or only where it is. Opaque faces of
/// the matte cut exactly; translucent ones hold out their share. Where one surface of the image is
/// seen, `Outside` and `Inside` add up to it.
///
/// Example: `Holdout(image: "solids", matte: "panes", keep: Inside)`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Holdout {
    /// The image.
    pub image: Link<SpanImage>,
    /// The matte, seen through the same camera. The matte itself is not shown.
    pub matte: Link<SpanImage>,
    /// What to keep: `Outside`, what the matte does not hide, or `Inside`, what it hides.
    pub keep: Kept,
}

/// What to keep of an image.
#[derive(Clone, Copy, Default, Serialize, Deserialize, JsonSchema)]
pub enum Kept {
    /// What the matte does not hide.
    #[default]
    Outside,
    /// What the matte hides.
    Inside,
}

impl Node for Holdout {
    type Output = SpanImage;
    const KIND: &'static str = "Holdout";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] = &["DeepHoldout", "HoldIn", "Matte", "DeepMatte"];

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.clone());
        upstream.ask(&self.matte, wanted.clone());
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let keep = match self.keep {
            Kept::Outside => Keep::Outside,
            Kept::Inside => Keep::Inside,
        };
        let rows = |link: &Link<SpanImage>| inputs.get(link).of_rows(&wanted.rows);
        rows(&self.image).held(&rows(&self.matte), keep)
    }
}
