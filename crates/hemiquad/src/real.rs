//! The two floating-point types the maps are written for, `f32` and `f64`, behind one sealed trait.
//!
//! Only what the formulae need; no fused operations, so that scalar and vectorised code give the same bits.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A floating-point number: `f32` or `f64`. Sealed.
pub trait Real:
    sealed::Sealed
    + Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + 'static
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// π.
    const PI: Self;
    /// The largest number below one.
    const BELOW_ONE: Self;
    /// How far the inverse of a map may land outside its domain by rounding and still be taken as on its edge.
    const SLACK: Self;
    /// Rounds an `f64` to this type.
    fn of(x: f64) -> Self;
    /// Widens to `f64`.
    fn to_f64(self) -> f64;
    /// √x.
    fn sqrt(self) -> Self;
    /// |x|.
    fn abs(self) -> Self;
    /// |self| with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// sin and cos, for any argument.
    fn sin_cos(self) -> (Self, Self);
    /// cos⁻¹.
    fn acos(self) -> Self;
    /// The angle of (x = `other`, y = `self`).
    fn atan2(self, other: Self) -> Self;
    /// The larger.
    fn max(self, other: Self) -> Self;
    /// The smaller.
    fn min(self, other: Self) -> Self;
    /// sin(π t / 4) and cos(π t / 4) for |t| ≤ 1 by polynomials, to the last bit or two: all the concentric maps need.
    fn sin_cos_octant(t: Self) -> (Self, Self);
}

macro_rules! real {
    ($t:ident, $slack:expr, $sin:expr, $cos:expr) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const PI: Self = std::f64::consts::PI as $t;
            const BELOW_ONE: Self = 1.0 - $t::EPSILON / 2.0;
            const SLACK: Self = $slack;
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $t::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                $t::abs(self)
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                $t::copysign(self, sign)
            }
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                $t::sin_cos(self)
            }
            #[inline(always)]
            fn acos(self) -> Self {
                $t::acos(self)
            }
            #[inline(always)]
            fn atan2(self, other: Self) -> Self {
                $t::atan2(self, other)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn sin_cos_octant(t: Self) -> (Self, Self) {
                let x = t * (std::f64::consts::FRAC_PI_4 as $t);
                let x2 = x * x;
                let mut s: $t = 0.0;
                for c in $sin {
                    s = s * x2 + c;
                }
                let mut c: $t = 0.0;
                for k in $cos {
                    c = c * x2 + k;
                }
                (x * s, c)
            }
        }
    };
}

// Taylor coefficients; the first term left out is below the rounding error for |x| ≤ π/4.
real!(
    f32,
    4e-6,
    [2.7557319e-6, -1.9841270e-4, 8.3333333e-3, -1.6666667e-1, 1.0],
    [2.4801587e-5, -1.3888889e-3, 4.1666667e-2, -0.5, 1.0]
);
real!(
    f64,
    1e-13,
    [
        -1.0 / 1_307_674_368_000.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 39_916_800.0,
        1.0 / 362_880.0,
        -1.0 / 5_040.0,
        1.0 / 120.0,
        -1.0 / 6.0,
        1.0
    ],
    [
        1.0 / 20_922_789_888_000.0,
        -1.0 / 87_178_291_200.0,
        1.0 / 479_001_600.0,
        -1.0 / 3_628_800.0,
        1.0 / 40_320.0,
        -1.0 / 720.0,
        1.0 / 24.0,
        -0.5,
        1.0
    ]
);
