use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::graph::node::{FieldError, InFile};
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::image::file::{self, Format};
use spandrel_engine::resolve::Channel;
use spandrel_engine::values::Picture;
use spandrel_engine::{Error, Result};
use std::path::Path;

/// Reads a picture: PNG and JPEG as scene-linear colour, OpenEXR and HDR as they are. A link to a picture may name
/// the file itself.
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Read {
    /// The file, ending in `.png`, `.jpg`, `.exr` or `.hdr`.
    pub file: InFile,
}

impl Node for Read {
    type Output = Image;
    const KIND: &'static str = "Read";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["ReadImage", "ImageReader", "FileIn", "Photograph"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if !self.file.0.is_empty() {
            let format = Format::of(Path::new(&self.file.0));
            format.map_err(|e| FieldError::new("file", e.to_string()))?;
        }
        Ok(())
    }

    fn demand(&self, _: &Picture, _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, wanted: &Picture, inputs: &Inputs<'_>) -> Result<Image> {
        let path = self.file.resolve(inputs);
        let image = file::read(&path)?;
        if wanted.channels.contains(&Channel::Color) && image.float("R").is_none() {
            let names: Vec<&str> = image.channels().map(|(name, _)| name).collect();
            let message =
                format!("it has no colour (R, G, B): its channels are {}", names.join(", "));
            return Err(Error::in_file(path, message));
        }
        Ok(wanted.part(image))
    }
}
