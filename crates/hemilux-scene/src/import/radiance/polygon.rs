//! Polygons to triangles: concave outlines, holes reached by a seam (an edge walked there and back), collinear and
//! repeated vertices.
//!
//! Ears are clipped (G. H. Meisters, "Polygons have ears", 1975) off the outline in the plane of Newell's normal. A seam
//! makes the outline touch itself; an ear is then rejected where an outline that passes through its tip would be cut
//! through. The triangles' areas add up to the polygon's.

use crate::geom::{DVec2, DVec3};

/// Steps after which ears are taken without looking for the vertices inside them: outlines of several thousand vertices.
const MAX_WORK: usize = 400_000_000;

/// Newell's area vector: normal to the polygon, as long as its area.
pub fn area_vector(p: &[DVec3]) -> DVec3 {
    let Some(&origin) = p.first() else { return DVec3::ZERO };
    // Relative to a vertex: far from the origin the products would lose their digits.
    let mut sum = DVec3::ZERO;
    for i in 0..p.len() {
        sum += (p[i] - origin).cross(p[(i + 1) % p.len()] - origin);
    }
    sum * 0.5
}

/// Greatest distance of a vertex from the mean plane, relative to the polygon's size.
pub fn out_of_plane(p: &[DVec3], normal: DVec3) -> f64 {
    let centre = p.iter().sum::<DVec3>() / p.len().max(1) as f64;
    let size = p.iter().map(|v| (*v - centre).length()).fold(0.0, f64::max);
    let off = p.iter().map(|v| (*v - centre).dot(normal).abs()).fold(0.0, f64::max);
    if size > 0.0 { off / size } else { 0.0 }
}

fn cross(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - a)
}

/// Triangles of the polygon as indices of its vertices, counter-clockwise around `area` (of [`area_vector`]). None of
/// them is degenerate beyond rounding. Empty if the polygon has no area.
pub fn triangulate(p: &[DVec3], area: DVec3) -> Vec<[u32; 3]> {
    let Some(normal) = area.try_normalize() else { return Vec::new() };
    if p.len() == 3 {
        return vec![[0, 1, 2]];
    }
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let flat: Vec<DVec2> = p.iter().map(|q| DVec2::new((*q - p[0]).dot(u), (*q - p[0]).dot(v))).collect();
    let size2 = flat.iter().map(|q| q.length_squared()).fold(0.0, f64::max);
    let mut outline = Outline { flat, eps: 1e-13 * size2, next: Vec::new(), work: 0 };
    outline.next = outline.cleaned();
    if outline.is_convex() {
        let n = &outline.next;
        let fan = (1..n.len().saturating_sub(1)).map(|i| [n[0] as u32, n[i] as u32, n[i + 1] as u32]);
        return fan.collect();
    }
    outline.clip()
}

/// What is left of the polygon.
struct Outline {
    flat: Vec<DVec2>,
    /// Twice an area that counts as none.
    eps: f64,
    /// Vertices in order.
    next: Vec<usize>,
    work: usize,
}

impl Outline {
    /// The vertices without those that repeat their predecessor.
    fn cleaned(&self) -> Vec<usize> {
        let mut list: Vec<usize> = Vec::with_capacity(self.flat.len());
        for i in 0..self.flat.len() {
            if list.last().is_none_or(|&j| self.flat[j] != self.flat[i]) {
                list.push(i);
            }
        }
        while list.len() > 1 && self.flat[list[0]] == self.flat[list[list.len() - 1]] {
            list.pop();
        }
        list
    }

    fn corner(&self, i: usize) -> [DVec2; 3] {
        let n = self.next.len();
        [self.flat[self.next[(i + n - 1) % n]], self.flat[self.next[i]], self.flat[self.next[(i + 1) % n]]]
    }

    /// Every turn left, once around.
    fn is_convex(&self) -> bool {
        let mut turn = 0.0;
        for i in 0..self.next.len() {
            let [a, b, c] = self.corner(i);
            if cross(a, b, c) <= self.eps {
                return false;
            }
            turn += (b - a).angle_to(c - b);
        }
        turn < 1.5 * std::f64::consts::TAU
    }

    fn clip(mut self) -> Vec<[u32; 3]> {
        let mut triangles = Vec::with_capacity(self.next.len());
        let mut at = 0;
        let mut unsettled = self.next.len();
        while self.next.len() > 2 {
            let n = self.next.len();
            at %= n;
            // Corners without area go first; later ones arise only beside a corner that went.
            if unsettled > 0 {
                if self.is_straight(at) {
                    self.next.remove(at);
                    (at, unsettled) = ((at + n - 2) % (n - 1), unsettled.max(2));
                } else {
                    (at, unsettled) = (at + 1, unsettled - 1);
                }
                continue;
            }
            let Some(i) = self.next_ear(at) else { break };
            triangles.push(self.triangle(i));
            self.next.remove(i);
            (at, unsettled) = ((i + n - 2) % (n - 1), 2);
        }
        triangles
    }

    fn triangle(&self, i: usize) -> [u32; 3] {
        let n = self.next.len();
        [(i + n - 1) % n, i, (i + 1) % n].map(|k| self.next[k] as u32)
    }

    /// The next vertex from `from` on that may go: an ear, an ear in looser terms, any convex one.
    fn next_ear(&mut self, from: usize) -> Option<usize> {
        let n = self.next.len();
        // Two steps on, so that triangles do not all fan out from one vertex.
        let order = move || (0..n).map(move |k| (from + 2 + k) % n);
        for strict in [true, false] {
            for i in order() {
                if self.work >= MAX_WORK {
                    break;
                }
                if self.is_ear(i, strict) {
                    return Some(i);
                }
            }
        }
        let convex = |i: &usize| {
            let [a, b, c] = self.corner(*i);
            cross(a, b, c) > self.eps
        };
        order().find(convex)
    }

    /// Whether the corner has no area: it repeats a neighbour, lies between them, or is the tip of a spike.
    fn is_straight(&self, i: usize) -> bool {
        let [a, b, c] = self.corner(i);
        cross(a, b, c).abs() <= self.eps
    }

    fn is_ear(&mut self, i: usize, strict: bool) -> bool {
        let [a, b, c] = self.corner(i);
        if cross(a, b, c) <= self.eps {
            return false;
        }
        let n = self.next.len();
        self.work += n;
        for k in 2..n - 1 {
            let j = (i + k) % n;
            let [before, q, after] = self.corner(j);
            let (ab, bc, ca) = (cross(a, b, q), cross(b, c, q), cross(c, a, q));
            if ab < 0.0 || bc < 0.0 || ca < 0.0 {
                continue;
            }
            if !strict {
                // Strictly inside, or on the cut.
                if ab > 0.0 && bc > 0.0 {
                    return false;
                }
                continue;
            }
            if q == a || q == c {
                // Touches an end of the cut: whatever leaves from there into the ear is found by its other end.
                continue;
            }
            if q == b {
                // Passes through the tip: an edge from there into the ear would be cut.
                let enters = |w: DVec2| cross(a, b, w) > 0.0 && cross(b, c, w) > 0.0;
                if enters(before) || enters(after) {
                    return false;
                }
                continue;
            }
            return false;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lift(points: &[[f64; 2]]) -> Vec<DVec3> {
        // Into a plane that is not parallel to any axis, far away from the origin.
        let (u, v) = (DVec3::new(1.0, 2.0, -0.5).normalize(), DVec3::new(2.0, -1.0, 0.0).normalize());
        points.iter().map(|p| DVec3::new(30.0, -20.0, 7.0) + u * p[0] + v * p[1]).collect()
    }

    /// Area of the triangles and of the polygon; every triangle must face the polygon's way.
    fn areas(p: &[DVec3]) -> (f64, f64, usize) {
        let area = area_vector(p);
        let triangles = triangulate(p, area);
        let mut sum = 0.0;
        for t in &triangles {
            let [a, b, c] = t.map(|i| p[i as usize]);
            let n = (b - a).cross(c - a) * 0.5;
            assert!(n.dot(area) > 0.0, "a triangle faces away");
            sum += n.length();
        }
        (sum, area.length(), triangles.len())
    }

    fn exact(points: &[[f64; 2]], expected: f64) {
        for reversed in [false, true] {
            for shift in 0..points.len() {
                let mut list = points.to_vec();
                list.rotate_left(shift);
                if reversed {
                    list.reverse();
                }
                let (sum, area, _) = areas(&lift(&list));
                assert!((area - expected).abs() < 1e-9 * expected.max(1.0), "{area} {expected}");
                assert!(
                    (sum - area).abs() < 1e-9 * area,
                    "{sum} of {area}, shift {shift}, {reversed}, {list:?}"
                );
            }
        }
    }

    #[test]
    fn convex_concave_collinear_and_repeated() {
        exact(&[[0., 0.], [2., 0.], [2., 1.], [0., 1.]], 2.0);
        exact(&[[0., 0.], [3., 0.], [3., 1.], [1., 1.], [1., 2.], [3., 2.], [3., 3.], [0., 3.]], 7.0);
        exact(&[[0., 0.], [1., 0.], [2., 0.], [2., 1.], [2., 1.], [1., 1.], [0., 1.], [0., 0.5]], 2.0);
        // An arrow and a spike that goes nowhere.
        exact(&[[0., 0.], [2., 1.], [0., 2.], [1., 1.]], 1.0);
        exact(&[[0., 0.], [2., 0.], [2., 2.], [3., 2.], [2., 2.], [0., 2.]], 4.0);
    }

    #[test]
    fn holes_by_a_seam() {
        // A square of 4 with a square hole of 1, the seam from corner to corner.
        let square = [
            [0., 0.],
            [4., 0.],
            [4., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 2.],
            [2., 2.],
            [2., 1.],
            [1., 1.],
        ];
        exact(&square, 15.0);
        // The seam from the middle of an edge; two holes, one behind the other.
        let two = [
            [0., 0.],
            [6., 0.],
            [6., 1.],
            [5., 1.],
            [4., 1.],
            [4., 2.],
            [5., 2.],
            [5., 1.],
            [6., 1.],
            [6., 4.],
            [3., 4.],
            [3., 3.],
            [3., 2.],
            [2., 2.],
            [2., 3.],
            [3., 3.],
            [3., 4.],
            [0., 4.],
        ];
        exact(&two, 22.0);
        let both = [
            [0., 0.],
            [8., 0.],
            [8., 4.],
            [0., 4.],
            [0., 0.],
            [1., 1.],
            [1., 3.],
            [3., 3.],
            [3., 2.],
            [5., 2.],
            [5., 3.],
            [6., 3.],
            [6., 1.],
            [5., 1.],
            [5., 2.],
            [3., 2.],
            [3., 1.],
            [1., 1.],
        ];
        exact(&both, 32.0 - 4.0 - 2.0);
    }

    fn signed(p: &[[f64; 2]]) -> f64 {
        let n = p.len();
        (0..n).map(|i| p[i][0] * p[(i + 1) % n][1] - p[(i + 1) % n][0] * p[i][1]).sum::<f64>() * 0.5
    }

    #[test]
    fn a_round_window_in_a_star() {
        // A ring of 64 vertices around a circle of 64, joined by a seam.
        let mut ring = Vec::new();
        let n = 64;
        let at = |i: usize, r: f64| {
            let a = i as f64 / n as f64 * std::f64::consts::TAU;
            [r * a.cos(), r * a.sin()]
        };
        for i in 0..=n {
            ring.push(at(i % n, if i % 2 == 0 { 3.0 } else { 2.0 }));
        }
        for i in (0..=n).rev() {
            ring.push(at(i % n, 1.0));
        }
        let expected = signed(&ring);
        let (sum, area, count) = areas(&lift(&ring));
        assert!((sum - expected).abs() < 1e-9 && (area - expected).abs() < 1e-9);
        assert_eq!(count, 2 * n);
    }

    #[test]
    fn nothing_comes_of_nothing() {
        for flat in [&lift(&[[0., 0.], [1., 0.], [2., 0.]])[..], &lift(&[[0., 0.]; 5])[..]] {
            assert!(triangulate(flat, area_vector(flat)).len() <= 1);
            assert!(area_vector(flat).length() < 1e-12);
        }
    }

    #[test]
    fn planes_are_checked_relative_to_size() {
        let mut p = lift(&[[0., 0.], [2., 0.], [2., 2.], [0., 2.]]);
        let n = area_vector(&p).normalize();
        assert!(out_of_plane(&p, n) < 1e-12);
        p[2] += n * 0.2;
        let n = area_vector(&p).normalize();
        assert!(out_of_plane(&p, n) > 0.02);
    }
}
