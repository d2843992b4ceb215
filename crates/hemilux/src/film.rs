//! The film: exact sums of camera samples per pixel, in tiles, cut at pass boundaries.
//!
//! Sums are kept in fixed point (128-bit, one unit = 2⁻⁶⁰), so addition is exact, associative and commutative: any
//! grouping of the same passes over the same tiles gives the same bits, whatever the number of threads or shards.
//! A film also records which passes cover which tile; [`Film::merge`] refuses coverage that overlaps. Its file form, and
//! the joining of films of different parts and seeds, are in [`crate::checkpoint`].
//!
//! Invariant: a pixel's sample count is the number of passes that cover its tile.

use hemilux_scene::Rgb;
use std::ops::Range;

/// Tiles are squares of this side (pixels); those at the right and bottom rims are cut.
pub const TILE: u32 = 16;
const RADIANCE_UNIT: f64 = (1u64 << 60) as f64;
const SQUARE_UNIT: f64 = (1u64 << 40) as f64;
const AOV_UNIT: f64 = (1u64 << 24) as f64;

/// What one camera sample contributes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// Filter-weighted radiance, W·sr⁻¹·m⁻².
    pub radiance: Rgb,
    /// Directional albedo at the first visible point (0 where nothing is hit).
    pub albedo: Rgb,
    /// Shading normal there, world space (0 where nothing is hit).
    pub normal: [f32; 3],
    /// Distance from the camera to it (m); `None` where nothing is hit.
    pub depth: Option<f32>,
}

/// Sums over the samples of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pixel {
    sum: [i128; 3],
    sum_squares: [i128; 3],
    albedo: [i64; 3],
    normal: [i64; 3],
    depth: i64,
    hits: u32,
    samples: u32,
    rejected: u32,
    /// Bits of the largest luminance of a single sample: for values that are not negative their order is that of floats.
    largest: u32,
}

fn fixed(v: f32, unit: f64) -> i128 {
    (v as f64 * unit) as i128
}

fn fixed_aov(v: f32) -> i64 {
    (v as f64 * AOV_UNIT) as i64
}

impl Pixel {
    /// Add one sample. A sample that is not finite counts as zero and is remembered as rejected.
    pub fn add(&mut self, s: &Sample) {
        self.samples += 1;
        if s.radiance.is_finite() {
            self.largest = self.largest.max(s.radiance.luminance().max(0.0).to_bits());
            for c in 0..3 {
                let v = s.radiance[c];
                self.sum[c] = self.sum[c].saturating_add(fixed(v, RADIANCE_UNIT));
                let square = (v as f64 * v as f64 * SQUARE_UNIT) as i128;
                self.sum_squares[c] = self.sum_squares[c].saturating_add(square);
            }
        } else {
            self.rejected += 1;
        }
        for c in 0..3 {
            self.albedo[c] = self.albedo[c].saturating_add(fixed_aov(s.albedo[c]));
            self.normal[c] = self.normal[c].saturating_add(fixed_aov(s.normal[c]));
        }
        if let Some(depth) = s.depth {
            self.depth = self.depth.saturating_add(fixed_aov(depth));
            self.hits += 1;
        }
    }

    pub(crate) fn merge(&mut self, o: &Pixel) {
        self.largest = self.largest.max(o.largest);
        for c in 0..3 {
            self.sum[c] = self.sum[c].saturating_add(o.sum[c]);
            self.sum_squares[c] = self.sum_squares[c].saturating_add(o.sum_squares[c]);
            self.albedo[c] = self.albedo[c].saturating_add(o.albedo[c]);
            self.normal[c] = self.normal[c].saturating_add(o.normal[c]);
        }
        self.depth = self.depth.saturating_add(o.depth);
        self.hits = self.hits.saturating_add(o.hits);
        self.samples = self.samples.saturating_add(o.samples);
        self.rejected = self.rejected.saturating_add(o.rejected);
    }

    /// Append the sums as variable-length integers (zigzag, seven bits a byte): about half their size in memory.
    pub(crate) fn encode(&self, out: &mut Vec<u8>) {
        let wide = self.sum.iter().chain(&self.sum_squares).copied();
        let narrow = self.albedo.iter().chain(&self.normal).chain([&self.depth]).map(|v| *v as i128);
        let counts = [self.hits, self.samples, self.rejected, self.largest].map(i128::from);
        for v in wide.chain(narrow).chain(counts) {
            let mut rest = ((v << 1) ^ (v >> 127)) as u128;
            while rest >= 0x80 {
                out.push(rest as u8 | 0x80);
                rest >>= 7;
            }
            out.push(rest as u8);
        }
    }

    /// Fewest bytes of an encoded pixel.
    pub(crate) const LEAST_BYTES: usize = 17;

    /// Take one encoded pixel off the front of `bytes`; `None` if there is none.
    pub(crate) fn decode(bytes: &mut &[u8]) -> Option<Pixel> {
        let mut next = || {
            let (mut value, mut shift) = (0u128, 0u32);
            loop {
                let (byte, rest) = bytes.split_first()?;
                *bytes = rest;
                if shift > 126 || (shift == 126 && *byte > 3) {
                    return None;
                }
                value |= ((byte & 0x7f) as u128) << shift;
                if byte & 0x80 == 0 {
                    return Some((value >> 1) as i128 ^ -((value & 1) as i128));
                }
                shift += 7;
            }
        };
        let mut p = Pixel::default();
        for v in p.sum.iter_mut().chain(&mut p.sum_squares) {
            *v = next()?;
        }
        for v in p.albedo.iter_mut().chain(&mut p.normal).chain([&mut p.depth]) {
            *v = i64::try_from(next()?).ok()?;
        }
        for v in [&mut p.hits, &mut p.samples, &mut p.rejected, &mut p.largest] {
            *v = u32::try_from(next()?).ok()?;
        }
        Some(p)
    }

    /// Largest luminance of a single sample.
    pub fn largest(&self) -> f32 {
        f32::from_bits(self.largest)
    }

    /// Number of camera samples.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// Samples that were not finite.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }

    /// Mean radiance per band.
    pub fn mean(&self) -> Rgb {
        let n = self.samples.max(1) as f64;
        Rgb(self.sum.map(|s| (s as f64 / RADIANCE_UNIT / n) as f32))
    }

    /// Standard error of the mean per band, from the spread of the samples; 0 with fewer than two.
    /// Samples of one pixel are stratified against one another, so this tends to overstate.
    pub fn standard_error(&self) -> Rgb {
        let n = self.samples as f64;
        if n < 2.0 {
            return Rgb::BLACK;
        }
        let mut out = [0f32; 3];
        for (c, out) in out.iter_mut().enumerate() {
            let mean = self.sum[c] as f64 / RADIANCE_UNIT / n;
            let square = self.sum_squares[c] as f64 / SQUARE_UNIT / n;
            *out = ((square - mean * mean).max(0.0) / (n - 1.0)).sqrt() as f32;
        }
        Rgb(out)
    }

    /// Mean directional albedo of the first visible point.
    pub fn albedo(&self) -> Rgb {
        let n = self.samples.max(1) as f64;
        Rgb(self.albedo.map(|v| (v as f64 / AOV_UNIT / n) as f32))
    }

    /// Mean shading normal of the first visible point (not renormalised).
    pub fn normal(&self) -> [f32; 3] {
        let n = self.samples.max(1) as f64;
        self.normal.map(|v| (v as f64 / AOV_UNIT / n) as f32)
    }

    /// Mean distance of the first visible point over the samples that hit one (m); 0 if none did.
    pub fn depth(&self) -> f32 {
        (self.depth as f64 / AOV_UNIT / self.hits.max(1) as f64) as f32
    }
}

/// Two films that cannot be joined, and why.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum MergeError {
    /// Sizes or regions differ.
    #[error("films of different size or region: {0:?} and {1:?}")]
    Size([u32; 6], [u32; 6]),
    /// Both hold the same pass of the same tile.
    #[error("both films cover pass {pass} of tile {tile}")]
    Overlap {
        /// Tile index.
        tile: usize,
        /// First pass in common.
        pass: u32,
    },
}

/// One square of the film, the unit of parallel work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left edge, pixels of the whole picture.
    pub x0: u32,
    /// Top edge.
    pub y0: u32,
    /// Width in pixels, ≤ [`TILE`].
    pub width: u32,
    /// Height in pixels, ≤ [`TILE`].
    pub height: u32,
    /// Row-major sums.
    pub pixels: Vec<Pixel>,
    /// Passes that it holds, sorted, disjoint, not touching.
    passes: Vec<Range<u32>>,
}

impl Tile {
    /// Note that passes `range` are now in the sums. Adjacent ranges join.
    ///
    /// # Errors
    /// The first pass of the range that the tile holds already.
    pub fn cover(&mut self, range: Range<u32>) -> Result<(), u32> {
        self.passes = united(&self.passes, &[range])?;
        Ok(())
    }

    /// The passes in the sums.
    pub fn passes(&self) -> &[Range<u32>] {
        &self.passes
    }

    /// Those of `range` that are not in the sums, in order.
    pub fn missing(&self, range: Range<u32>) -> Vec<Range<u32>> {
        let (mut at, mut gaps) = (range.start, Vec::new());
        for held in self.passes.iter().filter(|r| r.end > range.start && r.start < range.end) {
            if held.start > at {
                gaps.push(at..held.start);
            }
            at = held.end;
        }
        if at < range.end {
            gaps.push(at..range.end);
        }
        gaps
    }
}

/// The union of two sets of passes, sorted and joined; the first pass that is in both is an error.
pub(crate) fn united(a: &[Range<u32>], b: &[Range<u32>]) -> Result<Vec<Range<u32>>, u32> {
    let mut all: Vec<Range<u32>> = a.iter().chain(b).filter(|r| !r.is_empty()).cloned().collect();
    all.sort_by_key(|r| r.start);
    let mut joined: Vec<Range<u32>> = Vec::with_capacity(all.len());
    for r in all {
        match joined.last_mut() {
            Some(last) if r.start < last.end => return Err(r.start),
            Some(last) if r.start == last.end => last.end = r.end,
            _ => joined.push(r),
        }
    }
    Ok(joined)
}

/// A picture in the making.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    width: u32,
    height: u32,
    region: [u32; 4],
    tiles: Vec<Tile>,
}

impl Film {
    /// An empty film of `width` × `height` pixels of which `region` = [x0, x1, y0, y1] is rendered.
    /// The region is clipped to the picture.
    pub fn new(width: u32, height: u32, region: [u32; 4]) -> Film {
        let [x0, x1, y0, y1] =
            [region[0].min(width), region[1].min(width), region[2].min(height), region[3].min(height)];
        let mut tiles = Vec::new();
        // Tiles lie on the grid of the whole picture, so that films of parts share them.
        let mut y = y0 / TILE * TILE;
        while y < y1 {
            let mut x = x0 / TILE * TILE;
            while x < x1 {
                let (left, top) = (x.max(x0), y.max(y0));
                let (w, h) = ((x + TILE).min(x1) - left, (y + TILE).min(y1) - top);
                let pixels = vec![Pixel::default(); (w * h) as usize];
                tiles.push(Tile { x0: left, y0: top, width: w, height: h, pixels, passes: Vec::new() });
                x += TILE;
            }
            y += TILE;
        }
        Film { width, height, region: [x0, x1, y0, y1], tiles }
    }

    /// Bytes that a film of so many pixels needs.
    pub fn bytes(width: u64, height: u64) -> u64 {
        width.saturating_mul(height).saturating_mul(size_of::<Pixel>() as u64)
    }

    /// Width of the whole picture, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height of the whole picture, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Rendered part: x0, x1, y0, y1.
    pub fn region(&self) -> [u32; 4] {
        self.region
    }

    /// The tiles, row by row.
    pub fn tiles(&self) -> &[Tile] {
        &self.tiles
    }

    /// The tiles, to add samples to.
    pub fn tiles_mut(&mut self) -> &mut [Tile] {
        &mut self.tiles
    }

    /// The first pass from `from` on that some tile lacks.
    pub fn first_missing(&self, from: u32) -> u32 {
        let of = |t: &Tile| t.missing(from..u32::MAX).first().map_or(u32::MAX, |r| r.start);
        self.tiles.iter().map(of).min().unwrap_or(u32::MAX)
    }

    /// Fewest and most samples of a pixel.
    pub fn samples(&self) -> (u32, u32) {
        let of = |t: &Tile| t.pixels.first().map_or(0, Pixel::samples);
        let each = || self.tiles.iter().map(of);
        (each().min().unwrap_or(0), each().max().unwrap_or(0))
    }

    fn shape(&self) -> [u32; 6] {
        let r = self.region;
        [self.width, self.height, r[0], r[1], r[2], r[3]]
    }

    /// Add `other` to this film: exact, so the order of merges does not show. Neither film changes on error.
    pub fn merge(&mut self, other: &Film) -> Result<(), MergeError> {
        if self.shape() != other.shape() {
            return Err(MergeError::Size(self.shape(), other.shape()));
        }
        let mut passes = Vec::with_capacity(self.tiles.len());
        for (tile, (a, b)) in self.tiles.iter().zip(&other.tiles).enumerate() {
            passes.push(united(&a.passes, &b.passes).map_err(|pass| MergeError::Overlap { tile, pass })?);
        }
        for ((a, b), passes) in self.tiles.iter_mut().zip(&other.tiles).zip(passes) {
            a.passes = passes;
            for (p, q) in a.pixels.iter_mut().zip(&b.pixels) {
                p.merge(q);
            }
        }
        Ok(())
    }

    /// Visit every pixel as (x, y, pixel), coordinates of the whole picture.
    pub fn for_each(&self, mut f: impl FnMut(u32, u32, &Pixel)) {
        for t in &self.tiles {
            for (i, p) in t.pixels.iter().enumerate() {
                f(t.x0 + i as u32 % t.width, t.y0 + i as u32 / t.width, p);
            }
        }
    }

    /// Typical relative standard error: the root mean over pixels of (standard error)² / (mean² + 1 % of the
    /// picture's mean²), luminance. `None` before two samples per pixel.
    pub fn relative_error(&self) -> Option<f32> {
        let (mut n, mut mean, mut ready) = (0u64, 0f64, true);
        self.for_each(|_, _, p| {
            n += 1;
            mean += p.mean().luminance() as f64;
            ready &= p.samples() >= 2;
        });
        if n == 0 || !ready {
            return None;
        }
        let floor = 0.01 * (mean / n as f64).powi(2);
        let mut sum = 0f64;
        self.for_each(|_, _, p| {
            let (m, e) = (p.mean().luminance() as f64, p.standard_error().luminance() as f64);
            let denominator = m * m + floor;
            if denominator > 0.0 {
                sum += e * e / denominator;
            }
        });
        Some((sum / n as f64).sqrt() as f32)
    }

    /// Samples that were not finite, over all pixels.
    pub fn rejected(&self) -> u64 {
        let mut n = 0;
        self.for_each(|_, _, p| n += p.rejected() as u64);
        n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(v: f32) -> Sample {
        Sample { radiance: Rgb::new(v, 2.0 * v, 0.1 * v), depth: Some(v), ..Sample::default() }
    }

    /// Values whose float sum depends on the order.
    fn values() -> Vec<f32> {
        (0..97).map(|i| ((i * 7919 % 101) as f32).exp2().sqrt() * 1e-9 + 0.1 * i as f32).collect()
    }

    #[test]
    fn any_order_and_grouping_gives_the_same_bits() {
        let v = values();
        let mut forward = Pixel::default();
        v.iter().for_each(|&x| forward.add(&sample(x)));
        let mut backward = Pixel::default();
        v.iter().rev().for_each(|&x| backward.add(&sample(x)));
        assert_eq!(forward, backward);
        let mut parts = [Pixel::default(); 3];
        v.iter().enumerate().for_each(|(i, &x)| parts[i % 3].add(&sample(x)));
        let mut joined = parts[2];
        joined.merge(&parts[0]);
        joined.merge(&parts[1]);
        assert_eq!(forward, joined);
        // Negative control: plain floating-point sums of the same values do differ.
        let f: f32 = v.iter().sum();
        let b: f32 = v.iter().rev().sum();
        assert_ne!(f.to_bits(), b.to_bits());
    }

    #[test]
    fn mean_and_error_are_those_of_the_samples() {
        let mut p = Pixel::default();
        [1.0, 2.0, 3.0, 6.0].iter().for_each(|&x| p.add(&sample(x)));
        assert_eq!(p.mean()[0], 3.0);
        // Sample variance 14/3, divided by n = 4.
        assert!((p.standard_error()[0] - (14.0f32 / 3.0 / 4.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn a_sample_that_is_not_finite_is_counted_and_left_out() {
        let mut p = Pixel::default();
        p.add(&sample(2.0));
        p.add(&sample(f32::NAN));
        assert_eq!((p.samples(), p.rejected()), (2, 1));
        assert_eq!(p.mean()[0], 1.0);
    }

    #[test]
    fn pixels_are_read_back_as_they_were_written() {
        let mut p = Pixel::default();
        [1.0, -2.5e30, 3e-20, 1e38, 0.0].iter().for_each(|&x| p.add(&sample(x)));
        p.add(&sample(f32::NAN));
        p.sum_squares = [i128::MAX, i128::MIN, -1];
        let mut bytes = Vec::new();
        for q in [Pixel::default(), p] {
            bytes.clear();
            q.encode(&mut bytes);
            assert!(bytes.len() >= Pixel::LEAST_BYTES);
            let mut rest = &bytes[..];
            assert_eq!(Pixel::decode(&mut rest), Some(q));
            assert!(rest.is_empty());
            assert_eq!(Pixel::decode(&mut &bytes[..bytes.len() - 1]), None);
        }
        // Numbers longer than any are refused.
        assert_eq!(Pixel::decode(&mut &[0xff; 60][..]), None);
    }

    #[test]
    fn gaps_between_passes() {
        let mut film = Film::new(40, 20, [0, 40, 0, 20]);
        film.tiles_mut()[0].cover(2..4).unwrap();
        film.tiles_mut()[0].cover(6..7).unwrap();
        let t = &film.tiles()[0];
        assert_eq!(t.missing(0..9), [0..2, 4..6, 7..9]);
        let bounds = |r: Vec<std::ops::Range<u32>>| r.iter().map(|r| (r.start, r.end)).collect::<Vec<_>>();
        assert_eq!((bounds(t.missing(3..7)), bounds(t.missing(2..4))), (vec![(4, 6)], vec![]));
        assert_eq!((film.first_missing(0), film.first_missing(2)), (0, 2));
        film.tiles_mut().iter_mut().skip(1).for_each(|t| t.cover(2..9).unwrap());
        assert_eq!(film.first_missing(2), 4);
    }

    #[test]
    fn merge_refuses_overlap_and_other_sizes() {
        let mut a = Film::new(40, 20, [0, 40, 0, 20]);
        let mut b = a.clone();
        a.tiles_mut()[0].cover(0..4).unwrap();
        b.tiles_mut()[0].cover(3..5).unwrap();
        assert_eq!(a.clone().merge(&b), Err(MergeError::Overlap { tile: 0, pass: 3 }));
        assert!(matches!(a.merge(&Film::new(40, 21, [0, 40, 0, 21])), Err(MergeError::Size(..))));
        let mut c = Film::new(40, 20, [0, 40, 0, 20]);
        c.tiles_mut()[0].cover(4..8).unwrap();
        a.merge(&c).unwrap();
        assert_eq!(a.tiles()[0].passes(), std::slice::from_ref(&(0..8)));
    }

    #[test]
    fn tiles_cover_the_region_once() {
        let film = Film::new(50, 37, [3, 47, 5, 36]);
        let mut seen = vec![0; 50 * 37];
        film.for_each(|x, y, _| seen[(y * 50 + x) as usize] += 1);
        for y in 0..37u32 {
            for x in 0..50u32 {
                let inside = (3..47).contains(&x) && (5..36).contains(&y);
                assert_eq!(seen[(y * 50 + x) as usize], inside as i32);
            }
        }
    }
}
