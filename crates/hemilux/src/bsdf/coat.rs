//! What a dielectric coat lets through, and what comes back under it.
//!
//! **Smooth coat**: exact Fresnel terms.
//!
//! **Rough coat**: single scattering by its GGX facets reflects the albedo R(μ); everything else is taken as transmitted,
//! T(μ) = 1 - R(μ), so that a coat over a lossless base loses nothing (the light that the reflection lobe loses by multiple
//! scattering goes to the base). R - F, F the Fresnel term of the plane, is tabulated over (√μ, ∛α, η) and interpolated
//! linearly; it vanishes with α and with η → 1.
//!
//! **Coat over a rough metal**: light refracts in, is reflected by the metal, and is partly returned to it by the coat. For a
//! metal with Fresnel term 1 the directional albedo x of that stack (without the coat's own reflection) is found by solving
//! x = B T + B P x, where B scatters by the facets of the metal (single scattering, with its loss) and P is the coat's internal
//! reflection, 1 - T within the critical cone. The lobe is T(o) T(i) f(o', i') / η² times a geometric series F / (1 - F s) of which s(o, i) = 1 - q(o) q(i) is
//! *the* ratio of this form that gives a white metal exactly the albedo x: symmetric scaling of the kernel (R. Sinkhorn, 1964).
//! So the lobe is reciprocal, right in energy for white metals, never gains any for others, and tends to the plane stack,
//! s = R, for a smooth metal. q is tabulated like R, for each of the tabulated roughnesses of the coat. Only the azimuthal mean of the kernel matters for x and q.
//!
//! Tables are made line by line at first use, the same on every run: a material touches four lines of each, 1 to 3 ms a line.
//! Interpolation and quadrature leave errors of up to 0.01 of albedo at grazing angles and 0.001 elsewhere (tests print them).

use super::fresnel;
use super::ggx::Ggx;
use hemiquad::map::{Dir, GgxVisible, Map, disk_to_square};
use std::sync::OnceLock;

/// Largest index of a coat that scatters by its own or its base's roughness.
pub(super) const ETA_MAX: f32 = 3.0;

const MU: usize = 20;
const ALPHA: usize = 20;
const ETA: usize = 13;
/// Facets for one tabulated albedo, and for one row of a scattering kernel.
const FACETS: usize = 1024;
const KERNEL_FACETS: usize = 512;

/// Tables over (μ, α, η) on grids uniform in √μ, ∛α and η, one for each of some roughnesses of the coat. A line over μ is made
/// when first asked for.
struct Grid<const LINES: usize> {
    lines: [OnceLock<Line>; LINES],
    /// The values over μ at a roughness of the coat, an α and an η.
    make: fn(f64, f64, f64) -> [f64; MU],
}

/// Values at the nodes of μ, and 2 ∫ f(μ) μ dμ of what lies linearly (in √μ) between them.
struct Line {
    nodes: [f32; MU],
    mean: f32,
}

/// R - F of a rough interface of roughness α.
static EXCESS: Grid<{ ALPHA * ETA }> =
    Grid { lines: [const { OnceLock::new() }; ALPHA * ETA], make: |_, alpha, eta| excess_line(alpha, eta) };

/// q of the interreflection between a coat and a metal of roughness α.
static INTERREFLECTION: Grid<{ ALPHA * ALPHA * ETA }> =
    Grid { lines: [const { OnceLock::new() }; ALPHA * ALPHA * ETA], make: interreflection_line };

/// Position on one axis: cell and fraction.
#[derive(Clone, Copy)]
struct At(usize, f32);

impl At {
    /// `x` in [0, 1] on an axis of `n` nodes.
    #[inline]
    fn new(x: f32, n: usize) -> At {
        let x = x.clamp(0.0, 1.0) * (n - 1) as f32;
        let cell = (x as usize).min(n - 2);
        At(cell, x - cell as f32)
    }
}

#[inline]
fn mu_at(mu: f32) -> At {
    At::new(mu.max(0.0).sqrt(), MU)
}

/// What a roughness is looked up by: ∛α, computed once where it can be.
#[inline]
pub(super) fn alpha_coordinate(alpha: f32) -> f32 {
    alpha.min(1.0).cbrt()
}

#[inline]
fn eta_at(eta: f32) -> At {
    At::new((eta - 1.0) / (ETA_MAX - 1.0), ETA)
}

fn mu_node(i: usize) -> f64 {
    let x = i as f64 / (MU - 1) as f64;
    x * x
}

fn alpha_node(i: usize) -> f64 {
    let x = i as f64 / (ALPHA - 1) as f64;
    x * x * x
}

fn eta_node(i: usize) -> f64 {
    1.0 + (ETA_MAX as f64 - 1.0) * i as f64 / (ETA - 1) as f64
}

impl<const LINES: usize> Grid<LINES> {
    /// The value at `mu`, or the mean over μ.
    #[inline]
    fn at(&self, coat: usize, mu: Option<At>, alpha: At, eta: At) -> f32 {
        let line = |a: usize, e: usize| {
            let line = self.line(coat, alpha.0 + a, eta.0 + e);
            match mu {
                Some(mu) => line.nodes[mu.0] + (line.nodes[mu.0 + 1] - line.nodes[mu.0]) * mu.1,
                None => line.mean,
            }
        };
        let plane = |e: usize| {
            let (low, high) = (line(0, e), line(1, e));
            low + (high - low) * alpha.1
        };
        let (low, high) = (plane(0), plane(1));
        low + (high - low) * eta.1
    }

    #[inline]
    fn line(&self, coat: usize, alpha: usize, eta: usize) -> &Line {
        self.lines[(coat * ETA + eta) * ALPHA + alpha].get_or_init(|| {
            let nodes = (self.make)(alpha_node(coat), alpha_node(alpha), eta_node(eta));
            Line { nodes: nodes.map(|v| v as f32), mean: mean_over_mu(&nodes) as f32 }
        })
    }
}

/// 2 μ dμ = 4 x³ dx with x = √μ; Gauss's three points are exact for a line times x³.
fn mean_over_mu(nodes: &[f64; MU]) -> f64 {
    let cells = (MU - 1) as f64;
    let mut sum = 0.0;
    for (cell, ends) in nodes.windows(2).enumerate() {
        for (at, weight) in
            [(0.112_701_665_379_258, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_742, 5.0 / 18.0)]
        {
            let x = (cell as f64 + at) / cells;
            sum += weight / cells * 4.0 * x * x * x * (ends[0] + (ends[1] - ends[0]) * at);
        }
    }
    sum
}

fn excess_line(alpha: f64, eta: f64) -> [f64; MU] {
    if alpha == 0.0 {
        return [0.0; MU];
    }
    std::array::from_fn(|i| {
        let f = |cos: f64| fresnel::dielectric(cos as f32, eta as f32) as f64;
        let mut reflected = 0.0;
        each_facet(mu_node(i), alpha, FACETS, |cos_h, _, weight| reflected += weight * f(cos_h));
        reflected - f(mu_node(i))
    })
}

/// Calls `f` with (wo·h, cos θi, weight) for `count` visible normals of an isotropic surface seen at cosine `mu`: the weights are
/// G2/G1 times what each stands for, so that they sum to the albedo of a perfectly reflecting GGX surface. Hammersley's points on
/// the disk, drawn towards its rim, where the long tail of GGX lives: area 1 - (1 - s)³ lies within s.
fn each_facet(mu: f64, alpha: f64, count: usize, mut f: impl FnMut(f64, f64, f64)) {
    let sin = (1.0 - mu * mu).max(0.0).sqrt();
    let Some(map) = GgxVisible::<f64>::new(Dir::from_unit(sin, 0.0, mu), alpha, alpha) else { return };
    let stretch = |cos: f64| (cos * cos + alpha * alpha * (1.0 - cos * cos).max(0.0)).sqrt();
    let so = stretch(mu);
    for i in 0..count {
        let s = (i as f64 + 0.5) / count as f64;
        let phi =
            ((i as u32).reverse_bits() as f64 / 4_294_967_296.0 + 0.5 / count as f64) * std::f64::consts::TAU;
        let (area, density) = (1.0 - (1.0 - s).powi(3), 3.0 * (1.0 - s).powi(2) / count as f64);
        let radius = area.sqrt();
        let Some(at) = disk_to_square(radius * phi.cos(), radius * phi.sin()) else { continue };
        let h = map.dir(at);
        let cos_h = sin * h.x + mu * h.z;
        let cos_i = 2.0 * cos_h * h.z - mu;
        if cos_i > 0.0 {
            let shadowing = cos_i * (mu + so) / (cos_i * so + mu * stretch(cos_i));
            f(cos_h, cos_i, shadowing * density);
        }
    }
}

/// The coat of a layered lobe as its transmission needs it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Coat {
    /// Index of the coat relative to the outside.
    pub eta: f32,
    /// ∛ of the isotropic roughness; 0 for a smooth coat.
    alpha: f32,
}

impl Coat {
    /// A coat with the index limited to what the tables hold if it is rough.
    pub fn new(eta: f32, alpha: Ggx) -> Coat {
        if alpha.is_smooth() {
            Coat { eta, alpha: 0.0 }
        } else {
            Coat { eta: eta.clamp(1.0, ETA_MAX), alpha: alpha_coordinate(alpha.mean()) }
        }
    }

    /// T(μ): the part of light arriving from outside at cosine `mu` > 0 that enters.
    #[inline]
    pub fn transmittance(self, mu: f32) -> f32 {
        let plane = 1.0 - fresnel::dielectric(mu, self.eta);
        if self.alpha == 0.0 {
            return plane;
        }
        let excess = EXCESS.at(0, Some(mu_at(mu)), At::new(self.alpha, ALPHA), eta_at(self.eta));
        (plane - excess).clamp(0.0, 1.0)
    }

    /// 2 ∫ T(μ) μ dμ.
    pub fn mean_transmittance(self) -> f32 {
        let plane = 1.0 - fresnel::mean_dielectric(self.eta);
        if self.alpha == 0.0 {
            return plane;
        }
        plane - EXCESS.at(0, None, At::new(self.alpha, ALPHA), eta_at(self.eta))
    }

    /// q(μ) of the interreflection with a metal of [`alpha_coordinate`] `base` below (module text), for light outside at cosine
    /// `mu` > 0.
    #[inline]
    pub fn interreflection(self, mu: f32, base: f32) -> f32 {
        let (mu, base, eta) = (mu_at(mu), At::new(base, ALPHA), eta_at(self.eta));
        let of_coat = |i: usize| INTERREFLECTION.at(i, Some(mu), base, eta);
        let coat = At::new(self.alpha, ALPHA);
        let low = of_coat(coat.0);
        let q = if coat.1 == 0.0 { low } else { low + (of_coat(coat.0 + 1) - low) * coat.1 };
        q.clamp(1e-3, 1.0)
    }
}

/// Nodes of the internal hemisphere: the outside's seen through the coat, then as many between the critical angle and grazing.
const INSIDE: usize = 2 * MU - 1;

fn interreflection_line(coat_alpha: f64, alpha: f64, eta: f64) -> [f64; MU] {
    let coat = Coat { eta: eta as f32, alpha: coat_alpha.cbrt() as f32 };
    let reflected = |mu: f64| 1.0 - coat.transmittance(mu as f32) as f64;
    let mu_inside = |mu: f64| (1.0 - (1.0 - mu * mu) / (eta * eta)).max(0.0).sqrt();
    if eta == 1.0 {
        return [1.0; MU];
    }
    if alpha == 0.0 {
        // A mirror below: s = R.
        return std::array::from_fn(|i| (1.0 - reflected(mu_node(i))).sqrt());
    }
    // Scatter from every node; a direction between nodes counts for both.
    let critical = mu_inside(0.0);
    let mut leaving = [[0.0; MU]; INSIDE];
    let mut returning = [[0.0; INSIDE]; INSIDE];
    for row in 0..INSIDE {
        let mu = if row < MU {
            mu_inside(mu_node(row))
        } else {
            critical * (2 * MU - 2 - row) as f64 / (MU - 1) as f64
        };
        each_facet(mu, alpha, KERNEL_FACETS, |_, cos_i, weight| {
            let outside2 = 1.0 - (1.0 - cos_i * cos_i) * eta * eta;
            if outside2 > 0.0 {
                let cos_out = outside2.sqrt();
                let reflected = reflected(cos_out);
                let At(i, f) = mu_at(cos_out as f32);
                for (node, part) in [(i, 1.0 - f as f64), (i + 1, f as f64)] {
                    leaving[row][node] += weight * part * (1.0 - reflected);
                    returning[row][node] += weight * part * reflected;
                }
            } else {
                // Node 0 is the critical angle, nodes MU.. go from there to grazing.
                let At(i, f) = At::new((1.0 - cos_i / critical) as f32, MU);
                for (node, part) in [(i, 1.0 - f as f64), (i + 1, f as f64)] {
                    returning[row][if node == 0 { 0 } else { MU - 1 + node }] += weight * part;
                }
            }
        });
    }
    // x = B T + B P x.
    let direct: [f64; INSIDE] = std::array::from_fn(|row| leaving[row].iter().sum());
    let mut x = direct;
    for _ in 0..200 {
        x = std::array::from_fn(|row| {
            direct[row] + (0..INSIDE).map(|j| returning[row][j] * x[j]).sum::<f64>()
        });
    }
    // g with g_i Σ_j leaving_ij g_j = x_i.
    let mut g = [1.0; MU];
    for _ in 0..60 {
        let sums: [f64; MU] = std::array::from_fn(|i| (0..MU).map(|j| leaving[i][j] * g[j]).sum());
        for i in 0..MU {
            g[i] = (g[i] * x[i] / sums[i].max(1e-12)).sqrt();
        }
    }
    g.map(|g| 1.0 / g)
}
