//! hemiquad's rows of the comparison with other libraries: the same integrands and budgets as `bench/hemiquad/rivals.py`.
//!
//! Relative RMSE over 20 keys at 1024 and 16384 evaluations, and honesty: how often the 95 % interval held.

use hemiquad::method::*;
use hemiquad::suite::{Instance, disks};
use hemiquad::{Key, Method, Probe, Region, Uv, Workspace};
use std::f64::consts::PI;

const RUNS: u64 = 20;

type Function = Box<dyn Fn(&Probe) -> f64>;

struct Case {
    name: &'static str,
    exact: f64,
    f: Function,
    features: Vec<Region>,
}

fn plain(name: &'static str, exact: f64, f: impl Fn(f64, f64) -> f64 + 'static) -> Case {
    Case { name, exact, f: Box::new(move |p| f(p.uv.u, p.uv.v)), features: Vec::new() }
}

fn from(name: &'static str, i: Instance) -> Case {
    Case { name, exact: i.exact, features: i.features.clone(), f: i.function }
}

fn cases() -> Vec<Case> {
    let spot = |x: f64, y: f64, u: f64, v: f64| (-900.0 * ((x - u).powi(2) + (y - v).powi(2))).exp();
    // Both spots lie so far inside that the error function is 1 to the last digit.
    let spots = 2.0 * PI / 900.0;
    let r = (1e-3 / PI).sqrt();
    // √π/(2c) [erf(c(1-w)) + erf(cw)] at (9, 0.3) and (5, 0.6).
    let erf_part = [0.196_926_089_068_267_86, 0.353_657_747_804_388_6];
    vec![
        plain("gaussian", erf_part[0] * erf_part[1], |x, y| {
            (-81.0 * (x - 0.3).powi(2) - 25.0 * (y - 0.6).powi(2)).exp()
        }),
        plain("discontinuous", (0.9f64.exp() - 1.0) / 3.0 * (1.2f64.exp() - 1.0) / 2.0, |x, y| {
            if x <= 0.3 && y <= 0.6 { (3.0 * x + 2.0 * y).exp() } else { 0.0 }
        }),
        plain("kinked maximum", 0.728_737_532_479_6, |x, y| x.max(y).max((1.0 - x) * (1.0 - y))),
        plain("disk", PI * 0.31 * 0.31, |x, y| if (x - 0.43).hypot(y - 0.56) < 0.31 { 1.0 } else { 0.0 }),
        plain("aliased sine", 0.5, |x, _| (2.0 * PI * 32.0 * x).sin().powi(2)),
        plain("two spots on a diagonal", spots, move |x, y| spot(x, y, 0.23, 0.23) + spot(x, y, 0.74, 0.74)),
        from("pixel 1e-3", disks(vec![(Uv::new(0.43, 0.58), r, 1.0)], 0.5)),
        from(
            "two patches",
            disks(vec![(Uv::new(0.213, 0.377), 0.01, 0.6), (Uv::new(0.718, 0.641), 0.01, 0.4)], 0.0),
        ),
    ]
}

fn main() {
    println!("| integrand | method | RMSE 1024 | honest | RMSE 16384 | honest |");
    println!("| --- | --- | --- | --- | --- | --- |");
    let mut work = Workspace::new();
    for case in cases() {
        let wide: Vec<Region> = (0..)
            .zip(&case.features)
            .map(|(j, r)| Region { shape: r.shape.misplaced(2.0, Key::new(j)), ..*r })
            .collect();
        let two = TwoStage::default();
        let told = Predicted::<f64>::from_regions(&wide);
        let (blind, sequential) = (TwoStage::blind(), Sequential::default());
        let (linear, cubature) = (LinearControl::default(), GenzMalik::default());
        let always: [&dyn Method<f64>; 6] = [&Sobol, &Interlaced, &blind, &sequential, &linear, &cubature];
        let mut methods: Vec<(String, &dyn Method<f64>)> =
            always.into_iter().map(|m| (m.name().to_string(), m)).collect();
        if !wide.is_empty() {
            methods.push(("TwoStage, features may be enlarged".into(), &two));
            methods.push(("Predicted regions, told where (twice too wide)".into(), &told));
        }
        for (name, m) in methods {
            let mut cells = Vec::new();
            for n in [1024, 16384] {
                let (mut square, mut honest) = (0.0, 0);
                for k in 0..RUNS {
                    let e = m.integrate(&mut |p: &Probe| (case.f)(p), n, Key::new(k), &mut work);
                    let d = (e.value - case.exact).abs();
                    square += d * d;
                    honest += u64::from(e.half_width_95().is_some_and(|h| d <= h + 1e-13 * case.exact));
                }
                let rmse = (square / RUNS as f64).sqrt() / case.exact;
                cells.push(format!("{rmse:.1e} | {} %", 100 * honest / RUNS));
            }
            println!("| {} | hemiquad {name} | {} |", case.name, cells.join(" | "));
        }
    }
}
