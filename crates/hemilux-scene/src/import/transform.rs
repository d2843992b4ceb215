//! pbrt's transformations as double-precision affine maps.

use crate::geom::{DAffine3, DVec3};
use glam::DMat3;

/// Whether an affine map is finite and safely invertible (its columns are far from coplanar).
pub fn is_invertible(m: &DAffine3) -> bool {
    let l = m.matrix3;
    let scale = l.x_axis.length() * l.y_axis.length() * l.z_axis.length();
    let finite = m.is_finite() && scale.is_finite();
    finite && scale > 0.0 && l.determinant().abs() > 1e-12 * scale && m.inverse().is_finite()
}

/// Whether the map mirrors.
pub fn mirrors(m: &DAffine3) -> bool {
    m.matrix3.determinant() < 0.0
}

/// Sixteen numbers column by column, as `Transform` has them; `None` unless the last row is 0 0 0 1.
pub fn from_columns(v: &[f64; 16]) -> Option<DAffine3> {
    let row = [v[3], v[7], v[11], v[15]];
    if row[..3].iter().any(|x| x.abs() > 1e-9) || (row[3] - 1.0).abs() > 1e-9 {
        return None;
    }
    Some(DAffine3::from_cols_array(&[
        v[0], v[1], v[2], v[4], v[5], v[6], v[8], v[9], v[10], v[12], v[13], v[14],
    ]))
}

/// Rotation by degrees around an axis; `None` for a zero axis.
pub fn rotate(degrees: f64, axis: DVec3) -> Option<DAffine3> {
    let axis = axis.try_normalize()?;
    // Quarter turns exactly.
    let (sin, cos) = match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => degrees.to_radians().sin_cos(),
    };
    // Rodrigues: R v = v cos + (a × v) sin + a (a·v)(1 − cos).
    let column = |v: DVec3| v * cos + axis.cross(v) * sin + axis * (axis.dot(v) * (1.0 - cos));
    Some(DAffine3::from_mat3(DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))))
}

/// World to camera of `LookAt`: x right, y up, z towards `look` (left-handed). `None` if eye and look coincide or the
/// view runs along `up`.
pub fn look_at(eye: DVec3, look: DVec3, up: DVec3) -> Option<DAffine3> {
    let dir = (look - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(dir);
    if right.length() < 1e-9 {
        return None;
    }
    let right = right.normalize();
    let to_world = DAffine3 { matrix3: DMat3::from_cols(right, dir.cross(right), dir), translation: eye };
    Some(to_world.inverse())
}

/// The map of normals under `m`: inverse transpose, up to length.
pub fn normal_matrix(m: &DAffine3) -> DMat3 {
    m.matrix3.inverse().transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: DVec3, b: [f64; 3]) {
        assert!((a - DVec3::from(b)).length() < 1e-12, "{a} {b:?}");
    }

    #[test]
    fn columns_put_the_translation_last() {
        let m = from_columns(&[0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1., 0., 5., 6., 7., 1.]).unwrap();
        near(m.transform_point3(DVec3::X), [5., 7., 7.]);
        assert!(from_columns(&[1., 0., 0., 0.5, 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]).is_none());
    }

    #[test]
    fn rotations_turn_the_right_way() {
        near(rotate(90.0, DVec3::Z).unwrap().transform_point3(DVec3::X), [0., 1., 0.]);
        near(rotate(-90.0, DVec3::X * 3.0).unwrap().transform_point3(DVec3::Y), [0., 0., -1.]);
        let s = 0.75f64.sqrt();
        near(rotate(30.0, DVec3::Y).unwrap().transform_point3(DVec3::Z), [0.5, 0., s]);
        assert!(rotate(1.0, DVec3::ZERO).is_none());
    }

    #[test]
    fn look_at_is_left_handed() {
        // From (0,0,-5) at the origin, y up: the camera axes are the world's, x stays right.
        let m = look_at(DVec3::new(0., 0., -5.), DVec3::ZERO, DVec3::Y).unwrap();
        near(m.transform_point3(DVec3::ZERO), [0., 0., 5.]);
        near(m.transform_vector3(DVec3::X), [1., 0., 0.]);
        // pbrt's classic: from (3,4,1.5) at (.5,.5,0), z up.
        let m = look_at(DVec3::new(3., 4., 1.5), DVec3::new(0.5, 0.5, 0.), DVec3::Z).unwrap();
        let d = (2.5f64 * 2.5 + 3.5 * 3.5 + 1.5 * 1.5).sqrt();
        near(m.transform_point3(DVec3::new(0.5, 0.5, 0.)), [0., 0., d]);
        assert!(m.transform_vector3(DVec3::Z).y > 0.9);
        assert!(look_at(DVec3::X, DVec3::X, DVec3::Z).is_none());
        assert!(look_at(DVec3::ZERO, DVec3::Z, DVec3::Z).is_none());
    }

    #[test]
    fn invertible_at_any_scale_singular_when_flat() {
        assert!(is_invertible(&DAffine3::from_scale(DVec3::splat(1e-9))));
        assert!(is_invertible(&DAffine3::from_scale(DVec3::new(1e-3, 1e5, -1.0))));
        assert!(!is_invertible(&DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0))));
        assert!(!is_invertible(&DAffine3::from_scale(DVec3::splat(f64::INFINITY))));
        let flat = DMat3::from_cols(DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 1e-14));
        assert!(!is_invertible(&DAffine3::from_mat3(flat)));
        assert!(mirrors(&DAffine3::from_scale(DVec3::new(-1.0, 1.0, 1.0))));
    }
}
