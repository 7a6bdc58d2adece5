use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Lights, NAMES, finite};
use crate::error::{Error, Result};
use crate::image::{Image, Samples};

/// How two pictures are put together (Porter and Duff 1984).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum Operator {
    /// The front before the back.
    #[default]
    Over,
    /// The front where the back is.
    In,
    /// The front where the back is not.
    Out,
    /// The front where the back is, and the back beside it.
    Atop,
    /// Each where the other is not.
    Xor,
    /// The sum of both.
    Plus,
}

impl Operator {
    /// The shares of front and back, by the alphas of both.
    fn shares(self, front: f32, back: f32) -> (f32, f32) {
        match self {
            Operator::Over => (1.0, 1.0 - front),
            Operator::In => (back, 0.0),
            Operator::Out => (1.0 - back, 0.0),
            Operator::Atop => (back, 1.0 - front),
            Operator::Xor => (1.0 - back, 1.0 - front),
            Operator::Plus => (1.0, 1.0),
        }
    }
}

/// Two pictures of one size put together, with the layers of their lights. Where one holds nothing it is transparent.
/// Other channels are those of the back.
///
/// # Errors
/// If their sizes differ.
pub fn composite(front: &Image, back: &Image, operator: Operator) -> Result<Image> {
    if front.size != back.size {
        let ((w, h), (x, y)) = (front.size, back.size);
        return Err(Error::invalid(format!(
            "the front has {w} x {h} pixels and the back {x} x {y}: a Reformat makes them alike"
        )));
    }
    let window = front.window.around(back.window);
    if u64::from(window.width) * u64::from(window.height) > 1 << 28 {
        return Err(Error::invalid(format!("together they take {window}: more than 2^28 pixels")));
    }
    let (front, mut made) = (front.laid(window), back.laid(window));
    let back = made.clone();
    let shares: Vec<(f32, f32)> =
        front.pixels().zip(back.pixels()).map(|(f, b)| operator.shares(f[3], b[3])).collect();
    let pixels = front.pixels().zip(back.pixels()).zip(&shares).map(|((f, b), (p, q))| {
        let mut sum: [f32; 4] = std::array::from_fn(|k| finite(f[k] * p + b[k] * q));
        // Only Plus goes beyond 1.
        sum[3] = sum[3].min(1.0);
        sum
    });
    let mut channels: [Vec<f32>; 4] = Default::default();
    for pixel in pixels {
        channels.iter_mut().zip(pixel).for_each(|(channel, v)| channel.push(v));
    }
    // What a light adds to both, it adds to what they make together; a picture without layers comes from no light.
    let mut layers = Lights::of(&front);
    layers.names.append(&mut Lights::of(&back).names);
    if !layers.names.is_empty() {
        for name in layers.names.iter().filter(|name| *name != "rest") {
            let (f, b) = (Lights::layer(&front, name), Lights::layer(&back, name));
            let pairs = f.iter().zip(&b).zip(&shares);
            let layer: Vec<[f32; 3]> = pairs
                .map(|((f, b), (p, q))| std::array::from_fn(|k| f[k] * p + b[k] * q))
                .collect();
            Lights::put(&mut made, name, &layer)?;
        }
        layers.close(&mut made, &channels)?;
    }
    for (name, channel) in NAMES.into_iter().zip(channels) {
        made.insert(name, Samples::Float(channel))?;
    }
    Ok(made)
}
