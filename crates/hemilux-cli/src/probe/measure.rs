//! Numbers for a probe: the field radiance, a long run to compare with, single runs of strategies, and their errors.

use super::ProbeArgs;
use super::spot::Spot;
use hemilux::gather::{GatherPlan, Strategy, Stratum, draws, gather};
use hemilux::sampler::Sampler;
use hemilux::strategies::Domain;
use hemilux::transport::Tally;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::map::{Concentric, Map};
use hemiquad::method::{Leaves, Sobol};
use hemiquad::{Dir, Estimate, Integrand, Key, Method, Probe, Uv, Workspace};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// Field radiance over the unit square, W·sr⁻¹·m⁻², `side` × `side` values from v = 1 down.
pub struct Field {
    pub side: usize,
    pub all: Vec<Rgb>,
    /// Without luminaires, real or virtual: what the zones (and short gather rays) give.
    pub zones: Vec<Rgb>,
}

/// Rays per value of the field.
const RAYS_PER_VALUE: u32 = 4;

/// Measure the field.
pub fn field(spot: &Spot, side: u32, seed: u64) -> Field {
    let values: Vec<(Rgb, Rgb)> = (0..side * side)
        .into_par_iter()
        .map(|i| {
            let mut tally = Tally::default();
            let mut domain = spot.domain(Sampler::new(seed, i as u64, 0), &mut tally);
            let (mut all, mut zones) = (Rgb::BLACK, Rgb::BLACK);
            for k in 0..RAYS_PER_VALUE {
                let u = Key::new(seed).with(i as u64).uniform2_f64(k);
                let column = (i % side) as f64 + u.u;
                let row = (side - 1 - i / side) as f64 + u.v;
                let wi = domain.local(Uv::new(column / side as f64, row / side as f64));
                let part = 1.0 / RAYS_PER_VALUE as f32;
                // The same branch twice: the difference is the luminaires' alone.
                domain.next = k;
                all += domain.field_radiance(wi, false) * part;
                domain.next = k;
                zones += domain.field_radiance(wi, true) * part;
            }
            (all, zones)
        })
        .collect();
    let (all, zones) = values.into_iter().unzip();
    Field { side: side as usize, all, zones }
}

/// A mean of many.
#[derive(Clone, Copy, Debug)]
pub struct LongRun {
    pub rgb: [f64; 3],
    pub value: f64,
    pub std_error: f64,
    pub rays: u64,
}

/// Gathers by the default strategy, `gathers` of them: unbiased but for the zones, which all strategies share.
pub fn reference(spot: &Spot, gathers: u32, seed: u64) -> LongRun {
    let plan = GatherPlan { rays: 64, shadow_rays: 16, strategy: Strategy::default() };
    let runs: Vec<([f64; 3], u64)> = (0..gathers)
        .into_par_iter()
        .map(|i| {
            let mut tally = Tally::default();
            // Independent, so that the standard error is honest.
            let mut sampler = Sampler::new(seed ^ 0x9e37, i as u64, 0);
            let l = gather(&spot.walker, &spot.surface, &spot.bsdf, &plan, &mut sampler, &mut tally);
            (l.0.map(|v| v as f64 * spot.factor), tally.rays)
        })
        .collect();
    let n = runs.len() as f64;
    let rgb = [0, 1, 2].map(|c: usize| runs.iter().map(|r| r.0[c]).sum::<f64>() / n);
    let value = luminance(rgb);
    let variance = runs.iter().map(|r| (luminance(r.0) - value).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    LongRun { rgb, value, std_error: (variance / n).sqrt(), rays: runs.iter().map(|r| r.1).sum() }
}

struct Dark<'d, 's, 'w>(&'d mut Domain<'s, 'w>);

impl Integrand<[f64; 3]> for Dark<'_, '_, '_> {
    fn eval(&mut self, at: &[Probe], out: &mut [[f64; 3]]) {
        for (p, o) in at.iter().zip(out) {
            let wi = self.0.local(p.uv);
            *o = (self.0.weight(wi) * self.0.field_radiance(wi, true)).0.map(f64::from);
        }
    }
}

/// The part of the integral that no luminaire, real or virtual, sends directly.
pub fn zones_part(spot: &Spot, seed: u64) -> LongRun {
    let mut tally = Tally::default();
    let mut domain = spot.domain(Sampler::new(seed, 1 << 40, 0), &mut tally);
    let e = Sobol.integrate(&mut Dark(&mut domain), 1 << 15, Key::new(seed), &mut Workspace::new());
    let rgb = e.value.map(|v| v * spot.factor);
    let std_error = e.std_error.map_or(0.0, luminance) * spot.factor;
    LongRun { rgb, value: luminance(rgb), std_error, rays: tally.rays }
}

/// Luminance of three bands.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    Rgb(rgb.map(|v| v as f32)).luminance() as f64
}

/// One call of a strategy.
pub struct Run {
    pub strategy: Strategy,
    pub rgb: [f64; 3],
    pub value: f64,
    /// 95 % half-width, for methods that know one.
    pub half_width: Option<f64>,
    /// In radians.
    pub unexplored: Option<f64>,
    pub rays: u64,
    pub time: Duration,
    /// In order, with the luminance of what they gave; only of the report's methods, and only if asked for.
    pub samples: Vec<(Probe, f64)>,
    /// Where the rays of a plain strategy went, and what they were drawn from; only if asked for.
    pub drawn: Vec<(Uv<f64>, Stratum)>,
    pub cells: Vec<Vec<Uv<f64>>>,
}

struct Watch<'d, 's, 'w> {
    domain: &'d mut Domain<'s, 'w>,
    seen: Option<Vec<(Probe, f64)>>,
}

impl Integrand<[f64; 3]> for Watch<'_, '_, '_> {
    fn eval(&mut self, at: &[Probe], out: &mut [[f64; 3]]) {
        self.domain.eval(at, out);
        if let Some(seen) = &mut self.seen {
            seen.extend(at.iter().zip(out.iter()).map(|(p, v)| (*p, luminance(*v))));
        }
    }
}

/// The rays of a plain strategy on the unit square.
fn drawn(spot: &Spot, plan: &GatherPlan, mut sampler: Sampler) -> Vec<(Uv<f64>, Stratum)> {
    let s = &spot.surface;
    let side = 1f32.copysign(spot.wo.z);
    let place = |(w, stratum): (Vec3, Stratum)| {
        let d = s.frame.to_local(w);
        let d = Dir::normalize(d.x as f64, d.y as f64, (side * d.z) as f64).filter(|d| d.z > 0.0)?;
        Some((Concentric.uv(d)?, stratum))
    };
    let all = draws(&spot.walker, s, &spot.bsdf, plan, &mut sampler);
    all.into_iter().filter_map(place).collect()
}

/// Call a strategy once with about `rays` gather rays.
pub fn run(spot: &Spot, strategy: Strategy, rays: u32, seed: u64, watched: bool) -> Run {
    let mut tally = Tally::default();
    let mut sampler = Sampler::new(seed, 1 << 41, 0);
    let begin = Instant::now();
    let Strategy::Report(method) = strategy else {
        // A fifth of the rays are shadow rays, as by default.
        let plan = GatherPlan { rays: (rays * 4 / 5).max(1), shadow_rays: (rays / 5).max(1), strategy };
        let again = sampler.clone();
        let l = gather(&spot.walker, &spot.surface, &spot.bsdf, &plan, &mut sampler, &mut tally);
        let rgb = l.0.map(|v| v as f64 * spot.factor);
        let time = begin.elapsed();
        let drawn = if watched { drawn(spot, &plan, again) } else { Vec::new() };
        return Run {
            strategy,
            rgb,
            value: luminance(rgb),
            half_width: None,
            unexplored: None,
            rays: tally.rays,
            time,
            samples: Vec::new(),
            drawn,
            cells: Vec::new(),
        };
    };
    let key = sampler.key();
    let mut work = Workspace::new();
    let mut domain = spot.domain(sampler, &mut tally);
    let mut watch = Watch { domain: &mut domain, seen: watched.then(Vec::new) };
    let (e, leaves): (Estimate<[f64; 3]>, Option<Leaves>) =
        method.with(&spot.known, |m| (m.integrate(&mut watch, rays.max(4), key, &mut work), m.leaves()));
    let time = begin.elapsed();
    let samples = watch.seen.take().unwrap_or_default();
    let mut cells = Vec::new();
    if let (true, Some(leaves)) = (watched, leaves) {
        work.outlines(leaves, &mut |polygon, _| cells.push(polygon.to_vec()));
    }
    let rgb = e.value.map(|v| v * spot.factor);
    Run {
        strategy,
        rgb,
        value: luminance(rgb),
        half_width: e.half_width_95().map(|h| luminance(h) * spot.factor),
        unexplored: Some(e.unexplored_cap()),
        rays: tally.rays,
        time,
        samples,
        drawn: Vec::new(),
        cells,
    }
}

/// Errors at one number of rays.
pub struct Level {
    /// Rays asked for.
    pub asked: u32,
    /// Rays traced, mean.
    pub rays: f64,
    /// Relative to the long run.
    pub rmse: f64,
    pub bias: f64,
    /// Of the bias, noise of the long run included.
    pub bias_error: f64,
    /// Mean time of one run.
    pub time: Duration,
}

/// A strategy against the long run.
pub struct Compared {
    pub shown: Run,
    pub levels: Vec<Level>,
}

/// Numbers of rays that are compared.
const LEVELS: [u32; 4] = [16, 64, 256, 1024];

/// Compare one strategy.
pub fn compare(spot: &Spot, strategy: Strategy, args: &ProbeArgs, reference: &LongRun) -> Compared {
    let shown = run(spot, strategy, args.rays, args.seed, true);
    let levels = LEVELS
        .iter()
        .map(|&asked| {
            let begin = Instant::now();
            let runs: Vec<(f64, u64)> = (0..args.runs as u64)
                .map(|r| {
                    let seed = args.seed.wrapping_add(1 + r).wrapping_mul(0x1_0001) ^ (asked as u64) << 32;
                    let run = run(spot, strategy, asked, seed, false);
                    (run.value / reference.value - 1.0, run.rays)
                })
                .collect();
            let n = runs.len() as f64;
            let time = begin.elapsed() / args.runs;
            let bias = runs.iter().map(|r| r.0).sum::<f64>() / n;
            let square = runs.iter().map(|r| r.0 * r.0).sum::<f64>() / n;
            let spread = (square - bias * bias).max(0.0) / (n - 1.0).max(1.0);
            let own = reference.std_error / reference.value;
            Level {
                asked,
                rays: runs.iter().map(|r| r.1 as f64).sum::<f64>() / n,
                rmse: square.sqrt(),
                bias,
                bias_error: (spread + own * own).sqrt(),
                time,
            }
        })
        .collect();
    Compared { shown, levels }
}
