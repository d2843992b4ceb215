//! Passes whose weights are fixed in advance. Each pass samples a partition trained on the earlier ones only, so each is unbiased
//! given them, and so is any combination whose weights do not depend on what was found.

use super::draw::Placed;
use super::{Method, Workspace};
use crate::allocation::Allocation;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::Integrand;
use crate::points::Key;
use crate::value::Value;

/// Passes beyond this many are not made.
const MOST_PASSES: u32 = 16;

/// Sequential passes of growing size: no sample is thrown away, and nothing is biased. What earlier passes saw in a leaf serves
/// as a constant control variate.
///
/// Pass k of K takes a share k / (1 + … + K) of the samples, and its mean enters with weight ∝ k²: later passes know more.
/// Weights by estimated variances would be better on paper and are *biased*: they favour the passes that saw too little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sequential {
    /// Number of passes, 1 to 16.
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
        let passes = self.passes.clamp(1, (budget / 2).clamp(1, MOST_PASSES));
        let all = (passes * (passes + 1) / 2) as f64;
        let squares: f64 = (1..=passes).map(|k| (k * k) as f64).sum();
        let Workspace { trained, control, draw, .. } = work;
        // About four samples of the first pass per leaf to begin with.
        let start = budget as f64 / all / 4.0;
        trained.start((start.max(1.0).log2() / 2.0) as u8);
        trained.finish(Allocation::Proportional);
        let mut sum = Pairs::new();
        let mut spent = 0;
        draw.start();
        let mut upto = 0.0;
        let mut each = [(0.0, V::default()); MOST_PASSES as usize];
        for k in 1..=passes {
            let before = upto as u32;
            upto += budget as f64 * k as f64 / all / 2.0;
            let strata = ((upto + 1e-9) as u32 - before).max(1);
            let mut pass = Pairs::new();
            let mut seen = std::mem::take(&mut control.seen);
            seen.clear();
            let mut cursor = 0;
            let (tree, density) = (trained.tree(), trained.density());
            let place = |t: f64| density.place(tree, t, &mut cursor);
            let post = |v: V, p: &Placed| {
                seen.push((p.uv, v));
                v.minus(trained.level(p.cell))
            };
            pass.add_exact(trained.integral());
            spent += draw.pairs(f, strata, key.with(k as u64), place, post, &mut pass);
            let weight = (k * k) as f64 / squares;
            sum.join(&pass, weight);
            if let Some(e) = each.get_mut(k as usize - 1) {
                *e = (weight, pass.sum);
            }
            if k < passes {
                for (uv, value) in &seen {
                    trained.add(*uv, *value);
                }
                trained.refine((budget / 4).max(4), 4);
                trained.finish(self.allocation);
            }
            control.seen = seen;
        }
        let unexplored = draw.unexplored();
        let evaluations = Evaluations { pilot: 0, estimate: spent };
        // A pass that missed a feature does not know it, but its mean differs from the others': the larger error is believed.
        let within = sum.std_error();
        let (mut between, mut own) = (V::default(), 0.0);
        for (w, e) in &each {
            between = between.plus(e.zip(sum.sum, |e, m| w * w * (e - m) * (e - m)));
            own += w * w;
        }
        let between = between.each(|x| (x / (1.0 - own).max(0.1)).sqrt());
        let apart = between.drive() > within.drive();
        let dof = if apart { (passes.max(2) - 1) as f64 } else { sum.degrees_of_freedom() };
        Estimate::new(sum.sum, Some(within.zip(between, f64::max)), dof, evaluations, unexplored, false)
    }
}
