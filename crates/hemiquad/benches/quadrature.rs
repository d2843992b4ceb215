//! Nanoseconds per point of the maps, and bookkeeping per sample of the methods (with an integrand that costs nothing).

use criterion::{BenchmarkId, Criterion as Bench, Throughput, criterion_group, criterion_main};
use hemiquad::map::blocks::{Dir8, Uv8, concentric_all, cosine_all};
use hemiquad::map::{Concentric, Cosine, GgxVisible, Map, Octant, Polar, Sphere};
use hemiquad::method::*;
use hemiquad::{Criterion, Dir, Key, Method, Probe, Region, Shape, Uv, Workspace};
use std::hint::black_box;

const POINTS: usize = 1024;

fn maps(c: &mut Bench) {
    let uv: Vec<Uv> = (0..POINTS as u64).map(|i| Key::new(1).with(i).uniform2(0)).collect();
    let mut out = vec![Dir::<f32>::default(); POINTS];
    let mut group = c.benchmark_group("map");
    group.throughput(Throughput::Elements(POINTS as u64));
    macro_rules! scalar {
        ($name:expr, $map:expr) => {
            group.bench_function($name, |b| {
                b.iter(|| {
                    let map = black_box($map);
                    for (o, p) in out.iter_mut().zip(black_box(&uv)) {
                        *o = map.dir(*p);
                    }
                    black_box(&mut out);
                })
            });
        };
    }
    scalar!("theta-phi", Polar);
    scalar!("appendix octants", Octant);
    scalar!("concentric", Concentric);
    scalar!("cosine", Cosine);
    scalar!("sphere", Sphere);
    if let Some(ggx) = GgxVisible::new(Dir::from_unit(0.6f32, 0.0, 0.8), 0.3, 0.2) {
        scalar!("GGX visible normals", ggx);
    }
    let blocks: Vec<Uv8> = uv
        .chunks_exact(8)
        .map(|c| Uv8 { u: std::array::from_fn(|i| c[i].u), v: std::array::from_fn(|i| c[i].v) })
        .collect();
    let mut wide = vec![Dir8::default(); blocks.len()];
    group.bench_function("concentric 8-wide", |b| {
        b.iter(|| concentric_all(black_box(&blocks), black_box(&mut wide)))
    });
    group
        .bench_function("cosine 8-wide", |b| b.iter(|| cosine_all(black_box(&blocks), black_box(&mut wide))));
    let dirs: Vec<Dir> = uv.iter().map(|p| Concentric.dir(*p)).collect();
    let mut back = vec![Uv::<f32>::default(); POINTS];
    group.bench_function("concentric inverse", |b| {
        b.iter(|| {
            for (o, d) in back.iter_mut().zip(black_box(&dirs)) {
                *o = Concentric.uv(*d).unwrap_or_default();
            }
            black_box(&mut back);
        })
    });
    group.finish();
}

fn bookkeeping(c: &mut Bench) {
    let regions = [Region { shape: Shape::Disk { centre: Uv::new(0.4, 0.6), radius: 0.12 }, weight: 1.0 }];
    let mut trained = Trained::new();
    let f = |p: &Probe| {
        let (x, y) = (p.uv.u - 0.4, p.uv.v - 0.6);
        if x * x + y * y < 0.01 { 5.0 } else { p.uv.v }
    };
    for round in 0..3 {
        trained.learn(&mut { f }, 1000, 300, Key::new(round), Default::default());
    }
    let methods: [&dyn Method<f64>; 12] = [
        &Jittered,
        &Sobol,
        &Interlaced,
        &PainterSloan { criterion: Criterion::Contrast.into(), ..Default::default() },
        &PainterSloan { criterion: Criterion::Value.into(), ..Default::default() },
        &TwoStage::default(),
        &Sequential::default(),
        &Predicted::from_regions(&regions),
        &Predicted::from_partition(&trained),
        &BeyerLange::default(),
        &DelaunayAdaptive::default(),
        &Glassner::default(),
    ];
    let mut group = c.benchmark_group("bookkeeping");
    for n in [256u32, 1024, 4096] {
        group.throughput(Throughput::Elements(n as u64));
        for m in methods {
            let mut work = Workspace::new();
            group.bench_with_input(BenchmarkId::new(m.name(), n), &n, |b, n| {
                let mut key = 0;
                b.iter(|| {
                    key += 1;
                    black_box(m.integrate(&mut { f }, *n, Key::new(key), &mut work))
                })
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Bench::default()
        .sample_size(20)
        .warm_up_time(std::time::Duration::from_millis(300))
        .measurement_time(std::time::Duration::from_millis(700));
    targets = maps, bookkeeping
}
criterion_main!(benches);
