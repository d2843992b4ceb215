//! The zonal solution gathered once more: the irradiance of every zone side from gathers at random points of it, over the
//! solution that particles left.
//!
//! One Jacobi step E₁ = D + T E₀ on the particles' estimate E₀ (the final gather of radiosity, H. Rushmeier, C. Patterson
//! and A. Veerasamy 1993, at zones instead of pixels): linear, so unbiased where E₀ is, and far less noisy, since each
//! gather averages over the noise of many zones and takes luminaires and their images by sampling.
//!
//! Every number has an address (seed, zone side, round), so the result does not depend on threads.

use super::Zones;
use super::map::CellsByZone;
use crate::bsdf::Bsdf;
use crate::gather::{GatherPlan, Strategy, gather};
use crate::sampler::Sampler;
use crate::transport::{Tally, Walker};
use crate::world::{Surface, World};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Frame;
use rayon::prelude::*;

/// The work of one gather at a zone.
const PLAN: GatherPlan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::Sobol };
/// Scenes of more cells than this keep the particles' solution.
const MOST_CELLS: usize = 1 << 23;

/// Running sums of gathers at zones.
pub struct Refinement {
    /// `None` where there are too many to list.
    cells: Option<CellsByZone>,
    /// Per zone side: sum over rounds, and sum of squared luminance.
    sums: Vec<(Rgb, f32)>,
    rounds: u32,
    seed: u64,
    /// Rays traced.
    pub rays: u64,
}

impl Refinement {
    /// Nothing gathered yet.
    pub fn new(world: &World, zones: &Zones, seed: u64) -> Refinement {
        let cells = (zones.map.cell_count() <= MOST_CELLS).then(|| zones.map.cells_by_zone(world));
        Refinement { cells, sums: vec![(Rgb::BLACK, 0.0); zones.map.len() * 2], rounds: 0, seed, rays: 0 }
    }

    /// Rounds done.
    pub fn rounds(&self) -> u32 {
        self.rounds
    }

    /// One more gather at every zone side, over `zones` as the particles left it. Does nothing where there are too many
    /// cells to list.
    pub fn round(&mut self, world: &World, zones: &Zones) {
        let Some(cells) = &self.cells else { return };
        let (round, seed) = (self.rounds, self.seed);
        let rays: u64 = self
            .sums
            .par_iter_mut()
            .with_min_len(64)
            .enumerate()
            .map(|(side, sum)| {
                let mut sampler = Sampler::new(seed ^ 0x5ef1_4e, side as u64, round);
                let mut tally = Tally::default();
                let e = irradiance(world, zones, cells, side, &mut sampler, &mut tally);
                if e.is_finite() {
                    sum.0 += e;
                    sum.1 += e.luminance().powi(2);
                }
                tally.rays
            })
            .sum();
        self.rays += rays;
        self.rounds += 1;
    }

    /// Put the gathered irradiance in the place of the particles'.
    pub fn apply(self, zones: &mut Zones) {
        if self.rounds == 0 {
            return;
        }
        let n = self.rounds as f32;
        for (side, (sum, squares)) in self.sums.into_iter().enumerate() {
            let mean = sum * (1.0 / n);
            zones.total[side] = mean;
            if self.rounds > 1 {
                let variance = (squares / n - mean.luminance().powi(2)).max(0.0) / (n - 1.0);
                zones.error[side] = variance.sqrt();
            }
        }
    }
}

fn irradiance(
    world: &World,
    zones: &Zones,
    cells: &CellsByZone,
    side: usize,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    let Some(hit) = cells.point(side / 2, sampler.next1(), sampler.next2()) else { return Rgb::BLACK };
    let placed = world.surface(&hit, hemilux_scene::geom::Vec3::Z);
    let wo = if side % 2 == 0 { placed.ng } else { -placed.ng };
    let surface = Surface { wo, frame: Frame::from_normal(placed.ng), ..placed };
    let walker = Walker { world, zones: Some(zones), max_depth: u32::MAX };
    let white = Bsdf::diffuse(Rgb::WHITE);
    gather(&walker, &surface, &white, &PLAN, sampler, tally) * std::f32::consts::PI
}
