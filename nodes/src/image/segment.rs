//! The node `Segment`: from a picture to attribute indices (\[D], "Attribute domain"; its fig. 15
//! segments by thresholds).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::picture::{self, Segments};
use spandrel_engine::values::PictureDemand;

/// Divides a picture into numbered regions, by thresholds or by its own colours. The result is a
/// trigger pattern for attribute mapping. Written as a PNG, each byte is the number of the region.
///
/// Example: `Segment(image: "granite", colors: 3)`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Segment {
    /// The picture.
    pub image: Link<Image>,
    /// Display-coded luminances, 0 to 1, each greater than the last. Region 0 is below the first.
    pub thresholds: Vec<f32>,
    /// Without thresholds: how many of the picture's own colours make regions. Each pixel goes to
    /// the nearest; the darkest is 0.
    #[schemars(range(min = 1, max = 256))]
    pub colors: u32,
}

impl Default for Segment {
    fn default() -> Segment {
        Segment { image: Link::default(), thresholds: Vec::new(), colors: 3 }
    }
}

impl Segment {
    fn segments(&self) -> Segments {
        match &self.thresholds[..] {
            [] => Segments::Colors(self.colors),
            thresholds => Segments::Thresholds(thresholds.to_vec()),
        }
    }
}

impl Node for Segment {
    type Output = Image;
    const KIND: &'static str = "Segment";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["Threshold", "TriggerPattern", "Classify", "KMeans"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        let t = &self.thresholds;
        let rises = t.windows(2).all(|pair| pair[0] < pair[1]) && t.iter().all(|t| t.is_finite());
        match rises && t.len() <= 255 {
            true => Ok(()),
            false => Err(FieldError::new("thresholds", "must rise, and be at most 255")),
        }
    }

    fn demand(&self, wanted: &PictureDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        upstream.ask(&self.image, wanted.whole());
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
        let made = picture::segment(&inputs.get(&self.image), &self.segments())?;
        wanted.part(made)
    }
}
