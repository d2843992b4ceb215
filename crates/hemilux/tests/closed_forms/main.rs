//! Readings by `sense` against closed forms, set-up by set-up, and cases modelled on CIE 171 with references computed from closed forms.
//!
//! | what | test |
//! | --- | --- |
//! | uniform and overcast sky, disks, spheres, polygons, form factors of points and of squares | [`luminaires`] |
//! | white furnace, emitting sphere, lamp in a sphere, concentric spheres | [`furnace`] |
//! | images in plane mirrors: shrinking lamp, window, dome on one to three mirrors, facing mirrors, corner, fan of facets | [`mirrors`] |
//! | cases like CIE 171: 5.2 point source, 5.3 area sources, 5.4 flux, 5.5 transmittance, 5.6 to 5.8 reflection, 5.9 to 5.14 daylight | [`artificial`], [`daylight`] |
//!
//! Every case is judged by |z| < 3 against the standard error that `sense` states (pooled over four readings of 16 groups, so
//! Student's with 60 degrees of freedom): a right estimate fails 4 in 1000 of the cases, and the seeds are fixed. Every
//! case names a plausible wrong answer that the same test must reject (negative control).

#[path = "../common/mod.rs"]
mod common;

mod artificial;
mod daylight;
mod furnace;
mod luminaires;
mod mirrors;
use hemilux::validate::oracle;

use hemilux::sense::{Goal, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::{LoadOptions, load_radiance_str};
use std::path::Path;
use std::time::Duration;

/// Student's 97.5 % quantile with 15 degrees of freedom: what `sense` multiplies a standard error by.
const STUDENT_15: f64 = 2.131449546;
/// Readings pooled in one estimate.
const READINGS: u64 = 4;
/// Standard errors that an estimate may be away.
const LIMIT: f64 = 3.0;
/// Scenes are kept in single precision: a standard error cannot say less, relative to the value.
const ROUNDING: f64 = 5e-6;

/// A mean and its standard error.
#[derive(Clone, Copy, Debug)]
struct Estimate {
    mean: f64,
    error: f64,
}

impl Estimate {
    fn z(self, truth: f64) -> f64 {
        (self.mean - truth) / self.error.max(ROUNDING * truth.abs()).max(1e-30)
    }

    /// Agrees with the truth, and is sharp enough to reject `wrong`.
    fn check(self, what: &str, truth: f64, wrong: f64) {
        let (z, control) = (self.z(truth), self.z(wrong));
        println!(
            "{what}: {:.6} ± {:.6}, truth {truth:.6}, z = {z:+.2}; control {wrong:.6}, z = {control:+.1}",
            self.mean, self.error
        );
        assert!(z.abs() < LIMIT, "{what}: {self:?}, truth {truth}, z = {z}");
        assert!(control.abs() > LIMIT, "{what}: cannot tell {truth} from {wrong} ({self:?})");
    }
}

/// A scene in Radiance's words.
fn rad(text: &str) -> World {
    let loaded = load_radiance_str(text, None, Path::new("."), &LoadOptions::default());
    World::new(loaded.unwrap_or_else(|e| panic!("{e}\n{text}")).scene)
}

/// A parallelogram with normal `e1` × `e2`, in Radiance's words.
fn quad(modifier: &str, p: [f64; 3], e1: [f64; 3], e2: [f64; 3]) -> String {
    let at =
        |a: f64, b: f64| -> String { (0..3).map(|i| format!(" {}", p[i] + a * e1[i] + b * e2[i])).collect() };
    format!("{modifier} polygon q 0 0 12{}{}{}{}\n", at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0))
}

fn options(world: &World, receiver: Receiver, gathers: u64) -> SenseOptions {
    SenseOptions {
        receiver,
        goal: Goal::Gathers(gathers),
        limit: Duration::from_secs(3600),
        seed: 1,
        weights: world.scene.photometry.weights,
    }
}

fn pooled(sense: &Sense, p: [f64; 3], n: [f64; 3]) -> Estimate {
    let (p, n) = (p.map(|x| x as f32), Vec3::from(n.map(|x| x as f32)).normalize());
    let (mut mean, mut variance) = (0.0, 0.0);
    for index in 0..READINGS {
        let r = sense.read(index, Vec3::from(p), n);
        mean += r.scalar / READINGS as f64;
        variance += ((r.half_width - r.unseen) / STUDENT_15 / READINGS as f64).powi(2);
    }
    Estimate { mean, error: variance.sqrt() }
}

/// Irradiance at a point by `gathers` gathers continued as paths.
fn sensed(world: &World, p: [f64; 3], n: [f64; 3], gathers: u64) -> Estimate {
    let o = options(world, Receiver::Irradiance, gathers / READINGS);
    pooled(&Sense::new(world, &[], o), p, n)
}

/// Irradiance at a point by `gathers` gathers over sixteen zonal solutions, records of virtual luminaires included.
fn sensed_over_zones(world: &World, p: [f64; 3], n: [f64; 3], gathers: u64) -> Estimate {
    let zones: Vec<Zones> = (0..16)
        .map(|seed| Zones::solve(world, &ZoneOptions { budget: 2000, particles: 1 << 15, seed }))
        .collect();
    let o = options(world, Receiver::Irradiance, gathers / READINGS);
    pooled(&Sense::new(world, &zones, o), p, n)
}

/// Radiance that arrives from a direction.
fn radiance(world: &World, p: [f64; 3], d: [f64; 3], gathers: u64) -> Estimate {
    let o = options(world, Receiver::Radiance, gathers / READINGS);
    pooled(&Sense::new(world, &[], o), p, d)
}

/// Mean irradiance over a parallelogram, on the side of `e1` × `e2`, lifted by `lift` (m), less what is `known` at each point: sixteen
/// independent sets of sensors, jittered in `cells` × `cells` strata, each read once with sixteen gathers.
fn mean_over(
    world: &World,
    [p, e1, e2]: [[f64; 3]; 3],
    lift: f64,
    cells: u32,
    known: impl Fn([f64; 3]) -> f64,
) -> Estimate {
    const SETS: u64 = 16;
    let sense = Sense::new(world, &[], options(world, Receiver::Irradiance, 16));
    let n = oracle::unit(oracle::cross(e1, e2));
    let mut values = Vec::new();
    let mut index = 0;
    for _ in 0..SETS {
        let mut sum = 0.0;
        for cell in 0..cells * cells {
            index += 1;
            let a = ((cell % cells) as f64 + oracle::random(2 * index)) / cells as f64;
            let b = ((cell / cells) as f64 + oracle::random(2 * index + 1)) / cells as f64;
            let at = [0, 1, 2].map(|i| p[i] + a * e1[i] + b * e2[i] + lift * n[i]);
            let single = Vec3::from(at.map(|x| x as f32));
            sum += sense.read(index, single, Vec3::from(n.map(|x| x as f32))).scalar - known(at);
        }
        values.push(sum / (cells * cells) as f64);
    }
    let mean = values.iter().sum::<f64>() / SETS as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (SETS * (SETS - 1)) as f64;
    // Student's quantiles with 15 degrees of freedom are wider: the standard error that makes 3 as rare as with 60.
    Estimate { mean, error: variance.sqrt() * 1.14 }
}

/// Nothing is known beforehand.
fn nothing(_: [f64; 3]) -> f64 {
    0.0
}
