//! Everything against brute force in `f64`, and the two instruction-set paths against each other.

use crate::support::{Mesh, Random, bumpy_sphere, icosphere, room};
use glam::{DAffine3, DQuat, DVec3, Vec3, vec3};
use hemilux_accel::{Accel, Group, GroupBuilder, Hit, NO_INSTANCE, Quadric, Ray, SceneBuilder};

/// Möller and Trumbore in `f64`.
fn triangle(ray: &Ray, [a, b, c]: [Vec3; 3], to_world: &DAffine3) -> Option<(f64, f64, f64)> {
    let place = |p: Vec3| to_world.transform_point3(p.as_dvec3());
    let (a, b, c) = (place(a), place(b), place(c));
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    let (e1, e2, s) = (b - a, c - a, o - a);
    let p = d.cross(e2);
    let det = e1.dot(p);
    let (u, v) = (s.dot(p) / det, d.dot(s.cross(e1)) / det);
    let t = e2.dot(s.cross(e1)) / det;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some((t, u, v))
}

struct Oracle {
    triangles: Vec<([Vec3; 3], DAffine3, u32, u32)>,
}

impl Oracle {
    /// The nearest hit and how clearly it is one: the smallest barycentric coordinate.
    fn closest(&self, ray: &Ray) -> Option<(f64, f64, u32, u32)> {
        let mut best: Option<(f64, f64, u32, u32)> = None;
        for (v, to_world, prim, instance) in &self.triangles {
            if let Some((t, a, b)) = triangle(ray, *v, to_world)
                && t > f64::from(ray.t_min)
                && t < f64::from(ray.t_max)
                && best.is_none_or(|h| t < h.0)
            {
                best = Some((t, a.min(b).min(1.0 - a - b), *prim, *instance));
            }
        }
        best
    }
}

fn same(a: Option<Hit>, b: Option<Hit>) -> bool {
    let bits = |h: Hit| (h.t.to_bits(), h.u.to_bits(), h.v.to_bits(), h.prim, h.instance);
    a.map(bits) == b.map(bits)
}

/// Returns the number of hits compared.
fn compare(accel: &Accel, oracle: &Oracle, rays: impl Iterator<Item = Ray>, tolerance: f64) -> usize {
    let (mut hits, mut unclear, mut total) = (0, 0, 0);
    for ray in rays {
        let hit = accel.closest(&ray);
        assert!(same(hit, accel.closest_portable(&ray)), "paths differ for {ray:?}");
        assert_eq!(accel.occluded(&ray), hit.is_some(), "{ray:?}");
        assert_eq!(accel.occluded_portable(&ray), hit.is_some(), "{ray:?}");
        total += 1;
        match (hit, oracle.closest(&ray)) {
            (None, None) => {}
            (Some(h), Some((t, clear, prim, instance))) => {
                let close = (f64::from(h.t) - t).abs() <= tolerance * (1.0 + t);
                if close && (h.prim, h.instance) == (prim, instance) {
                    hits += 1;
                } else if close || clear < tolerance {
                    unclear += 1;
                } else {
                    // The nearest by rounding may pass beside an edge: then the oracle agrees about the triangle found.
                    let found = oracle.triangles.iter().find(|x| (x.2, x.3) == (h.prim, h.instance)).unwrap();
                    let again = triangle(&ray, found.0, &found.1);
                    assert!(again.is_none(), "{ray:?}: {h:?} but {t} {prim} {instance}");
                    unclear += 1;
                }
            }
            (h, o) => {
                assert!(o.is_none_or(|o| o.1 < tolerance), "{ray:?}: {h:?} but {o:?}");
                unclear += 1;
            }
        }
    }
    assert!(unclear * 1000 <= total, "{unclear} of {total} undecided");
    hits
}

fn soup(seed: u64, n: usize, size: f32) -> Mesh {
    let mut r = Random::new(seed);
    let mut mesh = Mesh::default();
    for _ in 0..n {
        let c = r.point(1.0);
        let base = mesh.positions.len() as u32;
        mesh.positions.extend((0..3).map(|_| c + Vec3::ZERO).collect::<Vec<_>>());
        for k in 0..3 {
            mesh.positions[base as usize + k] += r.point(size);
        }
        mesh.indices.push([base, base + 1, base + 2]);
    }
    mesh
}

fn group(mesh: &Mesh) -> Group {
    let mut g = GroupBuilder::new();
    g.add_mesh(&mesh.positions, &mesh.indices);
    g.build()
}

fn oracle(mesh: &Mesh) -> Oracle {
    let all = (0..mesh.indices.len()).map(|i| (mesh.triangle(i), DAffine3::IDENTITY, i as u32, NO_INSTANCE));
    Oracle { triangles: all.collect() }
}

fn rays(seed: u64, n: usize, size: f32) -> impl Iterator<Item = Ray> {
    let mut r = Random::new(seed);
    (0..n).map(move |i| {
        let origin = r.point(size);
        let mut ray = Ray::new(origin, r.direction());
        if i % 4 == 1 {
            ray.dir[r.below(3)] = 0.0;
            ray.dir = ray.dir.try_normalize().unwrap_or(Vec3::X);
        }
        if i % 4 == 2 {
            (ray.t_min, ray.t_max) = (0.3 * size * r.unit(), 2.0 * size * r.unit());
        }
        ray
    })
}

#[test]
fn soups_of_any_count() {
    for (seed, n) in [0, 1, 2, 3, 7, 8, 9, 17, 64, 65, 500].into_iter().enumerate() {
        let mesh = soup(seed as u64, n, 0.4);
        let hits = compare(&mesh.accel(), &oracle(&mesh), rays(90 + seed as u64, 4000, 1.5), 1e-5);
        assert!(hits >= 5 * n.min(100), "{hits} hits among {n}");
    }
}

#[test]
fn meshes() {
    for (seed, mesh) in [room(), icosphere(3), bumpy_sphere(3)].into_iter().enumerate() {
        let hits = compare(&mesh.accel(), &oracle(&mesh), rays(7 + seed as u64, 8000, 1.1), 1e-5);
        assert!(hits > 3000, "{hits}");
    }
}

#[test]
fn direction_of_any_length() {
    let mesh = soup(3, 200, 0.5);
    let accel = mesh.accel();
    for scale in [1e-12f32, 1e-3, 0.37, 1.0, 512.0, 1e12] {
        let scaled = rays(5, 3000, 1.5).map(|r| Ray {
            dir: r.dir * scale,
            t_min: r.t_min / scale,
            t_max: r.t_max / scale,
            ..r
        });
        for ray in scaled {
            let unit =
                Ray { dir: ray.dir / scale, t_min: ray.t_min * scale, t_max: ray.t_max * scale, ..ray };
            match (accel.closest(&ray), accel.closest(&unit)) {
                (Some(a), Some(b)) if a.prim == b.prim => {
                    assert!((a.t * scale - b.t).abs() < 1e-5 * b.t.max(1.0), "{a:?} {b:?}");
                }
                (None, None) => {}
                (a, b) => {
                    let bound = |h: Option<Hit>| h.is_none_or(|h| h.u.min(h.v).min(1.0 - h.u - h.v) < 1e-5);
                    assert!(bound(a) || bound(b), "{ray:?}: {a:?} {b:?}");
                }
            }
        }
    }
}

#[test]
fn instances_of_meshes_among_world_geometry() {
    let mut r = Random::new(11);
    let (world, parts) = (soup(1, 60, 0.3), [soup(2, 40, 0.6), icosphere(1)]);
    let mut scene = SceneBuilder::new(group(&world));
    let mut expected = oracle(&world);
    let groups = [scene.add_group(group(&parts[0])), scene.add_group(group(&parts[1]))];
    for i in 0..40 {
        let which = r.below(2);
        let stretch = DVec3::from_array([0, 1, 2].map(|_| 0.1 + 0.3 * f64::from(r.unit())));
        let mirrored = stretch * if r.below(2) == 0 { DVec3::ONE } else { DVec3::new(-1.0, 1.0, 1.0) };
        let turn = DQuat::from_axis_angle(r.direction().as_dvec3(), f64::from(r.unit()) * 6.0);
        let place = DAffine3::from_scale_rotation_translation(mirrored, turn, r.point(1.5).as_dvec3());
        assert_eq!(scene.add_instance(groups[which], place), i);
        let mesh = &parts[which];
        expected.triangles.extend((0..mesh.indices.len()).map(|k| (mesh.triangle(k), place, k as u32, i)));
    }
    let accel = scene.build();
    let hits = compare(&accel, &expected, rays(3, 10_000, 2.0), 3e-5);
    assert!(hits > 2000, "{hits}");
}

#[test]
fn empty_and_impossible_scenes() {
    let empty = SceneBuilder::new(GroupBuilder::new().build()).build();
    let ray = Ray::new(Vec3::ZERO, Vec3::X);
    assert!(empty.closest(&ray).is_none() && !empty.occluded(&ray) && empty.bounds().is_empty());

    let mut scene = SceneBuilder::new(GroupBuilder::new().build());
    let ball = scene.add_group(group(&icosphere(1)));
    let nothing = scene.add_group(GroupBuilder::new().build());
    scene.add_instance(nothing, DAffine3::IDENTITY);
    scene.add_instance(77, DAffine3::IDENTITY);
    scene.add_instance(ball, DAffine3::from_scale(DVec3::ZERO));
    scene.add_instance(ball, DAffine3::from_scale(DVec3::NAN));
    scene.add_instance(ball, DAffine3::from_translation(DVec3::INFINITY));
    let last = scene.add_instance(ball, DAffine3::IDENTITY);
    let hit = scene.build().closest(&ray).unwrap();
    assert_eq!(hit.instance, last);
    assert!((hit.t - 1.0).abs() < 0.1);
}

#[test]
fn numbers_follow_the_order_of_addition() {
    let one = |z: f32| [vec3(-1.0, -1.0, z), vec3(2.0, -1.0, z), vec3(-1.0, 2.0, z)];
    let disk = Quadric::Disk { height: 0.0, radius: 0.5, inner_radius: 0.0, phi_max: std::f64::consts::TAU };
    let mut g = GroupBuilder::new();
    assert_eq!(g.add_mesh(&one(1.0), &[[0, 1, 2]]), 0..1);
    assert_eq!(g.add_quadric(disk, DAffine3::from_translation(DVec3::Z * 2.0)), 1);
    assert_eq!(g.add_mesh(&[], &[]), 2..2);
    // Out of range, degenerate, not finite, good.
    let mut positions = one(3.0).to_vec();
    positions.push(Vec3::NAN);
    assert_eq!(g.add_mesh(&positions, &[[0, 1, 9], [0, 0, 1], [0, 1, 3], [0, 1, 2]]), 2..6);
    let accel = SceneBuilder::new(g.build()).build();
    let at = |z: f32| accel.closest(&Ray::new(vec3(0.1, 0.1, z), Vec3::Z)).map(|h| (h.prim, h.t));
    assert_eq!(at(0.0), Some((0, 1.0)));
    assert_eq!(at(1.5), Some((1, 0.5)));
    assert_eq!(at(2.5), Some((5, 0.5)));
    assert_eq!(at(3.5), None);
}

#[test]
fn barycentric_coordinates_rebuild_the_point() {
    let mesh = soup(8, 300, 0.5);
    let accel = mesh.accel();
    for ray in rays(2, 5000, 1.5) {
        if let Some(h) = accel.closest(&ray) {
            let [a, b, c] = mesh.triangle(h.prim as usize).map(Vec3::as_dvec3);
            let p = a + (b - a) * f64::from(h.u) + (c - a) * f64::from(h.v);
            let q = ray.origin.as_dvec3() + ray.dir.as_dvec3() * f64::from(h.t);
            assert!(p.distance(q) < 1e-6 * (1.0 + q.length()), "{p} {q}");
        }
    }
}

#[test]
fn not_a_number_neither_panics_nor_hits() {
    let mut mesh = soup(4, 100, 0.5);
    for (i, bad) in
        [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, 1e-45].into_iter().enumerate()
    {
        mesh.positions[i * 7].x = bad;
    }
    let accel = mesh.accel();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            let mut ray = Ray::new(Vec3::ZERO, Vec3::X);
            ray.origin[axis] = bad;
            assert!(accel.closest(&ray).is_none());
            let mut ray = Ray::new(Vec3::ZERO, Vec3::X);
            ray.dir[axis] = bad;
            assert!(accel.closest(&ray).is_none() && !accel.occluded(&ray));
        }
        let ray = Ray { t_max: bad, t_min: bad, ..Ray::new(Vec3::ZERO, Vec3::X) };
        assert!(accel.closest(&ray).is_none());
    }
    assert!(accel.closest(&Ray::new(Vec3::ZERO, Vec3::ZERO)).is_none());
    let mut r = Random::new(1);
    for _ in 0..2000 {
        let odd = |r: &mut Random| f32::from_bits(r.bits());
        let ray = Ray {
            origin: vec3(odd(&mut r), odd(&mut r), odd(&mut r)),
            dir: vec3(odd(&mut r), odd(&mut r), odd(&mut r)),
            t_min: odd(&mut r),
            t_max: odd(&mut r),
        };
        assert!(same(accel.closest(&ray), accel.closest_portable(&ray)), "{ray:?}");
    }
}
