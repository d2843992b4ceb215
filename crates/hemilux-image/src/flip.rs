//! FLIP, a measure of the difference seen when two pictures are shown in turn at the same place.
//!
//! Pictures for a screen: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, "FLIP: a difference
//! evaluator for alternating images", HPG 2020. Pictures of high dynamic range: Andersson, Nilsson, Shirley,
//! Akenine-Möller, "Visualizing errors in rendered high dynamic range images", Eurographics 2021: the largest of the
//! screen values over a range of exposures found from the reference.
//!
//! Written from the papers' formulae. Each pixel gets a value from 0 (no difference seen) to 1. All filters are
//! separable or sums of separable ones, and repeat the pixels of the rim outside.

use crate::buffer::{Encoding, Image};
use crate::error::ImageError;
use crate::srgb;

/// Pixels per degree of visual angle at 0.7 m from a screen of 0.7 m and 3840 pixels, the papers' default.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// A FLIP map and what it was made with.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// One value (0..1) per pixel, row by row.
    pub map: Vec<f32>,
    /// The mean of the map.
    pub mean: f64,
    /// The exposures used, in stops from the lowest to the highest; none for screen pictures.
    pub exposures: Vec<f32>,
}

type Planes = [Vec<f64>; 3];

/// Exponent of the colour difference.
const QC: f64 = 0.7;
/// Share of the largest colour difference below which errors are stretched, …
const PC: f64 = 0.4;
/// … to this value.
const PT: f64 = 0.95;
/// Exponent of the feature difference.
const QF: f64 = 0.5;
/// Width, in degrees, of the edges and points that are looked for.
const FEATURE_WIDTH: f64 = 0.082;
/// Contrast sensitivity of the three opponent channels: two Gaussians each, as (amplitude, width).
const SENSITIVITY: [[(f64, f64); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];

/// FLIP of two pictures for a screen, seen at `pixels_per_degree`. Linear pictures are taken as linear light and cut to
/// 0..1; sRGB pictures are decoded.
///
/// # Errors
/// The sizes differ, a picture has no colour, or the resolution is not positive.
pub fn ldr_flip(reference: &Image, test: &Image, pixels_per_degree: f32) -> Result<Flip, ImageError> {
    let (reference, test) = pair(reference, test)?;
    let filters = Filters::new(pixels_per_degree)?;
    let cut = |planes: &Planes| planes.clone().map(|p| p.into_iter().map(|v| v.clamp(0.0, 1.0)).collect());
    let map = filters.compare(
        &Field { planes: cut(&reference.planes), ..reference },
        &Field { planes: cut(&test.planes), ..test },
    );
    Ok(finish(map, Vec::new()))
}

/// FLIP of two linear pictures of any range, seen at `pixels_per_degree`: the largest of the values under exposures
/// from the one that just does not burn out the brightest pixel of the reference to the one that does so to its
/// median, about a stop apart, through an ACES-like tone curve. Negative and non-finite values count as 0.
///
/// # Errors
/// As [`ldr_flip`].
pub fn hdr_flip(reference: &Image, test: &Image, pixels_per_degree: f32) -> Result<Flip, ImageError> {
    let (reference, test) = pair(reference, test)?;
    let filters = Filters::new(pixels_per_degree)?;
    let exposures = exposures(&reference);
    let mut map = vec![0.0_f64; reference.width * reference.height];
    for stops in &exposures {
        let step = filters.compare(&reference.exposed(*stops), &test.exposed(*stops));
        map.iter_mut().zip(step).for_each(|(m, v)| *m = m.max(v));
    }
    Ok(finish(map, exposures.into_iter().map(|e| e as f32).collect()))
}

fn finish(map: Vec<f64>, exposures: Vec<f32>) -> Flip {
    let mean = map.iter().sum::<f64>() / map.len() as f64;
    Flip { map: map.into_iter().map(|v| v as f32).collect(), mean, exposures }
}

/// Three planes of a picture.
struct Field {
    width: usize,
    height: usize,
    planes: Planes,
}

fn pair(reference: &Image, test: &Image) -> Result<(Field, Field), ImageError> {
    if (reference.width, reference.height) != (test.width, test.height) {
        return Err(ImageError::unfit(format!(
            "sizes do not fit: {} x {} and {} x {}",
            reference.width, reference.height, test.width, test.height
        )));
    }
    Ok((Field::new(reference)?, Field::new(test)?))
}

/// The curve's coefficients: (a x² + b x) / (d x² + e x + f), Narkowicz's fit with its input scaled by 0.6.
const CURVE: [f64; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];

/// From the stop where the brightest luminance of the reference comes to 0.85 through the curve, to the one where the
/// median does; at least 2, at most a stop apart.
fn exposures(reference: &Field) -> Vec<f64> {
    let [a, b, d, e, f] = CURVE;
    let t = 0.85;
    let (p, q, r) = (a - t * d, b - t * e, -t * f);
    let bright = (-q + (q * q - 4.0 * p * r).sqrt()) / (2.0 * p);
    // Rec. 709's own rounding.
    let weights = [0.2126, 0.7152, 0.0722];
    let [red, green, blue] = &reference.planes;
    let mut luminance: Vec<f64> =
        (0..red.len()).map(|i| weights[0] * red[i] + weights[1] * green[i] + weights[2] * blue[i]).collect();
    luminance.sort_unstable_by(f64::total_cmp);
    let (n, tiny) = (luminance.len(), f64::from(f32::EPSILON));
    let median = luminance[n / 2].max(tiny);
    let start = (bright / luminance[n - 1].max(tiny)).log2();
    let stop = (bright / median).log2();
    let count = ((stop - start).ceil() as usize).max(2);
    (0..count).map(|i| start + (stop - start) * i as f64 / (count - 1) as f64).collect()
}

impl Field {
    fn new(image: &Image) -> Result<Self, ImageError> {
        image.check()?;
        let planes = image.rgb().ok_or_else(|| ImageError::unfit("no R, G, B or Y to compare"))?;
        let decoded = |v: f32| match image.encoding {
            Encoding::Srgb => srgb::decode(v),
            Encoding::Linear => v,
        };
        let clean = |v: &f32| if v.is_finite() && *v > 0.0 { f64::from(decoded(*v)) } else { 0.0 };
        let planes = planes.map(|p| p.iter().map(clean).collect());
        Ok(Self { width: image.width, height: image.height, planes })
    }

    fn exposed(&self, stops: f64) -> Self {
        let [a, b, d, e, f] = CURVE;
        let factor = stops.exp2();
        let show = |v: &f64| {
            let x = (v * factor).min(1e15);
            ((x * (a * x + b)) / (x * (d * x + e) + f)).clamp(0.0, 1.0)
        };
        Self { planes: self.planes.each_ref().map(|p| p.iter().map(show).collect()), ..*self }
    }

    fn map(&self, f: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        let n = self.width * self.height;
        let mut planes: Planes = [Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n)];
        let [x, y, z] = &self.planes;
        for i in 0..n {
            for (plane, v) in planes.iter_mut().zip(f([x[i], y[i], z[i]])) {
                plane.push(v);
            }
        }
        Self { planes, ..*self }
    }
}

/// Colour spaces relative to the white of the screen.
struct Spaces {
    to_xyz: [[f64; 3]; 3],
    to_rgb: [[f64; 3]; 3],
    white: [f64; 3],
}

impl Spaces {
    fn new() -> Option<Self> {
        let to_xyz = srgb::rgb_to_xyz(srgb::REC709_XY)?;
        Some(Self { to_rgb: srgb::invert(&to_xyz)?, white: srgb::mul(&to_xyz, [1.0; 3]), to_xyz })
    }

    fn relative(&self, rgb: [f64; 3]) -> [f64; 3] {
        let xyz = srgb::mul(&self.to_xyz, rgb);
        std::array::from_fn(|i| xyz[i] / self.white[i])
    }

    /// The linear opponent space YCxCz.
    fn opponent(&self, rgb: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.relative(rgb);
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    fn rgb_of_opponent(&self, [y, cx, cz]: [f64; 3]) -> [f64; 3] {
        let y = (y + 16.0) / 116.0;
        let relative = [y + cx / 500.0, y, y - cz / 200.0];
        srgb::mul(&self.to_rgb, std::array::from_fn(|i| relative[i] * self.white[i]))
    }

    /// CIE L*a*b* with the Hunt effect: chroma weakens with lightness.
    fn hunt(&self, rgb: [f64; 3]) -> [f64; 3] {
        const DELTA: f64 = 6.0 / 29.0;
        let f = |t: f64| if t > DELTA.powi(3) { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 };
        let [x, y, z] = self.relative(rgb).map(f);
        let l = 116.0 * y - 16.0;
        [l, 0.01 * l * 500.0 * (x - y), 0.01 * l * 200.0 * (y - z)]
    }
}

/// The HyAB distance: city block between lightness and chroma, Euclidean within chroma.
fn hyab(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// A filter in x (or y) of odd length.
type Kernel = Vec<f64>;

/// All filters for one resolution.
struct Filters {
    spaces: Spaces,
    /// For each opponent channel, Gaussians (same in x and y) with their weights.
    sensitivity: [Vec<(f64, Kernel)>; 3],
    gauss: Kernel,
    edge: Kernel,
    point: Kernel,
    largest: f64,
}

/// Distances from the middle.
fn steps(radius: i32) -> impl Iterator<Item = f64> {
    (-radius..=radius).map(f64::from)
}

fn unit(kernel: Kernel) -> Kernel {
    let sum: f64 = kernel.iter().sum();
    kernel.into_iter().map(|v| v / sum).collect()
}

/// Positive weights that sum to 1 and negative ones that sum to -1.
fn balanced(kernel: Kernel) -> Kernel {
    let positive: f64 = kernel.iter().filter(|v| **v > 0.0).sum();
    let negative: f64 = -kernel.iter().filter(|v| **v < 0.0).sum::<f64>();
    kernel.into_iter().map(|v| if v > 0.0 { v / positive } else { v / negative }).collect()
}

impl Filters {
    fn new(pixels_per_degree: f32) -> Result<Self, ImageError> {
        let ppd = f64::from(pixels_per_degree);
        if !(0.01..=10_000.0).contains(&ppd) {
            return Err(ImageError::unfit(format!("{ppd} pixels per degree are not in 0.01..10000")));
        }
        let spaces = Spaces::new().ok_or_else(|| ImageError::unfit("no colour space"))?;
        let pi2 = std::f64::consts::PI.powi(2);
        let radius = (3.0 * (0.04 / (2.0 * pi2)).sqrt() * ppd).ceil() as i32;
        let sensitivity = SENSITIVITY.map(|channel| {
            let gaussians = channel.map(|(a, b)| {
                let kernel: Kernel = steps(radius).map(|x| (-pi2 * (x / ppd).powi(2) / b).exp()).collect();
                (a * (std::f64::consts::PI / b).sqrt(), kernel)
            });
            let volume: f64 = gaussians.iter().map(|(w, k)| w * k.iter().sum::<f64>().powi(2)).sum();
            gaussians.into_iter().filter(|(w, _)| *w > 0.0).map(|(w, k)| (w / volume, k)).collect()
        });
        let deviation = 0.5 * FEATURE_WIDTH * ppd;
        let radius = (3.0 * deviation).ceil() as i32;
        let gaussian = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
        let second = |x: f64| ((x / deviation).powi(2) - 1.0) * gaussian(x);
        let (green, blue) = (spaces.hunt([0.0, 1.0, 0.0]), spaces.hunt([0.0, 0.0, 1.0]));
        Ok(Self {
            sensitivity,
            gauss: unit(steps(radius).map(gaussian).collect()),
            edge: balanced(steps(radius).map(|x| -x * gaussian(x)).collect()),
            point: balanced(steps(radius).map(second).collect()),
            largest: hyab(green, blue).powf(QC),
            spaces,
        })
    }

    /// FLIP of two fields of linear light in 0..1.
    fn compare(&self, reference: &Field, test: &Field) -> Vec<f64> {
        let (a, b) = (reference.map(|v| self.spaces.opponent(v)), test.map(|v| self.spaces.opponent(v)));
        let (edge_a, point_a) = self.features(&a);
        let (edge_b, point_b) = self.features(&b);
        let (seen_a, seen_b) = (self.seen(&a), self.seen(&b));
        let pixel = |f: &Field, i: usize| f.planes.each_ref().map(|p| p[i]);
        let bend = PC * self.largest;
        (0..edge_a.len())
            .map(|i| {
                let d = hyab(pixel(&seen_a, i), pixel(&seen_b, i)).powf(QC);
                let colour = if d < bend {
                    d * PT / bend
                } else {
                    PT + (d - bend) / (self.largest - bend) * (1.0 - PT)
                };
                let feature = (edge_a[i] - edge_b[i]).abs().max((point_a[i] - point_b[i]).abs());
                let feature = (feature / std::f64::consts::SQRT_2).powf(QF);
                colour.powf(1.0 - feature).clamp(0.0, 1.0)
            })
            .collect()
    }

    /// The picture as the eye resolves it, in Hunt-adjusted L*a*b*.
    fn seen(&self, opponent: &Field) -> Field {
        let (w, h) = (opponent.width, opponent.height);
        let filter = |c: usize| {
            let mut sum = vec![0.0; w * h];
            for (weight, kernel) in &self.sensitivity[c] {
                let part = convolve(&opponent.planes[c], w, h, kernel, kernel);
                sum.iter_mut().zip(part).for_each(|(s, v)| *s += weight * v);
            }
            sum
        };
        let filtered = Field { width: w, height: h, planes: [filter(0), filter(1), filter(2)] };
        filtered.map(|v| self.spaces.hunt(self.spaces.rgb_of_opponent(v).map(|v| v.clamp(0.0, 1.0))))
    }

    /// Strength of edges and of points in the achromatic channel.
    fn features(&self, opponent: &Field) -> (Vec<f64>, Vec<f64>) {
        let (w, h) = (opponent.width, opponent.height);
        let grey: Vec<f64> = opponent.planes[0].iter().map(|y| (y + 16.0) / 116.0).collect();
        let strength = |kernel: &Kernel| {
            let x = convolve(&grey, w, h, kernel, &self.gauss);
            let y = convolve(&grey, w, h, &self.gauss, kernel);
            x.into_iter().zip(y).map(|(x, y)| x.hypot(y)).collect()
        };
        (strength(&self.edge), strength(&self.point))
    }
}

/// A separable filter; the rim is repeated outside. The kernels are correlated, not turned round: only their
/// magnitudes are used.
fn convolve(data: &[f64], width: usize, height: usize, kx: &Kernel, ky: &Kernel) -> Vec<f64> {
    let mut rows = vec![0.0; data.len()];
    let radius = kx.len() / 2;
    let mut padded = vec![0.0; width + 2 * radius];
    for (line, out) in data.chunks_exact(width).zip(rows.chunks_exact_mut(width)) {
        padded[..radius].fill(line[0]);
        padded[radius..radius + width].copy_from_slice(line);
        padded[radius + width..].fill(line[width - 1]);
        for (window, v) in padded.windows(kx.len()).zip(out) {
            *v = window.iter().zip(kx).map(|(a, b)| a * b).sum();
        }
    }
    let mut out = vec![0.0; data.len()];
    let radius = ky.len() / 2;
    for (y, line) in out.chunks_exact_mut(width).enumerate() {
        for (k, weight) in ky.iter().enumerate() {
            let from = (y + k).saturating_sub(radius).min(height - 1);
            let row = &rows[from * width..(from + 1) * width];
            line.iter_mut().zip(row).for_each(|(v, r)| *v += weight * r);
        }
    }
    out
}
