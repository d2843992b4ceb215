//! Morton order: the curve along which leaves are sorted and samples are spread.

use crate::map::Uv;

/// Spreads 26 bits to the even places.
#[inline(always)]
fn spread(x: u64) -> u64 {
    let mut x = x & 0xffff_ffff;
    x = (x | (x << 16)) & 0x0000_ffff_0000_ffff;
    x = (x | (x << 8)) & 0x00ff_00ff_00ff_00ff;
    x = (x | (x << 4)) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | (x << 2)) & 0x3333_3333_3333_3333;
    (x | (x << 1)) & 0x5555_5555_5555_5555
}

/// Gathers the even places.
#[inline(always)]
fn gather(mut x: u64) -> u64 {
    x &= 0x5555_5555_5555_5555;
    x = (x | (x >> 1)) & 0x3333_3333_3333_3333;
    x = (x | (x >> 2)) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | (x >> 4)) & 0x00ff_00ff_00ff_00ff;
    x = (x | (x >> 8)) & 0x0000_ffff_0000_ffff;
    (x | (x >> 16)) & 0xffff_ffff
}

/// Interleaves the bits of two numbers, the first at the even places.
#[inline(always)]
pub(crate) fn interleave(x: u32, y: u32) -> u64 {
    spread(x as u64) | (spread(y as u64) << 1)
}

const SIDE: f64 = (1u64 << 26) as f64;
const LENGTH: f64 = (1u64 << 52) as f64;

/// The point of the unit square at position `t` in [0, 1) of the Morton curve: equal lengths are equal areas. 26 binary
/// digits per coordinate, at the middle of their interval.
#[inline]
pub fn at(t: f64) -> Uv<f64> {
    let code = (t.clamp(0.0, 1.0) * LENGTH) as u64;
    let code = code.min((1 << 52) - 1);
    Uv::new((gather(code) as f64 + 0.5) / SIDE, (gather(code >> 1) as f64 + 0.5) / SIDE)
}

/// The position of a point on the curve: inverse of [`at`] to its resolution.
#[inline]
pub fn position(p: Uv<f64>) -> f64 {
    let cell = |x: f64| ((x.clamp(0.0, 1.0) * SIDE) as u64).min((1 << 26) - 1);
    (spread(cell(p.u)) | (spread(cell(p.v)) << 1)) as f64 / LENGTH
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_and_position_are_inverse_and_quarters_are_quadrants() {
        for i in 0..1000 {
            let t = (i as f64 + 0.3) / 1000.0;
            assert!((position(at(t)) - t).abs() < 1e-15);
            let (p, q) = (at(t), (t * 4.0) as u32);
            assert_eq!(((p.u >= 0.5) as u32, (p.v >= 0.5) as u32), (q & 1, q >> 1));
        }
        assert!(at(1.0).u < 1.0 && at(1.0).v < 1.0 && at(-1.0).u > 0.0);
    }
}
