//! Two stages (D. Kirk and J. Arvo, "Unbiased sampling techniques for image synthesis", 1991): a pilot shapes the strata and is
//! discarded, fresh samples make the estimate. Unbiased whatever the pilot did.

use super::adaptive::{Plan, Sizing, refine_with};
use super::{Method, Workspace};
use crate::allocation::Allocation;
use crate::criterion::{Criterion, Weighted};
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Stage};
use crate::partition::{Parent, Partition};
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
    /// Radius, in sides of the asking cell, to which the pilot enlarges luminaires; 0 for none.
    pub reach: f64,
    /// How the fresh samples are shared out.
    pub allocation: Allocation,
}

impl Default for TwoStage<'_> {
    fn default() -> Self {
        TwoStage {
            criterion: Criterion::Deviation.into(),
            pilot: 0.5,
            reach: 1.0,
            allocation: Allocation::default(),
        }
    }
}

impl TwoStage<'_> {
    /// Without enlargement: blind to what the pilot's samples miss.
    pub fn blind() -> Self {
        TwoStage { reach: 0.0, ..TwoStage::default() }
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
        let pilot = refine_with(&mut work.tree, f, &plan, key.with(1), &mut work.refine);
        work.draw.start();
        let pairs = estimate(f, budget.saturating_sub(pilot), self.allocation, key.with(2), work);
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot, estimate: pairs.1 };
        let pairs = pairs.0;
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

/// Fresh samples over the leaves of the refined tree, shared out by what the pilot saw.
fn estimate<V: Value>(
    f: &mut dyn Integrand<V>,
    samples: u32,
    allocation: Allocation,
    key: Key,
    work: &mut Workspace<V>,
) -> (Pairs<V>, u32) {
    let (tree, refine, scratch) = (&work.tree, &work.refine, &mut work.trained);
    scratch.strata_mut().clear();
    for leaf in tree.leaves() {
        let area = tree.area(leaf);
        let drive = tree.members(leaf).as_slice().first().map_or(0.0, |i| refine.drives[*i as usize].abs());
        // One sample per leaf: its neighbours are all that is known of the spread.
        let spread = refine.variance[leaf as usize].max(0.0).sqrt();
        scratch.strata_mut().push((area, area * drive, spread));
    }
    scratch.share_out(allocation);
    work.density.set(tree, work.trained.shares());
    let density = &work.density;
    let mut pairs = Pairs::new();
    let mut cursor = 0;
    let spent = work.draw.pairs(
        f,
        (samples / 2).max(1),
        key,
        |t| density.place(tree, t, &mut cursor),
        |v, _| v,
        &mut pairs,
    );
    (pairs, spent)
}
