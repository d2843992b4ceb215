//! The end of a load: names are resolved, point luminaires become spheres, and what a [`Scene`] promises is checked.

use super::Env;
use super::builder::{Builder, PointLight};
use super::transform;
use crate::geom::{DAffine3, DVec3, Vec2, Vec3};
use crate::{
    Camera, Emission, Environment, Film, Filter, Geometry, Instance, Material, MaterialId, MaterialKind,
    Mesh, Projection, Quadric, Rgb, RgbParam, Scene, Shape, Span,
};
use std::f64::consts::{PI, TAU};

/// Most pixels of a film.
pub const MAX_PIXELS: u64 = 1 << 31;
/// Bytes that a pixel of film takes while rendering, about: sums, squares and auxiliary channels in 32 and 64 bits.
pub const BYTES_PER_PIXEL: u64 = 96;
/// Radius of the sphere that stands for a point luminaire, relative to the diagonal of the scene.
const LIGHT_RADIUS: f64 = 1e-3;
/// Triangles × luminaires that are looked at to keep those spheres clear of surfaces.
const CLEARANCE_BUDGET: usize = 20_000_000;

impl Builder {
    /// The scene, or errors in the log.
    pub fn finish(mut self) -> Option<Scene> {
        let env = self.env.clone();
        if let Some((directive, span)) = self.premature.take() {
            env.log.error(span, format!("{directive} must come after WorldBegin"));
        }
        self.resolve_materials();
        self.resolve_instances();
        self.expand_luminous_instances();
        self.place_point_lights();
        if self.degenerate > 0 {
            let message = format!("{} triangles without area were left out", self.degenerate);
            env.log.note(self.degenerate_span, message);
        }
        let film = self.checked_film();
        self.check_transforms();
        if env.log.errors() > 0 {
            return None;
        }
        let camera = self.camera.take().unwrap_or_else(|| {
            env.log.warning(Span::default(), "no Camera: at the origin, looking along z, field of view 90°");
            default_camera()
        });
        let lit = !self.environments.is_empty() || self.shapes.iter().any(|s| s.emission.is_some());
        if !lit {
            env.log.warning(Span::default(), "no luminaire: the picture will be black");
        }
        report_unused_defines(&env);
        let files = env.files.borrow();
        Some(Scene {
            camera,
            film,
            filter: self.filter.unwrap_or(Filter::Gaussian { radius: Vec2::splat(1.5), sigma: 0.5 }),
            samples_per_pixel: self.samples_per_pixel,
            max_depth: self.max_depth,
            textures: self.textures,
            images: self.images,
            materials: self.materials,
            meshes: self.meshes,
            shapes: self.shapes,
            objects: self.objects,
            instances: self.instances,
            environments: self.environments,
            photometry: crate::Photometry::CIE,
            files: files.paths.clone(),
            content_hash: files.hash.0,
        })
    }

    fn resolve_materials(&mut self) {
        let env = self.env.clone();
        let mut missing: Vec<_> = self
            .named_materials
            .iter()
            .filter(|(_, m)| !m.defined)
            .map(|(n, m)| (m.span, n.clone()))
            .collect();
        missing.sort_by_key(|(s, _)| (s.file, s.line, s.column));
        for (span, name) in missing {
            let known = self.named_materials.iter().filter(|(_, m)| m.defined).map(|(n, _)| n.as_str());
            env.log.unknown_among(span, format!("material \"{name}\" is not defined"), &name, known);
        }
        let replaced = std::mem::take(&mut self.replaced);
        if replaced.is_empty() {
            return;
        }
        let groups = self.objects.iter_mut().map(|o| &mut o.shapes).chain([&mut self.shapes]);
        for shape in groups.flatten() {
            if let Some(id) = replaced.get(&shape.material) {
                shape.material = *id;
            }
        }
    }

    fn resolve_instances(&mut self) {
        for (name, to_world, span) in std::mem::take(&mut self.placements) {
            match self.object_names.get(&name) {
                Some(&(object, _)) => self.instances.push(Instance { object, to_world }),
                None => {
                    let known = self.object_names.keys().map(String::as_str);
                    let message = format!("object \"{name}\" is not defined");
                    self.env.log.unknown_among(span, message, &name, known);
                }
            }
        }
    }

    /// Luminous shapes of objects are copied into the world once per instance, so that every luminaire is a shape of
    /// the world.
    fn expand_luminous_instances(&mut self) {
        let env_memory = self.env.memory;
        for i in 0..self.objects.len() {
            let (luminous, dark): (Vec<Shape>, Vec<Shape>) =
                std::mem::take(&mut self.objects[i].shapes).into_iter().partition(|s| s.emission.is_some());
            self.objects[i].shapes = dark;
            let Some(first) = luminous.first() else { continue };
            let message = "a luminaire in an object: each instance has its own copy of it (pbrt ignores it)";
            self.env.log.warning(first.span, message);
            let placed: Vec<DAffine3> =
                self.instances.iter().filter(|n| n.object as usize == i).map(|n| n.to_world).collect();
            let bytes: u64 = luminous.iter().map(|s| self.bytes_of(s)).sum();
            if bytes.saturating_mul(placed.len() as u64) > env_memory {
                self.env.log.error(first.span, "the copies of this luminaire exceed the memory limit");
                continue;
            }
            for m in &placed {
                for shape in &luminous {
                    let copy = self.placed_copy(shape, m);
                    self.shapes.push(copy);
                }
            }
        }
    }

    /// Memory that a copy of a shape takes, about.
    fn bytes_of(&self, shape: &Shape) -> u64 {
        let vertices = match shape.geometry {
            Geometry::Mesh(id) => {
                let mesh = &self.meshes[id.0 as usize];
                mesh.positions.len() + mesh.indices.len()
            }
            Geometry::Quadric(..) => 0,
        };
        500 + 32 * vertices as u64
    }

    fn placed_copy(&mut self, shape: &Shape, m: &DAffine3) -> Shape {
        let mut copy = shape.clone();
        copy.geometry = match shape.geometry {
            Geometry::Mesh(id) => {
                let mesh = transformed(&self.meshes[id.0 as usize], m);
                self.meshes.push(mesh);
                Geometry::Mesh(crate::MeshId(self.meshes.len() as u32 - 1))
            }
            Geometry::Quadric(q, to_group) => Geometry::Quadric(q, *m * to_group),
        };
        copy
    }

    // Point luminaires.

    fn place_point_lights(&mut self) {
        let lights = std::mem::take(&mut self.point_lights);
        if lights.is_empty() {
            return;
        }
        let env = self.env.clone();
        let wanted = env
            .define("light-radius")
            .map(|v| v.trim().parse::<f64>().ok().filter(|r| *r > 0.0 && r.is_finite()));
        if wanted == Some(None) {
            env.log.error(Span::default(), "-D light-radius must be a positive number of metres");
        }
        let black = MaterialId(self.materials.len() as u32);
        self.materials.push(Material {
            kind: MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::BLACK) },
            bump: None,
            normal_map: None,
            name: "luminaire".into(),
            span: lights[0].span,
        });
        let diagonal = self.diagonal();
        let mut budget = CLEARANCE_BUDGET;
        for light in lights {
            let radius = match wanted.flatten() {
                Some(r) => r,
                None => self.clear_radius(&light, diagonal, &mut budget),
            };
            let p = light.position;
            let message = format!(
                "the point luminaire at ({:.6}, {:.6}, {:.6}) became a sphere of radius {radius:.3e} m (-D light-radius)",
                p.x, p.y, p.z
            );
            env.log.note(light.span, message);
            self.shapes.push(sphere_of(&light, radius, black));
        }
    }

    /// A thousandth of the scene, but at most half the way to the nearest surface.
    fn clear_radius(&self, light: &PointLight, diagonal: f64, budget: &mut usize) -> f64 {
        let default = if diagonal > 0.0 { LIGHT_RADIUS * diagonal } else { LIGHT_RADIUS };
        let mut nearest = f64::INFINITY;
        for (shape, m) in self.placed_shapes() {
            if *budget == 0 {
                break;
            }
            *budget -= 1;
            let p = m.map_or(light.position, |m| m.inverse().transform_point3(light.position));
            // An instance may shrink distances; its smallest stretch bounds by how much.
            let stretch = m.map_or(1.0, |m| 1.0 / longest_stretch(&m.inverse()));
            match &shape.geometry {
                Geometry::Mesh(id) => {
                    let mesh = &self.meshes[id.0 as usize];
                    if *budget < mesh.indices.len() {
                        continue;
                    }
                    *budget -= mesh.indices.len();
                    for t in &mesh.indices {
                        let [a, b, c] = t.map(|i| mesh.positions[i as usize].as_dvec3());
                        nearest = nearest.min(stretch * distance_to_triangle(p, a, b, c));
                    }
                }
                Geometry::Quadric(q, to_group) => {
                    let inverse = to_group.inverse();
                    let d = distance_to_quadric(q, inverse.transform_point3(p)) / longest_stretch(&inverse);
                    nearest = nearest.min(stretch * d);
                }
            }
        }
        let radius = default.min(0.5 * nearest);
        if radius < 1e-6 * default {
            self.env.log.warning(light.span, "a luminaire lies on a surface: its sphere cuts through it");
            return default;
        }
        radius
    }

    fn placed_shapes(&self) -> impl Iterator<Item = (&Shape, Option<DAffine3>)> {
        let placed = self.instances.iter().flat_map(|n| {
            let object = self.objects.get(n.object as usize);
            object.into_iter().flat_map(|o| &o.shapes).map(|s| (s, Some(n.to_world)))
        });
        self.shapes.iter().map(|s| (s, None)).chain(placed)
    }

    fn diagonal(&self) -> f64 {
        let meshes: Vec<Bounds> = self.meshes.iter().map(Bounds::of_mesh).collect();
        let group = |shapes: &[Shape]| {
            shapes.iter().fold(Bounds::EMPTY, |all, shape| match &shape.geometry {
                Geometry::Mesh(id) => all.union(meshes[id.0 as usize]),
                Geometry::Quadric(q, m) => all.union(Bounds::of_quadric(q).transformed(m)),
            })
        };
        let objects: Vec<Bounds> = self.objects.iter().map(|o| group(&o.shapes)).collect();
        let all = self.instances.iter().fold(group(&self.shapes), |all, n| {
            all.union(objects[n.object as usize].transformed(&n.to_world))
        });
        let d = (all.high - all.low).length();
        if d.is_finite() { d } else { 0.0 }
    }

    // Checks.

    fn checked_film(&mut self) -> Film {
        let (mut film, span) = self.film.take().unwrap_or_else(|| (default_film(), Span::default()));
        film.scale *= self.exposure_time as f32;
        let (w, h) = (u64::from(film.width), u64::from(film.height));
        let pixels = w * h;
        let [x0, x1, y0, y1] = film.crop.map(f64::from);
        let rendered = (pixels as f64 * (x1 - x0) * (y1 - y0)) as u64;
        if pixels > MAX_PIXELS {
            self.env.log.error(span, format!("a film of {w} x {h} pixels is too large: at most 2^31 pixels"));
        } else if rendered.saturating_mul(BYTES_PER_PIXEL) > self.env.memory {
            let need = (rendered * BYTES_PER_PIXEL) >> 20;
            let have = self.env.memory >> 20;
            let message = format!(
                "a film of {w} x {h} pixels is too large: it takes {need} MiB, the limit is {have} MiB"
            );
            self.env.log.error(span, message);
        }
        film
    }

    /// Products of invertible transforms can still overflow.
    fn check_transforms(&self) {
        let groups = self.objects.iter().map(|o| &o.shapes).chain([&self.shapes]);
        for shape in groups.flatten() {
            if let Geometry::Quadric(q, m) = &shape.geometry {
                let reach = Bounds::of_quadric(q).transformed(m);
                let finite = reach.low.as_vec3().is_finite() && reach.high.as_vec3().is_finite();
                if !finite || !transform::is_invertible(m) {
                    self.env.log.error(shape.span, "the shape is not finite in single precision");
                }
            }
            if shape.emission.as_ref().is_some_and(|e| !e.radiance.is_finite()) {
                self.env.log.error(shape.span, "the emission is not finite in single precision");
            }
        }
        let finite = |e: &Environment| match e {
            Environment::Constant { radiance } | Environment::Sun { radiance, .. } => radiance.is_finite(),
            Environment::Image { scale, .. } => scale.is_finite(),
        };
        if !self.environments.iter().all(finite) {
            self.env
                .log
                .error(Span::default(), "an environment's radiance is not finite in single precision");
        }
        if self.instances.iter().any(|n| !transform::is_invertible(&n.to_world)) {
            self.env.log.error(Span::default(), "an instance has a singular transform");
        }
        if self.camera.as_ref().is_some_and(|c| !transform::is_invertible(&c.to_world)) {
            self.env.log.error(Span::default(), "the camera has a singular transform");
        }
    }
}

fn report_unused_defines(env: &Env) {
    let used = env.used_defines.borrow();
    for ((key, _), used) in env.options.defines.iter().zip(used.iter()) {
        if !used && key != "light-radius" {
            env.log.warning(Span::default(), format!("-D {key}: the scene has no ${key}"));
        }
    }
}

fn default_camera() -> Camera {
    Camera {
        projection: Projection::Perspective { fov: 90.0 },
        to_world: DAffine3::IDENTITY,
        screen_window: None,
        lens_radius: 0.0,
        focal_distance: 1e6,
        span: Span::default(),
    }
}

fn default_film() -> Film {
    Film { width: 1280, height: 720, crop: [0.0, 1.0, 0.0, 1.0], scale: 1.0, filename: None }
}

/// A sphere of the same intensity: I = L π r².
fn sphere_of(light: &PointLight, radius: f64, material: MaterialId) -> Shape {
    let radiance = light.intensity * (1.0 / (PI * radius * radius)) as f32;
    let geometry = Geometry::Quadric(
        Quadric::Sphere { radius, z_min: -radius, z_max: radius, phi_max: TAU },
        DAffine3::from_translation(light.position),
    );
    let emission = Emission { radiance, image: None, two_sided: false, profile: light.profile.clone() };
    Shape { span: light.span, ..Shape::new(geometry, material, Some(emission)) }
}

/// A mesh under a transform that keeps its faces on their side.
fn transformed(mesh: &Mesh, m: &DAffine3) -> Mesh {
    let n = transform::normal_matrix(m);
    let turn = transform::mirrors(m);
    Mesh {
        positions: mesh.positions.iter().map(|p| m.transform_point3(p.as_dvec3()).as_vec3()).collect(),
        normals: mesh.normals.iter().map(|v| (n * v.as_dvec3()).normalize_or_zero().as_vec3()).collect(),
        uvs: mesh.uvs.clone(),
        indices: mesh.indices.iter().map(|&[a, b, c]| if turn { [a, c, b] } else { [a, b, c] }).collect(),
    }
}

/// An axis-parallel box.
#[derive(Clone, Copy)]
struct Bounds {
    low: DVec3,
    high: DVec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    fn union(self, other: Bounds) -> Bounds {
        Bounds { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn of_mesh(mesh: &Mesh) -> Bounds {
        let fold =
            |f: fn(Vec3, Vec3) -> Vec3, start| mesh.positions.iter().copied().fold(start, f).as_dvec3();
        Bounds { low: fold(Vec3::min, Vec3::INFINITY), high: fold(Vec3::max, Vec3::NEG_INFINITY) }
    }

    fn of_quadric(q: &Quadric) -> Bounds {
        let (r, low, high) = match *q {
            Quadric::Sphere { radius, z_min, z_max, .. } | Quadric::Cylinder { radius, z_min, z_max, .. } => {
                (radius, z_min, z_max)
            }
            Quadric::Disk { radius, height, .. } => (radius, height, height),
        };
        Bounds { low: DVec3::new(-r, -r, low), high: DVec3::new(r, r, high) }
    }

    fn transformed(self, m: &DAffine3) -> Bounds {
        if self.low.x > self.high.x {
            return self;
        }
        (0..8).fold(Bounds::EMPTY, |all, i| {
            let pick = |bit: usize, low: f64, high: f64| if (i >> bit) & 1 == 0 { low } else { high };
            let (l, h) = (self.low, self.high);
            let corner =
                m.transform_point3(DVec3::new(pick(0, l.x, h.x), pick(1, l.y, h.y), pick(2, l.z, h.z)));
            all.union(Bounds { low: corner, high: corner })
        })
    }
}

/// A bound on how much a map stretches any vector (Frobenius norm).
fn longest_stretch(m: &DAffine3) -> f64 {
    let l = m.matrix3;
    (l.x_axis.length_squared() + l.y_axis.length_squared() + l.z_axis.length_squared()).sqrt()
}

/// Distance to the whole surface that the quadric is cut from (never more than to the quadric itself).
fn distance_to_quadric(q: &Quadric, p: DVec3) -> f64 {
    let across = p.x.hypot(p.y);
    match *q {
        Quadric::Sphere { radius, .. } => (p.length() - radius).abs(),
        Quadric::Disk { height, radius, .. } => (p.z - height).abs().hypot((across - radius).max(0.0)),
        Quadric::Cylinder { radius, z_min, z_max, .. } => {
            let beyond = (z_min - p.z).max(p.z - z_max).max(0.0);
            (across - radius).abs().hypot(beyond)
        }
    }
}

/// Distance from a point to a triangle (by the regions of Ericson, Real-Time Collision Detection, 5.1.5).
fn distance_to_triangle(p: DVec3, a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let n = (b - a).cross(c - a);
    let inside = |x: DVec3, y: DVec3| (y - x).cross(p - x).dot(n) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return (p - a).dot(n).abs() / n.length().max(f64::MIN_POSITIVE);
    }
    let edge = |x: DVec3, y: DVec3| {
        let d = y - x;
        let t = ((p - x).dot(d) / d.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        (x + d * t - p).length()
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}
