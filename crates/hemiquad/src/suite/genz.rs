//! Genz's six families on the unit square, and cases on which libraries have been seen to fail.

use super::{Class, Instance, Problem, disks};
use crate::map::Uv;
use crate::points::Key;
use std::f64::consts::PI;

/// Parameters: difficulty c and offset w per coordinate.
#[derive(Clone, Copy)]
struct Parameters {
    c: [f64; 2],
    w: [f64; 2],
}

/// Random parameters with Σ c = `difficulty`.
fn draw(difficulty: f64, key: Key) -> Parameters {
    let a = key.uniform2_f64(0);
    let (x, y) = (0.2 + a.u, 0.2 + a.v);
    let k = difficulty / (x + y);
    let w = key.uniform2_f64(1);
    Parameters { c: [x * k, y * k], w: [w.u, w.v] }
}

/// Abramowitz and Stegun will not do to double precision: erf by its series and continued fraction.
fn erf(x: f64) -> f64 {
    let a = x.abs();
    let value = if a < 3.0 {
        let (mut term, mut sum, mut n) = (a, a, 0.0);
        while term.abs() > 1e-17 * sum.abs() && n < 200.0 {
            n += 1.0;
            term *= -a * a / n;
            sum += term / (2.0 * n + 1.0);
        }
        sum * 2.0 / PI.sqrt()
    } else {
        let mut t = 0.0;
        for k in (1..=60).rev() {
            t = 0.5 * k as f64 / (a + t);
        }
        1.0 - (-a * a).exp() / (PI.sqrt() * (a + t))
    };
    value.copysign(x)
}

fn oscillatory(q: Parameters) -> Instance {
    let Parameters { c, w } = q;
    // Re e^{2πi w} Π (e^{ic} - 1)/(ic) = Π sinc(c/2) · cos(2πw + Σ c/2).
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { x.sin() / x };
    let exact = sinc(0.5 * c[0]) * sinc(0.5 * c[1]) * (2.0 * PI * w[0] + 0.5 * (c[0] + c[1])).cos();
    Instance::plain(exact, move |p| (2.0 * PI * w[0] + c[0] * p.u + c[1] * p.v).cos())
}

fn product_peak(q: Parameters) -> Instance {
    let Parameters { c, w } = q;
    let exact = (0..2).map(|i| c[i] * ((c[i] * (1.0 - w[i])).atan() + (c[i] * w[i]).atan())).product();
    Instance::plain(exact, move |p| {
        let f = |x: f64, i: usize| 1.0 / (1.0 / (c[i] * c[i]) + (x - w[i]) * (x - w[i]));
        f(p.u, 0) * f(p.v, 1)
    })
}

fn corner_peak(q: Parameters) -> Instance {
    let Parameters { c, .. } = q;
    let exact =
        (1.0 - 1.0 / (1.0 + c[0]) - 1.0 / (1.0 + c[1]) + 1.0 / (1.0 + c[0] + c[1])) / (2.0 * c[0] * c[1]);
    Instance::plain(exact, move |p| (1.0 + c[0] * p.u + c[1] * p.v).powi(-3))
}

fn gaussian(q: Parameters) -> Instance {
    let Parameters { c, w } = q;
    let one = |i: usize| PI.sqrt() / (2.0 * c[i]) * (erf(c[i] * (1.0 - w[i])) + erf(c[i] * w[i]));
    Instance::plain(one(0) * one(1), move |p| {
        let (a, b) = (c[0] * (p.u - w[0]), c[1] * (p.v - w[1]));
        (-a * a - b * b).exp()
    })
}

fn continuous(q: Parameters) -> Instance {
    let Parameters { c, w } = q;
    let one = |i: usize| (2.0 - (-c[i] * w[i]).exp() - (-c[i] * (1.0 - w[i])).exp()) / c[i];
    Instance::plain(one(0) * one(1), move |p| (-c[0] * (p.u - w[0]).abs() - c[1] * (p.v - w[1]).abs()).exp())
}

fn discontinuous(q: Parameters) -> Instance {
    let Parameters { c, w } = q;
    let one = |i: usize| ((c[i] * w[i].min(1.0)).exp() - 1.0) / c[i];
    Instance::plain(one(0) * one(1), move |p| {
        if p.u <= w[0] && p.v <= w[1] { (c[0] * p.u + c[1] * p.v).exp() } else { 0.0 }
    })
}

/// (exact, a midpoint-rule value) of the six families at c = (3, 2), w = (0.3, 0.6): for tests.
pub fn genz_spot_values() -> Vec<(f64, f64)> {
    let q = Parameters { c: [3.0, 2.0], w: [0.3, 0.6] };
    [oscillatory, product_peak, corner_peak, gaussian, continuous, discontinuous]
        .map(|f| {
            let i = f(q);
            let n = 1000;
            let at = |k: usize| {
                crate::Probe::at(Uv::new(
                    ((k % n) as f64 + 0.5) / n as f64,
                    ((k / n) as f64 + 0.5) / n as f64,
                ))
            };
            let sum: f64 = (0..n * n).map(|k| (i.function)(&at(k))).sum();
            (i.exact, sum / (n * n) as f64)
        })
        .to_vec()
}

/// A convex polygon by its corners, counter-clockwise: the indicator of its inside.
fn polygon(corners: Vec<Uv<f64>>) -> Instance {
    let n = corners.len();
    let area: f64 = (0..n)
        .map(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % n]);
            0.5 * (a.u * b.v - b.u * a.v)
        })
        .sum();
    Instance::plain(area, move |p| {
        let inside = (0..n).all(|i| {
            let (a, b) = (corners[i], corners[(i + 1) % n]);
            (b.u - a.u) * (p.v - a.v) - (b.v - a.v) * (p.u - a.u) >= 0.0
        });
        if inside { 1.0 } else { 0.0 }
    })
}

pub(super) fn problems() -> Vec<Problem> {
    use Class::*;
    macro_rules! p {
        ($name:expr, $class:expr, $make:expr) => {
            Problem { name: $name, class: $class, make: $make }
        };
    }
    vec![
        p!("G1 oscillatory", Smooth, |k| {
            // Kept away from zeros of the integral, so that relative errors mean something.
            let mut i = oscillatory(draw(9.0, k));
            let mut n = 0;
            while i.exact.abs() < 0.02 {
                n += 1;
                i = oscillatory(draw(9.0, k.with(n)));
            }
            i
        }),
        p!("G2 product peak", Smooth, |k| product_peak(draw(14.5, k))),
        p!("G3 corner peak", Smooth, |k| corner_peak(draw(5.0, k))),
        p!("G4 gaussian", Smooth, |k| gaussian(draw(14.0, k))),
        p!("G5 continuous", Rough, |k| continuous(draw(20.0, k))),
        p!("G6 discontinuous", Edge, |k| {
            // The box is kept from vanishing.
            let q = draw(8.0, k);
            discontinuous(Parameters { w: q.w.map(|w| 0.2 + 0.6 * w), ..q })
        }),
        p!("kinked maximum", Rough, |_| Instance::plain(KINKED, |p| p
            .u
            .max(p.v)
            .max((1.0 - p.u) * (1.0 - p.v)))),
        p!("polygon", Edge, |k| {
            let turn = k.uniform64(0) * PI;
            polygon(
                (0..5)
                    .map(|i| (turn + 2.0 * PI * i as f64 / 5.0).sin_cos())
                    .map(|(s, c)| Uv::new(0.5 + 0.45 * c, 0.5 + 0.45 * s))
                    .collect(),
            )
        }),
        p!("aliased sine", Smooth, |_| Instance::plain(0.5, |p| (2.0 * PI * 32.0 * p.u).sin().powi(2))),
        p!("two patches", Compact, |k| {
            let place = |i| {
                let p = k.with(i).uniform2_f64(0);
                Uv::new(0.02 + 0.46 * p.u, 0.02 + 0.96 * p.v)
            };
            let (a, b) = (place(0), place(1));
            disks(vec![(a, 0.01, 0.6), (Uv::new(b.u + 0.5, b.v), 0.01, 0.4)], 0.0)
        }),
        p!("far-flung shell", Rough, |_| Instance::plain(1.0, |p| {
            // |x|² exp(-|x|²)/π over [-100, 100]².
            let (x, y) = (200.0 * p.u - 100.0, 200.0 * p.v - 100.0);
            let r2 = x * x + y * y;
            40_000.0 * r2 * (-r2).exp() / PI
        })),
    ]
}

/// ∫∫ max(x, y, (1-x)(1-y)).
const KINKED: f64 = 0.728_737_532_479_6;
