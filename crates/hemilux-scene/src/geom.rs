//! Vocabulary of space: single-precision points and directions, double-precision transforms.
//!
//! Coordinates are right-handed, metres, axes as the file says. `Vec3` serves for points and directions alike inside
//! kernels; what a value is stands in its name (`p`, `n`, `dir`). Transforms are kept in `f64` because a chain of them
//! loses digits that a lamp of 0.1 mm needs.

pub use glam::{DAffine3, DMat4, DVec2, DVec3, Vec2, Vec3};

/// An orthonormal frame around a unit normal: local z is the normal (Duff et al. 2017, branchless).
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// First tangent, world space.
    pub s: Vec3,
    /// Second tangent, world space.
    pub t: Vec3,
    /// Normal, world space.
    pub n: Vec3,
}

impl Frame {
    /// A frame around unit normal `n`; tangents are arbitrary but continuous except at n.z = 0⁻.
    #[inline]
    pub fn from_normal(n: Vec3) -> Self {
        let sign = 1f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Frame {
            s: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            t: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            n,
        }
    }

    /// A frame around unit normal `n` whose first tangent lies in the plane of `n` and `s`.
    /// Falls back to [`Frame::from_normal`] where `s` is parallel to `n` or zero.
    #[inline]
    pub fn from_normal_tangent(n: Vec3, s: Vec3) -> Self {
        let projected = s - n * n.dot(s);
        let length = projected.length();
        if length > 1e-6 * s.length() && length > 0.0 {
            let s = projected / length;
            Frame { s, t: n.cross(s), n }
        } else {
            Frame::from_normal(n)
        }
    }

    /// World direction to local (z along the normal).
    #[inline]
    pub fn to_local(&self, w: Vec3) -> Vec3 {
        Vec3::new(self.s.dot(w), self.t.dot(w), self.n.dot(w))
    }

    /// Local direction to world.
    #[inline]
    pub fn to_world(&self, w: Vec3) -> Vec3 {
        self.s * w.x + self.t * w.y + self.n * w.z
    }
}
