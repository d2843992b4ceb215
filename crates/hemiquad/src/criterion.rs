//! Refinement criteria (report, section 3.2): how much a cell deserves to be split.

use crate::map::Uv;

/// What a criterion sees of a cell. The values are the scalars that drive ([`Value::drive`](crate::Value::drive)).
#[derive(Clone, Copy, Debug)]
pub struct CellView<'a> {
    /// Its area in the square.
    pub area: f64,
    /// The values of its own samples.
    pub inside: &'a [f64],
    /// The mean values of its neighbours.
    pub around: &'a [f64],
    /// The areas of its neighbours, in the same order.
    pub around_area: &'a [f64],
    /// One of its samples.
    pub at: Uv<f64>,
}

impl CellView<'_> {
    /// Mean of the values inside.
    #[inline]
    pub fn mean(&self) -> f64 {
        self.inside.iter().sum::<f64>() / self.inside.len().max(1) as f64
    }

    /// The largest difference between a value inside and one around or inside.
    #[inline]
    pub fn contrast(&self) -> f64 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &x in self.inside {
            low = low.min(x);
            high = high.max(x);
        }
        // Comparisons that NaN fails, not `max`, which treats it apart and is no single instruction.
        let larger = |c: f64, d: f64| if d > c { d } else { c };
        self.around.iter().fold(larger(0.0, high - low), |c, x| larger(larger(c, high - x), x - low))
    }

    /// How much brighter than the darkest neighbour, or an eighth of how much darker than the brightest.
    #[inline]
    fn unresolved(&self) -> f64 {
        let m = self.mean();
        self.around.iter().fold(0.0, |p, x| f64::max(p, (m - x).max(0.125 * (x - m))))
    }

    /// The mean square difference between a value inside and one around, halved: a guess at the variance in the cell. A smaller
    /// neighbour says something about a part as large as itself only.
    #[inline]
    pub fn variance(&self) -> f64 {
        let m = self.mean();
        let inner: f64 = self.inside.iter().map(|x| (x - m) * (x - m)).sum();
        let outer = self
            .around
            .iter()
            .zip(self.around_area)
            .map(|(x, a)| 0.5 * (x - m) * (x - m) * if *a < self.area { a / self.area } else { 1.0 });
        (inner + outer.sum::<f64>()) / (self.inside.len() + self.around.len()).max(1) as f64
    }
}

/// A criterion. Each is weighted by the cell's area and by [`Weighted::weight`].
#[derive(Clone, Copy, Default)]
pub enum Criterion<'a> {
    /// How different the cell might be from what its sample says: the largest contrast to a neighbour. For compact features,
    /// whose edges matter.
    #[default]
    Contrast,
    /// How much it contributes: its mean value. For ragged features: sample where it is bright.
    Value,
    /// The predicted deviation: root of the mean square contrast.
    Deviation,
    /// For enlarged luminaires: contrast × the side of the cell, an eighth of it for the darker side. A feature of flux F hidden
    /// somewhere in a cell of area a causes a deviation ∝ F √a, whatever its true size; bright cells go first, because most
    /// of their dark neighbours are no longer beside the feature once that has shrunk.
    Unresolved,
    /// Anything else.
    User(&'a (dyn Fn(&CellView<'_>) -> f64 + Sync)),
}

impl std::fmt::Debug for Criterion<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Criterion::Contrast => "Contrast",
            Criterion::Value => "Value",
            Criterion::Deviation => "Deviation",
            Criterion::Unresolved => "Unresolved",
            Criterion::User(_) => "User",
        })
    }
}

/// A criterion with a weight over the square, such as the product of BRDF and cosine where the integrand leaves it out.
#[derive(Clone, Copy, Default)]
pub struct Weighted<'a> {
    /// The criterion.
    pub criterion: Criterion<'a>,
    /// The weight; one everywhere when absent.
    pub weight: Option<&'a (dyn Fn(Uv<f64>) -> f64 + Sync)>,
}

impl std::fmt::Debug for Weighted<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?}{}", self.criterion, if self.weight.is_some() { " weighted" } else { "" })
    }
}

impl<'a> From<Criterion<'a>> for Weighted<'a> {
    fn from(criterion: Criterion<'a>) -> Self {
        Weighted { criterion, weight: None }
    }
}

impl Weighted<'_> {
    /// The priority of a cell: larger is split sooner. Never negative, never NaN.
    #[inline]
    pub fn priority(&self, cell: &CellView<'_>) -> f64 {
        let raw = match self.criterion {
            Criterion::Contrast => cell.contrast(),
            Criterion::Value => cell.mean().abs(),
            Criterion::Deviation => cell.variance().sqrt(),
            Criterion::Unresolved => cell.unresolved() * cell.area.sqrt(),
            Criterion::User(f) => f(cell),
        };
        let p = raw * cell.area * self.weight.map_or(1.0, |w| w(cell.at));
        // Also for NaN.
        if p > 0.0 { p } else { 0.0 }
    }
}
