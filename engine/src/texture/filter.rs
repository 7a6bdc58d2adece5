//! What a pixel sees of a picture.

use glam::DVec2;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::pyramid::{Level, Meaning};
use super::store::Opened;
use crate::error::Result;

/// How pictures on surfaces are filtered: time for accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum TextureFilter {
    /// The nearest texel: what is far away flickers.
    Nearest,
    /// Between texels and between levels, by the longer side of what a pixel covers: surfaces seen along them
    /// are blurred.
    Trilinear,
    /// As `Trilinear`, but along the longer side up to so many times, 1 to 256, by the shorter one.
    Anisotropic(u32),
    /// The mean over all texels that a pixel covers: what the others are measured against.
    Exact,
}

impl Default for TextureFilter {
    fn default() -> TextureFilter {
        TextureFilter::Anisotropic(8)
    }
}

impl TextureFilter {
    /// Whether its number is in range.
    ///
    /// # Errors
    /// If it is not.
    pub fn check(self) -> std::result::Result<(), String> {
        match self {
            TextureFilter::Anisotropic(n) if !(1..=256).contains(&n) => {
                Err(format!("Anisotropic({n}): must be 1 to 256"))
            }
            _ => Ok(()),
        }
    }
}

/// What is beside a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture again, turned round every other time.
    Mirror,
    /// Its border.
    Clamp,
    /// Nothing: what is there shows as if there were no picture.
    Nothing,
}

/// What a pixel covers of a picture, in pictures: u to the right, v upwards.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Footprint {
    /// The middle.
    pub at: DVec2,
    /// From there by one pixel to the right.
    pub right: DVec2,
    /// From there by one pixel down.
    pub down: DVec2,
}

/// The most samples of `Exact` along a side.
const MOST: f64 = 64.0;

impl Footprint {
    /// What is seen of a picture: linear, colours with associated alpha; and how much of what the pixel
    /// covers is picture, 1 unless it wraps by `Nothing`.
    ///
    /// # Errors
    /// If the picture must be read and cannot be.
    pub fn see(
        &self,
        picture: &Opened<'_>,
        filter: TextureFilter,
        wrap: [Wrap; 2],
    ) -> Result<Sample> {
        let size = DVec2::new(f64::from(picture.size.0), f64::from(picture.size.1));
        let finite = |v: DVec2| if v.is_finite() { v } else { DVec2::ZERO };
        let at = finite(self.at);
        let (right, down) = (finite(self.right), finite(self.down));
        let (a, b) = (right * size, down * size);
        let look = PictureView { picture, wrap };
        match filter {
            TextureFilter::Nearest => look.nearest(at),
            TextureFilter::Trilinear => look.between(at, a.length().max(b.length())),
            TextureFilter::Anisotropic(most) => {
                let (major, minor) = axes(a, b);
                let long = major.length();
                // What is round but for rounding takes one.
                let probes = (long / minor.max(1.0) - 1e-3).ceil().clamp(1.0, f64::from(most));
                // Where probes are too few for the length, each is wider: rather blurred than
                // speckled.
                let width = (long / probes).max(minor);
                let step = major / size / probes;
                let mut sum = [0.0; 5];
                for k in 0..probes as u32 {
                    let at = at + step * (f64::from(k) + 0.5 - probes / 2.0);
                    add(&mut sum, look.between(at, width)?, 1.0 / probes as f32);
                }
                Ok(sum)
            }
            TextureFilter::Exact => {
                // Two samples to a texel, of a level that so many samples cover.
                let longest = a.length().max(b.length());
                let level = (longest * 2.0 / MOST).max(1.0);
                let number = crate::math::log2(level).ceil().max(0.0);
                let texel = crate::math::pow(2.0, number);
                let count = |side: DVec2| (side.length() / texel * 2.0).ceil().clamp(1.0, MOST);
                let (m, n) = (count(a), count(b));
                let mut sum = [0.0; 5];
                for j in 0..n as u32 {
                    for i in 0..m as u32 {
                        let (u, v) = (f64::from(i) + 0.5, f64::from(j) + 0.5);
                        let at = at + right * (u / m - 0.5) + down * (v / n - 0.5);
                        let width = if number > 0.0 { texel } else { (1.0 / m).min(1.0 / n) };
                        add(&mut sum, look.on(number as u32, at, width)?, (1.0 / (m * n)) as f32);
                    }
                }
                Ok(sum)
            }
        }
    }
}

/// The longer axis of the ellipse that a parallelogram stands for, and the length of the shorter one.
fn axes(a: DVec2, b: DVec2) -> (DVec2, f64) {
    // Of the matrix with columns a and b: singular values and the first left vector.
    let (p, q, r) = (a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y);
    let (mean, half) = ((p + r) / 2.0, (p - r) / 2.0);
    let root = (half * half + q * q).sqrt();
    let (long, short) = ((mean + root).max(0.0).sqrt(), (mean - root).max(0.0).sqrt());
    // Of the two forms of the vector the one in which nothing cancels.
    let along = if half >= 0.0 { DVec2::new(half + root, q) } else { DVec2::new(q, root - half) };
    (along.try_normalize().unwrap_or(DVec2::X) * long, short)
}

/// Red, green, blue, alpha, and how much of it is picture.
pub type Sample = [f32; 5];

fn add(sum: &mut Sample, texel: Sample, weight: f32) {
    sum.iter_mut().zip(texel).for_each(|(sum, v)| *sum += v * weight);
}

/// A picture on a surface.
pub(super) struct PictureView<'a, 's> {
    pub(super) picture: &'a Opened<'s>,
    pub(super) wrap: [Wrap; 2],
}

impl PictureView<'_, '_> {
    fn nearest(&self, at: DVec2) -> Result<Sample> {
        let level = self.picture.level(0)?;
        let [x, y] = self.place(at, &level).map(|v| v.floor() as i64);
        Ok(self.cut(self.texel(&level, x, y), 0.0))
    }

    /// Between the two levels that show the mean over about `width` texels of the picture.
    fn between(&self, at: DVec2, width: f64) -> Result<Sample> {
        let most = f64::from(self.picture.count() - 1);
        // A texel that is the mean of a square, taken with its neighbours, is spread as far as a pixel whose side
        // is this much longer.
        let texel = width / 3f64.sqrt();
        let wanted = if texel > 1.0 { crate::math::log2(texel).min(most) } else { 0.0 };
        let (number, part) = (wanted.floor(), wanted.fract() as f32);
        let mut seen = self.on(number as u32, at, width)?;
        if part > 0.0 {
            let coarser = self.on(number as u32 + 1, at, width)?;
            for (fine, coarse) in seen.iter_mut().zip(coarser) {
                *fine += (coarse - *fine) * part;
            }
        }
        Ok(seen)
    }

    /// Between the texels of a level. A pixel covers `width` texels of the picture.
    fn on(&self, number: u32, at: DVec2, width: f64) -> Result<Sample> {
        let level = self.picture.level(number)?;
        let [x, y] = self.place(at, &level).map(|v| v - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (u, v) = ((x - left) as f32, (y - top) as f32);
        let (left, top) = (left as i64, top as i64);
        let mut sum = [0.0; 5];
        for (i, j, weight) in [
            (0, 0, (1.0 - u) * (1.0 - v)),
            (1, 0, u * (1.0 - v)),
            (0, 1, (1.0 - u) * v),
            (1, 1, u * v),
        ] {
            if weight > 0.0 {
                add(&mut sum, self.texel(&level, left + i, top + j), weight);
            }
        }
        // Coarser levels were cut texel by texel before they were averaged.
        Ok(if number == 0 { self.cut(sum, width) } else { sum })
    }

    /// The place of a point on a level, in its texels from the top left, near the picture.
    pub(super) fn place(&self, at: DVec2, level: &Level) -> [f64; 2] {
        let sizes = [level.width, level.height].map(f64::from);
        // v is upwards.
        let places = [at.x, 1.0 - at.y];
        [0, 1].map(|axis| {
            let place = match self.wrap[axis] {
                Wrap::Repeat => places[axis] - places[axis].floor(),
                Wrap::Mirror => places[axis] - (places[axis] / 2.0).floor() * 2.0,
                // Farther out all is alike, and numbers stay small enough for whole texels.
                Wrap::Clamp | Wrap::Nothing => places[axis].clamp(-4.0, 5.0),
            };
            place * sizes[axis]
        })
    }

    fn texel(&self, level: &Level, x: i64, y: i64) -> Sample {
        match self.within(level, x, y) {
            Some((x, y)) => {
                let [r, g, b, a] = level.texel(x, y);
                [r, g, b, a, 1.0]
            }
            None => [0.0; 5],
        }
    }

    /// Which texel of a level stands at a place; none beside a picture that ends.
    pub(super) fn within(&self, level: &Level, x: i64, y: i64) -> Option<(u32, u32)> {
        let inside = |at: i64, size: u32, wrap: Wrap| {
            let size = i64::from(size);
            match wrap {
                Wrap::Repeat => Some(at.rem_euclid(size)),
                Wrap::Mirror => {
                    let at = at.rem_euclid(2 * size);
                    Some(if at < size { at } else { 2 * size - 1 - at })
                }
                Wrap::Clamp => Some(at.clamp(0, size - 1)),
                Wrap::Nothing => Some(at).filter(|at| (0..size).contains(at)),
            }
        };
        let x = inside(x, level.width, self.wrap[0])?;
        Some((x as u32, inside(y, level.height, self.wrap[1])? as u32))
    }

    /// What is left of a place of the picture itself if it is cut out. Between texels the border is a line,
    /// and a pixel that covers `width` texels has its share of it.
    fn cut(&self, sample: Sample, width: f64) -> Sample {
        let Meaning::CutOut(from) = self.picture.meaning() else { return sample };
        let [r, g, b, a, covered] = sample;
        if a <= 0.0 {
            return [0.0, 0.0, 0.0, 0.0, covered];
        }
        // Alpha goes from nothing to all within about a texel; what has none and what has all of it stays so.
        let soft = (width as f32).min(1.0).min(2.0 * from).min(2.0 * (1.0 - from));
        let above = a / covered - from;
        let share = match soft > 0.0 {
            true => (above / soft + 0.5).clamp(0.0, 1.0),
            false => f32::from(u8::from(above >= -1e-6)),
        };
        let part = share * covered;
        [r / a * part, g / a * part, b / a * part, part, covered]
    }
}
