//! Cutting a subject out of a photograph (\[N], trees extracted from a photograph; \[D], figure 15: a
//! foreground extracted by thresholds).

use glam::{DVec3, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{straight, with_pixels};
use crate::color::{Color, encode_srgb};
use crate::error::{Error, Result};
use crate::image::Image;
use crate::polygon;

/// What tells the background from the subject. Numbers are of the picture as a display codes it, 0 to 1: what is
/// not beyond the first is surely subject, what is beyond the second surely background, and what is between them
/// is weighed by the colours around it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub enum ColorKey {
    /// The background is brighter: luminance.
    Brighter(f32, f32),
    /// The background is darker: the first number is the greater one.
    Darker(f32, f32),
    /// The background is bluer: its blue is so much above the mean of red and green.
    Bluer(f32, f32),
    /// The background has a hue, in degrees (0 red, 120 green, 240 blue), within so many degrees, and so much
    /// of it: the difference of the greatest and the least component. Half of it may be subject.
    Hue(f32, f32, f32),
    /// The background is nearer to the clean plate than this: subject beyond the first, background within the
    /// second, which is less. The distance is the greatest of the components'.
    Clean(f32, f32),
}

impl ColorKey {
    /// Whether its numbers are in order.
    ///
    /// # Errors
    /// What is wrong.
    pub fn check(self) -> std::result::Result<(), String> {
        let is_sound = match self {
            ColorKey::Brighter(a, b) | ColorKey::Bluer(a, b) => a < b,
            ColorKey::Darker(a, b) | ColorKey::Clean(a, b) => a > b,
            ColorKey::Hue(_, width, amount) => width > 0.0 && width <= 180.0 && amount > 0.0,
        };
        let numbers = match self {
            ColorKey::Brighter(a, b)
            | ColorKey::Bluer(a, b)
            | ColorKey::Darker(a, b)
            | ColorKey::Clean(a, b) => [a, b, 0.0],
            ColorKey::Hue(a, b, c) => [a, b, c],
        };
        if is_sound && numbers.iter().all(|v| v.is_finite()) {
            return Ok(());
        }
        Err(format!(
            "{self:?}: Brighter and Bluer rise, Darker and Clean fall, Hue has a width up to 180 degrees"
        ))
    }

    /// How surely a pixel is background, 0 to 1.
    fn background(self, pixel: Vec3, clean: Option<Vec3>) -> f32 {
        let between = |v: f32, from: f32, to: f32| ((v - from) / (to - from)).clamp(0.0, 1.0);
        let bright = encode_srgb(Color::new(pixel.x, pixel.y, pixel.z).luminance());
        let coded = pixel.to_array().map(encode_srgb);
        match self {
            ColorKey::Brighter(from, to) | ColorKey::Darker(from, to) => between(bright, from, to),
            ColorKey::Bluer(from, to) => between(coded[2] - (coded[0] + coded[1]) / 2.0, from, to),
            ColorKey::Hue(hue, width, amount) => {
                let most = coded.into_iter().fold(0.0, f32::max);
                let range = most - coded.into_iter().fold(1.0, f32::min);
                let [r, g, b] = coded;
                // The hexagon of hues, each sixth by which component is the greatest.
                let sixth = match range {
                    0.0 => return 0.0,
                    _ if most == r => (g - b) / range,
                    _ if most == g => 2.0 + (b - r) / range,
                    _ => 4.0 + (r - g) / range,
                };
                let off = (sixth * 60.0 - hue + 180.0).rem_euclid(360.0) - 180.0;
                let near = between(off.abs(), width, width / 2.0);
                near.min(between(range, amount / 2.0, amount))
            }
            ColorKey::Clean(from, to) => match clean {
                Some(clean) => {
                    let clean = clean.to_array().map(encode_srgb);
                    let off = coded.iter().zip(clean).map(|(a, b)| (a - b).abs());
                    between(off.fold(0.0, f32::max), from, to)
                }
                None => 0.0,
            },
        }
    }
}

/// How a subject is cut out.
#[derive(Clone, Debug, Default)]
pub struct Matte {
    /// What all say of the background counts; at least one.
    pub keys: Vec<ColorKey>,
    /// A polygon around the subject, in shares of the picture's width and height from the top left: all outside
    /// is background. Empty: there is none.
    pub garbage: Vec<(f64, f64)>,
    /// A polygon in the subject: all inside is subject. Empty: there is none.
    pub keep: Vec<(f64, f64)>,
    /// How wide soft edges are around what is no background, as a share of the height: so near to it nothing is
    /// surely background.
    pub edge: f64,
    /// How much of the background's colour is taken out of the subject's edge, 0 to 1.
    pub decontaminate: f32,
}

/// A subject that was cut out.
#[derive(Clone, Debug)]
pub struct Pulled {
    /// The subject, with alpha.
    pub subject: Image,
    /// Shares of pixels that are surely background, surely subject, and neither.
    pub shares: [f64; 3],
}

impl Matte {
    /// Cuts the subject out.
    ///
    /// Keys say what is surely subject and surely background. A pixel between is a mixture of the colours of
    /// both around it, in the proportion that comes nearest to its own; what the background gave of it is taken
    /// away.
    ///
    /// # Errors
    /// If a clean plate is needed and not given, or has another size.
    pub fn pull(&self, image: &Image, clean: Option<&Image>) -> Result<Pulled> {
        if clean.is_none() && self.keys.iter().any(|key| matches!(key, ColorKey::Clean(..))) {
            return Err(Error::invalid("a Clean key needs a clean plate: name one in `clean`"));
        }
        if let Some(clean) = clean
            && (clean.size, clean.window) != (image.size, image.window)
        {
            let ((w, h), (x, y)) = (image.size, clean.size);
            return Err(Error::invalid(format!(
                "the picture has {w} x {h} pixels and the clean plate {x} x {y}: they must be alike"
            )));
        }
        let color = |pixel: [f32; 4]| {
            let [r, g, b, _] = straight(pixel);
            Vec3::new(r, g, b)
        };
        let pixels: Vec<Vec3> = image.pixels().map(color).collect();
        let plate: Option<Vec<Vec3>> = clean.map(|clean| clean.pixels().map(color).collect());
        let (width, height) = (image.window.width as usize, image.window.height as usize);
        let sure = |at: usize| {
            let x = (image.window.x as f64 + (at % width) as f64 + 0.5) / f64::from(image.size.0);
            let y = (image.window.y as f64 + (at / width) as f64 + 0.5) / f64::from(image.size.1);
            if !self.garbage.is_empty() && !contains(&self.garbage, x, y) {
                return 1.0;
            }
            if !self.keep.is_empty() && contains(&self.keep, x, y) {
                return 0.0;
            }
            let clean = plate.as_ref().map(|plate| plate[at]);
            let all = self.keys.iter().map(|key| key.background(pixels[at], clean));
            // Without keys all that is no garbage is subject.
            // The least: all keys must say that it is background.
            all.reduce(f32::min).unwrap_or(0.0)
        };
        let mut sure: Vec<f32> = (0..pixels.len()).map(sure).collect();
        let edge = (self.edge * f64::from(image.size.1)).round() as usize;
        let near = near(&sure, width, height, edge);
        for (sure, near) in sure.iter_mut().zip(near) {
            if *sure >= 1.0 && near < 1.0 {
                // No longer sure, so that the mixture of the colours around it decides.
                *sure = 0.999;
            }
        }
        let only = |is: &dyn Fn(f32) -> bool| -> Vec<(Vec3, f32)> {
            let weigh = |(pixel, sure): (&Vec3, &f32)| {
                let weight = f32::from(u8::from(is(*sure)));
                (*pixel * weight, weight)
            };
            pixels.iter().zip(&sure).map(weigh).collect()
        };
        let behind = match &plate {
            Some(plate) => plate.clone(),
            None => spread(only(&|sure| sure >= 1.0), width, height),
        };
        let before = spread(only(&|sure| sure <= 0.0), width, height);
        let alpha = |at: usize| {
            let sure = sure[at];
            if sure <= 0.0 || sure >= 1.0 {
                return 1.0 - sure;
            }
            let (b, f, c) = (behind[at], before[at], pixels[at]);
            let way = f - b;
            let length = way.length_squared();
            // The place on the line between both colours that is nearest to the pixel's own. Where
            // both are alike it says nothing, and the keys do.
            if length < 1e-4 { 1.0 - sure } else { ((c - b).dot(way) / length).clamp(0.0, 1.0) }
        };
        let alphas: Vec<f32> = (0..pixels.len()).map(alpha).collect();
        let had: Vec<f32> = image.pixels().map(|[.., a]| a.clamp(0.0, 1.0)).collect();
        let done = (0..pixels.len()).map(|at| {
            let a = alphas[at];
            if a <= 0.0 {
                return [0.0; 4];
            }
            // The mixture, solved for the subject.
            let own = ((pixels[at] - behind[at] * (1.0 - a)) / a).max(Vec3::ZERO);
            // What divides by little is no longer known: then it is as the subject beside it.
            let known = own.lerp(before[at], (1.0 - a) * (1.0 - a));
            let [r, g, b] = pixels[at].lerp(known, self.decontaminate).to_array();
            // What was transparent before stays so.
            [r, g, b, 1.0].map(|v| v * a * had[at])
        });
        let subject = with_pixels(image, done)?;
        let share = |is: &dyn Fn(f32) -> bool| {
            sure.iter().filter(|sure| is(**sure)).count() as f64 / sure.len().max(1) as f64
        };
        let (all, none) = (share(&|sure| sure >= 1.0), share(&|sure| sure <= 0.0));
        Ok(Pulled { subject, shares: [all, none, 1.0 - all - none] })
    }
}

/// The least value within so many pixels.
fn near(values: &[f32], width: usize, height: usize, reach: usize) -> Vec<f32> {
    let least = |from: &[f32], step: usize, at: usize, count: usize, place: usize| {
        let (first, last) = (at.saturating_sub(reach), (at + reach).min(count - 1));
        let start = place - at * step;
        (first..=last).map(|k| from[start + k * step]).fold(f32::INFINITY, f32::min)
    };
    let all = 0..values.len();
    // The least of a square is the least along columns of the least along rows.
    let rows: Vec<f32> =
        all.clone().map(|place| least(values, 1, place % width, width, place)).collect();
    all.map(|place| least(&rows, width, place / width, height, place)).collect()
}

fn contains(corners: &[(f64, f64)], x: f64, y: f64) -> bool {
    let flat = corners.iter().map(|(x, y)| DVec3::new(*x, *y, 0.0));
    polygon::contains(flat, DVec3::Z, DVec3::new(x, y, 0.0))
}

/// Colours where there are some, spread to where there are none: each is the mean of what is near it, taken from
/// as small a square around it as has any.
fn spread(known: Vec<(Vec3, f32)>, width: usize, height: usize) -> Vec<Vec3> {
    if (width, height) == (1, 1) || known.is_empty() {
        let mean = |(color, weight): (Vec3, f32)| if weight > 0.0 { color / weight } else { color };
        return known.into_iter().map(mean).collect();
    }
    let (w, h) = (width.div_ceil(2), height.div_ceil(2));
    let mut half = vec![(Vec3::ZERO, 0.0f32); w * h];
    for (at, (color, weight)) in known.iter().enumerate() {
        let to = &mut half[(at / width / 2) * w + at % width / 2];
        *to = (to.0 + *color, to.1 + weight);
    }
    // A few say as much as many: near ones count more than far ones.
    half.iter_mut().filter(|(_, weight)| *weight > 1.0).for_each(|(color, weight)| {
        *color /= *weight;
        *weight = 1.0;
    });
    let coarse = spread(half, w, h);
    let smooth = |x: usize, y: usize| {
        // The middle of a fine pixel, counted in coarse pixels from the middle of the first.
        let (fx, fy) = ((x as f32 - 0.5) / 2.0, (y as f32 - 0.5) / 2.0);
        let (left, top) = (fx.floor(), fy.floor());
        let at = |x: f32, y: f32| {
            let (x, y) = (x.clamp(0.0, w as f32 - 1.0), y.clamp(0.0, h as f32 - 1.0));
            coarse[y as usize * w + x as usize]
        };
        let upper = at(left, top).lerp(at(left + 1.0, top), fx - left);
        upper.lerp(at(left, top + 1.0).lerp(at(left + 1.0, top + 1.0), fx - left), fy - top)
    };
    let fill = |(at, (color, weight)): (usize, &(Vec3, f32))| {
        let weight = weight.min(1.0);
        let own = if weight > 0.0 { *color / weight } else { Vec3::ZERO };
        smooth(at % width, at / width).lerp(own, weight)
    };
    known.iter().enumerate().map(fill).collect()
}
