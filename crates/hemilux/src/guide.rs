//! One direction at a vertex of a path, drawn from a mixture: the vertex's own scattering, the field radiance that light
//! particles predict there ([`crate::zones::field`]), and cones around the virtual luminaires and bright zones that they
//! have found ([`crate::zones::records`]).
//!
//! What a gather does with many rays a path does with one: a sample counts BSDF × cosine over the density of the whole
//! mixture (the one-sample balance heuristic, E. Veach 1997), and shadow rays share luminaires with that density. J. Vorba
//! et al. 2014 and T. Müller et al. 2017 guide paths by such mixtures. Unbiased whatever the particles found: scattering
//! keeps a share everywhere.
//!
//! Invariant: [`Guide::density`] is the density of [`Guide::sample`] over its outcomes that are not delta.

use crate::bsdf::{Bsdf, Transport as Quantity};
use crate::sampler::Sampler;
use crate::world::Surface;
use crate::zones::Zones;
use crate::zones::field::Prediction;
use crate::zones::records::{Around, Lent};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// Share of the cones, where there are any, ...
const BY_CONES: f32 = 0.35;
/// ... and, of the rest, of the prediction, where there is one.
const BY_PREDICTION: f32 = 0.5;

/// Where more images than this are listed there are no cones: vertices of paths lie anywhere, so each would expect anew what a
/// gather shares with its neighbours. There single images are picked instead ([`crate::images`]).
pub(crate) const MOST_LISTED: usize = 64;

/// The mixture at one vertex.
pub(crate) struct Guide<'a> {
    /// `None` where there are none.
    cones: Option<Lent>,
    prediction: Option<Prediction<'a>>,
    /// Share of the cones, of the prediction, of the scattering.
    shares: [f32; 3],
}

/// A direction and what it counts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Next {
    /// Unit, local to the surface.
    pub wi: Vec3,
    /// BSDF × cosine over density; for a delta lobe its weight.
    pub weight: Rgb,
    /// Density per steradian; 0 for a delta lobe.
    pub density: f32,
    /// Whether it came from a delta lobe.
    pub delta: bool,
    /// Whether it leads through the surface.
    pub transmitted: bool,
    /// Refractive index beyond over that before, 1 where nothing is refracted.
    pub eta: f32,
}

impl<'a> Guide<'a> {
    /// What `zones` know at `s`, which scatters by `bsdf`; `None` where nothing leads anywhere: nothing diffuse, or no
    /// particle was near.
    /// No cones where more than `most` images are listed.
    pub fn new(zones: &'a Zones, s: &Surface, bsdf: &Bsdf, most: usize) -> Option<Guide<'a>> {
        if !bsdf.has_diffuse() {
            return None;
        }
        let n = s.facing();
        Guide::of(zones.field().near(s.p, n), cones(zones, s.p, n, most))
    }

    /// The same without cones: for vertices whose images something else brings.
    pub fn without_images(zones: &'a Zones, s: &Surface, bsdf: &Bsdf) -> Option<Guide<'a>> {
        if bsdf.has_diffuse() { Guide::of(zones.field().near(s.p, s.facing()), None) } else { None }
    }

    fn of(prediction: Option<Prediction<'a>>, cones: Option<Lent>) -> Option<Guide<'a>> {
        let by_cones = if cones.is_some() { BY_CONES } else { 0.0 };
        let by_prediction = if prediction.is_some() { BY_PREDICTION * (1.0 - by_cones) } else { 0.0 };
        let shares = [by_cones, by_prediction, 1.0 - by_cones - by_prediction];
        (shares[2] < 1.0).then(|| Guide { cones, prediction, shares })
    }

    /// Density per steradian at unit `w`, where the scattering alone has `own`.
    pub fn density(&self, w: Vec3, own: f32) -> f32 {
        let mut density = self.shares[2] * own;
        if let Some(cones) = &self.cones {
            density += self.shares[0] * cones.density(w);
        }
        if let Some(prediction) = &self.prediction {
            density += self.shares[1] * prediction.pdf_solid_angle(w);
        }
        density
    }

    /// A direction of the mixture.
    pub fn sample(&self, s: &Surface, bsdf: &Bsdf, wo: Vec3, sampler: &mut Sampler) -> Option<Next> {
        let (pick, u_part, u) = (sampler.next1(), sampler.next1(), sampler.next2());
        let [by_cones, by_prediction, by_scattering] = self.shares;
        let mut missed = 0.0;
        let w = match (&self.cones, &self.prediction) {
            (Some(cones), _) if pick < by_cones => {
                let drawn = cones.sample(u_part, u)?;
                missed = by_cones * drawn.1;
                drawn.0
            }
            (_, Some(prediction)) if pick < by_cones + by_prediction => prediction.sample(u).0,
            _ => {
                let next = bsdf.sample(wo, u_part, u, Quantity::Radiance)?;
                if next.delta {
                    let weight = next.weight * (1.0 / by_scattering);
                    let transmitted = next.transmitted;
                    return Some(Next {
                        wi: next.wi,
                        weight,
                        density: 0.0,
                        delta: true,
                        transmitted,
                        eta: next.eta,
                    });
                }
                s.frame.to_world(next.wi).normalize()
            }
        };
        let wi = s.frame.to_local(w);
        let f = bsdf.eval(wo, wi, Quantity::Radiance) * wi.z.abs();
        let density = self.density(w, bsdf.pdf_solid_angle(wo, wi)) + missed;
        (!f.is_black() && density > 0.0).then(|| Next {
            wi,
            weight: f * (1.0 / density),
            density,
            delta: false,
            transmitted: wi.z * wo.z < 0.0,
            eta: 1.0,
        })
    }
}

/// The images to pick single ones from at `s`, where they are more than `most`, too many for cones; `None` elsewhere.
pub(crate) fn images<'a>(zones: &'a Zones, s: &Surface, bsdf: &Bsdf, most: usize) -> Option<Around<'a>> {
    let (records, n) = (zones.records(), s.facing());
    if !bsdf.has_diffuse() || records.is_empty() || records.listed(s.p, n) <= most {
        return None;
    }
    records.around(s.p, n)
}

/// The cones at `p`; `None` if there are none, or more than `most` images.
fn cones(zones: &Zones, p: Vec3, n: Vec3, most: usize) -> Option<Lent> {
    if most == 0 || zones.records().is_empty() || zones.records().listed(p, n) > most {
        return None;
    }
    Some(Lent::new(zones.records(), p, n)).filter(|cones| !cones.is_empty())
}
