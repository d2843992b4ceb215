//! Scenes built in code, and the statistics that estimates are judged by.
#![allow(dead_code)] // each test binary uses its own part

use hemilux::gather::{GatherPlan, Strategy};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::*;

/// A scene without anything, seen from the origin along +z.
pub fn empty() -> Scene {
    Scene {
        camera: Camera {
            projection: Projection::Perspective { fov: 60.0 },
            to_world: DAffine3::IDENTITY,
            screen_window: None,
            lens_radius: 0.0,
            focal_distance: 1.0,
            span: Span::default(),
        },
        film: Film { width: 32, height: 32, crop: [0.0, 1.0, 0.0, 1.0], scale: 1.0, filename: None },
        filter: Filter::Box { radius: Vec2::splat(0.5) },
        samples_per_pixel: None,
        max_depth: None,
        textures: Vec::new(),
        images: Vec::new(),
        materials: Vec::new(),
        meshes: Vec::new(),
        shapes: Vec::new(),
        objects: Vec::new(),
        instances: Vec::new(),
        environments: Vec::new(),
        photometry: Photometry::CIE,
        files: Vec::new(),
        content_hash: 1,
    }
}

pub fn material(scene: &mut Scene, kind: MaterialKind) -> MaterialId {
    scene.materials.push(Material {
        kind,
        bump: None,
        normal_map: None,
        name: String::new(),
        span: Span::default(),
    });
    MaterialId(scene.materials.len() as u32 - 1)
}

pub fn diffuse(scene: &mut Scene, rho: f32) -> MaterialId {
    material(scene, MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::splat(rho)) })
}

pub fn mirror(scene: &mut Scene, r: f32) -> MaterialId {
    let roughness = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
    let fresnel = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::splat(r)));
    material(scene, MaterialKind::Conductor { fresnel, roughness })
}

pub fn emission(radiance: f32) -> Option<Emission> {
    Some(Emission {
        radiance: Rgb::splat(radiance),
        image: None,
        two_sided: false,
        profile: Profile::Uniform,
    })
}

pub fn shape(scene: &mut Scene, geometry: Geometry, material: MaterialId, emission: Option<Emission>) {
    scene.shapes.push(Shape::new(geometry, material, emission));
}

/// A parallelogram with normal e1 × e2.
pub fn quad(
    scene: &mut Scene,
    p: [f32; 3],
    e1: [f32; 3],
    e2: [f32; 3],
    material: MaterialId,
    emission: Option<Emission>,
) {
    let (p, e1, e2) = (Vec3::from(p), Vec3::from(e1), Vec3::from(e2));
    scene.meshes.push(Mesh {
        positions: vec![p, p + e1, p + e1 + e2, p + e2],
        indices: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    });
    let id = MeshId(scene.meshes.len() as u32 - 1);
    shape(scene, Geometry::Mesh(id), material, emission);
}

/// A box with outward (or inward) normals.
pub fn cuboid(scene: &mut Scene, low: [f32; 3], high: [f32; 3], inward: bool, material: MaterialId) {
    let (a, b) = (Vec3::from(low), Vec3::from(high));
    let corner = |i: usize| {
        let pick = |bit: usize, l: f32, h: f32| if i & bit != 0 { h } else { l };
        Vec3::new(pick(1, a.x, b.x), pick(2, a.y, b.y), pick(4, a.z, b.z))
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut indices = Vec::new();
    for f in faces {
        for t in [[f[0], f[1], f[2]], [f[0], f[2], f[3]]] {
            indices.push(if inward { [t[0], t[2], t[1]] } else { t });
        }
    }
    scene.meshes.push(Mesh { positions: (0..8).map(corner).collect(), indices, ..Mesh::default() });
    let id = MeshId(scene.meshes.len() as u32 - 1);
    shape(scene, Geometry::Mesh(id), material, None);
}

pub fn sphere(
    scene: &mut Scene,
    centre: [f64; 3],
    radius: f64,
    inward: bool,
    material: MaterialId,
    emission: Option<Emission>,
) {
    let q = Quadric::Sphere { radius, z_min: -radius, z_max: radius, phi_max: std::f64::consts::TAU };
    let placed = DAffine3::from_translation(DVec3::from(centre));
    shape(scene, Geometry::Quadric(q, placed), material, emission);
    scene.shapes.last_mut().unwrap().reverse_orientation = inward;
}

pub const PLAN: GatherPlan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Adaptive };

/// Mean and standard error of `n` independent values.
pub fn statistics(n: u32, mut f: impl FnMut(u32) -> f64) -> (f64, f64) {
    let (mut sum, mut squares) = (0.0, 0.0);
    for i in 0..n {
        let v = f(i);
        sum += v;
        squares += v * v;
    }
    let mean = sum / n as f64;
    let variance = (squares / n as f64 - mean * mean).max(0.0) / (n as f64 - 1.0);
    (mean, variance.sqrt())
}

/// Irradiance (green band) by path-continued gathers: `n` independent ones.
pub fn path_irradiance(world: &World, p: [f32; 3], normal: [f32; 3], n: u32) -> (f64, f64) {
    let walker = Walker::path(world);
    let normal = Vec3::from(normal).normalize();
    statistics(n, |i| {
        let mut sampler = Sampler::new(7, i as u64, 0);
        irradiance(&walker, Vec3::from(p), normal, &PLAN, &mut sampler, &mut Tally::default())[1] as f64
    })
}

/// z of an estimate; the tests below accept |z| < 4.4, a false-alarm rate of 1e-5 each.
pub fn z(estimate: (f64, f64), truth: f64) -> f64 {
    (estimate.0 - truth) / estimate.1.max(1e-7 * truth.abs()).max(1e-30)
}

pub const Z_LIMIT: f64 = 4.4;

/// Assert that an estimate agrees with the truth and is sharp enough to tell it from `wrong`.
pub fn assert_is(what: &str, estimate: (f64, f64), truth: f64, wrong: f64) {
    println!("{what}: {:.6} ± {:.6}, truth {truth:.6}", estimate.0, estimate.1);
    assert!(z(estimate, truth).abs() < Z_LIMIT, "{what}: {estimate:?}, truth {truth}");
    // Negative control: the same test must reject the plausible wrong answer.
    assert!(z(estimate, wrong).abs() > Z_LIMIT, "{what}: cannot tell {truth} from {wrong} ({estimate:?})");
}
