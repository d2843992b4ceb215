//! Ways to cut the unit square into cells that carry samples (report, section 3.2 and figure 3).
//!
//! | partition | cell | samples per cell | splitting |
//! | --- | --- | --- | --- |
//! | [`Grid`] | rectangle | 1 | never |
//! | [`QuadTree`] | square | 1 | into four |
//! | [`Voronoi`] | Voronoi cell of a sample, clipped to the square | 1 | a sample is added inside |
//! | [`Delaunay`] | triangle | 3 | a sample is added inside |
//! | [`Triangles`] | spherical triangle | 3 | the longest edge is halved |
//! | [`Regions`](crate::Shape) | given from outside | any | never |
//!
//! Samples keep their index for ever; cells come and go. Everything keeps its memory between calls.

#[cfg(feature = "delaunay")]
mod delaunay;
mod grid;
mod quadtree;
mod triangles;
#[cfg(feature = "delaunay")]
mod voronoi;

#[cfg(feature = "delaunay")]
pub use delaunay::Delaunay;
pub use grid::Grid;
pub use quadtree::{Cell, Parent, QuadTree};
pub use triangles::Triangles;
#[cfg(feature = "delaunay")]
pub use voronoi::Voronoi;

use crate::map::Uv;
use crate::points::Key;

/// A few cell numbers, without memory of its own.
#[derive(Clone, Copy, Debug, Default)]
pub struct Few {
    items: [u32; 16],
    len: u32,
}

impl Few {
    /// Adds a number unless it is there already or there is no more room.
    #[inline]
    pub fn push(&mut self, x: u32) {
        if (self.len as usize) < self.items.len() && !self.as_slice().contains(&x) {
            self.items[self.len as usize] = x;
            self.len += 1;
        }
    }

    /// Adds a number that is known not to be there, if there is room.
    #[inline]
    pub(crate) fn push_new(&mut self, x: u32) {
        if let Some(place) = self.items.get_mut(self.len as usize) {
            *place = x;
            self.len += 1;
        }
    }

    /// The numbers.
    #[inline]
    pub fn as_slice(&self) -> &[u32] {
        &self.items[..self.len as usize]
    }
}

/// A partition of the unit square that can be refined where a criterion asks for it.
pub trait Partition {
    /// Starts again with about `n` cells, keeping the memory; new samples are appended to [`Partition::points`].
    fn seed(&mut self, n: u32, key: Key);
    /// Splits a cell; returns false when it cannot be split. New samples are appended to [`Partition::points`].
    fn split(&mut self, cell: u32, key: Key) -> bool;
    /// All samples so far, in the order of their making. Samples that no cell refers to any more have lost their weight.
    fn points(&self) -> &[Uv<f64>];
    /// One more than the largest number of a cell.
    fn cells(&self) -> u32;
    /// Whether this number is a cell at present.
    fn is_cell(&self, cell: u32) -> bool;
    /// The area of a cell. All areas sum to one.
    fn area(&self, cell: u32) -> f64;
    /// The samples that speak for a cell; its integral is its area times their mean.
    fn members(&self, cell: u32) -> Few;
    /// The mean over a cell's samples of what `values` holds for them.
    fn mean(&self, cell: u32, values: &[f64]) -> f64 {
        let m = self.members(cell);
        m.as_slice().iter().map(|i| values[*i as usize]).sum::<f64>() / m.as_slice().len().max(1) as f64
    }
    /// Cells that touch this one along an edge (at most 16 of them).
    fn neighbours(&self, cell: u32) -> Few;
    /// Writes the boundary of a cell, a closed polygon on the square, into `polygon` (for drawing).
    fn outline(&self, cell: u32, polygon: &mut Vec<Uv<f64>>);
    /// The cells made or changed by the last call of `seed` or `split`.
    fn touched(&self) -> &[u32];
    /// Upper bound of the number of samples that one split adds.
    fn samples_per_split(&self) -> u32;
}

/// A polygon through the corners of a cell of the hemisphere is curved on the square: this many points per side.
const POINTS_PER_ARC: u32 = 8;

/// Writes a rectangle.
fn rectangle(low: Uv<f64>, high: Uv<f64>, polygon: &mut Vec<Uv<f64>>) {
    polygon.clear();
    polygon.extend([low, Uv::new(high.u, low.v), high, Uv::new(low.u, high.v)]);
}
