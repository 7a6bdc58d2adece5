//! Radiance's HDR, scene-linear: read only.

use std::path::Path;

use super::{Image, Samples, Window};
use crate::error::{Error, Result};

/// Reads a picture as scene-linear colour.
pub(super) fn read(path: &Path) -> Result<Image> {
    let fault = |e: image::ImageError| Error::in_file(path, format!("not a sound HDR file: {e}"));
    let file = std::fs::File::open(path).map_err(|e| Error::file(path, e))?;
    let mut reader =
        image::ImageReader::with_format(std::io::BufReader::new(file), image::ImageFormat::Hdr);
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(16 << 30);
    reader.limits(limits);
    let pixels = reader.decode().map_err(fault)?.into_rgb32f();
    let (width, height) = pixels.dimensions();
    let mut picture = Image::new((width, height), Window::whole(width, height));
    for (axis, name) in ["R", "G", "B"].into_iter().enumerate() {
        let values = pixels.pixels().map(|pixel| pixel.0[axis]).collect();
        picture.insert(name, Samples::Float(values))?;
    }
    Ok(picture)
}
