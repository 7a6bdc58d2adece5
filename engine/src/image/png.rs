//! PNG, 8 or 16 bits, sRGB, with straight alpha.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use std::io::Write;
use std::path::Path;

use super::Image;
use crate::color::encode_srgb;
use crate::error::{Error, Result};

/// Writes the colour and alpha of a picture; `bits` is 8 or 16.
pub(super) fn write(image: &Image, bits: u32, path: &Path, out: &mut impl Write) -> Result<()> {
    let (width, height) = (image.window.width, image.window.height);
    let mut samples = Vec::with_capacity(image.window.area() * 4);
    for y in 0..height {
        for x in 0..width {
            let [r, g, b, a] = image.rgba(x, y);
            let alpha = if a > 0.0 { a.min(1.0) } else { 0.0 };
            let straight = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
            samples.extend([r, g, b].map(|v| encode_srgb(v * straight)));
            samples.push(alpha);
        }
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
