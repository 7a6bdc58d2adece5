//! The colours of glowing bodies and of the clear sky.

use glam::DVec3;
use std::f64::consts::PI;

use crate::color::Color;
use crate::error::{Error, Result};
use crate::math;

/// The colour of a black body at a temperature in kelvin, of luminance 1: a lamp of so many lumens keeps
/// them whatever its temperature. Planck's law under the observer of 1931 (in the closed form of Wyman,
/// Sloan and Shirley 2013); what Rec. 709 cannot show is cut.
///
/// # Errors
/// If the temperature is not from 800 to 100000 K.
pub fn black_body(kelvin: f64) -> Result<Color> {
    if !(800.0..=100_000.0).contains(&kelvin) {
        return Err(Error::invalid(format!("a temperature of {kelvin} K: must be 800 to 100000")));
    }
    let mut sum = [0.0; 3];
    for nanometres in (380..=780).step_by(2) {
        let length = f64::from(nanometres);
        let metres = length * 1e-9;
        let power =
            // The second radiation constant, in metre kelvin. The first is a factor that luminance
            // takes out.
            math::pow(metres, -5.0) / (math::exp(1.438_776_877e-2 / (metres * kelvin)) - 1.0);
        for (sum, seen) in sum.iter_mut().zip(observer(length)) {
            *sum += power * seen;
        }
    }
    Ok(of_luminance_1(sum.map(|v| v / sum[1])))
}

/// The colour of X, Y and Z with a Y of 1, and a luminance of 1. What Rec. 709 cannot show is cut.
fn of_luminance_1([x, y, z]: [f64; 3]) -> Color {
    let r = 3.240_969_9 * x - 1.537_383_2 * y - 0.498_610_8 * z;
    let g = -0.969_243_6 * x + 1.875_967_5 * y + 0.041_555_1 * z;
    let b = 0.055_630_1 * x - 0.203_977_0 * y + 1.056_971_5 * z;
    let [r, g, b] = [r, g, b].map(|v| v.max(0.0));
    // What was cut is made up for, so that the luminance stays 1.
    let luminance = 0.212_639 * r + 0.715_168_7 * g + 0.072_192_3 * b;
    let [r, g, b] = [r, g, b].map(|v| (v / luminance) as f32);
    Color::new(r, g, b)
}

/// The colours of a cloudless sky, of luminance 1, over the sky with the sun at one place: chromaticities after
/// Preetham, Shirley and Smits (1999, appendix A.2), for clear air of turbidity 2.5.
#[derive(Clone, Debug)]
pub struct ClearSky {
    /// The unit vector to the sun.
    sun: DVec3,
    /// For x and y: the coefficients of Perez' formula, and what makes the zenith's chromaticity of it.
    of: [([f64; 5], f64); 2],
}

impl ClearSky {
    /// The sky for a sun at or above the horizon, in a direction that is a unit vector.
    pub fn new(sun: DVec3) -> ClearSky {
        const TURBIDITY: f64 = 2.5;
        // By turbidity: what it is multiplied by, and what is added.
        const PEREZ: [[(f64, f64); 5]; 2] = [
            [
                (-0.0193, -0.2592),
                (-0.0665, 0.0008),
                (-0.0004, 0.2125),
                (-0.0641, -0.8989),
                (-0.0033, 0.0452),
            ],
            [
                (-0.0167, -0.2608),
                (-0.0950, 0.0092),
                (-0.0079, 0.2102),
                (-0.0441, -1.6537),
                (-0.0109, 0.0529),
            ],
        ];
        // By the square of the turbidity, itself and 1; each by powers of the sun's angle from the zenith, from the cube.
        const ZENITH: [[[f64; 4]; 3]; 2] = [
            [
                [0.00166, -0.00375, 0.00209, 0.0],
                [-0.02903, 0.06377, -0.03202, 0.00394],
                [0.11693, -0.21196, 0.06052, 0.25886],
            ],
            [
                [0.00275, -0.00610, 0.00317, 0.0],
                [-0.04214, 0.08970, -0.04153, 0.00516],
                [0.15346, -0.26756, 0.06670, 0.26688],
            ],
        ];
        // The fit holds for the day only.
        let angle = math::acos(sun.y.clamp(0.0, 1.0));
        let of = [0, 1].map(|k| {
            let perez = PEREZ[k].map(|(by, plus)| by * TURBIDITY + plus);
            let cubic = |of: [f64; 4]| of.into_iter().fold(0.0, |sum, by| sum * angle + by);
            let zenith = ZENITH[k].into_iter().fold(0.0, |sum, by| sum * TURBIDITY + cubic(by));
            // Perez' formula is relative: divided by its value at the zenith, `angle` from the sun.
            (perez, zenith / perez_of(&perez, 1.0, angle))
        });
        ClearSky { sun, of }
    }

    /// The colour in a direction at or above the horizon, a unit vector.
    pub fn color(&self, direction: DVec3) -> Color {
        let from_sun = math::acos(direction.dot(self.sun).clamp(-1.0, 1.0));
        let [x, y] = [0, 1].map(|k| {
            let (perez, scale) = &self.of[k];
            scale * perez_of(perez, direction.y, from_sun)
        });
        // From x, y and Y = 1 to X, Y and Z.
        of_luminance_1([x / y, 1.0, (1.0 - x - y) / y])
    }
}

/// Perez' formula, by the sine of the height above the horizon and the angle from the sun.
fn perez_of([a, b, c, d, e]: &[f64; 5], up: f64, from_sun: f64) -> f64 {
    // At the horizon: the limit, as b is below 0.
    let gradation = 1.0 + if up > 0.0 { a * math::exp(b / up) } else { 0.0 };
    let cosine = math::cos(from_sun.min(PI));
    gradation * (1.0 + c * math::exp(d * from_sun) + e * cosine * cosine)
}

fn observer(length: f64) -> [f64; 3] {
    let lobe = |peak: f64, below: f64, above: f64| {
        let t = (length - peak) / if length < peak { below } else { above };
        math::exp(-0.5 * t * t)
    };
    [
        1.056 * lobe(599.8, 37.9, 31.0) + 0.362 * lobe(442.0, 16.0, 26.7)
            - 0.065 * lobe(501.1, 20.4, 26.2),
        0.821 * lobe(568.8, 46.9, 40.5) + 0.286 * lobe(530.9, 16.3, 31.1),
        1.217 * lobe(437.0, 11.8, 36.0) + 0.681 * lobe(459.0, 26.0, 13.8),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chromaticity of a colour.
    fn chromaticity(color: Color) -> [f64; 2] {
        let [r, g, b] = color.to_array().map(f64::from);
        let x = 0.412_390_8 * r + 0.357_584_3 * g + 0.180_480_8 * b;
        let y = 0.212_639 * r + 0.715_168_7 * g + 0.072_192_3 * b;
        let z = 0.019_330_8 * r + 0.119_194_8 * g + 0.950_532_2 * b;
        [x / (x + y + z), y / (x + y + z)]
    }

    #[test]
    fn a_clear_sky_is_blue_and_paler_at_the_horizon() {
        // The zenith's own cubic, by hand: the sun at the zenith, and 45 degrees from it.
        let high = chromaticity(ClearSky::new(DVec3::Y).color(DVec3::Y));
        assert!((high[0] - 0.26871).abs() < 1e-4 && (high[1] - 0.27978).abs() < 1e-4, "{high:?}");
        let low = ClearSky::new(DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0));
        let zenith = chromaticity(low.color(DVec3::Y));
        assert!(
            (zenith[0] - 0.24328).abs() < 1e-4 && (zenith[1] - 0.24758).abs() < 1e-4,
            "{zenith:?}"
        );
        let horizon = chromaticity(low.color(DVec3::NEG_X));
        assert!(horizon[0] > zenith[0] + 0.02 && horizon[1] > zenith[1] + 0.02, "{horizon:?}");
        for up in [0.0, 0.1, 0.5, 1.0] {
            let direction = DVec3::new(0.0, up, f64::sqrt(1.0 - up * up));
            // The weights of a colour's luminance have four digits.
            assert!((low.color(direction).luminance() - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn black_bodies_have_the_chromaticities_that_are_known() {
        // CIE 15: illuminant A is a black body of 2855.6 K; others from the Planckian locus.
        for (kelvin, x, y) in
            [(2855.6, 0.4476, 0.4074), (4000.0, 0.3805, 0.3768), (6504.0, 0.3135, 0.3236)]
        {
            let Color { r, g, b } = black_body(kelvin).unwrap();
            let (r, g, b) = (f64::from(r), f64::from(g), f64::from(b));
            let xyz = [
                0.412_390_8 * r + 0.357_584_3 * g + 0.180_480_8 * b,
                0.212_639_0 * r + 0.715_168_7 * g + 0.072_192_3 * b,
                0.019_330_8 * r + 0.119_194_8 * g + 0.950_532_2 * b,
            ];
            let sum: f64 = xyz.iter().sum();
            assert!((xyz[1] - 1.0).abs() < 1e-5, "{kelvin}");
            assert!((xyz[0] / sum - x).abs() < 3e-3, "{kelvin}: {}", xyz[0] / sum);
            assert!((xyz[1] / sum - y).abs() < 3e-3, "{kelvin}: {}", xyz[1] / sum);
        }
        assert!(black_body(100.0).is_err() && black_body(f64::NAN).is_err());
    }
}
