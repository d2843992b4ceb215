//! What is integrated: a function of probes, one by one or in batches, that may know in which stage it is called.

use crate::map::{Dir, Map, Uv};
use crate::value::Value;

/// What an evaluation is for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// It only shapes the strata: the integrand may answer with a cheaper or smoother stand-in, for example enlarged luminaires.
    Pilot,
    /// Its value becomes part of the estimate.
    #[default]
    Estimate,
}

/// How large the integrand's small bright features (luminaires) should be taken, their flux being kept. An integrand that
/// has no such features, or does not know them, ignores this.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Size {
    /// As they are.
    #[default]
    True,
    /// This many times their area, and as many times less bright: the report's enlarged luminaires (section 4).
    Times(f64),
    /// So large that every point of the square within this distance of a feature's centre is lit by it, and as much less bright:
    /// the report's shrinking luminaires (section 4).
    AtLeast(f64),
}

/// Where to evaluate, and why.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probe {
    /// The point of the unit square.
    pub uv: Uv<f64>,
    /// What the value is for.
    pub stage: Stage,
    /// How large small features should be taken.
    pub size: Size,
}

impl Probe {
    /// A probe at true size for the estimate.
    #[inline]
    pub fn at(uv: Uv<f64>) -> Self {
        Probe { uv, ..Probe::default() }
    }
}

/// A function over the unit square. Closures `FnMut(&Probe) -> V` are integrands; [`Batch`] wraps one that takes many at once.
pub trait Integrand<V> {
    /// Writes the value at every probe; both slices have the same length.
    fn eval(&mut self, at: &[Probe], out: &mut [V]);
}

impl<V, F: FnMut(&Probe) -> V> Integrand<V> for F {
    #[inline]
    fn eval(&mut self, at: &[Probe], out: &mut [V]) {
        for (o, p) in out.iter_mut().zip(at) {
            *o = self(p);
        }
    }
}

/// An integrand that evaluates whole batches.
pub struct Batch<F>(pub F);

impl<V, F: FnMut(&[Probe], &mut [V])> Integrand<V> for Batch<F> {
    #[inline]
    fn eval(&mut self, at: &[Probe], out: &mut [V]) {
        (self.0)(at, out)
    }
}

/// Turns a function of directions into an integrand over the square: ∫ f dω = ∫ f(dir(u, v)) / pdf du dv.
pub fn over_directions<V: Value, M: Map<f64>>(
    map: M,
    mut f: impl FnMut(Dir<f64>) -> V,
) -> impl FnMut(&Probe) -> V {
    move |p| {
        let d = map.dir(p.uv);
        f(d).times(1.0 / map.pdf_solid_angle(d))
    }
}
