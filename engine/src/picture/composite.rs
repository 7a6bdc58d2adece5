use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::NAMES;
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

/// Two pictures of one size put together. Where one holds nothing it is transparent. Other channels are those
/// of the back.
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
    let mut made = if window == back.window {
        back.clone()
    } else {
        let mut bare = Image::new(back.size, window);
        bare.how.clone_from(&back.how);
        bare
    };
    let pixel = |image: &Image, x: u32, y: u32| {
        let at = image.window;
        let inside = (at.x..at.x + at.width).contains(&x) && (at.y..at.y + at.height).contains(&y);
        if inside { image.rgba(x - at.x, y - at.y) } else { [0.0; 4] }
    };
    let mut channels: [Vec<f32>; 4] = Default::default();
    for y in window.y..window.y + window.height {
        for x in window.x..window.x + window.width {
            let (f, b) = (pixel(front, x, y), pixel(back, x, y));
            let (p, q) = operator.shares(f[3], b[3]);
            for (k, channel) in channels.iter_mut().enumerate() {
                let sum = f[k] * p + b[k] * q;
                channel.push(if k == 3 { sum.min(1.0) } else { sum });
            }
        }
    }
    for (name, channel) in NAMES.into_iter().zip(channels) {
        made.insert(name, Samples::Float(channel))?;
    }
    Ok(made)
}
