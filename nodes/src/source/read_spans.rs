//! The node `ReadSpans`: reads spans from a file (\[N], "Image data structure").

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::InFile;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::span::SpanImage;
use spandrel_engine::span_file::SpanFile;
use spandrel_engine::values::SpanDemand;
use std::path::Path;

/// Reads an image of spans from a .span file: only the rows that are needed. Camera, size and lines
/// are those with which the file was written.
///
/// The scenes that the file names are found again, so that the image can be lit. Without them,
/// depth, merging and the stored colours still work. A warning says so, and lights are then an
/// error.
///
/// A link to an image may name the file directly. Deep OpenEXR files are not read.
///
/// Example: `ReadSpans(file: "town.span")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct ReadSpans {
    /// The file, ending in `.span`.
    pub file: InFile,
    /// A folder to search for scenes by name, if they have moved.
    pub scenes: Option<String>,
}

impl Node for ReadSpans {
    type Output = SpanImage;
    const KIND: &'static str = "ReadSpans";
    const GROUP: &'static str = "source";

    fn check(&self) -> std::result::Result<(), FieldError> {
        let is_other = |file: &str| Path::new(file).extension().is_none_or(|e| e != "span");
        if !self.file.0.is_empty() && is_other(&self.file.0) {
            let message =
                format!("\"{}\" is no file of spans: its name ends in .span", self.file.0);
            return Err(FieldError::new("file", message));
        }
        Ok(())
    }

    fn demand(&self, wanted: &SpanDemand, upstream: &mut Upstream<'_>) -> Result<()> {
        // Before anything is computed.
        SpanFile::check(&upstream.directory().join(&self.file.0), wanted.raster, wanted.plan)
    }

    fn evaluate(&self, wanted: &SpanDemand, inputs: &Inputs<'_>) -> Result<SpanImage> {
        let folder = self.scenes.as_ref().map(|folder| inputs.directory().join(folder));
        let file = SpanFile::open(&self.file.under(inputs.directory()), folder.as_deref())?;
        for scene in file.scenes() {
            if let Some(why) = &scene.missing {
                inputs.warn(&format!("{why}; depth and the stored colours remain"));
            }
        }
        let image = file.deliver(wanted.raster, wanted.plan, wanted.rows.clone())?;
        if wanted.layered {
            inputs.warn(
                "a file holds nothing behind opaque surfaces: where a program makes them let light through, there is \
                 nothing. Render the scene, or give its materials `alpha_mode: Blend` before the file is written",
            );
        }
        if wanted.plan.probed {
            inputs.warn(
                "a file holds its lines and no more: `Adaptive` leaves it, and what it is merged into, as `Sloped` does",
            );
        }
        Ok(image)
    }
}
