//! Pictures as files.

use std::path::Path;

use super::{Image, exr, hdr, png};
use crate::error::{Error, Result};
use crate::output;

/// A picture format, by the ending of a file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.png`: 8 or 16 bits, sRGB.
    Png,
    /// `.exr`: half or float, scene-linear.
    Exr,
    /// `.hdr`: Radiance's, scene-linear; read only.
    Hdr,
    /// `.jpg` or `.jpeg`: 8 bits, sRGB; read only.
    Jpeg,
}

impl Format {
    /// The format of a path.
    ///
    /// # Errors
    /// If the ending is not known.
    pub fn of(path: &Path) -> Result<Format> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        match extension.to_ascii_lowercase().as_str() {
            "png" => Ok(Format::Png),
            "exr" => Ok(Format::Exr),
            "hdr" => Ok(Format::Hdr),
            "jpg" | "jpeg" => Ok(Format::Jpeg),
            other => Err(Error::in_file(
                path,
                format!(
                    "\".{other}\" is no picture format: use .png or .exr, or .jpg or .hdr for reading"
                ),
            )),
        }
    }

    /// The bits per sample, if `asked` can be had: PNG 8 (default) or 16; EXR 16 (half, default) or 32.
    ///
    /// # Errors
    /// If it cannot.
    pub fn bits(self, asked: Option<u32>) -> Result<u32> {
        let known = match self {
            Format::Png => [8, 16],
            Format::Exr => [16, 32],
            Format::Hdr => return Err(Error::invalid("HDR is only read here: write .exr")),
            Format::Jpeg => return Err(Error::invalid("JPEG is only read here: write .png")),
        };
        match asked {
            None => Ok(known[0]),
            Some(bits) if known.contains(&bits) => Ok(bits),
            Some(bits) => Err(Error::invalid(format!(
                "{bits} bits: a {self:?} has {} or {} bits per sample",
                known[0], known[1]
            ))),
        }
    }
}

/// Writes a picture, whole or not at all; returns the file's length.
///
/// # Errors
/// If the format is not known, does not have the bits, or the file cannot be written.
pub fn write(image: &Image, path: &Path, bits: Option<u32>) -> Result<u64> {
    let format = Format::of(path)?;
    let bits = format.bits(bits).map_err(|e| Error::output(path, e))?;
    output::write(path, |out| match format {
        Format::Png => png::write(image, bits, path, out),
        Format::Exr | Format::Hdr | Format::Jpeg => exr::write(image, bits == 16, path, out),
    })
}

/// Reads a picture: PNG and JPEG as scene-linear colour with associated alpha, EXR and HDR as they are.
///
/// # Errors
/// If the file cannot be read, is damaged, or is of another format.
pub fn read(path: &Path) -> Result<Image> {
    match Format::of(path)? {
        Format::Png => png::read(path, image::ImageFormat::Png),
        Format::Jpeg => png::read(path, image::ImageFormat::Jpeg),
        Format::Exr => exr::read(path),
        Format::Hdr => hdr::read(path),
    }
}
