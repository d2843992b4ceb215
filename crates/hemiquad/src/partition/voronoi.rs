//! Voronoi cells, clipped to the square, as weights (A. Glassner, "Dynamic stratification", 1993; report, section 3.2).

use super::{Few, Partition, rectangle};
use crate::map::Uv;
use crate::points::{Key, jittered_f64};
use spade::handles::FixedVertexHandle;
use spade::{DelaunayTriangulation, Point2, Triangulation};

/// One cell per sample: all that lies nearer to it than to any other sample. Samples may be put anywhere. Areas are those of
/// the square cut by the bisectors towards the Delaunay neighbours, hence exact also at the border.
#[derive(Clone, Debug, Default)]
pub struct Voronoi {
    mesh: DelaunayTriangulation<Point2<f64>>,
    points: Vec<Uv<f64>>,
    areas: Vec<f64>,
    touched: Vec<u32>,
    polygon: Vec<Uv<f64>>,
    cut: Vec<Uv<f64>>,
}

impl Voronoi {
    /// Adds a sample from outside; false when it coincides with one that is there or is not a point of the square.
    pub fn insert(&mut self, p: Uv<f64>, near: Option<u32>) -> bool {
        self.touched.clear();
        if !self.add(p, near) {
            return false;
        }
        let new = self.points.len() - 1;
        self.touched.push(new as u32);
        for v in self.mesh.vertex(FixedVertexHandle::from_index(new)).out_edges() {
            self.touched.push(v.to().index() as u32);
        }
        for i in 0..self.touched.len() {
            let cell = self.touched[i];
            self.clip(cell);
            self.areas[cell as usize] = area_of(&self.polygon);
        }
        true
    }

    fn add(&mut self, p: Uv<f64>, near: Option<u32>) -> bool {
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
        if inserted.is_err() || self.mesh.num_vertices() == before {
            return false;
        }
        self.points.push(p);
        self.areas.push(0.0);
        true
    }

    /// Leaves the polygon of a cell in `self.polygon`.
    fn clip(&mut self, cell: u32) {
        let (mut polygon, mut cut) = (std::mem::take(&mut self.polygon), std::mem::take(&mut self.cut));
        self.clip_into(cell, &mut polygon, &mut cut);
        (self.polygon, self.cut) = (polygon, cut);
    }

    fn clip_into(&self, cell: u32, polygon: &mut Vec<Uv<f64>>, cut: &mut Vec<Uv<f64>>) {
        rectangle(Uv::new(0.0, 0.0), Uv::new(1.0, 1.0), polygon);
        let p = self.points[cell as usize];
        for edge in self.mesh.vertex(FixedVertexHandle::from_index(cell as usize)).out_edges() {
            let q = edge.to().position();
            // Keep x with (x - middle) · (q - p) ≤ 0.
            let (nu, nv) = (q.x - p.u, q.y - p.v);
            let limit = 0.5 * (nu * (q.x + p.u) + nv * (q.y + p.v));
            let side = |x: Uv<f64>| nu * x.u + nv * x.v - limit;
            cut.clear();
            for i in 0..polygon.len() {
                let (a, b) = (polygon[i], polygon[(i + 1) % polygon.len()]);
                let (sa, sb) = (side(a), side(b));
                if sa <= 0.0 {
                    cut.push(a);
                }
                if (sa < 0.0 && sb > 0.0) || (sa > 0.0 && sb < 0.0) {
                    let t = sa / (sa - sb);
                    cut.push(Uv::new(a.u + t * (b.u - a.u), a.v + t * (b.v - a.v)));
                }
            }
            std::mem::swap(polygon, cut);
        }
    }
}

fn area_of(polygon: &[Uv<f64>]) -> f64 {
    let Some(o) = polygon.first() else { return 0.0 };
    let twice: f64 =
        polygon.windows(2).map(|w| (w[0].u - o.u) * (w[1].v - o.v) - (w[1].u - o.u) * (w[0].v - o.v)).sum();
    0.5 * twice.abs()
}

impl Partition for Voronoi {
    /// About `n` jittered points.
    fn seed(&mut self, n: u32, key: Key) {
        self.mesh.clear();
        self.points.clear();
        self.areas.clear();
        let side = n.max(1).isqrt();
        for i in 0..side * side {
            let (x, y) = (i % side, i / side);
            let i = y * side + if y % 2 == 0 { x } else { side - 1 - x };
            self.add(jittered_f64(i, side, side, key), self.points.len().checked_sub(1).map(|x| x as u32));
        }
        self.touched.clear();
        for cell in 0..self.points.len() as u32 {
            self.clip(cell);
            self.areas[cell as usize] = area_of(&self.polygon);
            self.touched.push(cell);
        }
    }

    /// Adds a uniform sample of the cell.
    fn split(&mut self, cell: u32, key: Key) -> bool {
        if self.areas[cell as usize] < 1e-14 {
            return false;
        }
        self.clip(cell);
        let w = key.with(self.points.len() as u64);
        let mut left = w.uniform64(1) * area_of(&self.polygon);
        let o = self.polygon[0];
        for i in 1..self.polygon.len().saturating_sub(1) {
            let (a, b) = (self.polygon[i], self.polygon[i + 1]);
            let part = area_of(&[o, a, b]);
            if left <= part || i + 2 == self.polygon.len() {
                let r = w.uniform2_f64(0);
                let s = r.u.sqrt();
                let (k, l, m) = (1.0 - s, s * (1.0 - r.v), s * r.v);
                return self
                    .insert(Uv::new(k * o.u + l * a.u + m * b.u, k * o.v + l * a.v + m * b.v), Some(cell));
            }
            left -= part;
        }
        false
    }

    fn points(&self) -> &[Uv<f64>] {
        &self.points
    }

    fn cells(&self) -> u32 {
        self.points.len() as u32
    }

    fn is_cell(&self, cell: u32) -> bool {
        cell < self.cells()
    }

    fn area(&self, cell: u32) -> f64 {
        self.areas[cell as usize]
    }

    fn members(&self, cell: u32) -> Few {
        let mut few = Few::default();
        few.push(cell);
        few
    }

    fn neighbours(&self, cell: u32) -> Few {
        let mut few = Few::default();
        for v in self.mesh.vertex(FixedVertexHandle::from_index(cell as usize)).out_edges() {
            few.push(v.to().index() as u32);
        }
        few
    }

    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>) {
        self.clip_into(cell, polygon, &mut Vec::new());
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
    fn clipped_cells_tile_the_square_and_are_nearest_regions() {
        let mut d = Voronoi::default();
        d.seed(25, Key::new(1));
        for i in 0..200 {
            let cell = (Key::new(4).with(i).uniform64(0).powi(2) * d.cells() as f64) as u32;
            assert!(d.split(cell, Key::new(5)));
        }
        let area: f64 = (0..d.cells()).map(|c| d.area(c)).sum();
        assert!((area - 1.0).abs() < 1e-12, "{area}");
        // Against counting: 0.25 million lattice points to the nearest sample; the error is about the perimeter times the spacing.
        let n = 500;
        let mut count = vec![0u32; d.points().len()];
        for i in 0..n * n {
            let (u, v) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
            let distance = |p: &Uv<f64>| (p.u - u).powi(2) + (p.v - v).powi(2);
            let nearest = (0..count.len())
                .min_by(|a, b| distance(&d.points()[*a]).total_cmp(&distance(&d.points()[*b])));
            count[nearest.unwrap()] += 1;
        }
        for (c, k) in count.iter().enumerate() {
            let a = *k as f64 / (n * n) as f64;
            assert!(
                (a - d.area(c as u32)).abs() < 0.02 * a.sqrt() / 5.0 + 2e-5,
                "{c}: {a} {}",
                d.area(c as u32)
            );
        }
    }
}
