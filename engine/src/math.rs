//! The transcendental functions, in one place.
//!
//! The standard library takes them from the machine's C library, whose last bits differ between
//! machines; these come from one source everywhere, so that a golden picture made on one machine
//! holds on another. `.clippy.toml` refuses the standard ones. Square roots, sums and products are
//! exact to the last bit by IEEE 754 and need no such care.

use glam::DVec3;

/// The farthest from the origin that anything may lie, in metres, and one over the least size of a scene.
/// Within this range the size of the world changes no bit of a picture; beyond it squares of squares of
/// lengths leave the range of doubles.
pub const REACH: f64 = 1e30;

/// Whether a point lies within [`REACH`]; one that is not finite does not.
pub fn is_within_reach(point: DVec3) -> bool {
    point.abs().cmple(DVec3::splat(REACH)).all()
}

/// Sine of an angle in radians.
pub fn sin(x: f64) -> f64 {
    libm::sin(x)
}

/// Cosine of an angle in radians.
pub fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Tangent of an angle in radians.
pub fn tan(x: f64) -> f64 {
    libm::tan(x)
}

/// The angle in radians, in [-pi, pi], of the point (x, y).
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// The angle in radians, in [0, pi], whose cosine is `x`.
pub fn acos(x: f64) -> f64 {
    libm::acos(x)
}

/// e to the power `x`.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// e to the power `x`, in single precision.
pub fn expf(x: f32) -> f32 {
    libm::expf(x)
}

/// The logarithm of `x` to base 2.
pub fn log2(x: f64) -> f64 {
    libm::log2(x)
}

/// `x` to the power `y`.
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// `x` to the power `y`, in single precision.
pub fn powf(x: f32, y: f32) -> f32 {
    libm::powf(x, y)
}

/// `a * b + c`, rounded once.
pub fn fma(a: f64, b: f64, c: f64) -> f64 {
    libm::fma(a, b, c)
}
