//! Time of one gather against the number of lamps: a hall with a sphere per square metre of ceiling.
//!
//!     cargo bench -p hemilux --bench lamps
//!
//! The light hierarchy makes it grow with the logarithm of their number.

use criterion::{Criterion, criterion_group, criterion_main};
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux_scene::geom::Vec3;
use hemilux_scene::import::{LoadOptions, load_pbrt_str};
use std::fmt::Write;
use std::hint::black_box;
use std::path::Path;

fn hall(lamps: u32) -> World {
    let mut text = String::from(
        "Camera \"perspective\"\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n",
    );
    text += "Shape \"bilinearmesh\" \"point3 P\" [-9 -9 0  42 -9 0  -9 42 0  42 42 0]\n";
    text += "AreaLightSource \"diffuse\" \"rgb L\" [90 90 90]\n";
    for i in 0..lamps {
        let _ = writeln!(
            text,
            "AttributeBegin Translate {} {} 2.5 Shape \"sphere\" \"float radius\" 0.03 AttributeEnd",
            i % 32,
            i / 32
        );
    }
    match load_pbrt_str(&text, Path::new("."), &LoadOptions::default()) {
        Ok(loaded) => World::new(loaded.scene),
        Err(e) => panic!("{e}"),
    }
}

fn lamps(c: &mut Criterion) {
    let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Sobol };
    for n in [1, 2, 4, 10, 100, 1000] {
        let world = hall(n);
        let walker = Walker::path(&world);
        let mut i = 0u32;
        c.bench_function(&format!("gather of 16 rays and 4 shadow rays, {n} lamps"), |b| {
            b.iter(|| {
                i = i.wrapping_add(1);
                let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(2));
                let mut sampler = Sampler::new(1, i as u64, 0);
                let p = Vec3::new(8.0 * u.u, 8.0 * u.v, 0.5);
                black_box(irradiance(&walker, p, Vec3::Z, &plan, &mut sampler, &mut Tally::default()))
            })
        });
    }
}

criterion_group!(benches, lamps);
criterion_main!(benches);
