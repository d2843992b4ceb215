//! The zonal solution: a cheap, world-space estimate of the irradiance on every surface, for the far end of gather
//! rays (report, equation 1).
//!
//! [`ZoneMap`] cuts the surfaces, [`particles::Deposits`] collects flux by ray tracing, and [`Zones`] is the finished
//! solution that gathers look up. A solution can be written to a file and read back ([`Zones::write`], [`Zones::read`]),
//! or drawn as a coloured mesh ([`mesh::write_ply`]).

pub mod aim;
mod apparent;
mod bright;
pub mod broad;
pub mod field;
pub mod file;
mod kd;
pub mod map;
pub mod mesh;
pub mod particles;
mod prospect;
pub mod records;
pub mod scouts;
pub mod sight;
mod wire;
pub mod witness;

use crate::bsdf::Bsdf;
use crate::world::{Surface, World};
use broad::Broad;
use field::Field;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::points::Key;
pub use map::{ZoneMap, ZonePlace};
use particles::{Bin, Deposits, Finds, Ledger};
use records::Records;
use std::f32::consts::FRAC_1_PI;
use std::sync::{Arc, OnceLock};
use witness::Witnesses;

/// How fine and how well a zonal solution is to be made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZoneOptions {
    /// Most zones.
    pub budget: u32,
    /// Particles to trace.
    pub particles: u64,
    /// Seed of the particles.
    pub seed: u64,
}

impl Default for ZoneOptions {
    fn default() -> Self {
        ZoneOptions { budget: 60_000, particles: 1 << 21, seed: 0 }
    }
}

/// A zonal solution in the making: more particles can be added after a look at what they say.
///
/// Invariant: solutions are a function of world, options and the number of particles traced, in however many goes.
pub struct Making<'a> {
    world: &'a World,
    map: ZoneMap,
    deposits: Deposits,
    seed: u64,
    planned: u64,
}

impl<'a> Making<'a> {
    /// Cut the world; no particles yet. They are aimed at what `sight` sees; `None`: at everything.
    pub fn new(world: &'a World, options: &ZoneOptions, sight: Option<sight::Sight>) -> Making<'a> {
        let map = ZoneMap::new(world, options.budget);
        let deposits = Deposits::new(map.len(), world.luminaires.power(), sight);
        Making { world, map, deposits, seed: options.seed, planned: options.particles }
    }

    /// Trace until there are `total` particles, or `stop` (given the particles so far) says so.
    pub fn trace(&mut self, total: u64, stop: impl FnMut(u64) -> bool) {
        self.deposits.trace(self.world, &self.map, [self.seed, self.planned], total, stop);
    }

    /// Particles so far.
    pub fn particles(&self) -> u64 {
        self.deposits.particles
    }

    /// What they say.
    pub fn solution(&self) -> Zones {
        Zones::of(self.world, self.map.clone(), &self.deposits, self.deposits.finds.clone())
    }

    /// The same, where no more will follow.
    pub fn finish(mut self) -> Zones {
        let finds = std::mem::take(&mut self.deposits.finds);
        Zones::of(self.world, self.map, &self.deposits, finds)
    }
}

/// Irradiance per zone side (W·m⁻²), with its standard error.
#[derive(Clone, Debug)]
pub struct Zones {
    map: ZoneMap,
    /// Whole irradiance, by zone × 2 + side.
    total: Vec<Rgb>,
    /// Its caustic part.
    caustic: Vec<Rgb>,
    /// The part that came from bright zones by mirrors and glass.
    glints: Vec<Rgb>,
    /// The zones of which a side is bright, in order.
    bright: Vec<u32>,
    /// Standard error of the luminance of `total`, at least that of one deposit.
    error: Vec<f32>,
    /// Where virtual luminaires are expected; nothing in a solution that was read from a file.
    records: Arc<Records>,
    /// What the field radiance is expected to be; nothing in a solution that was read from a file.
    field: Arc<Field>,
    /// What is hardly looked for, once it is asked.
    witnesses: OnceLock<Witnesses>,
    /// Irradiance over wider areas, once it is asked.
    broad: OnceLock<Broad>,
    /// Where the flux went, per particle (W).
    pub ledger: Ledger,
    /// Particles traced.
    pub particles: u64,
}

impl Zones {
    /// Cut the world and trace particles. The solution is a function of the world, the options and the number of
    /// particles traced, bit for bit: what ended them does not show.
    pub fn solve(world: &World, options: &ZoneOptions) -> Zones {
        Zones::solve_until(world, options, |_| false)
    }

    /// The same, but no further once `stop` (given the particles so far) says so.
    pub fn solve_until(world: &World, options: &ZoneOptions, stop: impl FnMut(u64) -> bool) -> Zones {
        Zones::solve_seen(world, options, Some(sight::Sight::of_camera(world)), stop)
    }

    /// The same, with particles aimed at what `sight` sees instead of what the camera does; `None`: at everything.
    pub fn solve_seen(
        world: &World,
        options: &ZoneOptions,
        sight: Option<sight::Sight>,
        stop: impl FnMut(u64) -> bool,
    ) -> Zones {
        let mut making = Making::new(world, options, sight);
        making.trace(options.particles, stop);
        making.finish()
    }

    fn of(world: &World, map: ZoneMap, deposits: &Deposits, mut finds: Finds) -> Zones {
        prospect::send(world, &map, deposits.bright(), deposits.particles, &mut finds);
        finds.records.append(&mut finds.zone_records);
        finds.weigh();
        let records = Arc::new(Records::new(finds.records, &finds.exact));
        let field = Arc::new(Field::new(finds.incidences));
        let n = deposits.particles.max(1) as f64;
        let sides = map.len() * 2;
        let [mut total, mut caustic, mut glints] = [(); 3].map(|_| Vec::with_capacity(sides));
        let mut error = Vec::with_capacity(sides);
        // At least that of one deposit: where none has come, nothing is known, which is no certainty of darkness.
        let one = Rgb(deposits.ledger.emitted.map(|v| (v / n) as f32)).luminance() as f64;
        for side in 0..sides {
            let area = map.areas()[side / 2] as f64;
            let per_area = if area > 0.0 { 1.0 / (n * area) } else { 0.0 };
            let bins = [Bin::Direct, Bin::Caustic, Bin::Indirect].map(|b| deposits.flux(side, b));
            let sum = [0, 1, 2].map(|c| bins.iter().map(|b| b[c]).sum::<f64>());
            total.push(Rgb(sum.map(|v| (v * per_area) as f32)));
            caustic.push(Rgb(bins[Bin::Caustic as usize].map(|v| (v * per_area) as f32)));
            let glint = deposits.glints(side).map(|v| if area > 0.0 { (v / area) as f32 } else { 0.0 });
            glints.push(Rgb(glint));
            error.push((deposits.squares(side).max(one * one).sqrt() * per_area) as f32);
        }
        let scale = |v: [f64; 3]| v.map(|x| x / n);
        let l = deposits.ledger;
        let ledger = Ledger {
            emitted: scale(l.emitted),
            absorbed: scale(l.absorbed),
            escaped: scale(l.escaped),
            incident: scale(l.incident),
            truncated: scale(l.truncated),
            rays: l.rays,
        };
        Zones {
            map,
            total,
            caustic,
            glints,
            bright: deposits.bright().zones(),
            error,
            records,
            field,
            witnesses: OnceLock::new(),
            broad: OnceLock::new(),
            ledger,
            particles: deposits.particles,
        }
    }

    /// The cut surfaces.
    pub fn map(&self) -> &ZoneMap {
        &self.map
    }

    /// Where virtual luminaires are expected.
    pub fn records(&self) -> &Records {
        &self.records
    }

    /// What the field radiance is expected to be.
    pub fn field(&self) -> &Field {
        &self.field
    }

    /// What fresh particles say of the light that is hardly looked for with this solution as a guide; they are traced when it is first asked.
    pub fn witnesses(&self, world: &World) -> &Witnesses {
        self.witnesses.get_or_init(|| Witnesses::call(world, self, witness::COUNT))
    }

    /// What zones receive together with those around them; made when it is first asked.
    pub fn broad(&self, world: &World) -> &Broad {
        self.broad.get_or_init(|| Broad::new(self, world))
    }

    /// A hash of everything that gathers look up: two solutions with the same one give the same pictures.
    pub fn fingerprint(&self) -> u64 {
        let key = Key::new(self.particles).with(self.map.len() as u64).with(self.records.len());
        let values = self.total.iter().chain(&self.caustic).chain(&self.glints).flat_map(|v| v.0);
        values.fold(key, |key, v| key.with(v.to_bits() as u64)).bits64(0)
    }

    /// Irradiance of a zone side (W·m⁻²).
    pub fn irradiance(&self, zone: u32, side: u32) -> Rgb {
        self.total[(zone * 2 + side) as usize]
    }

    /// Share of caustics in [`Zones::irradiance`], by luminance.
    pub fn caustic_share(&self, zone: u32, side: u32) -> f32 {
        let k = (zone * 2 + side) as usize;
        let all = self.total[k].luminance();
        if all > 0.0 { (self.caustic[k].luminance() / all).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Standard error of the luminance of [`Zones::irradiance`], from the spread of deposits; at least what one deposit is.
    pub fn standard_error(&self, zone: u32, side: u32) -> f32 {
        self.error[(zone * 2 + side) as usize]
    }

    /// Median and 95th percentile, over lit zone sides weighted by area, of the relative standard error.
    pub fn relative_errors(&self) -> (f32, f32) {
        let mut v: Vec<(f32, f32)> = Vec::new();
        for side in 0..self.total.len() {
            let e = self.total[side].luminance();
            if e > 0.0 {
                v.push((self.error[side] / e, self.map.areas()[side / 2]));
            }
        }
        v.sort_by(|a, b| a.0.total_cmp(&b.0));
        let all: f64 = v.iter().map(|x| x.1 as f64).sum();
        let at = |share: f64| {
            let mut sum = 0.0;
            v.iter().find(|x| {
                sum += x.1 as f64;
                sum >= share * all
            })
        };
        let pick = |share| at(share).map_or(0.0, |x| x.0);
        (pick(0.5), pick(0.95))
    }

    /// Whether any particle arrived through a specular chain.
    pub fn has_caustics(&self) -> bool {
        self.caustic.iter().any(|c| !c.is_black())
    }

    /// The zone at `s` (see [`ZoneMap::locate`]).
    #[inline]
    pub fn locate(&self, world: &World, s: &Surface, jitter: [f32; 2]) -> ZonePlace {
        self.map.locate(world, s, jitter)
    }

    /// Surface radiance towards `wo` (local) by the diffuse lobes under the zone's irradiance on both sides.
    #[inline]
    pub fn reflected(&self, place: &ZonePlace, bsdf: &Bsdf, wo: Vec3) -> Rgb {
        scattered(&self.total, place, bsdf, wo)
    }

    /// The part of [`Zones::reflected`] that came by mirrors and glass from luminaires and from bright zones ([`Zones::is_bright`]).
    #[inline]
    pub fn reflected_caustic(&self, place: &ZonePlace, bsdf: &Bsdf, wo: Vec3) -> Rgb {
        scattered(&self.caustic, place, bsdf, wo) + scattered(&self.glints, place, bsdf, wo)
    }

    /// Whether a zone outshines the scene by far, on either side. A function of the solution.
    #[inline]
    pub fn is_bright(&self, zone: u32) -> bool {
        self.bright.binary_search(&zone).is_ok()
    }
}

#[inline]
fn scattered(irradiance: &[Rgb], place: &ZonePlace, bsdf: &Bsdf, wo: Vec3) -> Rgb {
    let at = |side: u32| irradiance[(place.zone * 2 + side) as usize];
    let mut radiance = bsdf.diffuse_albedo(wo) * at(place.side);
    let through = bsdf.diffuse_transmission_albedo(wo);
    if !through.is_black() {
        radiance += through * at(1 - place.side);
    }
    radiance * FRAC_1_PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::{GatherPlan, Strategy};
    use crate::sampler::Sampler;
    use crate::sensor::irradiance;
    use crate::transport::{Tally, Walker};
    use crate::validate::scenes::{diffuse, emission, empty, material, quad, sphere};
    use hemilux_scene::{ConductorFresnel, FloatParam, MaterialKind, RgbParam, Roughness};

    /// A corner of floor and wall at x = -1 that is lit by the image of a bright card in the mirror at x = 1 alone.
    fn corner() -> World {
        let mut scene = empty();
        let (grey, black) = (diffuse(&mut scene, 0.7), diffuse(&mut scene, 0.0));
        let smooth = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
        let fresnel = ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::splat(0.9)));
        let shiny = material(&mut scene, MaterialKind::Conductor { fresnel, roughness: smooth });
        quad(&mut scene, [-1.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], grey, None);
        quad(&mut scene, [-1.0, -1.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0], grey, None);
        quad(&mut scene, [1.0, -1.0, 0.0], [0.0, 0.0, 2.0], [0.0, 2.0, 0.0], shiny, None);
        // The card faces down, the lamp is under it and a shield under that.
        quad(&mut scene, [-0.1, -0.1, 1.0], [0.0, 0.2, 0.0], [0.2, 0.0, 0.0], grey, None);
        sphere(&mut scene, [0.0, 0.0, 0.96], 0.01, false, black, emission(1e4));
        quad(&mut scene, [-0.15, -0.15, 0.92], [0.3, 0.0, 0.0], [0.0, 0.3, 0.0], black, None);
        quad(&mut scene, [-0.15, -0.15, 0.92], [0.0, 0.3, 0.0], [0.0, 0.0, 0.2], black, None);
        World::new(scene)
    }

    /// Irradiance (green) beside the wall: mean and standard error.
    fn beside_the_wall(walker: &Walker, count: u32) -> (f64, f64) {
        let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Adaptive };
        let value = |i: u32| {
            let p = Vec3::new(-0.98, 0.0, 1e-5);
            let mut sampler = Sampler::new(7, i as u64, 0);
            irradiance(walker, p, Vec3::Z, &plan, &mut sampler, &mut Tally::default())[1] as f64
        };
        let (sum, squares) = (0..count).map(value).fold((0.0, 0.0), |s, v| (s.0 + v, s.1 + v * v));
        let mean = sum / count as f64;
        (mean, ((squares / count as f64 - mean * mean).max(0.0) / (count as f64 - 1.0)).sqrt())
    }

    /// Also where time ends the particles early, and whether they come at once or not.
    #[test]
    fn bright_zones_are_known_however_few_particles_there_are() {
        let world = corner();
        let options = ZoneOptions { budget: 3000, particles: 1 << 22, seed: 3 };
        for total in [1 << 15, 1 << 17, 3 << 16] {
            let mut once = Making::new(&world, &options, None);
            once.trace(total, |_| false);
            let once = once.finish();
            assert!(!once.bright.is_empty(), "{total} particles");
            let mut twice = Making::new(&world, &options, None);
            twice.trace(1 << 15, |_| false);
            twice.trace(total, |_| false);
            assert_eq!(once.fingerprint(), twice.finish().fingerprint(), "{total} particles");
        }
    }

    /// What bright zones send to a corner by mirrors comes from the corner's own zones, once.
    #[test]
    fn corners_get_the_light_of_bright_zones_by_mirrors_once() {
        let world = corner();
        let zones = Zones::solve_seen(
            &world,
            &ZoneOptions { budget: 20_000, particles: 1 << 20, seed: 3 },
            None,
            |_| false,
        );
        assert!(!zones.bright.is_empty());
        // Paths that particles lead and no zone ends.
        let truth = beside_the_wall(&Walker { steer: Some(&zones), ..Walker::path(&world) }, 20_000);
        let zonal = |zones: &Zones| beside_the_wall(&Walker::zonal(&world, zones), 2000);
        let found = zonal(&zones);
        let dark = || vec![Rgb::BLACK; zones.glints.len()];
        let twice = zonal(&Zones { bright: Vec::new(), ..zones.clone() });
        let never = zonal(&Zones { glints: dark(), ..zones.clone() });
        let chance = zonal(&Zones { bright: Vec::new(), glints: dark(), ..zones.clone() });
        println!(
            "paths {truth:?}, from zones {found:?}, by chance {chance:?}, twice {twice:?}, never {never:?}"
        );
        assert!((found.0 / truth.0 - 1.0).abs() < 0.03, "{found:?}, by paths {truth:?}");
        // Negative controls.
        assert!(twice.0 > 1.1 * truth.0, "{twice:?}, by paths {truth:?}");
        assert!(never.0 < 0.9 * truth.0, "{never:?}, by paths {truth:?}");
    }
}
