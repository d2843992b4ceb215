//! Where a gather's rays go, without tracing them: for pictures of strata.
//!
//! The numbers are those that [`gather`](super::gather) draws from the same sampler, in its order.

use super::{GatherPlan, Part, Point};
use crate::bsdf::{Bsdf, Transport as Quantity};
use crate::sampler::Sampler;
use crate::transport::Walker;
use crate::world::Surface;
use hemilux_scene::geom::Vec3;

/// What a ray was drawn from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stratum {
    /// A lobe's own chart.
    Lobe,
    /// The predicted field radiance.
    Prediction,
    /// The cones of virtual luminaires and bright zones.
    Cones,
    /// The luminaires: a shadow ray.
    Luminaires,
    /// A hint.
    Hint,
}

/// The directions (unit, world) of one gather with an unbiased plain strategy, each with its stratum.
pub fn draws(
    walker: &Walker,
    s: &Surface,
    bsdf: &Bsdf,
    plan: &GatherPlan,
    sampler: &mut Sampler,
) -> Vec<(Vec3, Stratum)> {
    Point::new(walker, s, bsdf, plan, Part::WHOLE).draws(sampler)
}

impl Point<'_> {
    fn draws(&self, sampler: &mut Sampler) -> Vec<(Vec3, Stratum)> {
        let mut all = Vec::new();
        let shift = sampler.next1();
        let points = self.plan.strategy.points(sampler, self.cone_rays.max(1));
        let pick = |i: u32| (i as f32 + shift) / self.cone_rays as f32;
        all.extend(
            (0..self.cone_rays)
                .filter_map(|i| Some((self.cones.sample(pick(i), points.point(i))?.0, Stratum::Cones))),
        );
        let (world, m) = (self.walker.world, self.plan.shadow_rays);
        let shift = sampler.next1();
        let points = self.plan.strategy.points(sampler, m);
        all.extend((0..m).filter_map(|i| {
            let pick = (i as f32 + shift) / m as f32;
            let l = world.luminaires.sample(&world.scene, &self.receiver, pick, points.point(i))?;
            Some((l.wi, Stratum::Luminaires))
        }));
        for (k, lobe) in self.bsdf.lobes().iter().enumerate().filter(|l| self.broad.own[l.0] > 0) {
            let points = self.plan.strategy.points(sampler, self.broad.own[k]);
            all.extend((0..self.broad.own[k]).filter_map(|i| {
                let sample = lobe.sample(self.wo, points.point(i), Quantity::Radiance)?;
                Some((self.s.frame.to_world(sample.wi).normalize(), Stratum::Lobe))
            }));
        }
        if let Some(prediction) = &self.broad.prediction {
            let points = self.plan.strategy.points(sampler, self.broad.guided);
            all.extend(
                (0..self.broad.guided).map(|i| (prediction.sample(points.point(i)).0, Stratum::Prediction)),
            );
        }
        for cone in self.looks.cones() {
            let points = self.plan.strategy.points(sampler, cone.rays);
            all.extend((0..cone.rays).map(|i| (cone.sample(points.point(i)), Stratum::Hint)));
        }
        all
    }
}
