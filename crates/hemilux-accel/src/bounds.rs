//! Axis-aligned boxes, always rounded outwards.

use glam::{DAffine3, DVec3, Vec3};

/// An axis-aligned box; empty when a component of `min` exceeds that of `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Smallest coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// The box that contains nothing.
    pub const EMPTY: Bounds = Bounds { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// True when the box contains no point.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// The smallest box containing both.
    #[must_use]
    pub fn union(self, other: Bounds) -> Bounds {
        Bounds { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The smallest box containing this one and `p`.
    #[must_use]
    pub fn extended(self, p: Vec3) -> Bounds {
        Bounds { min: self.min.min(p), max: self.max.max(p) }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.min.is_finite() && self.max.is_finite()
    }

    /// The largest distance along an axis from `p` to a point of the box.
    #[inline(always)]
    pub(crate) fn reach(&self, p: Vec3) -> f32 {
        (self.min - p).abs().max((self.max - p).abs()).max_element()
    }

    /// The `f32` box around an `f64` one, with a margin of a few roundings of its largest coordinate.
    pub(crate) fn outward(min: DVec3, max: DVec3) -> Bounds {
        let margin = DVec3::splat(min.abs().max(max.abs()).max_element() * 4.0 * f64::from(f32::EPSILON));
        Bounds { min: (min - margin).as_vec3(), max: (max + margin).as_vec3() }
    }

    /// A box around the image of this one. The margin covers the rounding of a ray carried into the space of this
    /// box: `f32` positions there are off by up to half a unit in the last place.
    pub(crate) fn transformed(&self, to: &DAffine3) -> Bounds {
        if self.is_empty() {
            return Bounds::EMPTY;
        }
        let (lo, hi) = (self.min.as_dvec3(), self.max.as_dvec3());
        let far = lo.abs().max(hi.abs());
        let m = to.matrix3;
        let local = m.x_axis.abs() * far.x + m.y_axis.abs() * far.y + m.z_axis.abs() * far.z;
        let margin = local * 4.0 * f64::from(f32::EPSILON);
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in 0..8 {
            let pick = |bit: u32, a: f64, b: f64| if corner >> bit & 1 == 0 { a } else { b };
            let p = DVec3::new(pick(0, lo.x, hi.x), pick(1, lo.y, hi.y), pick(2, lo.z, hi.z));
            let q = to.transform_point3(p);
            if !q.is_finite() {
                return Bounds { min: Vec3::NAN, max: Vec3::NAN };
            }
            min = min.min(q);
            max = max.max(q);
        }
        Bounds::outward(min - margin, max + margin)
    }
}
