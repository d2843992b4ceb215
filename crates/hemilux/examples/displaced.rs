//! Procedural geometry through the library's API: a glass pebble given by an implicit function casts its caustic on a table.
//!
//!     cargo run --release -p hemilux --example displaced -- pebble.png [TIME]
//!
//! The surface is the zero of f(p) = |p / axes| − 1 − ripples(p). It is star-shaped, so every vertex of a grid of directions
//! is found by bisection along its ray, and normals are gradients of f. The scene is built in code; no file is read.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_image::tone;
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::{
    Camera, Emission, Environment, Filter, FloatParam, Geometry, Material, MaterialId, MaterialKind, Mesh,
    MeshId, Photometry, Profile, Projection, Quadric, Rgb, RgbParam, Roughness, Scene, Shape, Span,
};
use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Positive outside. Metres.
fn implicit(p: DVec3) -> f64 {
    let q = p / DVec3::new(0.11, 0.085, 0.06);
    let ripples = 0.045 * (5.0 * q.x).sin() * (4.0 * q.y + 1.0).sin() + 0.02 * (9.0 * q.z + 3.0 * q.x).sin();
    q.length() - 1.0 - ripples
}

fn gradient(p: DVec3) -> DVec3 {
    let h = 1e-5;
    let along = |d: DVec3| (implicit(p + d * h) - implicit(p - d * h)) / (2.0 * h);
    DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z))
}

/// Where the ray from the centre along unit `d` leaves the body.
fn surface_along(d: DVec3) -> DVec3 {
    let (mut inside, mut outside) = (0.02, 0.2);
    for _ in 0..48 {
        let middle = 0.5 * (inside + outside);
        if implicit(d * middle) < 0.0 { inside = middle } else { outside = middle }
    }
    d * inside
}

/// The body as a mesh with smooth normals: `rows` × 2 `rows` cells of directions, poles on the x axis.
fn pebble(rows: u32) -> Mesh {
    let columns = 2 * rows;
    let mut mesh = Mesh::default();
    for j in 0..=rows {
        for i in 0..columns {
            let (theta, phi) = (PI * j as f64 / rows as f64, TAU * i as f64 / columns as f64);
            let d = DVec3::new(theta.cos(), theta.sin() * phi.cos(), theta.sin() * phi.sin());
            let p = surface_along(d);
            mesh.positions.push(p.as_vec3());
            mesh.normals.push(gradient(p).normalize().as_vec3());
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let (a, b) = (j * columns + i, j * columns + (i + 1) % columns);
            let (c, d) = (a + columns, b + columns);
            // Cells at the poles are triangles.
            if j > 0 {
                mesh.indices.push([a, b, d]);
            }
            if j + 1 < rows {
                mesh.indices.push([a, d, c]);
            }
        }
    }
    mesh
}

fn material(scene: &mut Scene, kind: MaterialKind) -> MaterialId {
    let (name, span) = (String::new(), Span::default());
    scene.materials.push(Material { kind, bump: None, normal_map: None, name, span });
    MaterialId(scene.materials.len() as u32 - 1)
}

fn matt(scene: &mut Scene, r: f32, g: f32, b: f32) -> MaterialId {
    material(scene, MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb([r, g, b])) })
}

fn add(scene: &mut Scene, geometry: Geometry, material: MaterialId, emission: Option<Emission>) {
    scene.shapes.push(Shape::new(geometry, material, emission));
}

fn add_mesh(scene: &mut Scene, mesh: Mesh, to: DAffine3, material: MaterialId) {
    let moved = |p: &Vec3| to.transform_point3(p.as_dvec3()).as_vec3();
    let turned = |n: &Vec3| to.transform_vector3(n.as_dvec3()).normalize().as_vec3();
    let positions = mesh.positions.iter().map(moved).collect();
    let normals = mesh.normals.iter().map(turned).collect();
    scene.meshes.push(Mesh { positions, normals, ..mesh });
    let id = MeshId(scene.meshes.len() as u32 - 1);
    add(scene, Geometry::Mesh(id), material, None);
}

fn quad(p: [f32; 3], a: [f32; 3], b: [f32; 3]) -> Mesh {
    let (p, a, b) = (Vec3::from(p), Vec3::from(a), Vec3::from(b));
    Mesh {
        positions: vec![p, p + a, p + a + b, p + b],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    }
}

fn scene() -> Scene {
    let eye = DVec3::new(-0.12, -0.56, 0.42);
    let forward = (DVec3::new(0.05, 0.03, 0.03) - eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let to_world = DAffine3::from_cols(right, right.cross(forward), forward, eye);
    let mut scene = Scene {
        camera: Camera {
            projection: Projection::Perspective { fov: 40.0 },
            to_world,
            screen_window: None,
            lens_radius: 0.0,
            focal_distance: 1.0,
            span: Span::default(),
        },
        film: hemilux_scene::Film {
            width: 320,
            height: 240,
            crop: [0.0, 1.0, 0.0, 1.0],
            scale: 1.0,
            filename: None,
        },
        filter: Filter::Gaussian { radius: Vec2::splat(1.2), sigma: 0.5 },
        samples_per_pixel: None,
        max_depth: None,
        textures: Vec::new(),
        images: Vec::new(),
        materials: Vec::new(),
        meshes: Vec::new(),
        shapes: Vec::new(),
        objects: Vec::new(),
        instances: Vec::new(),
        environments: vec![Environment::Constant { radiance: Rgb([0.05, 0.06, 0.08]) }],
        photometry: Photometry::CIE,
        files: Vec::new(),
        content_hash: 0,
    };
    let table = matt(&mut scene, 0.62, 0.58, 0.52);
    add_mesh(
        &mut scene,
        quad([-1.0, -0.8, 0.0], [2.0, 0.0, 0.0], [0.0, 1.6, 0.0]),
        DAffine3::IDENTITY,
        table,
    );
    let glass = material(
        &mut scene,
        MaterialKind::Dielectric {
            eta: 1.5,
            roughness: Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false },
        },
    );
    let lifted = DAffine3::from_translation(DVec3::new(0.0, 0.0, 0.068)) * DAffine3::from_rotation_z(0.5);
    add_mesh(&mut scene, pebble(48), lifted, glass);
    // The lamp: 12 mm across, 60 cm away, 2.5 W of light.
    let black = matt(&mut scene, 0.0, 0.0, 0.0);
    let radius = 0.006;
    let radiance = 2.5 / (4.0 * PI * PI * radius * radius);
    let emission = Emission {
        radiance: Rgb([1.15, 0.98, 0.75]) * radiance as f32,
        image: None,
        two_sided: false,
        profile: Profile::Uniform,
    };
    let ball = Quadric::Sphere { radius, z_min: -radius, z_max: radius, phi_max: TAU };
    let place = DAffine3::from_translation(DVec3::new(-0.42, 0.12, 0.42));
    add(&mut scene, Geometry::Quadric(ball, place), black, Some(emission));
    scene
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let path = args.next().ok_or("usage: displaced FILE.png [SECONDS]")?;
    let seconds: f64 = args.next().as_deref().unwrap_or("30s").trim_end_matches('s').parse()?;
    let start = Instant::now();
    let world = World::new(scene());
    println!("{} triangles and lamps", world.primitives());
    let stop = start + Duration::from_secs_f64(0.15 * seconds);
    let zones = Zones::solve_until(&world, &ZoneOptions::default(), |_| Instant::now() >= stop);
    let (width, height) = (world.scene.film.width, world.scene.film.height);
    let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Sobol };
    let options = RenderOptions { mode: Mode::Zonal, plan, seed: 0, max_depth: u32::MAX };
    let renderer = Renderer::new(&world, Some(&zones), width, height, options);
    let mut film = Film::new(width, height, [0, width, 0, height]);
    let deadline = Some(start + Duration::from_secs_f64(seconds));
    let outcome =
        renderer.run(&mut film, Stop { passes: u32::MAX, deadline }, &AtomicBool::new(false), |_| ());
    println!("{} samples per pixel", outcome.passes);
    let image = hemilux::picture::image(&film, &[]);
    let exposure = tone::Exposure::Percentile { percent: 95.0, target: 0.8 };
    let mut png = Vec::new();
    let map = tone::ToneMap { exposure, ..tone::ToneMap::default() };
    hemilux_image::png::encode_rgb8(&map.apply(&image)?, &[], &mut png)?;
    std::fs::write(path, png)?;
    Ok(())
}
