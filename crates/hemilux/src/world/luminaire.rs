//! Luminaires: everything that emits, how to pick one, and how to sample its points, directions and particles.
//!
//! A luminaire is one emitting triangle, one emitting quadric or one environment. They are picked in proportion to
//! power (Shirley, Wang and Zimmerman 1996); whole spheres are sampled by the cone they subtend, everything else by
//! area. Densities name their measure and include the probability of the pick.

use super::emitter_points::{
    Frame64, cone, mean_stretch, object_area, quadric_area_point, shape_radius, sphere_area_point,
    stretch_world, triangle_point, whole_sphere,
};
use super::environment::Sky;
use super::{World, texture};
use hemilux_accel::{NO_INSTANCE, offset_origin};
use hemilux_scene::geom::{DAffine3, DVec3, Frame, Vec2, Vec3};
use hemilux_scene::{Emission, FloatParam, Geometry, Profile, Quadric, Rgb, Scene, Wrap};
use std::f32::consts::PI;

/// [`super::Surface::luminaire`] of a surface that does not emit.
pub const NO_LUMINAIRE: u32 = u32::MAX;

/// What emits.
#[derive(Clone, Debug)]
enum Emitter {
    /// Corner and edges, world; unit normal on the emitting side; texture coordinates of the corners.
    Triangle { a: Vec3, e1: Vec3, e2: Vec3, n: Vec3, uv: [Vec2; 3] },
    /// A quadric, placed. `sphere`: centre and radius if it is a whole sphere, not stretched.
    Quadric { q: Quadric, to_world: DAffine3, sphere: Option<(DVec3, f64)>, sign: f64, area_object: f64 },
    /// An environment.
    Sky(usize),
}

/// One luminaire.
#[derive(Clone, Debug)]
struct Luminaire {
    emitter: Emitter,
    /// Index into [`Luminaires::emissions`]; unused for skies.
    emission: u32,
    /// m².
    area: f32,
    /// Probability of the pick.
    pick: f32,
    /// Rays never meet it (opacity 0): only sampling finds it.
    unseen: bool,
}

/// All luminaires of a world.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    items: Vec<Luminaire>,
    emissions: Vec<Emission>,
    /// Radius (m) of a ball around each emitting shape.
    radii: Vec<f32>,
    skies: Vec<Sky>,
    sky_items: Vec<u32>,
    cumulative: Vec<f64>,
    /// First luminaire of each world shape.
    world_base: Vec<u32>,
    /// The same per instance; empty where the object does not emit.
    instance_base: Vec<Vec<u32>>,
    /// Total power, W, by luminance of its bands.
    power: f64,
    bound: (Vec3, f32),
}

/// A point on a luminaire as seen from somewhere.
#[derive(Clone, Copy, Debug)]
pub struct LuminaireSample {
    /// Unit direction towards it.
    pub wi: Vec3,
    /// Radiance that would arrive without occlusion.
    pub radiance: Rgb,
    /// Density per solid angle, pick included.
    pub pdf_solid_angle: f32,
    /// Whether rays can meet this luminaire too (else nothing shares its work).
    pub met_by_rays: bool,
    /// End of the shadow ray, `None` at infinity.
    target: Option<Vec3>,
}

/// A particle as it leaves a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct EmittedParticle {
    /// Where it starts (already off the surface).
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// Power it would carry if it were the only one (W): divide by the number of particles.
    pub flux: Rgb,
    /// Which luminaire.
    pub luminaire: u32,
}

impl Luminaires {
    /// List what emits in `world`.
    pub fn new(world: &World) -> Luminaires {
        let mut all = Luminaires { bound: world.bound(), ..Luminaires::default() };
        let mut powers = Vec::new();
        all.world_base = all.add_group(world, 0, &DAffine3::IDENTITY, &mut powers);
        for placement in &world.placements {
            let group = &world.groups[placement.group as usize];
            let emits = group.shapes.iter().any(|s| s.emission.is_some());
            let base = if emits {
                all.add_group(world, placement.group, &placement.to_world, &mut powers)
            } else {
                Vec::new()
            };
            all.instance_base.push(base);
        }
        for i in 0..world.scene.environments.len() {
            let sky = Sky::new(&world.scene, i);
            let disk = std::f64::consts::PI * (all.bound.1 as f64).powi(2);
            powers.push(sky.integral.luminance() as f64 * disk);
            all.sky_items.push(all.items.len() as u32);
            all.items.push(Luminaire {
                emitter: Emitter::Sky(i),
                emission: 0,
                area: 0.0,
                pick: 0.0,
                unseen: false,
            });
            all.skies.push(sky);
        }
        all.power = powers.iter().sum();
        let mut sum = 0.0;
        for (item, power) in all.items.iter_mut().zip(&powers) {
            item.pick = if all.power > 0.0 { (power / all.power) as f32 } else { 0.0 };
            sum += power;
            all.cumulative.push(if all.power > 0.0 { sum / all.power } else { 0.0 });
        }
        all
    }

    fn add_group(
        &mut self,
        world: &World,
        group: u32,
        to_world: &DAffine3,
        powers: &mut Vec<f64>,
    ) -> Vec<u32> {
        let mut base = Vec::new();
        for shape in &world.groups[group as usize].shapes {
            let Some(emission) = &shape.emission else {
                base.push(NO_LUMINAIRE);
                continue;
            };
            base.push(self.items.len() as u32);
            let id = self.emissions.len() as u32;
            self.emissions.push(emission.clone());
            let unseen = shape.alpha == Some(FloatParam::Constant(0.0));
            let per_area = power_per_area(&world.scene, emission);
            self.radii.push(shape_radius(world, &shape.geometry, to_world));
            let mut push = |emitter: Emitter, area: f64| {
                powers.push(per_area * area);
                self.items.push(Luminaire { emitter, emission: id, area: area as f32, pick: 0.0, unseen });
            };
            match shape.geometry {
                Geometry::Mesh(mesh) => {
                    let mesh = &world.scene.meshes[mesh.0 as usize];
                    for t in &mesh.indices {
                        let at = |i: u32| to_world.transform_point3(mesh.positions[i as usize].as_dvec3());
                        let (a, b, c) = (at(t[0]), at(t[1]), at(t[2]));
                        let cross = (b - a).cross(c - a);
                        let mut n = cross.normalize_or_zero().as_vec3();
                        let given: Vec3 = match mesh.normals.is_empty() {
                            true => Vec3::ZERO,
                            false => t.iter().map(|&i| mesh.normals[i as usize]).sum(),
                        };
                        let against = if given == Vec3::ZERO {
                            shape.flips_handedness ^ shape.reverse_orientation
                        } else {
                            let normal_to_world = to_world.matrix3.inverse().transpose();
                            let given = (normal_to_world * given.as_dvec3()).as_vec3();
                            (given.dot(n) < 0.0) ^ shape.reverse_orientation
                        };
                        if against {
                            n = -n;
                        }
                        let uv = match mesh.uvs.is_empty() {
                            true => [Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::ONE],
                            false => t.map(|i| mesh.uvs[i as usize]),
                        };
                        let emitter = Emitter::Triangle {
                            a: a.as_vec3(),
                            e1: (b - a).as_vec3(),
                            e2: (c - a).as_vec3(),
                            n,
                            uv,
                        };
                        push(emitter, 0.5 * cross.length());
                    }
                }
                Geometry::Quadric(q, to_group) => {
                    let placed = *to_world * to_group;
                    let mirrored = to_group.matrix3.determinant() < 0.0;
                    let flip = shape.reverse_orientation ^ shape.flips_handedness ^ mirrored;
                    let sign = if flip { -1.0 } else { 1.0 };
                    let sphere = whole_sphere(q, &placed);
                    let area_object = object_area(q);
                    let area = match sphere {
                        Some((_, r)) => 4.0 * std::f64::consts::PI * r * r,
                        None => area_object * mean_stretch(q, &placed),
                    };
                    push(Emitter::Quadric { q, to_world: placed, sphere, sign, area_object }, area);
                }
            }
        }
        base
    }

    /// Number of luminaires.
    pub fn len(&self) -> usize {
        self.items.len()
    }

    /// Whether nothing emits.
    pub fn is_empty(&self) -> bool {
        self.power <= 0.0
    }

    /// Estimated total power by luminance (W); exact unless textures or profiles shape the emission.
    pub fn power(&self) -> f64 {
        self.power
    }

    /// Name and size of what luminaire `i` is part of, for grouping specular chains: a number for the emitting shape
    /// (or sky), and the radius (m) of a ball around it with the distance (m) it counts as being away beyond the start
    /// of the chain. `None` where it fills too much of the sky for its images to be small.
    pub fn identity(&self, scene: &Scene, i: u32) -> Option<(u32, f32, f32)> {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(s) => match &scene.environments[s] {
                hemilux_scene::Environment::Sun { cos_half_angle, .. } => {
                    let far = 1e4 * self.bound.1;
                    let tan = (1.0 - cos_half_angle * cos_half_angle).max(0.0).sqrt() / cos_half_angle;
                    Some((u32::MAX - s as u32, far * tan as f32, far))
                }
                _ => None,
            },
            _ => Some((item.emission, self.radii[item.emission as usize], 0.0)),
        }
    }

    /// A bound on the radiance of any luminaire or sky in any direction, weighted over the bands by `weights`
    /// (non-negative).
    pub fn brightest(&self, scene: &Scene, weights: [f64; 3]) -> f64 {
        let weigh = |v: Rgb| (0..3).map(|c| weights[c] * v[c].max(0.0) as f64).sum::<f64>();
        let image_max = |id: hemilux_scene::ImageId| {
            let texels = &scene.images[id.0 as usize].texels;
            texels.iter().fold(Rgb::BLACK, |m, t| Rgb([0, 1, 2].map(|c: usize| m[c].max(t[c]))))
        };
        let emissions = self.emissions.iter().map(|e| {
            let image = e.image.map_or(Rgb::WHITE, image_max);
            let profile = match &e.profile {
                Profile::Uniform | Profile::Spot { .. } => Rgb::WHITE,
                Profile::Goniometric { image, .. } | Profile::Projection { image, .. } => image_max(*image),
            };
            weigh(e.radiance * image * profile)
        });
        let skies = scene.environments.iter().map(|e| match e {
            hemilux_scene::Environment::Constant { radiance } => weigh(*radiance),
            hemilux_scene::Environment::Sun { radiance, .. } => weigh(*radiance),
            hemilux_scene::Environment::Image { image, scale, .. } => weigh(image_max(*image) * *scale),
        });
        emissions.chain(skies).fold(0.0, f64::max)
    }

    /// Luminaire of a primitive, or [`NO_LUMINAIRE`].
    #[inline]
    pub fn index(&self, instance: u32, _group: u32, shape: u32, within: u32) -> u32 {
        let base = if instance == NO_INSTANCE {
            &self.world_base
        } else {
            match self.instance_base.get(instance as usize) {
                Some(base) => base,
                None => return NO_LUMINAIRE,
            }
        };
        match base.get(shape as usize) {
            Some(&first) if first != NO_LUMINAIRE => first + within,
            _ => NO_LUMINAIRE,
        }
    }

    /// Pick a luminaire by power; also the unused part of `u`.
    fn pick(&self, u: f32) -> (usize, f32) {
        let u = u as f64;
        let i = self.cumulative.partition_point(|&c| c <= u).min(self.items.len() - 1);
        let low = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let width = self.cumulative[i] - low;
        let rest = if width > 0.0 { ((u - low) / width) as f32 } else { 0.5 };
        (i, rest.clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// Radiance of every environment at `from` from `dir`, each with its index.
    pub(crate) fn sky_radiance<'a>(
        &'a self,
        scene: &'a Scene,
        from: Vec3,
        dir: Vec3,
    ) -> impl Iterator<Item = (Rgb, u32)> + 'a {
        self.skies.iter().zip(&self.sky_items).map(move |(s, &i)| (s.radiance(scene, from, dir), i))
    }

    /// Density per solid angle, pick included, with which [`Luminaires::sample`] from anywhere finds `dir` on sky `i`.
    pub(crate) fn sky_pdf(&self, scene: &Scene, i: u32, dir: Vec3) -> f32 {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(s) => item.pick * self.skies[s].pdf_solid_angle(scene, dir),
            _ => 0.0,
        }
    }

    /// Radiance that luminaire `i` emits at a surface point towards unit `w`.
    pub fn radiance(&self, scene: &Scene, i: u32, n: Vec3, uv: Vec2, w: Vec3) -> Rgb {
        let emission = &self.emissions[self.items[i as usize].emission as usize];
        emitted(scene, emission, n, uv, w)
    }

    /// Radiant intensity (W·sr⁻¹) of luminaire `i` towards unit `w`, nothing being in the way.
    pub(super) fn intensity(&self, scene: &Scene, i: u32, w: Vec3) -> Rgb {
        let item = &self.items[i as usize];
        let emission = |n: Vec3, uv: Vec2| emitted(scene, &self.emissions[item.emission as usize], n, uv, w);
        match &item.emitter {
            Emitter::Triangle { n, uv, .. } => {
                emission(*n, (uv[0] + uv[1] + uv[2]) / 3.0) * (n.dot(w).abs() * item.area)
            }
            Emitter::Quadric { q, to_world, sphere, sign, area_object } => {
                // Points spread evenly over the area; a sphere's disk is known exactly.
                let (mut sum, mut seen) = (Rgb::BLACK, 0.0);
                for k in 0..16 {
                    let u = [(k % 4) as f32 / 4.0 + 0.125, (k / 4) as f32 / 4.0 + 0.125];
                    let (_, n, uv, pdf) = quadric_area_point(*q, to_world, *area_object, u);
                    let n = (n * *sign).as_vec3();
                    let cos = n.dot(w).abs() / (16.0 * pdf);
                    let radiance = emission(n, uv);
                    sum += radiance * cos;
                    seen += if radiance.is_black() { 0.0 } else { cos };
                }
                match sphere {
                    Some((_, r)) if seen > 0.0 => sum * (PI * (r * r) as f32 / seen),
                    _ => sum,
                }
            }
            Emitter::Sky(_) => Rgb::BLACK,
        }
    }

    /// Density per solid angle at `from`, pick included, with which [`Luminaires::sample`] finds this point of
    /// luminaire `i`: at distance `t`, with unit normal `n`, along unit `wi`.
    #[inline]
    pub fn pdf_solid_angle(&self, i: u32, from: Vec3, wi: Vec3, t: f32, n: Vec3) -> f32 {
        let item = &self.items[i as usize];
        let by_area = |area: f32| {
            let cos = n.dot(wi).abs();
            if cos > 0.0 { t * t / (area * cos) } else { 0.0 }
        };
        item.pick
            * match &item.emitter {
                Emitter::Triangle { .. } => by_area(item.area),
                Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                    match cone(from, *centre, *r, *sign) {
                        Some((_, _, height)) => (0.5 / std::f64::consts::PI / height) as f32,
                        None => by_area(item.area),
                    }
                }
                Emitter::Quadric { to_world, area_object, .. } => {
                    by_area((area_object * stretch_world(to_world, n.as_dvec3())) as f32)
                }
                Emitter::Sky(_) => 0.0,
            }
    }

    /// A luminaire point as seen from `from`. `u_pick` chooses the luminaire, `u` the point.
    /// `None` where the sample carries nothing.
    pub fn sample(&self, scene: &Scene, from: Vec3, u_pick: f32, u: [f32; 2]) -> Option<LuminaireSample> {
        if self.is_empty() {
            return None;
        }
        let (i, _) = self.pick(u_pick);
        let item = &self.items[i];
        let met_by_rays = !item.unseen;
        if let Emitter::Sky(s) = item.emitter {
            let (wi, pdf) = self.skies[s].sample(scene, u);
            let radiance = self.skies[s].radiance(scene, from, wi);
            let pdf = pdf * item.pick;
            return (pdf > 0.0 && !radiance.is_black()).then_some(LuminaireSample {
                wi,
                radiance,
                pdf_solid_angle: pdf,
                met_by_rays,
                target: None,
            });
        }
        let emission = &self.emissions[item.emission as usize];
        let (q, error, n, uv, direction, pdf) = self.point(item, from, u)?;
        let to = q - from;
        let distance2 = to.length_squared();
        let wi = direction.or_else(|| to.try_normalize())?;
        let radiance = emitted(scene, emission, n, uv, -wi);
        let cos = n.dot(wi).abs();
        let pdf = match pdf {
            Density::SolidAngle(p) => p,
            Density::Area(p) if cos > 0.0 => p * distance2 / cos,
            Density::Area(_) => return None,
        } * item.pick;
        if radiance.is_black() || pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        // The end of the shadow ray stays in front of the luminaire by a multiple of its rounding error.
        let target = offset_origin(q, error * 4.0, n, -wi);
        Some(LuminaireSample { wi, radiance, pdf_solid_angle: pdf, met_by_rays, target: Some(target) })
    }

    /// Point, its rounding error, normal on the emitting side, parameters, direction if known better than by
    /// difference, density.
    #[allow(clippy::type_complexity)] // one caller, taken apart at once
    fn point(
        &self,
        item: &Luminaire,
        from: Vec3,
        u: [f32; 2],
    ) -> Option<(Vec3, Vec3, Vec3, Vec2, Option<Vec3>, Density)> {
        match &item.emitter {
            Emitter::Triangle { a, e1, e2, n, uv } => {
                let (b1, b2) = triangle_point(u);
                let q = *a + *e1 * b1 + *e2 * b2;
                let st = uv[0] * (1.0 - b1 - b2) + uv[1] * b1 + uv[2] * b2;
                let error = (a.abs() + e1.abs() + e2.abs()) * (4.0 * f32::EPSILON);
                Some((q, error, *n, st, None, Density::Area(1.0 / item.area)))
            }
            Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                let Some((axis, distance, height)) = cone(from, *centre, *r, *sign) else {
                    let (q, n, uv) = sphere_area_point(*centre, *r, u);
                    let error = q.abs().as_vec3() * (2.0 * f32::EPSILON);
                    let n = (n * *sign).as_vec3();
                    return Some((q.as_vec3(), error, n, uv, None, Density::Area(1.0 / item.area)));
                };
                let x = u[0] as f64 * height;
                let sin2 = x * (2.0 - x);
                let (s, c) = (2.0 * std::f64::consts::PI * u[1] as f64).sin_cos();
                let frame = Frame64::new(axis);
                let sin = sin2.max(0.0).sqrt();
                let w = frame.s * (sin * c) + frame.t * (sin * s) + axis * (1.0 - x);
                let t = distance * (1.0 - x) - (r * r - distance * distance * sin2).max(0.0).sqrt();
                let q = from.as_dvec3() + w * t;
                let n = (q - *centre).normalize();
                let error = (q.abs() + from.as_dvec3().abs()).as_vec3() * (2.0 * f32::EPSILON);
                let pdf = (0.5 / std::f64::consts::PI / height) as f32;
                let n = (n * *sign).as_vec3();
                Some((q.as_vec3(), error, n, Vec2::ZERO, Some(w.as_vec3()), Density::SolidAngle(pdf)))
            }
            Emitter::Quadric { q, to_world, sign, area_object, .. } => {
                let (p, n, uv, pdf) = quadric_area_point(*q, to_world, *area_object, u);
                let error = p.abs().as_vec3() * (4.0 * f32::EPSILON);
                Some((p.as_vec3(), error, (n * *sign).as_vec3(), uv, None, Density::Area(pdf)))
            }
            Emitter::Sky(_) => None,
        }
    }

    /// A particle: `u_pick` chooses the luminaire, `u_point` where, `u_dir` whither.
    pub fn emit(
        &self,
        scene: &Scene,
        u_pick: f32,
        u_point: [f32; 2],
        u_dir: [f32; 2],
    ) -> Option<EmittedParticle> {
        if self.is_empty() {
            return None;
        }
        let (i, rest) = self.pick(u_pick);
        let item = &self.items[i];
        if let Emitter::Sky(s) = item.emitter {
            return self.emit_sky(scene, s, i, u_point, u_dir);
        }
        let emission = &self.emissions[item.emission as usize];
        if let (Emitter::Quadric { sphere: Some((centre, r)), .. }, true) =
            (&item.emitter, emission.profile != Profile::Uniform)
        {
            return emit_profile(scene, emission, item, i, *centre, *r, u_point, u_dir);
        }
        let far = Vec3::INFINITY;
        let (q, error, n, uv, pdf) = match &item.emitter {
            Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                let (q, n, uv) = sphere_area_point(*centre, *r, u_point);
                let error = (q.abs() * (2.0 * f32::EPSILON as f64)).as_vec3();
                (q.as_vec3(), error, (n * *sign).as_vec3(), uv, 1.0 / item.area)
            }
            _ => match self.point(item, far, u_point)? {
                (q, error, n, uv, _, Density::Area(pdf)) => (q, error, n, uv, pdf),
                _ => return None,
            },
        };
        // Two-sided emitters use what is left of the pick to choose the side.
        let (n, sides) = match emission.two_sided {
            true => (if rest < 0.5 { n } else { -n }, 2.0),
            false => (n, 1.0),
        };
        let local = cosine_direction(u_dir);
        let dir = Frame::from_normal(n).to_world(local).normalize();
        let radiance = emitted(scene, emission, n, uv, dir);
        let flux = radiance * (PI * sides / (pdf * item.pick));
        Some(EmittedParticle { origin: offset_origin(q, error, n, dir), dir, flux, luminaire: i as u32 })
    }

    fn emit_sky(
        &self,
        scene: &Scene,
        sky: usize,
        i: usize,
        u_point: [f32; 2],
        u_dir: [f32; 2],
    ) -> Option<EmittedParticle> {
        let (towards, pdf) = self.skies[sky].sample(scene, u_dir);
        let dir = -towards;
        let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u_point[0], u_point[1]));
        let frame = Frame::from_normal(dir);
        let (centre, radius) = self.bound;
        // A little wider than the ball, so that rounding does not cut its rim.
        let radius = radius * 1.0001;
        let origin = centre + (frame.s * x + frame.t * y) * radius - dir * (radius * 1.001);
        let radiance = {
            // Seen from behind the scene: a portal anywhere on the way counts.
            let end = centre + (frame.s * x + frame.t * y) * radius + dir * radius;
            self.skies[sky].radiance(scene, end, towards)
        };
        let flux = radiance * (PI * radius * radius / (pdf * self.items[i].pick));
        (pdf > 0.0).then_some(EmittedParticle { origin, dir, flux, luminaire: i as u32 })
    }
}

enum Density {
    SolidAngle(f32),
    Area(f32),
}

impl LuminaireSample {
    /// Whether something opaque stands between surface `s` and the sample.
    pub fn is_occluded(&self, world: &World, s: &super::Surface) -> bool {
        let origin = s.leave(self.wi);
        match self.target {
            None => world.occluded(origin, self.wi, f32::INFINITY),
            Some(target) => {
                let to = target - origin;
                let length = to.length();
                // A luminaire closer than rounding can resolve is not occluded.
                length > 0.0 && world.occluded(origin, to / length, length)
            }
        }
    }
}

fn emitted(scene: &Scene, e: &Emission, n: Vec3, uv: Vec2, w: Vec3) -> Rgb {
    if !e.two_sided && n.dot(w) <= 0.0 {
        return Rgb::BLACK;
    }
    let mut radiance = e.radiance;
    if let Some(image) = e.image {
        radiance *= texture::lookup(&scene.images[image.0 as usize], uv, Wrap::Clamp, false);
    }
    match &e.profile {
        Profile::Uniform => radiance,
        profile => radiance * profile_factor(scene, profile, w),
    }
}

fn profile_factor(scene: &Scene, profile: &Profile, w: Vec3) -> Rgb {
    match profile {
        Profile::Uniform => Rgb::WHITE,
        Profile::Spot { axis, cos_start, cos_end } => {
            let cos = axis.dot(w);
            let x = ((cos - cos_end) / (cos_start - cos_end).max(1e-9)).clamp(0.0, 1.0);
            Rgb::splat(x * x * (3.0 - 2.0 * x))
        }
        Profile::Goniometric { image, to_local } => {
            let d = to_local.transform_vector3(w.as_dvec3()).normalize_or_zero().as_vec3();
            let layout = hemilux_scene::EnvironmentLayout::EqualAreaOctahedral;
            let uv = super::environment::direction_to_uv(layout, d);
            texture::lookup(&scene.images[image.0 as usize], Vec2::new(uv.x, 1.0 - uv.y), Wrap::Clamp, false)
        }
        Profile::Projection { image, to_local, half_window } => {
            let d = to_local.transform_vector3(w.as_dvec3()).as_vec3();
            if d.z <= 0.0 {
                return Rgb::BLACK;
            }
            let st = Vec2::new(d.x / d.z / half_window.x, d.y / d.z / half_window.y);
            if st.x.abs() > 1.0 || st.y.abs() > 1.0 {
                return Rgb::BLACK;
            }
            let st = (st + Vec2::ONE) * 0.5;
            texture::lookup(&scene.images[image.0 as usize], st, Wrap::Clamp, false)
        }
    }
}

/// Emitted power per area by luminance (W·m⁻²).
fn power_per_area(scene: &Scene, e: &Emission) -> f64 {
    let mut radiance = e.radiance;
    if let Some(image) = e.image {
        let texels = &scene.images[image.0 as usize].texels;
        let sum = texels.iter().fold([0f64; 3], |s, t| [0, 1, 2].map(|c| s[c] + t[c] as f64));
        radiance *= Rgb(sum.map(|v| (v / texels.len().max(1) as f64) as f32));
    }
    let mean = match &e.profile {
        Profile::Uniform => 1.0,
        Profile::Spot { cos_start, cos_end, .. } => 0.5 * (1.0 - 0.5 * (cos_start + cos_end)) as f64,
        // Mean over directions by a fixed set.
        profile => {
            let layout = hemilux_scene::EnvironmentLayout::EqualAreaOctahedral;
            let n = 64;
            let cell = |i: usize| (i as f32 + 0.5) / n as f32;
            let at = |x, y| super::environment::uv_to_direction(layout, Vec2::new(cell(x), cell(y)));
            let sum: f64 =
                (0..n * n).map(|i| profile_factor(scene, profile, at(i % n, i / n)).luminance() as f64).sum();
            sum / (n * n) as f64
        }
    };
    let sides = if e.two_sided { 2.0 } else { 1.0 };
    radiance.luminance().max(0.0) as f64 * std::f64::consts::PI * sides * mean
}

/// A particle of a small sphere whose radiance depends on direction only: direction first, then a point of the disk
/// that the sphere shows to it.
fn emit_profile(
    scene: &Scene,
    emission: &Emission,
    item: &Luminaire,
    i: usize,
    centre: DVec3,
    r: f64,
    u_point: [f32; 2],
    u_dir: [f32; 2],
) -> Option<EmittedParticle> {
    let (dir, pdf) = match emission.profile {
        Profile::Spot { axis, cos_end, .. } => {
            let height = 1.0 - cos_end;
            let x = u_dir[0] * height;
            let sin = (x * (2.0 - x)).max(0.0).sqrt();
            let (s, c) = (2.0 * PI * u_dir[1]).sin_cos();
            let local = Vec3::new(sin * c, sin * s, 1.0 - x);
            (Frame::from_normal(axis).to_world(local).normalize(), 0.5 / PI / height)
        }
        _ => {
            let z = 1.0 - 2.0 * u_dir[0];
            let rho = (1.0 - z * z).max(0.0).sqrt();
            let (s, c) = (2.0 * PI * u_dir[1]).sin_cos();
            (Vec3::new(rho * c, rho * s, z), 0.25 / PI)
        }
    };
    let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u_point[0], u_point[1]));
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let n = Frame::from_normal(dir).to_world(Vec3::new(x, y, z));
    let q = centre + n.as_dvec3() * r;
    let radiance = emission.radiance * profile_factor(scene, &emission.profile, dir);
    let flux = radiance * (PI * (r * r) as f32 / (pdf * item.pick));
    let error = (q.abs() * (2.0 * f32::EPSILON as f64)).as_vec3();
    Some(EmittedParticle {
        origin: offset_origin(q.as_vec3(), error, n, dir),
        dir,
        flux,
        luminaire: i as u32,
    })
}

fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u[0], u[1]));
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}
