//! What leads a path at a vertex after the gather's own: cones where light particles say virtual luminaires and bright zones are
//! seen from there, beside the scattering itself.
//!
//! The next direction is drawn from the cones with probability [`SHARE`], else from the scattering, and weighed by the density of
//! both (E. Veach's balance heuristic for one sample, 1997): unbiased whatever the cones are. Without it a path meets the image
//! of a sun on a wall's far side of a mirror by chance alone, once in 50,000 scatterings.

use crate::bsdf::{Bsdf, BsdfSample, Transport as Quantity};
use crate::world::Surface;
use crate::zones::Zones;
use crate::zones::records::Cones;
use hemilux_scene::geom::Vec3;
use std::cell::RefCell;

/// Part of the next directions that the cones decide, where there are any.
const SHARE: f32 = 0.5;

thread_local! {
    /// Cones are large; a thread's walks use the same, one after the other (a residual within a walk needs a second).
    static SPARE: RefCell<Vec<Box<Cones>>> = const { RefCell::new(Vec::new()) };
}

/// Room for the cones of one walk, given back when the walk is over.
pub(super) struct Lead<'a> {
    steer: Option<&'a Zones>,
    cones: Option<Box<Cones>>,
}

impl Drop for Lead<'_> {
    fn drop(&mut self) {
        if let Some(cones) = self.cones.take() {
            SPARE.with_borrow_mut(|spare| spare.push(cones));
        }
    }
}

impl<'a> Lead<'a> {
    /// For a walk led by `steer`, if by anything.
    pub fn new(steer: Option<&'a Zones>) -> Lead<'a> {
        let steer = steer.filter(|z| !z.records().is_empty());
        let cones = steer.map(|_| SPARE.with_borrow_mut(Vec::pop).unwrap_or_default());
        Lead { steer, cones }
    }

    /// Look out from `s`, where `on` scatters. Returns the share of the cones.
    pub fn look(&mut self, s: &Surface, on: &Bsdf) -> f32 {
        let (Some(zones), Some(cones)) = (self.steer, &mut self.cones) else { return 0.0 };
        if !on.has_diffuse() {
            return 0.0;
        }
        cones.fill(zones.records(), s.p, if s.is_front(s.wo) { s.ng } else { -s.ng });
        if cones.is_empty() { 0.0 } else { SHARE }
    }

    /// Density per steradian of the next direction at unit `w`, `wi` in the frame of `s`, given the cones' share.
    pub fn pdf(&self, share: f32, on: &Bsdf, wo: Vec3, w: Vec3, wi: Vec3) -> f32 {
        let own = on.pdf_solid_angle(wo, wi);
        match &self.cones {
            Some(cones) if share > 0.0 => (1.0 - share) * own + share * cones.density(w),
            _ => own,
        }
    }

    /// The next direction at `s`, like [`Bsdf::sample`].
    pub fn sample(
        &self,
        share: f32,
        s: &Surface,
        on: &Bsdf,
        wo: Vec3,
        u_lobe: f32,
        u: [f32; 2],
    ) -> Option<BsdfSample> {
        let Some(cones) = self.cones.as_ref().filter(|_| share > 0.0) else {
            return on.sample(wo, u_lobe, u, Quantity::Radiance);
        };
        if u_lobe >= share {
            let u_lobe = ((u_lobe - share) / (1.0 - share)).min(BELOW_ONE);
            let mut next = on.sample(wo, u_lobe, u, Quantity::Radiance)?;
            if next.delta {
                next.weight *= 1.0 / (1.0 - share);
                return Some(next);
            }
            let pdf = self.pdf(share, on, wo, s.frame.to_world(next.wi).normalize(), next.wi);
            next.weight *= next.pdf / pdf;
            next.pdf = pdf;
            return Some(next);
        }
        let w = cones.sample((u_lobe / share).min(BELOW_ONE), u);
        let wi = s.frame.to_local(w);
        let pdf = self.pdf(share, on, wo, w, wi);
        let f = on.eval(wo, wi, Quantity::Radiance) * wi.z.abs();
        if f.is_black() || pdf <= 0.0 {
            return None;
        }
        Some(BsdfSample {
            wi,
            weight: f * (1.0 / pdf),
            pdf,
            transmitted: wi.z * wo.z < 0.0,
            ..BsdfSample::REFLECTION
        })
    }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;
