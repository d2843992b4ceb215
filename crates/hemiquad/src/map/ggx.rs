//! Visible normals of a GGX surface: E. Heitz, "Sampling the GGX distribution of visible normals", 2018, in the form of
//! J. Dupuy and A. Benyoub, "Sampling visible GGX normals with spherical caps", 2023.
//!
//! Stretch the view to the hemisphere configuration; the visible normals are then the half vectors between it and a uniform
//! direction of the cap above height -cos θ. That cap is a [`Cone`], so the square keeps its adjacency and the inverse is exact.

use super::{Cone, Dir, Map, Uv};
use crate::real::Real;

/// The square to half vectors, with the density of normals seen from `wo` on a GGX surface of roughness (αx, αy).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GgxVisible<T = f32> {
    wo: Dir<T>,
    stretched: Dir<T>,
    alpha_x: T,
    alpha_y: T,
    cap: Cone<T>,
    /// G1(wo) / cos θo, finite at grazing angles: 2 / (cos θo + √(cos² θo + αx² x² + αy² y²)).
    masking: T,
}

impl<T: Real> GgxVisible<T> {
    /// For a view direction above (or on) the horizon and roughnesses in (0, ∞); `None` otherwise.
    #[inline]
    pub fn new(wo: Dir<T>, alpha_x: T, alpha_y: T) -> Option<Self> {
        if !(wo.z >= T::ZERO && alpha_x > T::ZERO && alpha_y > T::ZERO) {
            return None;
        }
        let stretched = Dir::normalize(wo.x * alpha_x, wo.y * alpha_y, wo.z)?;
        let (sx, sy) = (wo.x * alpha_x, wo.y * alpha_y);
        let masking = T::of(2.0) / (wo.z + (wo.z * wo.z + sx * sx + sy * sy).sqrt());
        let cap = Cone::from_height((T::ONE + stretched.z).min(T::of(2.0)))?;
        Some(GgxVisible { wo, stretched, alpha_x, alpha_y, cap, masking })
    }

    /// The view direction.
    #[inline]
    pub fn wo(&self) -> Dir<T> {
        self.wo
    }

    /// The GGX distribution of normals D(h), per steradian; its cosine integral is 1.
    #[inline(always)]
    pub fn distribution(&self, h: Dir<T>) -> T {
        if h.z <= T::ZERO {
            return T::ZERO;
        }
        let (x, y) = (h.x / self.alpha_x, h.y / self.alpha_y);
        let l = x * x + y * y + h.z * h.z;
        T::ONE / (T::PI * self.alpha_x * self.alpha_y * l * l)
    }

    /// The masking function G1(wo).
    #[inline]
    pub fn masking(&self) -> T {
        self.masking * self.wo.z
    }

    /// The density per steradian of the *reflected* direction when its half vector is `h`: the density of h over 4 (wo · h).
    #[inline]
    pub fn pdf_reflected(&self, h: Dir<T>) -> T {
        if self.wo.dot(h) <= T::ZERO {
            return T::ZERO;
        }
        self.masking * self.distribution(h) * T::of(0.25)
    }
}

impl<T: Real> Map<T> for GgxVisible<T> {
    #[inline(always)]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let c = self.cap.dir(at);
        let w = self.stretched;
        let (x, y, z) = ((c.x + w.x) * self.alpha_x, (c.y + w.y) * self.alpha_y, (c.z + w.z).max(T::ZERO));
        // The two directions cancel only on the edge of the cap; any normal will do for a set of no measure.
        Dir::normalize(x, y, z).unwrap_or(Dir { x: T::ZERO, y: T::ZERO, z: T::ONE })
    }

    #[inline(always)]
    fn uv(&self, h: Dir<T>) -> Option<Uv<T>> {
        let m = Dir::normalize(h.x / self.alpha_x, h.y / self.alpha_y, h.z)?;
        let w = self.stretched;
        let k = w.dot(m);
        if k <= T::ZERO || m.z < T::ZERO {
            return None;
        }
        let k2 = k + k;
        self.cap.uv(Dir { x: k2 * m.x - w.x, y: k2 * m.y - w.y, z: k2 * m.z - w.z })
    }

    /// G1(wo) max(0, wo · h) D(h) / cos θo, per steradian of half vectors.
    #[inline(always)]
    fn pdf_solid_angle(&self, h: Dir<T>) -> T {
        self.masking * self.wo.dot(h).max(T::ZERO) * self.distribution(h)
    }
}
