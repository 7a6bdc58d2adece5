//! The node `Write`: writes a picture to a file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use spandrel_engine::graph::OutFile;
use spandrel_engine::graph::node::FieldError;
use spandrel_engine::graph::{Inputs, Link, Node, Upstream};
use spandrel_engine::image::file::{self, Format};
use spandrel_engine::image::{Channel, Image, Samples, Window};
use spandrel_engine::text::list;
use spandrel_engine::values::{Delivery, Override, PictureDemand};
use spandrel_engine::{Error, Result};
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// Writes a picture to a file: PNG (8 or 16 bits, sRGB, straight alpha) or OpenEXR (half or float,
/// scene-linear, associated alpha). The file is never half written: it is written beside its place
/// and then renamed. OpenEXR also gets back the other channels and attributes of a picture that was
/// read.
///
/// Example: `Write(image: "picture", path: "town.exr", channels: [Color, Z, Light])`
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Write {
    /// The picture.
    pub image: Link<Image>,
    /// The file. Its ending, `.png` or `.exr`, decides the format. Folders are made as needed.
    pub path: OutFile,
    /// The channels to write; no others are written. PNG holds `Color` only. EXR holds any of
    /// these. `Color`: R, G, B, A. `Z`: distance along the view axis in metres, infinite for
    /// background. `N`: unit normal in world axes. `P`: position in the world. `Id`: the object.
    /// `Light`: a layer `light_NAME` for each light, `light_own_ambient` for what `Illuminate` adds
    /// by itself, and `rest` for what comes from no light; they sum to the colour. `Made`: a
    /// channel or layer `NAME` for each that a `Stream` made. `Others`: whatever else was read with
    /// a picture. `light_error`: how far sampled light may be off. `aa_error`: how far coverage may
    /// be off, 0 to 1.
    ///
    /// `Z`, `N`, `P` and `Id` are unfiltered: they are those of the face that covers most of the
    /// pixel.
    pub channels: BTreeSet<Channel>,
    /// Bits per sample: PNG 8 or 16, EXR 16 (half) or 32. If absent, the first; but what was read
    /// from an EXR with 32 bits keeps them. Z, P, ids, and all channels that are neither colour nor
    /// a layer of light never lose bits.
    pub bits: Option<u32>,
    /// Whether colours of 8 bits are dithered, by less than half a step, so that a night sky has no
    /// bands. What was read with 8 bits stays as it was.
    pub dither: bool,
}

impl Default for Write {
    fn default() -> Write {
        Write {
            image: Link::default(),
            path: OutFile::default(),
            channels: BTreeSet::from([Channel::Color, Channel::Others]),
            bits: None,
            dither: true,
        }
    }
}

/// Whether an entry of a picture, by its name, belongs to one of the given channels.
fn is_of(channels: &BTreeSet<Channel>, name: &str, samples: &Samples) -> bool {
    match Channel::of(name) {
        Some(channel) => channels.contains(&channel) || channels.contains(&Channel::Others),
        None => {
            let is_read = samples.is_from_file() || matches!(samples, Samples::Id(_));
            channels.contains(if is_read { &Channel::Others } else { &Channel::Made })
        }
    }
}

/// The warning for a whole picture that shows nothing.
fn blank(image: &Image) -> Option<&'static str> {
    let is_whole = image.window == Window::whole(image.size.0, image.size.1);
    // A small part of a picture may well be of one colour.
    if !is_whole || image.window.area() < 64 || image.float("R").is_none() {
        return None;
    }
    let all = |test: fn([f32; 4]) -> bool| image.pixels().all(test);
    if all(|[.., a]| a <= 0.0) && all(|[r, g, b, _]| r <= 0.0 && g <= 0.0 && b <= 0.0) {
        Some("the picture is empty: the camera sees nothing, or nothing is left of it")
    } else if all(|[r, g, b, _]| r <= 0.0 && g <= 0.0 && b <= 0.0) {
        Some(
            "the picture is all black: no light reaches what is seen, or `white` of Illuminate is far too great",
        )
    } else if all(|[r, g, b, a]| a >= 1.0 && r >= 1.0 && g >= 1.0 && b >= 1.0) {
        Some(
            "the picture is all white: `white` of Illuminate, the illuminance that shows 1, is too small",
        )
    } else {
        None
    }
}

impl Write {
    /// The channels of the file.
    fn asked(&self) -> BTreeSet<Channel> {
        match Format::of(Path::new(&self.path.0)) {
            Ok(Format::Png) => BTreeSet::from([Channel::Color]),
            _ => self.channels.clone(),
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
        let beside = |channel: &Channel| !matches!(channel, Channel::Color | Channel::Others);
        if format == Format::Png && self.channels.iter().any(beside) {
            return Err(FieldError::new("channels", "a PNG holds `Color` only: write an .exr"));
        }
        if self.channels.is_empty() {
            return Err(FieldError::new("channels", "name at least one channel"));
        }
        Ok(())
    }

    fn demand(&self, wanted: &Override, upstream: &mut Upstream<'_>) -> Result<()> {
        for changed in wanted.asked() {
            upstream.ask(&self.image, PictureDemand { channels: self.asked(), changed });
        }
        Ok(())
    }

    fn evaluate(&self, wanted: &Override, inputs: &Inputs<'_>) -> Result<Delivery> {
        let path = self.path.under(inputs.directory());
        if wanted.is_for_others() {
            return Ok(Delivery { path, bytes: 0 });
        }
        let bands = wanted.asked().into_iter().zip(inputs.each(&self.image));
        let bands = bands.map(|(asked, band)| {
            let (width, height) = band.size;
            Ok((asked.part(Window::whole(width, height))?, band))
        });
        let mut image = match &bands.collect::<Result<Vec<_>>>()?[..] {
            [(_, whole)] => whole.clone(),
            bands => Arc::new(Image::joined(bands)?),
        };
        if let Some(window) = wanted.window
            && window != image.window
        {
            let (width, height) = image.size;
            let part = window.within(width, height);
            if part.area() == 0 {
                return Err(Error::invalid(format!(
                    "a window of {} by {} pixels at {}, {} lies outside of the picture, which has {width} by {height}",
                    window.width, window.height, window.x, window.y
                )));
            }
            image = Arc::new(image.cropped(part));
        }
        let asked = self.asked();
        let unasked: Vec<String> = image
            .channels()
            .filter(|(name, samples)| !is_of(&asked, name, samples))
            .map(|(name, _)| name.to_owned())
            .collect();
        if !unasked.is_empty() {
            // The value may be kept for others: what is changed is a copy.
            let own = Arc::make_mut(&mut image);
            unasked.iter().for_each(|name| drop(own.remove(name)));
        }
        // What may be nothing is: layers of no lights, and what no program made.
        let may_lack = [Channel::Light, Channel::Made, Channel::Others];
        let lacking = asked.iter().filter(|channel| !may_lack.contains(channel)).find(|channel| {
            !image.channels().any(|(name, _)| Channel::of(name) == Some(**channel))
        });
        if let Some(channel) = lacking {
            let known: Vec<&str> = image.channels().map(|(name, _)| name).collect();
            return Err(Error::invalid(format!(
                "the picture has no channel {channel:?}: of what is asked for it has {}",
                list(known)
            )));
        }
        if let Some(said) = blank(&image) {
            inputs.warn(said);
        }
        Ok(Delivery { bytes: file::write_as(&image, &path, self.bits, self.dither)?, path })
    }
}
