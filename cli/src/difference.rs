//! How far one picture is from another.

use spandrel_engine::image::file;
use spandrel_engine::image::{Image, Samples};
use spandrel_engine::{Error, Result};
use std::path::Path;

/// A step of 8 bits.
const STEP: f32 = 1.0 / 255.0;

/// The difference of two pictures over some samples, in the units of the channels: scene-linear for
/// colour.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Difference {
    /// Root of the mean square.
    pub(crate) rmse: f64,
    /// The greatest.
    pub(crate) most: f64,
    /// What 99.9 % do not exceed.
    pub(crate) high: f64,
    /// The share above 1/255.
    pub(crate) above_step: f64,
}

impl Difference {
    fn of(mut differences: Vec<f32>) -> Difference {
        if differences.is_empty() {
            return Difference::default();
        }
        let count = differences.len();
        let squares: f64 = differences.iter().map(|d| f64::from(*d) * f64::from(*d)).sum();
        let above = differences.iter().filter(|d| **d > STEP).count();
        let most = differences.iter().copied().fold(0.0, f32::max);
        let place = (count - 1).min((count as f64 * 0.999) as usize);
        // Selecting is linear; sorting millions of pixels is not.
        let (_, high, _) = differences.select_nth_unstable_by(place, f32::total_cmp);
        Difference {
            rmse: (squares / count as f64).sqrt(),
            most: f64::from(most),
            high: f64::from(*high),
            above_step: above as f64 / count as f64,
        }
    }
}

/// Reads a picture; a colour without alpha is opaque.
pub(crate) fn read(path: &Path) -> Result<Image> {
    let mut image = file::read(path)?;
    if image.channel("R").is_some() && image.channel("A").is_none() {
        image.insert("A", Samples::Float(vec![1.0; image.window.area()]))?;
    }
    Ok(image)
}

/// The difference of the colours (R, G, B, A) of two pictures.
pub(crate) fn of_colors(a: &Image, b: &Image) -> Result<Difference> {
    let mut all = Vec::new();
    for name in ["R", "G", "B", "A"] {
        all.extend(of_channel(a, b, name)?.unwrap_or_default());
    }
    Ok(Difference::of(all))
}

/// The differences of all channels that both have, by name.
pub(crate) fn by_channel(a: &Image, b: &Image) -> Result<Vec<(String, Difference)>> {
    let mut found = Vec::new();
    for (name, _) in a.channels() {
        if let Some(differences) = of_channel(a, b, name)? {
            found.push((name.to_owned(), Difference::of(differences)));
        }
    }
    Ok(found)
}

/// Absolute differences; ids differ by 1 or not at all, and so do values of which one is infinite.
fn of_channel(a: &Image, b: &Image, name: &str) -> Result<Option<Vec<f32>>> {
    if (a.size, a.window) != (b.size, b.window) {
        let size = |image: &Image| format!("{} by {}", image.window.width, image.window.height);
        let message = format!("pictures of {} and of {} pixels", size(a), size(b));
        return Err(Error::invalid(message));
    }
    Ok(match a.channel(name).zip(b.channel(name)) {
        Some((Samples::Id(a), Samples::Id(b))) => {
            Some(a.iter().zip(b).map(|(a, b)| f32::from(u8::from(a != b))).collect())
        }
        Some((a, b)) => a.floats().zip(b.floats()).map(|(a, b)| {
            let apart = |(a, b): (&f32, &f32)| match (a - b).abs() {
                _ if a == b || (a.is_nan() && b.is_nan()) => 0.0,
                d if d.is_finite() => d,
                _ => 1.0,
            };
            a.iter().zip(b).map(apart).collect()
        }),
        None => None,
    })
}
