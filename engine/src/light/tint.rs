//! The colour of a glowing body.

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
            math::pow(metres, -5.0) / (math::exp(1.438_776_877e-2 / (metres * kelvin)) - 1.0);
        for (sum, seen) in sum.iter_mut().zip(observer(length)) {
            *sum += power * seen;
        }
    }
    let [x, y, z] = sum.map(|v| v / sum[1]);
    let r = 3.240_969_9 * x - 1.537_383_2 * y - 0.498_610_8 * z;
    let g = -0.969_243_6 * x + 1.875_967_5 * y + 0.041_555_1 * z;
    let b = 0.055_630_1 * x - 0.203_977_0 * y + 1.056_971_5 * z;
    let [r, g, b] = [r, g, b].map(|v| v.max(0.0));
    // What was cut is made up for, so that the luminance stays 1.
    let luminance = 0.212_639 * r + 0.715_168_7 * g + 0.072_192_3 * b;
    let [r, g, b] = [r, g, b].map(|v| (v / luminance) as f32);
    Ok(Color::new(r, g, b))
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
