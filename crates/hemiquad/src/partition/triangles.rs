//! Triangles on the hemisphere: M. Beyer and B. Lange, "Rayvolution: an evolutionary ray tracing program", 1994, in its
//! geometric part. Rays are the vertices of a triangulation of the hemisphere; triangles are refined where the rays differ.

use super::{Few, POINTS_PER_ARC, Partition};
use crate::map::{Concentric, Dir, Map, Uv};
use crate::points::Key;
use std::f64::consts::PI;

const NONE: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Triangle {
    /// Vertices, counter-clockwise seen from outside.
    v: [u32; 3],
    /// The neighbour across the edge opposite each vertex.
    n: [u32; 3],
    area: f64,
}

/// A conforming triangulation of the hemisphere; splitting a triangle halves its longest edge, and with it the neighbour's.
/// Areas are exact spherical excesses over 2π.
#[derive(Clone, Debug, Default)]
pub struct Triangles {
    dirs: Vec<Dir<f64>>,
    points: Vec<Uv<f64>>,
    triangles: Vec<Triangle>,
    touched: Vec<u32>,
}

impl Triangles {
    fn vertex(&mut self, d: Dir<f64>) -> u32 {
        self.dirs.push(d);
        self.points.push(Concentric.uv(d).unwrap_or(Uv::new(0.5, 0.5)));
        self.dirs.len() as u32 - 1
    }

    /// Solid angle over 2π (A. van Oosterom and J. Strackee 1983).
    fn measure(&self, v: [u32; 3]) -> f64 {
        let [a, b, c] = v.map(|i| self.dirs[i as usize]);
        let triple =
            a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
        2.0 * triple.abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a)) / (2.0 * PI)
    }

    fn relink(&mut self, cell: u32, old: u32, new: u32) {
        if cell != NONE {
            for n in &mut self.triangles[cell as usize].n {
                if *n == old {
                    *n = new;
                }
            }
        }
    }

    /// Halves the triangle `t` at vertex `m` on the edge opposite its `i`-th vertex: `t` keeps the first half (apex, a, m), the
    /// new triangle is (apex, m, b). The neighbours across a–m and m–b are left for the caller.
    fn halve(&mut self, t: u32, i: usize, m: u32) -> u32 {
        let Triangle { v, n, .. } = self.triangles[t as usize];
        let (c, a, b) = (v[i], v[(i + 1) % 3], v[(i + 2) % 3]);
        // Opposite a lies the edge b–c, opposite b the edge c–a.
        let (across_bc, across_ca) = (n[(i + 1) % 3], n[(i + 2) % 3]);
        let new = self.triangles.len() as u32;
        let first = [c, a, m];
        let second = [c, m, b];
        self.triangles[t as usize] =
            Triangle { v: first, n: [NONE, new, across_ca], area: self.measure(first) };
        self.triangles.push(Triangle { v: second, n: [NONE, across_bc, t], area: self.measure(second) });
        self.relink(across_bc, t, new);
        new
    }
}

impl Partition for Triangles {
    /// A pyramid of four triangles, turned at random about the normal, with its largest triangles halved until there are `n`
    /// vertices.
    fn seed(&mut self, n: u32, key: Key) {
        self.dirs.clear();
        self.points.clear();
        self.triangles.clear();
        let pole = self.vertex(Dir::from_unit(0.0, 0.0, 1.0));
        let turn = key.uniform64(0) * 2.0 * PI;
        for k in 0..4 {
            let (s, c) = (turn + k as f64 * PI / 2.0).sin_cos();
            self.vertex(Dir::from_unit(c, s, 0.0));
        }
        for k in 0..4u32 {
            let v = [pole, 1 + k, 1 + (k + 1) % 4];
            let t = Triangle { v, n: [NONE, (k + 1) % 4, (k + 3) % 4], area: self.measure(v) };
            self.triangles.push(t);
        }
        while (self.points.len() as u32) < n {
            let largest = self.triangles.iter().fold(0f64, |m, t| m.max(t.area));
            for t in 0..self.triangles.len() as u32 {
                if (self.points.len() as u32) < n && self.triangles[t as usize].area > 0.6 * largest {
                    self.split(t, key);
                }
            }
        }
        self.touched.clear();
        self.touched.extend(0..self.triangles.len() as u32);
    }

    fn split(&mut self, cell: u32, key: Key) -> bool {
        let t = self.triangles[cell as usize];
        let length =
            |i: usize| self.dirs[t.v[(i + 1) % 3] as usize].dot(self.dirs[t.v[(i + 2) % 3] as usize]);
        // The longest edge has the smallest cosine.
        let i = (0..3).min_by(|a, b| length(*a).total_cmp(&length(*b))).unwrap_or(0);
        let (a, b) = (t.v[(i + 1) % 3], t.v[(i + 2) % 3]);
        let (p, q) = (self.dirs[a as usize], self.dirs[b as usize]);
        if t.area < 1e-14 {
            return false;
        }
        // Not quite in the middle: the rays are random, as in a population.
        let w = 0.5 + 0.4 * (key.with(self.points.len() as u64).uniform64(0) - 0.5);
        let on_horizon = p.z == 0.0 && q.z == 0.0;
        let z = if on_horizon { 0.0 } else { (1.0 - w) * p.z + w * q.z };
        let Some(d) = Dir::normalize((1.0 - w) * p.x + w * q.x, (1.0 - w) * p.y + w * q.y, z) else {
            return false;
        };
        let m = self.vertex(d);
        let other = t.n[i];
        let t2 = self.halve(cell, i, m);
        self.touched.clear();
        self.touched.extend([cell, t2]);
        if other != NONE {
            let o = self.triangles[other as usize];
            // The edge runs the other way round in the neighbour, whose vertices are (d, b, a).
            let j = (0..3).find(|&j| o.v[j] != a && o.v[j] != b).unwrap_or(0);
            let o2 = self.halve(other, j, m);
            // other = (d, b, m) faces t2 = (c, m, b); o2 = (d, m, a) faces cell = (c, a, m).
            self.triangles[other as usize].n[0] = t2;
            self.triangles[t2 as usize].n[0] = other;
            self.triangles[o2 as usize].n[0] = cell;
            self.triangles[cell as usize].n[0] = o2;
            self.touched.extend([other, o2]);
        }
        true
    }

    fn points(&self) -> &[Uv<f64>] {
        &self.points
    }

    fn cells(&self) -> u32 {
        self.triangles.len() as u32
    }

    fn is_cell(&self, cell: u32) -> bool {
        cell < self.cells()
    }

    fn area(&self, cell: u32) -> f64 {
        self.triangles[cell as usize].area
    }

    fn members(&self, cell: u32) -> Few {
        let mut few = Few::default();
        self.triangles[cell as usize].v.iter().for_each(|&v| few.push(v));
        few
    }

    fn neighbours(&self, cell: u32) -> Few {
        let mut few = Few::default();
        self.triangles[cell as usize].n.iter().filter(|n| **n != NONE).for_each(|&n| few.push(n));
        few
    }

    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>) {
        polygon.clear();
        let corners = self.triangles[cell as usize].v.map(|v| self.dirs[v as usize]);
        for i in 0..3 {
            let (p, q) = (corners[i], corners[(i + 1) % 3]);
            for k in 0..POINTS_PER_ARC {
                let w = k as f64 / POINTS_PER_ARC as f64;
                let mix = |a: f64, b: f64| (1.0 - w) * a + w * b;
                let d = Dir::normalize(mix(p.x, q.x), mix(p.y, q.y), mix(p.z, q.z));
                polygon.extend(d.and_then(|d| Concentric.uv(d)));
            }
        }
    }

    fn touched(&self) -> &[u32] {
        &self.touched
    }

    fn samples_per_split(&self) -> u32 {
        1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_tile_the_hemisphere_and_conform() {
        let mut t = Triangles::default();
        t.seed(50, Key::new(3));
        for i in 0..300 {
            let cell = (Key::new(4).with(i).uniform64(0).powi(3) * t.cells() as f64) as u32;
            assert!(t.split(cell, Key::new(5)));
        }
        let area: f64 = (0..t.cells()).map(|c| t.area(c)).sum();
        assert!((area - 1.0).abs() < 1e-12, "{area}");
        assert_eq!(t.points().len(), 350);
        for c in 0..t.cells() {
            for &n in t.neighbours(c).as_slice() {
                assert!(t.neighbours(n).as_slice().contains(&c));
                let (mine, other) = (t.members(c), t.members(n));
                let shared = mine.as_slice().iter().filter(|v| other.as_slice().contains(v)).count();
                assert_eq!(shared, 2);
            }
        }
        assert!(t.dirs.iter().all(|d| d.z >= 0.0));
    }
}
