//! The node `Read`: reads a picture file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::InFile;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Node, Upstream};
use spandrel_engine::image::file::{Encoded, NotFinite, Select};
use spandrel_engine::image::{Channel, Image};
use spandrel_engine::values::PictureDemand;

/// Reads a picture. OpenEXR and Radiance are taken as they are; all others, of 8 or 16 bits, become
/// scene-linear colour. A link to a picture may name the file directly.
///
/// What the file says about its colours is applied: other primaries are converted to those of Rec.
/// 709, with a note. So is the orientation of the camera. Other channels keep their names and
/// attributes, for nodes that ask for them and for `Write`.
///
/// Example: `Read(file: "plate.exr", layer: "beauty")`
#[derive(Serialize, Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields, default)]
pub struct Read {
    /// The file: PNG, JPEG, OpenEXR, Radiance (`.hdr`), TIFF, WebP, BMP or TGA. Its first bytes
    /// decide which.
    pub file: InFile,
    /// OpenEXR only: the layer to take the colour from, such as `"diffuse"`, or `"Combined"` for
    /// `"ViewLayer.Combined"`. A layer of one channel is grey. If absent, the main layer, or the
    /// only one with colour.
    pub layer: Option<String>,
    /// OpenEXR only: reads only this part, by its name or its number from 0.
    pub part: Option<String>,
    /// OpenEXR only: the view, such as `"right"`. If absent, the first.
    pub view: Option<String>,
    /// What to do with colours that are not finite. `Refuse` the picture, naming the pixel and the
    /// channel; `Zero` replaces them by 0; `Nearest` by the nearest finite one.
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

    fn demand(&self, _: &PictureDemand, _: &mut Upstream<'_>) -> Result<()> {
        Ok(())
    }

    fn evaluate(&self, wanted: &PictureDemand, inputs: &Inputs<'_>) -> Result<Image> {
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
        wanted.part(image)
    }
}
