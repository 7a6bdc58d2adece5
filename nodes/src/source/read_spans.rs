use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::InFile;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::SpanFile;
use spandrel_engine::values::Lines;

/// Reads an image of spans from a .span file: only the rows that are needed. Its camera, size and lines are
/// those with which it was written. Scenes that it names are found again, so that it can be lit; without them,
/// depth, merging and the stored colours remain, and a warning says so.
///
/// A link to an image may name the file itself.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ReadSpans {
    /// The file.
    pub file: InFile,
}

impl Node for ReadSpans {
    type Output = SpanImage;
    const KIND: &'static str = "ReadSpans";
    const GROUP: &'static str = "source";
    const ALIASES: &'static [&'static str] = &["DeepRead", "ReadDeep"];

    fn demand(&self, _: &Lines, _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, wanted: &Lines, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let file = SpanFile::open(&self.file.resolve(inputs))?;
        for scene in file.scenes() {
            if let Some(why) = &scene.missing {
                inputs.warn(&format!("{why}; depth and the stored colours remain"));
            }
        }
        if wanted.plan.probed {
            inputs.warn(
                "a file holds its lines and no more: `Adaptive` and `Exact` leave it, and what it is merged into, as \
                 `Sloped` does",
            );
        }
        file.deliver(wanted.raster, wanted.plan, wanted.rows.clone())
    }
}
