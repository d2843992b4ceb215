//! Scenes built in code.

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

/// Add a material.
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

/// A grey Lambertian material.
pub fn diffuse(scene: &mut Scene, rho: f32) -> MaterialId {
    material(scene, MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::splat(rho)) })
}

/// Uniform emission of one side.
pub fn emission(radiance: f32) -> Option<Emission> {
    Some(Emission {
        radiance: Rgb::splat(radiance),
        image: None,
        two_sided: false,
        profile: Profile::Uniform,
    })
}

/// Add a shape.
pub fn shape(scene: &mut Scene, geometry: Geometry, material: MaterialId, emission: Option<Emission>) {
    scene.shapes.push(Shape::new(geometry, material, emission));
}

/// A mesh with normals at its vertices (or none).
pub fn mesh(
    scene: &mut Scene,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    indices: Vec<[u32; 3]>,
    material: MaterialId,
) {
    scene.meshes.push(Mesh { positions, normals, indices, ..Mesh::default() });
    let id = MeshId(scene.meshes.len() as u32 - 1);
    shape(scene, Geometry::Mesh(id), material, None);
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
    mesh(scene, (0..8).map(corner).collect(), Vec::new(), indices, material);
}

/// A sphere; inward: its outside is within.
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
    if let Some(s) = scene.shapes.last_mut() {
        s.reverse_orientation = inward;
    }
}

/// A surface of revolution about z with smooth normals: `profile(t)` for t in [0, 1] gives radius, height and the normal's
/// radial and axial parts (towards the side that counts as outside).
pub fn revolved(
    scene: &mut Scene,
    steps: [u32; 2],
    profile: impl Fn(f64) -> ([f64; 2], [f64; 2]),
    material: MaterialId,
) {
    let [rings, sectors] = steps;
    let (mut positions, mut normals, mut indices) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..=rings {
        let ([r, z], [nr, nz]) = profile(i as f64 / rings as f64);
        for j in 0..sectors {
            let (s, c) = (j as f64 / sectors as f64 * std::f64::consts::TAU).sin_cos();
            positions.push(Vec3::new((r * c) as f32, (r * s) as f32, z as f32));
            normals.push(Vec3::new((nr * c) as f32, (nr * s) as f32, nz as f32).normalize_or_zero());
        }
    }
    for i in 0..rings {
        for j in 0..sectors {
            let at = |i: u32, j: u32| i * sectors + j % sectors;
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            indices.extend([[a, d, c], [a, c, b]]);
        }
    }
    // Pointed ends leave triangles without area.
    indices.retain(|t: &[u32; 3]| {
        let p = t.map(|i| positions[i as usize]);
        (p[1] - p[0]).cross(p[2] - p[0]).length() > 1e-12
    });
    mesh(scene, positions, normals, indices, material);
}
