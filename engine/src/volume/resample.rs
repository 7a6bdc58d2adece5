//! Volumes with other steps.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::Volume;
use crate::error::{Error, Result};
use crate::watch::Watch;

impl Volume {
    /// The same extent with samples `step` times as far apart along each axis, as nearly as whole numbers of them
    /// allow. Between samples the field is a cubic spline through them (Catmull-Rom, its slopes
    /// limited beside cliffs; at the ends it goes on straight), so that a step below 1 makes surfaces smoother than the samples are, and not only larger.
    ///
    /// # Errors
    /// If the step is not 1/16 to 64, or there would be more than [`MOST_SAMPLES`](super::MOST_SAMPLES).
    pub fn resampled(&self, step: f64) -> Result<Volume> {
        if !(1.0 / 16.0..=64.0).contains(&step) {
            return Err(Error::invalid("`step` must be 1/16 to 64 samples"));
        }
        if step == 1.0 {
            return Ok(self.clone());
        }
        let counts =
            self.counts.map(|count| (((count - 1) as f64 / step).round() as usize).max(1) + 1);
        let spread = |axis: usize| (self.counts[axis] - 1) as f64 / (counts[axis] - 1) as f64;
        let stretch = DVec3::from_array(std::array::from_fn(spread));
        let steps = self.steps * DMat3::from_diagonal(stretch);
        // Samples are not made before it is known that they can be.
        super::check(counts, self.origin, steps)?;
        let watch = Watch::current();
        // One axis after another: those that get shorter first would be faster, and no different.
        let mut samples = self.samples.clone();
        let mut now = self.counts;
        for axis in 0..3 {
            watch.check()?;
            samples = along(&samples, now, axis, counts[axis]);
            now[axis] = counts[axis];
        }
        let volume = Volume::new(counts, self.origin, steps, samples)?;
        let (unit_name, about, notes) =
            (self.unit_name.clone(), self.about.clone(), self.notes.clone());
        Ok(Volume { unit: self.unit, up: self.up, unit_name, about, notes, ..volume })
    }
}

/// Samples with another count along one axis.
fn along(samples: &[f32], counts: [usize; 3], axis: usize, count: usize) -> Vec<f32> {
    let old = counts[axis];
    // Samples beside each other along the axis lie `inner` apart, in `outer` blocks.
    let inner: usize = counts[..axis].iter().product();
    let taps: Vec<(usize, f32)> = (0..count)
        .map(|to| {
            let at = to as f64 * (old - 1) as f64 / (count - 1) as f64;
            let cell = (at.floor() as usize).min(old - 2);
            (cell, (at - cell as f64) as f32)
        })
        .collect();
    let outer = samples.len() / (inner * old);
    let mut made = vec![0.0; inner * count * outer];
    made.par_chunks_mut(inner * count).enumerate().for_each(|(block, made)| {
        let from = &samples[block * inner * old..(block + 1) * inner * old];
        for ((cell, share), made) in taps.iter().zip(made.chunks_mut(inner)) {
            for (x, made) in made.iter_mut().enumerate() {
                let at = |i: usize| from[i * inner + x];
                let (b, c) = (at(*cell), at(cell + 1));
                // Beyond the ends it goes on straight.
                let a = if *cell > 0 { at(cell - 1) } else { b + b - c };
                let d = if cell + 2 < old { at(cell + 2) } else { c + c - b };
                *made = between([a, b, c, d], *share);
            }
        }
    });
    made
}

/// The value at a share of the way from the second of four samples to the third.
fn between([a, b, c, d]: [f32; 4], t: f32) -> f32 {
    // A sample stays itself, whatever is beside it.
    if t == 0.0 || t == 1.0 {
        return if t == 0.0 { b } else { c };
    }
    let (m, n) = (slope(b - a, c - b), slope(c - b, d - c));
    let rise = c - b;
    b + t * (m + t * ((3.0 * rise - 2.0 * m - n) + t * (m + n - 2.0 * rise)))
}

/// The slope at a sample by the rises before and after it: their mean, but beside a cliff no more than keeps the
/// spline from dipping at its foot.
fn slope(before: f32, after: f32) -> f32 {
    let mean = (before + after) / 2.0;
    let most = 3.0 * before.abs().min(after.abs());
    if before * after > 0.0 { mean.clamp(-most, most) } else { mean }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quadratic field is itself at any step, but for the cells at the border.
    #[test]
    fn fields_of_second_degree_are_kept() {
        let field = |p: DVec3| (p.x * p.x - 2.0 * p.y * p.z + p.z - 3.0) as f32;
        let coarse = Volume::of([9, 9, 9], DVec3::ZERO, DMat3::IDENTITY, field).unwrap();
        for step in [0.5, 0.25, 2.0] {
            let fine = coarse.resampled(step).unwrap();
            assert_eq!(fine.bounds(), coarse.bounds());
            for k in 0..fine.counts[2] {
                for j in 0..fine.counts[1] {
                    for i in 0..fine.counts[0] {
                        let place = fine.place([i, j, k]);
                        let within = place.min_element() >= 1.0 && place.max_element() <= 7.0;
                        let found = fine.samples[fine.index([i, j, k])];
                        assert!(!within || (found - field(place)).abs() < 1e-4, "{place} {found}");
                    }
                }
            }
        }
    }

    /// The foot of a cliff, such as a nucleus, has no dip.
    #[test]
    fn what_rises_does_not_dip() {
        let row = [0.1f32, 0.5, 2.0, 49.0, 2.1, 0.4];
        for cell in 0..3 {
            let at = |i: usize| row[(cell + i).saturating_sub(1)];
            let values = (0..=20).map(|t| between([at(0), at(1), at(2), at(3)], t as f32 / 20.0));
            let values: Vec<f32> = values.collect();
            assert!(values.windows(2).all(|pair| pair[1] >= pair[0]), "{cell}: {values:?}");
        }
    }
}
