//! The node `Transform`: moves an image of spans over the picture.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::values::SpanDemand;
use spandrel_engine::{Error, Result};

/// Moves an image over the picture, with its depths, to merge it elsewhere. To show a whole picture
/// moved or scaled, use `pan` and `scale` of `Resolve`.
///
/// Example: `Transform(image: "part", translate: (-460, 40))`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Transform {
    /// The image.
    pub image: Link<SpanImage>,
    /// How far to move, right and down, in pixels of the raster. The move down must land on lines:
    /// with n lines per row, a multiple of 1 / n.
    #[schemars(extend("x-parts" = ["right", "down"]))]
    pub translate: (f64, f64),
}

impl Transform {
    /// How many lines it moves down.
    fn lines(&self, wanted: &SpanDemand) -> Result<i64> {
        let n = f64::from(wanted.plan.per_row);
        let lines = self.translate.1 * n;
        let whole = lines.round();
        if (lines - whole).abs() > 1e-9 || whole.abs() > 1e9 {
            return Err(Error::invalid(format!(
                "{} pixels down do not land on lines, of which there are {n} to a row: {} do",
                self.translate.1,
                whole / n
            )));
        }
        Ok(whole as i64)
    }
}

impl Node for Transform {
    type Output = SpanImage;
    const KIND: &'static str = "Transform";
    const GROUP: &'static str = "span";
    const ALIASES: &'static [&'static str] = &["DeepTransform", "Translate", "Move", "Position"];

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        let lines = self.lines(wanted)?;
        let per_row = f64::from(wanted.plan.per_row);
        let height = f64::from(wanted.raster.height);
        let from = |row: u32, shift: f64| (f64::from(row) - shift).clamp(0.0, height) as u32;
        let (up, down) = ((lines as f64 / per_row).ceil(), (lines as f64 / per_row).floor());
        let rows = from(wanted.rows.start, up)..from(wanted.rows.end, down);
        upstream.ask(&self.image, SpanDemand { rows, ..wanted.clone() });
        Ok(())
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let lines = self.lines(wanted)?;
        inputs.get(&self.image).moved(self.translate.0, lines, wanted.rows.clone())
    }

    fn passes(&self) -> Option<&Link<SpanImage>> {
        (self.translate == (0.0, 0.0)).then_some(&self.image)
    }
}
