use rayon::prelude::*;

use super::{Lights, with_pixels};
use crate::error::Result;
use crate::image::Image;
use crate::math;
use crate::watch::Watch;

/// A picture spread by a Gaussian of a standard deviation in pixels, 0 or more. At its border it goes on as it
/// ends.
///
/// # Errors
/// None.
pub fn blur(image: &Image, deviation: f64) -> Result<Image> {
    // Beyond three deviations lies a quarter of a percent.
    let reach = (3.0 * deviation).ceil().min(1e4) as i64;
    if reach < 1 {
        return Ok(image.clone());
    }
    let weight = |k: i64| {
        let x = k as f64 / deviation;
        math::expf((-0.5 * x * x) as f32)
    };
    let mut weights: Vec<f32> = (-reach..=reach).map(weight).collect();
    let sum: f32 = weights.iter().sum();
    // What was cut off would darken the picture.
    weights.iter_mut().for_each(|weight| *weight /= sum);
    let (width, height) = (image.window.width as usize, image.window.height as usize);
    let spread = |pixels: &[[f32; 4]]| spread(pixels, width, height, &weights);
    let mut blurred = with_pixels(image, spread(&image.pixels().collect::<Vec<_>>()).into_iter())?;
    for name in Lights::of(image).names {
        let layer: Vec<[f32; 4]> =
            Lights::layer(image, &name).into_iter().map(|[r, g, b]| [r, g, b, 0.0]).collect();
        let layer: Vec<[f32; 3]> =
            spread(&layer).into_iter().map(|[r, g, b, _]| [r, g, b]).collect();
        Lights::put(&mut blurred, &name, &layer)?;
    }
    Ok(blurred)
}

/// Pixels, each the mean of those around it by weights along rows and columns.
fn spread(pixels: &[[f32; 4]], width: usize, height: usize, weights: &[f32]) -> Vec<[f32; 4]> {
    let reach = (weights.len() / 2) as i64;
    let along = |count: usize, from: &(dyn Fn(usize) -> [f32; 4] + Sync), at: usize| {
        let mut sum = [0.0f32; 4];
        for (weight, k) in weights.iter().zip(-reach..) {
            let place = (at as i64 + k).clamp(0, count as i64 - 1) as usize;
            sum.iter_mut().zip(from(place)).for_each(|(sum, v)| *sum += v * weight);
        }
        sum
    };
    let watch = Watch::current();
    let along = |count: usize, from: &(dyn Fn(usize) -> [f32; 4] + Sync), at: usize| match watch
        .is_stopped()
    {
        true => [0.0; 4],
        false => along(count, from, at),
    };
    // A Gaussian is the product of one along rows and one along columns.
    let rows: Vec<[f32; 4]> = (0..width * height)
        .into_par_iter()
        .map(|at| {
            let (x, y) = (at % width, at / width);
            along(width, &|x| pixels[y * width + x], x)
        })
        .collect();
    (0..width * height)
        .into_par_iter()
        .map(|at| {
            let (x, y) = (at % width, at / width);
            along(height, &|y| rows[y * width + x], y)
        })
        .collect()
}
