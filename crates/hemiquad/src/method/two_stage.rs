//! Two stages (D. Kirk and J. Arvo, "Unbiased sampling techniques for image synthesis", 1991): a pilot shapes the strata and is
//! discarded, fresh samples make the estimate. Unbiased whatever the pilot did.

use super::adaptive::{Plan, Sizing, refine_with};
use super::{Leaves, Method, Workspace};
use crate::allocation::Allocation;
use crate::criterion::{Criterion, Weighted};
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Stage};
use crate::partition::Parent;
use crate::points::Key;
use crate::value::Value;

/// The two-stage method on a quadtree. While the pilot runs ([`Stage::Pilot`]) luminaires may be enlarged to what the asking cell
/// cannot miss, which costs nothing in truth: the estimate sees them as they are.
#[derive(Clone, Copy, Debug)]
pub struct TwoStage<'a> {
    /// Which cell the pilot splits next.
    pub criterion: Weighted<'a>,
    /// Share of the budget that the pilot takes, in (0, 1).
    pub pilot: f64,
    /// Radius, in sides of the asking cell, to which the pilot enlarges luminaires: from √½ on none is missed; 0 for none.
    pub reach: f64,
    /// How the fresh samples are shared out.
    pub allocation: Allocation,
}

impl Default for TwoStage<'_> {
    fn default() -> Self {
        TwoStage {
            criterion: Criterion::Unresolved.into(),
            pilot: 0.5,
            reach: 0.75,
            allocation: Allocation::default(),
        }
    }
}

impl TwoStage<'_> {
    /// Without enlargement: blind to what the pilot's samples miss.
    pub fn blind() -> Self {
        TwoStage { criterion: Criterion::Deviation.into(), reach: 0.0, ..TwoStage::default() }
    }
}

impl<V: Value> Method<V> for TwoStage<'_> {
    fn name(&self) -> &'static str {
        if self.reach > 0.0 { "TwoStage" } else { "TwoStage blind" }
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let total = ((budget as f64 * self.pilot.clamp(0.0, 0.95)) as u32).max(1);
        let plan = Plan {
            criterion: self.criterion,
            initial: (total / 4).max(1),
            total,
            stage: Stage::Pilot,
            sizing: if self.reach > 0.0 { Sizing::Shrinking(self.reach) } else { Sizing::True },
        };
        // A sample made for an enlarged luminaire says nothing about a smaller one.
        work.tree.set_parent(if self.reach > 0.0 { Parent::Drop } else { Parent::Keep });
        // Samples at the centres of cells miss nothing that is half a diagonal wide, and a pilot may be as regular as it likes.
        work.tree.set_stray(if self.reach > 0.0 { 0.0 } else { 1.0 });
        let pilot = refine_with(&mut work.tree, f, &plan, key.with(1), &mut work.refine);
        work.tree.set_stray(1.0);
        work.draw.start();
        // One sample per leaf: its neighbours are all that is known of the spread.
        let trained = &mut work.trained;
        trained.adopt(&mut work.tree, &work.refine.values, &work.refine.variance);
        trained.finish(self.allocation);
        let (tree, density) = (trained.tree(), trained.density());
        // What the pilot saw in a leaf is taken out of the fresh samples and put back exactly: a constant control variate, so that
        // leaves that share a sample do not differ in their means.
        let mut pairs = Pairs::new();
        pairs.add_exact(trained.integral());
        let mut cursor = 0;
        let place = |t: f64| density.place(tree, t, &mut cursor);
        let strata = (budget.saturating_sub(pilot) / 2).max(1);
        let estimate =
            work.draw.pairs(f, strata, key.with(2), place, |v, p| v.minus(trained.level(p.cell)), &mut pairs);
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot, estimate };
        // A pilot that enlarges leaves no feature hidden in a stratum; a blind one may, and keeps the wider interval.
        let dof =
            if self.reach > 0.0 { pairs.degrees_of_freedom_resolved() } else { pairs.degrees_of_freedom() };
        // Luminaires keep their flux when they are enlarged: a pilot that saw many times what the fresh samples found has seen
        // more luminaires than they could resolve. A blind pilot saw no more than they do.
        let witness = if self.reach > 0.0 { trained.level_as_witness() } else { None };
        Estimate::new(pairs.sum, Some(pairs.std_error()), dof, evaluations, unexplored, false).heard(witness)
    }

    fn leaves(&self) -> Option<Leaves> {
        Some(Leaves::Trained)
    }
}
