//! Points of the unit square: uniform, jittered, Owen-scrambled Sobol', interlaced Sobol' of order two. Everything is addressed by
//! hashing.
//!
//! A [`Key`] is the address of a random number (seed, pixel, pass, …); the same address always gives the same number,
//! whatever was asked before, by whatever thread. There are no generator objects.
//!
//! Sobol' points: I. M. Sobol' 1967; the scrambling is A. B. Owen's (1995), done by a hash that only lets a digit depend
//! on the digits above it (S. Laine and T. Karras 2011; B. Burley 2020).
//!
//! Interlaced points: J. Dick, "Higher order scrambled digital nets achieve the optimal rate of the root mean square error for
//! smooth integrands", Annals of Statistics 39(3), 2011. Of a four-dimensional scrambled Sobol' point two coordinates at a time are
//! made one by taking their digits in turn. Where the integrand has two derivatives per coordinate the error falls with n^-2.5 but for
//! logarithms; elsewhere like that of Sobol' points.

use crate::curve::interleave;
use crate::map::Uv;

/// The address of random numbers. Extend it with [`Key::with`]; order matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key(u64);

/// The finaliser of SplitMix64 (Steele, Lea and Flood 2014): a bijection that mixes all bits.
#[inline(always)]
const fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

impl Key {
    /// The address of a seed.
    #[inline]
    pub const fn new(seed: u64) -> Key {
        Key(mix(seed.wrapping_add(GOLDEN)))
    }

    /// A new address below this one. `k.with(a).with(b)` and `k.with(b).with(a)` differ.
    #[inline(always)]
    pub const fn with(self, x: u64) -> Key {
        Key(mix(self.0.rotate_left(23) ^ mix(x.wrapping_add(GOLDEN))).wrapping_add(GOLDEN))
    }

    /// 64 random bits of dimension `dim` at this address.
    #[inline(always)]
    pub const fn bits64(self, dim: u32) -> u64 {
        mix(self.0.wrapping_add((dim as u64 + 1).wrapping_mul(GOLDEN)))
    }

    /// 32 random bits of dimension `dim` at this address.
    #[inline(always)]
    pub const fn bits(self, dim: u32) -> u32 {
        (self.bits64(dim) >> 32) as u32
    }

    /// A uniform number in [0, 1).
    #[inline(always)]
    pub fn uniform(self, dim: u32) -> f32 {
        unit(self.bits(dim))
    }

    /// A uniform number in [0, 1) with 53 random bits.
    #[inline(always)]
    pub fn uniform64(self, dim: u32) -> f64 {
        (self.bits64(dim) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// A uniform point of the unit square, from one hash.
    #[inline(always)]
    pub fn uniform2(self, dim: u32) -> Uv {
        let b = self.bits64(dim);
        Uv::new(unit((b >> 32) as u32), unit(b as u32))
    }

    /// A uniform point of the unit square in double precision (32 random bits each, at the middle of their interval), from one hash.
    #[inline(always)]
    pub fn uniform2_f64(self, dim: u32) -> Uv<f64> {
        let b = self.bits64(dim);
        Uv::new(unit_f64((b >> 32) as u32), unit_f64(b as u32))
    }
}

/// The top 24 bits as a number in [0, 1).
#[inline(always)]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1u32 << 24) as f32)
}

/// 32 bits as the middle of their interval of [0, 1).
#[inline(always)]
fn unit_f64(bits: u32) -> f64 {
    (bits as f64 + 0.5) * (1.0 / (1u64 << 32) as f64)
}

/// The largest `f32` below one.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// A uniform point in the `i`-th cell of an `nx` × `ny` grid over the unit square (row by row, `u` fastest).
/// Cells beyond the last wrap around; a zero count is taken as one.
#[inline]
pub fn jittered(i: u32, nx: u32, ny: u32, key: Key) -> Uv {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let r = key.with(i as u64).uniform2(0);
    let (cx, cy) = (i % nx, (i / nx) % ny);
    Uv::new(((cx as f32 + r.u) / nx as f32).min(BELOW_ONE), ((cy as f32 + r.v) / ny as f32).min(BELOW_ONE))
}

/// [`jittered`] in double precision (other random digits).
#[inline]
pub fn jittered_f64(i: u32, nx: u32, ny: u32, key: Key) -> Uv<f64> {
    let (nx, ny) = (nx.max(1), ny.max(1));
    let r = key.with(i as u64).uniform2_f64(0);
    let (cx, cy) = (i % nx, (i / nx) % ny);
    Uv::new((cx as f64 + r.u) / nx as f64, (cy as f64 + r.v) / ny as f64)
}

/// The `index`-th point of a two-dimensional Sobol' sequence, Owen-scrambled and shuffled by `key`.
///
/// Every aligned block of 2^m consecutive indices is a (0, m, 2)-net: each of its elementary intervals of area 2^-m holds
/// exactly one point. Keys that differ give independent randomisations.
#[inline]
pub fn sobol(index: u32, key: Key) -> Uv {
    let [a, b] = sobol_bits(index, key);
    Uv::new(unit(a), unit(b))
}

/// [`sobol`] in double precision: the same 32 digits, at the middle of their interval.
#[inline]
pub fn sobol_f64(index: u32, key: Key) -> Uv<f64> {
    let [a, b] = sobol_bits(index, key);
    Uv::new(unit_f64(a), unit_f64(b))
}

/// The 32 binary digits of both coordinates of [`sobol`], most significant first.
#[inline]
pub fn sobol_bits(index: u32, key: Key) -> [u32; 2] {
    // Scrambling the index itself shuffles the points but keeps every aligned block a block.
    let i = owen_reversed(index.reverse_bits(), key.bits64(0)).reverse_bits();
    // The digits of both coordinates, least significant bit first: van der Corput's, and Sobol's second.
    [owen_reversed(i, key.bits64(1)).reverse_bits(), owen_reversed(pascal(i), key.bits64(2)).reverse_bits()]
}

/// The `index`-th point of a two-dimensional interlaced Sobol' sequence of order two, scrambled and shuffled by `key`: 52 binary
/// digits per coordinate, at the middle of their interval. Keys that differ give independent randomisations, and every point is
/// uniform on the square.
#[inline]
pub fn interlaced(index: u32, key: Key) -> Uv<f64> {
    let unit = |b: u64| ((b >> 12) as f64 + 0.5) * (1.0 / (1u64 << 52) as f64);
    let [a, b] = interlaced_bits(index, key);
    Uv::new(unit(a), unit(b))
}

/// The 64 binary digits of both coordinates of [`interlaced`], most significant first: digits 1, 3, 5, … of the first are those of
/// the first Sobol' coordinate, digits 2, 4, 6, … those of the second; for the second it is the fourth and the third. (Of all
/// ways to pair them this was among the two best of 256 on smooth families, by up to a factor of two.)
#[inline]
pub fn interlaced_bits(index: u32, key: Key) -> [u64; 2] {
    let i = owen_reversed(index.reverse_bits(), key.bits64(0)).reverse_bits();
    let scrambled = |digits: u32, dim: u32| owen_reversed(digits, key.bits64(dim)).reverse_bits();
    let (first, second) = (scrambled(i, 1), scrambled(pascal(i), 2));
    let (third, fourth) = (scrambled(times(&THIRD, i), 3), scrambled(times(&FOURTH, i), 4));
    [interleave(second, first), interleave(third, fourth)]
}

/// Columns of the generator matrices of the third and fourth Sobol' coordinate, first digit in the lowest bit: primitive polynomials
/// x² + x + 1 and x³ + x + 1, starting values of P. Bratley and B. L. Fox (Algorithm 659, 1988).
const THIRD: [u32; 32] = columns([1, 1, 0], 2, 0b1);
const FOURTH: [u32; 32] = columns([1, 3, 7], 3, 0b01);

/// Sobol's recurrence: `start` holds the first `degree` odd numbers, bit degree - 1 - k of `inner` is the polynomial's k-th inner
/// coefficient.
const fn columns(start: [u32; 3], degree: usize, inner: u32) -> [u32; 32] {
    let mut m = [0u64; 32];
    let mut out = [0; 32];
    let mut j = 0;
    while j < 32 {
        if j < degree {
            m[j] = start[j] as u64;
        } else {
            m[j] = m[j - degree] ^ (m[j - degree] << degree);
            let mut k = 1;
            while k < degree {
                if (inner >> (degree - 1 - k)) & 1 == 1 {
                    m[j] ^= m[j - k] << k;
                }
                k += 1;
            }
        }
        // m / 2^(j+1), with the first binary digit in the lowest bit.
        out[j] = ((m[j] << (31 - j)) as u32).reverse_bits();
        j += 1;
    }
    out
}

/// Multiplies the binary digits of an index by a generator matrix modulo 2.
#[inline(always)]
fn times(columns: &[u32; 32], mut i: u32) -> u32 {
    let mut digits = 0;
    while i != 0 {
        digits ^= columns[i.trailing_zeros() as usize];
        i &= i - 1;
    }
    digits
}

/// Multiplies the binary digits of an index by the Pascal matrix modulo 2, the generator matrix of Sobol's second
/// dimension. By Lucas' theorem entry (i, j) is 1 when the bits of i are among those of j: a superset sum in five steps.
#[inline(always)]
fn pascal(mut x: u32) -> u32 {
    x ^= (x & 0xaaaa_aaaa) >> 1;
    x ^= (x & 0xcccc_cccc) >> 2;
    x ^= (x & 0xf0f0_f0f0) >> 4;
    x ^= (x & 0xff00_ff00) >> 8;
    x ^= (x & 0xffff_0000) >> 16;
    x
}

/// Owen scrambling of a number whose digits are reversed (least significant bit = first digit): every step is a bijection
/// that lets a bit depend on lower bits only, which is what makes it a nested scramble.
#[inline(always)]
fn owen_reversed(mut x: u32, seed: u64) -> u32 {
    let (s, t) = (seed as u32, (seed >> 32) as u32);
    x = x.wrapping_add(s);
    x ^= x.wrapping_mul(0x6c50_b47c);
    x = x.wrapping_mul(t | 1);
    x ^= x.wrapping_mul(0xb82f_1e52);
    x = x.wrapping_add(t.rotate_left(16) ^ s);
    x ^= x.wrapping_mul(0xc7af_e638);
    x ^= x.wrapping_mul(0x8d22_f6e6);
    x
}
