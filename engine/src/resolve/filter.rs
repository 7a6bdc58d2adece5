//! Pixel filters: how much what lies beside a pixel's centre counts.
//!
//! A filter is a product of one function f in x and in y. Along x spans are integrated analytically:
//! what lies left of a boundary weighs F, the integral of f; of a boundary that leans through a strip,
//! the mean of F from its one end to the other, which is a difference of the integral of F. Both
//! integrals are tabulated once, with the values and the slopes of each knot, so that a cubic between
//! knots is exact to 1e-10. Along y a line weighs the integral of f over its strip.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::LazyLock;

use crate::math;

/// A pixel filter. Weights sum to 1; those of `Mitchell` and `Lanczos` are negative in places, so that
/// edges overshoot a little and look sharper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
pub enum PixelFilter {
    /// The mean over the pixel: radius 1/2. The papers' own.
    #[default]
    Box,
    /// A triangle: radius 1.
    Tent,
    /// A Gaussian of standard deviation 1/2, lowered so that it ends at 0: radius 1.5.
    Gaussian,
    /// Mitchell's and Netravali's cubic with B = C = 1/3: radius 2.
    Mitchell,
    /// A sinc windowed by a wider sinc: radius 3.
    Lanczos,
}

impl PixelFilter {
    /// How far it reaches from a pixel's centre, in pixels of the picture.
    pub fn radius(self) -> f64 {
        match self {
            PixelFilter::Box => 0.5,
            PixelFilter::Tent => 1.0,
            PixelFilter::Gaussian => 1.5,
            PixelFilter::Mitchell => 2.0,
            PixelFilter::Lanczos => 3.0,
        }
    }

    /// Its value at `t` pixels from the centre, up to a constant factor.
    fn value(self, t: f64) -> f64 {
        let t = t.abs();
        if t > self.radius() {
            return 0.0;
        }
        match self {
            PixelFilter::Box => 1.0,
            PixelFilter::Tent => 1.0 - t,
            PixelFilter::Gaussian => math::exp(-2.0 * t * t) - math::exp(-2.0 * 1.5 * 1.5),
            PixelFilter::Mitchell if t < 1.0 => (7.0 * t - 12.0) * t * t + 16.0 / 3.0,
            PixelFilter::Mitchell => ((-7.0 / 3.0 * t + 12.0) * t - 20.0) * t + 32.0 / 3.0,
            PixelFilter::Lanczos => sinc(t) * sinc(t / 3.0),
        }
    }

    /// Its integrals.
    pub(super) fn kernel(self) -> &'static Kernel {
        static KERNELS: [LazyLock<Kernel>; 5] = [
            LazyLock::new(|| Kernel::new(PixelFilter::Box)),
            LazyLock::new(|| Kernel::new(PixelFilter::Tent)),
            LazyLock::new(|| Kernel::new(PixelFilter::Gaussian)),
            LazyLock::new(|| Kernel::new(PixelFilter::Mitchell)),
            LazyLock::new(|| Kernel::new(PixelFilter::Lanczos)),
        ];
        &KERNELS[self as usize]
    }
}

fn sinc(t: f64) -> f64 {
    let angle = std::f64::consts::PI * t;
    if angle < 1e-8 { 1.0 } else { math::sin(angle) / angle }
}

/// Intervals of the tables, a multiple of every whole radius: where the cubics of a filter meet there
/// is a knot.
const INTERVALS: usize = 6 * 512;

/// The integrals of a filter from its left end on.
#[derive(Debug)]
pub(super) struct Kernel {
    radius: f64,
    step: f64,
    /// By knot: f, its integral F, which ends at 1, and the integral of F.
    knots: Vec<[f64; 3]>,
}

impl Kernel {
    fn new(filter: PixelFilter) -> Kernel {
        let radius = filter.radius();
        let step = 2.0 * radius / INTERVALS as f64;
        let at = |i: f64| filter.value(i * step - radius);
        // Simpson's rule.
        let piece = |i: usize| {
            let i = i as f64;
            (at(i) + 4.0 * at(i + 0.5) + at(i + 1.0)) * step / 6.0
        };
        let total: f64 = (0..INTERVALS).map(piece).sum();
        let mut knots = vec![[at(0.0) / total, 0.0, 0.0]];
        for i in 0..INTERVALS {
            let [f, first, second] = knots[i];
            let next = at((i + 1) as f64) / total;
            let sum = if i + 1 == INTERVALS { 1.0 } else { first + piece(i) / total };
            let under = step / 2.0 * (first + sum) + step * step / 12.0 * (f - next);
            knots.push([next, sum, second + under]);
        }
        Kernel { radius, step, knots }
    }

    /// The `order`th integral at `t` pixels from the centre, within the radius.
    fn integral(&self, order: usize, t: f64) -> f64 {
        let place = ((t + self.radius) / self.step).clamp(0.0, INTERVALS as f64);
        let i = (place as usize).min(INTERVALS - 1);
        let (u, a, b) = (place - i as f64, &self.knots[i], &self.knots[i + 1]);
        // The cubic through both values with both slopes.
        let (low, high) = (a[order], b[order]);
        let (rise, fall) = (a[order - 1] * self.step, b[order - 1] * self.step);
        let v = 1.0 - u;
        low * (1.0 + 2.0 * u) * v * v + high * (1.0 + 2.0 * v) * u * u + rise * u * v * v
            - fall * u * u * v
    }

    /// What lies left of `t` pixels from the centre weighs this much.
    pub(super) fn left_of(&self, t: f64) -> f64 {
        if t <= -self.radius {
            0.0
        } else if t >= self.radius {
            1.0
        } else {
            self.integral(1, t)
        }
    }

    /// What lies left of a boundary that runs straight from `t` to `u`.
    pub(super) fn mean_left_of(&self, t: f64, u: f64) -> f64 {
        // Nearer ends would lose digits; there the middle is as good.
        if (u - t).abs() < 1e-4 {
            return self.left_of((t + u) / 2.0);
        }
        let sum = |t: f64| match t {
            t if t <= -self.radius => 0.0,
            t if t >= self.radius => self.knots[INTERVALS][2] + (t - self.radius),
            t => self.integral(2, t),
        };
        (sum(u) - sum(t)) / (u - t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [PixelFilter; 5] = [
        PixelFilter::Box,
        PixelFilter::Tent,
        PixelFilter::Gaussian,
        PixelFilter::Mitchell,
        PixelFilter::Lanczos,
    ];

    #[test]
    fn integrals_are_those_of_closed_forms() {
        let tent = PixelFilter::Tent.kernel();
        let mitchell = PixelFilter::Mitchell.kernel();
        // The cubic's antiderivative, times 1/6, from its centre on.
        let cubic = |t: f64| {
            let inner = |t: f64| 7.0 / 4.0 * t.powi(4) - 4.0 * t.powi(3) + 16.0 / 3.0 * t;
            let outer =
                |t: f64| -7.0 / 12.0 * t.powi(4) + 4.0 * t.powi(3) - 10.0 * t * t + 32.0 / 3.0 * t;
            if t < 1.0 { inner(t) / 6.0 } else { (inner(1.0) + outer(t) - outer(1.0)) / 6.0 }
        };
        for i in 0..=1000 {
            let t = f64::from(i) / 1000.0;
            let triangle = 0.5 + t - t * t / 2.0;
            assert!((tent.left_of(t) - triangle).abs() < 1e-12, "{t}");
            assert!((tent.left_of(-t) - (1.0 - triangle)).abs() < 1e-12, "{t}");
            let t = 2.0 * t;
            assert!((mitchell.left_of(t) - (0.5 + cubic(t))).abs() < 1e-10, "{t}");
        }
        // Lanczos has none: the share of its first lobe by plain quadrature.
        let lobe = 2.0 * PixelFilter::Lanczos.kernel().left_of(1.0) - 1.0;
        let quadrature: f64 = {
            let n = 200_000;
            let at = |i: i32| PixelFilter::Lanczos.value(f64::from(i) / f64::from(n) * 3.0);
            let sum = |to: i32| (0..to).map(|i| at(i) + at(i + 1)).sum::<f64>();
            sum(n / 3) / sum(n)
        };
        assert!((lobe - quadrature).abs() < 1e-5, "{lobe} {quadrature}");
    }

    #[test]
    fn the_mean_along_a_slope_is_the_integral() {
        for filter in ALL {
            let kernel = filter.kernel();
            for (t, u) in [(-4.0, 5.0), (-0.3, 0.7), (0.2, 0.2001), (1.0, -2.0), (6.0, 9.0)] {
                let n = 20_000;
                let at = |i: i32| t + (u - t) * (f64::from(i) + 0.5) / f64::from(n);
                let mean = (0..n).map(|i| kernel.left_of(at(i))).sum::<f64>() / f64::from(n);
                assert!((kernel.mean_left_of(t, u) - mean).abs() < 1e-7, "{filter:?} {t} {u}");
            }
        }
    }
}
