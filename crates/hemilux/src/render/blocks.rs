//! Which pixels of a picture are computed together, because they share residuals ([`crate::gather`]).
//!
//! Invariants: the blocks of a square hold each of its pixels once; they depend on the square's place in the whole picture and on the deal alone, so
//! a part of a picture has the bits of the whole.

use hemiquad::points::Key;

/// Pixels that are computed together. Where they share residuals: one of each cell of [`CELL`] × [`CELL`] pixels of a square of [`SQUARE`] × [`SQUARE`],
/// dealt anew for each pass, so that what they have in common shows as noise and not as a pattern.
pub(super) struct Block {
    /// Upper left.
    at: [u32; 2],
    /// Which of the pixels of a cell, and by which deal; `None`: one pixel alone.
    dealt: Option<(u32, u32)>,
    size: [u32; 2],
}

/// Pixels across and down of what shares residuals in several blocks; divides the edge of a tile.
pub(super) const SQUARE: u32 = 8;
/// And of the cells each of which gives one to each block.
pub(super) const CELL: u32 = 2;

impl Block {
    /// One pixel of a picture of `size`.
    pub(super) fn pixel(at: [u32; 2], size: [u32; 2]) -> Block {
        Block { at, dealt: None, size }
    }

    /// The blocks of the square around `at`.
    pub(super) fn around(at: [u32; 2], deal: u32, size: [u32; 2]) -> impl Iterator<Item = Block> {
        let at = at.map(|v| v / SQUARE * SQUARE);
        (0..CELL * CELL).map(move |k| Block { at, dealt: Some((k, deal)), size })
    }

    pub(super) fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Block { at, dealt, size } = *self;
        let cells = if dealt.is_some() { SQUARE / CELL } else { 1 };
        let cell = move |i: u32| [at[0] + i % cells * CELL, at[1] + i / cells * CELL];
        let one = move |cell: [u32; 2]| match dealt {
            Some((k, deal)) => {
                let taken = dealt_in(cell, deal)[k as usize];
                [cell[0] + taken % CELL, cell[1] + taken / CELL]
            }
            None => cell,
        };
        (0..cells * cells).map(move |i| one(cell(i))).filter(move |at| at[0] < size[0] && at[1] < size[1])
    }
}

/// Which block gets which pixel of a cell.
fn dealt_in(cell: [u32; 2], deal: u32) -> [u32; (CELL * CELL) as usize] {
    let bits = Key::new(0xdea1).with((cell[0] as u64) << 32 | cell[1] as u64).bits64(deal);
    let mut all = std::array::from_fn(|i| i as u32);
    for i in (1..all.len()).rev() {
        all.swap(i, ((bits >> (16 * i)) & 0xffff) as usize % (i + 1));
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_of_a_square_is_in_one_block() {
        // A picture that ends within the square.
        let size = [30, 21];
        for deal in 0..4 {
            let mut all: Vec<[u32; 2]> =
                Block::around([25, 17], deal, size).flat_map(|block| block.pixels()).collect();
            all.sort_unstable();
            let square = (24..30).flat_map(|x| (16..21).map(move |y| [x, y]));
            assert_eq!(all, square.collect::<Vec<_>>());
        }
        let first =
            |deal: u32| Block::around([0, 0], deal, size).next().map(|b| b.pixels().collect::<Vec<_>>());
        assert_ne!(first(0), first(1), "dealt anew");
    }
}
