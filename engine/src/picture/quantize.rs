//! Few colours (\[D], displays with a palette), and pictures as numbers of regions (\[D], "integration of image
//! analysis and image synthesis").

use quantette::deps::palette::Srgb;
use quantette::dither::FloydSteinberg;
use quantette::kmeans::KmeansOptions;
use quantette::{ImageRef, PaletteBuf, PaletteSize, Pipeline, QuantizeMethod};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{straight, with_pixels};
use crate::color::{Color, decode_srgb, encode_srgb};
use crate::error::{Error, Result};
use crate::image::{Image, Samples, Window};

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

fn bytes(pixel: [f32; 4]) -> Bytes {
    let [r, g, b, _] = straight(pixel);
    let byte = |v: f32| (encode_srgb(v) * 255.0).round() as u8;
    Srgb::new(byte(r), byte(g), byte(b))
}

fn size_of(count: u32) -> Result<PaletteSize> {
    let size = u16::try_from(count).ok().and_then(|count| PaletteSize::try_from(count).ok());
    size.filter(|_| count > 0).ok_or_else(|| Error::invalid("a palette has 1 to 256 colours"))
}

/// Chooses colours by what a picture has, always the same.
fn own(pixels: &[Bytes], window: Window, count: u32) -> Result<Pipeline> {
    if pixels.is_empty() {
        return Err(Error::invalid("the picture holds no pixels"));
    }
    // A sample of this many colours is as good as all.
    let share = (262_144.0 / window.area() as f32).min(1.0);
    let means = KmeansOptions::new().sampling_factor(share).seed(1);
    Ok(Pipeline::new().palette_size(size_of(count)?).quantize_method(means))
}

/// Thresholds between -1/2 and 1/2, each once in 8 x 8 (Bayer).
fn threshold(x: u32, y: u32) -> f32 {
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
    let pipeline = match palette {
        Palette::Own(count) => own(&pixels, window, *count)?,
        Palette::Given(colors) => {
            size_of(colors.len() as u32)?;
            let colors: Vec<Bytes> = colors.iter().map(|c| bytes([c.r, c.g, c.b, 1.0])).collect();
            let colors = PaletteBuf::new(colors)
                .map_err(|_| Error::invalid("a palette has 1 to 256 colours"))?;
            Pipeline::new().quantize_method(QuantizeMethod::from(colors))
        }
    };
    let reference = ImageRef::new(window.width, window.height, &pixels)
        .map_err(|e| Error::invalid(e.to_string()))?;
    let pipeline = if let Dither::Ordered(strength) = dither {
        // The colours are those of the picture as it is; only then it is spread.
        let colors = pipeline.clone().input_image(reference).output_srgb8_palette();
        for (at, pixel) in pixels.iter_mut().enumerate() {
            let (x, y) = (at as u32 % window.width, at as u32 / window.width);
            let by = threshold(x, y) * strength * 16.0;
            let moved = |v: u8| (f32::from(v) + by).round().clamp(0.0, 255.0) as u8;
            *pixel = Srgb::new(moved(pixel.red), moved(pixel.green), moved(pixel.blue));
        }
        match colors {
            Some(colors) => pipeline.quantize_method(QuantizeMethod::from(colors)),
            None => pipeline,
        }
    } else {
        pipeline
    };
    let diffused = (dither == Dither::Diffused).then(FloydSteinberg::new);
    let reference = ImageRef::new(window.width, window.height, &pixels)
        .map_err(|e| Error::invalid(e.to_string()))?;
    let made = pipeline.ditherer(diffused).input_image(reference).output_srgb8_image();
    let linear = |byte: u8| decode_srgb(f32::from(byte) / 255.0);
    let alphas = image.pixels().map(|[.., a]| a);
    let done = made.as_inner().iter().zip(alphas).map(|(color, a)| {
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
            let reference = ImageRef::new(window.width, window.height, &pixels)
                .map_err(|e| Error::invalid(e.to_string()))?;
            let found = own(&pixels, window, *count)?.ditherer(None).input_image(reference);
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
    made.insert("A", Samples::Float(vec![1.0; values.len()]))?;
    for name in ["R", "G"] {
        made.insert(name, Samples::Float(values.clone()))?;
    }
    made.insert("B", Samples::Float(values))?;
    Ok(made)
}
