//! Places known beforehand: where luminaires, casters or predicted features lie on the square (or on the hemisphere behind it).

use crate::map::{Concentric, Cone, Dir, Map, Uv};
use crate::points::Key;
use std::f64::consts::PI;

/// A region of the unit square that can be sampled uniformly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A disk on the square. What sticks out of the square is sampled in vain, never wrongly.
    Disk {
        /// Centre.
        centre: Uv<f64>,
        /// Radius, in units of the square.
        radius: f64,
    },
    /// An axis-aligned rectangle.
    Rect {
        /// Lower corner.
        low: Uv<f64>,
        /// Upper corner.
        high: Uv<f64>,
    },
    /// A cone of directions on the hemisphere behind the square ([`Concentric`]); the part below the horizon is sampled in vain.
    Cap {
        /// Its axis.
        axis: Dir<f64>,
        /// 1 - cos of its half-angle.
        height: f64,
    },
}

impl Shape {
    /// A cap from its half-angle in radians.
    pub fn cap(axis: Dir<f64>, half_angle: f64) -> Shape {
        let s = (0.5 * half_angle).sin();
        Shape::Cap { axis, height: 2.0 * s * s }
    }

    /// Its measure on the square (a cap: solid angle over 2π), including what lies outside.
    #[inline]
    pub fn area(&self) -> f64 {
        match *self {
            Shape::Disk { radius, .. } => PI * radius * radius,
            Shape::Rect { low, high } => (high.u - low.u).max(0.0) * (high.v - low.v).max(0.0),
            Shape::Cap { height, .. } => height,
        }
    }

    /// Whether a point lies inside.
    #[inline]
    pub fn contains(&self, p: Uv<f64>) -> bool {
        match *self {
            Shape::Disk { centre, radius } => {
                let (x, y) = (p.u - centre.u, p.v - centre.v);
                x * x + y * y <= radius * radius
            }
            Shape::Rect { low, high } => p.u >= low.u && p.u <= high.u && p.v >= low.v && p.v <= high.v,
            Shape::Cap { axis, height } => {
                // |a - d|² = 2 (1 - cos), without cancellation for small caps.
                let d = Concentric.dir(p);
                let (x, y, z) = (d.x - axis.x, d.y - axis.y, d.z - axis.z);
                x * x + y * y + z * z <= 2.0 * height
            }
        }
    }

    /// Carries a uniform point of the square to a uniform point of the shape; `None` when that falls outside the domain.
    #[inline]
    pub fn sample(&self, at: Uv<f64>) -> Option<Uv<f64>> {
        let p = match *self {
            Shape::Disk { centre, radius } => {
                let (x, y) = crate::map::square_to_disk(at);
                Uv::new(centre.u + radius * x, centre.v + radius * y)
            }
            Shape::Rect { low, high } => {
                Uv::new(low.u + at.u * (high.u - low.u), low.v + at.v * (high.v - low.v))
            }
            Shape::Cap { axis, height } => {
                let local = Cone::from_height(height)?.dir(at);
                let d = turn(axis, local);
                if d.z < 0.0 {
                    return None;
                }
                Concentric.uv(d)?
            }
        };
        (p.u >= 0.0 && p.u < 1.0 && p.v >= 0.0 && p.v < 1.0).then_some(p)
    }

    /// The same shape with its linear size multiplied (about its centre).
    pub fn inflated(&self, k: f64) -> Shape {
        match *self {
            Shape::Disk { centre, radius } => Shape::Disk { centre, radius: radius * k },
            Shape::Rect { low, high } => {
                let (u, v) = (0.5 * (low.u + high.u), 0.5 * (low.v + high.v));
                let (a, b) = (0.5 * k * (high.u - low.u), 0.5 * k * (high.v - low.v));
                let clip = |x: f64| x.clamp(0.0, 1.0);
                Shape::Rect {
                    low: Uv::new(clip(u - a), clip(v - b)),
                    high: Uv::new(clip(u + a), clip(v + b)),
                }
            }
            Shape::Cap { axis, height } => Shape::Cap { axis, height: (height * k * k).min(2.0) },
        }
    }
}

impl Shape {
    /// What an imperfect prediction makes of a shape: `k` times as wide (k ≥ 1), and moved at random as far as it still covers
    /// the shape.
    pub fn misplaced(&self, k: f64, key: Key) -> Shape {
        let wide = self.inflated(k);
        let (x, y) = crate::map::square_to_disk(key.uniform2_f64(0));
        match (*self, wide) {
            (Shape::Disk { centre, radius }, Shape::Disk { radius: big, .. }) => {
                let room = big - radius;
                Shape::Disk { centre: Uv::new(centre.u + room * x, centre.v + room * y), radius: big }
            }
            (Shape::Cap { axis, height }, Shape::Cap { height: big, .. }) => {
                // Half-angle from the height: h = 2 sin²(s/2).
                let half = |h: f64| 2.0 * (0.5 * h).sqrt().min(1.0).asin();
                let angle = (half(big) - half(height)) * x.hypot(y);
                let (s, c) = (angle.sin(), angle.cos());
                let r = x.hypot(y).max(f64::MIN_POSITIVE);
                let moved = turn(axis, Dir::from_unit(s * x / r, s * y / r, c));
                Shape::Cap { axis: moved, height: big }
            }
            _ => wide,
        }
    }
}

/// Turns a direction about the z axis into one about `axis` (T. Duff et al., "Building an orthonormal basis, revisited", 2017).
#[inline]
pub fn turn(axis: Dir<f64>, d: Dir<f64>) -> Dir<f64> {
    let sign = 1f64.copysign(axis.z);
    let a = -1.0 / (sign + axis.z);
    let b = axis.x * axis.y * a;
    let s = (1.0 + sign * axis.x * axis.x * a, sign * b, -sign * axis.x);
    let t = (b, sign + axis.y * axis.y * a, -axis.y);
    Dir::from_unit(
        s.0 * d.x + t.0 * d.y + axis.x * d.z,
        s.1 * d.x + t.1 * d.y + axis.y * d.z,
        s.2 * d.x + t.2 * d.y + axis.z * d.z,
    )
}
