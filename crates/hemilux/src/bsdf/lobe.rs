//! One lobe of a surface: what it scatters, its own chart of the unit square, and its density.

use super::coat::Coat;
use super::directions::{
    coated_metal_factor, coated_mirror_reflectance, compression, grazing, inside_coat, mirrored,
    pane_reflectance, raised, refracted, refraction_half, relative, rough_glass_outcome, sample_cosine,
    sample_reflection,
};
use super::fresnel;
use super::ggx::{GRAZING, Ggx};
use super::given::{facet_colour, tinted_pane, view};
use super::ward::Ward;
use super::{BsdfSample, Transport};
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use std::f32::consts::FRAC_1_PI;

/// How sharply a lobe scatters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeClass {
    /// Cosine-like; sampled by the concentric disk.
    Diffuse,
    /// GGX, sampled by visible normals; or Ward's.
    Glossy,
    /// One direction, or two.
    Delta,
}

/// Which half of a rough dielectric a lobe is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Event {
    Reflect,
    Transmit,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Shape {
    /// albedo / π, to the same side or to the other.
    Lambert { albedo: Rgb, event: Event },
    /// Lambertian base under a coat: `scale` T(o) T(i) / π with scale = ρ / (η² (1 - ρ F_int)).
    Undercoat { scale: Rgb, coat: Coat, mean_transmittance: f32 },
    /// Bare metal, smooth or GGX.
    Metal { eta: Rgb, k: Rgb, ggx: Ggx, weight: f32 },
    /// The outer reflection of a coat, smooth or GGX.
    Gloss { eta: f32, ggx: Ggx, weight: f32 },
    /// Metal seen through a coat. `eta` and `k` are relative to the coat.
    CoatedMetal { coat: Coat, eta: Rgb, k: Rgb, ggx: Ggx, weight: f32 },
    /// A smooth coat on a smooth metal, its own reflection included. `eta` and `k` are relative to the coat.
    CoatedMirror { coat_eta: f32, eta: Rgb, k: Rgb, weight: f32 },
    /// Smooth interface: two branches.
    Glass { eta: f32, weight: Rgb },
    /// Rough interface. A `Reflect` lobe is always followed by its `Transmit` twin.
    RoughGlass { eta: f32, ggx: Ggx, event: Event, weight: f32 },
    /// Both interfaces of a thin pane: two branches.
    Pane { eta: f32, weight: f32 },
    /// The same for each polarisation by itself, with transmissivity `tint` of one passage at normal incidence.
    TintedPane { eta: f32, tint: Rgb, weight: f32 },
    /// Mirror or Ward's rough reflection of given reflectance. Transmission is the reflection thrown to the other side. With `grazing`
    /// (smooth only) the reflectance grows to 1 as [`fresnel::polish`] does, and the transmittance fades.
    Facets { colour: Rgb, grazing: bool, ward: Ward, event: Event, weight: f32 },
    /// What [`fresnel::polish`] leaves for a Lambertian base: albedo (1 - F(view)) / π. Not reciprocal.
    Base { albedo: Rgb, event: Event },
}

/// One term of a [`Bsdf`](super::Bsdf). Directions as there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe(pub(super) Shape);

/// One outcome of a delta lobe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Branch {
    /// Direction to follow, local frame.
    pub wi: Vec3,
    /// Factor on the radiance (or flux) that arrives along `wi`.
    pub weight: Rgb,
    /// Whether `wi` is on the other side of the surface from `wo`.
    pub transmitted: bool,
    /// Index of the side of `wi` relative to the side of `wo`; 1 for reflection.
    pub eta: f32,
}

impl Lobe {
    /// How sharply this lobe scatters.
    #[inline]
    pub fn kind(&self) -> LobeClass {
        match self.0 {
            Shape::Lambert { .. } | Shape::Undercoat { .. } | Shape::Base { .. } => LobeClass::Diffuse,
            Shape::Metal { ggx, .. } | Shape::Gloss { ggx, .. } if ggx.is_smooth() => LobeClass::Delta,
            Shape::Facets { ward, .. } if ward.is_smooth() => LobeClass::Delta,
            Shape::Metal { .. }
            | Shape::Gloss { .. }
            | Shape::Facets { .. }
            | Shape::CoatedMetal { .. }
            | Shape::RoughGlass { .. } => LobeClass::Glossy,
            Shape::CoatedMirror { .. }
            | Shape::Glass { .. }
            | Shape::Pane { .. }
            | Shape::TintedPane { .. } => LobeClass::Delta,
        }
    }

    #[inline]
    pub(super) fn is_delta(&self) -> bool {
        self.kind() == LobeClass::Delta
    }

    /// Whether light can cross the surface through this lobe. A smooth dielectric does both; other transmissive lobes only cross.
    pub fn is_transmissive(&self) -> bool {
        matches!(
            self.0,
            Shape::Lambert { event: Event::Transmit, .. }
                | Shape::RoughGlass { event: Event::Transmit, .. }
                | Shape::Glass { .. }
                | Shape::Pane { .. }
                | Shape::TintedPane { .. }
                | Shape::Facets { event: Event::Transmit, .. }
                | Shape::Base { event: Event::Transmit, .. }
        )
    }

    /// Roughness: GGX α (geometric mean of the two), 1 for diffuse lobes, 0 for delta lobes.
    pub fn alpha(&self) -> f32 {
        match self.0 {
            Shape::Lambert { .. } | Shape::Undercoat { .. } | Shape::Base { .. } => 1.0,
            Shape::Metal { ggx, .. }
            | Shape::Gloss { ggx, .. }
            | Shape::CoatedMetal { ggx, .. }
            | Shape::RoughGlass { ggx, .. } => ggx.mean(),
            Shape::Facets { ward, .. } => ward.alpha,
            Shape::CoatedMirror { .. }
            | Shape::Glass { .. }
            | Shape::Pane { .. }
            | Shape::TintedPane { .. } => 0.0,
        }
    }

    /// What the radiance that a diffuse lobe sends to `wo`, on one side of the surface, is in proportion to, whatever arrives; `None` for
    /// others.
    #[inline]
    pub(super) fn view(&self, wo: Vec3) -> Option<f32> {
        match self.0 {
            Shape::Lambert { .. } => Some(1.0),
            Shape::Base { .. } => Some(fresnel::base(wo.z.abs())),
            Shape::Undercoat { coat, .. } => Some(coat.transmittance(wo.z.abs())),
            _ => None,
        }
    }

    /// Whether [`Lobe::view`] of both is the same to all directions.
    #[inline]
    pub(super) fn is_seen_like(&self, other: &Lobe) -> bool {
        match (self.0, other.0) {
            (Shape::Lambert { .. }, Shape::Lambert { .. }) | (Shape::Base { .. }, Shape::Base { .. }) => true,
            (Shape::Undercoat { coat: a, .. }, Shape::Undercoat { coat: b, .. }) => a == b,
            _ => false,
        }
    }

    /// Value of this lobe, 1/sr, without the cosine; 0 for delta lobes.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, t: Transport) -> Rgb {
        let same_side = wo.z * wi.z > 0.0;
        match self.0 {
            Shape::Lambert { albedo, event } => {
                let matches = if event == Event::Reflect { same_side } else { wo.z * wi.z < 0.0 };
                if matches { albedo * FRAC_1_PI } else { Rgb::BLACK }
            }
            Shape::Base { albedo, event } => {
                if same_side != (event == Event::Reflect) {
                    return Rgb::BLACK;
                }
                albedo * (fresnel::base(view(wo.z, wi.z, t).abs()) * FRAC_1_PI)
            }
            Shape::Facets { colour, ward, event, weight, .. } => {
                let sides = same_side == (event == Event::Reflect);
                if ward.is_smooth() || !sides || grazing(wo) || grazing(wi) {
                    return Rgb::BLACK;
                }
                colour * (ward.value(raised(wo).0, raised(wi).0) * weight)
            }
            Shape::Undercoat { scale, coat, .. } => {
                if !same_side {
                    return Rgb::BLACK;
                }
                scale * (coat.transmittance(wo.z.abs()) * coat.transmittance(wi.z.abs()) * FRAC_1_PI)
            }
            Shape::RoughGlass { eta, ggx, event, weight } => {
                if grazing(wo) || grazing(wi) || same_side != (event == Event::Reflect) {
                    return Rgb::BLACK;
                }
                let (eta, (wo, sign)) = (relative(eta, wo), raised(wo));
                let wi = Vec3::new(wi.x, wi.y, wi.z * sign);
                let visibility = weight * ggx.visibility(wo, wi);
                if event == Event::Reflect {
                    let h = (wo + wi).normalize_or_zero();
                    return Rgb::splat(
                        visibility * ggx.distribution(h) * fresnel::dielectric(wo.dot(h), eta),
                    );
                }
                let Some((h, jacobian)) = refraction_half(eta, wo, wi) else { return Rgb::BLACK };
                let cos = wo.dot(h);
                let passed = 1.0 - fresnel::dielectric_of_cosines(cos, -wi.dot(h), eta);
                Rgb::splat(
                    4.0 * visibility * ggx.distribution(h) * passed * cos * jacobian * compression(eta, t),
                )
            }
            Shape::Metal { .. } | Shape::Gloss { .. } | Shape::CoatedMetal { .. } => {
                if self.is_delta() || !same_side || grazing(wo) || grazing(wi) {
                    return Rgb::BLACK;
                }
                self.eval_glossy_reflection(raised(wo).0, raised(wi).0)
            }
            Shape::CoatedMirror { .. }
            | Shape::Glass { .. }
            | Shape::Pane { .. }
            | Shape::TintedPane { .. } => Rgb::BLACK,
        }
    }

    /// Rough two-sided reflections, directions raised and not grazing.
    #[inline]
    fn eval_glossy_reflection(&self, wo: Vec3, wi: Vec3) -> Rgb {
        let facets = |ggx: Ggx, wo: Vec3, wi: Vec3| {
            let h = (wo + wi).normalize_or_zero();
            (ggx.visibility(wo, wi) * ggx.distribution(h), wo.dot(h))
        };
        match self.0 {
            Shape::Metal { eta, k, ggx, weight } => {
                let (value, cos) = facets(ggx, wo, wi);
                fresnel::conductor(cos, eta, k) * (value * weight)
            }
            Shape::Gloss { eta, ggx, weight } => {
                let (value, cos) = facets(ggx, wo, wi);
                Rgb::splat(fresnel::dielectric(cos, eta) * value * weight)
            }
            Shape::CoatedMetal { coat, eta, k, ggx, weight } => {
                let (value, cos) = facets(ggx, inside_coat(wo, coat.eta), inside_coat(wi, coat.eta));
                let factor = coated_metal_factor(coat, eta, k, ggx.mean(), wo.z, wi.z, cos);
                factor * (value * weight / (coat.eta * coat.eta))
            }
            _ => Rgb::BLACK,
        }
    }

    /// Density per steradian of [`Lobe::sample`]; 0 for delta lobes.
    #[inline]
    pub fn pdf_solid_angle(&self, wo: Vec3, wi: Vec3) -> f32 {
        self.density(wo, wi, false)
    }

    /// [`Lobe::pdf_solid_angle`], for a half of a rough dielectric times the Fresnel choice of that half.
    #[inline]
    pub(super) fn density(&self, wo: Vec3, wi: Vec3, chosen: bool) -> f32 {
        let same_side = wo.z * wi.z > 0.0;
        match self.0 {
            Shape::Lambert { event, .. } | Shape::Base { event, .. } => {
                let matches = if event == Event::Reflect { same_side } else { wo.z * wi.z < 0.0 };
                if matches { wi.z.abs() * FRAC_1_PI } else { 0.0 }
            }
            Shape::Facets { ward, event, .. } => {
                let sides = same_side == (event == Event::Reflect);
                if ward.is_smooth() || !sides || grazing(wo) || grazing(wi) {
                    return 0.0;
                }
                ward.density(raised(wo).0, raised(wi).0)
            }
            Shape::Undercoat { .. } => {
                if same_side {
                    wi.z.abs() * FRAC_1_PI
                } else {
                    0.0
                }
            }
            Shape::RoughGlass { eta, ggx, event, .. } => {
                if grazing(wo) || grazing(wi) || same_side != (event == Event::Reflect) {
                    return 0.0;
                }
                let (eta, (wo, sign)) = (relative(eta, wo), raised(wo));
                let wi = Vec3::new(wi.x, wi.y, wi.z * sign);
                let half = match event {
                    Event::Reflect => Some(((wo + wi).normalize_or_zero(), 0.25)),
                    Event::Transmit => {
                        refraction_half(eta, wo, wi).map(|(h, jacobian)| (h, jacobian * wo.dot(h)))
                    }
                };
                let Some((h, jacobian)) = half else { return 0.0 };
                let share = match (chosen, event) {
                    (false, _) => 1.0,
                    (true, Event::Reflect) => fresnel::dielectric(wo.dot(h), eta),
                    (true, Event::Transmit) => {
                        1.0 - fresnel::dielectric_of_cosines(wo.dot(h), -wi.dot(h), eta)
                    }
                };
                ggx.visible_density(wo, h) * jacobian * share
            }
            Shape::Metal { ggx, .. } | Shape::Gloss { ggx, .. } => {
                if ggx.is_smooth() || !same_side || grazing(wo) || grazing(wi) {
                    return 0.0;
                }
                let (wo, wi) = (raised(wo).0, raised(wi).0);
                0.25 * ggx.visible_density(wo, (wo + wi).normalize_or_zero())
            }
            Shape::CoatedMetal { coat, ggx, .. } => {
                if !same_side || grazing(wo) || grazing(wi) {
                    return 0.0;
                }
                let (inner_o, inner_i) =
                    (inside_coat(raised(wo).0, coat.eta), inside_coat(raised(wi).0, coat.eta));
                let h = (inner_o + inner_i).normalize_or_zero();
                0.25 * ggx.visible_density(inner_o, h) * wi.z.abs() / (coat.eta * coat.eta * inner_i.z)
            }
            Shape::CoatedMirror { .. }
            | Shape::Glass { .. }
            | Shape::Pane { .. }
            | Shape::TintedPane { .. } => 0.0,
        }
    }

    /// Samples this lobe alone in its own chart; the weight is relative to this lobe's own value. Delta lobes choose between
    /// their branches with `u[0]`. `None` where a facet's light goes below the horizon: such a sample is worth zero.
    #[inline]
    pub fn sample(&self, wo: Vec3, u: [f32; 2], t: Transport) -> Option<BsdfSample> {
        self.sample_with(wo, u[0], u, t)
    }

    /// [`Lobe::sample`] with its own number for the choice between the branches of a delta lobe.
    #[inline]
    pub(super) fn sample_with(&self, wo: Vec3, choice: f32, u: [f32; 2], t: Transport) -> Option<BsdfSample> {
        match self.0 {
            Shape::Lambert { albedo, event } => sample_cosine(wo, u, event, |_| albedo),
            Shape::Undercoat { scale, coat, .. } => sample_cosine(wo, u, Event::Reflect, |mu| {
                scale * (coat.transmittance(wo.z.abs()) * coat.transmittance(mu))
            }),
            Shape::Base { albedo, event } => {
                sample_cosine(wo, u, event, |mu| albedo * fresnel::base(view(wo.z.abs(), mu, t)))
            }
            _ if self.is_delta() => self.sample_delta(wo, choice, t),
            _ if grazing(wo) => None,
            Shape::RoughGlass { eta, ggx, event, weight } => {
                let (eta, (up, sign)) = (relative(eta, wo), raised(wo));
                let h = ggx.sample_visible(up, u)?;
                let (f, cos_t) = fresnel::dielectric_refracted(up.dot(h), eta);
                let share = if event == Event::Reflect { f } else { 1.0 - f };
                let mut sample = rough_glass_outcome(ggx, up, h, eta, cos_t, event, t)?;
                sample.weight = Rgb::splat(sample.weight[0] * share * weight);
                sample.wi.z *= sign;
                Some(sample)
            }
            Shape::CoatedMetal { coat, eta, k, ggx, weight } => {
                let (up, sign) = raised(wo);
                let inner_o = inside_coat(up, coat.eta);
                let (inner_i, h, shadowing, density) = sample_reflection(ggx, inner_o, u)?;
                let (x, y) = (inner_i.x * coat.eta, inner_i.y * coat.eta);
                let cos2 = 1.0 - x * x - y * y;
                if cos2 <= GRAZING * GRAZING {
                    return None;
                }
                let cos = cos2.sqrt();
                let factor = coated_metal_factor(coat, eta, k, ggx.mean(), up.z, cos, inner_o.dot(h));
                Some(BsdfSample {
                    wi: Vec3::new(x, y, cos * sign),
                    weight: factor * (weight * shadowing),
                    pdf: density * cos / (coat.eta * coat.eta * inner_i.z),
                    ..BsdfSample::REFLECTION
                })
            }
            Shape::Facets { colour, ward, event, weight, .. } => {
                let (up, sign) = raised(wo);
                let (wi, factor, pdf) = ward.sample(up, u)?;
                let transmitted = event == Event::Transmit;
                let sign = if transmitted { -sign } else { sign };
                let wi = Vec3::new(wi.x, wi.y, wi.z * sign);
                let weight = colour * (weight * factor);
                Some(BsdfSample { wi, weight, pdf, transmitted, ..BsdfSample::REFLECTION })
            }
            Shape::Metal { ggx, .. } | Shape::Gloss { ggx, .. } => {
                let (up, sign) = raised(wo);
                let (wi, h, shadowing, pdf) = sample_reflection(ggx, up, u)?;
                let cos = up.dot(h);
                let reflected = match self.0 {
                    Shape::Metal { eta, k, weight, .. } => fresnel::conductor(cos, eta, k) * weight,
                    Shape::Gloss { eta, weight, .. } => Rgb::splat(fresnel::dielectric(cos, eta) * weight),
                    _ => Rgb::BLACK,
                };
                let wi = Vec3::new(wi.x, wi.y, wi.z * sign);
                Some(BsdfSample { wi, weight: reflected * shadowing, pdf, ..BsdfSample::REFLECTION })
            }
            Shape::CoatedMirror { .. }
            | Shape::Glass { .. }
            | Shape::Pane { .. }
            | Shape::TintedPane { .. } => None,
        }
    }

    /// Samples both halves of a rough dielectric with the Fresnel term of the facet as the choice (B. Walter et al., 2007).
    /// Only its `Reflect` half knows how.
    #[inline]
    pub(super) fn sample_rough_glass(
        &self,
        wo: Vec3,
        choice: f32,
        u: [f32; 2],
        t: Transport,
    ) -> Option<BsdfSample> {
        let Shape::RoughGlass { eta, ggx, weight, .. } = self.0 else { return None };
        if grazing(wo) {
            return None;
        }
        let (eta, (up, sign)) = (relative(eta, wo), raised(wo));
        let h = ggx.sample_visible(up, u)?;
        let (f, cos_t) = fresnel::dielectric_refracted(up.dot(h), eta);
        let (event, share) = if choice < f { (Event::Reflect, f) } else { (Event::Transmit, 1.0 - f) };
        let mut sample = rough_glass_outcome(ggx, up, h, eta, cos_t, event, t)?;
        sample.weight *= weight;
        sample.pdf *= share;
        sample.wi.z *= sign;
        Some(sample)
    }

    fn sample_delta(&self, wo: Vec3, choice: f32, t: Transport) -> Option<BsdfSample> {
        let [reflection, transmission] = self.branches(wo, t);
        let (branch, probability) = match (reflection, transmission) {
            (Some(reflection), Some(transmission)) => {
                // The reflectance is the probability: both weights become the same.
                let flux = |b: &Branch| b.weight.mean() / compression(b.eta, t);
                let (r, s) = (flux(&reflection), flux(&transmission));
                let p = r / (r + s);
                if choice < p { (reflection, p) } else { (transmission, 1.0 - p) }
            }
            (Some(only), None) | (None, Some(only)) => (only, 1.0),
            (None, None) => return None,
        };
        Some(BsdfSample {
            wi: branch.wi,
            weight: branch.weight / probability,
            pdf: 0.0,
            delta: true,
            transmitted: branch.transmitted,
            eta: branch.eta,
            lobe: 0,
        })
    }

    /// All outcomes of a delta lobe, reflection first: a caller that follows both need not choose. Nothing for other lobes.
    /// Branches of no weight are left out.
    pub fn branches(&self, wo: Vec3, t: Transport) -> [Option<Branch>; 2] {
        if !self.is_delta() || grazing(wo) {
            return [None; 2];
        }
        let cos = wo.z.abs();
        let reflection = |weight: Rgb| Branch { wi: mirrored(wo), weight, transmitted: false, eta: 1.0 };
        let single = |weight: Rgb| [Some(reflection(weight)), None];
        let both = |weight: Rgb, r: f32, wi: Vec3, eta: f32| {
            let through = weight * ((1.0 - r) * compression(eta, t));
            let transmission = Branch { wi, weight: through, transmitted: true, eta };
            [(r > 0.0).then(|| reflection(weight * r)), (r < 1.0).then_some(transmission)]
        };
        match self.0 {
            Shape::Metal { eta, k, weight, .. } => single(fresnel::conductor(cos, eta, k) * weight),
            Shape::Gloss { eta, weight, .. } => single(Rgb::splat(fresnel::dielectric(cos, eta) * weight)),
            Shape::CoatedMirror { coat_eta, eta, k, weight } => {
                single(coated_mirror_reflectance(cos, coat_eta, eta, k) * weight)
            }
            Shape::Glass { eta, weight } => {
                let eta = relative(eta, wo);
                let (r, cos_t) = fresnel::dielectric_refracted(cos, eta);
                both(weight, r, refracted(wo, eta, cos_t), eta)
            }
            Shape::Pane { eta, weight } => both(Rgb::splat(weight), pane_reflectance(cos, eta), -wo, 1.0),
            Shape::TintedPane { eta, tint, weight } => {
                let (r, through) = tinted_pane(cos, eta, tint);
                let transmission = Branch { wi: -wo, weight: through * weight, transmitted: true, eta: 1.0 };
                [
                    (!r.is_black()).then(|| reflection(r * weight)),
                    (!through.is_black()).then_some(transmission),
                ]
            }
            Shape::Facets { colour, grazing, event, weight, .. } => {
                let weight = facet_colour(colour, grazing, event, cos) * weight;
                match event {
                    _ if weight.is_black() => [None; 2],
                    Event::Reflect => single(weight),
                    Event::Transmit => [None, Some(Branch { wi: -wo, weight, transmitted: true, eta: 1.0 })],
                }
            }
            _ => [None; 2],
        }
    }

    /// Directional-hemispherical albedo as flux: exact for smooth and diffuse lobes, Fresnel term of the mean plane for rough ones.
    pub(crate) fn albedo(&self, wo: Vec3) -> Rgb {
        let cos = wo.z.abs();
        match self.0 {
            Shape::Lambert { albedo, .. } => albedo,
            Shape::Undercoat { scale, coat, mean_transmittance } => {
                scale * (coat.transmittance(cos) * mean_transmittance)
            }
            Shape::Metal { eta, k, weight, .. } => fresnel::conductor(cos, eta, k) * weight,
            Shape::Gloss { eta, ggx, weight } => {
                Rgb::splat((1.0 - Coat::new(eta, ggx).transmittance(cos)) * weight)
            }
            Shape::CoatedMetal { coat, eta, k, weight, .. } => {
                // All of a white metal's light comes out again; at grazing angles not mirrored but spread, hence the limit.
                let returned = fresnel::dielectric(cos.max(0.3), coat.eta);
                let inner = (1.0 - (1.0 - cos * cos) / (coat.eta * coat.eta)).max(0.0).sqrt();
                let through = coat.transmittance(cos) * (1.0 - returned) * weight;
                fresnel::conductor(inner, eta, k).map(|m| through * m / (1.0 - returned * m))
            }
            Shape::CoatedMirror { coat_eta, eta, k, weight } => {
                coated_mirror_reflectance(cos, coat_eta, eta, k) * weight
            }
            Shape::Glass { weight, .. } => weight,
            Shape::Pane { weight, .. } => Rgb::splat(weight),
            Shape::TintedPane { eta, tint, weight } => {
                let (r, through) = tinted_pane(cos, eta, tint);
                (r + through) * weight
            }
            Shape::Facets { colour, grazing, event, weight, .. } => {
                facet_colour(colour, grazing, event, cos) * weight
            }
            Shape::Base { albedo, .. } => albedo * fresnel::base(cos),
            Shape::RoughGlass { eta, event, weight, .. } => {
                let r = fresnel::dielectric(cos, relative(eta, wo));
                Rgb::splat(weight * if event == Event::Reflect { r } else { 1.0 - r })
            }
        }
    }

    /// What a rough dielectric scatters by both halves together.
    #[inline]
    pub(super) fn pair_weight(&self) -> f32 {
        if let Shape::RoughGlass { weight, .. } = self.0 { weight } else { 0.0 }
    }

    /// The lobe times `k`.
    pub(super) fn scaled(mut self, k: f32) -> Lobe {
        match &mut self.0 {
            Shape::Lambert { albedo, .. } | Shape::Base { albedo, .. } => *albedo *= k,
            Shape::Glass { weight, .. } => *weight *= k,
            Shape::Undercoat { scale, .. } => *scale *= k,
            Shape::Metal { weight, .. }
            | Shape::Gloss { weight, .. }
            | Shape::CoatedMetal { weight, .. }
            | Shape::CoatedMirror { weight, .. }
            | Shape::RoughGlass { weight, .. }
            | Shape::Facets { weight, .. }
            | Shape::TintedPane { weight, .. }
            | Shape::Pane { weight, .. } => *weight *= k,
        }
        self
    }

    /// Whether the lobe never scatters anything.
    pub(super) fn is_black(&self) -> bool {
        match self.0 {
            Shape::Lambert { albedo, .. } | Shape::Base { albedo, .. } => albedo.is_black(),
            Shape::Glass { weight, .. } => weight.is_black(),
            Shape::Facets { colour, grazing, event, weight, .. } => {
                weight == 0.0 || (colour.is_black() && !(grazing && event == Event::Reflect))
            }
            Shape::Undercoat { scale, .. } => scale.is_black(),
            Shape::Gloss { eta, weight, .. } => weight == 0.0 || eta == 1.0,
            Shape::Metal { weight, .. }
            | Shape::CoatedMetal { weight, .. }
            | Shape::CoatedMirror { weight, .. }
            | Shape::RoughGlass { weight, .. }
            | Shape::TintedPane { weight, .. }
            | Shape::Pane { weight, .. } => weight == 0.0,
        }
    }
}
