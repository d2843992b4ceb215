//! Samples against densities: χ² over polar cells around the direction of the lobe's peak, on each side of the surface.

use crate::stats::{Random, chi_square_tail, sidak};
use crate::{direction, materials};
use hemilux::bsdf::{Bsdf, Lobe, Transport};
use hemilux_scene::geom::{Frame, Vec3};

const SAMPLES: usize = 50_000;
const RINGS: usize = 20;
const SECTORS: usize = 10;

/// What is tested: something that samples and knows a density.
trait Sampler {
    fn draw(&self, wo: Vec3, random: &mut Random) -> Option<(Vec3, bool)>;
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32;
}

impl Sampler for Bsdf {
    fn draw(&self, wo: Vec3, random: &mut Random) -> Option<(Vec3, bool)> {
        self.sample(wo, random.unit(), random.square(), Transport::Radiance).map(|s| (s.wi, s.delta))
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_solid_angle(wo, wi)
    }
}

impl Sampler for Lobe {
    fn draw(&self, wo: Vec3, random: &mut Random) -> Option<(Vec3, bool)> {
        self.sample(wo, random.square(), Transport::Radiance).map(|s| (s.wi, s.delta))
    }
    fn pdf(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.pdf_solid_angle(wo, wi)
    }
}

/// Polar coordinates around an axis, the angle warped to spend half of the rings within `width` of it.
struct Cells {
    frame: Frame,
    width: f64,
}

impl Cells {
    fn ring_end(&self) -> f64 {
        std::f64::consts::PI / (std::f64::consts::PI + self.width)
    }

    fn cell(&self, w: Vec3) -> usize {
        let l = self.frame.to_local(w);
        let theta = (l.x.hypot(l.y) as f64).atan2(l.z as f64);
        let ring = theta / (theta + self.width) / self.ring_end() * RINGS as f64;
        let sector = ((l.y as f64).atan2(l.x as f64) / std::f64::consts::TAU + 1.0).fract() * SECTORS as f64;
        (ring as usize).min(RINGS - 1) * SECTORS + (sector as usize).min(SECTORS - 1)
    }

    /// Direction and solid angle per unit of (ring, sector).
    fn at(&self, ring: f64, sector: f64) -> (Vec3, f64) {
        let scale = self.ring_end() / RINGS as f64;
        let t = ring * scale;
        let theta = self.width * t / (1.0 - t);
        let phi = sector / SECTORS as f64 * std::f64::consts::TAU;
        let jacobian =
            theta.sin() * self.width / (1.0 - t).powi(2) * scale * std::f64::consts::TAU / SECTORS as f64;
        let local =
            Vec3::new((theta.sin() * phi.cos()) as f32, (theta.sin() * phi.sin()) as f32, theta.cos() as f32);
        (self.frame.to_world(local), jacobian)
    }

    /// Gauss 3 × 3 over a square of (ring, sector).
    fn gauss(&self, f: &impl Fn(Vec3) -> f64, at: [f64; 2], size: f64) -> f64 {
        const NODES: [(f64, f64); 3] =
            [(0.112_701_665_379_258, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_742, 5.0 / 18.0)];
        let mut sum = 0.0;
        for (x, wx) in NODES {
            for (y, wy) in NODES {
                let (w, jacobian) = self.at(at[0] + x * size, at[1] + y * size);
                sum += wx * wy * jacobian * f(w);
            }
        }
        sum * size * size
    }

    /// Whether the horizon, where densities end, crosses the square.
    fn cut(&self, at: [f64; 2], size: f64) -> bool {
        let below = (0..9).filter(|i| {
            let (x, y) = ((i / 3) as f64 / 2.0, (i % 3) as f64 / 2.0);
            self.at(at[0] + x * size, at[1] + y * size).0.z < 0.0
        });
        !matches!(below.count(), 0 | 9)
    }

    /// Integral over a square of (ring, sector), of which `whole` is the first guess: quartered until it settles, once at least, and
    /// whatever the nodes say where the horizon cuts.
    fn integrate(&self, f: &impl Fn(Vec3) -> f64, at: [f64; 2], size: f64, whole: f64, depth: usize) -> f64 {
        let h = size / 2.0;
        let quarters = [[at[0], at[1]], [at[0] + h, at[1]], [at[0], at[1] + h], [at[0] + h, at[1] + h]];
        let parts = quarters.map(|q| self.gauss(f, q, h));
        let sum: f64 = parts.iter().sum();
        if depth == 0 || (size < 0.5 && (sum - whole).abs() < 5e-7 && !self.cut(at, size)) {
            return sum;
        }
        quarters.iter().zip(parts).map(|(&q, part)| self.integrate(f, q, h, part, depth - 1)).sum()
    }
}

/// p-value of samples of `sampler` on the side of sign `side` against the density of `density`.
fn p_value(
    sampler: &impl Sampler,
    density: &impl Sampler,
    wo: Vec3,
    axis: Vec3,
    width: f64,
    side: f32,
    seed: u64,
) -> f64 {
    let cells = Cells { frame: Frame::from_normal(axis), width };
    let mut counts = vec![0.0; RINGS * SECTORS];
    let mut random = Random(seed);
    let mut inside = 0;
    for _ in 0..SAMPLES {
        if let Some((wi, false)) = sampler.draw(wo, &mut random)
            && wi.z * side > 0.0
        {
            counts[cells.cell(wi)] += 1.0;
            inside += 1;
        }
    }
    let pdf = |w: Vec3| if w.z * side > 0.0 { density.pdf(wo, w) as f64 } else { 0.0 };
    // Cells of fewer than 5 expected samples are pooled; so is all that went elsewhere.
    let (mut statistic, mut bins, mut pooled, mut total) = (0.0, 0, (0.0, 0.0), 0.0);
    let mut add = |observed: f64, expected: f64| {
        statistic += (observed - expected).powi(2) / expected;
        bins += 1;
    };
    for (i, &observed) in counts.iter().enumerate() {
        let corner = [(i / SECTORS) as f64, (i % SECTORS) as f64];
        let expected = SAMPLES as f64 * cells.integrate(&pdf, corner, 1.0, f64::INFINITY, 5);
        total += expected;
        if expected >= 5.0 {
            add(observed, expected);
        } else {
            pooled = (pooled.0 + observed, pooled.1 + expected);
        }
    }
    if pooled.1 >= 5.0 {
        add(pooled.0, pooled.1);
    } else if pooled.0 > 25.0 {
        return 0.0;
    }
    let elsewhere = SAMPLES as f64 - total;
    if elsewhere >= 5.0 {
        add((SAMPLES - inside) as f64, elsewhere);
    } else if elsewhere < -0.002 * SAMPLES as f64 {
        return 0.0;
    }
    if bins < 2 { 1.0 } else { chi_square_tail(statistic, bins - 1) }
}

fn views() -> [Vec3; 6] {
    [
        direction(1.0, 0.0),
        direction(0.8, 0.4),
        direction(0.35, 2.0),
        direction(0.02, -1.0),
        direction(-0.6, 0.9),
        direction(-0.05, 3.0),
    ]
}

/// Where the peak of a lobe lies on a side, roughly.
fn peak(wo: Vec3, transmitted: bool, eta: f32) -> Vec3 {
    if !transmitted {
        return Vec3::new(-wo.x, -wo.y, wo.z);
    }
    let eta = if wo.z > 0.0 { eta } else { 1.0 / eta };
    let (x, y) = (-wo.x / eta, -wo.y / eta);
    let z2 = 1.0 - x * x - y * y;
    // Facets that pass light where the mean plane would not send it near the horizon.
    Vec3::new(x, y, -wo.z.signum() * z2.max(0.0).sqrt()).normalize()
}

/// (name, sampler's index and lobe or none, view, side): everything that has a density, on both sides.
fn cases() -> Vec<(String, Bsdf, Option<Lobe>, Vec3, bool)> {
    let mut cases = Vec::new();
    for (name, bsdf) in materials() {
        if !bsdf.has_non_delta() {
            continue;
        }
        for wo in views() {
            for transmitted in [false, true] {
                if transmitted && !bsdf.lobes().iter().any(Lobe::is_transmissive) {
                    continue;
                }
                cases.push((name.to_string(), bsdf, None, wo, transmitted));
                if bsdf.lobes().len() > 1 && [0.35, -0.6].contains(&wo.z) {
                    for (i, lobe) in bsdf.lobes().iter().enumerate() {
                        let delta = lobe.kind() == hemilux::bsdf::LobeClass::Delta;
                        if !delta && lobe.is_transmissive() == transmitted {
                            cases.push((format!("{name}, lobe {i}"), bsdf, Some(*lobe), wo, transmitted));
                        }
                    }
                }
            }
        }
    }
    cases
}

/// Roughness of the narrowest lobe with a density.
fn width(bsdf: &Bsdf) -> f64 {
    let narrowest = bsdf.lobes().iter().map(Lobe::alpha).filter(|&a| a > 0.0).fold(1.0, f32::min);
    2.0 * narrowest as f64
}

fn index_of(name: &str) -> f32 {
    match name {
        _ if name.contains("1.33") => 1.33,
        _ if name.starts_with("bubble") => 1.0 / 1.5,
        _ => 1.5,
    }
}

/// Family-wise false-alarm rate 1 %.
#[test]
fn samples_follow_their_density() {
    let cases = cases();
    let alpha = sidak(0.01, cases.len());
    let mut failures = Vec::new();
    for (i, (name, bsdf, lobe, wo, transmitted)) in cases.iter().enumerate() {
        let side = if *transmitted { -wo.z.signum() } else { wo.z.signum() };
        let axis = peak(*wo, *transmitted, index_of(name));
        let p = match lobe {
            Some(lobe) => p_value(lobe, lobe, *wo, axis, width(bsdf), side, i as u64),
            None => p_value(bsdf, bsdf, *wo, axis, width(bsdf), side, i as u64),
        };
        if p < alpha {
            failures.push(format!("{name}, wo.z = {}, transmitted {transmitted}: p = {p:e}", wo.z));
        }
    }
    println!("{} tests, significance of each {alpha:.2e}", cases.len());
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A density of a slightly different material must be rejected, at the same significance.
#[test]
fn wrong_densities_are_rejected() {
    let alpha = sidak(0.01, cases().len());
    let (eta, k) = crate::GOLD;
    let tan = hemilux_scene::Rgb::new(0.7, 0.5, 0.3);
    let pairs = [
        ("metal", Bsdf::conductor(eta, k, [0.3; 2]), Bsdf::conductor(eta, k, [0.33; 2])),
        ("glass", Bsdf::dielectric(1.5, [0.3; 2]), Bsdf::dielectric(1.6, [0.3; 2])),
        ("varnish", Bsdf::coated_diffuse(tan, 1.5, [0.1; 2]), Bsdf::coated_diffuse(tan * 0.8, 1.5, [0.1; 2])),
        ("leaf", Bsdf::diffuse_transmission(tan, tan), Bsdf::diffuse_transmission(tan * 0.8, tan)),
        (
            "coated metal",
            Bsdf::coated_conductor(1.5, [0.0; 2], eta, k, [0.2; 2]),
            Bsdf::coated_conductor(1.5, [0.0; 2], eta, k, [0.22; 2]),
        ),
    ];
    for (name, sampled, claimed) in pairs {
        for wo in [direction(0.8, 0.4), direction(0.35, 2.0)] {
            let p = p_value(&sampled, &claimed, wo, peak(wo, false, 1.5), width(&sampled), 1.0, 7);
            assert!(p < alpha, "{name} at {} passes with a wrong density: p = {p:e}", wo.z);
        }
    }
}
