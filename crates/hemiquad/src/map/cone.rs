//! A cone of directions about the normal: luminaires and casters.

use super::{Dir, Map, Uv, concentric, concentric_inverse};
use crate::real::Real;

/// The square to the directions within a half-angle of the z axis, equal area. Rotate the frame to point it.
///
/// Stored as the height h = 1 - cos of the spherical cap, which keeps its digits for luminaires of any smallness (the cosine
/// of 0.02° is 1 in single precision).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone<T = f32> {
    height: T,
}

impl<T: Real> Cone<T> {
    /// From the height 1 - cos of the cap, in (0, 2]; `None` otherwise.
    #[inline]
    pub fn from_height(height: T) -> Option<Self> {
        (height > T::ZERO && height <= T::of(2.0)).then_some(Cone { height })
    }

    /// From the half-angle in radians, in (0, π]; `None` otherwise.
    #[inline]
    pub fn from_half_angle(angle: T) -> Option<Self> {
        let (s, _) = (angle * T::of(0.5)).sin_cos();
        if angle > T::ZERO && angle <= T::PI { Self::from_height(T::of(2.0) * s * s) } else { None }
    }

    /// From the cosine of the half-angle, in [-1, 1); `None` otherwise. Inaccurate for small cones: see the other two.
    #[inline]
    pub fn from_cos(cos: T) -> Option<Self> {
        Self::from_height(T::ONE - cos)
    }

    /// The cone about a sphere of radius `r` at distance `d` from its apex; `None` when the apex is inside.
    #[inline]
    pub fn about_sphere(r: T, d: T) -> Option<Self> {
        if !(r > T::ZERO && d > r) {
            return None;
        }
        let s2 = (r / d) * (r / d);
        Self::from_height(s2 / (T::ONE + (T::ONE - s2).sqrt()))
    }

    /// 1 - cos of the half-angle.
    #[inline]
    pub fn height(&self) -> T {
        self.height
    }

    /// The solid angle, in steradians.
    #[inline]
    pub fn solid_angle(&self) -> T {
        T::of(2.0) * T::PI * self.height
    }

    /// Whether the direction is inside.
    #[inline(always)]
    pub fn contains(&self, d: Dir<T>) -> bool {
        cap_height(d) <= self.height * (T::ONE + T::SLACK)
    }
}

/// 1 - cos θ without cancellation on the upper side.
#[inline(always)]
fn cap_height<T: Real>(d: Dir<T>) -> T {
    if d.z > T::ZERO { (d.x * d.x + d.y * d.y) / (T::ONE + d.z) } else { T::ONE - d.z }
}

impl<T: Real> Map<T> for Cone<T> {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let (c, s, r) = concentric(at);
        let h = r * r * self.height;
        // 1 - cos θ = h, hence sin θ = √(h (2 - h)); r keeps the sign.
        let sin = (h * (T::of(2.0) - h)).max(T::ZERO).sqrt().copysign(r);
        Dir { x: sin * c, y: sin * s, z: T::ONE - h }
    }

    #[inline(always)]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        if !self.contains(d) {
            return None;
        }
        Some(concentric_inverse(d.x, d.y, (cap_height(d) / self.height).sqrt()))
    }

    #[inline(always)]
    fn pdf_solid_angle(&self, d: Dir<T>) -> T {
        if self.contains(d) { T::ONE / self.solid_angle() } else { T::ZERO }
    }
}
