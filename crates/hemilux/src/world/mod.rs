//! The prepared scene: ray-tracing structure, luminaires, and what lies at a hit. Immutable and shared by all threads.
//!
//! [`World::new`] turns a [`Scene`] into a form rays can meet; nothing later changes it. Primitive ids are those of
//! `hemilux-accel`: per group (the world's own shapes, and each object) in the order of addition.

pub mod balls;
pub mod camera;
pub mod emission;
pub(crate) mod emitter_points;
pub mod environment;
mod extent;
mod favour;
pub mod hierarchy;
pub mod luminaire;
pub(crate) mod outline;
mod patch;
pub mod solid_angle;
pub mod surface;
pub mod texture;
mod unit;

use crate::bsdf::Bsdf;
use crate::hints::Hints;
use balls::Balls;
use hemilux_accel as accel;
use hemilux_scene::geom::{DAffine3, Vec3};
use hemilux_scene::{ConductorFresnel, Geometry, MaterialId, MaterialKind, Roughness, Scene, Shape};
use luminaire::Luminaires;
use patch::Patches;
pub use surface::Surface;
use texture::TexturePoint;

/// Shapes that are traced together: the world's own, or those of one object.
pub(crate) struct Group {
    pub shapes: Vec<Shape>,
    /// First primitive of each shape, and one past the last.
    pub first_prim: Vec<u32>,
    /// Shape of each primitive.
    pub prim_shape: Vec<u32>,
}

impl Group {
    fn new(scene: &Scene, shapes: &[Shape]) -> (Group, accel::Group) {
        let mut builder = accel::GroupBuilder::new();
        let mut group = Group { shapes: shapes.to_vec(), first_prim: vec![0], prim_shape: Vec::new() };
        for (i, shape) in shapes.iter().enumerate() {
            let end = match shape.geometry {
                Geometry::Mesh(id) => {
                    let mesh = &scene.meshes[id.0 as usize];
                    builder.add_mesh(&mesh.positions, &mesh.indices).end
                }
                Geometry::Quadric(q, to_group) => builder.add_quadric(convert(q), to_group) + 1,
            };
            group.prim_shape.resize(end as usize, i as u32);
            group.first_prim.push(end);
        }
        (group, builder.build())
    }

    /// Number of primitives.
    pub fn prims(&self) -> u32 {
        self.prim_shape.len() as u32
    }
}

/// The scene's quadric as the ray tracer's.
pub(crate) fn convert(q: hemilux_scene::Quadric) -> accel::Quadric {
    use hemilux_scene::Quadric as Q;
    match q {
        Q::Sphere { radius, z_min, z_max, phi_max } => {
            accel::Quadric::Sphere { radius, z_min, z_max, phi_max }
        }
        Q::Disk { height, radius, inner_radius, phi_max } => {
            accel::Quadric::Disk { height, radius, inner_radius, phi_max }
        }
        Q::Cylinder { radius, z_min, z_max, phi_max } => {
            accel::Quadric::Cylinder { radius, z_min, z_max, phi_max }
        }
    }
}

/// The straight way that ended on a surface.
#[derive(Clone, Copy)]
struct Segment {
    /// m.
    length: f32,
    /// Whether it came from the side of the geometric normal.
    outside: bool,
}

/// A placed object.
pub(crate) struct Placement {
    /// Index into `World::groups`.
    pub group: u32,
    pub to_world: DAffine3,
    /// Normals go to world by this (inverse transpose).
    pub normal_to_world: glam::DMat3,
}

impl Placement {
    /// An outline of the group's in the world.
    fn moved(&self, own: &outline::Outline) -> outline::Outline {
        own.moved(
            |p| self.to_world.transform_point3(p.as_dvec3()).as_vec3(),
            |v| self.to_world.transform_vector3(v.as_dvec3()).as_vec3(),
        )
    }
}

/// The prepared scene.
pub struct World {
    /// The description it was made from.
    pub scene: Scene,
    pub(crate) accel: accel::Accel,
    /// Group 0 is the world's own; object i is group i + 1.
    pub(crate) groups: Vec<Group>,
    pub(crate) placements: Vec<Placement>,
    /// Everything that emits.
    pub luminaires: Luminaires,
    /// Luminaires and casters as balls.
    pub balls: Balls,
    /// What the user knows of it.
    pub hints: Hints,
    /// Whether some surface lets rays pass at random or always.
    has_holes: bool,
    /// Per group.
    patches: Vec<Patches>,
    /// Reflectance of each shape of group 0 that is plain: see [`World::plain`].
    plain: Vec<Option<hemilux_scene::Rgb>>,
    /// Centre and radius of a ball around all geometry (m).
    bound: (Vec3, f32),
}

/// Least cosine between the geometric and the shading normal of what is flat.
const PARALLEL: f32 = 0.99999;

impl World {
    /// Build the ray-tracing structure and the list of luminaires.
    pub fn new(scene: Scene) -> World {
        let mut groups = Vec::with_capacity(scene.objects.len() + 1);
        let (world_group, traced) = Group::new(&scene, &scene.shapes);
        let mut builder = accel::SceneBuilder::new(traced);
        groups.push(world_group);
        for object in &scene.objects {
            let (group, traced) = Group::new(&scene, &object.shapes);
            builder.add_group(traced);
            groups.push(group);
        }
        let mut placements = Vec::with_capacity(scene.instances.len());
        for instance in &scene.instances {
            builder.add_instance(instance.object, instance.to_world);
            let linear = instance.to_world.matrix3;
            placements.push(Placement {
                group: instance.object + 1,
                to_world: instance.to_world,
                normal_to_world: linear.inverse().transpose(),
            });
        }
        let accel = builder.build();
        let has_holes = groups.iter().flat_map(|g| &g.shapes).any(|s| {
            s.alpha.is_some()
                || matches!(scene.materials[s.material.0 as usize].kind, MaterialKind::Interface)
        });
        let box_ = accel.bounds();
        let bound = match box_.is_empty() {
            false => ((box_.min + box_.max) * 0.5, (box_.max - box_.min).length() * 0.5),
            true => (Vec3::ZERO, 1.0),
        };
        let mut world = World {
            scene,
            accel,
            groups,
            placements,
            luminaires: Luminaires::default(),
            balls: Balls::default(),
            hints: Hints::default(),
            has_holes,
            patches: Vec::new(),
            plain: Vec::new(),
            bound,
        };
        world.luminaires = Luminaires::new(&world);
        world.balls = Balls::new(&world);
        let casts = |s: &Shape| !world.is_diffuse(s.material);
        world.patches = world.groups.iter().map(|g| Patches::new(&world.scene, g, casts)).collect();
        world.plain = world.groups[0].shapes.iter().map(|s| world.plain_reflectance(s)).collect();
        world
    }

    /// Take the user's hints, in place of earlier ones.
    pub fn hint(&mut self, given: &hemilux_scene::hints::Hints) {
        let favours: Vec<_> =
            given.luminaires.iter().map(|l| (&*l.shapes, &*l.environments, l.shadow_rays)).collect();
        let favoured = self.luminaires.favours(self, &favours);
        self.luminaires.favour(favoured);
        self.hints = Hints::new(self, given);
    }

    /// Whether some surface reflects or refracts other than diffusely, so that virtual luminaires can exist.
    pub fn has_casters(&self) -> bool {
        self.groups.iter().flat_map(|g| &g.shapes).any(|s| !self.is_diffuse(s.material))
    }

    /// Whether some surface scatters diffusely, so that virtual luminaires can be met after a further scattering.
    pub fn has_diffuse(&self) -> bool {
        self.groups.iter().flat_map(|g| &g.shapes).any(|s| {
            match &self.scene.materials[s.material.0 as usize].kind {
                MaterialKind::Diffuse { reflectance: hemilux_scene::RgbParam::Constant(r) } => r.max() > 0.0,
                MaterialKind::Polished { diffuse, diffuse_transmission, .. } => {
                    diffuse.max().max(diffuse_transmission.max()) > 0.0
                }
                MaterialKind::Conductor { .. }
                | MaterialKind::Dielectric { .. }
                | MaterialKind::ThinDielectric { .. }
                | MaterialKind::CoatedConductor { .. }
                | MaterialKind::TintedPane { .. }
                | MaterialKind::TintedDielectric { .. }
                | MaterialKind::Interface => false,
                _ => true,
            }
        })
    }

    fn is_diffuse(&self, id: MaterialId) -> bool {
        matches!(
            self.scene.materials[id.0 as usize].kind,
            MaterialKind::Diffuse { .. } | MaterialKind::DiffuseTransmission { .. } | MaterialKind::Interface
        )
    }

    /// Centre and radius (m) of a ball around all geometry.
    pub fn bound(&self) -> (Vec3, f32) {
        self.bound
    }

    /// Number of primitives, instances counted as often as they are placed.
    pub fn primitives(&self) -> u64 {
        let placed: u64 = self.placements.iter().map(|p| self.groups[p.group as usize].prims() as u64).sum();
        self.groups[0].prims() as u64 + placed
    }

    /// Bytes of the ray-tracing structure.
    pub fn accel_bytes(&self) -> usize {
        self.accel.memory_bytes()
    }

    /// Whether anything has holes.
    pub(crate) fn has_holes(&self) -> bool {
        self.has_holes
    }

    /// The nearest surface along the ray that is not a hole, within `t_max`. `dir` is unit.
    #[inline]
    pub fn closest(&self, origin: Vec3, dir: Vec3, t_max: f32) -> Option<Surface> {
        let hit = self.closest_hit(origin, dir, t_max)?;
        self.surface_behind(hit, origin, dir, t_max)
    }

    /// The nearest hit, holes included: [`World::surface_behind`] tells what it leads to.
    #[inline]
    pub(crate) fn closest_hit(&self, origin: Vec3, dir: Vec3, t_max: f32) -> Option<accel::Hit> {
        self.accel.closest(&accel::Ray { origin, dir, t_min: 0.0, t_max })
    }

    /// The surface at `hit`, or the next one along the ray if that is a hole.
    #[inline]
    pub(crate) fn surface_behind(
        &self,
        mut hit: accel::Hit,
        origin: Vec3,
        dir: Vec3,
        t_max: f32,
    ) -> Option<Surface> {
        let mut ray = accel::Ray { origin, dir, t_min: 0.0, t_max };
        let mut travelled = 0.0;
        loop {
            let mut surface = self.surface(&hit, dir);
            if !self.has_holes || !self.is_hole(&surface) {
                surface.t += travelled;
                return Some(surface);
            }
            travelled += hit.t;
            ray.origin = accel::offset_origin(surface.p, surface.p_error, surface.ng, dir);
            ray.t_max = t_max - travelled;
            hit = self.accel.closest(&ray)?;
        }
    }

    /// Whether anything opaque lies on the open segment from `origin` along unit `dir` up to `t_max`.
    #[inline]
    pub fn occluded(&self, origin: Vec3, dir: Vec3, t_max: f32) -> bool {
        if self.has_holes {
            return self.closest(origin, dir, t_max).is_some();
        }
        self.accel.occluded(&accel::Ray { origin, dir, t_min: 0.0, t_max })
    }

    /// Reflectance and whether the front is met, for a hit on a flat triangle that is diffuse, of one reflectance, opaque
    /// and dark: what such a surface sends back is known without working out the rest of the [`Surface`].
    #[inline]
    pub(crate) fn plain(&self, hit: &accel::Hit, dir: Vec3) -> Option<(hemilux_scene::Rgb, bool)> {
        if hit.instance != accel::NO_INSTANCE {
            return None;
        }
        let group = &self.groups[0];
        let index = group.prim_shape[hit.prim as usize] as usize;
        let reflectance = self.plain[index]?;
        let shape = &group.shapes[index];
        let Geometry::Mesh(id) = shape.geometry else { return None };
        let mesh = &self.scene.meshes[id.0 as usize];
        let [a, b, c] =
            mesh.indices[(hit.prim - group.first_prim[index]) as usize].map(|i| mesh.positions[i as usize]);
        let against = (b - a).cross(c - a).dot(dir) < 0.0;
        Some((reflectance, against ^ shape.reverse_orientation ^ shape.flips_handedness))
    }

    fn plain_reflectance(&self, shape: &Shape) -> Option<hemilux_scene::Rgb> {
        let Geometry::Mesh(id) = shape.geometry else { return None };
        let dark = shape.emission.is_none() && shape.alpha.is_none();
        let flat = self.scene.meshes[id.0 as usize].normals.is_empty();
        match &self.scene.materials[shape.material.0 as usize].kind {
            MaterialKind::Diffuse { reflectance: hemilux_scene::RgbParam::Constant(r) } if dark && flat => {
                Some(r.map(|v| v.clamp(0.0, 1.0)))
            }
            _ => None,
        }
    }

    fn is_hole(&self, s: &Surface) -> bool {
        let shape = self.shape(s.group, s.shape);
        if matches!(self.scene.materials[shape.material.0 as usize].kind, MaterialKind::Interface) {
            return true;
        }
        let Some(alpha) = shape.alpha else { return false };
        let alpha = texture::float(&self.scene, alpha, &s.texture_point());
        if alpha >= 1.0 {
            return false;
        }
        // Keyed by place, so that every ray and every thread decides alike there.
        let key = hemiquad::points::Key::new(0x0a1f_a0a1)
            .with(s.p.x.to_bits() as u64 | (s.p.y.to_bits() as u64) << 32)
            .with(s.p.z.to_bits() as u64);
        key.uniform(0) >= alpha
    }

    /// The smooth piece of surface that `s` lies on, for telling specular chains apart.
    pub(crate) fn patch(&self, s: &Surface) -> u64 {
        let within = s.hit.prim - self.groups[s.group as usize].first_prim[s.shape as usize];
        let patch = self.patches[s.group as usize].of(s.shape, within);
        hemiquad::points::Key::new((s.hit.instance as u64) << 32 | s.shape as u64).bits64(patch)
    }

    /// The outline of that piece in the world, if it is flat.
    pub(crate) fn outline(&self, s: &Surface) -> Option<outline::Outline> {
        let within = s.hit.prim - self.groups[s.group as usize].first_prim[s.shape as usize];
        let patches = &self.patches[s.group as usize];
        let own = patches.outline(s.shape, patches.of(s.shape, within))?;
        Some(match s.hit.instance {
            hemilux_accel::NO_INSTANCE => *own,
            i => self.placements[i as usize].moved(own),
        })
    }

    /// The same, if mirrors and glass there behave as if flat, too.
    pub(crate) fn flat_outline(&self, s: &Surface) -> Option<outline::Outline> {
        self.outline(s).filter(|_| s.ng.dot(s.frame.n).abs() > PARALLEL)
    }

    /// The outlines in the world of all flat pieces of shapes that reflect or refract other than diffusely.
    pub(crate) fn flat_casters(&self) -> Vec<outline::Outline> {
        let placed = self.placements.iter().flat_map(|at| {
            let own = self.patches[at.group as usize].outlines();
            own.map(|outline| at.moved(outline))
        });
        self.patches[0].outlines().copied().chain(placed).collect()
    }

    #[inline]
    pub(crate) fn shape(&self, group: u32, shape: u32) -> &Shape {
        &self.groups[group as usize].shapes[shape as usize]
    }

    /// How the surface scatters at this point, in its shading frame.
    #[inline]
    pub fn bsdf(&self, s: &Surface) -> Bsdf {
        let behind = Segment { length: s.t, outside: s.is_front(s.wo) };
        self.material_bsdf(self.shape(s.group, s.shape).material, &s.texture_point(), behind)
    }

    fn material_bsdf(&self, id: MaterialId, at: &TexturePoint, behind: Segment) -> Bsdf {
        let rgb = |p| texture::rgb(&self.scene, p, at).map(|v| v.max(0.0));
        // Reflectances above 1 would create energy.
        let albedo = |p| rgb(p).map(|v| v.min(1.0));
        let alpha = |r: &Roughness| self.alpha(r, at);
        match &self.scene.materials[id.0 as usize].kind {
            MaterialKind::Diffuse { reflectance } => Bsdf::diffuse(albedo(*reflectance)),
            MaterialKind::Conductor { fresnel, roughness } => match *fresnel {
                ConductorFresnel::EtaK(eta, k) => Bsdf::conductor(rgb(eta), rgb(k), alpha(roughness)),
                ConductorFresnel::Reflectance(r) => Bsdf::conductor_reflectance(albedo(r), alpha(roughness)),
            },
            MaterialKind::Dielectric { eta, roughness } => Bsdf::dielectric(*eta, alpha(roughness)),
            MaterialKind::ThinDielectric { eta } => Bsdf::thin_dielectric(*eta),
            MaterialKind::CoatedDiffuse { reflectance, eta, roughness } => {
                Bsdf::coated_diffuse(albedo(*reflectance), *eta, alpha(roughness))
            }
            MaterialKind::CoatedConductor { eta, coat_roughness, fresnel, base_roughness } => {
                let (n, k) = match *fresnel {
                    ConductorFresnel::EtaK(n, k) => (rgb(n), rgb(k)),
                    ConductorFresnel::Reflectance(r) => {
                        let r = albedo(r).map(|v| v.min(0.9999));
                        (hemilux_scene::Rgb::WHITE, r.map(|v| 2.0 * (v / (1.0 - v)).sqrt()))
                    }
                };
                Bsdf::coated_conductor(*eta, alpha(coat_roughness), n, k, alpha(base_roughness))
            }
            MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } => {
                let (r, t) = (rgb(*reflectance) * *scale, rgb(*transmittance) * *scale);
                let excess = (r + t).map(|v| v.max(1.0));
                let share = |x: hemilux_scene::Rgb| {
                    hemilux_scene::Rgb([x[0] / excess[0], x[1] / excess[1], x[2] / excess[2]])
                };
                Bsdf::diffuse_transmission(share(r), share(t))
            }
            MaterialKind::Mix { a, b, amount } => {
                let t = texture::float(&self.scene, *amount, at).clamp(0.0, 1.0);
                match t {
                    0.0 => self.material_bsdf(*a, at, behind),
                    1.0 => self.material_bsdf(*b, at, behind),
                    _ => {
                        let (a, b) = (self.material_bsdf(*a, at, behind), self.material_bsdf(*b, at, behind));
                        Bsdf::mix(&a, &b, t)
                    }
                }
            }
            MaterialKind::Polished {
                diffuse,
                specular,
                diffuse_transmission,
                specular_transmission,
                alpha,
                fresnel,
            } => Bsdf::polished(
                [*diffuse, *diffuse_transmission],
                [*specular, *specular_transmission],
                *alpha,
                *fresnel,
            ),
            MaterialKind::TintedPane { eta, transmissivity } => Bsdf::tinted_pane(*eta, *transmissivity),
            MaterialKind::TintedDielectric { eta, inside, outside } => {
                // Beer and Lambert: what is left of the segment that ended here.
                let medium = if behind.outside { outside } else { inside };
                Bsdf::tinted_dielectric(*eta, medium.map(|c| c.powf(behind.length)))
            }
            MaterialKind::Interface => Bsdf::none(),
        }
    }

    fn alpha(&self, r: &Roughness, at: &TexturePoint) -> [f32; 2] {
        [r.u, r.v].map(|p| {
            let v = texture::float(&self.scene, p, at).clamp(0.0, 1.0);
            if r.remap { v.sqrt() } else { v }
        })
    }
}
