//! Pictures without layers: PNG, JPEG, TIFF, WebP, BMP, TGA and Radiance's.

use image::error::ImageError;
use image::metadata::Orientation;
use image::{ColorType, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::io::Cursor;
use std::path::Path;
use std::sync::Arc;

use super::format::{Format, check_largest, largest};
use super::head::Head;
use super::texels::{Samples, Texels};
use super::{Coded, Codes, Coding, Layout, hdr, png, tiff};
use crate::error::{Error, Result};

/// A picture whose head is read.
pub(super) struct Started<'b> {
    /// Columns and rows as the file has them.
    pub(super) size: (u32, u32),
    /// What its samples are, for people.
    pub(super) samples: String,
    /// Bytes of a pixel when it is decoded.
    pub(super) pixel: u64,
    /// How its codes become colours.
    pub(super) coding: Coding,
    /// How it is to be turned.
    pub(super) orientation: Orientation,
    pub(super) notes: Vec<String>,
    /// Decodes it.
    pub(super) decode: Box<dyn FnOnce() -> Result<Pixels> + 'b>,
}

pub(super) enum Pixels {
    Coded(Layout, Codes),
    Linear(Vec<[f32; 4]>),
}

/// A picture that is decoded, and what is to be known of it.
pub(super) struct DecodedRaster {
    pub(super) texels: Texels,
    pub(super) notes: Vec<String>,
}

fn start<'b>(path: &Path, bytes: &'b [u8], format: Format) -> Result<Started<'b>> {
    let started = match format {
        Format::Png => png::start(path, bytes)?,
        Format::Hdr => hdr::start(path, bytes)?,
        _ => by_library(path, bytes, format)?,
    };
    let (width, height) = started.size;
    if width == 0 || height == 0 {
        return Err(Error::in_file(path, format!("it has {width} by {height} pixels: none")));
    }
    Ok(started)
}

/// What the file of a picture says of it.
pub(super) fn head(path: &Path, bytes: &[u8], format: Format) -> Result<Head> {
    let started = start(path, bytes, format)?;
    let (width, height) = started.size;
    let area = u64::from(width) * u64::from(height);
    let size = if is_turned(started.orientation) { (height, width) } else { (width, height) };
    // Smaller sizes are bytes if the picture is, and numbers otherwise.
    let smaller = match started.pixel {
        _ if !started.coding.is_rec_709() => 16,
        1 => 1,
        2..=4 => 4,
        _ => 16,
    };
    let mut notes = started.notes;
    notes.extend(told(&started.coding, started.orientation));
    Ok(Head {
        format,
        size,
        samples: started.samples,
        bytes: area.saturating_mul(started.pixel),
        mapped: area.saturating_mul(started.pixel).saturating_add(area / 3 * smaller),
        layers: None,
        notes,
    })
}

fn told(coding: &Coding, orientation: Orientation) -> Vec<String> {
    let space = coding.note.as_ref().map(|space| format!("its colours are of {space}: converted"));
    let turned = (orientation != Orientation::NoTransforms)
        .then(|| format!("turned as its camera says (EXIF orientation {})", orientation.to_exif()));
    space.into_iter().chain(turned).collect()
}

fn is_turned(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// Decodes a picture. What is raw has its own pixels, whatever its file says of their colour or of how they are held.
pub(super) fn decode(
    path: &Path,
    bytes: &[u8],
    format: Format,
    is_raw: bool,
) -> Result<DecodedRaster> {
    let started = start(path, bytes, format)?;
    let [width, height] = [started.size.0, started.size.1].map(u64::from);
    let takes = (width * height).saturating_mul(started.pixel);
    check_largest(path, [width, height], takes)?;
    let (coding, orientation) = match is_raw {
        true => (Coding::srgb(), Orientation::NoTransforms),
        false => (started.coding, started.orientation),
    };
    let mut notes = started.notes;
    notes.extend(told(&coding, orientation));
    let size = started.size;
    let texels = match (started.decode)()? {
        Pixels::Coded(layout, codes) => {
            let coded = Coded { size, layout, codes, coding };
            if !coded.is_whole() {
                let what = "its samples are fewer or more than its pixels: it is damaged";
                return Err(Error::in_file(path, what));
            }
            Texels::coded(Arc::new(coded.upright(orientation)))
        }
        Pixels::Linear(pixels) => Texels { size, samples: Samples::Linear(pixels) },
    };
    Ok(DecodedRaster { texels, notes })
}

/// An error of the library that decodes a format.
pub(super) fn fault(path: &Path, format: Format, error: &ImageError) -> Error {
    let name = format.name();
    Error::in_file(
        path,
        match error {
            ImageError::Unsupported(what) => {
                format!(
                    "a {name} file of a kind that is not read ({what}): save it as PNG or OpenEXR"
                )
            }
            other => format!("not a sound {name} file: {other}"),
        },
    )
}

fn by_library<'b>(path: &Path, bytes: &'b [u8], format: Format) -> Result<Started<'b>> {
    let known = match format {
        Format::Jpeg => ImageFormat::Jpeg,
        Format::Tiff => ImageFormat::Tiff,
        Format::WebP => ImageFormat::WebP,
        Format::Bmp => ImageFormat::Bmp,
        _ => ImageFormat::Tga,
    };
    if format == Format::Jpeg && !has_end(bytes) {
        let at = bytes.len() as u64;
        let what = "not a sound JPEG file: it breaks off before its end: copy it again";
        return Err(Error::at_byte(path, at, what));
    }
    let fault = |error: ImageError| fault(path, format, &error);
    let mut reader = ImageReader::with_format(Cursor::new(bytes), known);
    let mut limits = Limits::default();
    limits.max_alloc = Some(largest());
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(fault)?;
    let size = decoder.dimensions();
    let color = decoder.color_type();
    let mut notes = Vec::new();
    // A byte of a JPEG is eight blocks of 8 by 8 pixels at the most; others may repeat one colour without end.
    let area = u64::from(size.0) * u64::from(size.1);
    if format == Format::Jpeg && area / 512 > bytes.len() as u64 {
        return Err(too_small(path, size, bytes));
    }
    let of_tiff = if format == Format::Tiff { tiff::about(bytes) } else { tiff::About::default() };
    if of_tiff.pictures > 1 {
        notes.push(format!("it holds {} pictures: the first is read", of_tiff.pictures));
    }
    let (depth, words) = match color {
        ColorType::L8 => (8, "grey"),
        ColorType::La8 => (8, "grey and alpha"),
        ColorType::Rgb8 => (8, "red green blue"),
        ColorType::Rgba8 => (8, "red green blue alpha"),
        ColorType::L16 => (16, "grey"),
        ColorType::La16 => (16, "grey and alpha"),
        ColorType::Rgb16 => (16, "red green blue"),
        ColorType::Rgba16 => (16, "red green blue alpha"),
        ColorType::Rgb32F => (32, "red green blue"),
        _ => (32, "red green blue alpha"),
    };
    let is_grey = words.starts_with("grey");
    let mut coding = Coding::srgb();
    if depth < 32 {
        // Damaged descriptions are no reason to refuse what they describe.
        let profile = decoder.icc_profile().ok().flatten();
        match profile.map(|profile| Coding::of_profile(&profile, if is_grey { 1 } else { 3 })) {
            None | Some(Ok(None)) => {}
            Some(Ok(Some(own))) => coding = own,
            Some(Err(what)) => {
                notes.push(format!("its profile is not used ({what}): it is read as sRGB"));
            }
        }
    }
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let samples = match depth {
        32 => format!("float, {words}, scene-linear"),
        bits => format!("{bits} bits, {words}"),
    };
    let pixel = if depth == 32 { 16 } else { u64::from(color.bytes_per_pixel()) };
    let (path, is_associated) = (path.to_owned(), of_tiff.is_associated);
    let decode = move || -> Result<Pixels> {
        let fault = |error: ImageError| self::fault(&path, format, &error);
        let mut samples = vec![0u8; decoder.total_bytes() as usize];
        decoder.read_image(&mut samples).map_err(fault)?;
        let words = || samples.chunks_exact(2).map(|pair| u16::from_ne_bytes([pair[0], pair[1]]));
        let floats = || {
            let four = |v: &[u8]| f32::from_ne_bytes([v[0], v[1], v[2], v[3]]);
            samples.chunks_exact(4).map(four)
        };
        let layout = match color {
            ColorType::L8 | ColorType::L16 => Layout::Grey,
            ColorType::La8 | ColorType::La16 => Layout::GreyAlpha,
            ColorType::Rgb8 | ColorType::Rgb16 => Layout::Rgb,
            _ => Layout::Rgba,
        };
        Ok(match color {
            ColorType::Rgb32F => {
                let values: Vec<f32> = floats().collect();
                Pixels::Linear(values.chunks_exact(3).map(|v| [v[0], v[1], v[2], 1.0]).collect())
            }
            ColorType::Rgba32F => {
                let values: Vec<f32> = floats().collect();
                let pixel = |v: &[f32]| {
                    let by = if is_associated { 1.0 } else { v[3] };
                    [v[0] * by, v[1] * by, v[2] * by, v[3]]
                };
                Pixels::Linear(values.chunks_exact(4).map(pixel).collect())
            }
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
                let mut codes: Vec<u16> = words().collect();
                if is_associated && layout.has_alpha() {
                    codes.chunks_exact_mut(layout.channels()).for_each(|pixel| {
                        straighten(pixel, u16::MAX, u32::from, |v| v as u16);
                    });
                }
                Pixels::Coded(layout, Codes::Words(codes))
            }
            _ => {
                if is_associated && layout.has_alpha() {
                    samples.chunks_exact_mut(layout.channels()).for_each(|pixel| {
                        straighten(pixel, u8::MAX, u32::from, |v| v as u8);
                    });
                }
                Pixels::Coded(layout, Codes::Bytes(samples))
            }
        })
    };
    let decode = Box::new(decode);
    Ok(Started { size, samples, pixel, coding, orientation, notes, decode })
}

/// Takes the alpha of codes, which come last, out of the others.
fn straighten<T: Copy + Ord>(
    pixel: &mut [T],
    most: T,
    wide: impl Fn(T) -> u32,
    narrow: impl Fn(u32) -> T,
) {
    let Some((alpha, colors)) = pixel.split_last_mut() else { return };
    let (alpha, most) = (wide(*alpha), wide(most));
    for color in colors.iter_mut().filter(|_| alpha > 0) {
        let straight =
            (u64::from(wide(*color)) * u64::from(most) + u64::from(alpha) / 2) / u64::from(alpha);
        *color = narrow((straight as u32).min(most));
    }
}

/// That a file's pixels cannot be in its bytes.
pub(super) fn too_small(path: &Path, (width, height): (u32, u32), bytes: &[u8]) -> Error {
    let message = format!(
        "{width} by {height} pixels cannot be in {} bytes: it is damaged, or not whole",
        bytes.len()
    );
    Error::in_file(path, message)
}

/// Whether the marker of the end follows the segments and scans of a JPEG: decoders make grey of what is missing. What
/// comes after it does not count.
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
