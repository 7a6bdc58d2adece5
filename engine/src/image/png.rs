//! PNG, 8 or 16 bits, sRGB, with straight alpha; and JPEG, which is only read.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageDecoder, ImageEncoder, ImageFormat};
use std::io::{Cursor, Write};
use std::path::Path;

use super::texels::check_end;
use super::{Image, Samples, Window};
use crate::color::{decode_srgb, encode_srgb};
use crate::error::{Error, Result};

/// Writes the colour and alpha of a picture; `bits` is 8 or 16.
pub(super) fn write(image: &Image, bits: u32, path: &Path, out: &mut impl Write) -> Result<()> {
    let (width, height) = (image.window.width, image.window.height);
    let mut samples = Vec::with_capacity(image.window.area() * 4);
    for [r, g, b, a] in image.pixels() {
        let alpha = if a > 0.0 { a.min(1.0) } else { 0.0 };
        let straight = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
        samples.extend([r, g, b].map(|v| encode_srgb(v * straight)));
        samples.push(alpha);
    }
    let (bytes, color) = if bits == 16 {
        let wide = samples.iter().map(|v| (v * 65_535.0).round() as u16);
        (wide.flat_map(u16::to_ne_bytes).collect(), ExtendedColorType::Rgba16)
    } else {
        let bytes: Vec<u8> = samples.iter().map(|v| (v * 255.0).round() as u8).collect();
        (bytes, ExtendedColorType::Rgba8)
    };
    PngEncoder::new_with_quality(out, CompressionType::Default, FilterType::Adaptive)
        .write_image(&bytes, width, height, color)
        .map_err(|e| Error::output(path, e))
}

/// Reads a PNG or JPEG as scene-linear colour with associated alpha.
pub(super) fn read(path: &Path, format: ImageFormat) -> Result<Image> {
    let name = if format == ImageFormat::Png { "PNG" } else { "JPEG" };
    let fault =
        |e: image::ImageError| Error::in_file(path, format!("not a sound {name} file: {e}"));
    let bytes = std::fs::read(path).map_err(|e| Error::file(path, e))?;
    check_end(&bytes, format).map_err(|what| Error::in_file(path, what))?;
    let mut reader = image::ImageReader::with_format(Cursor::new(&bytes), format);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(16 << 30);
    reader.limits(limits);
    let mut decoder = reader.into_decoder().map_err(fault)?;
    // A camera that was held upright says so.
    let orientation = decoder.orientation().map_err(fault)?;
    let mut picture = image::DynamicImage::from_decoder(decoder).map_err(fault)?;
    picture.apply_orientation(orientation);
    let pixels = picture.into_rgba16();
    let (width, height) = pixels.dimensions();
    let mut channels: [Vec<f32>; 4] = Default::default();
    for pixel in pixels.pixels() {
        let [r, g, b, alpha] = pixel.0.map(|v| f32::from(v) / 65_535.0);
        for (channel, value) in channels.iter_mut().zip([r, g, b]) {
            channel.push(decode_srgb(value) * alpha);
        }
        channels[3].push(alpha);
    }
    let mut picture = Image::new((width, height), Window::whole(width, height));
    for (name, values) in ["R", "G", "B", "A"].into_iter().zip(channels) {
        picture.insert(name, Samples::Float(values))?;
    }
    Ok(picture)
}
