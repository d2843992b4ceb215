//! Passes whose weights are fixed in advance. Each pass samples a partition trained on the earlier ones only, so each is unbiased
//! given them, and so is any combination whose weights do not depend on what was found.

use super::draw::Placed;
use super::{Method, Workspace};
use crate::allocation::Allocation;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::Integrand;
use crate::points::Key;
use crate::value::Value;

/// Sequential passes of growing size: no sample is thrown away, and nothing is biased. What earlier passes saw in a leaf serves
/// as a constant control variate.
///
/// Pass k of K takes a share k / (1 + … + K) of the samples, and its mean enters with weight ∝ k²: later passes know more.
/// Weights by estimated variances would be better on paper and are *biased*: they favour the passes that saw too little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sequential {
    /// Number of passes, at least 1.
    pub passes: u32,
    /// How samples are shared out from the second pass on.
    pub allocation: Allocation,
}

impl Default for Sequential {
    fn default() -> Self {
        Sequential { passes: 4, allocation: Allocation::default() }
    }
}

impl<V: Value> Method<V> for Sequential {
    fn name(&self) -> &'static str {
        "Sequential"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let passes = self.passes.clamp(1, budget.max(2) / 2);
        let all = (passes * (passes + 1) / 2) as f64;
        let squares: f64 = (1..=passes).map(|k| (k * k) as f64).sum();
        let mut trained = std::mem::take(&mut work.trained);
        // About four samples of the first pass per leaf to begin with.
        let start = budget as f64 / all / 4.0;
        trained.start((start.max(1.0).log2() / 2.0) as u8);
        trained.finish(Allocation::Proportional);
        let mut sum = Pairs::new();
        let mut spent = 0;
        work.draw.start();
        let mut upto = 0.0;
        for k in 1..=passes {
            let before = upto as u32;
            upto += budget as f64 * k as f64 / all / 2.0;
            let strata = ((upto + 1e-9) as u32 - before).max(1);
            let mut pass = Pairs::new();
            let mut seen = std::mem::take(&mut work.control.seen);
            seen.clear();
            let mut cursor = 0;
            let (tree, density) = (trained.tree(), trained.density());
            let place = |t: f64| density.place(tree, t, &mut cursor);
            let post = |v: V, p: &Placed| {
                seen.push((p.uv, v));
                v.minus(trained.level(p.cell))
            };
            pass.add_exact(trained.integral());
            spent += work.draw.pairs(f, strata, key.with(k as u64), place, post, &mut pass);
            sum.join(&pass, (k * k) as f64 / squares);
            if k < passes {
                for (uv, value) in &seen {
                    trained.add(*uv, *value);
                }
                trained.refine((budget / 4).max(4), 4);
                trained.finish(self.allocation);
            }
            work.control.seen = seen;
        }
        work.trained = trained;
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot: 0, estimate: spent };
        Estimate::new(
            sum.sum,
            Some(sum.std_error()),
            sum.degrees_of_freedom(),
            evaluations,
            unexplored,
            false,
        )
    }
}
