use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

use super::NAMES;
use crate::error::{Error, Result};
use crate::image::texels::{Samples as Texture, Texels};
use crate::image::{Image, Samples, Window};
use crate::key::Key;
use crate::math;
use crate::texture::{Filter, Footprint, Meaning, Source, Store, Wrap};

/// A picture laid into another size: a part of it, moved, scaled and turned.
#[derive(Clone, Copy, Debug)]
pub struct Reformat {
    /// Columns and rows of the new picture.
    pub size: (u32, u32),
    /// The part that is shown: left, top, width, height, as shares of the picture.
    pub part: [f64; 4],
    /// Whether the part keeps its proportions: all of it is shown then, with nothing beside it.
    pub keeps_shape: bool,
    /// Right and down, in shares of the new picture's width and height.
    pub shift: DVec2,
    /// Larger than it would be, to the right and down.
    pub scale: DVec2,
    /// Turned clockwise about the middle, in radians.
    pub turn: f64,
    /// How it is filtered.
    pub filter: Filter,
}

/// The most pixels of a picture.
const MOST: usize = 1 << 28;

/// What of a footprint is picture, and how much of it that is.
fn within(footprint: Footprint) -> (Footprint, f32) {
    let Footprint { at, right, down } = footprint;
    let extent = right.abs() + down.abs();
    let (mut middle, mut part) = (at, DVec2::ONE);
    for axis in 0..2 {
        let half = extent[axis] / 2.0;
        let (low, high) = ((at[axis] - half).max(0.0), (at[axis] + half).min(1.0));
        let is_seen = high > low;
        if !is_seen {
            return (footprint, 0.0);
        }
        middle[axis] = (low + high) / 2.0;
        part[axis] = (high - low) / extent[axis];
        // What is inside but for rounding is all there.
        if part[axis] > 1.0 - 1e-9 {
            (middle[axis], part[axis]) = (at[axis], 1.0);
        }
    }
    let footprint = Footprint { at: middle, right: right * part, down: down * part };
    (footprint, (part.x * part.y) as f32)
}

impl Reformat {
    /// The new picture, of colour and alpha alone.
    ///
    /// # Errors
    /// If the picture holds nothing.
    pub fn apply(&self, image: &Image) -> Result<Image> {
        let (width, height) = self.size;
        let held = image.window;
        if held.area() == 0 {
            return Err(Error::invalid("the picture holds no pixels"));
        }
        // What is not held is transparent.
        let whole = (image.size.0 as usize).checked_mul(image.size.1 as usize);
        let count = whole.filter(|count| *count <= MOST);
        let count = count.ok_or_else(|| Error::invalid("the picture has more than 2^28 pixels"))?;
        if u64::from(width) * u64::from(height) > MOST as u64 {
            return Err(Error::invalid("the new picture would have more than 2^28 pixels"));
        }
        let mut texels = vec![[0.0f32; 4]; count];
        for (at, pixel) in image.pixels().enumerate() {
            let (x, y) = (at as u32 % held.width + held.x, at as u32 / held.width + held.y);
            // Some programs hold more than the picture shows.
            if x >= image.size.0 || y >= image.size.1 {
                continue;
            }
            texels[y as usize * image.size.0 as usize + x as usize] = pixel;
        }
        let texels = Texels { size: image.size, samples: Texture::Linear(texels) };
        let once = std::sync::Mutex::new(Some(texels));
        let read = move || {
            let texels = once.lock().ok().and_then(|mut once| once.take());
            texels.ok_or_else(|| Error::invalid("the picture is gone"))
        };
        let source =
            Source { key: Key::of("reformat"), meaning: Meaning::Color, read: Box::new(read) };
        let store = Arc::new(Store::new(usize::MAX));
        // The levels are made before rows share them.
        store.open(&source)?;
        let target = DVec2::new(f64::from(width), f64::from(height));
        let [left, top, part_width, part_height] = self.part;
        let part = DVec2::new(part_width, part_height);
        let pixels = DVec2::new(f64::from(image.size.0), f64::from(image.size.1)) * part;
        // Pixels of the new picture to one of the old.
        let fit = target / pixels;
        let fit = if self.keeps_shape { DVec2::splat(fit.x.min(fit.y)) } else { fit };
        let (sin, cos) = (math::sin(self.turn), math::cos(self.turn));
        let place = |x: f64, y: f64| {
            let off = DVec2::new(x, y) - target * (0.5 + self.shift);
            let back = DVec2::new(off.x * cos + off.y * sin, off.y * cos - off.x * sin);
            let of_part = back / (fit * self.scale * pixels) + 0.5;
            DVec2::new(left, top) + of_part * part
        };
        let up = |at: DVec2| DVec2::new(at.x, 1.0 - at.y);
        let rows: Vec<Vec<[f32; 4]>> = (0..height)
            .into_par_iter()
            .map(|y| {
                let opened = store.open(&source)?;
                let one = |x: u32| {
                    let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
                    let at = up(place(x, y));
                    let (right, down) = (up(place(x + 1.0, y)) - at, up(place(x, y + 1.0)) - at);
                    let (footprint, covered) = within(Footprint { at, right, down });
                    if covered == 0.0 {
                        return Ok([0.0; 4]);
                    }
                    let [r, g, b, a, _] = footprint.see(&opened, self.filter, [Wrap::Clamp; 2])?;
                    Ok([r, g, b, a].map(|v| v * covered))
                };
                (0..width).map(one).collect::<Result<_>>()
            })
            .collect::<Result<_>>()?;
        let mut made = Image::new(self.size, Window::whole(width, height));
        for (k, name) in NAMES.into_iter().enumerate() {
            let channel = rows.iter().flatten().map(|pixel| pixel[k]).collect();
            made.insert(name, Samples::Float(channel))?;
        }
        Ok(made)
    }
}
