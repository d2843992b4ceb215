//! How surfaces scatter: bidirectional scattering distribution functions as sums of lobes.
//!
//! Directions are unit, in the local frame whose z axis is the shading normal, and point away from the surface: `wo` to where
//! radiance goes (for a camera path), `wi` to where it comes from. A [`Bsdf`] is plain data without heap; its lobes can be
//! summed ([`Bsdf::eval`]), sampled together ([`Bsdf::sample`]), or each integrated in its own chart ([`Lobe::sample`]).
//!
//! | material | lobes | model |
//! | --- | --- | --- |
//! | [`Bsdf::diffuse`] | Lambert | |
//! | [`Bsdf::conductor`] | metal | exact Fresnel; delta or GGX, height-correlated Smith, single scattering |
//! | [`Bsdf::dielectric`] | glass, or rough reflection and rough refraction | exact Fresnel; B. Walter et al., 2007 |
//! | [`Bsdf::thin_dielectric`] | pane | both interfaces, unpolarised, all inner bounces |
//! | [`Bsdf::coated_diffuse`] | gloss, undercoat | inner interreflections of a Lambertian base as a geometric series |
//! | [`Bsdf::coated_conductor`] | gloss, coated metal; or one mirror | refracted facets, interreflections as a geometric series |
//! | [`Bsdf::diffuse_transmission`] | Lambert, Lambert through | |
//! | [`Bsdf::polished`] | Lambert and facets, both ways | given reflectances, mirror or Ward's roughness |
//! | [`Bsdf::tinted_pane`] | pane | each polarisation, absorption |
//! | [`Bsdf::tinted_dielectric`] | glass | exact Fresnel, weakened |
//! | [`Bsdf::mix`] | those of both | |
//!
//! Reflection acts alike on both sides of a surface (metals, coats, Lambert). Grazing directions (|cos θ| < 1e-6 for
//! anything but Lambert) and directions whose z is not a number carry nothing. For unit directions, values, densities and weights
//! are never negative, infinite or not a number.
//!
//! # What is approximate
//!
//! GGX lobes scatter once: what a facet throws at another facet is lost. Albedo of a surface that would lose nothing:
//!
//! | cos θ | 1 | 0.7 | 0.4 | 0.1 | 0.01 |
//! | --- | --- | --- | --- | --- | --- |
//! | metal, α = 0.1 | 0.989 | 0.982 | 0.956 | 0.883 | 0.977 |
//! | metal, α = 0.3 | 0.877 | 0.844 | 0.815 | 0.889 | 0.981 |
//! | metal, α = 0.5 | 0.688 | 0.683 | 0.715 | 0.860 | 0.974 |
//! | metal, α = 1 | 0.307 | 0.379 | 0.499 | 0.760 | 0.954 |
//! | glass 1.5, α = 0.1, outside | 0.999 | 0.997 | 0.986 | 0.923 | 0.978 |
//! | glass 1.5, α = 0.3, outside | 0.988 | 0.971 | 0.933 | 0.906 | 0.971 |
//! | glass 1.5, α = 0.3, inside | 0.899 | 0.823 | 0.772 | 0.790 | 0.834 |
//! | glass 1.5, α = 1, outside | 0.894 | 0.800 | 0.718 | 0.741 | 0.916 |
//!
//! A rough coat transmits whatever it does not reflect by single scattering, in the directions of its mean plane: varnish over
//! white keeps everything (tables and their interpolation: within 0.008). Anisotropic coats transmit with the geometric mean of
//! their roughnesses. A rough coat over a metal widens the metal's facets, α² + (1 - 1/η)² α_coat² / 2 (each of two passages turns
//! a ray by (1 - 1/η) of the tilt of the facet, a reflection by twice the tilt). Interreflection between coat and rough metal keeps
//! the shape of the first reflection; its energy is that of a random walk within 0.012 for a white metal and 0.02 for a grey
//! one. Index of rough coats and of coats over metals: [1, 3], clamped.

mod coat;
mod directions;
pub mod fresnel;
mod ggx;
mod given;
mod lobe;
mod split;
mod ward;

pub use ggx::SMOOTH_ALPHA;
pub use lobe::{Branch, Lobe, LobeClass};

use crate::wrong::{Wrong, makes};
use coat::Coat;
use ggx::Ggx;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use lobe::{Event, Shape};
use std::f32::consts::FRAC_1_PI;
use ward::Ward;

/// Most lobes a [`Bsdf`] holds.
pub const MAX_LOBES: usize = 8;

/// Indices closer to 1 than this do not refract visibly; a rough interface of such an index counts as smooth, since the half
/// vector of its refraction has no digits left.
const NO_REFRACTION: f32 = 1e-3;

/// What is transported from `wi` to `wo`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transport {
    /// Radiance, as camera paths carry: a refraction into relative index η divides it by η².
    Radiance,
    /// Flux, as light particles carry: a refraction leaves it as it is.
    Flux,
}

/// One sampled direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BsdfSample {
    /// Direction, local frame, unit.
    pub wi: Vec3,
    /// f |cos θi| / density; for delta lobes reflectance over probability.
    pub weight: Rgb,
    /// Density per steradian; 0 for delta lobes.
    pub pdf: f32,
    /// Whether a delta lobe was sampled.
    pub delta: bool,
    /// Whether `wi` is on the other side of the surface from `wo`.
    pub transmitted: bool,
    /// Index of the side of `wi` relative to the side of `wo`; 1 for reflection and where nothing refracts.
    pub eta: f32,
    /// Index of the lobe in [`Bsdf::lobes`]; 0 from [`Lobe::sample`].
    pub lobe: u8,
}

impl BsdfSample {
    /// What every non-delta reflection has in common.
    pub(crate) const REFLECTION: BsdfSample = BsdfSample {
        wi: Vec3::Z,
        weight: Rgb::BLACK,
        pdf: 0.0,
        delta: false,
        transmitted: false,
        eta: 1.0,
        lobe: 0,
    };
}

/// A sum of lobes at one point of a surface.
#[derive(Clone, Copy, Debug)]
pub struct Bsdf {
    lobes: [Lobe; MAX_LOBES],
    count: u8,
    /// Lobes of finite density, a rough dielectric counted once.
    smooth: u8,
    delta: bool,
}

/// `v` in [0, `most`]; 0 if it is not a number.
fn limited(v: f32, most: f32) -> f32 {
    if v > 0.0 { v.min(most) } else { 0.0 }
}

/// Albedos of a texture: [0, 1], not-a-number is 0.
fn albedo(rgb: Rgb) -> Rgb {
    rgb.map(|v| limited(v, 1.0))
}

/// Finite, non-negative optical constants; not-a-number is 0.
fn optical(rgb: Rgb) -> Rgb {
    rgb.map(|v| limited(v, 1e5))
}

/// An index of refraction in [0.01, 100]; not-a-number is 1.
fn index(eta: f32) -> f32 {
    if eta.is_nan() { 1.0 } else { eta.clamp(0.01, 100.0) }
}

impl Bsdf {
    /// Absorbs everything.
    #[inline]
    pub fn none() -> Bsdf {
        const NONE: Bsdf = Bsdf {
            lobes: [Lobe(Shape::Lambert { albedo: Rgb::BLACK, event: Event::Reflect }); MAX_LOBES],
            count: 0,
            smooth: 0,
            delta: false,
        };
        NONE
    }

    fn one(shape: Shape) -> Bsdf {
        let mut bsdf = Bsdf::none();
        bsdf.push(Lobe(shape));
        bsdf
    }

    fn two(first: Shape, second: Shape) -> Bsdf {
        let mut bsdf = Bsdf::one(first);
        bsdf.push(Lobe(second));
        bsdf
    }

    /// Appends a lobe unless it is black; adds Lambertian lobes of one side into one. Room is the caller's business.
    fn push(&mut self, lobe: Lobe) {
        if lobe.is_black() || self.count as usize == MAX_LOBES {
            return;
        }
        if let Shape::Lambert { albedo: more, event } = lobe.0 {
            for present in &mut self.lobes[..self.count as usize] {
                match &mut present.0 {
                    Shape::Lambert { albedo, event: e } if *e == event => return *albedo += more,
                    _ => {}
                }
            }
        }
        self.lobes[self.count as usize] = lobe;
        self.count += 1;
        if lobe.is_delta() {
            self.delta = true;
        } else if !is_twin(&lobe) {
            self.smooth += 1;
        }
    }

    /// Lambertian reflection of `albedo` in [0, 1] (clamped), from both sides.
    #[inline]
    pub fn diffuse(albedo: Rgb) -> Bsdf {
        let mut bsdf = Bsdf::none();
        let albedo = self::albedo(albedo);
        if !albedo.is_black() {
            bsdf.lobes[0] = Lobe(Shape::Lambert { albedo, event: Event::Reflect });
            (bsdf.count, bsdf.smooth) = (1, 1);
        }
        bsdf
    }

    /// Metal of complex index `eta` + i `k` (relative to outside) and GGX roughness `alpha` along the two tangents; a mirror when
    /// both are below [`SMOOTH_ALPHA`].
    pub fn conductor(eta: Rgb, k: Rgb, alpha: [f32; 2]) -> Bsdf {
        Bsdf::one(Shape::Metal { eta: optical(eta), k: optical(k), ggx: Ggx::new(alpha), weight: 1.0 })
    }

    /// Metal of reflectance `r` at normal incidence: η = 1, k = 2 √r / √(1 - r). 1 reflects everything at every angle.
    pub fn conductor_reflectance(r: Rgb, alpha: [f32; 2]) -> Bsdf {
        Bsdf::conductor(Rgb::WHITE, fresnel::k_of_reflectance(albedo(r)), alpha)
    }

    /// Interface of index `eta` = inside / outside, inside being z < 0; [0.01, 100], clamped. `eta` = 1 passes straight through.
    /// Smooth when both roughnesses are below [`SMOOTH_ALPHA`] or `eta` is within 0.001 of 1.
    pub fn dielectric(eta: f32, alpha: [f32; 2]) -> Bsdf {
        let (eta, ggx) = (index(eta), Ggx::new(alpha));
        if ggx.is_smooth() || (eta - 1.0).abs() < NO_REFRACTION {
            return Bsdf::one(Shape::Glass { eta, weight: Rgb::WHITE });
        }
        let half = |event| Shape::RoughGlass { eta, ggx, event, weight: 1.0 };
        Bsdf::two(half(Event::Reflect), half(Event::Transmit))
    }

    /// A pane of index `eta` too thin to displace rays: reflectance R + T² R / (1 - R²) of the unpolarised R, the rest straight on.
    pub fn thin_dielectric(eta: f32) -> Bsdf {
        Bsdf::one(Shape::Pane { eta: index(eta), weight: 1.0 })
    }

    /// [`Bsdf::thin_dielectric`] of tinted glass, each polarisation by itself: `tint` in [0, 1] (clamped) is the transmissivity of one
    /// passage at normal incidence; a passage at inner cosine c transmits `tint`^(1/c).
    pub fn tinted_pane(eta: f32, tint: Rgb) -> Bsdf {
        Bsdf::one(Shape::TintedPane { eta: index(eta), tint: albedo(tint), weight: 1.0 })
    }

    /// A smooth [`Bsdf::dielectric`] all of whose outcomes are weakened by `tint` in [0, 1] (clamped): what an absorbing medium
    /// has left of them on the way here.
    pub fn tinted_dielectric(eta: f32, tint: Rgb) -> Bsdf {
        Bsdf::one(Shape::Glass { eta: index(eta), weight: albedo(tint) })
    }

    /// Given reflectances and transmittances, diffuse and specular, from both sides; each in [0, 1] (clamped), their sum is the
    /// caller's business. Specular reflection is a mirror or Ward's of roughness `alpha` with bounded albedo; specular transmission goes
    /// straight on, spread by half that roughness.
    ///
    /// With `grazing` a smooth surface's mirror grows to 1 towards grazing angles, r + F (1 - r) with [`fresnel::polish`]; what lies
    /// below fades by 1 - F of the direction it is seen from. That is how Radiance has it: everything comes back from uniform
    /// surroundings. This Lambertian part is not reciprocal; particles use its adjoint.
    pub fn polished(diffuse: [Rgb; 2], specular: [Rgb; 2], alpha: f32, grazing: bool) -> Bsdf {
        let (facets, through) = (Ward::new(alpha), Ward::new(0.5 * alpha));
        let grazing = grazing && facets.is_smooth();
        let mut bsdf = Bsdf::none();
        for (albedo, event) in diffuse.map(albedo).into_iter().zip([Event::Reflect, Event::Transmit]) {
            bsdf.push(Lobe(match grazing {
                true => Shape::Base { albedo, event },
                false => Shape::Lambert { albedo, event },
            }));
        }
        let kinds = [(facets, Event::Reflect), (through, Event::Transmit)];
        let part = if makes(Wrong::Mirrors) { 0.9 } else { 1.0 };
        for (colour, (ward, event)) in specular.map(albedo).into_iter().zip(kinds) {
            let colour = colour * part;
            bsdf.push(Lobe(Shape::Facets { colour, grazing, ward, event, weight: 1.0 }));
        }
        bsdf
    }

    /// Varnish: a coat of index `eta` and roughness `alpha` over a Lambertian base, from both sides. Under a smooth coat
    /// f = (1 - F(o)) (1 - F(i)) ρ / (π η² (1 - ρ F_int)), F_int the mean internal reflectance; under a rough one 1 - F becomes
    /// one minus the albedo of the rough reflection.
    pub fn coated_diffuse(albedo: Rgb, eta: f32, alpha: [f32; 2]) -> Bsdf {
        let (eta, ggx) = (index(eta), Ggx::new(alpha));
        let coat = Coat::new(eta, ggx);
        let mean_transmittance = coat.mean_transmittance();
        let eta2 = coat.eta * coat.eta;
        let internal = 1.0 - mean_transmittance / eta2;
        let scale = self::albedo(albedo).map(|rho| rho / (eta2 * (1.0 - rho * internal)));
        if coat.eta == 1.0 {
            return Bsdf::diffuse(albedo);
        }
        Bsdf::two(
            Shape::Gloss { eta: coat.eta, ggx, weight: 1.0 },
            Shape::Undercoat { scale, coat, mean_transmittance },
        )
    }

    /// A coat of index `coat_eta` in [1, 3] (clamped) and roughness `coat_alpha` over a metal of complex index `eta` + i `k`
    /// *relative to the outside* (it is divided by `coat_eta` here) and roughness `base_alpha`, from both sides.
    ///
    /// Both smooth: one mirror, F + (1 - F)² M / (1 - F M). Otherwise the coat's own reflection and a lobe of the metal seen through
    /// the coat, refracted at the mean plane both ways, times a geometric series of interreflections: see the module text.
    pub fn coated_conductor(
        coat_eta: f32,
        coat_alpha: [f32; 2],
        eta: Rgb,
        k: Rgb,
        base_alpha: [f32; 2],
    ) -> Bsdf {
        let coat_eta = index(coat_eta).clamp(1.0, coat::ETA_MAX);
        if coat_eta == 1.0 {
            return Bsdf::conductor(eta, k, base_alpha);
        }
        let (gloss, base) = (Ggx::new(coat_alpha), Ggx::new(base_alpha));
        let (eta, k) = (optical(eta) / coat_eta, optical(k) / coat_eta);
        if gloss.is_smooth() && base.is_smooth() {
            return Bsdf::one(Shape::CoatedMirror { coat_eta, eta, k, weight: 1.0 });
        }
        let coat = Coat::new(coat_eta, gloss);
        let turn = 0.5 * (1.0 - 1.0 / coat_eta) * (1.0 - 1.0 / coat_eta);
        // Never smooth: seen through a rough coat nothing is, and a lobe under a smooth one has its own roughness.
        let widened = |base: f32, coat: f32| (base * base + turn * coat * coat).sqrt().max(SMOOTH_ALPHA);
        let ggx = Ggx::new([widened(base.x, gloss.x), widened(base.y, gloss.y)]);
        Bsdf::two(
            Shape::Gloss { eta: coat_eta, ggx: gloss, weight: 1.0 },
            Shape::CoatedMetal { coat, eta, k, ggx, weight: 1.0 },
        )
    }

    /// Lambertian reflection and transmission, from both sides. Both in [0, 1] (clamped); where their sum exceeds 1, both are
    /// scaled to make it 1.
    pub fn diffuse_transmission(reflectance: Rgb, transmittance: Rgb) -> Bsdf {
        let (r, t) = (albedo(reflectance), albedo(transmittance));
        let scale = (r + t).map(|sum| 1.0 / sum.max(1.0));
        Bsdf::two(
            Shape::Lambert { albedo: r * scale, event: Event::Reflect },
            Shape::Lambert { albedo: t * scale, event: Event::Transmit },
        )
    }

    /// (1 - `amount`) `a` + `amount` `b`, `amount` in [0, 1] (clamped). Beyond [`MAX_LOBES`] the lobes faintest at normal incidence
    /// are dropped: such a surface is too dark, never too bright.
    pub fn mix(a: &Bsdf, b: &Bsdf, amount: f32) -> Bsdf {
        let amount = limited(amount, 1.0);
        let mut bsdf = Bsdf::none();
        let parts = [(a, 1.0 - amount), (b, amount)];
        let needed: usize = parts.iter().filter(|p| p.1 > 0.0).map(|p| p.0.lobes().len()).sum();
        let faintest = if needed > MAX_LOBES { faintest_kept(&parts) } else { 0.0 };
        for (part, weight) in parts {
            if weight == 0.0 {
                continue;
            }
            for lobe in part.lobes() {
                if strength(lobe) * weight >= faintest {
                    bsdf.push(lobe.scaled(weight));
                }
            }
        }
        bsdf
    }

    /// The lobes. Each can be integrated alone; their sum is the whole.
    #[inline]
    pub fn lobes(&self) -> &[Lobe] {
        &self.lobes[..self.count as usize]
    }

    /// Whether some lobe is a delta lobe.
    #[inline]
    pub fn has_delta(&self) -> bool {
        self.delta
    }

    /// Whether some lobe has a finite density.
    #[inline]
    pub fn has_non_delta(&self) -> bool {
        self.smooth > 0
    }

    /// Whether nothing is ever scattered.
    #[inline]
    pub fn is_black(&self) -> bool {
        self.count == 0
    }

    /// The value f, 1/sr, *without* the cosine; delta lobes are left out.
    #[inline]
    pub fn eval(&self, wo: Vec3, wi: Vec3, t: Transport) -> Rgb {
        if let [Lobe(Shape::Lambert { albedo, event: Event::Reflect })] = *self.lobes() {
            return if wo.z * wi.z > 0.0 { albedo * FRAC_1_PI } else { Rgb::BLACK };
        }
        self.eval_lobes(wo, wi, t)
    }

    fn eval_lobes(&self, wo: Vec3, wi: Vec3, t: Transport) -> Rgb {
        let mut sum = Rgb::BLACK;
        if self.smooth == 0 {
            return sum;
        }
        for lobe in self.lobes() {
            sum += lobe.eval(wo, wi, t);
        }
        sum
    }

    /// Density per steradian of [`Bsdf::sample`] over its non-delta outcomes, choice of lobe included.
    #[inline]
    pub fn pdf_solid_angle(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.lobes() {
            _ if self.smooth == 0 => 0.0,
            [Lobe(Shape::Lambert { event: Event::Reflect, .. })] => {
                if wo.z * wi.z > 0.0 {
                    wi.z.abs() * FRAC_1_PI
                } else {
                    0.0
                }
            }
            [only] => only.pdf_solid_angle(wo, wi),
            _ => self.mixture_density(&self.selection(wo), wo, wi),
        }
    }

    /// Samples a direction: a lobe by its estimated albedo with `u_lobe`, a direction in its chart with `u`, both in [0, 1). A rough
    /// dielectric chooses between reflection and refraction by the Fresnel term of the sampled facet. The weight of a non-delta
    /// sample is that of the whole non-delta sum.
    #[inline]
    pub fn sample(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], t: Transport) -> Option<BsdfSample> {
        match self.lobes() {
            [] => None,
            [Lobe(Shape::Lambert { albedo, event })] => directions::sample_cosine(wo, u, *event, |_| *albedo),
            [only] => only.sample_with(wo, u_lobe, u, t),
            _ => self.sample_mixture(wo, u_lobe, u, t),
        }
    }

    fn sample_mixture(&self, wo: Vec3, u_lobe: f32, u: [f32; 2], t: Transport) -> Option<BsdfSample> {
        let selection = self.selection(wo);
        let (index, rest) = self.pick(&selection, u_lobe)?;
        let lobe = &self.lobes[index];
        let p = selection[index];
        let mut sample = if is_leader(lobe) {
            lobe.sample_rough_glass(wo, rest, u, t)?
        } else {
            lobe.sample_with(wo, rest, u, t)?
        };
        sample.lobe = index as u8 + (is_leader(lobe) && sample.transmitted) as u8;
        if sample.delta || self.smooth == 1 {
            // Nothing else leads there.
            sample.weight = sample.weight / p;
            sample.pdf *= p;
        } else {
            let pdf = self.mixture_density(&selection, wo, sample.wi);
            if pdf <= 0.0 {
                return None;
            }
            sample.weight = self.eval(wo, sample.wi, t) * (sample.wi.z.abs() / pdf);
            sample.pdf = pdf;
        }
        Some(sample)
    }

    /// Probability of each lobe; the halves of a rough dielectric carry that of the pair.
    #[inline]
    fn selection(&self, wo: Vec3) -> [f32; MAX_LOBES] {
        let mut p = [0.0; MAX_LOBES];
        let mut total = 0.0;
        for (i, lobe) in self.lobes().iter().enumerate() {
            if is_twin(lobe) {
                p[i] = p[i - 1];
                continue;
            }
            // A floor keeps weights bounded where the estimate is too low.
            let paired = if is_leader(lobe) { lobe.pair_weight() } else { lobe.albedo(wo).mean() };
            p[i] = paired.max(0.01);
            total += p[i];
        }
        p.map(|p| p / total)
    }

    /// The lobe that `u` falls on, and where in it, [0, 1).
    #[inline]
    fn pick(&self, selection: &[f32; MAX_LOBES], u: f32) -> Option<(usize, f32)> {
        let mut below = 0.0;
        let mut last = None;
        for (i, lobe) in self.lobes().iter().enumerate() {
            if is_twin(lobe) {
                continue;
            }
            let rest = (u - below) / selection[i];
            if rest < 1.0 {
                return Some((i, rest.max(0.0)));
            }
            below += selection[i];
            last = Some((i, 1.0 - f32::EPSILON));
        }
        // Rounding may leave u at the end of the last.
        last
    }

    #[inline]
    fn mixture_density(&self, selection: &[f32; MAX_LOBES], wo: Vec3, wi: Vec3) -> f32 {
        let mut sum = 0.0;
        for (lobe, p) in self.lobes().iter().zip(selection) {
            sum += p * lobe.density(wo, wi, true);
        }
        sum
    }

    /// What the diffuse reflection makes of uniform irradiance E on the side of `wo`: it reflects the radiance albedo E / π.
    pub fn diffuse_albedo(&self, wo: Vec3) -> Rgb {
        self.sum_albedo(wo, |lobe| lobe.kind() == LobeClass::Diffuse && !lobe.is_transmissive())
    }

    /// What the radiance that the diffuse lobes send to `wo`, on one side of the surface, is in proportion to, whatever arrives. `None` where there is
    /// none, or where they differ in that.
    #[inline]
    pub(crate) fn diffuse_view(&self, wo: Vec3) -> Option<f32> {
        let mut lobes = self.lobes().iter().filter(|l| l.kind() == LobeClass::Diffuse);
        let first = lobes.next()?;
        if lobes.all(|l| l.is_seen_like(first)) { first.view(wo) } else { None }
    }

    /// [`Bsdf::diffuse_albedo`] for irradiance on the other side.
    pub fn diffuse_transmission_albedo(&self, wo: Vec3) -> Rgb {
        self.sum_albedo(wo, |lobe| lobe.kind() == LobeClass::Diffuse && lobe.is_transmissive())
    }

    /// All outcomes of the delta lobes from local `wo` ([`Lobe::branches`]).
    pub fn branches(&self, wo: Vec3, t: Transport) -> impl Iterator<Item = Branch> + '_ {
        self.lobes().iter().flat_map(move |l| l.branches(wo, t)).flatten()
    }

    /// Directional-hemispherical albedo of everything, as flux: a cheap estimate for Russian roulette and feature buffers, with the
    /// Fresnel term of the mean plane for rough metals and dielectrics.
    pub fn albedo(&self, wo: Vec3) -> Rgb {
        self.sum_albedo(wo, |_| true)
    }

    fn sum_albedo(&self, wo: Vec3, which: impl Fn(&Lobe) -> bool) -> Rgb {
        self.lobes().iter().filter(|lobe| which(lobe)).fold(Rgb::BLACK, |sum, lobe| sum + lobe.albedo(wo))
    }
}

/// The reflecting half of a rough dielectric: the one that is selected for both.
#[inline]
fn is_leader(lobe: &Lobe) -> bool {
    matches!(lobe.0, Shape::RoughGlass { event: Event::Reflect, .. })
}

/// The refracting half of a rough dielectric.
#[inline]
fn is_twin(lobe: &Lobe) -> bool {
    matches!(lobe.0, Shape::RoughGlass { event: Event::Transmit, .. })
}

/// Albedo at normal incidence; that of both for the halves of a rough dielectric, so that they stay together.
fn strength(lobe: &Lobe) -> f32 {
    if is_leader(lobe) || is_twin(lobe) { lobe.pair_weight() } else { lobe.albedo(Vec3::Z).mean() }
}

/// The strength below which lobes have to go so that [`MAX_LOBES`] remain.
fn faintest_kept(parts: &[(&Bsdf, f32); 2]) -> f32 {
    let mut strengths = [0.0f32; 2 * MAX_LOBES];
    let all =
        parts.iter().flat_map(|(bsdf, weight)| bsdf.lobes().iter().map(move |lobe| strength(lobe) * weight));
    for (slot, s) in strengths.iter_mut().zip(all) {
        *slot = s;
    }
    strengths.sort_by(|a, b| b.total_cmp(a));
    // Keep fewer rather than part of a tie: the halves of a rough dielectric are one.
    if strengths[MAX_LOBES] == strengths[MAX_LOBES - 1] {
        strengths[MAX_LOBES - 1].next_up()
    } else {
        strengths[MAX_LOBES - 1]
    }
}
