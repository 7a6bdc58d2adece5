use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::InFile;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::image::file::{Encoded, NotFinite, Select};
use spandrel_engine::resolve::Channel;
use spandrel_engine::values::Picture;

/// Reads a picture: OpenEXR and Radiance as they are, all others, which have 8 or 16 bits, as scene-linear colour. A
/// link to a picture may name the file itself.
///
/// What the file says of its colours is heeded: those of other primaries become those of Rec. 709, with a note. So is
/// how a camera was held. What it has beside its colour is kept under its names, with its attributes, for nodes that ask
/// for it, and for `Write`.
///
/// Example: `Read(file: "plate.exr", layer: "beauty")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Read {
    /// The file: PNG, JPEG, OpenEXR, Radiance (`.hdr`), TIFF, WebP, BMP or TGA; its first bytes say which.
    pub file: InFile,
    /// Of OpenEXR: the layer whose colour this is, such as `"diffuse"`, or `"Combined"` for `"ViewLayer.Combined"`.
    /// A layer of one channel is grey. Absent, the main layer, or the only one that has colour.
    pub layer: Option<String>,
    /// Of OpenEXR: read this part only, by its name or its number from 0.
    pub part: Option<String>,
    /// Of OpenEXR: the view, such as `"right"`. Absent, the first.
    pub view: Option<String>,
    /// What is done to colours that are not finite: `Refuse` the picture, with the pixel and the channel; `Zero`; or
    /// `Nearest`, the nearest that is finite.
    pub not_finite: NotFinite,
}

impl Node for Read {
    type Output = Image;
    const KIND: &'static str = "Read";
    const GROUP: &'static str = "image";
    const ALIASES: &'static [&'static str] = &["ReadImage", "ImageReader", "FileIn", "Photograph"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        Ok(())
    }

    fn demand(&self, _: &Picture, _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, wanted: &Picture, inputs: &Inputs<'_>) -> Result<Image> {
        let file = Encoded::open(&self.file.under(inputs.directory()))?;
        let asked = &wanted.channels;
        let wants = |name: &str| match Channel::of(name) {
            Some(channel) => asked.contains(&channel) || asked.contains(&Channel::Others),
            None => asked.contains(&Channel::Others) || asked.contains(&Channel::Made),
        };
        let select = Select {
            layer: self.layer.as_deref(),
            part: self.part.as_deref(),
            view: self.view.as_deref(),
            needs_color: asked.contains(&Channel::Color),
            wants: &wants,
        };
        let (image, notes) = file.image(&select, Some(self.not_finite))?;
        notes.iter().for_each(|note| inputs.note(note));
        Ok(wanted.part(image))
    }
}
