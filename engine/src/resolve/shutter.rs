//! What a shutter sees: pictures of several moments in one.

use std::collections::BTreeSet;

use crate::error::{Error, Result};
use crate::image::{Channel, Image, Samples};

/// The moments at which a shutter that is open from one frame to another is sampled: the middles of equal parts.
pub fn moments((from, to): (f64, f64), samples: u32) -> Vec<f64> {
    let part = |i: u32| from + (to - from) * (f64::from(i) + 0.5) / f64::from(samples);
    (0..samples).map(part).collect()
}

/// Pictures of equal parts of the time that a shutter is open, as one. Colours, layers of light, what programs made and
/// errors are their mean; distances, positions, normals and ids, of which there is no mean, those of the middle.
///
/// # Errors
/// If there are none, or they differ in size or window.
pub fn averaged(pictures: &[Image]) -> Result<Image> {
    let Some(middle) = pictures.get(pictures.len() / 2) else {
        return Err(Error::invalid("a shutter sees at least one moment"));
    };
    if pictures.iter().any(|other| (other.size, other.window) != (middle.size, middle.window)) {
        return Err(Error::invalid("the pictures of a shutter's moments differ in size"));
    }
    let mut made = Image::new(middle.size, middle.window);
    made.attributes = middle.attributes.clone();
    made.how = middle.how.as_ref().map(|how| format!("{how}, {} moments", pictures.len()));
    for picture in pictures {
        made.names.extend(picture.names.iter().map(|(id, name)| (*id, name.clone())));
    }
    let names: BTreeSet<&str> =
        pictures.iter().flat_map(|picture| picture.channels().map(|(name, _)| name)).collect();
    for name in names {
        let is_of_one =
            matches!(Channel::of(name), Some(Channel::Z | Channel::N | Channel::P | Channel::Id));
        if is_of_one {
            if let Some(samples) = middle.channel(name) {
                made.insert(name, samples.clone())?;
            }
            continue;
        }
        // A layer that is not there at a moment is black then.
        let mut sums = vec![0.0f64; middle.window.area()];
        for samples in pictures.iter().filter_map(|picture| picture.channel(name)?.floats()) {
            sums.iter_mut().zip(samples).for_each(|(sum, sample)| *sum += f64::from(*sample));
        }
        let count = pictures.len() as f64;
        let mean = sums.into_iter().map(|sum| (sum / count) as f32).collect();
        made.insert(name, Samples::Float(mean))?;
    }
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::Window;

    #[test]
    fn colours_are_averaged_and_distances_are_not() {
        let picture = |red: f32, z: f32| {
            let mut image = Image::new((1, 1), Window { x: 0, y: 0, width: 1, height: 1 });
            image.insert("R", Samples::Float(vec![red])).unwrap();
            image.insert("Z", Samples::Float(vec![z])).unwrap();
            image
        };
        let mut last = picture(0.5, 9.0);
        last.insert("light_car.R", Samples::Float(vec![3.0])).unwrap();
        let made = averaged(&[picture(1.0, 2.0), picture(0.0, f32::INFINITY), last]).unwrap();
        let at = |name: &str| made.channel(name).and_then(Samples::floats).map(|s| s[0]);
        assert_eq!([at("R"), at("light_car.R")], [Some(0.5), Some(1.0)]);
        assert_eq!(at("Z"), Some(f32::INFINITY));
        assert_eq!(moments((-0.5, 0.5), 4), [-0.375, -0.125, 0.125, 0.375]);
    }
}
