//! Areas of shapes: luminaires of given power need them.

use crate::Quadric;
use crate::geom::{DAffine3, DVec3, Vec3};

/// Area of a triangle mesh.
pub fn of_mesh(positions: &[Vec3], indices: &[[u32; 3]]) -> f64 {
    let at = |i: u32| positions[i as usize].as_dvec3();
    indices.iter().map(|&[a, b, c]| 0.5 * (at(b) - at(a)).cross(at(c) - at(a)).length()).sum()
}

/// Area of a placed quadric: exact under similarities, a midpoint sum of 256 × 256 otherwise.
pub fn of_quadric(q: &Quadric, m: &DAffine3) -> f64 {
    let l = m.matrix3;
    let (x, y, z) = (l.x_axis, l.y_axis, l.z_axis);
    let s = x.length_squared();
    let skew = x.dot(y).abs().max(y.dot(z).abs()).max(z.dot(x).abs());
    let uneven = (y.length_squared() - s).abs().max((z.length_squared() - s).abs());
    if skew.max(uneven) < 1e-9 * s {
        return s * own_area(q);
    }
    const N: usize = 256;
    let h = 1.0 / N as f64;
    let mut sum = 0.0;
    for i in 0..N {
        for j in 0..N {
            let (du, dv) = partials(q, (i as f64 + 0.5) * h, (j as f64 + 0.5) * h);
            sum += (l * du).cross(l * dv).length();
        }
    }
    sum * h * h
}

fn own_area(q: &Quadric) -> f64 {
    match *q {
        Quadric::Sphere { radius, z_min, z_max, phi_max } => phi_max * radius * (z_max - z_min),
        Quadric::Disk { radius, inner_radius, phi_max, .. } => {
            phi_max * 0.5 * (radius * radius - inner_radius * inner_radius)
        }
        Quadric::Cylinder { radius, z_min, z_max, phi_max } => phi_max * radius * (z_max - z_min),
    }
}

/// dp/du and dp/dv at (u, v) in [0, 1]²: u along φ; v along z, or along the radius of a disk.
fn partials(q: &Quadric, u: f64, v: f64) -> (DVec3, DVec3) {
    match *q {
        Quadric::Sphere { radius, z_min, z_max, phi_max } => {
            let (sin, cos) = (u * phi_max).sin_cos();
            let z = z_min + v * (z_max - z_min);
            let r = (radius * radius - z * z).max(1e-30).sqrt();
            (
                DVec3::new(-sin, cos, 0.0) * (r * phi_max),
                DVec3::new(-z / r * cos, -z / r * sin, 1.0) * (z_max - z_min),
            )
        }
        Quadric::Disk { radius, inner_radius, phi_max, .. } => {
            let (sin, cos) = (u * phi_max).sin_cos();
            let r = inner_radius + v * (radius - inner_radius);
            (DVec3::new(-sin, cos, 0.0) * (r * phi_max), DVec3::new(cos, sin, 0.0) * (radius - inner_radius))
        }
        Quadric::Cylinder { radius, z_min, z_max, phi_max } => {
            let (sin, cos) = (u * phi_max).sin_cos();
            (DVec3::new(-sin, cos, 0.0) * (radius * phi_max), DVec3::Z * (z_max - z_min))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn closed_forms() {
        let sphere = Quadric::Sphere { radius: 2.0, z_min: -2.0, z_max: 2.0, phi_max: TAU };
        assert!((of_quadric(&sphere, &DAffine3::IDENTITY) - 16.0 * PI).abs() < 1e-12);
        let twice = DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
        assert!((of_quadric(&sphere, &twice) - 64.0 * PI).abs() < 1e-10);
        let disk = Quadric::Disk { height: 1.0, radius: 2.0, inner_radius: 1.0, phi_max: PI };
        assert!((of_quadric(&disk, &DAffine3::IDENTITY) - 1.5 * PI).abs() < 1e-12);
        // An ellipse of half axes 3 and 1, an elliptic cylinder by Ramanujan's perimeter.
        let unit = Quadric::Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: TAU };
        let stretch = DAffine3::from_scale(DVec3::new(3.0, 1.0, 1.0));
        assert!((of_quadric(&unit, &stretch) - 3.0 * PI).abs() < 1e-6);
        let tube = Quadric::Cylinder { radius: 1.0, z_min: 0.0, z_max: 2.0, phi_max: TAU };
        let perimeter = PI * (12.0 - (10.0f64 * 6.0).sqrt());
        assert!((of_quadric(&tube, &stretch) / (2.0 * perimeter) - 1.0).abs() < 1e-3);
        // A prolate spheroid (half axes 1, 1, 2): 2π(1 + 2 asin(e)/e), e = √3/2.
        let ball = Quadric::Sphere { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: TAU };
        let e = 0.75f64.sqrt();
        let exact = TAU * (1.0 + 2.0 * e.asin() / e);
        let long = DAffine3::from_scale(DVec3::new(1.0, 1.0, 2.0));
        assert!((of_quadric(&ball, &long) / exact - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_square_of_two_triangles() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y, Vec3::Y];
        assert!((of_mesh(&p, &[[0, 1, 2], [0, 2, 3]]) - 1.0).abs() < 1e-12);
    }
}
