//! Samples over a predicted partition, combined with broad ones by the multi-sample balance heuristic (E. Veach and L. Guibas,
//! "Optimally combining sampling techniques", 1995):
//!
//! I ≈ Σₖ Σᵢ F(wₖᵢ) / Σⱼ nⱼ pⱼ(wₖᵢ).
//!
//! Unbiased whatever was predicted, as long as the samples are fresh: a bad prediction costs noise. The noise grows with how much
//! too wide the prediction is: √((w/A - 1)/n) relative to a feature of area A in a stratum of area w with n samples.

use super::draw::Placed;
use super::known::{Region, choose, mixture};
use super::train::Trained;
use super::{Method, Workspace};
use crate::curve;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::Integrand;
use crate::points::Key;
use crate::value::Value;

/// What was predicted.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a, V = f64> {
    /// Places where features may be, each with its expected contribution.
    pub regions: &'a [Region],
    /// A partition trained on *other* samples; without one the broad samples are uniform.
    pub partition: Option<&'a Trained<V>>,
}

/// Sampling by prediction.
#[derive(Clone, Copy, Debug)]
pub struct Predicted<'a, V = f64> {
    /// The prediction.
    pub prediction: Prediction<'a, V>,
    /// Share of the samples that stays broad (over the partition, or uniform), in (0, 1]; all of them without regions.
    pub broad: f64,
    /// Whether the partition's mean values serve as a control variate. Unbiased either way; leave it off when the training
    /// saw another integrand altogether. With it on, the interval is widened where what the training saw contradicts it
    /// ([`Trained::witness`]).
    pub control: bool,
}

impl<'a, V: Value> Predicted<'a, V> {
    /// From places; a fifth of the samples stays broad.
    pub fn from_regions(regions: &'a [Region]) -> Self {
        Predicted { prediction: Prediction { regions, partition: None }, broad: 0.2, control: false }
    }

    /// From a trained partition.
    pub fn from_partition(partition: &'a Trained<V>) -> Self {
        Predicted {
            prediction: Prediction { regions: &[], partition: Some(partition) },
            broad: 1.0,
            control: true,
        }
    }
}

impl<V: Value> Method<V> for Predicted<'_, V> {
    fn name(&self) -> &'static str {
        if self.prediction.partition.is_some() { "Predicted partition" } else { "Predicted regions" }
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let Prediction { regions, partition } = self.prediction;
        let predicted = regions.iter().any(|r| r.weight > 0.0);
        let regions = if predicted { regions } else { &[] };
        let strata = (budget / 2).max(1);
        let broad = if predicted {
            ((strata as f64 * self.broad.clamp(0.01, 1.0)) as u32).clamp(1, strata)
        } else {
            strata
        };
        let narrow = strata - broad;
        let (nb, nn) = (2.0 * broad as f64, 2.0 * narrow as f64);
        let broad_density = |p| partition.map_or(1.0, |t| t.density().pdf_square(t.tree(), p));
        // Each stratum's two samples together count with 2 / Σ n p; `pairs` divides by the number of strata of its technique.
        let mut pairs = Pairs::new();
        let mut cursor = 0;
        let place_broad = |t: f64| {
            let p = match partition {
                Some(trained) => trained.density().place(trained.tree(), t, &mut cursor)?,
                None => Placed { uv: curve::at(t), weight: 1.0, cell: 0 },
            };
            let (_, density) = mixture(regions, p.uv);
            Some(Placed { weight: nb / (nb / p.weight + nn * density), ..p })
        };
        let control = partition.filter(|_| self.control);
        if let Some(trained) = control {
            pairs.add_exact(trained.integral());
        }
        let rest = |v: V, p: &Placed| match control {
            Some(trained) => v.minus(trained.level(trained.tree().leaf_at(p.uv))),
            None => v,
        };
        work.draw.start();
        let mut spent = work.draw.pairs(f, broad, key.with(1), place_broad, rest, &mut pairs);
        if narrow > 0 {
            let mut cursor = (0, 0.0);
            let place_narrow = |t: f64| {
                let (i, s) = choose(regions, t, &mut cursor)?;
                let uv = regions[i].shape.sample(curve::at(s))?;
                let (_, density) = mixture(regions, uv);
                Some(Placed { uv, weight: nn / (nb * broad_density(uv) + nn * density), cell: i as u32 })
            };
            spent += work.draw.pairs(f, narrow, key.with(2), place_narrow, rest, &mut pairs);
        }
        let unexplored = work.draw.unexplored();
        let evaluations = Evaluations { pilot: 0, estimate: spent };
        Estimate::new(
            pairs.sum,
            Some(pairs.std_error()),
            pairs.degrees_of_freedom(),
            evaluations,
            unexplored,
            false,
        )
        .heard(control.and_then(Trained::witnessed))
    }
}
