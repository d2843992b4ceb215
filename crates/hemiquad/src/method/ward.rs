//! Adaptive shadow testing: G. Ward, "Adaptive shadow testing for ray tracing", 1991.

use super::draw::Placed;
use super::known::{Region, mixture, outside};
use super::{Method, Workspace};
use crate::curve;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::Integrand;
use crate::points::Key;
use crate::value::Value;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// How visible each luminaire has been so far: sums of tested potential and of what came through, in parts per million.
#[derive(Debug, Default)]
pub struct History {
    tested: Vec<AtomicU64>,
    seen: Vec<AtomicU64>,
}

impl History {
    /// For this many luminaires.
    pub fn new(luminaires: usize) -> Self {
        let zeros = || (0..luminaires).map(|_| AtomicU64::new(0)).collect();
        History { tested: zeros(), seen: zeros() }
    }

    fn record(&self, i: usize, visible: f64) {
        if let (Some(t), Some(s)) = (self.tested.get(i), self.seen.get(i)) {
            t.fetch_add(1_000_000, Relaxed);
            s.fetch_add((visible.clamp(0.0, 1.0) * 1e6) as u64, Relaxed);
        }
    }

    /// The mean visibility of a luminaire, if it was ever tested.
    pub fn visibility(&self, i: usize) -> Option<f64> {
        let t = self.tested.get(i)?.load(Relaxed);
        (t > 0).then(|| self.seen[i].load(Relaxed) as f64 / t as f64)
    }
}

/// Sorts luminaires by the contribution each would make if nothing were in the way, tests them in that order, and stops when
/// the rest could not matter; the rest is taken at its mean visibility so far. *Biased* by visibilities that differ from their
/// past. Two shadow rays per tested luminaire at least; the budget's other half goes to everything else.
#[derive(Clone, Copy, Debug)]
pub struct WardShadows<'a> {
    /// The luminaires; `weight` is the unoccluded contribution, in the unit of the integral.
    pub luminaires: &'a [Region],
    /// Stop when the untested potential is below this part of what was found: 0 tests all of them.
    pub tolerance: f64,
    /// What earlier calls have learnt.
    pub history: &'a History,
}

impl<V: Value> Method<V> for WardShadows<'_> {
    fn name(&self) -> &'static str {
        "WardShadows"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let n = self.luminaires.len();
        let mut pairs = Pairs::new();
        work.draw.start();
        let mut order = std::mem::take(&mut work.trained.order);
        order.clear();
        order.extend(0..n as u32);
        // Indices break ties, so that an unstable sort (which needs no memory) gives one result.
        order.sort_unstable_by(|a, b| {
            let weight = |i: &u32| self.luminaires[*i as usize].weight;
            weight(b).total_cmp(&weight(a)).then(a.cmp(b))
        });
        let mut potential: f64 = self.luminaires.iter().map(|l| l.weight).sum();
        let strata = (budget / 4 / n.max(1) as u32).max(1);
        let (mut spent, mut found, mut found_drive, mut hope) = (0, V::default(), 0.0, 0.0);
        let mut tested = 0;
        for &i in &order {
            if potential <= self.tolerance * found_drive || spent + 2 * strata > budget / 2 {
                break;
            }
            let l = &self.luminaires[i as usize];
            let (shape, area) = (l.shape, l.shape.area());
            let place = |t: f64| {
                let uv = shape.sample(curve::at(t))?;
                Some(Placed { uv, weight: area / mixture(self.luminaires, uv).0.max(1) as f64, cell: i })
            };
            let before = pairs.sum;
            spent += work.draw.pairs(f, strata, key.with(i as u64), place, |v, _| v, &mut pairs);
            let part = pairs.sum.minus(before);
            if l.weight > 0.0 {
                self.history.record(i as usize, part.drive() / l.weight);
            }
            found = found.plus(part);
            found_drive += part.drive().abs();
            hope += l.weight;
            potential -= l.weight;
            tested += 1;
        }
        // The untested take the colour of what was found.
        let usual = if hope > 0.0 { (found_drive / hope).min(1.0) } else { 0.0 };
        let rest: f64 = order[tested..]
            .iter()
            .map(|&i| {
                self.luminaires[i as usize].weight * self.history.visibility(i as usize).unwrap_or(usual)
            })
            .sum();
        if found_drive > 0.0 {
            pairs.add_exact(found.times(rest / found_drive));
        }
        work.trained.order = order;
        let left = (budget.saturating_sub(spent) / 2).max(1);
        spent += outside(f, self.luminaires, left, key.with(u64::MAX), work, &mut pairs);
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot: 0, estimate: spent };
        Estimate::new(
            pairs.sum,
            Some(pairs.std_error()),
            pairs.degrees_of_freedom(),
            evaluations,
            unexplored,
            true,
        )
    }
}
