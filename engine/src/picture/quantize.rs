//! Few colours (\[D], displays with a palette), and pictures as numbers of regions (\[D], "integration of image
//! analysis and image synthesis").

use quantette::deps::palette::Srgb;
use quantette::dither::FloydSteinberg;
use quantette::kmeans::KmeansOptions;
use quantette::{ImageRef, PaletteBuf, PaletteSize, Pipeline, QuantizeMethod};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap, HashSet};

use super::{straight, with_pixels};
use crate::color::{Color, decode_srgb, encode_srgb};
use crate::error::{Error, Result};
use crate::image::{Image, Samples};

/// How colours between those of a palette are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum Dither {
    /// Each as the nearest one.
    None,
    /// By a pattern of 8 x 8 thresholds, this strong: 1 spreads over one of 16 steps of brightness.
    Ordered(f32),
    /// What is left over goes to the neighbours (Floyd and Steinberg), this share of it.
    #[default]
    Diffused,
}

/// The colours that a picture may have.
#[derive(Clone, Debug, PartialEq)]
pub enum Palette {
    /// As many of its own as said, 1 to 256, chosen by k-means.
    Own(u32),
    /// These, 1 to 256.
    Given(Vec<Color>),
}

type Bytes = Srgb<u8>;

/// About how many colours are clustered.
const MOST_POINTS: f64 = 262_144.0;

fn bytes(pixel: [f32; 4]) -> Bytes {
    let [r, g, b, _] = straight(pixel);
    let byte = |v: f32| (encode_srgb(v) * 255.0).round() as u8;
    Srgb::new(byte(r), byte(g), byte(b))
}

fn size_of(count: u32) -> Result<PaletteSize> {
    let size = u16::try_from(count).ok().and_then(|count| PaletteSize::try_from(count).ok());
    size.filter(|_| count > 0).ok_or_else(|| Error::invalid("a palette has 1 to 256 colours"))
}

/// Colours by how many pixels have them.
type Counts = HashMap<[u8; 3], u32>;

fn counted<'b>(pixels: impl Iterator<Item = &'b Bytes>) -> Counts {
    let mut counts = Counts::new();
    pixels.for_each(|c| *counts.entry([c.red, c.green, c.blue]).or_default() += 1);
    counts
}

fn palette_of(colors: Vec<Bytes>) -> Result<PaletteBuf<Bytes>> {
    PaletteBuf::new(colors).map_err(|_| Error::invalid("a palette has 1 to 256 colours"))
}

/// Chooses colours by what is seen of a picture, always the same. Where it has no more than may be, they are its own.
fn own(seen: &Counts, count: u32) -> Result<PaletteBuf<Bytes>> {
    let size = size_of(count)?;
    if seen.is_empty() {
        return Err(Error::invalid("nothing of the picture is seen: it has no colours"));
    }
    let mut known: Vec<_> = seen.iter().map(|(color, count)| (*color, *count)).collect();
    // The order of a hash map differs from run to run.
    known.sort_unstable();
    if known.len() <= count as usize {
        return palette_of(known.into_iter().map(|([r, g, b], _)| Srgb::new(r, g, b)).collect());
    }
    // Colours that are near each other count as one, by the root of how often they are there: a few berries among
    // many leaves keep a colour.
    let mut near: BTreeMap<[u8; 3], (u64, [u64; 3])> = BTreeMap::new();
    for (color, count) in known {
        let (all, sums) = near.entry(color.map(|v| v >> 3)).or_default();
        *all += u64::from(count);
        (0..3).for_each(|k| sums[k] += u64::from(color[k]) * u64::from(count));
    }
    let (mut points, mut total) = (Vec::new(), 0.0);
    near.values().for_each(|(all, _)| total += (*all as f64).sqrt());
    for (all, sums) in near.into_values() {
        let [r, g, b] = sums.map(|sum| (sum / all) as u8);
        let times = ((all as f64).sqrt() * (MOST_POINTS / total).min(1.0)).ceil() as usize;
        points.extend(std::iter::repeat_n(Srgb::new(r, g, b), times));
    }
    let reference = ImageRef::new(points.len() as u32, 1, &points)
        .map_err(|e| Error::invalid(e.to_string()))?;
    let means = KmeansOptions::new().sampling_factor(1.0).seed(1);
    let pipeline = Pipeline::new().palette_size(size).quantize_method(means);
    pipeline
        .input_image(reference)
        .output_srgb8_palette()
        .ok_or_else(|| Error::invalid("the picture holds no colours"))
}

/// Thresholds between -1/2 and 1/2, each once in 8 x 8 (Bayer).
fn threshold(x: u32, y: u32) -> f32 {
    // The lowest bits of the place weigh most: neighbours have thresholds that are far apart.
    let bits = (0..3).fold(0, |sum, bit| {
        let (x, y) = ((x >> bit) & 1, (y >> bit) & 1);
        sum * 4 + (x ^ y) * 2 + y
    });
    (bits as f32 + 0.5) / 64.0 - 0.5
}

/// A picture in few colours. Its alpha stays.
///
/// # Errors
/// If the palette has not 1 to 256 colours, or the picture holds nothing.
pub fn quantize(image: &Image, palette: &Palette, dither: Dither) -> Result<Image> {
    let window = image.window;
    let mut pixels: Vec<Bytes> = image.pixels().map(bytes).collect();
    let is_seen: Vec<bool> = image.pixels().map(|[.., a]| a > 0.0).collect();
    let visible = || pixels.iter().zip(&is_seen).filter(|(_, seen)| **seen).map(|(c, _)| c);
    let seen = counted(visible());
    let colors = match palette {
        Palette::Own(count) => own(&seen, *count)?,
        Palette::Given(colors) => {
            size_of(colors.len() as u32)?;
            palette_of(colors.iter().map(|c| bytes([c.r, c.g, c.b, 1.0])).collect())?
        }
    };
    let has = |color: &[u8; 3]| colors.iter().any(|c| [c.red, c.green, c.blue] == *color);
    let exact: HashSet<[u8; 3]> = seen.keys().filter(|color| has(color)).copied().collect();
    // What cannot be seen takes no part: it is a colour of the palette already.
    let hidden = colors.iter().next().copied().unwrap_or_default();
    pixels.iter_mut().zip(&is_seen).filter(|(_, seen)| !**seen).for_each(|(c, _)| *c = hidden);
    let is_exact = |c: &Bytes| exact.contains(&[c.red, c.green, c.blue]);
    let made = if exact.len() == seen.len() {
        pixels
    } else {
        let mut spread = pixels.clone();
        if let Dither::Ordered(strength) = dither {
            for (at, pixel) in spread.iter_mut().enumerate() {
                let (x, y) = (at as u32 % window.width, at as u32 / window.width);
                // By place in the whole picture, so that parts of it join.
                let (x, y) = (window.x + x, window.y + y);
                let by = threshold(x, y) * strength * 16.0;
                let moved = |v: u8| (f32::from(v) + by).round().clamp(0.0, 255.0) as u8;
                *pixel = Srgb::new(moved(pixel.red), moved(pixel.green), moved(pixel.blue));
            }
        }
        let diffused = (dither == Dither::Diffused).then(FloydSteinberg::new);
        let reference = ImageRef::new(window.width, window.height, &spread)
            .map_err(|e| Error::invalid(e.to_string()))?;
        let pipeline = Pipeline::new().quantize_method(QuantizeMethod::from(colors));
        let found = pipeline.ditherer(diffused).input_image(reference).output_srgb8_image();
        // Without a pattern, what is of the palette stays as it is.
        let stays = |c: &Bytes| dither == Dither::None && is_exact(c);
        let found = found.as_inner().iter().zip(&pixels);
        found.map(|(found, own)| if stays(own) { *own } else { *found }).collect()
    };
    let linear = |byte: u8| decode_srgb(f32::from(byte) / 255.0);
    let alphas = image.pixels().map(|[.., a]| a);
    let done = made.iter().zip(alphas).map(|(color, a)| {
        [linear(color.red) * a, linear(color.green) * a, linear(color.blue) * a, a]
    });
    with_pixels(image, done)
}

/// How a picture is divided into regions.
#[derive(Clone, Debug, PartialEq)]
pub enum Segments {
    /// By brightness: below the first 0, from it to the second 1, and so on. Thresholds are of luminance as a
    /// display codes it, 0 to 1, each greater than the last, at most 255.
    Thresholds(Vec<f32>),
    /// By the nearest of so many colours that it has itself, 1 to 256, the darkest first.
    Colors(u32),
}

/// A picture of numbers: its channels R, G and B say, as bytes, to which region each pixel belongs, so that a
/// PNG of it is a trigger pattern. \[D], "attribute-domain definition function".
///
/// # Errors
/// If thresholds do not rise, or the picture holds nothing.
pub fn segment(image: &Image, segments: &Segments) -> Result<Image> {
    let indices: Vec<u8> = match segments {
        Segments::Thresholds(thresholds) => {
            let rises = thresholds.windows(2).all(|pair| pair[0] < pair[1]);
            if !rises || thresholds.len() > 255 || thresholds.iter().any(|t| !t.is_finite()) {
                let what = "thresholds rise, and are at most 255";
                return Err(Error::invalid(what));
            }
            let index = |pixel: [f32; 4]| {
                let [r, g, b, _] = straight(pixel);
                let bright = encode_srgb(Color::new(r, g, b).luminance());
                thresholds.partition_point(|threshold| *threshold <= bright) as u8
            };
            image.pixels().map(index).collect()
        }
        Segments::Colors(count) => {
            let window = image.window;
            let pixels: Vec<Bytes> = image.pixels().map(bytes).collect();
            let seen = image.pixels().zip(&pixels).filter(|([.., a], _)| *a > 0.0);
            let colors = own(&counted(seen.map(|(_, color)| color)), *count)?;
            let reference = ImageRef::new(window.width, window.height, &pixels)
                .map_err(|e| Error::invalid(e.to_string()))?;
            let pipeline = Pipeline::new().quantize_method(QuantizeMethod::from(colors));
            let found = pipeline.ditherer(None).input_image(reference);
            let found = found.output_srgb8_indexed_image();
            let bright = |color: &Bytes| {
                let [r, g, b] =
                    [color.red, color.green, color.blue].map(|v| decode_srgb(f32::from(v) / 255.0));
                Color::new(r, g, b).luminance()
            };
            let mut order: Vec<usize> = (0..found.palette().len()).collect();
            order.sort_by(|a, b| {
                bright(&found.palette()[*a]).total_cmp(&bright(&found.palette()[*b]))
            });
            let mut rank = vec![0u8; order.len()];
            order.iter().enumerate().for_each(|(at, of)| rank[*of] = at as u8);
            found.indices().iter().map(|index| rank[usize::from(*index)]).collect()
        }
    };
    // As a PNG codes them: the byte is the number.
    let coded = |index: &u8| decode_srgb(f32::from(*index) / 255.0);
    let values: Vec<f32> = indices.iter().map(coded).collect();
    let mut made = Image::new(image.size, image.window);
    made.attributes.clone_from(&image.attributes);
    made.insert("A", Samples::Float(vec![1.0; values.len()]))?;
    for name in ["R", "G"] {
        made.insert(name, Samples::Float(values.clone()))?;
    }
    made.insert("B", Samples::Float(values))?;
    Ok(made)
}
