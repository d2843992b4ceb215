//! Units of direct light: the triangle, quadric or rectangle that a pick finds; its extent for the tree, and its points.

use super::emission::power_per_area;
use super::emitter_points::{
    Frame64, cone, quadric_area_point, quadric_box, sphere_area_point, triangle_point,
};
use super::hierarchy::Extent;
use super::luminaire::{Emitter, Luminaire};
use super::solid_angle::{Rectangle, SphericalRectangle, SphericalTriangle};
use hemilux_scene::geom::{DVec3, Vec2, Vec3};
use hemilux_scene::{Emission, Profile, Quadric, Scene};

/// A flat unit closer than this many of its radii is sampled by solid angle.
const NEAR: f64 = 5.0;

/// What a pick for a receiver finds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Unit {
    /// First luminaire; the next one belongs to it too if there is a rectangle.
    pub item: u32,
    pub rectangle: Option<Rectangle>,
    /// Middle and radius (m) of a ball around it.
    pub centre: DVec3,
    pub radius: f64,
}

pub(super) enum Density {
    SolidAngle(f32),
    Area(f32),
}

impl Unit {
    /// `from` if it is near enough for sampling by solid angle.
    #[inline]
    pub(super) fn near(&self, from: Vec3) -> Option<DVec3> {
        let from = from.as_dvec3();
        let reach = NEAR * self.radius;
        ((from - self.centre).length_squared() < reach * reach).then_some(from)
    }

    pub(super) fn area(&self, item: &Luminaire) -> f32 {
        self.rectangle.map_or(item.area, |r| r.area() as f32)
    }

    /// Solid angle (sr) of the rectangle, or of the triangle given; `None`: sample by area.
    pub(super) fn solid_angle(&self, from: DVec3, a: Vec3, e1: Vec3, e2: Vec3) -> Option<f64> {
        match &self.rectangle {
            Some(r) => SphericalRectangle::new(from, r).map(|s| s.solid_angle),
            None => SphericalTriangle::new(from, corners(a, e1, e2)).map(|s| s.solid_angle),
        }
    }

    /// Point, direction and density by solid angle.
    pub(super) fn near_point(
        &self,
        from: DVec3,
        a: Vec3,
        e1: Vec3,
        e2: Vec3,
        u: [f32; 2],
    ) -> Option<(Vec3, Option<Vec3>, Density)> {
        let [u, v] = u.map(|x| x as f64);
        let (q, w, omega) = match &self.rectangle {
            Some(r) => {
                let s = SphericalRectangle::new(from, r)?;
                let q = r.point(s.fractions(u, v));
                (q, (q - from).normalize_or_zero(), s.solid_angle)
            }
            None => {
                let s = SphericalTriangle::new(from, corners(a, e1, e2))?;
                let w = s.direction(u, v);
                let n = e1.as_dvec3().cross(e2.as_dvec3());
                let q = from + w * (n.dot(a.as_dvec3() - from) / n.dot(w));
                // A grazing direction may miss the triangle by rounding.
                let inside = (q - self.centre).length_squared() <= self.radius * self.radius * 1.01;
                (if inside { q } else { self.centre }, w, s.solid_angle)
            }
        };
        Some((q.as_vec3(), Some(w.as_vec3()), Density::SolidAngle((1.0 / omega) as f32)))
    }
}

pub(super) fn corners(a: Vec3, e1: Vec3, e2: Vec3) -> [DVec3; 3] {
    let a = a.as_dvec3();
    [a, a + e1.as_dvec3(), a + e2.as_dvec3()]
}

impl Luminaire {
    /// The rectangle that this triangle and `next` make, if they emit alike.
    pub(super) fn rectangle_with(&self, next: &Luminaire) -> Option<Rectangle> {
        let (Emitter::Triangle { a, e1, e2, n, .. }, Emitter::Triangle { a: b, e1: f1, e2: f2, n: m, .. }) =
            (&self.emitter, &next.emitter)
        else {
            return None;
        };
        let alike = self.emission == next.emission && n.dot(*m) > 1.0 - 1e-6;
        alike.then(|| Rectangle::from_triangles(corners(*a, *e1, *e2), corners(*b, *f1, *f2)))?
    }

    /// What the tree must know.
    pub(super) fn extent(&self, scene: &Scene, emission: &Emission) -> Extent {
        let sides = if emission.two_sided { 2.0 } else { 1.0 };
        let radiance = match emission.profile {
            // In full within its cone.
            Profile::Spot { .. } => emission.radiance.luminance().max(0.0) as f64,
            _ => power_per_area(scene, emission) / (std::f64::consts::PI * sides),
        };
        let everywhere = |low: DVec3, high: DVec3, shown: f64| Extent {
            low,
            high,
            axis: DVec3::Z,
            spread: std::f64::consts::PI,
            reach: std::f64::consts::FRAC_PI_2,
            two_sided: false,
            intensity: radiance * shown,
        };
        let flat = |low: DVec3, high: DVec3, axis: DVec3| Extent {
            axis,
            spread: 0.0,
            two_sided: emission.two_sided,
            ..everywhere(low, high, self.area as f64)
        };
        match &self.emitter {
            Emitter::Triangle { a, e1, e2, n, .. } => {
                let [a, b, c] = corners(*a, *e1, *e2);
                let axis = n.as_dvec3().try_normalize();
                match axis {
                    Some(axis) => flat(a.min(b).min(c), a.max(b).max(c), axis),
                    None => everywhere(a.min(b).min(c), a.max(b).max(c), 0.0),
                }
            }
            Emitter::Quadric { sphere: Some((centre, r)), .. } => {
                let whole = everywhere(*centre - *r, *centre + *r, std::f64::consts::PI * r * r);
                match emission.profile {
                    Profile::Spot { axis, cos_end, .. } => Extent {
                        axis: axis.as_dvec3().normalize_or(DVec3::Z),
                        spread: 0.0,
                        reach: (cos_end as f64).clamp(-1.0, 1.0).acos(),
                        ..whole
                    },
                    _ => whole,
                }
            }
            Emitter::Quadric { q, to_world, sign, .. } => {
                let (low, high) = quadric_box(*q, to_world);
                match q {
                    Quadric::Disk { .. } => {
                        let normal = to_world.matrix3.inverse().transpose() * DVec3::Z;
                        flat(low, high, (normal * *sign).normalize_or(DVec3::Z))
                    }
                    _ => everywhere(low, high, self.area as f64 / std::f64::consts::PI),
                }
            }
            Emitter::Sky(_) => everywhere(DVec3::ZERO, DVec3::ZERO, 0.0),
        }
    }

    /// A point of a quadric as seen from `from`.
    pub(super) fn quadric_point(&self, from: Vec3, u: [f32; 2]) -> Option<LuminairePoint> {
        match &self.emitter {
            Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                let Some((axis, distance, height)) = cone(from, *centre, *r, *sign) else {
                    let (q, n, uv) = sphere_area_point(*centre, *r, u);
                    return Some(LuminairePoint {
                        q: q.as_vec3(),
                        error: q.abs().as_vec3() * (2.0 * f32::EPSILON),
                        n: (n * *sign).as_vec3(),
                        uv,
                        direction: None,
                        density: Density::Area(1.0 / self.area),
                    });
                };
                let x = u[0] as f64 * height;
                let sin2 = x * (2.0 - x);
                let (s, c) = (2.0 * std::f64::consts::PI * u[1] as f64).sin_cos();
                let frame = Frame64::new(axis);
                let sin = sin2.max(0.0).sqrt();
                let w = frame.s * (sin * c) + frame.t * (sin * s) + axis * (1.0 - x);
                let t = distance * (1.0 - x) - (r * r - distance * distance * sin2).max(0.0).sqrt();
                let q = from.as_dvec3() + w * t;
                Some(LuminairePoint {
                    q: q.as_vec3(),
                    error: (q.abs() + from.as_dvec3().abs()).as_vec3() * (2.0 * f32::EPSILON),
                    n: ((q - *centre).normalize() * *sign).as_vec3(),
                    uv: Vec2::ZERO,
                    direction: Some(w.as_vec3()),
                    density: Density::SolidAngle((0.5 / std::f64::consts::PI / height) as f32),
                })
            }
            Emitter::Quadric { q, to_world, sign, area_object, .. } => {
                let (p, n, uv, pdf) = quadric_area_point(*q, to_world, *area_object, u);
                Some(LuminairePoint {
                    q: p.as_vec3(),
                    error: p.abs().as_vec3() * (4.0 * f32::EPSILON),
                    n: (n * *sign).as_vec3(),
                    uv,
                    direction: None,
                    density: Density::Area(pdf),
                })
            }
            _ => None,
        }
    }

    /// A point uniform over the area, for emission.
    pub(super) fn area_point(&self, u: [f32; 2]) -> Option<LuminairePoint> {
        match &self.emitter {
            Emitter::Triangle { a, e1, e2, n, uv } => {
                let (b1, b2) = triangle_point(u);
                Some(LuminairePoint {
                    q: *a + *e1 * b1 + *e2 * b2,
                    error: (a.abs() + e1.abs() + e2.abs()) * (4.0 * f32::EPSILON),
                    n: *n,
                    uv: uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2,
                    direction: None,
                    density: Density::Area(1.0 / self.area),
                })
            }
            // From infinitely far away the cone of a sphere is no way to sample it.
            Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                let (q, n, uv) = sphere_area_point(*centre, *r, u);
                Some(LuminairePoint {
                    q: q.as_vec3(),
                    error: (q.abs() * (2.0 * f32::EPSILON as f64)).as_vec3(),
                    n: (n * *sign).as_vec3(),
                    uv,
                    direction: None,
                    density: Density::Area(1.0 / self.area),
                })
            }
            _ => self.quadric_point(Vec3::INFINITY, u),
        }
    }
}

/// A point of a luminaire.
pub(super) struct LuminairePoint {
    pub q: Vec3,
    /// Rounding error of `q`.
    pub error: Vec3,
    /// On the emitting side.
    pub n: Vec3,
    pub uv: Vec2,
    /// If known better than by difference.
    pub direction: Option<Vec3>,
    pub density: Density,
}
