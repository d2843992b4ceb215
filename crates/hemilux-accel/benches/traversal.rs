//! Rays per second, beside obvhs's trees on the same triangles and rays.
//!
//! `cargo bench -p hemilux-accel`; ratios within one run are what counts. Rays: *coherent* = a pinhole image in rows,
//! *incoherent* = a cosine ray from each of many random points in random order, *gather* = 64 cosine rays point after
//! point, *shadow* = segments between random pairs of visible points (any hit).

#[path = "../tests/suite/support.rs"]
mod support;

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::{Vec3, vec3};
use hemilux_accel::{Accel, Ray, offset_origin, triangle_normal, triangle_point};
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray as TheirRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use support::{Mesh, Random, bumpy_sphere, room};

const RAYS: usize = 16_384;

struct Rival<T> {
    tree: T,
    triangles: Vec<RtTriangle>,
}

fn triangles(mesh: &Mesh) -> Vec<Triangle> {
    (0..mesh.indices.len())
        .map(|i| {
            let [v0, v1, v2] = mesh.triangle(i).map(Into::into);
            Triangle { v0, v1, v2 }
        })
        .collect()
}

fn reordered(triangles: &[Triangle], order: &[u32]) -> Vec<RtTriangle> {
    order.iter().map(|&i| (&triangles[i as usize]).into()).collect()
}

fn cwbvh(mesh: &Mesh) -> Rival<CwBvh> {
    let all = triangles(mesh);
    let tree = build_cwbvh_from_tris(&all, BvhBuildParams::medium_build(), &mut Duration::default());
    Rival { triangles: reordered(&all, &tree.primitive_indices), tree }
}

fn bvh2(mesh: &Mesh) -> Rival<Bvh2> {
    let all = triangles(mesh);
    let tree = build_bvh2_from_tris(&all, BvhBuildParams::medium_build(), &mut Duration::default());
    Rival { triangles: reordered(&all, &tree.primitive_indices), tree }
}

fn their_ray(ray: &Ray) -> TheirRay {
    TheirRay::new(ray.origin.into(), ray.dir.into(), ray.t_min, ray.t_max)
}

struct Load {
    name: &'static str,
    rays: Vec<Ray>,
    any: bool,
}

/// A visible point and its normal towards the viewer.
fn visible(accel: &Accel, mesh: &Mesh, ray: &Ray) -> Option<(Vec3, Vec3, Vec3)> {
    let hit = accel.closest(ray)?;
    let t = mesh.triangle(hit.prim as usize);
    let n = triangle_normal(&t);
    let n = if n.dot(ray.dir) > 0.0 { -n } else { n };
    let (p, error) = triangle_point(&t, hit.u, hit.v);
    Some((p, error, n))
}

fn loads(accel: &Accel, mesh: &Mesh, eye: Vec3) -> Vec<Load> {
    let mut r = Random::new(1);
    let side = (RAYS as f32).sqrt() as usize;
    let pixel = |i: usize| {
        let (x, y) = ((i % side) as f32 / side as f32 - 0.5, (i / side) as f32 / side as f32 - 0.5);
        Ray::new(eye, vec3(x, 0.6, y).normalize())
    };
    let coherent = (0..RAYS).map(pixel).collect();
    let mut points = Vec::new();
    while points.len() < RAYS {
        let Some((p, _, n)) = visible(accel, mesh, &Ray::new(eye, r.direction())) else { continue };
        // Two bounces: points all over, not only those the eye sees.
        let Some(found) = visible(accel, mesh, &Ray::new(p + n * 1e-3, r.cosine(n))) else { continue };
        points.push(found);
    }
    let leave = |r: &mut Random, (p, error, n): (Vec3, Vec3, Vec3)| {
        let dir = r.cosine(n);
        Ray::new(offset_origin(p, error, n, dir), dir)
    };
    let incoherent = points.iter().map(|&s| leave(&mut r, s)).collect();
    let gather = (0..RAYS).map(|i| leave(&mut r, points[i / 64])).collect();
    let shadow = (0..RAYS)
        .map(|i| {
            let (a, b) = (points[i], points[r.below(RAYS)]);
            let d = b.0 - a.0;
            let origin = offset_origin(a.0, a.1, a.2, d);
            Ray { t_max: d.length() * 0.999, ..Ray::new(origin, d.normalize()) }
        })
        .collect();
    let load = |name, any, rays| Load { name, rays, any };
    vec![
        load("coherent", false, coherent),
        load("incoherent", false, incoherent),
        load("gather", false, gather),
        load("shadow", true, shadow),
    ]
}

fn traversal(c: &mut Criterion) {
    let scenes: [(&str, Mesh, Vec3); 3] = [
        ("room", room(), vec3(0.1, -1.0, 1.5)),
        ("sphere82k", bumpy_sphere(6), Vec3::ZERO),
        ("sphere1.3M", bumpy_sphere(8), Vec3::ZERO),
    ];
    for (scene, mesh, eye) in &scenes {
        let accel = mesh.accel();
        let (wide, binary) = (cwbvh(mesh), bvh2(mesh));
        for load in loads(&accel, mesh, *eye) {
            let mut group = c.benchmark_group(format!("{scene}/{}", load.name));
            group.throughput(Throughput::Elements(RAYS as u64));
            let rays = &load.rays;
            group.bench_function(BenchmarkId::from_parameter("accel"), |b| {
                b.iter(|| {
                    if load.any {
                        rays.iter().filter(|r| accel.occluded(r)).count()
                    } else {
                        rays.iter().filter(|r| black_box(accel.closest(r)).is_some()).count()
                    }
                });
            });
            group.bench_function(BenchmarkId::from_parameter("accel portable"), |b| {
                b.iter(|| {
                    if load.any {
                        rays.iter().filter(|r| accel.occluded_portable(r)).count()
                    } else {
                        rays.iter().filter(|r| black_box(accel.closest_portable(r)).is_some()).count()
                    }
                });
            });
            group.bench_function(BenchmarkId::from_parameter("obvhs CwBvh"), |b| {
                let hit = |ray: &TheirRay, i: usize| wide.triangles[i].intersect(ray);
                b.iter(|| {
                    let one = |r: &&Ray| {
                        if load.any {
                            return !wide.tree.ray_traverse_miss(their_ray(r), hit);
                        }
                        let mut found = RayHit::none();
                        wide.tree.ray_traverse(their_ray(r), &mut found, hit);
                        black_box(found).t.is_finite()
                    };
                    rays.iter().filter(one).count()
                });
            });
            group.bench_function(BenchmarkId::from_parameter("obvhs Bvh2"), |b| {
                let hit = |ray: &TheirRay, i: usize| binary.triangles[i].intersect(ray);
                b.iter(|| {
                    let one = |r: &&Ray| {
                        if load.any {
                            return !binary.tree.ray_traverse_miss(their_ray(r), hit);
                        }
                        let mut found = RayHit::none();
                        binary.tree.ray_traverse(their_ray(r), &mut found, hit);
                        black_box(found).t.is_finite()
                    };
                    rays.iter().filter(one).count()
                });
            });
            group.finish();
        }
    }
}

fn building(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    group.sample_size(10);
    for (name, mesh) in [("room", room()), ("sphere1.3M", bumpy_sphere(8))] {
        group.bench_function(BenchmarkId::new("accel", name), |b| b.iter(|| mesh.accel().memory_bytes()));
        group.bench_function(BenchmarkId::new("obvhs CwBvh", name), |b| {
            b.iter(|| cwbvh(&mesh).triangles.len())
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1000));
    targets = traversal, building
}
criterion_main!(benches);
