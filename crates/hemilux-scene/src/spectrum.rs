//! Three-band spectral values. The band count is the one thing to change for more.

use std::ops::{Add, AddAssign, Div, Index, Mul, MulAssign, Neg, Sub};

/// A value per spectral band (R, G, B of linear sRGB / Rec. 709 primaries). Unit and meaning as the owner says:
/// radiance (W·sr⁻¹·m⁻²), irradiance (W·m⁻²), flux (W) or a dimensionless factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rgb(pub [f32; 3]);

impl Rgb {
    /// Zero in every band.
    pub const BLACK: Rgb = Rgb([0.0; 3]);
    /// One in every band.
    pub const WHITE: Rgb = Rgb([1.0; 3]);

    /// The bands.
    #[inline]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Rgb([r, g, b])
    }

    /// The same value in every band.
    #[inline]
    pub const fn splat(v: f32) -> Self {
        Rgb([v; 3])
    }

    /// CIE Y of linear sRGB (Rec. 709 weights; sums to the value itself for grey).
    #[inline]
    pub fn luminance(self) -> f32 {
        0.2126 * self.0[0] + 0.7152 * self.0[1] + 0.0722 * self.0[2]
    }

    /// Largest band.
    #[inline]
    pub fn max(self) -> f32 {
        self.0[0].max(self.0[1]).max(self.0[2])
    }

    /// Mean of the bands.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.0[0] + self.0[1] + self.0[2]) * (1.0 / 3.0)
    }

    /// Whether every band is exactly zero.
    #[inline]
    pub fn is_black(self) -> bool {
        self.0 == [0.0; 3]
    }

    /// Whether every band is finite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|v| v.is_finite())
    }

    /// Apply `f` to every band.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Rgb([f(self.0[0]), f(self.0[1]), f(self.0[2])])
    }

    /// Linear interpolation, `t` in [0, 1].
    #[inline]
    pub fn lerp(self, other: Rgb, t: f32) -> Self {
        self * (1.0 - t) + other * t
    }
}

macro_rules! bandwise {
    ($trait:ident, $f:ident, $op:tt) => {
        impl $trait for Rgb {
            type Output = Rgb;
            #[inline]
            fn $f(self, o: Rgb) -> Rgb {
                Rgb([self.0[0] $op o.0[0], self.0[1] $op o.0[1], self.0[2] $op o.0[2]])
            }
        }
    };
}
bandwise!(Add, add, +);
bandwise!(Sub, sub, -);
bandwise!(Mul, mul, *);

impl Mul<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn mul(self, k: f32) -> Rgb {
        self.map(|v| v * k)
    }
}

impl Div<f32> for Rgb {
    type Output = Rgb;
    #[inline]
    fn div(self, k: f32) -> Rgb {
        self.map(|v| v / k)
    }
}

impl Neg for Rgb {
    type Output = Rgb;
    #[inline]
    fn neg(self) -> Rgb {
        self.map(|v| -v)
    }
}

impl AddAssign for Rgb {
    #[inline]
    fn add_assign(&mut self, o: Rgb) {
        *self = *self + o;
    }
}

impl MulAssign for Rgb {
    #[inline]
    fn mul_assign(&mut self, o: Rgb) {
        *self = *self * o;
    }
}

impl MulAssign<f32> for Rgb {
    #[inline]
    fn mul_assign(&mut self, k: f32) {
        *self = *self * k;
    }
}

impl Index<usize> for Rgb {
    type Output = f32;
    #[inline]
    fn index(&self, i: usize) -> &f32 {
        &self.0[i]
    }
}
