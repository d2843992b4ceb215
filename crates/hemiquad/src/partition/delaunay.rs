//! The Delaunay triangulation of the samples (report, section 3.2): three samples and at most three neighbours per cell,
//! values interpolated linearly. Built on `spade`, whose memory is reused.

use super::{Few, Partition};
use crate::map::Uv;
use crate::points::{Key, jittered_f64};
use spade::handles::{FixedFaceHandle, FixedVertexHandle, InnerTag};
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// Delaunay triangles over the square. Its four corners are samples, so that the triangles tile it.
#[derive(Clone, Debug, Default)]
pub struct Delaunay {
    mesh: DelaunayTriangulation<Point2<f64>>,
    points: Vec<Uv<f64>>,
    faces: Vec<Option<FixedFaceHandle<InnerTag>>>,
    touched: Vec<u32>,
}

impl Delaunay {
    /// Adds a sample from outside; false when it coincides with one that is there or is not a point of the square. Its
    /// triangles are in [`Partition::touched`].
    pub fn insert(&mut self, p: Uv<f64>, near: Option<u32>) -> bool {
        self.touched.clear();
        if !((0.0..=1.0).contains(&p.u) && (0.0..=1.0).contains(&p.v)) {
            return false;
        }
        let before = self.mesh.num_vertices();
        let at = Point2::new(p.u, p.v);
        let inserted = match near {
            Some(v) if (v as usize) < before => {
                self.mesh.insert_with_hint(at, FixedVertexHandle::from_index(v as usize))
            }
            _ => self.mesh.insert(at),
        };
        let Ok(vertex) = inserted else { return false };
        if self.mesh.num_vertices() == before {
            return false;
        }
        self.points.push(p);
        for edge in self.mesh.vertex(vertex).out_edges() {
            if let Some(face) = edge.face().as_inner() {
                let i = face.index();
                if self.faces.len() <= i {
                    self.faces.resize(i + 1, None);
                }
                self.faces[i] = Some(face.fix());
                self.touched.push(i as u32);
            }
        }
        true
    }

    fn corners(&self, cell: u32) -> Option<[(u32, Uv<f64>); 3]> {
        let face = self.mesh.face((*self.faces.get(cell as usize)?)?);
        Some(face.vertices().map(|v| (v.index() as u32, Uv::new(v.position().x, v.position().y))))
    }
}

impl Partition for Delaunay {
    /// The corners and about `n` - 4 jittered points.
    fn seed(&mut self, n: u32, key: Key) {
        self.mesh.clear();
        self.points.clear();
        self.faces.clear();
        for (u, v) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            self.insert(Uv::new(u, v), None);
        }
        let side = n.saturating_sub(4).isqrt();
        for i in 0..side * side {
            // Boustrophedon, so that every point is near the one before.
            let (x, y) = (i % side, i / side);
            let i = y * side + if y % 2 == 0 { x } else { side - 1 - x };
            self.insert(jittered_f64(i, side, side, key), self.points.len().checked_sub(1).map(|x| x as u32));
        }
        // Faces made before the corners were complete are known by number only.
        self.faces.clear();
        self.touched.clear();
        for face in self.mesh.fixed_inner_faces() {
            let i = face.index();
            if self.faces.len() <= i {
                self.faces.resize(i + 1, None);
            }
            self.faces[i] = Some(face);
            self.touched.push(i as u32);
        }
    }

    /// Adds a sample inside the triangle, half-way between its centre and a uniform point.
    fn split(&mut self, cell: u32, key: Key) -> bool {
        let Some([(a, p), (_, q), (_, r)]) = self.corners(cell) else { return false };
        if self.area(cell) < 1e-14 {
            return false;
        }
        let w = key.with(self.points.len() as u64).uniform2_f64(0);
        let s = w.u.sqrt();
        let third = 1.0 / 3.0;
        let (k, l) = (0.5 * (1.0 - s) + 0.5 * third, 0.5 * s * (1.0 - w.v) + 0.5 * third);
        let m = 1.0 - k - l;
        self.insert(Uv::new(k * p.u + l * q.u + m * r.u, k * p.v + l * q.v + m * r.v), Some(a))
    }

    fn points(&self) -> &[Uv<f64>] {
        &self.points
    }

    fn cells(&self) -> u32 {
        self.faces.len() as u32
    }

    fn is_cell(&self, cell: u32) -> bool {
        self.faces.get(cell as usize).is_some_and(|f| f.is_some())
    }

    fn area(&self, cell: u32) -> f64 {
        let Some([(_, p), (_, q), (_, r)]) = self.corners(cell) else { return 0.0 };
        0.5 * ((q.u - p.u) * (r.v - p.v) - (r.u - p.u) * (q.v - p.v)).abs()
    }

    fn members(&self, cell: u32) -> Few {
        let mut few = Few::default();
        if let Some(c) = self.corners(cell) {
            c.iter().for_each(|(i, _)| few.push(*i));
        }
        few
    }

    fn neighbours(&self, cell: u32) -> Few {
        let mut few = Few::default();
        if let Some(Some(face)) = self.faces.get(cell as usize) {
            for edge in self.mesh.face(*face).adjacent_edges() {
                if let Some(other) = edge.rev().face().as_inner() {
                    few.push(other.index() as u32);
                }
            }
        }
        few
    }

    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>) {
        polygon.clear();
        polygon.extend(self.corners(cell).into_iter().flatten().map(|c| c.1));
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
    fn triangles_tile_the_square_after_any_splits() {
        let mut d = Delaunay::default();
        for round in 0..2u64 {
            d.seed(64, Key::new(round));
            for i in 0..300 {
                let cell = (Key::new(4).with(i).uniform64(0).powi(2) * d.cells() as f64) as u32;
                d.split(cell, Key::new(5));
            }
            let area: f64 = (0..d.cells()).map(|c| d.area(c)).sum();
            assert!((area - 1.0).abs() < 1e-12, "{area}");
            assert_eq!(d.points().len() as u32 * 2 - 2 - 4, d.cells() - 1);
            // Number 0 is the outer face.
            assert!(!d.is_cell(0));
            assert!((1..d.cells()).all(|c| d.members(c).as_slice().len() == 3 && d.is_cell(c)));
        }
    }
}
