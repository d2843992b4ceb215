//! Adaptive cubature with an honest end: the degree-7 rule of A. Genz and A. Malik ("Remarks on algorithm 006", 1980) refines
//! rectangles in a heap by the error between its embedded rules; its 17 values per rectangle fit a polynomial, which is
//! integrated exactly; fresh random samples integrate what the polynomials leave. Unbiased, unlike every deterministic cubature.

use super::draw::Placed;
use super::{Method, Workspace, evaluate};
use crate::curve;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Probe, Size, Stage};
use crate::map::Uv;
use crate::points::Key;
use crate::value::Value;
use std::collections::BinaryHeap;
use std::sync::OnceLock;

/// Nodes of the rule in two dimensions.
const NODES: usize = 17;
/// Polynomial terms: all of total degree ≤ 4, with x³y and xy³ (which the nodes cannot tell apart) as their sum.
const TERMS: usize = 14;

/// The nodes on [-1, 1]².
fn nodes() -> [(f64, f64); NODES] {
    let (a, b, c) = ((9.0f64 / 70.0).sqrt(), (0.9f64).sqrt(), (9.0f64 / 19.0).sqrt());
    [
        (0.0, 0.0),
        (a, 0.0),
        (-a, 0.0),
        (0.0, a),
        (0.0, -a),
        (b, 0.0),
        (-b, 0.0),
        (0.0, b),
        (0.0, -b),
        (b, b),
        (-b, b),
        (b, -b),
        (-b, -b),
        (c, c),
        (-c, c),
        (c, -c),
        (-c, -c),
    ]
}

/// Weights of the five orbits, for the mean over the square: degree 7 and embedded degree 5 (n = 2).
const DEGREE7: [f64; 5] =
    [-3816.0 / 19683.0, 980.0 / 6561.0, 1020.0 / 19683.0, 200.0 / 19683.0, 6859.0 / 19683.0 / 4.0];
const DEGREE5: [f64; 5] = [-971.0 / 729.0, 245.0 / 486.0, 65.0 / 1458.0, 25.0 / 729.0, 0.0];

fn orbit(i: usize) -> usize {
    [0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4][i]
}

fn terms(x: f64, y: f64) -> [f64; TERMS] {
    let (x2, y2) = (x * x, y * y);
    let (x3, y3) = (x2 * x, y2 * y);
    [1.0, x, y, x2, x * y, y2, x3, x2 * y, x * y2, y3, x2 * x2, x * y * (x2 + y2), x2 * y2, y2 * y2]
}

/// Means of the terms over [-1, 1]².
const MEANS: [f64; TERMS] =
    [1.0, 0.0, 0.0, 1.0 / 3.0, 0.0, 1.0 / 3.0, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 1.0 / 9.0, 0.2];

/// The matrix that carries the 17 values to the coefficients of the least-squares polynomial: (TᵀT)⁻¹Tᵀ.
fn fitting() -> &'static [[f64; NODES]; TERMS] {
    static MATRIX: OnceLock<[[f64; NODES]; TERMS]> = OnceLock::new();
    MATRIX.get_or_init(|| {
        let t = nodes().map(|(x, y)| terms(x, y));
        // Gauss–Jordan on the normal equations, with Tᵀ as right-hand sides.
        let mut m = [[0.0; TERMS + NODES]; TERMS];
        for i in 0..TERMS {
            for j in 0..TERMS {
                m[i][j] = t.iter().map(|r| r[i] * r[j]).sum();
            }
            for k in 0..NODES {
                m[i][TERMS + k] = t[k][i];
            }
        }
        for c in 0..TERMS {
            let pivot = (c..TERMS).max_by(|a, b| m[*a][c].abs().total_cmp(&m[*b][c].abs())).unwrap_or(c);
            m.swap(c, pivot);
            let d = m[c][c];
            m[c].iter_mut().for_each(|x| *x /= d);
            let row = m[c];
            for (r, other) in m.iter_mut().enumerate() {
                let k = other[c];
                if r != c && k != 0.0 {
                    other.iter_mut().zip(row).for_each(|(x, y)| *x -= k * y);
                }
            }
        }
        std::array::from_fn(|i| std::array::from_fn(|k| m[i][TERMS + k]))
    })
}

#[derive(Clone, Copy, Debug)]
struct Rect<V> {
    low: Uv<f64>,
    size: Uv<f64>,
    coefficients: [V; TERMS],
    /// Root mean square of what the polynomial leaves at the nodes, and the rule's own error, per unit of area.
    spread: f64,
    error: f64,
    /// Halve along u?
    along_u: bool,
}

/// Reusable memory.
#[derive(Debug)]
pub(crate) struct Regions<V> {
    rects: Vec<Rect<V>>,
    heap: BinaryHeap<(u64, u32)>,
    end: Vec<f64>,
    density: Vec<f64>,
    values: Vec<V>,
}

impl<V> Default for Regions<V> {
    fn default() -> Self {
        Regions {
            rects: Vec::new(),
            heap: BinaryHeap::new(),
            end: Vec::new(),
            density: Vec::new(),
            values: Vec::new(),
        }
    }
}

/// The heap of rectangles, then residual Monte Carlo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GenzMalik {
    /// Share of the budget for the rule's nodes, in (0, 1); the rest samples the residual.
    pub pilot: f64,
    /// Share of the residual samples that is spread by area whatever the errors say, in (0, 1].
    pub defensive: f64,
}

impl Default for GenzMalik {
    fn default() -> Self {
        GenzMalik { pilot: 0.5, defensive: 0.3 }
    }
}

impl<V: Value> Regions<V> {
    fn measure(&mut self, f: &mut dyn Integrand<V>, low: Uv<f64>, size: Uv<f64>) -> Rect<V> {
        let at = nodes().map(|(x, y)| {
            let uv = Uv::new(low.u + size.u * 0.5 * (x + 1.0), low.v + size.v * 0.5 * (y + 1.0));
            Probe { uv, stage: Stage::Pilot, size: Size::True }
        });
        self.values.clear();
        evaluate(f, &at, &mut self.values);
        let fitting = fitting();
        let mut coefficients = [V::default(); TERMS];
        for (c, row) in coefficients.iter_mut().zip(fitting) {
            *c = self.values.iter().zip(row).fold(V::default(), |s, (v, k)| s.plus(v.times(*k)));
        }
        let rect = Rect { low, size, coefficients, spread: 0.0, error: 0.0, along_u: true };
        let drive: Vec17 = std::array::from_fn(|i| self.values[i].drive());
        let rest: f64 =
            at.iter().zip(&self.values).map(|(p, v)| v.minus(rect.at(p.uv)).drive().powi(2)).sum();
        let rule = |w: &[f64; 5]| -> f64 { (0..NODES).map(|i| w[orbit(i)] * drive[i]).sum() };
        let error = (rule(&DEGREE7) - rule(&DEGREE5)).abs();
        // Fourth differences say along which side the integrand bends most (Genz and Malik).
        let bend = |i: usize| {
            let second = |k: usize| drive[k] + drive[k + 1] - 2.0 * drive[0];
            (second(i) - second(i + 4) / 7.0).abs()
        };
        let (bu, bv) = (bend(1), bend(3));
        let along_u = if (bu - bv).abs() <= 1e-10 * (bu + bv) { size.u >= size.v } else { bu > bv };
        Rect { spread: (rest / (NODES - TERMS) as f64).sqrt(), error, along_u, ..rect }
    }

    fn push(&mut self, rect: Rect<V>, at: usize) {
        let priority = rect.error * rect.size.u * rect.size.v;
        if at < self.rects.len() {
            self.rects[at] = rect;
        } else {
            self.rects.push(rect);
        }
        // Rectangles without error still come up in time: their area decides.
        let priority = priority + 1e-9 * rect.size.u * rect.size.v;
        self.heap.push((priority.to_bits(), at as u32));
    }
}

type Vec17 = [f64; NODES];

impl<V: Value> Rect<V> {
    fn at(&self, p: Uv<f64>) -> V {
        let x = 2.0 * (p.u - self.low.u) / self.size.u - 1.0;
        let y = 2.0 * (p.v - self.low.v) / self.size.v - 1.0;
        self.coefficients.iter().zip(terms(x, y)).fold(V::default(), |s, (c, t)| s.plus(c.times(t)))
    }

    fn area(&self) -> f64 {
        self.size.u * self.size.v
    }

    fn integral(&self) -> V {
        let mean = self.coefficients.iter().zip(MEANS).fold(V::default(), |s, (c, t)| s.plus(c.times(t)));
        mean.times(self.area())
    }
}

impl<V: Value> Method<V> for GenzMalik {
    fn name(&self) -> &'static str {
        "GenzMalik + residual"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let most = (budget as f64 * self.pilot.clamp(0.0, 0.95)) as u32;
        let state = &mut work.cubature;
        state.rects.clear();
        state.heap.clear();
        let mut pilot = NODES as u32;
        let whole = state.measure(f, Uv::new(0.0, 0.0), Uv::new(1.0, 1.0));
        state.push(whole, 0);
        while pilot + 2 * NODES as u32 <= most {
            let Some((_, i)) = state.heap.pop() else { break };
            let r = state.rects[i as usize];
            let (size, step) = if r.along_u {
                (Uv::new(0.5 * r.size.u, r.size.v), Uv::new(0.5 * r.size.u, 0.0))
            } else {
                (Uv::new(r.size.u, 0.5 * r.size.v), Uv::new(0.0, 0.5 * r.size.v))
            };
            let a = state.measure(f, r.low, size);
            let b = state.measure(f, Uv::new(r.low.u + step.u, r.low.v + step.v), size);
            state.push(a, i as usize);
            let next = state.rects.len();
            state.push(b, next);
            pilot += 2 * NODES as u32;
        }
        // The residual is sampled where the polynomials and the rules disagree, with a defensive share by area.
        let wanted = |r: &Rect<V>| r.area() * (r.spread + r.error);
        let total: f64 = state.rects.iter().map(wanted).sum();
        let d = self.defensive.clamp(0.01, 1.0);
        state.end.clear();
        state.density.clear();
        let (mut sum, mut exact) = (0.0, V::default());
        for r in &state.rects {
            let share = if total > 0.0 { d * r.area() + (1.0 - d) * wanted(r) / total } else { r.area() };
            sum += share;
            state.end.push(sum);
            state.density.push(share / r.area());
            exact = exact.plus(r.integral());
        }
        let (rects, end, density) = (&state.rects, &state.end, &state.density);
        let place = |t: f64| {
            let t = t * sum;
            let i = end.partition_point(|e| *e <= t).min(end.len() - 1);
            let from = if i == 0 { 0.0 } else { end[i - 1] };
            let r = &rects[i];
            let p = curve::at((t - from) / (end[i] - from));
            let uv = Uv::new(r.low.u + p.u * r.size.u, r.low.v + p.v * r.size.v);
            Some(Placed { uv, weight: sum / density[i], cell: i as u32 })
        };
        let post = |v: V, p: &Placed| v.minus(rects[p.cell as usize].at(p.uv));
        let mut pairs = Pairs::new();
        pairs.add_exact(exact);
        work.draw.start();
        let strata = (budget.saturating_sub(pilot) / 2).max(1);
        let estimate = work.draw.pairs(f, strata, key, place, post, &mut pairs);
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot, estimate };
        Estimate::new(
            pairs.sum,
            Some(pairs.std_error()),
            pairs.degrees_of_freedom(),
            evaluations,
            unexplored,
            false,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_have_their_degrees() {
        let mean =
            |i: i32, j: i32| if i % 2 == 0 && j % 2 == 0 { 1.0 / ((i + 1) * (j + 1)) as f64 } else { 0.0 };
        for (weights, degree) in [(DEGREE7, 7), (DEGREE5, 5)] {
            let mut broken = false;
            for i in 0..=degree + 1 {
                for j in 0..=degree + 1 - i {
                    let sum: f64 = nodes()
                        .iter()
                        .enumerate()
                        .map(|(k, (x, y))| weights[orbit(k)] * x.powi(i) * y.powi(j))
                        .sum();
                    let wrong = (sum - mean(i, j)).abs() > 1e-13;
                    assert!(!(wrong && i + j <= degree), "x^{i} y^{j}");
                    broken |= wrong;
                }
            }
            assert!(broken, "degree {} ends somewhere", degree);
        }
    }

    #[test]
    fn the_fit_reproduces_its_polynomials() {
        let mut state = Regions::<f64>::default();
        let c: [f64; TERMS] = std::array::from_fn(|i| (i as f64 * 0.7).sin());
        let f = |u: f64, v: f64| {
            c.iter().zip(terms(2.0 * u - 1.0, 2.0 * v - 1.0)).map(|(a, b)| a * b).sum::<f64>()
        };
        let mut integrand = |p: &Probe| f(p.uv.u, p.uv.v);
        let r = state.measure(&mut integrand, Uv::new(0.0, 0.0), Uv::new(1.0, 1.0));
        assert!((r.at(Uv::new(0.3, 0.8)) - f(0.3, 0.8)).abs() < 1e-12 && r.spread < 1e-12);
    }
}
