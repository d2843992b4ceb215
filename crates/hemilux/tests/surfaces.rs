//! Surfaces in the renderer: the white furnace of every material, opacity, interfaces, bumps and normal maps.

mod common;
use common::*;
use hemilux::film::Film;
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::*;
use std::f64::consts::TAU;
use std::sync::atomic::AtomicU64;

fn smooth() -> Roughness {
    Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false }
}

const WHITE: RgbParam = RgbParam::Constant(Rgb::WHITE);

/// Materials that lose nothing: everything seen under a sky of radiance 1 has radiance 1, reflected, refracted, varnished.
#[test]
fn white_furnace_of_every_lossless_material() {
    let glass = |eta| MaterialKind::Dielectric { eta, roughness: smooth() };
    let kinds = [
        ("diffuse", MaterialKind::Diffuse { reflectance: WHITE }),
        (
            "mirror",
            MaterialKind::Conductor { fresnel: ConductorFresnel::Reflectance(WHITE), roughness: smooth() },
        ),
        ("glass", glass(1.5)),
        ("bubble in glass", glass(1.0 / 1.5)),
        ("pane", MaterialKind::ThinDielectric { eta: 1.5 }),
        ("varnish", MaterialKind::CoatedDiffuse { reflectance: WHITE, eta: 1.5, roughness: smooth() }),
        (
            "diffuse transmission",
            MaterialKind::DiffuseTransmission {
                reflectance: RgbParam::Constant(Rgb::splat(0.5)),
                transmittance: RgbParam::Constant(Rgb::splat(0.5)),
                scale: 1.0,
            },
        ),
    ];
    for (name, kind) in kinds {
        for mode in [Mode::Path, Mode::Zonal] {
            let (mean, error) = furnace(kind.clone(), mode);
            println!("{name}, {mode:?}: {mean:.5} ± {error:.5}");
            // Roulette leaves a little noise in path tracing; zones of 2¹⁸ particles are common to all pixels: 0.1 %.
            let zonal = if mode == Mode::Zonal { 1e-3 } else { 1e-5 };
            assert!(
                (mean - 1.0).abs() < Z_LIMIT * error + zonal && error < 3e-3,
                "{name}, {mode:?}: {mean} ± {error}"
            );
        }
    }
    // Negative control: a ball that absorbs three hundredths shows.
    let grey = MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::splat(0.97)) };
    let (mean, error) = furnace(grey, Mode::Path);
    assert!((mean - 1.0).abs() > Z_LIMIT * error + 1e-3, "{mean} ± {error}");
}

/// Mean radiance of a picture of a ball under a sky of radiance 1, and its standard error over pixels.
fn furnace(kind: MaterialKind, mode: Mode) -> (f64, f64) {
    let mut scene = empty();
    let m = material(&mut scene, kind);
    sphere(&mut scene, [0.0, 0.0, 3.0], 1.9, false, m, None);
    scene.environments.push(Environment::Constant { radiance: Rgb::WHITE });
    let world = World::new(scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: 400, particles: 1 << 18, seed: 9 });
    let options = RenderOptions { mode, plan: PLAN, seed: 3, max_depth: u32::MAX };
    let renderer = Renderer::new(&world, Some(&zones), 24, 24, options);
    let mut film = Film::new(24, 24, [0, 24, 0, 24]);
    renderer.passes(&mut film, 0..64, &AtomicU64::new(0));
    let mut values = Vec::new();
    film.for_each(|_, _, p| {
        assert_eq!(p.rejected(), 0);
        values.push(p.mean()[1] as f64);
    });
    statistics(values.len() as u32, |i| values[i as usize])
}

/// A sheet of opacity α lets 1 − α of what crosses it pass; an interface material lets everything pass.
#[test]
fn opacity_and_interfaces_let_rays_pass() {
    let through = |alpha: Option<f32>, kind: MaterialKind| {
        let mut scene = empty();
        let (m, black) = (material(&mut scene, kind), diffuse(&mut scene, 0.0));
        quad(&mut scene, [-5.0, -5.0, 0.5], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], m, None);
        scene.shapes[0].alpha = alpha.map(FloatParam::Constant);
        quad(&mut scene, [-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0], black, emission(1.0));
        path_irradiance(&World::new(scene), [0.0; 3], [0.0, 0.0, 1.0], 20_000)
    };
    let black = MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::BLACK) };
    let open = 1.740839503;
    assert_is("a quarter opaque", through(Some(0.25), black.clone()), 0.75 * open, open);
    assert_eq!(through(Some(1.0), black.clone()).0, 0.0);
    assert_eq!(through(None, black).0, 0.0);
    assert_is("interface", through(None, MaterialKind::Interface), open, 0.98 * open);
}

/// Radiance of a white diffuse floor under a distant sun follows the tilted normal: cos of its angle to the sun.
fn floor_under_sun(change: impl FnOnce(&mut Scene)) -> f64 {
    let mut scene = empty();
    let m = diffuse(&mut scene, 1.0);
    scene.meshes.push(Mesh {
        positions: [[-1.0, -1.0, 3.0], [1.0, -1.0, 3.0], [1.0, 1.0, 3.0], [-1.0, 1.0, 3.0]]
            .map(Vec3::from)
            .to_vec(),
        uvs: [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from).to_vec(),
        indices: vec![[0, 2, 1], [0, 3, 2]],
        ..Mesh::default()
    });
    shape(&mut scene, Geometry::Mesh(MeshId(0)), m, None);
    let half_angle = 0.2665f64.to_radians();
    let radiance = (1.0 / half_angle.sin().powi(2)) as f32; // irradiance π on a surface that faces it
    scene.environments.push(Environment::Sun {
        direction: Vec3::NEG_Z,
        cos_half_angle: half_angle.cos(),
        radiance: Rgb::splat(radiance),
    });
    scene.camera.projection = Projection::Perspective { fov: 10.0 };
    change(&mut scene);
    let world = World::new(scene);
    let options = RenderOptions { mode: Mode::Path, plan: PLAN, seed: 3, max_depth: 1 };
    let renderer = Renderer::new(&world, None, 16, 16, options);
    let mut film = Film::new(16, 16, [0, 16, 0, 16]);
    renderer.passes(&mut film, 0..16, &AtomicU64::new(0));
    let mut sum = 0.0;
    film.for_each(|_, _, p| sum += p.mean()[1] as f64 / 256.0);
    sum
}

#[test]
fn bumps_and_normal_maps_tilt_the_shading_normal() {
    let flat = floor_under_sun(|_| ());
    assert!((flat - 1.0).abs() < 1e-3, "{flat}");
    // Displacement d = s · u over a floor 2 m wide: slope s / 2 (the ramp is an image of two texels, bilinear between
    // their centres, where the camera looks).
    let slope = 0.5f64;
    let bumped = floor_under_sun(|scene| {
        let texels = vec![Rgb::splat(0.0), Rgb::splat(2.0 * slope as f32 * 0.5)];
        scene.images.push(TextureImage {
            width: 2,
            height: 1,
            texels,
            alpha: None,
            path: Default::default(),
        });
        scene.textures.push(Texture::Image {
            image: ImageId(0),
            mapping: TextureMapping::Uv { scale: Vec2::ONE, delta: Vec2::ZERO },
            wrap: Wrap::Clamp,
            nearest: false,
            scale: 1.0,
            invert: false,
        });
        scene.materials[0].bump = Some(FloatParam::Texture(TextureId(0)));
    });
    // Texel centres lie half a unit of u, 1 m, apart: d rises by `slope` metres over that metre.
    let truth = 1.0 / (1.0 + slope * slope).sqrt();
    assert!((bumped - truth).abs() < 2e-3, "{bumped}, truth {truth}");
    let n = Vec3::new(0.6, 0.0, 0.8);
    let mapped = floor_under_sun(|scene| {
        let texel = Rgb([n.x, n.y, n.z].map(|v| 0.5 * (v + 1.0)));
        scene.images.push(TextureImage {
            width: 1,
            height: 1,
            texels: vec![texel],
            alpha: None,
            path: Default::default(),
        });
        scene.materials[0].normal_map = Some(ImageId(0));
    });
    assert!((mapped - 0.8).abs() < 2e-3, "{mapped}");
    // Negative control: tilting does something.
    assert!((flat - bumped).abs() > 0.05 && (flat - mapped).abs() > 0.1);
}

/// A distant view through a stretched, instanced glass ball: the same picture as of the same ball placed directly.
#[test]
fn instances_render_as_what_they_place() {
    let picture = |instanced: bool| {
        let mut scene = empty();
        let m = diffuse(&mut scene, 0.5);
        let q = Quadric::Sphere { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: TAU };
        let placed = DAffine3::from_translation(DVec3::new(0.2, -0.1, 4.0))
            * DAffine3::from_scale(DVec3::new(1.0, 0.5, 0.7));
        if instanced {
            shape(&mut scene, Geometry::Quadric(q, DAffine3::IDENTITY), m, None);
            let ball = scene.shapes.pop().unwrap();
            scene.objects.push(Object { name: "ball".into(), shapes: vec![ball] });
            scene.instances.push(Instance { object: 0, to_world: placed });
        } else {
            shape(&mut scene, Geometry::Quadric(q, placed), m, None);
        }
        scene.environments.push(Environment::Constant { radiance: Rgb::WHITE });
        let world = World::new(scene);
        let options = RenderOptions { mode: Mode::Path, plan: PLAN, seed: 3, max_depth: 8 };
        let mut film = Film::new(32, 32, [0, 32, 0, 32]);
        Renderer::new(&world, None, 32, 32, options).passes(&mut film, 0..64, &AtomicU64::new(0));
        let mut means = Vec::new();
        film.for_each(|_, _, p| means.push(p.mean()[1] as f64));
        means
    };
    let (a, b) = (picture(true), picture(false));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    assert!((mean(&a) / mean(&b) - 1.0).abs() < 1e-3, "{} and {}", mean(&a), mean(&b));
    let worst = a.iter().zip(&b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    assert!(worst < 0.1, "{worst}");
    assert!(mean(&b) < 0.98 && mean(&b) > 0.5, "the ball is there: {}", mean(&b));
}
