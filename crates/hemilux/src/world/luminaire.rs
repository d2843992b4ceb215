//! Luminaires: everything that emits, how to pick one from a given place, and how to sample its points.
//!
//! A luminaire is one emitting triangle, one emitting quadric or one environment. Picks go over *units*: a triangle, a
//! quadric, or the rectangle that two triangles of a mesh make. Units lie in a tree ([`super::hierarchy`]); the tree and
//! every environment share the picks by the irradiance they may bring to the receiver, half of it evenly so that what is
//! occluded does not starve the rest. Whole spheres are sampled by the cone they subtend, nearby triangles and rectangles
//! by their solid angle ([`super::solid_angle`]), everything else by area. Densities name their measure and include the
//! probability of the pick at the receiver.

use super::World;
use super::emission::{emitted, power_per_area};
use super::emitter_points::{
    cone, mean_stretch, object_area, quadric_area_point, stretch_world, triangle_point, whole_sphere,
};
use super::environment::Sky;
use super::extent::ShapeExtent;
use super::favour::{Favoured, Pick};
use super::hierarchy::Hierarchy;
pub use super::hierarchy::Receiver;
use super::unit::{Density, LuminairePoint, Unit};
use crate::wrong::{Wrong, makes};
use hemilux_accel::{NO_INSTANCE, offset_origin};
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::{Emission, FloatParam, Geometry, Profile, Quadric, Rgb, Scene};

/// [`super::Surface::luminaire`] of a surface that does not emit.
pub const NO_LUMINAIRE: u32 = u32::MAX;

/// Share of the picks that the tree and the environments split evenly.
const EVEN: f32 = 0.5;

/// What emits.
#[derive(Clone, Debug)]
pub(super) enum Emitter {
    /// Corner and edges, world; unit normal on the emitting side; texture coordinates of the corners.
    Triangle { a: Vec3, e1: Vec3, e2: Vec3, n: Vec3, uv: [Vec2; 3] },
    /// A quadric, placed. `sphere`: centre and radius if it is a whole sphere, not stretched.
    Quadric { q: Quadric, to_world: DAffine3, sphere: Option<(DVec3, f64)>, sign: f64, area_object: f64 },
    /// An environment.
    Sky(usize),
}

/// One luminaire.
#[derive(Clone, Debug)]
pub(super) struct Luminaire {
    pub(super) emitter: Emitter,
    /// Index into [`Luminaires::emissions`]; unused for skies.
    pub(super) emission: u32,
    /// m².
    pub(super) area: f32,
    /// Share of the power: the probability of the pick for emission.
    pub(super) pick: f32,
    /// Rays never meet it (opacity 0): only sampling finds it.
    unseen: bool,
}

/// All luminaires of a world.
#[derive(Clone, Debug, Default)]
pub struct Luminaires {
    pub(super) items: Vec<Luminaire>,
    pub(super) emissions: Vec<Emission>,
    /// Of each emitting shape.
    pub(super) extents: Vec<ShapeExtent>,
    pub(super) skies: Vec<Sky>,
    pub(super) sky_items: Vec<u32>,
    pub(super) units: Vec<Unit>,
    /// Unit of each luminaire that is not an environment.
    pub(super) unit_of: Vec<u32>,
    tree: Hierarchy,
    pub(super) cumulative: Vec<f64>,
    /// Shares of the picks that hints give.
    pub(super) favoured: Favoured,
    /// First luminaire of each world shape.
    pub(super) world_base: Vec<u32>,
    /// The same per instance; empty where the object does not emit.
    pub(super) instance_base: Vec<Vec<u32>>,
    /// Total power, W, by luminance of its bands.
    power: f64,
    pub(super) bound: (Vec3, f32),
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

/// Cosine at the luminaire, between areas and solid angles.
#[inline]
fn cosine(n: Vec3, wi: Vec3) -> f32 {
    if makes(Wrong::Cosine) { 1.0 } else { n.dot(wi).abs() }
}

/// Weighted sum of the bands, the negative ones aside.
fn weigh(v: Rgb, weights: [f64; 3]) -> f64 {
    (0..3).map(|c| weights[c] * v[c].max(0.0) as f64).sum()
}

/// Largest value of each band of an image.
fn image_max(scene: &Scene, id: hemilux_scene::ImageId) -> Rgb {
    let texels = &scene.images[id.0 as usize].texels;
    texels.iter().fold(Rgb::BLACK, |m, t| Rgb([0, 1, 2].map(|c: usize| m[c].max(t[c]))))
}

/// A bound on the radiance of an emission.
fn brightest_of(scene: &Scene, e: &Emission) -> Rgb {
    let image = e.image.map_or(Rgb::WHITE, |i| image_max(scene, i));
    let profile = match &e.profile {
        Profile::Uniform | Profile::Spot { .. } => Rgb::WHITE,
        Profile::Goniometric { image, .. } | Profile::Projection { image, .. } => image_max(scene, *image),
    };
    e.radiance * image * profile
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
        all.plant(&world.scene);
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
            let first = self.items.len();
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
            let area: f32 = self.items[first..].iter().map(|i| i.area).sum();
            self.extents.push(ShapeExtent::of(world, &shape.geometry, to_world, area));
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

    /// Mean radiance of luminaire `i` (luminance, W·sr⁻¹·m⁻²), as if it emitted evenly.
    pub fn mean_radiance(&self, scene: &Scene, i: u32) -> f32 {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(s) => match &scene.environments[s] {
                hemilux_scene::Environment::Sun { radiance, .. } => radiance.luminance(),
                _ => 0.0,
            },
            _ => (item.pick as f64 * self.power / (std::f64::consts::PI * item.area as f64)) as f32,
        }
    }

    /// A bound on the radiance of any luminaire or sky in any direction, weighted over the bands by `weights`
    /// (non-negative).
    pub fn brightest(&self, scene: &Scene, weights: [f64; 3]) -> f64 {
        let emissions = self.emissions.iter().map(|e| weigh(brightest_of(scene, e), weights));
        let suns = scene.environments.iter().map(|e| match e {
            hemilux_scene::Environment::Sun { radiance, .. } => weigh(*radiance, weights),
            _ => 0.0,
        });
        emissions.chain(suns).fold(self.brightest_wide_sky(scene, weights), f64::max)
    }

    /// The same of skies other than suns.
    pub fn brightest_wide_sky(&self, scene: &Scene, weights: [f64; 3]) -> f64 {
        let skies = scene.environments.iter().map(|e| match e {
            hemilux_scene::Environment::Constant { radiance } => weigh(*radiance, weights),
            hemilux_scene::Environment::Image { image, scale, .. } => {
                weigh(image_max(scene, *image) * *scale, weights)
            }
            hemilux_scene::Environment::Sun { .. } => 0.0,
        });
        skies.fold(0.0, f64::max)
    }

    /// A bound on the luminance (W·sr⁻¹·m⁻²) of luminaire `i`; 0 for skies other than suns.
    pub fn peak_radiance(&self, scene: &Scene, i: u32) -> f64 {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(_) => self.mean_radiance(scene, i) as f64,
            _ => brightest_of(scene, &self.emissions[item.emission as usize]).luminance() as f64,
        }
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

    /// Pick a luminaire by power, for emission; also the unused part of `u`.
    pub(super) fn pick_by_power(&self, u: f32) -> (usize, f32) {
        let u = u as f64;
        let i = self.cumulative.partition_point(|&c| c <= u).min(self.items.len() - 1);
        let low = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let width = self.cumulative[i] - low;
        let rest = if width > 0.0 { ((u - low) / width) as f32 } else { 0.5 };
        (i, rest.clamp(0.0, 1.0 - f32::EPSILON))
    }

    /// Radiance of every environment at `from` from `dir`, each with its index.
    pub fn sky_radiance<'a>(
        &'a self,
        scene: &'a Scene,
        from: Vec3,
        dir: Vec3,
    ) -> impl Iterator<Item = (Rgb, u32)> + 'a {
        self.skies.iter().zip(&self.sky_items).map(move |(s, &i)| (s.radiance(scene, from, dir), i))
    }

    /// Density per solid angle, pick included, with which [`Luminaires::sample`] for `at` finds `dir` on sky `i`.
    pub fn sky_pdf(&self, scene: &Scene, i: u32, at: &Receiver, dir: Vec3) -> f32 {
        match self.items[i as usize].emitter {
            Emitter::Sky(s) => self.sky_probability(s, at) * self.skies[s].pdf_for(scene, at, dir),
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
                    Some((_, r)) if seen > 0.0 => sum * (std::f32::consts::PI * (r * r) as f32 / seen),
                    _ => sum,
                }
            }
            Emitter::Sky(_) => Rgb::BLACK,
        }
    }

    /// Density per solid angle at `at`, pick included, with which [`Luminaires::sample`] finds this point of luminaire
    /// `i`: at distance `t`, with unit normal `n`, along unit `wi`.
    #[inline]
    pub fn pdf_solid_angle(&self, i: u32, at: &Receiver, wi: Vec3, t: f32, n: Vec3) -> f32 {
        let item = &self.items[i as usize];
        if matches!(item.emitter, Emitter::Sky(_)) {
            return 0.0;
        }
        let number = self.unit_of[i as usize];
        let pick = self.unit_probability(number, at);
        if pick == 0.0 {
            return 0.0;
        }
        let by_area = |area: f32| {
            let cos = cosine(n, wi);
            if cos > 0.0 { t * t / (area * cos) } else { 0.0 }
        };
        let unit = &self.units[number as usize];
        pick * match &item.emitter {
            Emitter::Triangle { a, e1, e2, .. } => match unit.near(at.p) {
                Some(from) => match unit.solid_angle(from, *a, *e1, *e2) {
                    Some(omega) => (1.0 / omega) as f32,
                    None => by_area(unit.area(item)),
                },
                None => by_area(unit.area(item)),
            },
            Emitter::Quadric { sphere: Some((centre, r)), sign, .. } => {
                match cone(at.p, *centre, *r, *sign) {
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

    /// Probability with which [`Luminaires::sample`] for `at` picks luminaire `i` (together with the other triangle of its
    /// rectangle).
    pub fn pick_probability(&self, i: u32, at: &Receiver) -> f32 {
        match self.items[i as usize].emitter {
            Emitter::Sky(s) => self.sky_probability(s, at),
            _ => self.unit_probability(self.unit_of[i as usize], at),
        }
    }

    /// Probability of the pick of a unit.
    #[inline]
    fn unit_probability(&self, number: u32, at: &Receiver) -> f32 {
        let plain = self.tree_share(at) * self.tree.probability(at, number);
        self.favoured.with(plain, Pick::Unit(number))
    }

    /// Probability of the pick of a sky.
    fn sky_probability(&self, sky: usize, at: &Receiver) -> f32 {
        self.favoured.with(self.sky_share(sky, at), Pick::Sky(sky as u32))
    }

    /// A pick for `u`, and its probability; `None` where `u` falls on what cannot be seen.
    fn pick(&self, at: &Receiver, u: f32) -> Option<(Pick, f32)> {
        let share = self.favoured.share;
        let pick = match self.favoured.pick(u) {
            Some(pick) => pick,
            None => {
                let u = if share > 0.0 {
                    ((u - share) / (1.0 - share)).clamp(0.0, 1.0 - f32::EPSILON / 2.0)
                } else {
                    u
                };
                let (sky, part, rest) = self.pick_group(at, u)?;
                let (pick, probability) = match sky {
                    Some(s) => (Pick::Sky(s as u32), part),
                    None => {
                        let (number, probability) = self.tree.pick(at, rest)?;
                        (Pick::Unit(number), part * probability)
                    }
                };
                return Some((pick, self.favoured.with(probability, pick)));
            }
        };
        let probability = match pick {
            Pick::Sky(s) => self.sky_probability(s as usize, at),
            Pick::Unit(number) => self.unit_probability(number, at),
        };
        Some((pick, probability))
    }

    /// Share of the picks that go to the tree.
    #[inline]
    fn tree_share(&self, at: &Receiver) -> f32 {
        if self.skies.is_empty() { 1.0 } else { self.shares(at).share(self.tree.importance(at)) }
    }

    fn sky_share(&self, sky: usize, at: &Receiver) -> f32 {
        self.shares(at).share(self.skies[sky].irradiance(at))
    }

    /// What the tree and the environments may bring, together.
    fn shares(&self, at: &Receiver) -> Shares {
        let skies = self.skies.iter().map(|s| s.irradiance(at));
        skies.fold(Shares::default().with(self.tree.importance(at)), Shares::with)
    }

    /// A sky or (`None`) the tree for `u`; its probability, and the unused part of `u`.
    fn pick_group(&self, at: &Receiver, u: f32) -> Option<(Option<usize>, f32, f32)> {
        if self.skies.is_empty() {
            return Some((None, 1.0, u));
        }
        let all = self.shares(at);
        let mut low = 0.0;
        for k in 0..=self.skies.len() {
            // Skies first, the tree last.
            let estimate = self.skies.get(k).map_or_else(|| self.tree.importance(at), |s| s.irradiance(at));
            let share = all.share(estimate);
            if share > 0.0 && u < low + share {
                let rest = ((u - low) / share).clamp(0.0, 1.0 - f32::EPSILON / 2.0);
                return Some(((k < self.skies.len()).then_some(k), share, rest));
            }
            low += share;
        }
        None
    }

    /// A luminaire point as seen from `at`. `u_pick` chooses the luminaire, `u` the point.
    /// `None` where the sample carries nothing.
    pub fn sample(&self, scene: &Scene, at: &Receiver, u_pick: f32, u: [f32; 2]) -> Option<LuminaireSample> {
        if self.is_empty() {
            return None;
        }
        let (pick, probability) = self.pick(at, u_pick)?;
        let number = match pick {
            Pick::Sky(s) => return self.sky_sample(scene, at, s as usize, probability, u),
            Pick::Unit(number) => number,
        };
        let unit = &self.units[number as usize];
        let item = &self.items[unit.item as usize];
        let emission = &self.emissions[item.emission as usize];
        let point = self.point(unit, at.p, u, emission.image.is_some())?;
        let to = point.q - at.p;
        let distance2 = to.length_squared();
        let wi = point.direction.or_else(|| to.try_normalize())?;
        let radiance = emitted(scene, emission, point.n, point.uv, -wi);
        let cos = point.n.dot(wi).abs();
        let pdf = match point.density {
            Density::SolidAngle(p) => p,
            Density::Area(p) if cos > 0.0 => p * distance2 / cos,
            Density::Area(_) => return None,
        } * probability;
        if radiance.is_black() || pdf <= 0.0 || !pdf.is_finite() {
            return None;
        }
        // The end of the shadow ray stays in front of the luminaire by a multiple of its rounding error and of the ray's own,
        // which grows with its length: a luminaire in a coordinate plane has none itself.
        let error = point.error * 4.0 + Vec3::splat(4.0 * f32::EPSILON * (point.q - at.p).length());
        let target = offset_origin(point.q, error, point.n, -wi);
        Some(LuminaireSample {
            wi,
            radiance,
            pdf_solid_angle: pdf,
            met_by_rays: !item.unseen,
            target: Some(target),
        })
    }

    /// A direction towards a sky that was picked with `probability`.
    fn sky_sample(
        &self,
        scene: &Scene,
        at: &Receiver,
        sky: usize,
        probability: f32,
        u: [f32; 2],
    ) -> Option<LuminaireSample> {
        let (wi, pdf) = self.skies[sky].sample_for(scene, at, u);
        let radiance = self.skies[sky].radiance(scene, at.p, wi);
        let pdf = pdf * probability;
        (pdf > 0.0 && !radiance.is_black()).then_some(LuminaireSample {
            wi,
            radiance,
            pdf_solid_angle: pdf,
            met_by_rays: true,
            target: None,
        })
    }

    /// A point of a unit as seen from `from`; its parameters only if they are `wanted`.
    fn point(&self, unit: &Unit, from: Vec3, u: [f32; 2], wanted: bool) -> Option<LuminairePoint> {
        let item = &self.items[unit.item as usize];
        match &item.emitter {
            Emitter::Triangle { a, e1, e2, n, .. } => {
                let near = unit.near(from).and_then(|from| unit.near_point(from, *a, *e1, *e2, u));
                let (q, direction, density) = near.unwrap_or_else(|| {
                    let q = match &unit.rectangle {
                        Some(r) => r.point(u.map(|x| x as f64)).as_vec3(),
                        None => {
                            let (b1, b2) = triangle_point(u);
                            *a + *e1 * b1 + *e2 * b2
                        }
                    };
                    (q, None, Density::Area(1.0 / unit.area(item)))
                });
                let error = (a.abs() + e1.abs() + e2.abs() + from.abs()) * (4.0 * f32::EPSILON);
                let uv = if wanted { self.parameters(unit, q) } else { Vec2::ZERO };
                Some(LuminairePoint { q, error, n: *n, uv, direction, density })
            }
            _ => item.quadric_point(from, u),
        }
    }

    /// Texture coordinates at `q` on a triangle or rectangle.
    fn parameters(&self, unit: &Unit, q: Vec3) -> Vec2 {
        let on = |i: usize| {
            let Emitter::Triangle { a, e1, e2, uv, .. } = &self.items[i].emitter else {
                return (f32::NEG_INFINITY, Vec2::ZERO);
            };
            let (d, c) = (q - *a, e1.cross(*e2));
            let scale = 1.0 / c.length_squared();
            let (b1, b2) = (d.cross(*e2).dot(c) * scale, e1.cross(d).dot(c) * scale);
            let b0 = 1.0 - b1 - b2;
            // How far inside, and the coordinates there.
            (b0.min(b1).min(b2), uv[0] * b0 + uv[1] * b1 + uv[2] * b2)
        };
        let first = on(unit.item as usize);
        if unit.rectangle.is_none() || first.0 >= 0.0 {
            return first.1;
        }
        let second = on(unit.item as usize + 1);
        if second.0 > first.0 { second.1 } else { first.1 }
    }

    /// Make units of the luminaires listed so far, and the tree over them.
    fn plant(&mut self, scene: &Scene) {
        let mut extents = Vec::new();
        let mut i = 0;
        while i < self.items.len() {
            let item = &self.items[i];
            let rectangle = self.items.get(i + 1).and_then(|next| item.rectangle_with(next));
            let members = 1 + rectangle.is_some() as usize;
            let mut extent = item.extent(scene, &self.emissions[item.emission as usize]);
            if members == 2 {
                let other = self.items[i + 1].extent(scene, &self.emissions[item.emission as usize]);
                (extent.low, extent.high) = (extent.low.min(other.low), extent.high.max(other.high));
                extent.intensity += other.intensity;
            }
            let number = self.units.len() as u32;
            self.unit_of.extend(std::iter::repeat_n(number, members));
            let centre = (extent.low + extent.high) * 0.5;
            let radius = (extent.high - extent.low).length() * 0.5;
            self.units.push(Unit { item: i as u32, rectangle, centre, radius });
            extents.push(extent);
            i += members;
        }
        self.tree = Hierarchy::new(&extents);
    }
}

/// Everything that picks are shared among, summed up.
#[derive(Clone, Copy, Default)]
struct Shares {
    sum: f32,
    count: u32,
}

impl Shares {
    fn with(self, estimate: f32) -> Shares {
        let counts = estimate > 0.0 && estimate.is_finite();
        Shares { sum: self.sum + if counts { estimate } else { 0.0 }, count: self.count + counts as u32 }
    }

    /// Share of what may bring `estimate` (W·m⁻²).
    fn share(&self, estimate: f32) -> f32 {
        if estimate > 0.0 && estimate.is_finite() {
            EVEN / self.count as f32 + (1.0 - EVEN) * estimate / self.sum
        } else {
            0.0
        }
    }
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
