//! How many samples each stratum gets.
//!
//! For strata of measure wᵢ and standard deviation sᵢ the variance is Σ wᵢ² sᵢ² / nᵢ. Proportional shares (nᵢ ∝ wᵢ) never lose
//! against plain sampling; J. Neyman's (1934), nᵢ ∝ wᵢ sᵢ, are best when sᵢ is known. A share a of proportional samples bounds
//! the variance by Var_proportional / a however wrong sᵢ is.

/// A rule that turns areas, predicted masses and predicted deviations into probabilities per stratum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allocation {
    /// By area.
    Proportional,
    /// By area × predicted deviation, with a defensive share split between area and predicted mass.
    Neyman {
        /// The defensive share, in (0, 1]; 0.2 is a good habit. Clamped to [0.01, 1].
        defensive: f64,
    },
}

impl Default for Allocation {
    fn default() -> Self {
        Allocation::Neyman { defensive: 0.2 }
    }
}

impl Allocation {
    /// Writes the probability of every stratum into `share` (sum one). All slices have the same length; a stratum is
    /// (area, mass, deviation), none negative.
    pub fn shares(&self, strata: &[(f64, f64, f64)], share: &mut Vec<f64>) {
        share.clear();
        let (mut area, mut mass, mut spread) = (0.0, 0.0, 0.0);
        for s in strata {
            area += s.0;
            mass += s.1;
            spread += s.0 * s.2;
        }
        let part =
            |x: f64, of: f64, otherwise: f64| if of > 0.0 && of.is_finite() { x / of } else { otherwise };
        for s in strata {
            let a = part(s.0, area, 1.0 / strata.len() as f64);
            share.push(match *self {
                Allocation::Proportional => a,
                Allocation::Neyman { defensive } => {
                    let d = defensive.clamp(0.01, 1.0);
                    d * (0.5 * a + 0.5 * part(s.1, mass, a)) + (1.0 - d) * part(s.0 * s.2, spread, a)
                }
            });
        }
    }
}

/// Systematic allocation: walks along the strata (in Morton order, so that neighbours share) with one offset in [0, 1) and
/// gives each ⌊N pᵢ⌋ or ⌈N pᵢ⌉ samples, N pᵢ on average. `visit` receives (stratum, samples).
pub fn systematic(share: &[f64], samples: u32, offset: f64, mut visit: impl FnMut(usize, u32)) {
    let total: f64 = share.iter().sum();
    let scale = if total > 0.0 { samples as f64 / total } else { 0.0 };
    let (mut along, mut given) = (offset, 0u32);
    for (i, p) in share.iter().enumerate() {
        along += p * scale;
        // The last stratum takes what rounding has left.
        let upto = if i + 1 == share.len() { samples } else { (along as u32).min(samples) };
        visit(i, upto.saturating_sub(given));
        given = given.max(upto);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Key;

    #[test]
    fn systematic_gives_the_floor_or_the_ceiling_and_the_right_mean() {
        let share = [0.031, 0.4, 0.002, 0.317, 0.25];
        let mut sum = [0u32; 5];
        for k in 0..4000 {
            let mut total = 0;
            systematic(&share, 17, Key::new(k).uniform64(0), |i, n| {
                let expect = share[i] * 17.0;
                assert!(n as f64 >= expect.floor() - 1e-9 && n as f64 <= expect.ceil() + 1e-9, "{i} {n}");
                sum[i] += n;
                total += n;
            });
            assert_eq!(total, 17);
        }
        for i in 0..5 {
            // Standard deviation of the mean at most 0.5/√4000 = 0.008; five of them.
            assert!((sum[i] as f64 / 4000.0 - share[i] * 17.0).abs() < 0.04);
        }
    }

    #[test]
    fn neyman_beats_proportional_and_its_defence_bounds_the_loss() {
        let strata = [(0.9, 0.45, 0.01), (0.1, 5.0, 3.0)];
        let variance = |truth: [f64; 2], share: &[f64]| -> f64 {
            (0..2).map(|i| (strata[i].0 * truth[i]).powi(2) / share[i]).sum()
        };
        let (mut p, mut n) = (Vec::new(), Vec::new());
        Allocation::Proportional.shares(&strata, &mut p);
        Allocation::default().shares(&strata, &mut n);
        assert!((n.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(variance([0.01, 3.0], &n) < 0.3 * variance([0.01, 3.0], &p));
        // The prediction was exactly wrong: still at most 1/(area share 0.1) times proportional.
        let loss = variance([3.0, 0.01], &n) / variance([3.0, 0.01], &p);
        assert!(loss > 1.0 && loss < 10.0, "{loss}");
    }
}
