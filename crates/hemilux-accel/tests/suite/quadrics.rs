//! Spheres, disks and cylinders: precision, limits, closedness.

use std::f64::consts::{PI, TAU};

use crate::support::Random;
use glam::{DAffine3, DQuat, DVec3, Vec3, vec3};
use hemilux_accel::{
    Accel, GroupBuilder, Quadric, Ray, SceneBuilder, offset_origin, rounding_error, transform_error,
};

fn sphere(radius: f64) -> Quadric {
    Quadric::Sphere { radius, z_min: -radius, z_max: radius, phi_max: TAU }
}

fn world(shapes: &[(Quadric, DAffine3)]) -> Accel {
    let mut g = GroupBuilder::new();
    for (q, m) in shapes {
        g.add_quadric(*q, *m);
    }
    SceneBuilder::new(g.build()).build()
}

fn uniform(r: &mut Random, lo: f64, hi: f64) -> f64 {
    lo + (hi - lo) * f64::from(r.unit())
}

/// A rigid motion.
fn motion(r: &mut Random, reach: f32) -> DAffine3 {
    let turn = DQuat::from_axis_angle(r.direction().as_dvec3().normalize(), uniform(r, 0.0, TAU));
    DAffine3::from_rotation_translation(turn, r.point(reach).as_dvec3())
}

/// Distance of `p` from the line of the ray.
fn off_ray(ray: &Ray, p: DVec3) -> f64 {
    let (o, d) = (ray.origin.as_dvec3(), ray.dir.as_dvec3());
    (p - o).cross(d).length() / d.length()
}

#[test]
fn spheres_of_every_size_from_every_distance() {
    let mut r = Random::new(1);
    // Radius and distance of the eye: a pin-point lamp, scenes from centimetres to tens of kilometres.
    for (radius, distance) in
        [(1e-4, 4.0), (1e-2, 1e2), (1e-6, 1e-2), (1.0, 1.5), (0.5, 1e4), (1e4, 2e4), (1e3, 1.0001e3)]
    {
        let mut hits = 0;
        for _ in 0..2000 {
            let place = motion(&mut r, distance as f32 * 0.1);
            let accel = world(&[(sphere(radius), place)]);
            let c = place.translation;
            let origin = (c + r.direction().as_dvec3() * distance).as_vec3();
            let target = c + r.direction().as_dvec3() * (radius * uniform(&mut r, 0.0, 1.2));
            let ray = Ray::new(origin, (target - origin.as_dvec3()).normalize().as_vec3());
            let miss = off_ray(&ray, c) / radius;
            if (c - origin.as_dvec3()).dot(ray.dir.as_dvec3()) < 0.0 {
                assert!(accel.closest(&ray).is_none());
                continue;
            }
            let Some(hit) = accel.closest(&ray) else {
                assert!(miss > 1.0 - 1e-9, "{radius} from {distance}: lost at {miss}");
                continue;
            };
            assert!(miss < 1.0 + 1e-9, "{radius} from {distance}: hit at {miss}");
            let s = sphere(radius).eval(hit.u.into(), hit.v.into());
            let p = place.transform_point3(s.position);
            assert!((s.position.length() - radius).abs() < 1e-15 * radius * 4.0);
            assert!(off_ray(&ray, p) < 3e-7 * radius + 1e-15 * distance, "{}", off_ray(&ray, p) / radius);
            // The near side.
            let normal = place.transform_vector3(s.normal);
            assert!(normal.dot(ray.dir.as_dvec3()) < 1e-3 || distance < radius);
            hits += 1;
        }
        assert!(hits > 500, "{radius} from {distance}: {hits}");
    }
}

#[test]
fn sphere_parameters_keep_their_precision_at_the_poles() {
    let mut r = Random::new(2);
    let radius = 1.0;
    let accel = world(&[(sphere(radius), DAffine3::IDENTITY)]);
    let mut worst_by_height = 0.0f64;
    for i in 0..20_000 {
        let pole = if i % 2 == 0 { 1.0 } else { -1.0 };
        let rho = 10f64.powf(uniform(&mut r, -7.0, -1.0));
        let phi = uniform(&mut r, 0.0, TAU);
        let origin = (DVec3::new(rho * phi.cos(), rho * phi.sin(), 3.0 * pole)).as_vec3();
        let ray = Ray::new(origin, vec3(0.0, 0.0, -pole as f32));
        let hit = accel.closest(&ray).unwrap();
        let p = sphere(radius).eval(hit.u.into(), hit.v.into()).position;
        let (x, y) = (f64::from(origin.x), f64::from(origin.y));
        let exact = DVec3::new(x, y, pole * (1.0 - x * x - y * y).sqrt());
        assert!(p.distance(exact) < 3e-7, "{} at rho {rho}", p.distance(exact));
        // The control: a height rounded to f32 could not do it.
        let z = 2.0 * f64::from(((exact.z + 1.0) * 0.5) as f32) - 1.0;
        worst_by_height = worst_by_height.max(((1.0 - z * z).max(0.0).sqrt() - rho).abs());
    }
    assert!(worst_by_height > 1e-4);
}

fn random_shape(r: &mut Random) -> Quadric {
    let phi_max = if r.below(2) == 0 { TAU } else { uniform(r, 0.3, 6.0) };
    let radius = uniform(r, 0.3, 1.5);
    let (z_min, z_max) = (uniform(r, -1.0, -0.1) * radius, uniform(r, -0.05, 1.0) * radius);
    match r.below(3) {
        0 => Quadric::Sphere { radius, z_min, z_max, phi_max },
        1 => Quadric::Disk { height: z_min, radius, inner_radius: radius * uniform(r, 0.0, 0.9), phi_max },
        _ => Quadric::Cylinder { radius, z_min, z_max, phi_max },
    }
}

/// All crossings with the whole shape by the textbook formula, and how far each is inside the limits (negative: outside).
fn crossings(q: &Quadric, o: DVec3, d: DVec3) -> Vec<(f64, f64)> {
    let quadratic = |a: f64, b: f64, c: f64| {
        let root = (b * b - 4.0 * a * c).sqrt();
        vec![(-b - root) / (2.0 * a), (-b + root) / (2.0 * a)]
    };
    let angle = |p: DVec3, phi_max: f64| {
        let phi = p.y.atan2(p.x).rem_euclid(TAU);
        if phi_max >= TAU { 1.0 } else { (phi_max - phi).min(phi.max((phi - PI).abs())).min(phi) }
    };
    let (ts, limits): (Vec<f64>, Box<dyn Fn(DVec3) -> f64>) = match *q {
        Quadric::Sphere { radius, z_min, z_max, phi_max } => (
            quadratic(d.dot(d), 2.0 * o.dot(d), o.dot(o) - radius * radius),
            Box::new(move |p| (p.z - z_min).min(z_max - p.z).min(angle(p, phi_max))),
        ),
        Quadric::Disk { height, radius, inner_radius, phi_max } => (
            vec![(height - o.z) / d.z],
            Box::new(move |p| {
                let rho = p.x.hypot(p.y);
                (radius - rho).min(rho - inner_radius).min(angle(p, phi_max))
            }),
        ),
        Quadric::Cylinder { radius, z_min, z_max, phi_max } => (
            quadratic(
                d.x * d.x + d.y * d.y,
                2.0 * (o.x * d.x + o.y * d.y),
                o.x * o.x + o.y * o.y - radius * radius,
            ),
            Box::new(move |p| (p.z - z_min).min(z_max - p.z).min(angle(p, phi_max))),
        ),
    };
    ts.into_iter().filter(|t| t.is_finite()).map(|t| (t, limits(o + d * t))).collect()
}

#[test]
fn partial_shapes_against_the_textbook() {
    let mut r = Random::new(3);
    let (mut hits, mut unclear) = (0, 0);
    for _ in 0..300 {
        let shapes: Vec<_> =
            (0..1 + r.below(12)).map(|_| (random_shape(&mut r), motion(&mut r, 2.0))).collect();
        let accel = world(&shapes);
        for _ in 0..200 {
            let origin = r.point(3.0);
            let ray = Ray::new(origin, (r.point(2.0) - origin).normalize());
            let mut all = Vec::new();
            for (i, (q, m)) in shapes.iter().enumerate() {
                let back = m.inverse();
                let o = back.transform_point3(ray.origin.as_dvec3());
                let d = back.transform_vector3(ray.dir.as_dvec3());
                all.extend(
                    crossings(q, o, d).into_iter().filter(|c| c.0 > 0.0).map(|(t, inside)| (t, inside, i)),
                );
            }
            if all.iter().any(|c| c.1.abs() < 1e-6) {
                unclear += 1;
                continue;
            }
            let nearest = all.iter().filter(|c| c.1 > 0.0).min_by(|a, b| a.0.total_cmp(&b.0));
            let hit = accel.closest(&ray);
            assert_eq!(hit.is_some(), accel.occluded(&ray));
            assert_eq!(hit, accel.closest_portable(&ray));
            match (hit, nearest) {
                (None, None) => {}
                (Some(h), Some(&(t, _, i))) => {
                    assert!((f64::from(h.t) - t).abs() < 1e-5, "{h:?} {t}");
                    assert_eq!(h.prim as usize, i);
                    let s = shapes[i].0.eval(h.u.into(), h.v.into());
                    assert!(off_ray(&ray, shapes[i].1.transform_point3(s.position)) < 1e-6);
                    hits += 1;
                }
                (h, n) => panic!("{ray:?}: {h:?} but {n:?}"),
            }
        }
    }
    assert!(hits > 10_000 && unclear < 300, "{hits} {unclear}");
}

#[test]
fn derivatives_are_those_of_the_map() {
    let mut r = Random::new(4);
    for _ in 0..500 {
        let q = random_shape(&mut r);
        let (u, v) = (uniform(&mut r, 0.01, 0.99), uniform(&mut r, 0.01, 0.99));
        let s = q.eval(u, v);
        let h = 1e-5;
        let du = (q.eval(u + h, v).position - q.eval(u - h, v).position) / (2.0 * h);
        let dv = (q.eval(u, v + h).position - q.eval(u, v - h).position) / (2.0 * h);
        assert!(du.distance(s.dpdu) < 1e-7 && dv.distance(s.dpdv) < 1e-7);
        assert!((s.normal.length() - 1.0).abs() < 1e-14);
        assert!(s.normal.dot(s.dpdu).abs() < 1e-12 && s.normal.dot(s.dpdv).abs() < 1e-12);
    }
}

#[test]
fn a_closed_can_does_not_leak_at_its_rims() {
    let mut r = Random::new(5);
    for _ in 0..100 {
        let (radius, top) = (uniform(&mut r, 0.1, 3.0), uniform(&mut r, 0.1, 3.0));
        let place = motion(&mut r, 10.0);
        let disk = |height| Quadric::Disk { height, radius, inner_radius: 0.0, phi_max: TAU };
        let side = Quadric::Cylinder { radius, z_min: 0.0, z_max: top, phi_max: TAU };
        let accel = world(&[(disk(0.0), place), (disk(top), place), (side, place)]);
        let origin = place.transform_point3(DVec3::new(0.1 * radius, 0.0, 0.5 * top)).as_vec3();
        for i in 0..2000 {
            let phi = uniform(&mut r, 0.0, TAU);
            let rim = DVec3::new(radius * phi.cos(), radius * phi.sin(), if i % 2 == 0 { 0.0 } else { top });
            let dir = if i % 3 == 0 {
                r.direction()
            } else {
                (place.transform_point3(rim) - origin.as_dvec3()).normalize().as_vec3()
            };
            assert!(accel.occluded(&Ray::new(origin, dir)));
        }
    }
}

/// Spawns rays from points of spheres; counts those that meet the near side again, or from inside nothing.
fn wrong_side(spawn: impl Fn(Vec3, Vec3, Vec3, Vec3) -> Vec3) -> (usize, usize) {
    let mut r = Random::new(6);
    let (mut again, mut lost) = (0, 0);
    for _ in 0..3000 {
        let scale = 10f64.powf(uniform(&mut r, -2.0, 4.0));
        let radius = scale * 10f64.powf(uniform(&mut r, -2.0, 0.0));
        let place = motion(&mut r, scale as f32);
        let accel = world(&[(sphere(radius), place)]);
        for _ in 0..10 {
            let s = sphere(radius).eval(r.unit().into(), r.unit().into());
            let (p, error) = transform_error(&place, s.position, DVec3::ZERO);
            let n = place.transform_vector3(s.normal).as_vec3();
            let mut dir = r.direction();
            if r.below(2) == 0 {
                dir = (dir - n * dir.dot(n) * (1.0 - 0.01 * r.unit())).normalize();
            }
            let out = dir.dot(n) >= 0.0;
            let hit = accel.closest(&Ray::new(spawn(p, error, n, dir), dir));
            if out {
                again += usize::from(hit.is_some());
            } else if dir.dot(n) < -1e-3 {
                let chord = -2.0 * f64::from(dir.dot(n)) * radius;
                lost += usize::from(hit.is_none_or(|h| f64::from(h.t) < 0.5 * chord));
            }
        }
    }
    (again, lost)
}

#[test]
fn spawned_rays_do_not_meet_their_sphere() {
    assert_eq!(wrong_side(offset_origin), (0, 0));
    let (again, lost) = wrong_side(|p, _, _, _| p);
    assert!(again > 100 && lost > 100, "the rays are too easy: {again} {lost}");
}

#[test]
fn rounding_is_bounded() {
    let mut r = Random::new(7);
    for _ in 0..10_000 {
        let exact = r.direction().as_dvec3() * 10f64.powf(uniform(&mut r, -30.0, 30.0)) * PI;
        let p = exact.as_vec3();
        assert!((p.as_dvec3() - exact).abs().cmple(rounding_error(p).as_dvec3()).all());
    }
}

#[test]
fn quadrics_within_instances() {
    let mut r = Random::new(8);
    for _ in 0..200 {
        let mut g = GroupBuilder::new();
        g.add_quadric(sphere(0.25), DAffine3::from_translation(DVec3::X));
        let mut scene = SceneBuilder::new(GroupBuilder::new().build());
        let ball = scene.add_group(g.build());
        let place = motion(&mut r, 5.0) * DAffine3::from_scale(DVec3::splat(uniform(&mut r, 0.1, 10.0)));
        scene.add_instance(ball, place);
        let accel = scene.build();
        let centre = place.transform_point3(DVec3::X);
        let radius = place.transform_vector3(DVec3::X).length() * 0.25;
        for _ in 0..100 {
            let origin = r.point(10.0);
            let target = centre + r.direction().as_dvec3() * radius * 1.2;
            let ray = Ray::new(origin, (target - origin.as_dvec3()).normalize().as_vec3());
            let miss = off_ray(&ray, centre) / radius;
            let inside = origin.as_dvec3().distance(centre) < radius;
            let ahead = (centre - origin.as_dvec3()).dot(ray.dir.as_dvec3()) > 0.0;
            if (miss - 1.0).abs() > 1e-6 {
                assert_eq!(accel.occluded(&ray), inside || (ahead && miss < 1.0));
            }
        }
    }
}

#[test]
fn impossible_shapes_are_not_hit() {
    let bad = [f64::NAN, f64::INFINITY, -1.0, 0.0];
    for x in bad {
        for m in [DAffine3::IDENTITY, DAffine3::from_scale(DVec3::ZERO), DAffine3::from_scale(DVec3::NAN)] {
            let accel = world(&[
                (Quadric::Sphere { radius: x, z_min: -x, z_max: x, phi_max: x }, m),
                (Quadric::Disk { height: x, radius: x, inner_radius: x, phi_max: x }, m),
                (Quadric::Cylinder { radius: x, z_min: x, z_max: x, phi_max: x }, m),
            ]);
            for dir in [Vec3::X, Vec3::Z, vec3(0.6, 0.0, -0.8)] {
                assert!(accel.closest(&Ray::new(vec3(-0.1, 0.2, 0.3), dir)).is_none());
            }
        }
    }
}
