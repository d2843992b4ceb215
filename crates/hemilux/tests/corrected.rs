//! Mode corrected against mode path, pixel by pixel, over zones that are bad on purpose: with residuals the zones must not
//! show; without them, or with their sign turned, they must.

mod common;
use common::*;
use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::sense::{Goal, Receiver, Sense, SenseOptions};
use hemilux::transport::Residual;
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3, Vec3};
use hemilux_scene::*;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

const SIDE: u32 = 12;
/// Independent pictures behind every pixel's mean and its error.
const REPLICATES: u64 = 32;
/// Student's t with 62 degrees of freedom exceeds this with probability 1e-5: over 144 pixels and 3 scenes, a false
/// alarm in 250 runs; the seeds are fixed.
const LIMIT: f64 = 4.8;

/// A room with a large luminaire, a box that shades, and whatever `more` adds.
fn room(albedo: f32, more: fn(&mut Scene)) -> Scene {
    let mut scene = empty();
    let (wall, dark) = (diffuse(&mut scene, albedo), diffuse(&mut scene, 0.3));
    cuboid(&mut scene, [0.0; 3], [4.0, 3.0, 2.5], true, wall);
    cuboid(&mut scene, [1.4, 1.0, 0.0], [2.4, 1.8, 0.9], false, dark);
    quad(&mut scene, [1.2, 1.0, 2.4], [0.0, 1.0, 0.0], [1.6, 0.0, 0.0], wall, emission(5.0));
    more(&mut scene);
    // From a corner, looking across the room and down.
    let eye = DVec3::new(0.3, 0.3, 1.6);
    let forward = (DVec3::new(2.6, 2.0, 0.6) - eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    scene.camera.to_world = DAffine3::from_cols(right, up, forward, eye);
    scene.camera.projection = Projection::Perspective { fov: 75.0 };
    scene
}

fn with_mirror(scene: &mut Scene) {
    let m = mirror(scene, 0.9);
    quad(scene, [3.9, 0.3, 0.3], [0.0, 2.4, 0.0], [0.0, 0.0, 1.8], m, None);
    sphere(scene, [3.0, 2.2, 0.5], 0.5, false, m, None);
}

fn with_varnish(scene: &mut Scene) {
    let zero = FloatParam::Constant(0.05);
    let coat = material(
        scene,
        MaterialKind::CoatedDiffuse {
            reflectance: RgbParam::Constant(Rgb::new(0.5, 0.3, 0.2)),
            roughness: Roughness { u: zero, v: zero, remap: false },
            eta: 1.5,
        },
    );
    cuboid(scene, [2.6, 1.2, 0.0], [3.6, 2.6, 0.6], false, coat);
}

/// The zones of a darker room of the same shape: too dark by a quarter or so, and noisy.
fn bad_zones(more: fn(&mut Scene)) -> Zones {
    let darker = World::new(room(0.5, more));
    Zones::solve(&darker, &ZoneOptions { budget: 600, particles: 1 << 14, seed: 2 })
}

/// Means of luminance and their variances, over replicates.
#[derive(Debug, PartialEq)]
struct Pictures {
    pixels: Vec<(f64, f64)>,
    /// Of the whole: pixels that share residuals err together.
    whole: (f64, f64),
}

/// Pictures of every replicate.
fn pictures(world: &World, zones: &Zones, mode: Mode, residual: Option<Residual>) -> Pictures {
    let plan = GatherPlan { rays: 8, shadow_rays: 2, strategy: Strategy::Jittered };
    let passes = if mode == Mode::Path { 24 } else { 4 };
    let mut all = vec![(0.0, 0.0); (SIDE * SIDE) as usize];
    let mut whole = (0.0, 0.0);
    for seed in 0..REPLICATES {
        let options = RenderOptions { mode, plan, seed: 100 * mode as u64 + seed, max_depth: u32::MAX };
        let mut renderer = Renderer::new(world, Some(zones), SIDE, SIDE, options);
        if let Some(residual) = residual {
            renderer = renderer.with_residual(residual);
        }
        let mut film = Film::new(SIDE, SIDE, [0, SIDE, 0, SIDE]);
        renderer.passes(&mut film, 0..passes, &AtomicU64::new(0));
        let mut mean = 0.0;
        film.for_each(|x, y, p| {
            let v = p.mean().luminance() as f64;
            let sums = &mut all[(y * SIDE + x) as usize];
            *sums = (sums.0 + v, sums.1 + v * v);
            mean += v / (SIDE * SIDE) as f64;
        });
        whole = (whole.0 + mean, whole.1 + mean * mean);
    }
    let n = REPLICATES as f64;
    let of = |(s, q): &(f64, f64)| (s / n, (q / n - (s / n).powi(2)).max(0.0) / (n - 1.0));
    Pictures { pixels: all.iter().map(of).collect(), whole: of(&whole) }
}

/// Pixels whose z is over the limit, and the z of the mean over all pixels.
fn disagreement(a: &Pictures, b: &Pictures) -> (usize, f64) {
    let z = |a: &(f64, f64), b: &(f64, f64)| (a.0 - b.0) / (a.1 + b.1).sqrt();
    let over = a.pixels.iter().zip(&b.pixels).filter(|(a, b)| z(a, b).abs() > LIMIT).count();
    (over, z(&a.whole, &b.whole))
}

#[test]
fn corrected_is_path_whatever_the_zones() {
    for (name, more) in
        [("diffuse", (|_| ()) as fn(&mut Scene)), ("mirrors", with_mirror), ("varnish", with_varnish)]
    {
        let world = World::new(room(0.7, more));
        let zones = bad_zones(more);
        let path = pictures(&world, &zones, Mode::Path, None);
        let good = disagreement(&pictures(&world, &zones, Mode::Corrected, Some(Residual::new(0.3))), &path);
        let zonal = disagreement(&pictures(&world, &zones, Mode::Zonal, None), &path);
        let turned = Residual { weight: -1.0, ..Residual::new(0.3) };
        let turned = disagreement(&pictures(&world, &zones, Mode::Corrected, Some(turned)), &path);
        println!(
            "{name}: pixels over the limit, z of the mean: corrected {good:?}, zonal {zonal:?}, sign turned {turned:?}"
        );
        assert!(good.0 == 0 && good.1.abs() < 4.4, "{name}: {good:?}");
        // Negative controls.
        assert!(zonal.0 > 0 || zonal.1.abs() > 4.4, "{name}: zones this bad must show ({zonal:?})");
        assert!(turned.0 > 0 || turned.1.abs() > 4.4, "{name}: the turned sign must show ({turned:?})");
    }
}

/// Residuals are shared by pixels of a square, which a part of the picture may cut.
#[test]
fn a_part_has_the_bits_of_the_whole() {
    let world = World::new(room(0.7, with_varnish));
    let zones = bad_zones(with_varnish);
    let plan = GatherPlan { rays: 8, shadow_rays: 2, strategy: Strategy::Adaptive };
    let options = RenderOptions { mode: Mode::Corrected, plan, seed: 3, max_depth: u32::MAX };
    let renderer = Renderer::new(&world, Some(&zones), SIDE, SIDE, options).with_residual(Residual::new(0.3));
    let pixels = |region: [u32; 4]| {
        let mut film = Film::new(SIDE, SIDE, region);
        renderer.passes(&mut film, 0..2, &AtomicU64::new(0));
        let mut all = Vec::new();
        film.for_each(|x, y, p| all.push(([x, y], p.mean())));
        all
    };
    let whole = pixels([0, SIDE, 0, SIDE]);
    let [x0, x1, y0, y1] = [3, 9, 2, 7];
    let part = pixels([x0, x1, y0, y1]);
    assert_eq!(part.len() as u32, (x1 - x0) * (y1 - y0));
    for (at, value) in part {
        let of_whole = whole.iter().find(|p| p.0 == at).expect("a pixel of the whole");
        assert_eq!(value, of_whole.1, "{at:?}");
    }
}

/// A share of 0 is mode zonal, bit for bit; the residual has random numbers of its own.
#[test]
fn no_share_is_zonal() {
    let world = World::new(room(0.7, |_| ()));
    let zones = bad_zones(|_| ());
    let zonal = pictures(&world, &zones, Mode::Zonal, None);
    assert_eq!(zonal, pictures(&world, &zones, Mode::Zonal, Some(Residual::NONE)));
    assert_ne!(zonal, pictures(&world, &zones, Mode::Zonal, Some(Residual::new(0.1))));
}

/// The study's bias is that of the zones: against the difference of pictures, and its share pays.
#[test]
fn the_zonal_bias_is_estimated() {
    let world = World::new(room(0.7, |_| ()));
    let zones = bad_zones(|_| ());
    let plan = GatherPlan { rays: 8, shadow_rays: 2, strategy: Strategy::Jittered };
    let options = RenderOptions { mode: Mode::Zonal, plan, seed: 1, max_depth: u32::MAX };
    let renderer = Renderer::new(&world, Some(&zones), SIDE, SIDE, options);
    let study = renderer.study([0, SIDE, 0, SIDE], 20_000);
    let mean = |p: Pictures| (p.whole.0, p.whole.1.sqrt());
    let zonal = mean(pictures(&world, &zones, Mode::Zonal, None));
    let path = mean(pictures(&world, &zones, Mode::Path, None));
    let truth = (zonal.0 - path.0) / zonal.0;
    let error = (study.bias_error.powi(2) + (path.1.powi(2) + zonal.1.powi(2)) / zonal.0.powi(2)).sqrt();
    println!(
        "bias {:.4} ± {:.4}, by pictures {truth:.4}; share {}",
        study.bias, study.bias_error, study.share
    );
    assert!((study.bias - truth).abs() < 4.4 * error, "{study:?}, truth {truth}, error {error}");
    assert!((0.02..=0.5).contains(&study.share));
    assert_eq!(study, renderer.study([0, SIDE, 0, SIDE], 20_000));
}

/// Sensors over zones this bad, with residuals: z-test against paths; without them the zones show.
#[test]
fn corrected_readings_are_those_of_paths() {
    let world = World::new(room(0.7, with_mirror));
    let zones = [bad_zones(with_mirror)];
    let options = |seed, n| SenseOptions {
        receiver: Receiver::Irradiance,
        goal: Goal::Gathers(n),
        limit: Duration::from_secs(60),
        seed,
        weights: [0.0, 1.0, 0.0],
    };
    let (p, n) = (Vec3::new(0.8, 2.4, 0.7), Vec3::new(0.3, -0.2, 0.9).normalize());
    let readings = |sense: &dyn Fn(u64) -> f64, count: u64| statistics(count as u32, |i| sense(i as u64));
    let path = readings(&|i| Sense::new(&world, &[], options(i, 256)).read(0, p, n).scalar, 24);
    let good = readings(&|i| Sense::corrected(&world, &zones, options(100 + i, 64)).read(0, p, n).scalar, 24);
    let zonal = readings(&|i| Sense::new(&world, &zones, options(200 + i, 64)).read(0, p, n).scalar, 24);
    // Led by the particles of another room: noise, and no bias.
    let led = readings(
        &|i| Sense::new(&world, &[], options(300 + i, 64)).steered(&zones[0]).read(0, p, n).scalar,
        24,
    );
    println!("path {path:?}, corrected {good:?}, led {led:?}, zonal {zonal:?}");
    let z = |a: (f64, f64), b: (f64, f64)| (a.0 - b.0) / a.1.hypot(b.1);
    assert!(z(good, path).abs() < 4.4 && z(led, path).abs() < 4.4);
    assert!(z(zonal, path).abs() > 4.4, "negative control");
    // A reading over zones says by how much they are off, beside its noise.
    let said = readings(
        &|i| {
            Sense::new(&world, &zones, options(400 + i, 64)).read(0, p, n).bias.map_or(f64::NAN, |b| b.scalar)
        },
        24,
    );
    let bias = (zonal.0 - path.0, zonal.1.hypot(path.1));
    println!("bias {said:?}, by readings {bias:?}");
    assert!(z(said, bias).abs() < 4.4 && said.0.abs() > 4.4 * said.1);
    let r = Sense::new(&world, &zones, options(500, 64)).read(0, p, n);
    assert!(r.bias.is_some_and(|b| (b.scalar - bias.0).abs() < 3.0 * b.half_width), "{r:?}");
    assert!(Sense::corrected(&world, &zones, options(500, 64)).read(0, p, n).bias.is_none());
}
