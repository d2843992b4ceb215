//! Flat outlines: what the piece of a plane that an image is seen through, or that shines, looks like.
//!
//! One triangle is its own outline; any other flat piece counts as the smallest rectangle around it, of a few turns.

use hemilux_scene::geom::Vec3;

/// A triangle or a parallelogram.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outline {
    /// m.
    pub corner: Vec3,
    /// The two sides from there (m).
    pub sides: [Vec3; 2],
    /// Whether it is the triangle between the sides, not the parallelogram.
    pub triangle: bool,
}

/// Turns that are tried for a rectangle.
const TURNS: u32 = 12;
/// What lies this far off the plane, against its extent, is not flat.
const FLAT: f32 = 1e-3;

/// What a rim adds: of a size, and of the coordinates.
pub const RIM: f32 = 1e-3;
pub const ROUNDING: f32 = 1e-6;

impl Outline {
    /// Around flat `triangles`; `None` if they are not flat, or have no area.
    pub fn around(triangles: &[[Vec3; 3]]) -> Option<Outline> {
        if let &[[a, b, c]] = triangles {
            let whole = Outline { corner: a, sides: [b - a, c - a], triangle: true };
            return (whole.area() > 0.0 && whole.area().is_finite()).then_some(whole);
        }
        let largest = triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a));
        let normal =
            largest.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))?.try_normalize()?;
        let corners = || triangles.iter().flatten();
        let count = 3.0 * triangles.len() as f32;
        let mean = corners().copied().sum::<Vec3>() / count;
        let extent = corners().map(|p| (*p - mean).length()).fold(0.0, f32::max);
        if corners().any(|p| (*p - mean).dot(normal).abs() > FLAT * extent) {
            return None;
        }
        let across = normal.any_orthonormal_vector();
        let up = normal.cross(across);
        let turned = |i: u32| {
            let (s, c) = (i as f32 * std::f32::consts::FRAC_PI_2 / TURNS as f32).sin_cos();
            rectangle(mean, [across * c + up * s, up * c - across * s], corners())
        };
        // Edges are likely sides of the smallest.
        let along = triangles.iter().take(TURNS as usize).filter_map(|[a, b, _]| {
            let u = (*b - *a).try_normalize()?;
            Some(rectangle(mean, [u, normal.cross(u)], corners()))
        });
        (0..TURNS)
            .map(turned)
            .chain(along)
            .filter(|o| o.area() > 0.0)
            .min_by(|a, b| a.area().total_cmp(&b.area()))
    }

    /// Moved by a map that keeps lines straight: `point` moves points, `vector` what lies between them.
    pub fn moved(&self, point: impl Fn(Vec3) -> Vec3, vector: impl Fn(Vec3) -> Vec3) -> Outline {
        Outline { corner: point(self.corner), sides: self.sides.map(vector), ..*self }
    }

    /// Its image in the plane through `p` with unit normal `n`.
    pub fn mirrored(&self, p: Vec3, n: Vec3) -> Outline {
        self.moved(|q| mirrored(q, p, n), |v| v - n * (2.0 * n.dot(v)))
    }

    /// A little larger all round, so that rounding hides no rim.
    pub fn with_rim(&self) -> Outline {
        let (centre, radius) = self.ball();
        let factor = 1.0 + RIM + ROUNDING * centre.abs().max_element() / radius;
        Outline {
            corner: centre + (self.corner - centre) * factor,
            sides: self.sides.map(|s| s * factor),
            ..*self
        }
    }

    /// m².
    pub fn area(&self) -> f32 {
        self.sides[0].cross(self.sides[1]).length() * if self.triangle { 0.5 } else { 1.0 }
    }

    /// Unit, or zero where it has no area.
    pub fn normal(&self) -> Vec3 {
        self.sides[0].cross(self.sides[1]).normalize_or_zero()
    }

    /// The point at `u` in [0, 1)², spread evenly (m).
    pub fn point(&self, [u, v]: [f32; 2]) -> Vec3 {
        let (u, v) = if self.triangle && u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        self.corner + self.sides[0] * u + self.sides[1] * v
    }

    /// The middle of its corners (m).
    #[inline]
    pub fn middle(&self) -> Vec3 {
        let [u, v] = self.sides;
        self.corner + (u + v) * if self.triangle { 1.0 / 3.0 } else { 0.5 }
    }

    /// That, and how far the farthest corner is from there (m).
    #[inline]
    pub fn ball(&self) -> (Vec3, f32) {
        let [u, v] = self.sides;
        let far2 = match self.triangle {
            true => {
                let middle = (u + v) / 3.0;
                let far2 = |corner: Vec3| (corner - middle).length_squared();
                middle.length_squared().max(far2(u)).max(far2(v))
            }
            false => 0.25 * (u + v).length_squared().max((u - v).length_squared()),
        };
        (self.middle(), far2.sqrt())
    }
}

/// The image of `q` in the plane through `p` with unit normal `n`.
pub fn mirrored(q: Vec3, p: Vec3, n: Vec3) -> Vec3 {
    q - n * (2.0 * n.dot(q - p))
}

fn rectangle<'a>(mean: Vec3, axes: [Vec3; 2], corners: impl Iterator<Item = &'a Vec3> + Clone) -> Outline {
    let [(low_u, high_u), (low_v, high_v)] = axes.map(|u| {
        let along = corners.clone().map(|p| u.dot(*p - mean));
        along.fold((f32::MAX, f32::MIN), |r, v| (r.0.min(v), r.1.max(v)))
    });
    Outline {
        corner: mean + axes[0] * low_u + axes[1] * low_v,
        sides: [axes[0] * (high_u - low_u), axes[1] * (high_v - low_v)],
        triangle: false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f32, y: f32, z: f32) -> Vec3 {
        Vec3::new(x, y, z)
    }

    #[test]
    fn a_turned_rectangle_of_two_triangles_is_found_exactly() {
        let (u, w) = (v(0.6, 0.8, 0.0) * 3.0, v(-0.8, 0.6, 0.0) * 0.5);
        let o = v(5.0, 1.0, 2.0);
        let both = [[o, o + u, o + u + w], [o, o + u + w, o + w]];
        let outline = Outline::around(&both).unwrap();
        assert!(!outline.triangle && (outline.area() - 1.5).abs() < 1e-5, "{outline:?}");
        let (middle, far) = outline.ball();
        assert!((middle - (o + (u + w) * 0.5)).length() < 1e-5);
        assert!((far - 0.5 * (u + w).length()).abs() < 1e-5);
    }

    #[test]
    fn one_triangle_is_itself_and_what_is_bent_is_nothing() {
        let t = [v(0.0, 0.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 1.0, 0.0)];
        let outline = Outline::around(&[t]).unwrap();
        assert!(outline.triangle && outline.area() == 1.0);
        assert_eq!(Outline::around(&[t, [t[1], v(2.0, 1.0, 0.4), t[2]]]), None);
        assert_eq!(Outline::around(&[[t[0], t[0], t[1]]]), None);
        assert_eq!(Outline::around(&[]), None);
    }

    #[test]
    fn mirrored_twice_it_is_itself() {
        let t =
            Outline { corner: v(1.0, 2.0, 3.0), sides: [v(1.0, 0.0, 0.5), v(0.0, 2.0, 0.0)], triangle: true };
        let (p, n) = (v(0.3, -1.0, 2.0), v(1.0, 2.0, -2.0) / 3.0);
        let once = t.mirrored(p, n);
        assert!((once.area() - t.area()).abs() < 1e-5 && (once.corner - t.corner).length() > 0.1);
        let twice = once.mirrored(p, n);
        assert!((twice.corner - t.corner).length() < 1e-5 && (twice.sides[0] - t.sides[0]).length() < 1e-5);
    }
}
