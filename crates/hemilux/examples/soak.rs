//! A soak: random rooms, rendered in every mode, until the time is over. Nothing may panic or hang, and modes path and
//! corrected must agree.
//!
//!     cargo run --release -p hemilux --example soak -- [minutes=30] [seed=1] [only=SEED] [more=1] [lamps=1]
//!
//! A room has random albedos, up to eight balls, boxes and panes of random materials (mirrors, glass and varnish of random
//! roughness among them) that may intersect walls and one another, up to four luminaires of random size and power, now
//! and then a sky, and a camera anywhere in it. For each scene: eight independent pictures by each of path, corrected and
//! zonal; z of the mean luminance of corrected against path (Welch), and the zones' bias. Luminaires that the camera sees
//! straight are left out: a lamp a fiftieth of a pixel wide is in one picture of eight and in no error. What is rare
//! otherwise (small images met by paths) still makes spreads too small, so where |z| > 4.4 the comparison is repeated with
//! 16 times the samples and other seeds, and the medians of the pictures are printed too. What differs again may still be an image so
//! small that no path has met it (a lamp of a millimetre in a ball): it is repeated with lamps eight and 64 times as wide (but at most
//! half a metre) at equal flux, where paths find it if the modes agree; what differs there is an error. Light that only paths of two bounces off walls take by a mirror is in no
//! picture's spread at eight times (scene 385: one picture in a hundred has it). `lamps` does the same for any scene. A comparison that takes more than two minutes of processor time (32 when repeated) or half an hour ends the
//! soak, by a watchdog, with exit code 3; panics are caught and counted, and they and differences end it with exit code 1. Built with the feature
//! `wrong-physics` it makes a mistake in modes corrected and zonal (`Wrong::Density`): the control.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::validate::scenes::{cuboid, diffuse, emission, empty, material, quad, sphere};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3};
use hemilux_scene::*;
use hemiquad::points::Key;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

const SIDE: u32 = 16;
const PICTURES: u64 = 8;
/// Seconds of processor time for one comparison: a minute of two cores.
const LONGEST: u64 = 120;
/// Seconds of the watchdog for one comparison, whatever the share of the machine it gets.
const WALL: u64 = 1800;
/// Beyond it two modes differ.
const LIMIT: f64 = 4.4;
/// How many times the samples a comparison beyond the limit is repeated with.
const AGAIN: u32 = 16;
/// How many times as wide lamps are, at equal flux, where that differs too, and where it differs once more.
const WIDER: [f64; 2] = [8.0, 64.0];
/// Lamps are at most so wide, m.
const WIDEST: f64 = 0.5;

/// Random numbers in the order they are asked for.
struct Random(Key, u32);

impl Random {
    fn next(&mut self) -> f64 {
        self.1 += 1;
        self.0.uniform64(self.1)
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    fn below(&mut self, n: u32) -> u32 {
        ((self.next() * n as f64) as u32).min(n - 1)
    }

    /// Spread evenly over orders of magnitude.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.next())
    }
}

fn random_material(scene: &mut Scene, r: &mut Random) -> MaterialId {
    let grey = RgbParam::Constant(Rgb([0; 3].map(|_| r.next() as f32)));
    let alpha = if r.below(2) == 0 { 0.0 } else { r.within(0.02, 0.6) as f32 };
    let rough = || Roughness { u: FloatParam::Constant(alpha), v: FloatParam::Constant(alpha), remap: false };
    let eta = r.within(1.1, 2.0) as f32;
    let metal = ConductorFresnel::Reflectance(grey);
    let kind = match r.below(9) {
        0 | 1 => MaterialKind::Conductor { fresnel: metal, roughness: rough() },
        2 => MaterialKind::Dielectric { eta, roughness: rough() },
        3 => MaterialKind::ThinDielectric { eta },
        4 => MaterialKind::CoatedDiffuse { reflectance: grey, eta, roughness: rough() },
        5 => MaterialKind::CoatedConductor {
            eta,
            coat_roughness: rough(),
            fresnel: metal,
            base_roughness: rough(),
        },
        6 => MaterialKind::DiffuseTransmission { reflectance: grey, transmittance: grey, scale: 0.5 },
        _ => MaterialKind::Diffuse { reflectance: grey },
    };
    material(scene, kind)
}

fn room(seed: u64, wider: f64) -> Scene {
    let r = &mut Random(Key::new(seed).with(0x50a1c), 0);
    let mut scene = empty();
    let size = [r.within(1.0, 8.0), r.within(1.0, 8.0), r.within(1.0, 4.0)];
    let wall = diffuse(&mut scene, r.within(0.0, 0.9) as f32);
    let at = |r: &mut Random| [0, 1, 2].map(|i| size[i] * r.next());
    let low = |p: [f64; 3], s: f64| p.map(|x| (x - s) as f32);
    cuboid(&mut scene, [0.0; 3], size.map(|s| s as f32), true, wall);
    for _ in 0..r.below(9) {
        let m = random_material(&mut scene, r);
        let (p, s) = (at(r), r.scale(0.02, 1.0));
        match r.below(3) {
            0 => sphere(&mut scene, p, s, r.below(4) == 0, m, None),
            1 => cuboid(&mut scene, low(p, s), low(p, -s), false, m),
            _ => {
                let edge = |r: &mut Random| [0; 3].map(|_| r.within(-s, s) as f32);
                let (a, b) = (edge(r), edge(r));
                quad(&mut scene, p.map(|x| x as f32), a, b, m, None);
            }
        }
    }
    for _ in 0..1 + r.below(4) {
        let (p, s) = (at(r), (wider * r.scale(0.003, WIDEST)).min(WIDEST));
        let light = emission((r.scale(0.1, 100.0) / (s * s)) as f32);
        let black = diffuse(&mut scene, 0.0);
        match r.below(2) {
            0 => sphere(&mut scene, p, s, false, black, light),
            _ => quad(&mut scene, low(p, 0.0), [0.0, s as f32, 0.0], [s as f32, 0.0, 0.0], black, light),
        }
    }
    if r.below(4) == 0 {
        scene.environments.push(Environment::Constant { radiance: Rgb::splat(r.next() as f32) });
    }
    let eye = DVec3::from(at(r));
    let forward = (DVec3::from(at(r)) - eye).try_normalize().unwrap_or(DVec3::X);
    let right = forward.any_orthonormal_vector();
    scene.camera.to_world = DAffine3::from_cols(right, right.cross(forward), forward, eye);
    scene.camera.projection = Projection::Perspective { fov: r.within(20.0, 120.0) as f32 };
    scene
}

/// A scene and its solution.
struct Solved {
    world: World,
    zones: Zones,
}

impl Solved {
    fn new(scene: Scene, particles: u64, seed: u64) -> Solved {
        let world = World::new(scene);
        let zones = Zones::solve(&world, &ZoneOptions { budget: 2000, particles, seed });
        Solved { world, zones }
    }

    /// Mean luminance of a picture.
    fn mean(&self, mode: Mode, seed: u64, passes: u32) -> f64 {
        let plan = GatherPlan { rays: 8, shadow_rays: 4, strategy: Strategy::default() };
        let options = RenderOptions { mode, plan, seed, max_depth: u32::MAX };
        let renderer = Renderer::new(&self.world, Some(&self.zones), SIDE, SIDE, options);
        let mut film = Film::new(SIDE, SIDE, [0, SIDE, 0, SIDE]);
        renderer.passes(&mut film, 0..passes, &AtomicU64::new(0));
        let mut sum = 0.0;
        film.for_each(|_, _, p| sum += p.mean().luminance() as f64);
        assert!(film.rejected() == 0, "samples that are not finite");
        sum / (SIDE * SIDE) as f64
    }
}

/// Mean luminance of independent pictures, `more` times as many samples in each, without luminaires that the camera sees
/// straight: `blackened`, the same room with everything painted black, says in the same mode what the same camera rays meet of those
/// (modes that gather ask several rays a sample), be it everything or, more often, nothing.
fn pictures(room: &Solved, blackened: &Solved, mode: Mode, more: u32) -> Vec<f64> {
    let passes = more * if mode == Mode::Path { 64 } else { 8 };
    let seed = |picture| picture + 100 * mode as u64 + 1000 * more as u64;
    (0..PICTURES).map(|i| room.mean(mode, seed(i), passes) - blackened.mean(mode, seed(i), passes)).collect()
}

/// Mean, its standard error, median.
fn statistics(values: &[f64]) -> [f64; 3] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [mean, variance.sqrt(), sorted[values.len() / 2]]
}

/// z of corrected against path, bias of zonal against corrected, and words for a line.
fn compare(seed: u64, more: u32, wider: f64) -> (f64, f64, String) {
    let mut black = room(seed, wider);
    let paint = MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::BLACK) };
    black.materials.iter_mut().for_each(|m| m.kind = paint.clone());
    let (room, black) = (Solved::new(room(seed, wider), 1 << 16, seed), Solved::new(black, 1 << 8, seed));
    let [path, corrected, zonal] = [Mode::Path, Mode::Corrected, Mode::Zonal]
        .map(|mode| statistics(&pictures(&room, &black, mode, more)));
    let z = match path[1].hypot(corrected[1]) {
        error if error > 1e-6 * path[0] => (corrected[0] - path[0]) / error,
        _ => 0.0,
    };
    let bias = if corrected[0] > 0.0 { zonal[0] / corrected[0] - 1.0 } else { 0.0 };
    let words = |s: [f64; 3]| format!("{:.5} ± {:.5} (median {:.5})", s[0], s[1], s[2]);
    (z, bias, format!("path {}, corrected {}, zonal {}", words(path), words(corrected), words(zonal)))
}

fn option(key: &str) -> Option<f64> {
    let prefix = format!("{key}=");
    std::env::args().find_map(|o| o.strip_prefix(&prefix).and_then(|v| v.parse::<f64>().ok()))
}

/// Seconds of processor time that this program has used (Linux; 0 elsewhere).
fn processor() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    // Fields 14 and 15, counted after the name in brackets; a hundred ticks a second.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    fields.filter_map(|f| f.parse::<u64>().ok()).sum::<u64>() / 100
}

fn main() {
    #[cfg(feature = "wrong-physics")]
    hemilux::wrong::choose(hemilux::wrong::Wrong::Density);
    let end = (60.0 * option("minutes").unwrap_or(30.0)) as u64;
    let first = option("only").or(option("seed")).unwrap_or(1.0) as u64;
    // Scene, second at which it began, the same of processor time, how much of that it may take; and seconds since the
    // beginning, counted here so that a machine that sleeps, or a soak that is stopped, is not taken for one that hangs.
    static NOW: [AtomicU64; 4] = [const { AtomicU64::new(0) }; 4];
    static SECONDS: AtomicU64 = AtomicU64::new(0);
    let watch = |seed: u64, more: u32| {
        let values = [seed, SECONDS.load(Ordering::Relaxed), processor(), LONGEST * more as u64];
        NOW.iter().zip(values).for_each(|(now, v)| now.store(v, Ordering::Relaxed));
    };
    watch(first, 1);
    std::thread::spawn(move || {
        loop {
            std::thread::sleep(Duration::from_secs(1));
            let now = SECONDS.fetch_add(1, Ordering::Relaxed) + 1;
            let [seed, since, used, longest] = [0, 1, 2, 3].map(|i| NOW[i].load(Ordering::Relaxed));
            let (wall, used) = (now.saturating_sub(since), processor().saturating_sub(used));
            if used > longest || wall > WALL {
                eprintln!(
                    "scene {seed} takes longer than {longest} s: {used} s of processor time in {wall} s"
                );
                std::process::exit(3);
            }
        }
    });
    let (mut scenes, mut panics, mut repeated, mut far, mut farther) = (0u64, 0u64, 0u64, 0u64, 0u64);
    let wider = option("lamps").unwrap_or(1.0);
    let (mut slowest, mut biases) = ((0, 0), Vec::new());
    let (more, only) = (option("more").unwrap_or(1.0) as u32, option("only").is_some());
    for seed in first.. {
        if scenes > 0 && (SECONDS.load(Ordering::Relaxed) >= end || only) {
            break;
        }
        let since = processor();
        watch(seed, more);
        let done = catch_unwind(AssertUnwindSafe(|| {
            let (z, bias, words) = compare(seed, more, wider);
            biases.push(bias.abs());
            if only || z.abs() > LIMIT {
                println!("scene {seed}: z = {z:+.1}: {words}");
            }
            if z.abs() > LIMIT {
                repeated += 1;
                slowest = slowest.max((processor() - since, seed));
                watch(seed, AGAIN * more);
                let (z, _, words) = compare(seed, AGAIN * more, wider);
                println!("   {AGAIN} times the samples: z = {z:+.1}: {words}");
                far += (z.abs() > LIMIT) as u64;
                let mut differs = z.abs() > LIMIT;
                for times in WIDER {
                    if !differs {
                        break;
                    }
                    watch(seed, AGAIN * more);
                    let (z, _, words) = compare(seed, AGAIN * more, times * wider);
                    println!("   lamps {times} times as wide: z = {z:+.1}: {words}");
                    differs = z.abs() > LIMIT;
                }
                farther += differs as u64;
            } else {
                slowest = slowest.max((processor() - since, seed));
            }
        }));
        if done.is_err() {
            println!("scene {seed}: PANIC");
            panics += 1;
        }
        scenes += 1;
    }
    biases.sort_by(f64::total_cmp);
    let at = |share: f64| biases.get((share * (biases.len() as f64 - 1.0)) as usize).copied().unwrap_or(0.0);
    println!(
        "{scenes} scenes, {panics} panics, {repeated} with |z| > {LIMIT}, {far} of them again, {farther} with wide lamps too; |zonal / corrected - 1| median {:.4}, 95 % {:.4}; slowest scene {} ({} s of processor time)",
        at(0.5),
        at(0.95),
        slowest.1,
        slowest.0
    );
    std::process::exit((panics + farther > 0) as i32);
}
