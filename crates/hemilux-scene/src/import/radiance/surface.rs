//! Surfaces: polygons, quadrics, tessellated cones, and sources at infinity.

use super::material::Look;
use super::words::{Word, Words};
use super::{Context, Primitive, Reader, polygon};
use crate::geom::{DAffine3, DVec3, Vec3};
use crate::{
    Emission, Environment, FloatParam, Geometry, Material, MaterialId, Mesh, MeshId, Quadric, Shape, Span,
    TextureImage,
};
use glam::DMat3;
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Facets of a cone. The inscribed polygon's radius is at worst 1 − cos(π/128) = 3e-4 too small.
pub const FACETS: usize = 128;

/// Deviation from a plane, relative to size, from which a polygon is warned about.
const PLANAR: f64 = 1e-3;

/// Which open mesh a triangle belongs to: definition, and whether it has normals.
type Key = (Option<usize>, bool);

/// The scene so far.
#[derive(Default)]
pub struct Build {
    pub materials: Vec<Material>,
    pub images: Vec<TextureImage>,
    pub environments: Vec<Environment>,
    pub meshes: Vec<Mesh>,
    pub shapes: Vec<Shape>,
    open: HashMap<Key, (usize, Look, Span)>,
    /// Surfaces without material.
    pub invisible: usize,
    /// Polygons without area.
    pub degenerate: usize,
    pub degenerate_span: Span,
    pub surfaces: usize,
}

impl Build {
    pub fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    /// The mesh that collects the triangles of one modifier.
    fn mesh(&mut self, key: Key, look: &Look, span: Span) -> &mut Mesh {
        let next = self.meshes.len();
        let (i, ..) = *self.open.entry(key).or_insert_with(|| (next, look.clone(), span));
        if i == next {
            self.meshes.push(Mesh::default());
        }
        &mut self.meshes[i]
    }

    /// Meshes become shapes, in the order of their first triangle.
    pub fn close_meshes(&mut self) {
        let mut open: Vec<_> = std::mem::take(&mut self.open).into_values().collect();
        open.sort_by_key(|o| o.0);
        for (mesh, look, span) in open {
            if let Some(shape) = shape(Geometry::Mesh(MeshId(mesh as u32)), &look, span) {
                self.shapes.push(shape);
            }
        }
    }
}

fn shape(geometry: Geometry, look: &Look, span: Span) -> Option<Shape> {
    let emission = look.emission.clone().filter(|e| !e.radiance.is_black());
    Some(Shape {
        alpha: (look.opacity < 1.0).then_some(FloatParam::Constant(look.opacity)),
        span,
        ..Shape::new(geometry, look.material?, emission)
    })
}

impl Reader {
    /// Add a surface whose modifier is known.
    pub(super) fn surface(
        &mut self,
        words: &mut Words,
        modifier: Option<usize>,
        p: &Primitive,
        context: &Context,
    ) {
        self.build.surfaces += 1;
        let Some(look) = self.look(modifier) else {
            return;
        };
        if p.kind.name == "source" {
            self.source(words, p, &look, context);
            return;
        }
        if look.sky.is_some() && look.emission.is_some() {
            let message = format!("{} \"{}\": only a source can have a sky", p.kind.name, words.text(p.id));
            self.env.log.unknown(p.head, message);
            return;
        }
        let placed = match p.kind.name {
            "polygon" => self.polygon(words, modifier, p, &look, context),
            "sphere" | "bubble" => self.sphere(words, p, &look, context),
            "cylinder" | "tube" => self.cylinder(words, modifier, p, &look, context),
            "cone" | "cup" => self.cone(words, modifier, p, &look, context),
            _ => self.ring(words, p, &look, context),
        };
        if placed.is_some() && look.material.is_none() {
            self.build.invisible += 1;
        }
    }

    fn wrong(&self, words: &mut Words, word: Word, message: String) -> Option<()> {
        let span = words.span(word);
        self.env.log.error(span, message);
        None
    }

    fn owner_of(&self, words: &Words, p: &Primitive) -> String {
        format!("{} \"{}\"", p.kind.name, words.text(p.id))
    }

    /// A radius that must be positive (or may be 0).
    fn radius(&self, words: &mut Words, p: &Primitive, i: usize, zero: bool) -> Option<f64> {
        let r = p.reals[i];
        if r > 0.0 || (zero && r == 0.0) {
            return Some(r);
        }
        let wanted = if zero { "must not be negative" } else { "must be positive" };
        let message = format!("radius of {} {wanted}, not {r}", self.owner_of(words, p));
        self.wrong(words, p.numbers[i], message)?;
        None
    }

    fn too_large(&self, words: &Words, p: &Primitive) -> Option<()> {
        let message = format!("{} is not finite in single precision", self.owner_of(words, p));
        self.env.log.error(p.head, message);
        None
    }

    fn polygon(
        &mut self,
        words: &mut Words,
        modifier: Option<usize>,
        p: &Primitive,
        look: &Look,
        context: &Context,
    ) -> Option<()> {
        if !p.reals.len().is_multiple_of(3) {
            let message = format!(
                "{} takes three numbers per vertex: {} is no multiple of 3",
                self.owner_of(words, p),
                p.reals.len()
            );
            return self.wrong(words, p.count, message);
        }
        let mut points: Vec<DVec3> =
            p.reals.chunks_exact(3).map(|c| context.map.point(DVec3::new(c[0], c[1], c[2]))).collect();
        if points.iter().any(|q| !q.as_vec3().is_finite()) {
            return self.too_large(words, p);
        }
        if context.map.mirrors() != context.invert {
            points.reverse();
        }
        let area = polygon::area_vector(&points);
        let size2 = points.iter().map(|q| (*q - points[0]).length_squared()).fold(0.0, f64::max);
        if area.length() <= 1e-12 * size2 || !area.is_finite() {
            self.build.degenerate += 1;
            if self.build.degenerate == 1 {
                self.build.degenerate_span = p.head;
            }
            return None;
        }
        if points.len() > 3 && polygon::out_of_plane(&points, area.normalize()) > PLANAR {
            let message = format!("{} is not planar", self.owner_of(words, p));
            self.env.log.warning(p.head, message);
        }
        look.material?;
        let triangles = polygon::triangulate(&points, area);
        let mesh = self.build.mesh((modifier, false), look, p.head);
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(points.iter().map(|q| q.as_vec3()));
        for t in triangles {
            let t = t.map(|i| i + first);
            let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
            // Single precision may have flattened it.
            if (b - a).as_dvec3().cross((c - a).as_dvec3()) != DVec3::ZERO {
                mesh.indices.push(t);
            }
        }
        Some(())
    }

    fn sphere(&mut self, words: &mut Words, p: &Primitive, look: &Look, context: &Context) -> Option<()> {
        let radius = self.radius(words, p, 3, false)? * context.map.scale;
        let centre = context.map.point(DVec3::new(p.reals[0], p.reals[1], p.reals[2]));
        let q = Quadric::Sphere { radius, z_min: -radius, z_max: radius, phi_max: TAU };
        self.quadric(words, p, q, DAffine3::from_translation(centre), p.kind.name == "bubble", look, context)
    }

    fn quadric(
        &mut self,
        words: &Words,
        p: &Primitive,
        q: Quadric,
        at: DAffine3,
        inward: bool,
        look: &Look,
        context: &Context,
    ) -> Option<()> {
        let extent = match q {
            Quadric::Sphere { radius, .. } | Quadric::Disk { radius, .. } => radius,
            Quadric::Cylinder { radius, z_max, .. } => radius.max(z_max),
        };
        let reach = at.translation.abs().max_element() + extent;
        if !(reach as f32).is_finite() || (extent as f32) < f32::MIN_POSITIVE {
            return self.too_large(words, p);
        }
        let mut shape = shape(Geometry::Quadric(q, at), look, p.head)?;
        shape.reverse_orientation = inward != context.invert;
        shape.name = words.text(p.id).to_owned();
        self.build.shapes.push(shape);
        Some(())
    }

    /// Both ends of an axis, and its length.
    fn axis(&self, words: &mut Words, p: &Primitive, context: &Context) -> Option<(DVec3, DVec3, f64)> {
        let v = &p.reals;
        let (a, b) = (DVec3::new(v[0], v[1], v[2]), DVec3::new(v[3], v[4], v[5]));
        let (a, b) = (context.map.point(a), context.map.point(b));
        let length = (b - a).length();
        if length > 0.0 && length.is_finite() {
            return Some((a, b, length));
        }
        let message = format!("both ends of {} are the same point", self.owner_of(words, p));
        self.wrong(words, p.numbers[3], message)?;
        None
    }

    fn cylinder(
        &mut self,
        words: &mut Words,
        _modifier: Option<usize>,
        p: &Primitive,
        look: &Look,
        context: &Context,
    ) -> Option<()> {
        let radius = self.radius(words, p, 6, false)? * context.map.scale;
        let (a, b, length) = self.axis(words, p, context)?;
        let at = placement(a, (b - a) / length);
        let q = Quadric::Cylinder { radius, z_min: 0.0, z_max: length, phi_max: TAU };
        self.quadric(words, p, q, at, p.kind.name == "tube", look, context)
    }

    fn ring(&mut self, words: &mut Words, p: &Primitive, look: &Look, context: &Context) -> Option<()> {
        let (r0, r1) = (self.radius(words, p, 6, true)?, self.radius(words, p, 7, true)?);
        let (inner, outer) = (r0.min(r1) * context.map.scale, r0.max(r1) * context.map.scale);
        if inner == outer {
            let message = format!("both radii of {} are {r0}", self.owner_of(words, p));
            return self.wrong(words, p.numbers[7], message);
        }
        let v = &p.reals;
        let centre = context.map.point(DVec3::new(v[0], v[1], v[2]));
        let Some(normal) = context.map.vector(DVec3::new(v[3], v[4], v[5])).try_normalize() else {
            let message = format!("{} has no normal", self.owner_of(words, p));
            return self.wrong(words, p.numbers[3], message);
        };
        let q = Quadric::Disk { height: 0.0, radius: outer, inner_radius: inner, phi_max: TAU };
        self.quadric(words, p, q, placement(centre, normal), false, look, context)
    }

    fn cone(
        &mut self,
        words: &mut Words,
        modifier: Option<usize>,
        p: &Primitive,
        look: &Look,
        context: &Context,
    ) -> Option<()> {
        let (r0, r1) = (self.radius(words, p, 6, true)?, self.radius(words, p, 7, true)?);
        let (a, b, length) = self.axis(words, p, context)?;
        if r0 == 0.0 && r1 == 0.0 {
            let message = format!("both radii of {} are 0", self.owner_of(words, p));
            return self.wrong(words, p.numbers[7], message);
        }
        let (r0, r1) = (r0 * context.map.scale, r1 * context.map.scale);
        let reach = a.abs().max(b.abs()).max_element() + r0.max(r1);
        if !(reach as f32).is_finite() {
            return self.too_large(words, p);
        }
        let inward = (p.kind.name == "cup") != context.invert;
        if r0 == r1 {
            let q = Quadric::Cylinder { radius: r0, z_min: 0.0, z_max: length, phi_max: TAU };
            return self.quadric(
                words,
                p,
                q,
                placement(a, (b - a) / length),
                p.kind.name == "cup",
                look,
                context,
            );
        }
        look.material?;
        let m = placement(a, (b - a) / length).matrix3;
        let mesh = self.build.mesh((modifier, true), look, p.head);
        let first = mesh.positions.len() as u32;
        let sign = if inward { -1.0 } else { 1.0 };
        for i in 0..FACETS {
            let (sin, cos) = (i as f64 / FACETS as f64 * TAU).sin_cos();
            let out = m * DVec3::new(cos, sin, 0.0);
            // The slope: over `length` along the axis the radius changes by r1 − r0.
            let n = m * DVec3::new(cos * length, sin * length, r0 - r1).normalize() * sign;
            mesh.positions.extend([(a + out * r0).as_vec3(), (b + out * r1).as_vec3()]);
            mesh.normals.extend([n.as_vec3(); 2]);
        }
        for i in 0..FACETS as u32 {
            let j = (i + 1) % FACETS as u32;
            let at = |k: u32, end: u32| first + 2 * k + end;
            let (low, high) = ([at(i, 0), at(j, 0), at(j, 1)], [at(i, 0), at(j, 1), at(i, 1)]);
            for t in [low, high] {
                let t = if inward { [t[0], t[2], t[1]] } else { t };
                let [x, y, z] = t.map(|k| mesh.positions[k as usize]);
                if (y - x).as_dvec3().cross((z - x).as_dvec3()) != DVec3::ZERO {
                    mesh.indices.push(t);
                }
            }
        }
        Some(())
    }

    fn source(&mut self, words: &mut Words, p: &Primitive, look: &Look, context: &Context) {
        let v = &p.reals;
        let direction = context.map.vector(DVec3::new(v[0], v[1], v[2])).try_normalize();
        let Some(direction) = direction else {
            let message = format!("{} has no direction", self.owner_of(words, p));
            let _ = self.wrong(words, p.numbers[0], message);
            return;
        };
        let angle = v[3];
        if !(angle > 0.0 && angle <= 360.0) {
            let owner = self.owner_of(words, p);
            let message = format!("angle of {owner} must be in (0, 360] degrees, not {angle}");
            let _ = self.wrong(words, p.numbers[3], message);
            return;
        }
        let Some(Emission { radiance, .. }) = look.emission.clone() else {
            if look.material.is_some() {
                let message = format!("{} does not emit: it is left out", self.owner_of(words, p));
                self.env.log.warning(p.head, message);
            }
            return;
        };
        if !radiance.is_finite() {
            let _ = self.too_large(words, p);
            return;
        }
        if let Some(sky) = look.sky {
            self.sky_source(sky, radiance, direction, angle, p.head);
        } else if radiance.is_black() {
            // A sun below its clouds.
        } else if angle >= 360.0 {
            self.build.environments.push(Environment::Constant { radiance });
        } else {
            let half = (0.5 * angle).to_radians();
            // 1 − cos by the half-angle formula, which keeps its digits for the sun.
            let cos_half_angle = 1.0 - 2.0 * (0.5 * half).sin().powi(2);
            let direction: Vec3 = direction.as_vec3().normalize();
            self.build.environments.push(Environment::Sun { direction, cos_half_angle, radiance });
        }
    }
}

/// A frame at `origin` whose z axis is `z` (unit).
fn placement(origin: DVec3, z: DVec3) -> DAffine3 {
    let x = z.any_orthonormal_vector();
    DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation: origin }
}
