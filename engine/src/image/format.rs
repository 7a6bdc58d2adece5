//! The formats of pictures: what a file is, and how large what is in it may be.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};
use crate::open;
use crate::text;

/// A picture format.
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
    /// `.tif` or `.tiff`: 8 or 16 bits, sRGB, or float, scene-linear; read only.
    Tiff,
    /// `.webp`: 8 bits, sRGB; read only.
    WebP,
    /// `.bmp`: 8 bits, sRGB; read only.
    Bmp,
    /// `.tga`: 8 bits, sRGB; read only.
    Tga,
}

impl Format {
    const ENDINGS: [(&str, Format); 11] = [
        ("png", Format::Png),
        ("exr", Format::Exr),
        ("hdr", Format::Hdr),
        ("pic", Format::Hdr),
        ("jpg", Format::Jpeg),
        ("jpeg", Format::Jpeg),
        ("tif", Format::Tiff),
        ("tiff", Format::Tiff),
        ("webp", Format::WebP),
        ("bmp", Format::Bmp),
        ("tga", Format::Tga),
    ];

    /// The format that a path's ending says.
    ///
    /// # Errors
    /// If the ending is not known.
    pub fn of(path: &Path) -> Result<Format> {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("");
        Format::by_ending(path).ok_or_else(|| {
            let what = if ending.is_empty() {
                "its name has no ending".to_owned()
            } else {
                format!("\".{ending}\" is no picture format")
            };
            Error::in_file(
                path,
                format!("{what}: use .png or .exr, or for reading .jpg, .hdr, .tif, .webp, .bmp or .tga too"),
            )
        })
    }

    pub(super) fn by_ending(path: &Path) -> Option<Format> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        Format::ENDINGS.into_iter().find(|(known, _)| *known == ending).map(|(_, format)| format)
    }

    /// The format of a file by its first bytes; where they say nothing, by its ending.
    ///
    /// # Errors
    /// If it is no picture that is read here, and what it is.
    pub fn find(path: &Path, bytes: &[u8]) -> Result<Format> {
        let kind = open::kind(bytes);
        let known = match kind {
            Some("a PNG picture") => Some(Format::Png),
            Some("an OpenEXR picture") => Some(Format::Exr),
            Some("a Radiance picture (.hdr)") => Some(Format::Hdr),
            Some("a JPEG picture") => Some(Format::Jpeg),
            Some("a TIFF picture" | "a BigTIFF picture") => Some(Format::Tiff),
            Some("a WebP picture") => Some(Format::WebP),
            Some("a BMP picture") => Some(Format::Bmp),
            // Those have nothing at their start to know them by.
            None => Format::by_ending(path).filter(|format| *format == Format::Tga),
            Some(_) => None,
        };
        known.ok_or_else(|| {
            let what = match (kind, Format::by_ending(path)) {
                (Some(kind), _) => format!("it is {kind}, which is not read as a picture"),
                (None, Some(format)) => {
                    format!(
                        "it does not begin as a {} does: it is damaged, or something else",
                        format.name()
                    )
                }
                (None, None) => "it is no picture that is known".to_owned(),
            };
            Error::in_file(
                path,
                format!("{what}: use .png, .jpg, .exr, .hdr, .tif, .webp, .bmp or .tga"),
            )
        })
    }

    /// What people call it.
    pub fn name(self) -> &'static str {
        match self {
            Format::Png => "PNG",
            Format::Exr => "OpenEXR",
            Format::Hdr => "Radiance",
            Format::Jpeg => "JPEG",
            Format::Tiff => "TIFF",
            Format::WebP => "WebP",
            Format::Bmp => "BMP",
            Format::Tga => "TGA",
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
            other => {
                let name = other.name();
                return Err(Error::invalid(format!(
                    "{name} is only read here: write .png or .exr"
                )));
            }
        };
        match asked {
            None => Ok(known[0]),
            Some(bits) if known.contains(&bits) => Ok(bits),
            Some(bits) => Err(Error::invalid(format!(
                "{bits} bits: a {} has {} or {} bits per sample",
                self.name(),
                known[0],
                known[1]
            ))),
        }
    }
}

static LARGEST: AtomicU64 = AtomicU64::new(0);

/// The most bytes that a picture may take when it is decoded; a quarter of this machine's memory if nobody
/// [said](set_largest) otherwise.
pub fn largest() -> u64 {
    match LARGEST.load(Ordering::Relaxed) {
        0 => crate::machine::memory().map_or(4 << 30, |memory| memory / 4),
        bytes => bytes,
    }
}

/// Changes the most bytes that a picture may take when it is decoded.
pub fn set_largest(bytes: u64) {
    LARGEST.store(bytes.max(1), Ordering::Relaxed);
}

/// Whether a picture may be decoded.
///
/// # Errors
/// If it takes more bytes than a picture may.
pub(super) fn check_largest(path: &Path, [width, height]: [u64; 2], bytes: u64) -> Result<()> {
    let most = largest();
    if bytes <= most {
        return Ok(());
    }
    let (takes, most) = (text::bytes(bytes), text::bytes(most));
    Err(Error::in_file(
        path,
        format!(
            "{width} by {height} pixels take {takes} when they are decoded, and a picture may take \
             {most}: make it smaller, or allow it more (--largest-picture)"
        ),
    ))
}
