//! No ray leaves a closed mesh; no ray meets the surface it leaves.

use crate::support::{Mesh, Random, cuboid, icosphere};
use glam::{DAffine3, DQuat, DVec3, Vec3, vec3};
use hemilux_accel::{
    Accel, GroupBuilder, Ray, SceneBuilder, offset_origin, transform_error, triangle_normal, triangle_point,
};

/// The test most programs begin with, in `f32`: what the watertight one is measured against.
fn naive_hit([a, b, c]: [Vec3; 3], ray: &Ray) -> bool {
    let (e1, e2, s) = (b - a, c - a, ray.origin - a);
    let p = ray.dir.cross(e2);
    let inv = 1.0 / e1.dot(p);
    let (u, v) = (s.dot(p) * inv, ray.dir.dot(s.cross(e1)) * inv);
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && e2.dot(s.cross(e1)) * inv > ray.t_min
}

fn check(accel: &Accel, ray: &Ray) {
    assert!(accel.closest(ray).is_some(), "{ray:?} escapes");
    assert!(accel.occluded(ray), "{ray:?} sees out");
}

/// A closed mesh around the origin, at a random place and scale, and the point that was the origin.
fn closed(r: &mut Random, kind: usize) -> (Mesh, Vec3, f32) {
    let scale = 10f32.powf(6.0 * r.unit() - 2.0);
    let mesh = match kind % 3 {
        0 => cuboid(-Vec3::ONE - r.point(0.9), Vec3::ONE + r.point(0.9), 1 + r.below(4) as u32),
        1 => {
            let mut m = icosphere(r.below(4) as u32);
            m.positions.iter_mut().for_each(|p| *p *= 0.6 + 0.8 * r.unit());
            m
        }
        _ => {
            let squeeze = vec3(1.0, 0.003 + r.unit(), 0.003 + r.unit());
            icosphere(2).map(|p| p * squeeze)
        }
    };
    let away = if r.below(2) == 0 { 1.0 } else { 20.0 };
    let at = r.point(scale * away);
    (mesh.map(|p| p * scale + at), at, scale)
}

#[test]
fn random_rays_stay_inside() {
    let mut r = Random::new(1);
    for kind in 0..60 {
        let (mesh, inside, _) = closed(&mut r, kind);
        let accel = mesh.accel();
        for _ in 0..20_000 {
            check(&accel, &Ray::new(inside, r.direction()));
        }
    }
}

/// Rays to vertices and to points of edges, from `inside`.
fn aimed(r: &mut Random, mesh: &Mesh, inside: Vec3) -> Ray {
    let t = mesh.triangle(r.below(mesh.indices.len()));
    let k = r.below(3);
    let (a, b) = (t[k], t[(k + 1) % 3]);
    let target = match r.below(4) {
        0 => a,
        1 => (a + b) * 0.5,
        2 => a + (b - a) * r.unit(),
        _ => a + (b - a) * r.unit().powi(12),
    };
    let dir = target - inside;
    // Not normalised, vertices are met as exactly as floats allow.
    Ray::new(inside, if r.below(2) == 0 { dir } else { dir.normalize() })
}

#[test]
fn rays_at_edges_and_vertices_stay_inside() {
    let mut r = Random::new(2);
    let mut naive_leaks = 0;
    for kind in 0..60 {
        let (mesh, inside, _) = closed(&mut r, kind);
        let accel = mesh.accel();
        for i in 0..15_000 {
            let ray = aimed(&mut r, &mesh, inside);
            check(&accel, &ray);
            if i < 300 && !(0..mesh.indices.len()).any(|i| naive_hit(mesh.triangle(i), &ray)) {
                naive_leaks += 1;
            }
        }
    }
    assert!(naive_leaks > 20, "the rays are too easy: the naive test lost only {naive_leaks}");
}

#[test]
fn rays_through_exact_lattices_stay_inside() {
    // Integer vertices and origins: edges, vertices and planes are met exactly, also with zero components.
    let mesh = cuboid(Vec3::splat(-4.0), Vec3::splat(4.0), 8);
    let accel = mesh.accel();
    for origin in [Vec3::ZERO, vec3(1.0, 2.0, -3.0), vec3(0.0, 0.5, 3.0), vec3(3.0, 3.0, 3.0)] {
        for target in &mesh.positions {
            check(&accel, &Ray::new(origin, *target - origin));
            check(&accel, &Ray::new(origin, (*target - origin).normalize()));
        }
    }
}

#[test]
fn origins_close_to_a_far_larger_wall_stay_inside() {
    // Large triangles whose vertices are far away while the ray is nearly at the edge they share.
    let mut r = Random::new(3);
    for _ in 0..300 {
        let at = r.point(30.0);
        let mesh = cuboid(at - Vec3::splat(10.0), at + Vec3::splat(10.0), 2);
        let accel = mesh.accel();
        for _ in 0..1000 {
            let height = 10f32.powf(-4.0 * r.unit());
            let mut origin = at + r.point(9.0);
            let axis = r.below(3);
            origin[axis] = mesh.positions.iter().fold(f32::MAX, |m, p| m.min(p[axis])) + height;
            let mut target = origin + r.point(height * 3.0);
            target[axis] = origin[axis] - height;
            if r.below(2) == 0 {
                target[(axis + 1) % 3] = at[(axis + 1) % 3];
            }
            check(&accel, &Ray::new(origin, (target - origin).normalize()));
        }
    }
}

#[test]
fn a_missing_triangle_is_noticed() {
    let mut mesh = icosphere(2);
    let [a, b, c] = mesh.triangle(100);
    mesh.indices.remove(100);
    let ray = Ray::new(Vec3::ZERO, (a + b + c).normalize());
    assert!(mesh.accel().closest(&ray).is_none());
}

#[test]
fn degenerate_triangles_are_not_hit() {
    let mut r = Random::new(4);
    for _ in 0..200 {
        let a = (r.point(8.0) * 64.0).round() / 64.0;
        let step = (r.point(1.0) * 64.0).round() / 64.0;
        let positions = [a, a + step, a + step * 4.0];
        let mesh = Mesh { positions: positions.to_vec(), indices: vec![[0, 1, 2], [0, 0, 1], [2, 1, 1]] };
        let accel = mesh.accel();
        assert!(accel.bounds().is_empty());
        let origin = r.point(4.0);
        for target in positions {
            assert!(!accel.occluded(&Ray::new(origin, target - origin)));
        }
    }
}

/// One triangle hit by random rays; `spawn` makes the origin of the ray that leaves it. Returns how many meet it again.
fn met_again(seed: u64, spawn: impl Fn(Vec3, Vec3, Vec3, Vec3) -> Vec3) -> usize {
    let mut r = Random::new(seed);
    let mut again = 0;
    for i in 0..6000 {
        let scale = 10f32.powf(6.0 * r.unit() - 2.0);
        let at = r.point(scale * [0.0, 1.0, 30.0][i % 3]);
        let sliver = if i % 2 == 0 { 1.0 } else { 10f32.powf(-3.0 * r.unit()) };
        let a = at + r.point(scale);
        let b = at + r.point(scale);
        let mut triangle = [a, b, a + (b - a) * r.unit() + r.point(scale * sliver)];
        if i % 5 == 0 {
            triangle.iter_mut().for_each(|v| v.z = at.z);
        }
        let mesh = Mesh { positions: triangle.to_vec(), indices: vec![[0, 1, 2]] };
        let accel = mesh.accel();
        let n = triangle_normal(&triangle);
        for _ in 0..40 {
            let (s, t) = (r.unit(), r.unit());
            let target = triangle[0]
                + (triangle[1] - triangle[0]) * (1.0 - s.sqrt())
                + (triangle[2] - triangle[0]) * (t * s.sqrt());
            let origin = at + r.point(scale * 3.0);
            let Some(hit) = accel.closest(&Ray::new(origin, (target - origin).normalize())) else { continue };
            let (p, error) = triangle_point(&triangle, hit.u, hit.v);
            let mut dir = r.direction();
            if r.below(3) == 0 {
                // Grazing.
                dir = (dir - n * dir.dot(n) * (1.0 - 1e-4 * r.unit())).normalize();
            }
            let ray = Ray::new(spawn(p, error, n, dir), dir);
            again += usize::from(accel.closest(&ray).is_some());
            assert_eq!(accel.closest(&ray).is_some(), accel.occluded(&ray));
        }
    }
    again
}

#[test]
fn spawned_rays_do_not_meet_their_triangle() {
    assert_eq!(met_again(5, offset_origin), 0);
    let without = met_again(5, |p, _, _, _| p);
    assert!(without > 1000, "the rays are too easy: without an offset only {without} meet it again");
}

#[test]
fn spawned_rays_stay_inside() {
    let mut r = Random::new(6);
    let mut left = 0;
    for kind in 0..100 {
        let (mesh, inside, _) = closed(&mut r, kind);
        let accel = mesh.accel();
        for _ in 0..10_000 {
            let ray = Ray::new(inside, r.direction());
            let hit = accel.closest(&ray).unwrap();
            let t = mesh.triangle(hit.prim as usize);
            let (p, error) = triangle_point(&t, hit.u, hit.v);
            let n = triangle_normal(&t);
            let n = if n.dot(ray.dir) > 0.0 { -n } else { n };
            let dir = r.cosine(n);
            left += usize::from(!accel.occluded(&Ray::new(offset_origin(p, error, n, dir), dir)));
        }
    }
    // A hit within rounding of an edge could be carried through the other wall; that is rarer than one in a million.
    assert_eq!(left, 0);
}

/// A random place for an instance: stretched, turned, mirrored or not, at any scale.
fn placed(r: &mut Random) -> DAffine3 {
    let scale = 10f64.powf(4.0 * f64::from(r.unit()) - 2.0);
    let stretch = DVec3::from_array([0, 1, 2].map(|_| 0.1 + f64::from(r.unit()))) * scale;
    let mirror = if r.below(2) == 0 { DVec3::ONE } else { DVec3::new(1.0, -1.0, 1.0) };
    let turn = DQuat::from_axis_angle(r.direction().as_dvec3().normalize(), 6.0 * f64::from(r.unit()));
    DAffine3::from_scale_rotation_translation(stretch * mirror, turn, r.point(scale as f32 * 5.0).as_dvec3())
}

#[test]
fn rays_stay_inside_instances_and_leave_their_surface() {
    let mut r = Random::new(9);
    let mesh = icosphere(2).map(|p| p * vec3(1.0, 0.7, 1.2));
    for _ in 0..60 {
        let mut group = GroupBuilder::new();
        group.add_mesh(&mesh.positions, &mesh.indices);
        let mut scene = SceneBuilder::new(GroupBuilder::new().build());
        let group = scene.add_group(group.build());
        let place = placed(&mut r);
        scene.add_instance(group, place);
        let accel = scene.build();
        let normal_matrix = place.matrix3.inverse().transpose();
        let inside = place.translation.as_vec3();
        for i in 0..5000 {
            let mut ray = Ray::new(inside, r.direction());
            if i % 2 == 0 {
                let corner = mesh.positions[r.below(mesh.positions.len())].as_dvec3();
                ray.dir = (place.transform_point3(corner) - inside.as_dvec3()).normalize().as_vec3();
            }
            check(&accel, &ray);
            // And on, outwards: the mesh is convex.
            let hit = accel.closest(&ray).unwrap();
            let t = mesh.triangle(hit.prim as usize);
            let (p, error) = triangle_point(&t, hit.u, hit.v);
            let (p, error) = transform_error(&place, p.as_dvec3(), error.as_dvec3());
            let n = (normal_matrix * triangle_normal(&t).as_dvec3()).normalize().as_vec3();
            let n = if n.dot(ray.dir) < 0.0 { -n } else { n };
            let dir = r.cosine(n);
            assert!(!accel.occluded(&Ray::new(offset_origin(p, error, n, dir), dir)));
        }
    }
}

#[test]
fn builds_of_ties_end() {
    let one = [vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 1.0), vec3(0.0, 1.0, 1.0)];
    let mut identical = GroupBuilder::new();
    identical.add_mesh(&one, &vec![[0, 1, 2]; 100_000]);
    let accel = SceneBuilder::new(identical.build()).build();
    let hit = accel.closest(&Ray::new(vec3(0.2, 0.2, 0.0), Vec3::Z)).unwrap();
    assert_eq!(hit.t, 1.0);

    // Same centroid, growing: every box contains the smaller ones.
    let mut nested = Mesh::default();
    for i in 0..100_000u32 {
        let s = 1.0 + i as f32;
        nested.positions.extend([vec3(-s, -s, 2.0), vec3(s, -s, 2.0), vec3(0.0, s, 2.0)]);
        nested.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    assert!(nested.accel().occluded(&Ray::new(Vec3::ZERO, Vec3::Z)));

    // A strip of equal quads, and positions doubling towards infinity.
    let mut strip = Mesh::default();
    for i in 0..100_000u32 {
        let x = i as f32;
        strip.positions.extend([vec3(x, 0.0, 0.0), vec3(x + 1.0, 0.0, 0.0), vec3(x, 1.0, 0.0)]);
        strip.indices.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    for i in 0..250u32 {
        let x = 2f32.powi(i as i32 / 2);
        let base = strip.positions.len() as u32;
        strip.positions.extend([vec3(x, 0.0, 5.0), vec3(x * 1.1, 0.0, 5.0), vec3(x, x, 5.0)]);
        strip.indices.push([base, base + 1, base + 2]);
    }
    let accel = strip.accel();
    assert!(accel.occluded(&Ray::new(vec3(77_777.25, 0.25, -1.0), Vec3::Z)));
}
