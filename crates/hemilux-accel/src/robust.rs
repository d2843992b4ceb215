//! Rounding-error bounds, and rays that start beside a surface and not on its wrong side.
//!
//! The intersection tests decide the side of the plane or quadric in `f64`, so the only error that matters when a
//! ray is spawned is that of the `f32` hit point. It is bounded here and handed to [`offset_origin`]: no epsilon, no
//! scene scale (M. Pharr, W. Jakob, G. Humphreys, *Physically Based Rendering*, section "Managing Rounding Error").

use glam::{DAffine3, DVec3, Vec3};

/// Half a unit in the last place, relative.
const UNIT: f32 = 0.5 * f32::EPSILON;

/// The bound on the error of a point computed in `f64` and rounded to `p`, per axis.
#[inline]
pub fn rounding_error(p: Vec3) -> Vec3 {
    // The second term covers the f64 arithmetic (a hundred roundings), the last subnormal results.
    p.abs() * (UNIT * (1.0 + 1e-6)) + Vec3::splat(f32::from_bits(1))
}

/// The point of a triangle with barycentric coordinates `u` (vertex 1) and `v` (vertex 2), and the bound of its
/// distance to the triangle's plane, per axis.
#[inline]
pub fn triangle_point(vertices: &[Vec3; 3], u: f32, v: f32) -> (Vec3, Vec3) {
    let [a, b, c] = vertices.map(Vec3::as_dvec3);
    let (u, v) = (f64::from(u), f64::from(v));
    let p = a + (b - a) * u + (c - a) * v;
    let cancelled = (a.abs() + (b - a).abs() + (c - a).abs()).as_vec3() * (16.0 * f64::EPSILON as f32);
    (p.as_vec3(), rounding_error(p.as_vec3()) + cancelled)
}

/// The unit normal of a triangle, counter-clockwise seen against it; computed in `f64`, since `f32` differences of the
/// vertices of a sliver far from the origin can tilt it by degrees. NaN for a triangle of no area.
#[inline]
pub fn triangle_normal(vertices: &[Vec3; 3]) -> Vec3 {
    let [a, b, c] = vertices.map(Vec3::as_dvec3);
    (b - a).cross(c - a).normalize().as_vec3()
}

/// The image of a point known within `error`, and the bound of its error, both per axis.
///
/// The point is transformed in `f64` and rounded once. The second term of the bound covers what cancels in the `f64`
/// sum, as when a far translation undoes a far local origin.
#[inline]
pub fn transform_error(to_world: &DAffine3, p: DVec3, error: DVec3) -> (Vec3, Vec3) {
    let m = &to_world.matrix3;
    let spread = |d: DVec3| m.x_axis.abs() * d.x + m.y_axis.abs() * d.y + m.z_axis.abs() * d.z;
    let image = to_world.transform_point3(p).as_vec3();
    let sum = spread(p.abs()) + to_world.translation.abs();
    let error = spread(error.abs()) + sum * (16.0 * f64::EPSILON);
    (image, rounding_error(image) + error.as_vec3() * (1.0 + f32::EPSILON))
}

/// The origin of a ray leaving the surface point `p` along `dir`: `p` moved to the side of the normal `n` (unit) that
/// `dir` points to, by `|n| · p_error` and on to the next floats away from the surface.
///
/// If the true surface passes within `p_error` (per axis) of `p`, the result is strictly on that side of its tangent
/// plane. A ray with `t_min = 0` from there does not meet the same triangle, nor the same convex side of a quadric.
#[inline]
pub fn offset_origin(p: Vec3, p_error: Vec3, n: Vec3, dir: Vec3) -> Vec3 {
    let side = if dir.dot(n) < 0.0 { -n } else { n };
    let offset = side * (n.abs().dot(p_error) * (1.0 + 4.0 * f32::EPSILON));
    let away = |x: f32, by: f32, side: f32| {
        if side > 0.0 {
            (x + by).next_up()
        } else if side < 0.0 {
            (x + by).next_down()
        } else {
            x
        }
    };
    Vec3::new(away(p.x, offset.x, side.x), away(p.y, offset.y, side.y), away(p.z, offset.z, side.z))
}
