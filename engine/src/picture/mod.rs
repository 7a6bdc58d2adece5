//! Operations on pictures: photographs before they go into a scene, and finished pictures after it.
//!
//! Pixels are scene-linear with associated alpha. Every operation changes the colour and alpha of a picture and
//! leaves its other channels as they are, where they keep their place.

mod blur;
mod composite;
mod grade;
mod matte;
mod quantize;
mod reformat;

pub use blur::blur;
pub use composite::{Operator, composite};
pub use grade::Grade;
pub use matte::{Key, Matte, Pulled};
pub use quantize::{Dither, Palette, Segments, quantize, segment};
pub use reformat::Reformat;

use crate::error::Result;
use crate::image::{Image, Samples};

const NAMES: [&str; 4] = ["R", "G", "B", "A"];

/// A picture with other pixels, as many as before.
fn with_pixels(image: &Image, pixels: impl Iterator<Item = [f32; 4]>) -> Result<Image> {
    let mut changed = image.clone();
    let mut channels: [Vec<f32>; 4] = Default::default();
    for pixel in pixels {
        channels.iter_mut().zip(pixel).for_each(|(channel, v)| channel.push(v));
    }
    for (name, channel) in NAMES.into_iter().zip(channels) {
        changed.insert(name, Samples::Float(channel))?;
    }
    Ok(changed)
}

/// A picture without associated alpha: the colour itself, and black where there is none.
fn straight([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let share = if a > 0.0 { 1.0 / a } else { 0.0 };
    [r * share, g * share, b * share, a]
}
