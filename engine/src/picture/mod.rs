//! Operations on pictures: photographs before they go into a scene, and finished pictures after it.
//!
//! Pixels are scene-linear with associated alpha. Every operation changes the colour and alpha of a picture and
//! with it the layers of its lights, which go on to sum to the colour; its other channels stay as they are, or,
//! where pixels move, go with them unmixed. No operation makes numbers that are not finite.

mod blur;
mod composite;
mod grade;
mod matte;
mod quantize;
mod reformat;

pub use blur::blur;
pub use composite::{Operator, composite};
pub use grade::Grade;
pub use matte::{ColorKey, Matte, Pulled};
pub use quantize::{Dither, Palette, Segments, quantize, segment};
pub use reformat::Reformat;

use std::collections::BTreeSet;

use crate::error::Result;
use crate::image::{Image, Samples, is_layer_of_light};

const NAMES: [&str; 4] = ["R", "G", "B", "A"];

/// A number that is finite, whatever came out.
fn finite(v: f32) -> f32 {
    // `clamp` keeps NaN.
    if v.is_nan() { 0.0 } else { v.clamp(-f32::MAX, f32::MAX) }
}

/// A picture with other pixels, as many as before. Its layers of light change as its colour does, so that they sum to it.
fn with_pixels(image: &Image, pixels: impl Iterator<Item = [f32; 4]>) -> Result<Image> {
    let mut changed = image.clone();
    let mut channels: [Vec<f32>; 4] = Default::default();
    for pixel in pixels {
        channels.iter_mut().zip(pixel).for_each(|(channel, v)| channel.push(finite(v)));
    }
    let layers = Lights::of(image);
    if !layers.names.is_empty() {
        let old: Vec<[f32; 4]> = image.pixels().collect();
        let share = |at: usize, k: usize| {
            let (new, old) = (channels[k][at], old[at][k]);
            if old == 0.0 { 0.0 } else { finite(new / old) }
        };
        layers
            .change(&mut changed, |at, layer| std::array::from_fn(|k| layer[k] * share(at, k)))?;
        layers.close(&mut changed, &channels)?;
    }
    for (name, channel) in NAMES.into_iter().zip(channels) {
        changed.insert(name, Samples::Float(channel))?;
    }
    Ok(changed)
}

/// The layers of light of a picture, `light_NAME` and `rest`, which sum to its colour.
struct Lights {
    names: BTreeSet<String>,
}

impl Lights {
    fn of(image: &Image) -> Lights {
        let layers = image.channels().filter_map(|(name, _)| name.rsplit_once('.'));
        let layers = layers.map(|(layer, _)| layer).filter(|layer| is_layer_of_light(layer));
        Lights { names: layers.map(str::to_owned).collect() }
    }

    /// A layer, pixel by pixel; black if there is none of that name.
    fn layer(image: &Image, name: &str) -> Vec<[f32; 3]> {
        let parts = ["R", "G", "B"].map(|axis| image.float(&format!("{name}.{axis}")));
        let value = |at: usize| parts.map(|part| part.map_or(0.0, |part| part[at]));
        (0..image.window.area()).map(value).collect()
    }

    fn put(image: &mut Image, name: &str, layer: &[[f32; 3]]) -> Result<()> {
        for (k, axis) in ["R", "G", "B"].into_iter().enumerate() {
            let values = layer.iter().map(|v| finite(v[k])).collect();
            image.insert(&format!("{name}.{axis}"), Samples::Float(values))?;
        }
        Ok(())
    }

    /// Changes all layers, pixel by pixel.
    fn change(
        &self,
        image: &mut Image,
        change: impl Fn(usize, [f32; 3]) -> [f32; 3],
    ) -> Result<()> {
        for name in &self.names {
            let layer = Lights::layer(image, name).into_iter().enumerate();
            let layer: Vec<[f32; 3]> = layer.map(|(at, layer)| change(at, layer)).collect();
            Lights::put(image, name, &layer)?;
        }
        Ok(())
    }

    /// Adds to `rest` what is missing to a colour.
    fn close(&self, image: &mut Image, color: &[Vec<f32>; 4]) -> Result<()> {
        let mut rest = Lights::layer(image, "rest");
        let mut sum = vec![[0.0f32; 3]; rest.len()];
        for name in self.names.iter().filter(|name| *name != "rest") {
            for (sum, layer) in sum.iter_mut().zip(Lights::layer(image, name)) {
                (0..3).for_each(|k| sum[k] += layer[k]);
            }
        }
        for (at, rest) in rest.iter_mut().enumerate() {
            *rest = std::array::from_fn(|k| color[k][at] - sum[at][k]);
        }
        Lights::put(image, "rest", &rest)
    }
}

/// A picture without associated alpha: the colour itself, and black where there is none.
fn straight([r, g, b, a]: [f32; 4]) -> [f32; 4] {
    let own = |v: f32| if a > 0.0 { finite(v / a) } else { 0.0 };
    [own(r), own(g), own(b), a]
}
