//! Kernels of the renderer: a zone look-up, one gather (plain and over zones), one path, one particle.
//!
//!     cargo bench -p hemilux
//!
//! The scene is a room of 12 triangles with a lamp and a mirror ball, built in code.

use criterion::{Criterion, criterion_group, criterion_main};
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Arrival, Start, Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::import::{LoadOptions, load_pbrt_str};
use std::hint::black_box;
use std::path::Path;

const ROOM: &str = r#"
LookAt 2 1 1.2  2 4 1  0 0 1
Camera "perspective" "float fov" 60
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.7 0.6 0.5 ]
Shape "trianglemesh" "point3 P" [ 0 0 0  4 0 0  4 4 0  0 4 0  0 0 3  4 0 3  4 4 3  0 4 3 ]
  "integer indices" [ 0 1 2 0 2 3  4 6 5 4 7 6  0 5 1 0 4 5  3 2 6 3 6 7  0 3 7 0 7 4  1 5 6 1 6 2 ]
AttributeBegin
  Translate 2.6 2.5 0.4
  Material "conductor" "rgb reflectance" [ 0.9 0.9 0.9 ]
  Shape "sphere" "float radius" 0.4
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Translate 1.5 2 2.5
  Shape "sphere" "float radius" 0.1
AttributeEnd
"#;

fn room() -> World {
    match load_pbrt_str(ROOM, Path::new("."), &LoadOptions::default()) {
        Ok(loaded) => World::new(loaded.scene),
        Err(e) => panic!("{e}"),
    }
}

fn kernels(c: &mut Criterion) {
    let world = room();
    let options = ZoneOptions { budget: 20_000, particles: 1 << 17, seed: 1 };
    let zones = Zones::solve(&world, &options);
    let point = |i: u32| {
        let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(2));
        Vec3::new(0.2 + 3.6 * u.u, 0.2 + 3.6 * u.v, 0.001)
    };
    let surfaces: Vec<_> = (0..1024)
        .filter_map(|i| {
            let d = Vec3::new((i % 32) as f32 - 15.5, 20.0, (i / 32) as f32 - 15.5).normalize();
            world.closest(Vec3::new(2.0, 1.0, 1.2), d, f32::INFINITY)
        })
        .collect();
    let mut i = 0u32;
    c.bench_function("zone look-up, 1024 points", |b| {
        b.iter(|| {
            let mut sum = 0.0;
            for s in &surfaces {
                let place = zones.locate(&world, s, [0.3, 0.8]);
                sum += zones.irradiance(place.zone, place.side)[1];
            }
            black_box(sum)
        })
    });
    for (name, zones, strategy) in [
        ("gather of 64 rays over zones, jittered", Some(&zones), Strategy::Jittered),
        ("gather of 64 rays over zones, sobol", Some(&zones), Strategy::Sobol),
        ("gather of 64 rays continued as paths", None, Strategy::Jittered),
    ] {
        let walker = Walker { zones, ..Walker::path(&world) };
        let plan = GatherPlan { rays: 64, shadow_rays: 4, strategy };
        c.bench_function(name, |b| {
            b.iter(|| {
                i = i.wrapping_add(1);
                let mut sampler = Sampler::new(1, i as u64, 0);
                black_box(irradiance(&walker, point(i), Vec3::Z, &plan, &mut sampler, &mut Tally::default()))
            })
        });
    }
    let walker = Walker::path(&world);
    c.bench_function("one path", |b| {
        b.iter(|| {
            i = i.wrapping_add(1);
            let mut sampler = Sampler::new(1, i as u64, 0);
            let u = sampler.next2();
            let dir = Vec3::new(u[0] - 0.5, 1.0, u[1] - 0.5).normalize();
            let start =
                Start { origin: Vec3::new(2.0, 1.0, 1.2), dir, arrival: Arrival::Full, depth: 0, worth: 0.0 };
            black_box(walker.field_radiance(start, &mut sampler, &mut Tally::default()))
        })
    });
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread");
    c.bench_function("zonal solution, 65,536 particles, one thread", |b| {
        b.iter(|| {
            let options = ZoneOptions { budget: 20_000, particles: 1 << 16, seed: 1 };
            one.install(|| black_box(Zones::solve(&world, &options)))
        })
    });
}

criterion_group!(benches, kernels);
criterion_main!(benches);
