//! Irradiance against closed forms: luminaires of every shape, sampling by cones and by area, shared with gather rays.

mod common;
use common::*;
use hemilux::world::World;
use hemilux_scene::geom::{DAffine3, DVec3};
use hemilux_scene::*;
use std::f64::consts::{PI, TAU};

fn black(scene: &mut Scene) -> MaterialId {
    diffuse(scene, 0.0)
}

/// A square luminaire [-1, 1]² at z = 1 that shines down (Lambert's formula for polygons).
#[test]
fn square_overhead() {
    let mut scene = empty();
    let m = black(&mut scene);
    quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], m, emission(1.0));
    let world = World::new(scene);
    let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 4000);
    assert_is("square overhead", e, 1.740839503, 1.740839503 * 1.02);
    // It does not shine up.
    assert_eq!(path_irradiance(&world, [0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 50).0, 0.0);
}

#[test]
fn triangle_with_a_tilted_receiver() {
    let mut scene = empty();
    let m = black(&mut scene);
    let positions = [[0.0, 0.0, 2.0], [0.0, 1.0, 2.0], [3.0, 0.0, 2.0]].map(geom::Vec3::from).to_vec();
    scene.meshes.push(Mesh { positions, indices: vec![[0, 1, 2]], ..Mesh::default() });
    shape(&mut scene, Geometry::Mesh(MeshId(0)), m, emission(1.0));
    let world = World::new(scene);
    let up = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 4000);
    assert_is("triangle", up, 0.225353617, 0.225353617 * 1.03);
    let tilted = path_irradiance(&world, [0.0; 3], [1.0, 1.0, 1.0], 4000);
    assert_is("triangle, tilted", tilted, 0.200705027, 0.225353617);
}

/// Half-angle s at polar angle g, above and across the horizon.
#[test]
fn spheres_above_and_across_the_horizon() {
    let table = [
        (60.0, 30.0, PI / 8.0),
        (80.0, 20.0, 0.069150718),
        (90.0, 30.0, 0.090586074),
        (100.0, 20.0, 0.005335615),
    ];
    for (g, s, truth) in table.map(|(g, s, e): (f64, f64, f64)| (g.to_radians(), s.to_radians(), e)) {
        let mut scene = empty();
        let m = black(&mut scene);
        sphere(&mut scene, [3.0 * g.sin(), 0.0, 3.0 * g.cos()], 3.0 * s.sin(), false, m, emission(1.0));
        let world = World::new(scene);
        let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 20_000);
        assert_is(&format!("sphere {g:.3} {s:.3}"), e, truth, truth * 1.05);
    }
}

#[test]
fn disks_coaxial_and_off_axis() {
    for (radius, h, d, truth) in
        [(1.0, 2.0, 0.0, 0.628318531), (1.0, 1.0, 1.0, PI * 0.276393202), (0.5, 2.0, 1.5, PI * 0.025658351)]
    {
        let mut scene = empty();
        let m = black(&mut scene);
        let q = Quadric::Disk { height: 0.0, radius, inner_radius: 0.0, phi_max: TAU };
        let placed = DAffine3::from_translation(DVec3::new(d, 0.0, h));
        shape(&mut scene, Geometry::Quadric(q, placed), m, emission(1.0));
        scene.shapes[0].reverse_orientation = true;
        let world = World::new(scene);
        let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 8000);
        assert_is(&format!("disk {radius} {h} {d}"), e, truth, truth * 1.05);
    }
}

/// E of an unoccluded sphere of given power does not depend on its radius: lamps down to 0.1 mm, seen from 4 m, and
/// whole scenes scaled from a centimetre to ten kilometres.
#[test]
fn lamps_of_any_size_in_scenes_of_any_scale() {
    for scale in [1e-2, 1.0, 1e4] {
        for radius in [0.3, 1e-2, 1e-4] {
            let mut scene = empty();
            let m = black(&mut scene);
            let (power, distance) = (100.0, 4.0 * scale);
            let radiance = power / (4.0 * PI * PI * radius * radius * scale * scale);
            let centre = [0.6 * distance, 0.0, 0.8 * distance];
            sphere(&mut scene, centre, radius * scale, false, m, emission(radiance as f32));
            let world = World::new(scene);
            let truth = power * 0.8 / (4.0 * PI * distance * distance);
            let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 1000);
            assert_is(&format!("lamp {radius} at scale {scale}"), e, truth, truth * 1.01);
        }
    }
}

#[test]
fn sky_and_sun() {
    let mut scene = empty();
    scene.environments.push(Environment::Constant { radiance: Rgb::splat(1.0) });
    let world = World::new(scene);
    let e = path_irradiance(&world, [0.0; 3], [0.3, 0.2, 1.0], 2000);
    assert_is("uniform sky", e, PI, PI * 1.01);

    let mut scene = empty();
    let (half_angle, cos) = (0.2665f64.to_radians(), 0.8);
    let direction = geom::Vec3::new(0.6, 0.0, 0.8);
    let radiance = 1000.0 / (PI * half_angle.sin().powi(2));
    scene.environments.push(Environment::Sun {
        direction,
        cos_half_angle: half_angle.cos(),
        radiance: Rgb::splat(radiance as f32),
    });
    let world = World::new(scene);
    let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 2000);
    assert_is("sun", e, 1000.0 * cos, 1000.0);
}

/// Image method: a lamp and its image in a plane mirror (found by gather rays), any lamp size.
#[test]
fn a_lamp_and_its_image_in_a_mirror() {
    let mut scene = empty();
    let (m, r) = (black(&mut scene), mirror(&mut scene, 0.9));
    let radius = 0.3;
    let radiance = 100.0 / (4.0 * PI * PI * radius * radius);
    sphere(&mut scene, [1.0, 0.0, 2.0], radius, false, m, emission(radiance as f32));
    quad(&mut scene, [2.0, -200.0, -200.0], [0.0, 400.0, 0.0], [0.0, 0.0, 400.0], r, None);
    let world = World::new(scene);
    let e = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 60_000);
    // The mirror's reflectance 0.9 at normal incidence is 0.9 at 56° only to Fresnel's accuracy: the closed form holds
    // for a constant one, so take the conductor's own value at the image's mean angle.
    let cos = 3.0 / (9.0f64 + 4.0).sqrt();
    let reflectance = hemilux::bsdf::fresnel::conductor(
        cos as f32,
        Rgb::WHITE,
        hemilux::bsdf::fresnel::k_of_reflectance(Rgb::splat(0.9)),
    )[1] as f64;
    let truth = 1.423525087 + 0.339551070 * reflectance;
    assert_is("lamp and image", e, truth, 1.423525087);
}

/// From inside a luminaire: it surrounds the receiver, wherever that is.
#[test]
fn inside_an_emitting_sphere() {
    let mut scene = empty();
    let m = black(&mut scene);
    sphere(&mut scene, [0.0; 3], 1.0, true, m, emission(1.0));
    let world = World::new(scene);
    for (p, n) in [
        ([0.0, 0.0, 0.0], [0.0, 0.3, 1.0]),
        ([0.0, 0.0, 0.9], [1.0, 0.0, 0.0]),
        ([0.0, 0.0, 0.999], [0.0, 0.0, -1.0]),
    ] {
        let e = path_irradiance(&world, p, n, 4000);
        assert_is(&format!("inside at {p:?}"), e, PI, PI * 1.02);
    }
}

/// CIE overcast sky, L = Lz (1 + 2 sin γ) / 3, as an image: horizontal and vertical closed forms, importance-sampled.
#[test]
fn overcast_sky_from_an_image() {
    let (width, height) = (64u32, 1024u32);
    let mut texels = Vec::new();
    for y in 0..height {
        // Latitude–longitude, z up: rows from the zenith down; below the horizon nothing.
        let theta = (y as f64 + 0.5) / height as f64 * PI;
        let radiance = if theta < PI / 2.0 { (1.0 + 2.0 * theta.cos()) / 3.0 } else { 0.0 };
        texels.extend(std::iter::repeat_n(Rgb::splat(radiance as f32), width as usize));
    }
    let mut scene = empty();
    scene.images.push(TextureImage { width, height, texels, alpha: None, path: Default::default() });
    scene.environments.push(Environment::Image {
        image: ImageId(0),
        scale: Rgb::WHITE,
        layout: EnvironmentLayout::LatLong,
        to_world: DAffine3::IDENTITY,
        portal: None,
    });
    let world = World::new(scene);
    let up = path_irradiance(&world, [0.0; 3], [0.0, 0.0, 1.0], 4000);
    assert_is("overcast, horizontal", up, 2.443460953, PI);
    let side = path_irradiance(&world, [0.0; 3], [1.0, 0.0, 0.0], 8000);
    assert_is("overcast, vertical", side, 0.968043220, 0.968043220 * 1.03);
}
