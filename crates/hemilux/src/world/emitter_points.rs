//! Points on emitting shapes: uniform over area, or over the cone that a sphere fills; areas and stretches of placed
//! quadrics. Double precision where a lamp of 0.1 mm needs it.

use super::World;
#[cfg(test)]
use super::convert;
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::{Geometry, Quadric};

/// Uniform barycentrics (Heitz 2019, a low-distortion map).
pub(super) fn triangle_point(u: [f32; 2]) -> (f32, f32) {
    if u[0] < u[1] {
        let b0 = u[0] * 0.5;
        (b0, u[1] - b0)
    } else {
        let b1 = u[1] * 0.5;
        (u[0] - b1, b1)
    }
}

/// Axis, distance and height (1 − cos of the half-angle) of the cone that a sphere fills. `None` where sampling by area
/// has to do: from inside, and as near to the surface as rounding of `from` can tell; always if it emits inward.
pub(super) fn cone(from: Vec3, centre: DVec3, r: f64, sign: f64) -> Option<(DVec3, f64, f64)> {
    let from = from.as_dvec3();
    let to = centre - from;
    let d2 = to.length_squared();
    let rounding = 8.0 * f32::EPSILON as f64 * (from.abs().max_element() + centre.abs().max_element() + r);
    if sign < 0.0 || d2 <= (r + rounding).powi(2) {
        return None;
    }
    let sin2 = r * r / d2;
    let distance = d2.sqrt();
    Some((to / distance, distance, sin2 / (1.0 + (1.0 - sin2).sqrt())))
}

pub(super) struct Frame64 {
    pub s: DVec3,
    pub t: DVec3,
}

impl Frame64 {
    pub(super) fn new(n: DVec3) -> Frame64 {
        let s = n.any_orthonormal_vector();
        Frame64 { s, t: n.cross(s) }
    }
}

pub(super) fn sphere_area_point(centre: DVec3, r: f64, u: [f32; 2]) -> (DVec3, DVec3, Vec2) {
    let z = 1.0 - 2.0 * u[0] as f64;
    let rho = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = (2.0 * std::f64::consts::PI * u[1] as f64).sin_cos();
    let n = DVec3::new(rho * c, rho * s, z);
    (centre + n * r, n, Vec2::new(u[1], u[0]))
}

pub(super) fn whole_sphere(q: Quadric, to_world: &DAffine3) -> Option<(DVec3, f64)> {
    let Quadric::Sphere { radius, z_min, z_max, phi_max } = q else { return None };
    let whole = z_min <= -radius && z_max >= radius && phi_max >= 2.0 * std::f64::consts::PI * (1.0 - 1e-9);
    let m = to_world.matrix3;
    let scale = m.x_axis.length();
    let gram = m.transpose() * m;
    let ideal = glam::DMat3::from_diagonal(DVec3::splat(scale * scale));
    let similar = (gram - ideal).to_cols_array().iter().all(|v| v.abs() <= 1e-6 * scale * scale);
    (whole && similar).then_some((to_world.translation, radius * scale))
}

/// Centre and radius (m) of a ball around a shape.
pub(crate) fn shape_ball(world: &World, geometry: &Geometry, to_world: &DAffine3) -> (DVec3, f32) {
    let mut corners: Vec<DVec3> = Vec::new();
    match geometry {
        Geometry::Mesh(id) => {
            let positions = &world.scene.meshes[id.0 as usize].positions;
            corners.extend(positions.iter().map(|p| to_world.transform_point3(p.as_dvec3())));
        }
        Geometry::Quadric(q, to_group) => {
            let placed = *to_world * *to_group;
            let cell = |i: usize| i as f32 / 8.0;
            corners.extend((0..81).map(|i| {
                let (p, _, _) = quadric_object_point(*q, [cell(i % 9), cell(i / 9)]);
                placed.transform_point3(p)
            }));
        }
    }
    let low = corners.iter().fold(DVec3::INFINITY, |m, c| m.min(*c));
    let high = corners.iter().fold(DVec3::NEG_INFINITY, |m, c| m.max(*c));
    let centre = (low + high) * 0.5;
    (centre, corners.iter().map(|c| (*c - centre).length()).fold(0.0, f64::max) as f32)
}

/// Area before the placement (m²).
pub(super) fn object_area(q: Quadric) -> f64 {
    match q {
        Quadric::Sphere { radius, z_min, z_max, phi_max } => {
            phi_max * radius * (z_max.min(radius) - z_min.max(-radius))
        }
        Quadric::Disk { radius, inner_radius, phi_max, .. } => {
            0.5 * phi_max * (radius * radius - inner_radius * inner_radius)
        }
        Quadric::Cylinder { radius, z_min, z_max, phi_max } => phi_max * radius * (z_max - z_min),
    }
}

/// World area per object area where the object's normal is `n` (unit).
pub(super) fn stretch(to_world: &DAffine3, n: DVec3) -> f64 {
    let m = to_world.matrix3;
    (m.determinant() * (m.inverse().transpose() * n).length()).abs()
}

/// The same, given the world normal (unit).
pub(super) fn stretch_world(to_world: &DAffine3, n: DVec3) -> f64 {
    let object = (to_world.matrix3.transpose() * n).normalize_or_zero();
    stretch(to_world, object)
}

pub(super) fn mean_stretch(q: Quadric, to_world: &DAffine3) -> f64 {
    let n = 32;
    let cell = |i: usize| (i as f32 + 0.5) / n as f32;
    let sum: f64 =
        (0..n * n).map(|i| stretch(to_world, quadric_object_point(q, [cell(i % n), cell(i / n)]).1)).sum();
    sum / (n * n) as f64
}

/// A point uniform over the object's area: position, unit normal, (u, v).
pub(super) fn quadric_object_point(q: Quadric, u: [f32; 2]) -> (DVec3, DVec3, Vec2) {
    let (a, b) = (u[0] as f64, u[1] as f64);
    match q {
        Quadric::Sphere { radius, z_min, z_max, phi_max } => {
            let (low, high) = (z_min.max(-radius), z_max.min(radius));
            let z = low + (high - low) * b;
            let rho = (radius * radius - z * z).max(0.0).sqrt();
            let (s, c) = (phi_max * a).sin_cos();
            let p = DVec3::new(rho * c, rho * s, z);
            let angle = |z: f64| (z / radius).clamp(-1.0, 1.0).acos();
            let span = angle(high) - angle(low);
            let v = if span != 0.0 { (angle(z) - angle(low)) / span } else { 0.5 };
            (p, p / radius, Vec2::new(u[0], v as f32))
        }
        Quadric::Disk { height, radius, inner_radius, phi_max } => {
            let r =
                (inner_radius * inner_radius + (radius * radius - inner_radius * inner_radius) * b).sqrt();
            let (s, c) = (phi_max * a).sin_cos();
            let v = (radius - r) / (radius - inner_radius);
            (DVec3::new(r * c, r * s, height), DVec3::Z, Vec2::new(u[0], v as f32))
        }
        Quadric::Cylinder { radius, z_min, z_max, phi_max } => {
            let (s, c) = (phi_max * a).sin_cos();
            let n = DVec3::new(c, s, 0.0);
            (n * radius + DVec3::Z * (z_min + (z_max - z_min) * b), n, Vec2::new(u[0], u[1]))
        }
    }
}

/// Box around a placed quadric (m).
pub(super) fn quadric_box(q: Quadric, to_world: &DAffine3) -> (DVec3, DVec3) {
    let (radius, low, high) = match q {
        Quadric::Sphere { radius, z_min, z_max, .. } => (radius, z_min.max(-radius), z_max.min(radius)),
        Quadric::Disk { height, radius, .. } => (radius, height, height),
        Quadric::Cylinder { radius, z_min, z_max, .. } => (radius, z_min.min(z_max), z_max.max(z_min)),
    };
    let corners = (0..8).map(|i| {
        let side = |bit: usize| if i & bit == 0 { -radius } else { radius };
        let z = if i & 4 == 0 { low } else { high };
        to_world.transform_point3(DVec3::new(side(1), side(2), z))
    });
    corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), c| (a.min(c), b.max(c)))
}

pub(super) fn quadric_area_point(
    q: Quadric,
    to_world: &DAffine3,
    area_object: f64,
    u: [f32; 2],
) -> (DVec3, DVec3, Vec2, f32) {
    let (p, n, uv) = quadric_object_point(q, u);
    let normal = (to_world.matrix3.inverse().transpose() * n).normalize_or_zero();
    let pdf = 1.0 / (area_object * stretch(to_world, n));
    (to_world.transform_point3(p), normal, uv, pdf as f32)
}

// The ray tracer's parametrisation must be the one that `quadric_object_point` reports.
#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn sampled_points_lie_where_their_parameters_say() {
        let quadrics = [
            Quadric::Sphere { radius: 2.0, z_min: -1.0, z_max: 1.5, phi_max: 4.0 },
            Quadric::Disk { height: 0.3, radius: 2.0, inner_radius: 0.5, phi_max: TAU },
            Quadric::Cylinder { radius: 1.5, z_min: -1.0, z_max: 2.0, phi_max: 5.0 },
        ];
        for q in quadrics {
            for u in [[0.1, 0.2], [0.7, 0.9], [0.5, 0.5]] {
                let (p, n, uv) = quadric_object_point(q, u);
                let at = convert(q).eval(uv.x as f64, uv.y as f64);
                assert!((at.position - p).length() < 1e-6, "{q:?} {u:?}: {} and {p}", at.position);
                assert!((at.normal.dot(n).abs() - 1.0).abs() < 1e-6);
            }
        }
    }

    #[test]
    fn cone_of_a_tiny_sphere_keeps_its_digits() {
        let (_, _, height) = cone(Vec3::ZERO, DVec3::new(0.0, 0.0, 4.0), 1e-4, 1.0).unwrap();
        let exact = 1.0 - (1.0 - (1e-4f64 / 4.0).powi(2)).sqrt();
        // The naive form is itself off by rounding; the series 1 − cos = s²/2 + s⁴/8 is not.
        let s2 = (1e-4f64 / 4.0).powi(2);
        assert!((height / (s2 / 2.0 + s2 * s2 / 8.0) - 1.0).abs() < 1e-12);
        assert!((exact / height - 1.0).abs() > 1e-9, "the naive form would have done");
    }
}
