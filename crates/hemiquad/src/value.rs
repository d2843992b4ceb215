//! What an integrand returns: a number, or several channels driven by their luminance.

use std::fmt::Debug;

/// A value of the integrand. One scalar, [`Value::drive`], steers refinement and allocation; all channels share the points.
pub trait Value: Copy + Default + PartialEq + Debug + Send + Sync + 'static {
    /// Applies a function to every channel of two values.
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self;
    /// The scalar that steers: luminance by default for three channels.
    fn drive(self) -> f64;

    /// Applies a function to every channel.
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        self.zip(self, |a, _| f(a))
    }
    /// The sum.
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    /// The difference.
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    /// The product with a number.
    #[inline(always)]
    fn times(self, k: f64) -> Self {
        self.each(|a| a * k)
    }
    /// The largest absolute value over the channels.
    fn largest(self) -> f64;
}

impl Value for f64 {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        f(self, other)
    }
    #[inline(always)]
    fn drive(self) -> f64 {
        self
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.abs()
    }
}

impl<const C: usize> Value for [f64; C]
where
    [f64; C]: Default,
{
    #[inline(always)]
    fn zip(mut self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        for (a, b) in self.iter_mut().zip(other) {
            *a = f(*a, b);
        }
        self
    }
    /// Rec. 709 luminance for three channels, the mean otherwise.
    #[inline(always)]
    fn drive(self) -> f64 {
        match self.as_slice() {
            [r, g, b] => 0.2126 * r + 0.7152 * g + 0.0722 * b,
            all => all.iter().sum::<f64>() / C.max(1) as f64,
        }
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.iter().fold(0.0, |m, x| m.max(x.abs()))
    }
}

/// Channels driven by the loudest of them instead of luminance: a blue feature then counts as much as a green one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Loudest<V>(pub V);

impl<V: Value> Value for Loudest<V> {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Loudest(self.0.zip(other.0, f))
    }
    #[inline(always)]
    fn drive(self) -> f64 {
        self.0.largest()
    }
    #[inline(always)]
    fn largest(self) -> f64 {
        self.0.largest()
    }
}
