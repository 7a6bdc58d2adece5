//! The numbers that programs run on: single precision over fragments, double for what changes in time.

use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::math;

/// A number of either precision.
pub(super) trait Real:
    Copy
    + PartialOrd
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
{
    fn of(number: f64) -> Self;
    fn wide(self) -> f64;
    fn abs(self) -> Self;
    fn floor(self) -> Self;
    fn ceil(self) -> Self;
    fn round(self) -> Self;
    fn sqrt(self) -> Self;
    fn exp(self) -> Self;
    fn power(self, to: Self) -> Self;
}

macro_rules! real {
    ($type:ident, $exp:path, $power:path) => {
        impl Real for $type {
            #[inline(always)]
            fn of(number: f64) -> $type {
                number as $type
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                self.into()
            }

            #[inline(always)]
            fn abs(self) -> $type {
                self.abs()
            }

            #[inline(always)]
            fn floor(self) -> $type {
                self.floor()
            }

            #[inline(always)]
            fn ceil(self) -> $type {
                self.ceil()
            }

            #[inline(always)]
            fn round(self) -> $type {
                self.round()
            }

            #[inline(always)]
            fn sqrt(self) -> $type {
                self.sqrt()
            }

            #[inline(always)]
            fn exp(self) -> $type {
                $exp(self)
            }

            #[inline(always)]
            fn power(self, to: $type) -> $type {
                $power(self, to)
            }
        }
    };
}

real!(f32, math::expf, math::powf);
real!(f64, math::exp, math::pow);
