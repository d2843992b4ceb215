//! Spheres, disks and cylinders: shape, parametrisation, intersection.
//!
//! The shapes and their partial forms are those of pbrt. Everything is computed in `f64` in object space. The
//! discriminant is taken from the ray's closest approach, so that neither a distant nor a huge quadric cancels
//! (E. Haines et al., *Precision Improvements for Ray/Sphere Intersection*, Ray Tracing Gems, 2019).

use std::f64::consts::TAU;

use glam::{DAffine3, DVec2, DVec3};

use crate::bounds::Bounds;

/// A quadric in its object space, around the z axis. Lengths in object units, angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Quadric {
    /// A sphere around the origin, cut at two heights and by an angle.
    Sphere {
        /// Radius, > 0.
        radius: f64,
        /// Lowest height; `-radius` for a whole sphere.
        z_min: f64,
        /// Highest height; `radius` for a whole sphere.
        z_max: f64,
        /// Angle around z, in 0..=2π.
        phi_max: f64,
    },
    /// A disk or ring in the plane `z = height`.
    Disk {
        /// Height along z.
        height: f64,
        /// Outer radius, > 0.
        radius: f64,
        /// Inner radius; 0 for a whole disk.
        inner_radius: f64,
        /// Angle around z, in 0..=2π.
        phi_max: f64,
    },
    /// An open cylinder around z.
    Cylinder {
        /// Radius, > 0.
        radius: f64,
        /// Lowest height.
        z_min: f64,
        /// Highest height.
        z_max: f64,
        /// Angle around z, in 0..=2π.
        phi_max: f64,
    },
}

/// A point of a quadric in its object space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, on the surface to `f64` rounding.
    pub position: DVec3,
    /// Unit normal: away from the centre or axis; +z for a disk.
    pub normal: DVec3,
    /// Derivative of the position with respect to u; zero at a sphere's poles and a disk's centre.
    pub dpdu: DVec3,
    /// Derivative of the position with respect to v.
    pub dpdv: DVec3,
}

impl Quadric {
    /// The surface point at `(u, v)`, both in 0..=1.
    ///
    /// `u` is always φ / φ_max, with φ the angle around z from +x. `v` is
    /// - sphere: (θ - θ₀) / (θ₁ - θ₀), with θ the angle from +z, θ₀ that of `z_min` (so `v = 0` at the bottom), θ₁ that of `z_max`;
    /// - disk: (radius - ρ) / (radius - inner_radius), with ρ the distance to the axis (`v = 0` at the rim);
    /// - cylinder: (z - z_min) / (z_max - z_min).
    ///
    /// From `f32` parameters the point is exactly on the surface, and off along it by less than 3e-7 radius (plus 1e-7
    /// of a cylinder's height), near the poles too. A height in place of θ would lose 3e-4 radius there.
    pub fn eval(&self, u: f64, v: f64) -> SurfacePoint {
        let (sin, cos) = (u * self.phi_max()).sin_cos();
        let out = DVec3::new(cos, sin, 0.0);
        let along = DVec3::new(-sin, cos, 0.0) * self.phi_max();
        match *self {
            Quadric::Sphere { radius, .. } => {
                let (start, end) = self.thetas();
                let (sin_theta, cos_theta) = (start + v * (end - start)).sin_cos();
                let normal = out * sin_theta + DVec3::Z * cos_theta;
                SurfacePoint {
                    position: normal * radius,
                    normal,
                    dpdu: along * (radius * sin_theta),
                    dpdv: (out * cos_theta - DVec3::Z * sin_theta) * (radius * (end - start)),
                }
            }
            Quadric::Disk { height, radius, inner_radius, .. } => {
                let rho = radius - v * (radius - inner_radius);
                SurfacePoint {
                    position: out * rho + DVec3::Z * height,
                    normal: DVec3::Z,
                    dpdu: along * rho,
                    dpdv: out * (inner_radius - radius),
                }
            }
            Quadric::Cylinder { radius, z_min, z_max, .. } => SurfacePoint {
                position: out * radius + DVec3::Z * (z_min + v * (z_max - z_min)),
                normal: out,
                dpdu: along * radius,
                dpdv: DVec3::Z * (z_max - z_min),
            },
        }
    }

    /// A box around the shape in object space.
    pub(crate) fn object_box(&self) -> (DVec3, DVec3) {
        let (r, lo, hi) = match *self {
            Quadric::Sphere { radius, z_min, z_max, .. } => (radius, z_min.max(-radius), z_max.min(radius)),
            Quadric::Disk { height, radius, .. } => (radius, height, height),
            Quadric::Cylinder { radius, z_min, z_max, .. } => (radius, z_min, z_max),
        };
        (DVec3::new(-r, -r, lo), DVec3::new(r, r, hi))
    }

    /// The nearest `t` in the open interval with its parameters, for the ray `origin + t dir` in object space.
    pub(crate) fn intersect(
        &self,
        origin: DVec3,
        dir: DVec3,
        t_min: f64,
        t_max: f64,
    ) -> Option<(f64, f64, f64)> {
        let try_at = |t: f64| {
            let found = t > t_min && t < t_max;
            if found { self.parameters(origin, dir, t).map(|(u, v)| (t, u, v)) } else { None }
        };
        let (near, far) = match *self {
            Quadric::Disk { height, .. } => return try_at((height - origin.z) / dir.z),
            Quadric::Sphere { radius, .. } => {
                roots(radius, dir.length_squared(), origin.dot(dir), origin.length(), {
                    |t| (origin + dir * t).length_squared()
                })?
            }
            Quadric::Cylinder { radius, .. } => {
                let (o, d) = (origin.truncate(), dir.truncate());
                roots(radius, d.length_squared(), o.dot(d), o.length(), |t| (o + d * t).length_squared())?
            }
        };
        try_at(near).or_else(|| try_at(far))
    }

    /// The parameters of the point at `t`, if the partial shape contains it.
    ///
    /// The limits are widened by the rounding of the point, so that shapes sharing a rim leave no gap.
    fn parameters(&self, origin: DVec3, dir: DVec3, t: f64) -> Option<(f64, f64)> {
        let p = origin + dir * t;
        let slack = 8.0 * f64::EPSILON * (origin.abs() + (dir * t).abs()).max_element();
        let rho = p.truncate().length();
        let v = match *self {
            Quadric::Sphere { radius, z_min, z_max, .. } => {
                // Back onto the sphere, where the point belongs; its height is then as good as its direction.
                let z = p.z * (radius / p.length());
                if z < z_min - slack || z > z_max + slack {
                    return None;
                }
                let (start, end) = self.thetas();
                (rho.atan2(p.z) - start) / (end - start)
            }
            Quadric::Disk { radius, inner_radius, .. } => {
                if !(rho <= radius + slack && rho >= inner_radius - slack) {
                    return None;
                }
                (radius - rho) / (radius - inner_radius)
            }
            Quadric::Cylinder { z_min, z_max, .. } => {
                if p.z < z_min - slack || p.z > z_max + slack {
                    return None;
                }
                (p.z - z_min) / (z_max - z_min)
            }
        };
        let angle = DVec2::new(p.x, p.y).to_angle();
        let mut phi = if angle < 0.0 { angle + TAU } else { angle };
        let phi_slack = if rho > 0.0 { slack / rho } else { 0.0 };
        if phi > self.phi_max() + phi_slack {
            if TAU - phi > phi_slack {
                return None;
            }
            phi = 0.0;
        }
        let u = phi / self.phi_max();
        (u.is_finite() && v.is_finite()).then_some((u.clamp(0.0, 1.0), v.clamp(0.0, 1.0)))
    }

    fn phi_max(&self) -> f64 {
        match *self {
            Quadric::Sphere { phi_max, .. }
            | Quadric::Disk { phi_max, .. }
            | Quadric::Cylinder { phi_max, .. } => phi_max,
        }
    }

    /// Polar angles of a sphere's lower and upper cut.
    fn thetas(&self) -> (f64, f64) {
        match *self {
            Quadric::Sphere { radius, z_min, z_max, .. } => {
                let theta = |z: f64| (z / radius).clamp(-1.0, 1.0).acos();
                (theta(z_min), theta(z_max))
            }
            _ => (0.0, 0.0),
        }
    }
}

/// The roots of a t² + 2 b t + (c² - r²) with a = d·d, b = o·d, c = |o|, in ascending order.
///
/// `miss(t)` is the squared distance of the point at t from the centre or axis.
fn roots(r: f64, a: f64, b: f64, c: f64, miss: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let closest = -b / a;
    let half_squared = (r * r - miss(closest)) / a;
    if half_squared < 0.0 || half_squared.is_nan() {
        return None;
    }
    // The root of larger magnitude does not cancel; the other follows from the product of both.
    let large = closest + half_squared.sqrt().copysign(closest);
    let small = if large == 0.0 { 0.0 } else { (c - r) * (c + r) / (a * large) };
    Some(if small <= large { (small, large) } else { (large, small) })
}

/// A quadric placed in a group.
pub(crate) struct PlacedQuadric {
    pub shape: Quadric,
    pub to_object: DAffine3,
    pub prim: u32,
}

impl PlacedQuadric {
    pub fn new(shape: Quadric, to_group: DAffine3, prim: u32) -> PlacedQuadric {
        PlacedQuadric { shape, to_object: to_group.inverse(), prim }
    }

    /// `None` when the placed shape has no finite box or no inverse: it is never hit.
    pub fn bounds(&self, to_group: &DAffine3) -> Option<Bounds> {
        let (lo, hi) = self.shape.object_box();
        if !(lo.cmple(hi).all() && lo.is_finite() && hi.is_finite() && self.to_object.is_finite()) {
            return None;
        }
        // Extent of the box's image per axis, from its centre.
        let (centre, half) = ((lo + hi) * 0.5, (hi - lo) * 0.5);
        let m = &to_group.matrix3;
        let mut spread = m.x_axis.abs() * half.x + m.y_axis.abs() * half.y + m.z_axis.abs() * half.z;
        if let Quadric::Sphere { radius, z_min, z_max, .. } = self.shape
            && z_min <= -radius
            && z_max >= radius
        {
            let rows = m.transpose();
            spread = DVec3::new(rows.x_axis.length(), rows.y_axis.length(), rows.z_axis.length()) * radius;
        }
        let middle = to_group.transform_point3(centre);
        let bounds = Bounds::outward(middle - spread, middle + spread);
        bounds.is_finite().then_some(bounds)
    }

    #[inline]
    pub fn intersect(&self, origin: DVec3, dir: DVec3, t_min: f32, t_max: f32) -> Option<(f64, f64, f64)> {
        let o = self.to_object.transform_point3(origin);
        let d = self.to_object.transform_vector3(dir);
        self.shape.intersect(o, d, f64::from(t_min), f64::from(t_max))
    }
}
