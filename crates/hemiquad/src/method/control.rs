//! A linear control variate in every leaf. The planes are fitted to a pilot's samples and integrated exactly; fresh samples
//! integrate what is left. Unbiased, because the planes do not know the fresh samples; fitted to the same samples (as regression
//! Monte Carlo does) they would be biased by O(1/n).

use super::draw::Placed;
use super::train::Trained;
use super::{Method, Workspace, evaluate};
use crate::allocation::Allocation;
use crate::estimate::{Estimate, Evaluations, Pairs};
use crate::integrand::{Integrand, Probe, Size, Stage};
use crate::map::Uv;
use crate::partition::Partition;
use crate::points::{Key, jittered_f64};
use crate::value::Value;

/// A plane over a cell: its value at the centre and its slopes, in units of the square.
#[derive(Clone, Copy, Debug, Default)]
struct Plane<V> {
    centre: Uv<f64>,
    value: V,
    du: V,
    dv: V,
    /// Standard deviation of the driving scalar about the plane; negative where there is no plane.
    spread: f64,
}

impl<V: Value> Plane<V> {
    fn at(&self, p: Uv<f64>) -> V {
        self.value.plus(self.du.times(p.u - self.centre.u)).plus(self.dv.times(p.v - self.centre.v))
    }
}

/// Reusable memory.
#[derive(Debug, Default)]
pub(crate) struct Models<V> {
    planes: Vec<Plane<V>>,
    pub seen: Vec<(Uv<f64>, V)>,
}

/// Linear control variates over a trained quadtree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinearControl {
    /// Share of the budget that the pilot takes, in (0, 1).
    pub pilot: f64,
    /// How the fresh samples are shared out.
    pub allocation: Allocation,
}

impl Default for LinearControl {
    fn default() -> Self {
        LinearControl { pilot: 0.5, allocation: Allocation::default() }
    }
}

/// Samples a leaf needs before it may be split, and before a plane is believed.
const PER_SPLIT: u32 = 16;
const PER_PLANE: usize = 5;

impl<V: Value> Method<V> for LinearControl {
    fn name(&self) -> &'static str {
        "LinearControl"
    }

    fn integrate(
        &self,
        f: &mut dyn Integrand<V>,
        budget: u32,
        key: Key,
        work: &mut Workspace<V>,
    ) -> Estimate<V> {
        let side = ((budget as f64 * self.pilot.clamp(0.01, 0.95)) as u32).max(1).isqrt();
        let pilot = side * side;
        let Workspace { trained, control, draw, refine, .. } = work;
        trained.start(0);
        let values = &mut refine.values;
        values.clear();
        let mut probes = [Probe::default(); 64];
        let mut first = 0;
        while first < pilot {
            let m = (pilot - first).min(64);
            for k in 0..m {
                let uv = jittered_f64(first + k, side, side, key.with(1));
                probes[k as usize] = Probe { uv, stage: Stage::Pilot, size: Size::True };
            }
            evaluate(f, &probes[..m as usize], values);
            for k in 0..m as usize {
                trained.add(probes[k].uv, values[first as usize + k]);
            }
            first += m;
        }
        trained.refine((pilot / 4).max(1), PER_SPLIT);
        let planes = &mut control.planes;
        planes.clear();
        planes.resize(trained.tree().node_count() as usize, Plane::default());
        let mut exact = V::default();
        for leaf in trained.tree().leaves() {
            let plane = fit(trained, leaf, values);
            exact = exact.plus(plane.value.times(trained.tree().area(leaf)));
            planes[leaf as usize] = plane;
        }
        trained.finish_with(self.allocation, |leaf, learnt| {
            let s = planes[leaf as usize].spread;
            if s < 0.0 { learnt } else { s }
        });
        let (tree, density) = (trained.tree(), trained.density());
        let mut pairs = Pairs::new();
        pairs.add_exact(exact);
        let mut cursor = 0;
        let place = |t: f64| density.place(tree, t, &mut cursor);
        let post = |v: V, p: &Placed| v.minus(planes[p.cell as usize].at(p.uv));
        draw.start();
        let strata = (budget.saturating_sub(pilot) / 2).max(1);
        let estimate = draw.pairs(f, strata, key.with(2), place, post, &mut pairs);
        let unexplored = draw.unexplored();
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

/// The least-squares plane of a leaf's samples, or their mean where a plane explains no more than chance would.
fn fit<V: Value>(trained: &Trained<V>, leaf: u32, values: &[V]) -> Plane<V> {
    let cell = trained.tree().cell(leaf);
    let centre = cell.at(Uv::new(0.5, 0.5));
    let (mut n, mut x, mut y, mut mean) = (0.0, 0.0, 0.0, V::default());
    for i in trained.members(leaf) {
        let p = trained.point(i);
        n += 1.0;
        x += p.u - centre.u;
        y += p.v - centre.v;
        mean = mean.plus(values[i]);
    }
    if n == 0.0 {
        return Plane { centre, spread: -1.0, ..Plane::default() };
    }
    (x, y, mean) = (x / n, y / n, mean.times(1.0 / n));
    let flat = Plane { centre, value: mean, du: V::default(), dv: V::default(), spread: -1.0 };
    if n < PER_PLANE as f64 {
        return flat;
    }
    let (mut xx, mut xy, mut yy, mut before) = (0.0, 0.0, 0.0, 0.0);
    let (mut xf, mut yf) = (V::default(), V::default());
    for i in trained.members(leaf) {
        let p = trained.point(i);
        let (a, b, d) = (p.u - centre.u - x, p.v - centre.v - y, values[i].minus(mean));
        xx += a * a;
        xy += a * b;
        yy += b * b;
        xf = xf.plus(d.times(a));
        yf = yf.plus(d.times(b));
        before += d.drive() * d.drive();
    }
    let det = xx * yy - xy * xy;
    if det <= 1e-6 * xx * yy {
        return flat;
    }
    let du = xf.times(yy / det).minus(yf.times(xy / det));
    let dv = yf.times(xx / det).minus(xf.times(xy / det));
    // The plane through the mean, moved to the centre.
    let value = mean.minus(du.times(x)).minus(dv.times(y));
    let mut plane = Plane { centre, value, du, dv, spread: 0.0 };
    let after: f64 =
        trained.members(leaf).map(|i| values[i].minus(plane.at(trained.point(i))).drive().powi(2)).sum();
    if after / (n - 3.0) >= before / (n - 1.0) {
        return flat;
    }
    // Believe the fit only as far as a plane has left degrees of freedom, and a little of what it was before.
    let prior = trained.stats(leaf).variance;
    plane.spread = ((after + 0.02 * prior) / (n - 3.0)).sqrt();
    plane
}
