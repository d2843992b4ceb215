//! Directions uniform over the solid angle of a flat luminaire: spherical triangles (Arvo 1995, "Stratified sampling of
//! spherical triangles") and spherical rectangles (Ureña, Fajardo and King 2013, "An area-preserving parametrization for
//! spherical rectangles"). In `f64`; both maps keep strata together.
//!
//! Nearby luminaires subtend so much that sampling by area wastes samples where the distance or the slant is large.
//! Constructors return `None` where the solid angle is too small or too slim for the formulas: sampling by area serves
//! there. The answer depends on the luminaire and the point alone, so that a density can be asked for later.

use hemilux_scene::geom::DVec3;
use std::f64::consts::{PI, TAU};

/// Below this solid angle (sr) the formulas lose digits.
const SMALLEST: f64 = 1e-7;

/// A triangle projected on the unit sphere around a point.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    a: DVec3,
    b: DVec3,
    c: DVec3,
    /// Steradians, in (0, 2π).
    pub solid_angle: f64,
}

impl SphericalTriangle {
    /// The triangle of `corners` seen from `from` (m).
    pub fn new(from: DVec3, corners: [DVec3; 3]) -> Option<SphericalTriangle> {
        let [a, b, c] = corners.map(|q| (q - from).normalize_or_zero());
        // Van Oosterom and Strackee 1983.
        let volume = a.dot(b.cross(c)).abs();
        let solid_angle = 2.0 * volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        let regular = a.cross(b).length() > 1e-6 && a.cross(c).length() > 1e-6 && volume > 1e-9;
        (regular && solid_angle > SMALLEST && solid_angle < TAU - 1e-6).then_some(SphericalTriangle {
            a,
            b,
            c,
            solid_angle,
        })
    }

    /// The direction at (u, v) of the unit square; density 1 / `solid_angle`.
    pub fn direction(&self, u: f64, v: f64) -> DVec3 {
        let SphericalTriangle { a, b, c, solid_angle } = *self;
        let (ab, ac) = (a.cross(b), a.cross(c));
        let scale = 1.0 / (ab.length() * ac.length());
        let (cos_alpha, sin_alpha) = (ab.dot(ac) * scale, ab.cross(ac).length() * scale);
        let alpha = sin_alpha.atan2(cos_alpha);
        // The sub-triangle of area u Ω that keeps A and B.
        let (s, t) = (u * solid_angle - alpha).sin_cos();
        let p = t - cos_alpha;
        let q = s + sin_alpha * a.dot(b);
        let cos_side = ((q * t - p * s) * cos_alpha - q) / ((q * s + p * t) * sin_alpha);
        let cos_side = if cos_side.is_nan() { 1.0 } else { cos_side.clamp(-1.0, 1.0) };
        let corner = a * cos_side + across(c, a) * (1.0 - cos_side * cos_side).max(0.0).sqrt();
        let z = 1.0 - v * (1.0 - corner.dot(b));
        b * z + across(corner, b) * (1.0 - z * z).max(0.0).sqrt()
    }
}

/// The part of `v` across unit `axis`, unit.
fn across(v: DVec3, axis: DVec3) -> DVec3 {
    (v - axis * v.dot(axis)).normalize_or_zero()
}

/// A flat rectangle in space.
#[derive(Clone, Copy, Debug)]
pub struct Rectangle {
    /// One corner (m).
    pub corner: DVec3,
    /// Unit directions of the edges.
    pub axes: [DVec3; 2],
    /// Lengths of the edges (m).
    pub lengths: [f64; 2],
}

impl Rectangle {
    /// The rectangle that two triangles make, and whether there is one: they share the diagonal, the first one has the
    /// right angle at `apex`.
    pub fn from_triangles(first: [DVec3; 3], second: [DVec3; 3]) -> Option<Rectangle> {
        let alone = |t: &[DVec3; 3], other: &[DVec3; 3]| {
            let mut apart = (0..3).filter(|&i| !other.contains(&t[i]));
            let apex = apart.next()?;
            apart.next().is_none().then_some(apex)
        };
        let (i, j) = (alone(&first, &second)?, alone(&second, &first)?);
        let corner = first[i];
        let edges = [first[(i + 1) % 3] - corner, first[(i + 2) % 3] - corner];
        let lengths = edges.map(DVec3::length);
        let size = lengths[0].max(lengths[1]);
        let square = edges[0].dot(edges[1]).abs() <= 1e-6 * lengths[0] * lengths[1];
        let closed = (corner + edges[0] + edges[1] - second[j]).length() <= 1e-6 * size;
        let slim = lengths[0].min(lengths[1]) <= 1e-9 * size;
        (square && closed && !slim).then(|| Rectangle {
            corner,
            axes: [edges[0] / lengths[0], edges[1] / lengths[1]],
            lengths,
        })
    }

    /// m².
    pub fn area(&self) -> f64 {
        self.lengths[0] * self.lengths[1]
    }

    /// The point at fractions `u` of the edges.
    pub fn point(&self, u: [f64; 2]) -> DVec3 {
        self.corner + self.axes[0] * (u[0] * self.lengths[0]) + self.axes[1] * (u[1] * self.lengths[1])
    }
}

/// A rectangle projected on the unit sphere around a point. Coordinates along its edges and its normal, the point at the
/// origin.
#[derive(Clone, Copy, Debug)]
pub struct SphericalRectangle {
    low: [f64; 2],
    high: [f64; 2],
    /// Distance from the plane (m).
    distance: f64,
    /// Steradians, in (0, 2π).
    pub solid_angle: f64,
}

impl SphericalRectangle {
    /// `rectangle` seen from `from` (m).
    pub fn new(from: DVec3, rectangle: &Rectangle) -> Option<SphericalRectangle> {
        let [x, y] = rectangle.axes;
        let to = rectangle.corner - from;
        let low = [to.dot(x), to.dot(y)];
        let high = [low[0] + rectangle.lengths[0], low[1] + rectangle.lengths[1]];
        let distance = to.dot(x.cross(y)).abs();
        if distance <= 1e-6 * (rectangle.lengths[0] + rectangle.lengths[1]) {
            return None;
        }
        let corner =
            |x: f64, y: f64| (x * y / (distance * (x * x + y * y + distance * distance).sqrt())).atan();
        let solid_angle = corner(high[0], high[1]) - corner(low[0], high[1]) - corner(high[0], low[1])
            + corner(low[0], low[1]);
        (solid_angle > SMALLEST).then_some(SphericalRectangle { low, high, distance, solid_angle })
    }

    /// Where the direction at (u, v) of the unit square meets the rectangle: fractions of its edges; density 1 /
    /// `solid_angle`.
    pub fn fractions(&self, u: f64, v: f64) -> [f64; 2] {
        let SphericalRectangle { low: [x0, y0], high: [x1, y1], distance: z, solid_angle } = *self;
        let slope = |a: f64| a / a.hypot(z);
        // z components of the normals of the planes through the edges, as in the paper with z0 = -distance.
        let (b0, b1, n1, n3) = (-slope(y0), slope(y1), slope(x1), -slope(x0));
        let angle = |a: f64, b: f64| (-a * b).clamp(-1.0, 1.0).acos();
        let k = TAU - angle(b1, n3) - angle(n3, b0);
        debug_assert!(angle(b0, n1) + angle(n1, b1) + k.abs() < 4.0 * PI);
        let (sin, cos) = (u * solid_angle + k).sin_cos();
        let f = (cos * b0 - b1) / sin;
        let c = (1.0 / f.hypot(b0)).copysign(f).clamp(-1.0, 1.0);
        let x = (c * z / (1.0 - c * c).max(1e-300).sqrt()).clamp(x0, x1);
        let d = x.hypot(z);
        let (h0, h1) = (y0 / y0.hypot(d), y1 / y1.hypot(d));
        let h = h0 + v * (h1 - h0);
        let y = (h * d / (1.0 - h * h).max(1e-300).sqrt()).clamp(y0, y1);
        [(x - x0) / (x1 - x0), (y - y0) / (y1 - y0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_square(z: f64) -> Rectangle {
        Rectangle { corner: DVec3::new(-0.5, -0.5, z), axes: [DVec3::X, DVec3::Y], lengths: [1.0, 1.0] }
    }

    #[test]
    fn solid_angles_against_closed_forms() {
        // A face of a cube seen from its centre.
        let face = SphericalRectangle::new(DVec3::ZERO, &unit_square(0.5)).unwrap();
        assert!((face.solid_angle - 4.0 * PI / 6.0).abs() < 1e-12);
        // An octant.
        let octant = SphericalTriangle::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z]).unwrap();
        assert!((octant.solid_angle - PI / 2.0).abs() < 1e-12);
        // Two triangles make the rectangle, from off its axis too.
        let from = DVec3::new(1.3, -0.4, 0.2);
        let r = unit_square(0.7);
        let at = |u, v| r.point([u, v]);
        let corners = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        let t = |i: [usize; 3]| SphericalTriangle::new(from, i.map(|i| corners[i])).unwrap().solid_angle;
        let whole = SphericalRectangle::new(from, &r).unwrap().solid_angle;
        assert!((t([0, 1, 2]) + t([0, 2, 3]) - whole).abs() < 1e-12);
        let made = Rectangle::from_triangles([0, 1, 2].map(|i| corners[i]), [0, 2, 3].map(|i| corners[i]));
        assert!((made.unwrap().area() - 1.0).abs() < 1e-12);
        // A parallelogram that is no rectangle is none.
        let sheared = [corners[0], corners[1], corners[2] + DVec3::X * 0.1, corners[3] + DVec3::X * 0.1];
        let made = Rectangle::from_triangles([0, 1, 2].map(|i| sheared[i]), [0, 2, 3].map(|i| sheared[i]));
        assert!(made.is_none());
    }

    /// Quarter squares must have quarter solid angles: the maps keep area. Solid angles of the images of cell corners
    /// are compared with the cells' areas by the spherical polygon of a finely divided boundary.
    #[test]
    fn maps_keep_area() {
        let from = DVec3::new(0.6, 0.1, 0.3);
        let r = unit_square(0.55);
        let rectangle = SphericalRectangle::new(from, &r).unwrap();
        let triangle =
            SphericalTriangle::new(from, [r.point([0.0, 0.0]), r.point([1.0, 0.2]), r.point([0.3, 1.0])])
                .unwrap();
        let on_rectangle = |u: f64, v: f64| (r.point(rectangle.fractions(u, v)) - from).normalize();
        let on_triangle = |u: f64, v: f64| triangle.direction(u, v);
        let n = 40;
        let cell = |map: &dyn Fn(f64, f64) -> DVec3, i: usize, j: usize| {
            let at = |i: usize, j: usize| map(i as f64 / n as f64, j as f64 / n as f64);
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            let omega = |a: DVec3, b: DVec3, c: DVec3| {
                2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
            };
            omega(a, b, c) + omega(a, c, d)
        };
        for i in 0..n {
            for j in 0..n {
                let wanted = rectangle.solid_angle / (n * n) as f64;
                let got = cell(&on_rectangle, i, j);
                assert!((got / wanted - 1.0).abs() < 3e-2, "rectangle {i} {j}: {got} {wanted}");
                let wanted = triangle.solid_angle / (n * n) as f64;
                let got = cell(&on_triangle, i, j);
                // Cells at the corner that Arvo's map pinches have edges that bend more.
                assert!((got / wanted - 1.0).abs() < 6e-2, "triangle {i} {j}: {got} {wanted}");
            }
        }
    }

    #[test]
    fn too_small_or_edge_on_is_left_to_area_sampling() {
        assert!(SphericalRectangle::new(DVec3::new(0.0, 0.0, 1.0), &unit_square(1.0)).is_none());
        assert!(SphericalRectangle::new(DVec3::new(0.0, 0.0, 1e5), &unit_square(1.0)).is_none());
        let line = [DVec3::X, DVec3::X * 2.0, DVec3::X * 3.0];
        assert!(SphericalTriangle::new(DVec3::Z, line).is_none());
        assert!(SphericalTriangle::new(DVec3::ZERO, [DVec3::ZERO, DVec3::X, DVec3::Y]).is_none());
    }
}
