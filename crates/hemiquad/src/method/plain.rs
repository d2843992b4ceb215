//! Methods that do not adapt: jittered, scrambled Sobol' of order one and two, product Gauss rules.

use super::{Method, Workspace, evaluate, gap_of};
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Probe};
use crate::map::{Concentric, Dir, Map, Uv};
use crate::points::{Key, interlaced, jittered_f64, sobol_f64};
use crate::value::Value;
use std::f64::consts::PI;

/// Reusable memory of plain methods is that of the drawing; this is a batch of probes.
const BATCH: usize = 128;

/// Jittered sampling: one uniform point in each cell of a grid of ⌊√n⌋ columns (R. Cook 1986). Unbiased. The standard error
/// takes neighbouring cells in pairs, which errs on the safe side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Jittered;

impl<V: Value> Method<V> for Jittered {
    fn name(&self) -> &'static str {
        "Jittered"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let nx = budget.max(1).isqrt();
        let ny = budget.max(1) / nx;
        let n = nx * ny;
        let state = &mut work.refine;
        state.values.clear();
        let mut probes = [Probe::default(); BATCH];
        let mut first = 0;
        work.draw.start();
        while first < n {
            let m = (n - first).min(BATCH as u32);
            for k in 0..m {
                // There and back again, so that consecutive cells touch.
                let (x, y) = ((first + k) % nx, (first + k) / nx);
                let x = if y % 2 == 0 { x } else { nx - 1 - x };
                let p = jittered_f64(y * nx + x, nx, ny, key);
                probes[k as usize] = Probe::at(p);
                work.draw.points.push(p);
            }
            evaluate(f, &probes[..m as usize], &mut state.values);
            first += m;
        }
        let mut pairs = Pairs::new();
        let k = 2.0 / n as f64;
        for pair in state.values.chunks(2) {
            match *pair {
                [a, b] => pairs.add(a.times(k), b.times(k)),
                [a] => pairs.add_exact(a.times(0.5 * k)),
                _ => {}
            }
        }
        let unexplored = gap_of(&mut work.draw.gap, &work.draw.points);
        let error = (n > 1).then(|| pairs.std_error());
        let evaluations = Evaluations { pilot: 0, estimate: n };
        Estimate::new(pairs.sum, error, pairs.degrees_of_freedom(), evaluations, unexplored, false)
    }
}

/// Owen-scrambled Sobol' points in eight independent replicates, which give the standard error (7 degrees of freedom). Unbiased.
/// Error n^-1.5 √log n on smooth integrands (A. Owen 1997).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sobol;

/// Interlaced Sobol' points of order two (J. Dick 2011; [`points::interlaced`](crate::points::interlaced)) in four independent
/// replicates, which give the standard error (3 degrees of freedom: the steeper the error falls, the dearer are replicates).
/// Unbiased. Error n^-2.5 but for logarithms where the integrand has two derivatives in each coordinate; like [`Sobol`] where it has kinks
/// or jumps, and on a few hundred samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Interlaced;

impl<V: Value> Method<V> for Sobol {
    fn name(&self) -> &'static str {
        "Sobol'"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        replicated::<V, 8>(sobol_f64, f, budget, key, work)
    }
}

impl<V: Value> Method<V> for Interlaced {
    fn name(&self) -> &'static str {
        "Interlaced Sobol'"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        replicated::<V, 4>(interlaced, f, budget, key, work)
    }
}

/// The mean over `R` independently scrambled nets, and their spread.
fn replicated<V: Value, const R: usize>(
    point: impl Fn(u32, Key) -> Uv<f64>,
    f: &mut dyn Integrand<V>,
    budget: u32,
    key: Key,
    work: &mut Workspace<V>,
) -> Estimate<V> {
    let n = (budget / R as u32).max(1);
    let mut means = [V::default(); R];
    let mut probes = [Probe::default(); BATCH];
    let mut values = [V::default(); BATCH];
    work.draw.start();
    for (r, mean) in means.iter_mut().enumerate() {
        let key = key.with(r as u64);
        let mut first = 0;
        while first < n {
            let m = (n - first).min(BATCH as u32);
            for k in 0..m {
                let p = point(first + k, key);
                probes[k as usize] = Probe::at(p);
                work.draw.points.push(p);
            }
            f.eval(&probes[..m as usize], &mut values[..m as usize]);
            for v in &values[..m as usize] {
                *mean = mean.plus(v.times(1.0 / n as f64));
            }
            first += m;
        }
    }
    let r = R as f64;
    let value = means.iter().fold(V::default(), |s, m| s.plus(m.times(1.0 / r)));
    let variance = means
        .iter()
        .fold(V::default(), |s, m| s.plus(m.zip(value, |a, b| (a - b) * (a - b) / (r * (r - 1.0)))));
    let unexplored = gap_of(&mut work.draw.gap, &work.draw.points);
    let evaluations = Evaluations { pilot: 0, estimate: n * R as u32 };
    Estimate::new(value, Some(variance.each(f64::sqrt)), r - 1.0, evaluations, unexplored, false)
}

/// Where a product rule lives.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProductRule {
    /// Gauss–Legendre in u and in v.
    Square,
    /// Gauss–Legendre in cos θ and the trapezoidal rule in φ (turned at random), on the hemisphere behind the square
    /// ([`Concentric`]): exact for spherical harmonics up to degree about √(2n).
    #[default]
    Hemisphere,
}

/// Product Gauss rules. Deterministic but for a turn: *biased*, without a standard error, and unbeatable where the integrand is
/// smooth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ProductGauss {
    /// On the square or on the hemisphere.
    pub rule: ProductRule,
}

impl<V: Value> Method<V> for ProductGauss {
    fn name(&self) -> &'static str {
        match self.rule {
            ProductRule::Square => "ProductGauss square",
            ProductRule::Hemisphere => "ProductGauss hemisphere",
        }
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        // A rule of m × m on the square; m in cos θ and 2m in φ on the hemisphere.
        let budget = budget.max(1);
        let (m, k) = match self.rule {
            ProductRule::Square => (budget.isqrt(), budget.isqrt()),
            ProductRule::Hemisphere => {
                let m = (budget / 2).isqrt().max(1);
                (m, budget / m)
            }
        };
        let (m, k) = (m.min(128), k.max(1));
        let mut node = [(0.0, 0.0); 128];
        gauss_legendre(&mut node[..m as usize]);
        let mut other = [(0.0, 0.0); 128];
        if self.rule == ProductRule::Square {
            other = node;
        }
        let k = if self.rule == ProductRule::Square { m } else { k };
        let turn = key.uniform64(0);
        let mut value = V::default();
        let mut probes = [Probe::default(); BATCH];
        let mut weights = [0.0; BATCH];
        let mut values = [V::default(); BATCH];
        work.draw.start();
        let (n, mut first) = (m * k, 0);
        while first < n {
            let size = (n - first).min(BATCH as u32);
            for b in 0..size {
                let (i, j) = ((first + b) / k, (first + b) % k);
                let (x, w) = node[i as usize];
                let (uv, w) = match self.rule {
                    ProductRule::Square => {
                        let (y, v) = other[j as usize];
                        (Uv::new(x, y), w * v)
                    }
                    ProductRule::Hemisphere => {
                        let (s, c) = (2.0 * PI * (j as f64 + turn) / k as f64).sin_cos();
                        let sin = ((1.0 - x) * (1.0 + x)).sqrt();
                        let uv =
                            Concentric.uv(Dir::from_unit(sin * c, sin * s, x)).unwrap_or(Uv::new(0.5, 0.5));
                        (uv, w / k as f64)
                    }
                };
                probes[b as usize] = Probe::at(uv);
                weights[b as usize] = w;
                work.draw.points.push(uv);
            }
            let size = size as usize;
            f.eval(&probes[..size], &mut values[..size]);
            for (v, w) in values[..size].iter().zip(&weights) {
                value = value.plus(v.times(*w));
            }
            first += size as u32;
        }
        let unexplored = gap_of(&mut work.draw.gap, &work.draw.points);
        Estimate::new(value, None, 1.0, Evaluations { pilot: 0, estimate: n }, unexplored, true)
    }
}

/// Nodes and weights of the Gauss–Legendre rule on [0, 1], by Newton's method on the Legendre polynomial.
fn gauss_legendre(rule: &mut [(f64, f64)]) {
    let n = rule.len();
    for (i, out) in rule.iter_mut().enumerate() {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..20 {
            let (mut p, mut q) = (1.0, 0.0);
            for j in 0..n {
                let j = j as f64;
                (p, q) = (((2.0 * j + 1.0) * x * p - j * q) / (j + 1.0), p);
            }
            slope = n as f64 * (x * p - q) / (x * x - 1.0);
            let step = p / slope;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        *out = (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gauss_rules_are_exact_to_degree_2n_minus_1() {
        for n in [1usize, 2, 5, 16, 64] {
            let mut rule = vec![(0.0, 0.0); n];
            gauss_legendre(&mut rule);
            for degree in [0, 1, 2 * n - 1] {
                let sum: f64 = rule.iter().map(|(x, w)| w * x.powi(degree as i32)).sum();
                assert!((sum * (degree + 1) as f64 - 1.0).abs() < 1e-12, "{n} {degree} {sum}");
            }
        }
    }
}
