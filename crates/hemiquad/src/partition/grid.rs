//! A regular grid with one jittered sample per cell: never refined.

use super::{Few, Partition, rectangle};
use crate::map::Uv;
use crate::points::{Key, jittered_f64};

/// A regular grid of about square cells.
#[derive(Clone, Debug, Default)]
pub struct Grid {
    nx: u32,
    ny: u32,
    points: Vec<Uv<f64>>,
    touched: Vec<u32>,
}

impl Partition for Grid {
    /// ⌊√n⌋ columns and as many whole rows as fit.
    fn seed(&mut self, n: u32, key: Key) {
        let n = n.max(1);
        self.nx = n.isqrt();
        self.ny = n / self.nx;
        self.points.clear();
        self.touched.clear();
        for i in 0..self.nx * self.ny {
            self.points.push(jittered_f64(i, self.nx, self.ny, key));
            self.touched.push(i);
        }
    }

    fn split(&mut self, _: u32, _: Key) -> bool {
        false
    }

    fn points(&self) -> &[Uv<f64>] {
        &self.points
    }

    fn cells(&self) -> u32 {
        self.nx * self.ny
    }

    fn is_cell(&self, cell: u32) -> bool {
        cell < self.cells()
    }

    fn area(&self, _: u32) -> f64 {
        1.0 / self.cells().max(1) as f64
    }

    fn members(&self, cell: u32) -> Few {
        let mut few = Few::default();
        few.push(cell);
        few
    }

    fn neighbours(&self, cell: u32) -> Few {
        let (x, y) = (cell % self.nx.max(1), cell / self.nx.max(1));
        let mut few = Few::default();
        if x > 0 {
            few.push(cell - 1);
        }
        if x + 1 < self.nx {
            few.push(cell + 1);
        }
        if y > 0 {
            few.push(cell - self.nx);
        }
        if y + 1 < self.ny {
            few.push(cell + self.nx);
        }
        few
    }

    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>) {
        let at = |x: u32, y: u32| Uv::new(x as f64 / self.nx as f64, y as f64 / self.ny as f64);
        let (x, y) = (cell % self.nx, cell / self.nx);
        rectangle(at(x, y), at(x + 1, y + 1), polygon);
    }

    fn touched(&self) -> &[u32] {
        &self.touched
    }

    fn samples_per_split(&self) -> u32 {
        0
    }
}
