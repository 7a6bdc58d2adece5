use glam::{DAffine2, DMat2, DVec2};
use rayon::prelude::*;
use std::sync::Arc;

use super::{Lights, NAMES, finite};
use crate::error::{Error, Result};
use crate::image::texels::{Samples as Texture, Texels};
use crate::image::{Image, Samples, Window};
use crate::key::Key;
use crate::math;
use crate::texture::{Footprint, Meaning, PictureSource, Store, TextureFilter, Wrap};
use crate::watch::Watch;

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
    pub filter: TextureFilter,
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
    /// The new picture. Colour, alpha and the layers of light are filtered; of other channels, which are not to be mixed,
    /// each pixel has what is at its middle.
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
        if whole.is_none_or(|count| count > MOST) {
            return Err(Error::invalid("the picture has more than 2^28 pixels"));
        }
        if u64::from(width) * u64::from(height) > MOST as u64 {
            return Err(Error::invalid("the new picture would have more than 2^28 pixels"));
        }
        let image = image.whole();
        let mut made = Image::new(self.size, Window::whole(width, height));
        made.names.clone_from(&image.names);
        let mut put = |names: [String; 4], count: usize, pixels: &[[f32; 4]]| -> Result<()> {
            for (k, name) in names.iter().enumerate().take(count) {
                let values = pixels.iter().map(|pixel| finite(pixel[k])).collect();
                made.insert(name, Samples::Float(values))?;
            }
            Ok(())
        };
        put(NAMES.map(str::to_owned), 4, &self.filtered(Texels::of(&image))?)?;
        let layers = Lights::of(&image).names;
        for name in &layers {
            let layer: Vec<[f32; 4]> =
                Lights::layer(&image, name).into_iter().map(|[r, g, b]| [r, g, b, 0.0]).collect();
            let texels = Texels { size: image.size, samples: Texture::Linear(layer) };
            put(NAMES.map(|axis| format!("{name}.{axis}")), 3, &self.filtered(texels)?)?;
        }
        let place = self.place(image.size);
        if let Some(attributes) = &image.attributes {
            let start = place(0.0, 0.0);
            let along = DMat2::from_cols(
                place(f64::from(width), 0.0) - start,
                place(0.0, f64::from(height)) - start,
            );
            let from_new = DAffine2 { matrix2: along, translation: start };
            made.attributes = Some(Arc::new(attributes.reframed(from_new.inverse())));
        }
        let places: Vec<Option<usize>> = (0..width as usize * height as usize)
            .map(|at| {
                let (x, y) = (at % width as usize, at / width as usize);
                let at = place(x as f64 + 0.5, y as f64 + 0.5);
                let is_in = at.cmpge(DVec2::ZERO).all() && at.cmplt(DVec2::ONE).all();
                let column = (at.x * f64::from(image.size.0)) as usize;
                let row = (at.y * f64::from(image.size.1)) as usize;
                is_in.then(|| row * image.size.0 as usize + column)
            })
            .collect();
        for (name, samples) in image.channels() {
            let layer = name.rsplit_once('.').map_or("", |(layer, _)| layer);
            if !NAMES.contains(&name) && !layers.contains(layer) {
                made.insert(name, samples.moved(&places))?;
            }
        }
        Ok(made)
    }

    /// From a place in the new picture, in pixels, to the place in one of a size, in shares of it from its top left.
    fn place(&self, size: (u32, u32)) -> impl Fn(f64, f64) -> DVec2 + Sync {
        let target = DVec2::new(f64::from(self.size.0), f64::from(self.size.1));
        let [left, top, part_width, part_height] = self.part;
        let part = DVec2::new(part_width, part_height);
        let pixels = DVec2::new(f64::from(size.0), f64::from(size.1)) * part;
        // Pixels of the new picture to one of the old.
        let fit = target / pixels;
        let fit = if self.keeps_shape { DVec2::splat(fit.x.min(fit.y)) } else { fit };
        let (sin, cos) = (math::sin(self.turn), math::cos(self.turn));
        let (shift, scale) = (self.shift, self.scale);
        move |x: f64, y: f64| {
            let off = DVec2::new(x, y) - target * (0.5 + shift);
            // Places are taken back from the new picture, so all is undone in reverse: moved,
            // turned, scaled.
            let back = DVec2::new(off.x * cos + off.y * sin, off.y * cos - off.x * sin);
            let of_part = back / (fit * scale * pixels) + 0.5;
            DVec2::new(left, top) + of_part * part
        }
    }

    /// The pixels of the new picture, each the mean of what it covers.
    fn filtered(&self, texels: Texels) -> Result<Vec<[f32; 4]>> {
        let (width, height) = self.size;
        let place = self.place(texels.size);
        let once = std::sync::Mutex::new(Some(texels));
        let read = move || {
            let texels = once.lock().ok().and_then(|mut once| once.take());
            texels.ok_or_else(|| Error::invalid("the picture is gone"))
        };
        let source = PictureSource {
            key: Key::of("reformat"),
            meaning: Meaning::Color,
            read: Box::new(read),
        };
        let store = Store::new(usize::MAX);
        let watch = Watch::current();
        // The levels are made before rows share them.
        store.open(&source)?;
        // Textures have v upwards, pictures y downwards.
        let up = |at: DVec2| DVec2::new(at.x, 1.0 - at.y);
        let rows: Vec<Vec<[f32; 4]>> = (0..height)
            .into_par_iter()
            .map(|y| {
                watch.check()?;
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
        Ok(rows.concat())
    }
}
