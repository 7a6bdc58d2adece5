//! Pictures as they are mapped on surfaces: their samples as the file has them, whatever they mean.

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::Path;

use super::file;
use crate::error::{Error, Result};

/// The most bytes that a picture may take while it is read.
const MOST_BYTES: u64 = 4 << 30;

/// A picture's size and samples, row by row from the top.
#[derive(Clone, Debug)]
pub struct Texels {
    /// Columns and rows, at least 1 each.
    pub size: (u32, u32),
    /// Red, green, blue and alpha.
    pub samples: Samples,
}

/// The samples of a picture.
#[derive(Clone, Debug)]
pub enum Samples {
    /// 8 bits each as they are coded, alpha straight.
    Bytes(Vec<[u8; 4]>),
    /// 16 bits each as they are coded, alpha straight, 1 the greatest.
    Words(Vec<[f32; 4]>),
    /// Scene-linear, alpha associated.
    Linear(Vec<[f32; 4]>),
}

impl Texels {
    /// The same size with the first samples, shrunk by alpha, for alpha, and white for the colour.
    pub fn into_alpha(self) -> Texels {
        let straight = |[v, .., a]: [f32; 4]| [1.0, 1.0, 1.0, v * a];
        let samples = match self.samples {
            Samples::Bytes(texels) => {
                let product = |v: u8, a: u8| ((u32::from(v) * u32::from(a) + 127) / 255) as u8;
                let alpha = |[v, .., a]: [u8; 4]| [255, 255, 255, product(v, a)];
                Samples::Bytes(texels.into_iter().map(alpha).collect())
            }
            Samples::Words(texels) => Samples::Words(texels.into_iter().map(straight).collect()),
            // Associated: the first is shrunk already.
            Samples::Linear(texels) => {
                Samples::Linear(texels.into_iter().map(|[v, ..]| [v; 4]).collect())
            }
        };
        Texels { size: self.size, samples }
    }
}

/// Reads a picture: PNG, JPEG, EXR or HDR.
///
/// # Errors
/// If the file cannot be read, is damaged or too large, or is of another format.
pub fn read(path: &Path) -> Result<Texels> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
    match ending.to_ascii_lowercase().as_str() {
        "exr" | "hdr" => {
            let picture = file::read(path)?;
            let whole = picture.window.area() == picture.size.0 as usize * picture.size.1 as usize;
            if !whole || picture.window.area() == 0 {
                return Err(Error::in_file(path, "the picture is not whole: it cannot be mapped"));
            }
            // EXR without colour, such as a mask, is grey.
            let samples = match (picture.float("R"), picture.float("Y")) {
                (None, Some(grey)) => grey.iter().map(|y| [*y, *y, *y, 1.0]).collect(),
                _ => picture.pixels().collect(),
            };
            finite(path, Texels { size: picture.size, samples: Samples::Linear(samples) })
        }
        _ => {
            let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
            decode(&bytes).map_err(|what| Error::in_file(path, what))
        }
    }
}

/// Decodes a PNG or JPEG.
///
/// # Errors
/// What is wrong with it.
pub fn decode(bytes: &[u8]) -> std::result::Result<Texels, String> {
    let format = match image::guess_format(bytes) {
        Ok(format @ (ImageFormat::Png | ImageFormat::Jpeg)) => format,
        _ => return Err("not a picture that can be mapped: use .png, .jpg, .exr or .hdr".into()),
    };
    check_end(bytes, format)?;
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(MOST_BYTES);
    reader.limits(limits);
    let name = if format == ImageFormat::Png { "PNG" } else { "JPEG" };
    let picture = reader.decode().map_err(|e| format!("not a sound {name} file: {e}"))?;
    let size = (picture.width(), picture.height());
    let is_deep = matches!(
        picture,
        DynamicImage::ImageLuma16(_)
            | DynamicImage::ImageLumaA16(_)
            | DynamicImage::ImageRgb16(_)
            | DynamicImage::ImageRgba16(_)
    );
    let samples = if is_deep {
        let words = picture.into_rgba16();
        Samples::Words(words.pixels().map(|p| p.0.map(|v| f32::from(v) / 65_535.0)).collect())
    } else {
        Samples::Bytes(picture.into_rgba8().pixels().map(|pixel| pixel.0).collect())
    };
    Ok(Texels { size, samples })
}

/// Whether a JPEG goes on to its end: decoders make grey of what is missing.
///
/// # Errors
/// If it does not.
pub(super) fn check_end(bytes: &[u8], format: ImageFormat) -> std::result::Result<(), String> {
    if format != ImageFormat::Jpeg || has_end(bytes) {
        return Ok(());
    }
    Err(format!(
        "not a sound JPEG file: it breaks off at byte {}, before its end: copy it again",
        bytes.len()
    ))
}

/// Whether the marker of the end follows the segments and scans of a JPEG. What comes after it does not count.
fn has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let [first, second, rest @ ..] = bytes.get(at..).unwrap_or_default() {
        at += match (first, second) {
            (0xff, 0xd9) => return true,
            // Filled up, or a byte of coded data.
            (0xff, 0xff) | (0..0xff, _) => 1,
            // Stuffed, or a marker without a length.
            (0xff, 0x00 | 0x01 | 0xd0..=0xd8) => 2,
            _ => match rest {
                [high, low, ..] => 2 + usize::from(u16::from_be_bytes([*high, *low])).max(2),
                _ => return false,
            },
        };
    }
    false
}

/// The bytes that a picture takes as a pyramid, at most, by its head alone; 0 if that is not to be read.
pub fn bytes(path: &Path) -> u64 {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or("");
    let texels = match ending.to_ascii_lowercase().as_str() {
        "exr" => {
            let meta = ::exr::meta::MetaData::read_from_file(path, false).ok();
            let size = meta.and_then(|meta| Some(meta.headers.first()?.layer_size));
            size.map(|size| (size.area() as u64).saturating_mul(16))
        }
        ending => {
            let opened = File::open(path).ok().map(BufReader::new);
            let format = if ending == "hdr" { Some(ImageFormat::Hdr) } else { None };
            opened.and_then(|file| texel_bytes(file, format))
        }
    };
    (texels.unwrap_or(0) / 3).saturating_mul(4)
}

/// The same of a PNG or JPEG.
pub fn bytes_of(picture: &[u8]) -> u64 {
    (texel_bytes(Cursor::new(picture), None).unwrap_or(0) / 3).saturating_mul(4)
}

fn texel_bytes(picture: impl BufRead + Seek, format: Option<ImageFormat>) -> Option<u64> {
    let reader = match format {
        Some(format) => ImageReader::with_format(picture, format),
        None => ImageReader::new(picture).with_guessed_format().ok()?,
    };
    let decoder = reader.into_decoder().ok()?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let texel = if color.bytes_per_pixel() > color.channel_count() { 16 } else { 4 };
    Some((u64::from(width) * u64::from(height)).saturating_mul(texel))
}

fn finite(path: &Path, texels: Texels) -> Result<Texels> {
    if let Samples::Linear(samples) = &texels.samples {
        let bad = samples.iter().position(|texel| texel.iter().any(|v| !v.is_finite()));
        if let Some(at) = bad {
            let (x, y) = (at as u32 % texels.size.0, at as u32 / texels.size.0);
            return Err(Error::in_file(path, format!("pixel {x}, {y} is not a finite number")));
        }
    }
    Ok(texels)
}
