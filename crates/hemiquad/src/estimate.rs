//! What every method returns: the value, and what is known of its error.

use crate::map::Concentric;
use crate::value::Value;

/// How many times the integrand was evaluated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Evaluations {
    /// Evaluations that only shaped the strata; their values are not part of the estimate.
    pub pilot: u32,
    /// Evaluations that make the estimate.
    pub estimate: u32,
}

impl Evaluations {
    /// All of them.
    pub fn total(self) -> u32 {
        self.pilot + self.estimate
    }
}

/// How many times what an interval allows an independent look may have seen before the interval is taken to be wrong. The price of
/// a false alarm is width, in at most one of so many runs.
pub const SURPRISE: f64 = 4.0;

/// An integral over the unit square with everything that is known of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[must_use]
pub struct Estimate<V = f64> {
    /// The integral.
    pub value: V,
    /// The standard error, channel by channel; `None` when the method has none, or when nothing but zeros was seen: an
    /// integral of "0 ± 0" is never claimed.
    pub std_error: Option<V>,
    /// Effective degrees of freedom of the standard error: how far to trust it.
    pub degrees_of_freedom: f64,
    /// How many evaluations were spent.
    pub evaluations: Evaluations,
    /// Radius, in the unit square, of the largest disk that may hold no evaluation of the estimate (an upper bound, from the
    /// points as they fell). A feature smaller than this can have been missed.
    pub unexplored: f64,
    /// Whether the method is biased, in which case the standard error does not tell the whole error.
    pub biased: bool,
}

impl<V: Value> Estimate<V> {
    /// Assembles a result; never lets "0 ± 0" pass.
    pub(crate) fn new(
        value: V,
        std_error: Option<V>,
        dof: f64,
        evaluations: Evaluations,
        unexplored: f64,
        biased: bool,
    ) -> Self {
        let silent = value.largest() == 0.0;
        Estimate {
            value,
            std_error: std_error.filter(|e| !(silent && e.largest() == 0.0)),
            degrees_of_freedom: dof.max(1.0),
            evaluations,
            unexplored,
            biased,
        }
    }

    /// Half-width of the 95 % interval (Student's), channel by channel.
    pub fn half_width_95(&self) -> Option<V> {
        self.std_error.map(|e| e.times(student_975(self.degrees_of_freedom)))
    }

    /// Widens the interval where what `witness` saw of the same integral contradicts it: another estimate, unbiased and from
    /// samples that this one does not hold (value and standard error), of an integrand that is nowhere negative.
    ///
    /// By Markov's inequality a sum of nonnegative values exceeds [`SURPRISE`] times its mean with probability 1/[`SURPRISE`]
    /// at most, whatever the integrand. A witness that saw more than that many times the upper end of the interval therefore
    /// says that the fresh samples missed something: one hit on a thin ring is no surprise if the ring is long, and a great one if
    /// only the spot around it is lit. The interval then reaches as far as the witness' own; the value stays as it is, unbiased.
    pub(crate) fn heard(mut self, witness: Option<(V, V)>) -> Self {
        let Some((seen, doubt)) = witness else { return self };
        let half = self.half_width_95().unwrap_or_default();
        let upper = self.value.drive() + half.drive();
        // A control variate can bring the value below zero, which contradicts even more.
        if seen.drive() > SURPRISE * upper.max(0.0) {
            let normal = student_975(f64::INFINITY);
            let apart = seen.zip(self.value, |s, v| (s - v).abs() / normal).plus(doubt);
            self.std_error = Some(apart.zip(half, |a, h| a.max(h / normal)));
            self.degrees_of_freedom = f64::INFINITY;
        }
        self
    }

    /// Half-angle, in radians, of the largest cap of directions that may hold no evaluation, when the square stands for the
    /// hemisphere through [`Concentric`].
    pub fn unexplored_cap(&self) -> f64 {
        (self.unexplored * Concentric::LARGEST_STRETCH).min(std::f64::consts::PI)
    }
}

/// The 97.5 % point of Student's t (Cornish–Fisher expansion; exact values at 1 and 2 degrees of freedom).
pub fn student_975(dof: f64) -> f64 {
    let z: f64 = 1.959_963_984_540_054;
    let expansion = |n: f64| {
        let (z2, n2) = (z * z, n * n);
        z + z * (z2 + 1.0) / (4.0 * n)
            + z * ((5.0 * z2 + 16.0) * z2 + 3.0) / (96.0 * n2)
            + z * (((3.0 * z2 + 19.0) * z2 + 17.0) * z2 - 15.0) / (384.0 * n2 * n)
    };
    if dof.is_nan() || dof <= 1.0 {
        12.706
    } else if dof < 2.0 {
        // In between, 1/t is close to linear in 1/n.
        let w = 2.0 - 2.0 / dof;
        1.0 / ((1.0 - w) / 12.706 + w / 4.303)
    } else if dof < 3.0 {
        let w = (1.0 / 2.0 - 1.0 / dof) * 6.0;
        1.0 / ((1.0 - w) / 4.303 + w / 3.182)
    } else if dof.is_infinite() {
        z
    } else {
        expansion(dof)
    }
}

/// Sums pairs: two independent points in every stratum give the mean and an unbiased estimate of its variance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pairs<V> {
    pub sum: V,
    variance: V,
    /// Sum, and sum of squares, of the strata's variances of the driving scalar: for the degrees of freedom.
    drive: f64,
    drive2: f64,
}

impl<V: Value> Pairs<V> {
    pub fn new() -> Self {
        Pairs { sum: V::default(), variance: V::default(), drive: 0.0, drive2: 0.0 }
    }

    /// Two values of one stratum, each already scaled to stand for the whole stratum.
    #[inline]
    pub fn add(&mut self, a: V, b: V) {
        self.sum = self.sum.plus(a.zip(b, |a, b| 0.5 * (a + b)));
        let v = a.zip(b, |a, b| 0.25 * (a - b) * (a - b));
        self.variance = self.variance.plus(v);
        let d = 0.25 * (a.drive() - b.drive()) * (a.drive() - b.drive());
        self.drive += d;
        self.drive2 += d * d;
    }

    /// Another independent sum.
    pub fn join(&mut self, other: &Self, weight: f64) {
        self.sum = self.sum.plus(other.sum.times(weight));
        let w2 = weight * weight;
        self.variance = self.variance.plus(other.variance.times(w2));
        self.drive += w2 * other.drive;
        self.drive2 += w2 * w2 * other.drive2;
    }

    /// A quantity known exactly.
    pub fn add_exact(&mut self, v: V) {
        self.sum = self.sum.plus(v);
    }

    /// A variance that is known: k times the square of `v`.
    pub fn add_variance(&mut self, v: V, k: f64) {
        self.variance = self.variance.plus(v.each(|x| k * x * x));
        self.drive += k * v.drive() * v.drive();
    }

    pub fn std_error(&self) -> V {
        self.variance.each(f64::sqrt)
    }

    /// Satterthwaite's degrees of freedom of a sum of variances with one degree each. For equal normal strata it is three times
    /// too small; strata that are hit now and then are neither, and need the room.
    pub fn degrees_of_freedom(&self) -> f64 {
        if self.drive2 > 0.0 { (self.drive * self.drive / self.drive2).max(1.0) } else { f64::INFINITY }
    }

    /// The same where the strata are known to hide nothing: 2 r - 2, with r the count of
    /// [`degrees_of_freedom`](Self::degrees_of_freedom).
    ///
    /// The degrees are 2 (Σ σ²)² / Σ Var s², where Var s² = (κ - 1) σ⁴ if E s⁴ = κ σ⁴ (κ = 3 for normal strata). Estimates s² in
    /// the place of σ² make the sum of squares κ times too large, and the square of the sum too large by (κ - 1) Σ σ⁴; both taken
    /// back leave r · 2κ/(κ - 1) - 2: 3 r - 2 for normal strata (E. Johnson and K. Rust, 1992), and never less than 2 r - 2
    /// whatever κ is.
    pub fn degrees_of_freedom_resolved(&self) -> f64 {
        (2.0 * self.degrees_of_freedom() - 2.0).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Key;

    /// How often the 95 % interval of 12 strata holds, which differ in size by up to 3.6 and are uniform inside.
    fn coverage(dof: impl Fn(&Pairs<f64>) -> f64) -> f64 {
        let runs = 20_000;
        let held = (0..runs).filter(|r| {
            let mut pairs = Pairs::new();
            for k in 0..12u64 {
                let u = Key::new(8).with(*r).with(k).uniform2_f64(0);
                let size = 1.25f64.powi(k as i32 / 2);
                pairs.add(size * (u.u - 0.5), size * (u.v - 0.5));
            }
            pairs.sum.abs() <= student_975(dof(&pairs)) * pairs.std_error()
        });
        held.count() as f64 / runs as f64
    }

    #[test]
    fn intervals_of_resolved_strata_hold_and_are_not_idle() {
        let (resolved, plain, normal) = (
            coverage(Pairs::degrees_of_freedom_resolved),
            coverage(Pairs::degrees_of_freedom),
            coverage(|_| f64::INFINITY),
        );
        println!("resolved {resolved:.4}, plain {plain:.4}, normal {normal:.4}");
        // One standard deviation is 0.0015: five of them around 94.5 to 96 %. Controls: both others lie outside.
        assert!((0.945 - 0.0075..0.96 + 0.0075).contains(&resolved), "{resolved}");
        assert!(plain > resolved + 0.0075, "{plain}");
        assert!(normal < 0.945 - 0.0075, "{normal}");
    }
}
