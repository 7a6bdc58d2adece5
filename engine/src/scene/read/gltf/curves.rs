//! Samplers of animations: values over time, between keys.
//!
//! Before its first key a sampler has the first value, after its last key the last one. Between two keys it steps, goes
//! straight (rotations along the shorter arc, at an even pace), or follows a cubic Hermite spline: the appendix on
//! interpolation of the specification.

use ::gltf::json::accessor::{ComponentType, Type};
use ::gltf::json::animation::{Interpolation, Property, Sampler};
use ::gltf::json::validation::Checked;

use super::Builder;
use super::values::{Kind, Values};
use crate::error::{Error, Result};
use crate::math;

const FLOAT: &[ComponentType] = &[ComponentType::F32];
/// What rotations and weights may be beside; whole numbers must be normalized.
const SHARES: &[ComponentType] = &[
    ComponentType::F32,
    ComponentType::I8,
    ComponentType::U8,
    ComponentType::I16,
    ComponentType::U16,
];

/// A sampler that was checked.
pub(super) struct Curve {
    times: Values,
    values: Values,
    interpolation: Interpolation,
    /// The values of a key: 1, or one for each morph target.
    width: usize,
}

/// Where a time lies between keys.
struct Between {
    /// The key at or before it; the first, if it lies before all.
    key: usize,
    /// The way from this key to the next, 0 to 1.
    share: f64,
    /// The seconds from this key to the next.
    distance: f64,
}

/// Which of the three values that a key of a spline has.
#[derive(Clone, Copy)]
enum Part {
    Before,
    Value,
    After,
}

impl Curve {
    /// A sampler as what moves a property, of a mesh with so many morph targets.
    ///
    /// # Errors
    /// If its times do not increase, its values are too many, too few or of the wrong kind, or a number is not finite.
    pub(super) fn new(
        builder: &mut Builder<'_>,
        sampler: &Sampler,
        property: Property,
        targets: usize,
    ) -> Result<Curve> {
        let Checked::Valid(interpolation) = sampler.interpolation else {
            return Err(Error::invalid("its interpolation is not known"));
        };
        let (shape, components, width) = match property {
            Property::Translation | Property::Scale => (Type::Vec3, FLOAT, 1),
            Property::Rotation => (Type::Vec4, SHARES, 1),
            Property::MorphTargetWeights => (Type::Scalar, SHARES, targets),
        };
        let (input, output) = (sampler.input.value(), sampler.output.value());
        let times = builder.values(input, &Kind { shapes: &[Type::Scalar], components: FLOAT })?;
        let values = builder.values(output, &Kind { shapes: &[shape], components })?;
        if !values.are_shares() {
            return Err(Error::invalid(format!("accessor {output} is not normalized")));
        }
        let of_key = if interpolation == Interpolation::CubicSpline { 3 * width } else { width };
        let (keys, count) = (times.count, values.count);
        if keys.checked_mul(of_key) != Some(count) {
            return Err(Error::invalid(format!(
                "accessor {output} has {count} values, and {keys} keys need {of_key} each"
            )));
        }
        // Counted before they are looked at: they need no data, and may be beyond counting.
        builder.buffers.take((keys as u64).saturating_add(count as u64))?;
        let curve = Curve { times, values, interpolation, width };
        curve.check(input, output)?;
        Ok(curve)
    }

    fn check(&self, input: usize, output: usize) -> Result<()> {
        let mut before = f64::NEG_INFINITY;
        for key in 0..self.times.count {
            let time = self.time(key);
            if !time.is_finite() {
                let message = format!("accessor {input}: the time of key {key} is not finite");
                return Err(Error::invalid(message));
            }
            if time <= before {
                return Err(Error::invalid(format!(
                    "accessor {input}: key {key} is at {time} s, and the one before it at {before} s: times \
                     must increase"
                )));
            }
            before = time;
        }
        let is_finite = |at: &usize| self.values.floats::<4>(*at).iter().all(|v| v.is_finite());
        match (0..self.values.count).find(|at| !is_finite(at)) {
            Some(at) => Err(Error::invalid(format!("accessor {output}: value {at} is not finite"))),
            None => Ok(()),
        }
    }

    /// The times of its first and last keys, in seconds.
    pub(super) fn range(&self) -> [f64; 2] {
        [self.time(0), self.time(self.times.count - 1)]
    }

    /// The three numbers of a translation or scale at a time in seconds.
    pub(super) fn vector(&self, seconds: f64) -> [f64; 3] {
        self.at(&self.between(seconds), 0)
    }

    /// A rotation at a time in seconds, as a quaternion of any length.
    pub(super) fn rotation(&self, seconds: f64) -> [f64; 4] {
        let between = self.between(seconds);
        if self.interpolation != Interpolation::Linear || between.share == 0.0 {
            return self.at(&between, 0);
        }
        let [from, to] =
            [between.key, between.key + 1].map(|key| unit(self.value(key, Part::Value, 0)));
        slerp(from, to, between.share)
    }

    /// The weights of all morph targets at a time in seconds.
    pub(super) fn weights(&self, seconds: f64) -> Vec<f64> {
        let between = self.between(seconds);
        (0..self.width).map(|target| self.at::<1>(&between, target)[0]).collect()
    }

    fn time(&self, key: usize) -> f64 {
        self.times.floats::<1>(key)[0]
    }

    fn between(&self, seconds: f64) -> Between {
        // Times of keys are single precision: what steps at the time of a frame is to have stepped in that frame.
        let seconds = match self.interpolation {
            Interpolation::Step => f64::from(seconds as f32),
            _ => seconds,
        };
        let (mut low, mut high) = (0, self.times.count);
        while low < high {
            let middle = low.midpoint(high);
            if self.time(middle) <= seconds {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        let key = low.saturating_sub(1);
        if low == 0 || low == self.times.count {
            return Between { key, share: 0.0, distance: 0.0 };
        }
        let (from, distance) = (self.time(key), self.time(low) - self.time(key));
        Between { key, share: (seconds - from) / distance, distance }
    }

    /// A value of a key, as the file has it.
    fn value<const N: usize>(&self, key: usize, part: Part, target: usize) -> [f64; N] {
        let at = match self.interpolation {
            // All tangents towards a key, then its values, then all tangents from it.
            Interpolation::CubicSpline => (3 * key + part as usize) * self.width + target,
            _ => key * self.width + target,
        };
        self.values.floats(at)
    }

    fn at<const N: usize>(&self, between: &Between, target: usize) -> [f64; N] {
        let Between { key, share: t, distance } = *between;
        let from: [f64; N] = self.value(key, Part::Value, target);
        if t == 0.0 || self.interpolation == Interpolation::Step {
            return from;
        }
        let to: [f64; N] = self.value(key + 1, Part::Value, target);
        if self.interpolation == Interpolation::Linear {
            return std::array::from_fn(|i| (1.0 - t) * from[i] + t * to[i]);
        }
        let leaving: [f64; N] = self.value(key, Part::After, target);
        let arriving: [f64; N] = self.value(key + 1, Part::Before, target);
        let (t2, t3) = (t * t, t * t * t);
        std::array::from_fn(|i| {
            (2.0 * t3 - 3.0 * t2 + 1.0) * from[i]
                + distance * (t3 - 2.0 * t2 + t) * leaving[i]
                + (3.0 * t2 - 2.0 * t3) * to[i]
                + distance * (t3 - t2) * arriving[i]
        })
    }
}

/// A quaternion of length 1; what has no length turns nothing.
fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = length(q);
    if length > 0.0 { q.map(|v| v / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

fn length(q: [f64; 4]) -> f64 {
    q.iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// Between two unit quaternions, at an even pace along the shorter arc.
fn slerp(from: [f64; 4], to: [f64; 4], share: f64) -> [f64; 4] {
    let dot: f64 = from.iter().zip(to).map(|(a, b)| a * b).sum();
    // A quaternion and its negative are one rotation.
    let to = if dot < 0.0 { to.map(|v| -v) } else { to };
    let apart = length(std::array::from_fn(|i| from[i] - to[i]));
    let together = length(std::array::from_fn(|i| from[i] + to[i]));
    let angle = 2.0 * math::atan2(apart, together);
    let sin = math::sin(angle);
    let [a, b] = if sin < 1e-9 {
        [1.0 - share, share]
    } else {
        [1.0 - share, share].map(|share| math::sin(share * angle) / sin)
    };
    std::array::from_fn(|i| a * from[i] + b * to[i])
}
