use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::Result;
use spandrel_engine::graph::node::{FieldError, OutFile};
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::Image;
use spandrel_engine::image::file::{self, Format};
use spandrel_engine::resolve::Channel;
use spandrel_engine::values::{Delivery, Override, Picture};
use std::collections::BTreeSet;
use std::path::Path;

/// Writes a picture to a file: PNG (8 or 16 bits, sRGB, straight alpha) or OpenEXR (half or float,
/// scene-linear, associated alpha). The file is whole or not there: it is written beside its place and then renamed.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Write {
    /// The picture.
    pub image: Link<Image>,
    /// The file; its ending, `.png` or `.exr`, decides the format. Folders are made as needed.
    pub path: OutFile,
    /// The channels to write. PNG holds `Color` only; EXR holds any: `Color` (R, G, B, A), `Z`
    /// (distance along the view axis in metres, infinite for background), `N` (unit normal in world
    /// axes), `P` (position in the world), `Id` (object), `Light` (a layer `light_NAME` for each light,
    /// `light_own_ambient` for what `Illuminate` adds by itself, and `rest` for what comes from no light;
    /// they sum to the colour), `Made` (`NAME`, or a layer of that name, for each channel that programs of `Stream` made), `light_error` (by how much light that is found by samples may be off),
    /// `aa_error` (by which share of the pixel its coverage may be off, 0 to 1). `Z`, `N`, `P` and `Id` are
    /// those of the face that covers most of the pixel, unfiltered.
    pub channels: BTreeSet<Channel>,
    /// Bits per sample: PNG 8 or 16, EXR 16 (half) or 32. Absent, the first. Z, P and ids are always 32.
    pub bits: Option<u32>,
}

impl Default for Write {
    fn default() -> Write {
        Write {
            image: Link::default(),
            path: OutFile::default(),
            channels: BTreeSet::from([Channel::Color]),
            bits: None,
        }
    }
}

impl Node for Write {
    type Output = Delivery;
    const KIND: &'static str = "Write";
    const GROUP: &'static str = "output";
    const ALIASES: &'static [&'static str] = &["Save", "Output", "WriteExr", "ImageWriter"];

    fn check(&self) -> std::result::Result<(), FieldError> {
        if self.path.0.is_empty() {
            return Err(FieldError::new("path", "name a file to write, such as \"out/town.png\""));
        }
        let format = Format::of(Path::new(&self.path.0));
        let format = format.map_err(|e| FieldError::new("path", e.to_string()))?;
        format.bits(None).map_err(|e| FieldError::new("path", e.to_string()))?;
        format.bits(self.bits).map_err(|e| FieldError::new("bits", e.to_string()))?;
        let has_color_only = self.channels == BTreeSet::from([Channel::Color]);
        if format == Format::Png && !has_color_only {
            return Err(FieldError::new("channels", "a PNG holds `Color` only: write an .exr"));
        }
        if self.channels.is_empty() {
            return Err(FieldError::new("channels", "name at least one channel"));
        }
        Ok(())
    }

    fn demand(&self, wanted: &Override, upstream: &mut Upstream<'_>) -> Result<()> {
        wanted.check_clobber(&upstream.directory().join(&self.path.0))?;
        let (channels, changed) = (self.channels.clone(), wanted.clone());
        upstream.ask(&self.image, Picture { channels, changed });
        Ok(())
    }

    fn evaluate(&self, wanted: &Override, inputs: &Inputs<'_>) -> Result<Delivery> {
        let image = inputs.get(&self.image);
        let path = self.path.resolve(inputs);
        let bytes = match wanted.window {
            Some(window) if window != image.window => {
                file::write(&image.cropped(window), &path, self.bits)?
            }
            _ => file::write(&image, &path, self.bits)?,
        };
        Ok(Delivery { path, bytes })
    }
}
