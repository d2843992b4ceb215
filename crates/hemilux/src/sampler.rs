//! The random numbers of one camera sample, by address (seed, pixel, pass, dimension).
//!
//! Early dimensions are Owen-scrambled Sobol' points whose index is the pass, so a pixel's passes are stratified
//! against one another; later ones are plain hashes. Nothing depends on threads or order.

use hemiquad::points::{Key, jittered, sobol};

/// Dimensions beyond this are hashed: stratification no longer pays for them.
const SOBOL_DIMENSIONS: u32 = 24;

/// Hands out the dimensions of one camera sample in order.
#[derive(Clone, Debug)]
pub struct Sampler {
    pixel: Key,
    sample: Key,
    pass: u32,
    dimension: u32,
}

/// A set of points that one gather takes at once.
#[derive(Clone, Copy, Debug)]
pub enum PointSet {
    /// One point in each of as many cells of a grid as are asked for, random within them, from a random cell on:
    /// so every single point is uniform over the square even where the grid is larger than the set.
    Jittered {
        /// Cells across and down.
        grid: [u32; 2],
        /// Cell of point 0.
        offset: u32,
        /// Address.
        key: Key,
    },
    /// A block of an Owen-scrambled Sobol' sequence that continues from pass to pass.
    Sobol {
        /// First index.
        first: u32,
        /// Address, the same for all passes.
        key: Key,
    },
}

impl PointSet {
    /// The `i`-th point.
    #[inline]
    pub fn point(&self, i: u32) -> [f32; 2] {
        let uv = match *self {
            PointSet::Jittered { grid, offset, key } => {
                jittered((i + offset) % (grid[0] * grid[1]), grid[0], grid[1], key)
            }
            PointSet::Sobol { first, key } => sobol(first.wrapping_add(i), key),
        };
        [uv.u, uv.v]
    }
}

impl Sampler {
    /// The sample of `pixel` (any unique number) in `pass`.
    #[inline]
    pub fn new(seed: u64, pixel: u64, pass: u32) -> Sampler {
        let pixel = Key::new(seed).with(pixel);
        Sampler { pixel, sample: pixel.with(0x5a_0000_0000 | pass as u64), pass, dimension: 0 }
    }

    /// The next two dimensions, in [0, 1)².
    #[inline]
    pub fn next2(&mut self) -> [f32; 2] {
        let d = self.dimension;
        self.dimension += 1;
        let uv = if d < SOBOL_DIMENSIONS {
            sobol(self.pass, self.pixel.with(d as u64))
        } else {
            self.sample.uniform2(d)
        };
        [uv.u, uv.v]
    }

    /// The next dimension, in [0, 1).
    #[inline]
    pub fn next1(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension += 1;
        if d < SOBOL_DIMENSIONS {
            sobol(self.pass, self.pixel.with(d as u64)).u
        } else {
            self.sample.uniform(d)
        }
    }

    /// `n` points for a gather; `stratified` in a grid of this pass alone, else Sobol' across passes.
    #[inline]
    pub fn set(&mut self, n: u32, grid: bool) -> PointSet {
        let d = self.dimension;
        self.dimension += 1;
        if grid {
            let columns = (n as f32).sqrt().ceil() as u32;
            let rows = n.div_ceil(columns.max(1));
            let grid = [columns.max(1), rows.max(1)];
            let key = self.sample.with(d as u64);
            let cells = grid[0] * grid[1];
            let offset = ((key.uniform(1) * cells as f32) as u32).min(cells - 1);
            PointSet::Jittered { grid, offset, key }
        } else {
            PointSet::Sobol { first: self.pass.wrapping_mul(n), key: self.pixel.with(d as u64) }
        }
    }

    /// An address below this sample for whoever makes points of their own.
    #[inline]
    pub fn key(&mut self) -> Key {
        let d = self.dimension;
        self.dimension += 1;
        self.sample.with(d as u64)
    }

    /// An independent stream below this sample, for the `i`-th gather ray.
    #[inline]
    pub fn branch(&self, i: u32) -> Sampler {
        let key = self.sample.with((self.dimension as u64) << 32 | i as u64);
        // Hashed throughout: the gather's own points carry the stratification.
        Sampler { pixel: key, sample: key, pass: 0, dimension: SOBOL_DIMENSIONS }
    }
}
