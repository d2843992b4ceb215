//! Maps between the unit square and directions (report, section 5), with exact inverse and density per steradian.
//!
//! | map | domain | measure that becomes uniform | aspect ratio |
//! | --- | --- | --- | --- |
//! | [`Concentric`] | hemisphere | solid angle | 1.27 to 3.00 |
//! | [`Octant`] | hemisphere | solid angle: the appendix of the report as printed | as above |
//! | [`Cosine`] | hemisphere | projected solid angle (Nusselt) | unbounded at the horizon |
//! | [`Sphere`] | sphere | solid angle | 1.27 to 3.00 |
//! | [`Cone`] | cone about the normal | solid angle | 1.27 to 3.00 |
//! | [`Polar`] | hemisphere | none: θ and φ themselves | 0 to 4, with a cut at φ = 0 |
//! | [`GgxVisible`] | half vectors | visible normals of a GGX surface | depends on roughness and view |
//!
//! The square is closed by convention at 0 and open at 1; every map also accepts the edge 1. All of them are generic over
//! `f32` and `f64`, allocate nothing and are inlined. [`blocks`] carries many points at once.

pub mod blocks;
mod cone;
mod ggx;
mod hemisphere;
mod octant;
mod sphere;

pub use cone::Cone;
pub use ggx::GgxVisible;
pub use hemisphere::{Concentric, Cosine, Polar};
pub use octant::Octant;
pub use sphere::Sphere;

use crate::real::Real;

/// A point of the unit square.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uv<T = f32> {
    /// First coordinate, in [0, 1).
    pub u: T,
    /// Second coordinate, in [0, 1).
    pub v: T,
}

impl<T> Uv<T> {
    /// The point (u, v).
    #[inline(always)]
    pub const fn new(u: T, v: T) -> Self {
        Uv { u, v }
    }
}

impl Uv<f32> {
    /// The same point in double precision.
    #[inline(always)]
    pub fn widen(self) -> Uv<f64> {
        Uv::new(self.u as f64, self.v as f64)
    }
}

impl Uv<f64> {
    /// The nearest point in single precision that is still below one.
    #[inline(always)]
    pub fn narrow(self) -> Uv<f32> {
        Uv::new(Real::min(self.u as f32, f32::BELOW_ONE), Real::min(self.v as f32, f32::BELOW_ONE))
    }
}

/// A direction of unit length in a local frame whose z axis is the surface normal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dir<T = f32> {
    /// Along the first tangent.
    pub x: T,
    /// Along the second tangent.
    pub y: T,
    /// Along the normal: cos θ.
    pub z: T,
}

impl<T: Real> Dir<T> {
    /// A direction from components that already have unit length.
    #[inline(always)]
    pub const fn from_unit(x: T, y: T, z: T) -> Self {
        Dir { x, y, z }
    }

    /// The direction of a vector; `None` for a vector of no (or no finite) length.
    #[inline]
    pub fn normalize(x: T, y: T, z: T) -> Option<Self> {
        // Divide by the largest component first: nothing overflows or vanishes.
        let m = x.abs().max(y.abs()).max(z.abs());
        if !(m > T::ZERO && m < T::of(f32::MAX as f64)) {
            return None;
        }
        let (x, y, z) = (x / m, y / m, z / m);
        let l = (x * x + y * y + z * z).sqrt();
        Some(Dir { x: x / l, y: y / l, z: z / l })
    }

    /// The cosine of the angle to another direction.
    #[inline(always)]
    pub fn dot(self, o: Self) -> T {
        self.x * o.x + self.y * o.y + self.z * o.z
    }
}

/// A bijection (up to sets of no measure) between the unit square and a set of directions.
pub trait Map<T: Real> {
    /// The direction of a point of the square.
    fn dir(&self, at: Uv<T>) -> Dir<T>;
    /// The point of the square that [`Map::dir`] carries to this direction; `None` outside the map's domain.
    fn uv(&self, dir: Dir<T>) -> Option<Uv<T>>;
    /// The density, per steradian, of the directions of uniform points of the square; 0 outside the domain. Its reciprocal is
    /// the solid angle that stands for a unit of the square.
    fn pdf_solid_angle(&self, dir: Dir<T>) -> T;
}

/// Shirley and Chiu's concentric map of the square to a disk, branch-reduced: (cos φ, sin φ, r), where r may be negative
/// (then the point is opposite). φ always lies in [-π/4, 3π/4].
#[inline(always)]
pub(crate) fn concentric<T: Real>(at: Uv<T>) -> (T, T, T) {
    let a = at.u + at.u - T::ONE;
    let b = at.v + at.v - T::ONE;
    let wide = a.abs() > b.abs();
    let (r, other) = if wide { (a, b) } else { (b, a) };
    let t = if r == T::ZERO { T::ZERO } else { other / r };
    // φ = (π/4)(b/a), or π/2 minus (π/4)(a/b): the complement swaps sine and cosine.
    let (s, c) = T::sin_cos_octant(t);
    if wide { (c, s, r) } else { (s, c, r) }
}

/// Inverse of [`concentric`]: the point of the square at radius `r` in the direction of (x, y).
#[inline(always)]
pub(crate) fn concentric_inverse<T: Real>(x: T, y: T, r: T) -> Uv<T> {
    let (ax, ay) = (x.abs(), y.abs());
    let wide = ax > ay;
    let (big, small) = if wide { (ax, ay) } else { (ay, ax) };
    let t = if big == T::ZERO { T::ZERO } else { small.atan2(big) * T::of(4.0) / T::PI };
    let r = r.min(T::ONE);
    let (a, b) = if wide { (r, r * t) } else { (r * t, r) };
    let half = T::of(0.5);
    Uv::new((a.copysign(x) * half + half).min(T::BELOW_ONE), (b.copysign(y) * half + half).min(T::BELOW_ONE))
}

/// The disk of radius 1 on which uniform points of the square become uniform: area factor π.
#[inline]
pub fn square_to_disk<T: Real>(at: Uv<T>) -> (T, T) {
    let (c, s, r) = concentric(at);
    (r * c, r * s)
}

/// Inverse of [`square_to_disk`]; `None` outside the disk.
#[inline]
pub fn disk_to_square<T: Real>(x: T, y: T) -> Option<Uv<T>> {
    let r = (x * x + y * y).sqrt();
    if r > T::ONE + T::SLACK { None } else { Some(concentric_inverse(x, y, r)) }
}
