//! Lint for lighting models: what loads, and is still probably not what was meant.
//!
//! Each finding is a warning at the place of the shape or material it is about; where an importer has joined many shapes into one
//! mesh, at the first of them, and the message says where in space. Looked for: glass that is open or inside out, reflectances over 1,
//! the same triangle or quadric twice, suspicious units, luminaires brighter than the sun or that light nothing, and energy of
//! luminaires that leaves a scene without sky. (Shapes without extent and missing textures are the importers' to report.)
//!
//! Geometry is compared after rounding to a millionth of the scene's size. Triangles that overlap in one plane without being the same
//! are not found, nor are glass bodies made of parts of quadrics judged.

use crate::world::World;
use crate::world::luminaire::NO_LUMINAIRE;
use crate::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::{DAffine3, DVec3};
use hemilux_scene::{
    ConductorFresnel, Diagnostic, Geometry, MaterialId, MaterialKind, Mesh, Quadric, RgbParam, Scene,
    Severity, Shape, Span, Texture,
};
use std::collections::HashMap;

/// Particles by which luminaires and what becomes of their light are judged.
const PARTICLES: u64 = 1 << 14;
/// Fewer particles of a luminaire than this that all miss say nothing.
const ENOUGH: u32 = 64;
/// Share of the emitted power that may leave unmentioned.
const LEAK: f64 = 0.01;
/// Scenes larger or smaller than this (m) are probably not in metres.
const LARGEST: f32 = 5000.0;
const SMALLEST: f32 = 0.05;
/// More than the sun (cd/m²).
const BRIGHTEST: f64 = 2e9;

/// All findings, in no order that means anything.
pub fn findings(world: &World) -> Vec<Diagnostic> {
    let mut found = Vec::new();
    let scene = &world.scene;
    let size = 2.0 * world.bound().1;
    albedos(scene, &mut found);
    for shapes in std::iter::once(&scene.shapes).chain(scene.objects.iter().map(|o| &o.shapes)) {
        let grid = Grid { step: (size as f64 * 1e-6).max(1e-12) };
        duplicates(scene, shapes, grid, &mut found);
        glass(scene, shapes, grid, &mut found);
    }
    units(scene, size, &mut found);
    emitters(scene, &mut found);
    unlit(world, &mut found);
    escape(world, &mut found);
    found
}

fn warn(found: &mut Vec<Diagnostic>, span: Span, message: String, help: &str) {
    found.push(Diagnostic { severity: Severity::Warning, message, span, help: Some(help.to_owned()) });
}

/// The largest value of a parameter in any band.
fn largest(scene: &Scene, p: RgbParam) -> f32 {
    let top = |rgb: hemilux_scene::Rgb| rgb.0.iter().copied().fold(0.0, f32::max);
    let RgbParam::Texture(id) = p else {
        let RgbParam::Constant(c) = p else { return 0.0 };
        return top(c);
    };
    match &scene.textures[id.0 as usize] {
        Texture::Constant(c) => top(*c),
        Texture::Image { image, scale, invert: false, .. } => {
            let texels = &scene.images[image.0 as usize].texels;
            scale * texels.iter().map(|t| top(*t)).fold(0.0, f32::max)
        }
        Texture::Image { .. } => 1.0,
        Texture::Scale(a, b) => largest(scene, *a) * largest(scene, *b),
        Texture::Mix { a, b, .. } => largest(scene, *a).max(largest(scene, *b)),
        Texture::Checkerboard { even, odd, .. } => largest(scene, *even).max(largest(scene, *odd)),
    }
}

fn albedos(scene: &Scene, found: &mut Vec<Diagnostic>) {
    for m in &scene.materials {
        let albedo = match &m.kind {
            MaterialKind::Diffuse { reflectance } | MaterialKind::CoatedDiffuse { reflectance, .. } => {
                largest(scene, *reflectance)
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                scale * (largest(scene, *reflectance) + largest(scene, *transmittance))
            }
            MaterialKind::Conductor { fresnel: ConductorFresnel::Reflectance(r), .. } => largest(scene, *r),
            MaterialKind::Polished {
                diffuse, specular, diffuse_transmission, specular_transmission, ..
            } => (0..3)
                .map(|c| diffuse[c] + specular[c] + diffuse_transmission[c] + specular_transmission[c])
                .fold(0.0, f32::max),
            _ => 0.0,
        };
        if albedo > 1.0 + 1e-5 {
            let message = format!("material{} returns {albedo:.3} of what arrives", quoted(&m.name));
            warn(found, m.span, message, "reflectance and transmittance together must not exceed 1");
        }
    }
}

fn quoted(name: &str) -> String {
    if name.is_empty() { String::new() } else { format!(" \"{name}\"") }
}

/// Points rounded so that corners that are meant to coincide do.
#[derive(Clone, Copy)]
struct Grid {
    step: f64,
}

impl Grid {
    fn key(self, p: DVec3) -> [i64; 3] {
        (p / self.step).round().to_array().map(|x| x as i64)
    }
}

fn mesh<'a>(scene: &'a Scene, shape: &Shape) -> Option<&'a Mesh> {
    match shape.geometry {
        Geometry::Mesh(id) => scene.meshes.get(id.0 as usize),
        Geometry::Quadric(..) => None,
    }
}

fn corners(mesh: &Mesh, t: [u32; 3]) -> [DVec3; 3] {
    t.map(|i| mesh.positions[i as usize].as_dvec3())
}

/// A point, for a message.
fn near(p: DVec3) -> String {
    let [x, y, z] = p.to_array().map(|v| (1000.0 * v).round() / 1000.0 + 0.0);
    format!("near {x} {y} {z}")
}

/// The same triangle or quadric twice, whichever way it faces.
fn duplicates(scene: &Scene, shapes: &[Shape], grid: Grid, found: &mut Vec<Diagnostic>) {
    let mut triangles: HashMap<[[i64; 3]; 3], usize> = HashMap::new();
    let mut quadrics: HashMap<String, usize> = HashMap::new();
    // Pairs of shapes that have been told.
    let mut told = std::collections::HashSet::new();
    for (i, shape) in shapes.iter().enumerate() {
        let mut twin = None;
        if let Geometry::Quadric(q, placed) = shape.geometry {
            twin = quadrics.insert(format!("{q:?} {placed:?}"), i).map(|first| (first, placed.translation));
        }
        for t in mesh(scene, shape).iter().flat_map(|mesh| &mesh.indices) {
            let Some(mesh) = mesh(scene, shape) else { break };
            let p = corners(mesh, *t);
            let mut key = p.map(|p| grid.key(p));
            key.sort_unstable();
            let first = triangles.insert(key, i);
            twin = first.map(|first| (first, (p[0] + p[1] + p[2]) / 3.0)).or(twin);
        }
        let Some((first, place)) = twin.filter(|(first, _)| told.insert((*first, i))) else { continue };
        let place = near(place);
        let message = match first == i {
            true => format!("the same triangle lies there twice, {place}"),
            false => {
                format!("a shape lies where that of line {} lies already, {place}", shapes[first].span.line)
            }
        };
        warn(found, shape.span, message, "of two surfaces in one place either may be met: remove one");
    }
}

/// One connected body of triangles.
#[derive(Default)]
struct Body {
    span: Span,
    volume: f64,
    low: DVec3,
    high: DVec3,
    /// Edges with a triangle on one side only; edges whose triangles face different ways.
    open: usize,
    turned: usize,
}

fn glass(scene: &Scene, shapes: &[Shape], grid: Grid, found: &mut Vec<Diagnostic>) {
    let mut by_material: HashMap<u32, Vec<&Shape>> = HashMap::new();
    for shape in shapes {
        if is_glass(scene, shape.material) {
            by_material.entry(shape.material.0).or_default().push(shape);
        }
    }
    for (material, shapes) in by_material {
        let name = quoted(&scene.materials[material as usize].name);
        let mut bodies = bodies(scene, &shapes, grid);
        let partly = whole_spheres(&shapes, &mut bodies);
        for (i, body) in bodies.iter().enumerate() {
            let within = bodies.iter().enumerate().any(|(j, other)| {
                i != j && other.low.cmple(body.low).all() && other.high.cmpge(body.high).all()
            });
            let place = near((body.low + body.high) * 0.5);
            if partly && (body.open > 0 || body.turned > 0) {
                continue;
            }
            if body.open > 0 {
                let message = format!("glass{name} is open, {place}: {} edges have no other side", body.open);
                warn(found, body.span, message, "close the body, or use a thin pane (thindielectric, glass)");
            } else if body.turned > 0 {
                let message = format!(
                    "glass{name}, {place}: neighbouring faces look different ways at {} edges",
                    body.turned
                );
                warn(found, body.span, message, "let all faces look outwards");
            } else if body.volume < 0.0 && !within {
                let message = format!("glass{name} is inside out, {place}: its faces look inwards");
                warn(
                    found,
                    body.span,
                    message,
                    "reverse its orientation; only a hollow in other glass looks inwards",
                );
            }
        }
    }
}

fn is_glass(scene: &Scene, id: MaterialId) -> bool {
    matches!(
        scene.materials[id.0 as usize].kind,
        MaterialKind::Dielectric { .. } | MaterialKind::TintedDielectric { .. }
    )
}

/// Adds whole spheres as bodies; whether there are other quadrics.
fn whole_spheres(shapes: &[&Shape], bodies: &mut Vec<Body>) -> bool {
    let mut partly = false;
    for shape in shapes {
        let Geometry::Quadric(q, placed) = shape.geometry else { continue };
        match q {
            Quadric::Sphere { radius, z_min, z_max, phi_max }
                if z_min <= -radius && z_max >= radius && phi_max >= std::f64::consts::TAU * (1.0 - 1e-6) =>
            {
                let mirrored = placed.matrix3.determinant() < 0.0;
                let inwards = shape.reverse_orientation ^ shape.flips_handedness ^ mirrored;
                let half = extent(&placed) * radius;
                let (centre, volume) = (placed.translation, if inwards { -1.0 } else { 1.0 });
                let (low, high) = (centre - half, centre + half);
                bodies.push(Body { span: shape.span, volume, low, high, ..Body::default() });
            }
            _ => partly = true,
        }
    }
    partly
}

/// Half the size of the box around a placed unit ball.
fn extent(placed: &DAffine3) -> DVec3 {
    let m = placed.matrix3.transpose();
    DVec3::new(m.x_axis.length(), m.y_axis.length(), m.z_axis.length())
}

/// The connected bodies of the meshes among shapes of one material.
fn bodies(scene: &Scene, shapes: &[&Shape], grid: Grid) -> Vec<Body> {
    let mut names: HashMap<[i64; 3], u32> = HashMap::new();
    let mut parent: Vec<u32> = Vec::new();
    let mut triangles = Vec::new();
    for shape in shapes {
        let Some(mesh) = mesh(scene, shape) else { continue };
        let turned = shape.reverse_orientation ^ shape.flips_handedness;
        for t in &mesh.indices {
            let mut p = corners(mesh, *t);
            if turned {
                p.swap(1, 2);
            }
            let v = p.map(|p| {
                let next = parent.len() as u32;
                let id = *names.entry(grid.key(p)).or_insert(next);
                if id == next {
                    parent.push(next);
                }
                id
            });
            if v[0] == v[1] || v[1] == v[2] || v[0] == v[2] {
                continue;
            }
            for pair in [(v[0], v[1]), (v[1], v[2])] {
                let (a, b) = (root(&mut parent, pair.0), root(&mut parent, pair.1));
                parent[a as usize] = b;
            }
            triangles.push((v, p, shape.span));
        }
    }
    // Per edge, how often it is walked each way.
    let mut edges: HashMap<(u32, u32), [u32; 2]> = HashMap::new();
    let mut all: HashMap<u32, Body> = HashMap::new();
    for (v, p, span) in triangles {
        for (a, b) in [(v[0], v[1]), (v[1], v[2]), (v[2], v[0])] {
            edges.entry((a.min(b), a.max(b))).or_default()[(a > b) as usize] += 1;
        }
        let body = all.entry(root(&mut parent, v[0])).or_insert_with(|| Body {
            span,
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
            ..Body::default()
        });
        body.volume += p[0].dot(p[1].cross(p[2])) / 6.0;
        for p in p {
            (body.low, body.high) = (body.low.min(p), body.high.max(p));
        }
    }
    for ((a, _), [there, back]) in edges {
        let Some(body) = all.get_mut(&root(&mut parent, a)) else { continue };
        match there.abs_diff(back) {
            0 => {}
            _ if (there + back) % 2 == 1 => body.open += 1,
            _ => body.turned += 1,
        }
    }
    let mut list: Vec<Body> = all.into_values().collect();
    list.sort_by_key(|b| (b.span.file, b.span.line, b.span.column));
    list
}

fn root(parent: &mut [u32], mut i: u32) -> u32 {
    while parent[i as usize] != i {
        parent[i as usize] = parent[parent[i as usize] as usize];
        i = parent[i as usize];
    }
    i
}

fn units(scene: &Scene, size: f32, found: &mut Vec<Diagnostic>) {
    let empty = scene.shapes.is_empty() && scene.instances.is_empty();
    let help = "lengths are metres: xform -s .001 for a model in millimetres (pbrt: Scale)";
    if !empty && size > LARGEST {
        warn(found, Span::default(), format!("the scene is {size:.0} m across"), help);
    } else if !empty && size < SMALLEST {
        warn(found, Span::default(), format!("the scene is only {:.2} mm across", 1000.0 * size), help);
    }
}

fn emitters(scene: &Scene, found: &mut Vec<Diagnostic>) {
    for shape in scene.shapes.iter().chain(scene.objects.iter().flat_map(|o| &o.shapes)) {
        let Some(emission) = &shape.emission else { continue };
        let luminance = scene.photometry.luminous(emission.radiance);
        if luminance > BRIGHTEST {
            let message = format!("a luminaire of {luminance:.1e} cd/m2 is brighter than the sun");
            warn(found, shape.span, message, "radiance is W/sr/m2, not the lumens of the lamp");
        }
    }
}

/// Luminaires none of whose particles meets anything.
fn unlit(world: &World, found: &mut Vec<Diagnostic>) {
    let emitting: Vec<&Shape> = world.scene.shapes.iter().filter(|s| s.emission.is_some()).collect();
    let mut tries = vec![(0u32, 0u32); emitting.len()];
    for i in 0..PARTICLES {
        let u = |k: u32| {
            let p = hemiquad::points::sobol(i as u32, hemiquad::points::Key::new(u64::from(k) + 17));
            [p.u as f32, p.v as f32]
        };
        let pick = (i as f32 + 0.5) / PARTICLES as f32;
        let Some(p) = world.luminaires.emit(&world.scene, pick, u(0), u(1)) else { continue };
        let Some((id, _, _)) = world.luminaires.identity(&world.scene, p.luminaire) else { continue };
        let Some(count) = tries.get_mut(id as usize) else { continue };
        count.0 += 1;
        let hit = world.closest(p.origin, p.dir, f32::INFINITY);
        count.1 += hit.is_some_and(|s| s.luminaire == NO_LUMINAIRE) as u32;
    }
    for (shape, (tried, met)) in emitting.iter().zip(tries) {
        if tried >= ENOUGH && met == 0 {
            let help =
                "it lies outside the model, or faces away: a luminaire emits to the side of its normal";
            warn(found, shape.span, "a luminaire lights nothing".into(), help);
        }
    }
}

fn escape(world: &World, found: &mut Vec<Diagnostic>) {
    if !world.scene.environments.is_empty() || world.luminaires.is_empty() {
        return;
    }
    let zones = Zones::solve(world, &ZoneOptions { budget: 256, particles: PARTICLES, seed: 1 });
    let sum = |v: [f64; 3]| v.iter().sum::<f64>();
    let share = sum(zones.ledger.escaped) / sum(zones.ledger.emitted).max(f64::MIN_POSITIVE);
    if share > LEAK {
        let message = format!("{:.0} % of what the luminaires emit leaves the scene", 100.0 * share);
        warn(
            found,
            Span::default(),
            message,
            "a room that is meant to be closed has a gap, or a wall is missing",
        );
    }
}
