//! Pictures as files.
//!
//! A picture is opened in one way, whatever it is for: by its first bytes, not by its name; with what decoding
//! it will take known before anything is taken; and with every decoder behind a guard.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::format::check_largest;
use super::raster::{self, DecodedRaster};
use super::texels::{Samples as Mapped, Texels};
use super::{Channel, Image, Samples, Window, exr, png};
use crate::error::{Error, Result};
use crate::open;
use crate::output;

pub use super::exr::{Layer, Layers, Select};
pub use super::format::{Format, largest, set_largest};
pub use super::head::Head;

/// Writes a picture, whole or not at all, each sample as the nearest that the file has; returns the file's length.
///
/// # Errors
/// If the format is not known, does not have the bits, or the file cannot be written.
pub fn write(image: &Image, path: &Path, bits: Option<u32>) -> Result<u64> {
    write_as(image, path, bits, false)
}

/// As [`write()`]; colours of 8 bits are dithered by less than half a step, if they are to be.
///
/// # Errors
/// As [`write()`].
pub fn write_as(image: &Image, path: &Path, bits: Option<u32>, is_dithered: bool) -> Result<u64> {
    let format = Format::of(path)?;
    let depth = format.bits(bits).map_err(|e| Error::output(path, e))?;
    output::write(path, |out| match format {
        Format::Png => png::write(image, depth, is_dithered, path, out),
        _ => exr::write(image, bits, path, out),
    })
}

/// What becomes of samples that are not finite, in the colour of a picture that is read.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
pub enum NotFinite {
    /// The picture is refused, with the pixel and the channel.
    #[default]
    Refuse,
    /// They are 0.
    Zero,
    /// They are those of the nearest pixel that is finite.
    Nearest,
}

/// A picture in its file: its format is known, and nothing is decoded.
#[derive(Debug)]
pub struct Encoded<'b> {
    path: PathBuf,
    bytes: Cow<'b, [u8]>,
    /// The format.
    pub format: Format,
}

impl Encoded<'static> {
    /// Opens a file.
    ///
    /// # Errors
    /// If it cannot be read, is empty, or no picture.
    pub fn open(path: &Path) -> Result<Encoded<'static>> {
        let bytes = open::bytes(path)?;
        let format = Format::find(path, &bytes)?;
        Ok(Encoded { path: path.to_owned(), bytes: bytes.into(), format })
    }
}

impl<'b> Encoded<'b> {
    /// A picture that another file holds; errors name that file.
    ///
    /// # Errors
    /// If it is no picture.
    pub fn of(path: &Path, bytes: &'b [u8]) -> Result<Encoded<'b>> {
        let format = Format::find(path, bytes)?;
        Ok(Encoded { path: path.to_owned(), bytes: bytes.into(), format })
    }

    fn guarded<T>(&self, run: impl FnOnce() -> Result<T>) -> Result<T> {
        open::guarded(run).unwrap_or_else(|broke| {
            Err(Error::in_file(
                &self.path,
                format!("not a sound {} file: {broke}", self.format.name()),
            ))
        })
    }

    /// What the file says of the picture.
    ///
    /// # Errors
    /// If its head is damaged.
    pub fn head(&self) -> Result<Head> {
        let mut head = self.guarded(|| match self.format {
            Format::Exr => exr::head(&self.path, &self.bytes),
            format => raster::head(&self.path, &self.bytes, format),
        })?;
        head.notes.extend(self.misnamed());
        Ok(head)
    }

    /// That a picture is of another format than its name says.
    fn misnamed(&self) -> Option<String> {
        let named = Format::by_ending(&self.path)?;
        (named != self.format).then(|| {
            format!(
                "it is a {}, although its name ends as that of a {} does",
                self.format.name(),
                named.name()
            )
        })
    }

    /// The pixels of a picture that has no layers, and what is to be known of them; nothing for OpenEXR.
    fn raster(&self, is_raw: bool) -> Result<Option<DecodedRaster>> {
        match self.format {
            Format::Exr => Ok(None),
            format => {
                self.guarded(|| raster::decode(&self.path, &self.bytes, format, is_raw)).map(Some)
            }
        }
    }

    /// The picture, and notes of what was done to it or left out: coded colours become scene-linear when they are asked
    /// for, colours of other primaries become those of Rec. 709, what a camera held upright is upright. Without a word
    /// of what is not finite, it stays.
    ///
    /// # Errors
    /// If it is damaged or too large, does not have what is selected, or is not finite.
    pub fn image(
        &self,
        select: &Select<'_>,
        not_finite: Option<NotFinite>,
    ) -> Result<(Image, Vec<String>)> {
        let (mut image, mut notes) = match self.raster(false)? {
            None => self.guarded(|| exr::read(&self.path, &self.bytes, select))?,
            Some(raster) => {
                select.check_absent(&self.path, self.format)?;
                raster.into_image()?
            }
        };
        notes.extend(self.misnamed());
        if let Some(asked) = not_finite {
            notes.extend(finite(&self.path, &mut image, asked)?);
        }
        Ok((image, notes))
    }

    /// The picture as it is mapped on surfaces. What is raw has its own pixels, whatever its file says of their colour
    /// or of how they are held.
    ///
    /// # Errors
    /// If it is damaged or too large, has no colour, or is not finite.
    pub fn texels(&self, is_raw: bool) -> Result<Texels> {
        if let Some(raster) = self.raster(is_raw)? {
            let texels = raster.into_texels();
            check_finite(&self.path, texels.size, texels.pixels())?;
            return Ok(texels);
        }
        let (image, _) = self.image(&Select::color(), Some(NotFinite::Refuse))?;
        // The whole of what is displayed, of which a file may hold a corner: four floats to a pixel, twice.
        let [width, height] = [image.size.0, image.size.1].map(u64::from);
        let bytes = width.saturating_mul(height).saturating_mul(32);
        check_largest(&self.path, [width, height], bytes)?;
        let image = image.whole();
        Ok(Texels { size: image.size, samples: Mapped::Linear(image.pixels().collect()) })
    }
}

/// Reads a picture: its colour, and all else that it has, finite or not. What is coded becomes scene-linear with
/// associated alpha.
///
/// # Errors
/// If the file cannot be read, is damaged, or is no picture.
pub fn read(path: &Path) -> Result<Image> {
    Ok(Encoded::open(path)?.image(&Select::all(), None)?.0)
}

fn check_finite(
    path: &Path,
    size: (u32, u32),
    mut pixels: impl Iterator<Item = [f32; 4]>,
) -> Result<()> {
    let bad = pixels.position(|pixel| pixel.iter().any(|v| !v.is_finite()));
    bad.map_or(Ok(()), |at| {
        let (x, y) = (at as u32 % size.0, at as u32 / size.0);
        Err(Error::in_file(path, format!("pixel {x}, {y} is not a finite number")))
    })
}

/// Does to colours that are not finite what is asked; returns a note of it.
fn finite(path: &Path, image: &mut Image, asked: NotFinite) -> Result<Option<String>> {
    let names: Vec<String> = image
        .channels()
        .filter(|(name, samples)| Channel::is_color(name) && samples.coded().is_none())
        .map(|(name, _)| name.to_owned())
        .collect();
    let (width, window) = (image.window.width as usize, image.window);
    let mut count = 0;
    for name in names {
        let Some(values) = image.float(&name) else { continue };
        let Some(at) = values.iter().position(|v| !v.is_finite()) else { continue };
        let (x, y) = (window.x as usize + at % width, window.y as usize + at / width);
        match asked {
            NotFinite::Refuse => {
                let value = values[at];
                return Err(Error::in_file(
                    path,
                    format!(
                        "channel {name} of pixel {x}, {y} is {value}, not a finite number: mend the picture, or \
                         read it with `not_finite: Zero` or `Nearest`"
                    ),
                ));
            }
            NotFinite::Zero => {
                count += values.iter().filter(|v| !v.is_finite()).count();
                let zeroed = values.iter().map(|v| if v.is_finite() { *v } else { 0.0 });
                let zeroed = zeroed.collect();
                image.insert(&name, Samples::Float(zeroed))?;
            }
            NotFinite::Nearest => {
                count += values.iter().filter(|v| !v.is_finite()).count();
                let filled = nearest(values, width);
                image.insert(&name, Samples::Float(filled))?;
            }
        }
    }
    let become_words = if asked == NotFinite::Zero { "0" } else { "as the nearest that are" };
    Ok((count > 0).then(|| format!("{count} samples that are not finite are {become_words}")))
}

/// The numbers, those that are not finite being those of the nearest that are, by steps to the sides.
fn nearest(values: &[f32], width: usize) -> Vec<f32> {
    let mut filled = values.to_vec();
    let mut known: Vec<bool> = values.iter().map(|v| v.is_finite()).collect();
    let mut edge: Vec<usize> = (0..values.len()).filter(|at| known[*at]).collect();
    if edge.is_empty() {
        return vec![0.0; values.len()];
    }
    let height = values.len() / width;
    while !edge.is_empty() {
        let mut next = Vec::new();
        for at in edge {
            let (x, y) = (at % width, at / width);
            let beside = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then(|| at + 1),
                (y > 0).then(|| at - width),
                (y + 1 < height).then(|| at + width),
            ];
            for near in beside.into_iter().flatten() {
                if !known[near] {
                    known[near] = true;
                    filled[near] = filled[at];
                    next.push(near);
                }
            }
        }
        edge = next;
    }
    filled
}

impl DecodedRaster {
    /// The picture, with notes.
    fn into_image(self) -> Result<(Image, Vec<String>)> {
        let size = self.texels.size;
        let mut image = Image::new(size, Window::whole(size.0, size.1));
        match self.texels.samples {
            Mapped::Coded(coded) => {
                let count = if coded.layout.has_alpha() { 4 } else { 3 };
                let coded: Arc<_> = coded;
                for (k, name) in ["R", "G", "B", "A"].into_iter().take(count).enumerate() {
                    image.insert(name, Samples::of_coded(&coded, k))?;
                }
            }
            Mapped::Linear(pixels) => {
                let is_opaque = pixels.iter().all(|[.., a]| *a == 1.0);
                let count = if is_opaque { 3 } else { 4 };
                for (k, name) in ["R", "G", "B", "A"].into_iter().take(count).enumerate() {
                    let values = pixels.iter().map(|pixel| pixel[k]).collect();
                    image.insert(name, Samples::exact(values))?;
                }
            }
        }
        Ok((image, self.notes))
    }

    fn into_texels(self) -> Texels {
        self.texels
    }
}
