//! How errors fall with the number of evaluations, and the report's two expectations of section 3.2.

use hemiquad::method::*;
use hemiquad::suite::disks;
use hemiquad::{Criterion, Estimate, Key, Method, Probe, Uv, Workspace};
use std::f64::consts::PI;

fn rmse(runs: u64, exact: f64, mut one: impl FnMut(Key) -> Estimate<f64>) -> f64 {
    ((0..runs).map(|r| (one(Key::new(31).with(r)).value - exact).powi(2)).sum::<f64>() / runs as f64).sqrt()
}

/// Slope of the least-squares line through log error over log n.
fn slope(n: &[u32], error: &[f64]) -> f64 {
    let x: Vec<f64> = n.iter().map(|n| (*n as f64).ln()).collect();
    let y: Vec<f64> = error.iter().map(|e| e.ln()).collect();
    let (mx, my) = (x.iter().sum::<f64>() / x.len() as f64, y.iter().sum::<f64>() / y.len() as f64);
    let xy: f64 = x.iter().zip(&y).map(|(a, b)| (a - mx) * (b - my)).sum();
    xy / x.iter().map(|a| (a - mx) * (a - mx)).sum::<f64>()
}

fn disk(p: Uv<f64>) -> f64 {
    if (p.u - 0.43).hypot(p.v - 0.56) < 0.31 { 1.0 } else { 0.0 }
}

const BUDGETS: [u32; 5] = [64, 256, 1024, 4096, 16384];

#[test]
fn slopes_on_smooth_integrands() {
    let exact = (std::f64::consts::E - 1.0).powi(2);
    let mut work = Workspace::new();
    let mut measure = |m: &dyn Method<f64>| {
        let error = BUDGETS.map(|n| {
            rmse(40, exact, |k| m.integrate(&mut |p: &Probe| (p.uv.u + p.uv.v).exp(), n, k, &mut work))
        });
        println!("{}: {error:.5?}", m.name());
        slope(&BUDGETS, &error)
    };
    let (jitter, sobol, order_two) = (measure(&Jittered), measure(&Sobol), measure(&Interlaced));
    println!("smooth: jittered {jitter:.2}, Sobol' {sobol:.2}, interlaced {order_two:.2}");
    assert!((jitter + 1.0).abs() < 0.1, "{jitter}");
    assert!(sobol < -1.4, "{sobol}");
    // 40 runs leave a slope uncertain by 0.03.
    assert!(order_two < -1.5 - 0.12, "{order_two}");
}

#[test]
fn slopes_on_the_indicator_of_a_disk() {
    let exact = PI * 0.31 * 0.31;
    let mut work = Workspace::new();
    let jittered = BUDGETS
        .map(|n| rmse(40, exact, |k| Jittered.integrate(&mut |p: &Probe| disk(p.uv), n, k, &mut work)));
    // Trained on four times as many samples from elsewhere, in four rounds.
    let trained = BUDGETS.map(|n| {
        rmse(40, exact, |k| {
            let mut t = Trained::new();
            t.start(2);
            for round in 0..4 {
                t.learn(&mut |p: &Probe| disk(p.uv), n, 2 * n, k.with(round), Default::default());
            }
            Predicted::from_partition(&t).integrate(&mut |p: &Probe| disk(p.uv), n, k, &mut work)
        })
    });
    let two_stage = BUDGETS.map(|n| {
        rmse(40, exact, |k| TwoStage::blind().integrate(&mut |p: &Probe| disk(p.uv), n, k, &mut work))
    });
    let s = [slope(&BUDGETS, &jittered), slope(&BUDGETS, &trained), slope(&BUDGETS, &two_stage)];
    println!("disk: jittered {jittered:.5?} slope {:.2}", s[0]);
    println!("disk: trained {trained:.5?} slope {:.2}", s[1]);
    println!("disk: two-stage {two_stage:.5?} slope {:.2}", s[2]);
    assert!((s[0] + 0.75).abs() < 0.1, "{}", s[0]);
    assert!(s[1] <= -1.2, "{}", s[1]);
    assert!(s[2] <= -1.2, "{}", s[2]);
}

/// A bright feature of area 0.04 with `teeth` around a circle: the boundary grows with them, the area stays.
fn ragged(teeth: f64) -> impl Fn(Uv<f64>) -> f64 {
    move |p: Uv<f64>| {
        let (x, y) = (p.u - 0.47, p.v - 0.52);
        // r² = a (1 + 0.8 sin(teeth φ)) has area π a whatever the teeth.
        let a = 0.04 / PI;
        if x * x + y * y < a * (1.0 + 0.8 * (teeth * y.atan2(x)).sin()) { 1.0 } else { 0.0 }
    }
}

/// Relative RMSE when cells are chosen by contrast and by value: one-stage, and as the pilot of two stages.
fn contrast_and_value(teeth: f64, n: u32, work: &mut Workspace<f64>) -> [f64; 4] {
    let f = ragged(teeth);
    let mut of = |criterion: Criterion<'_>, two: bool| {
        let one_stage = PainterSloan { criterion: criterion.into(), ..Default::default() };
        let two_stage = TwoStage { criterion: criterion.into(), ..TwoStage::blind() };
        let m: &dyn Method<f64> = if two { &two_stage } else { &one_stage };
        rmse(60, 0.04, |k| m.integrate(&mut |p: &Probe| f(p.uv), n, k, work)) / 0.04
    };
    let (contrast, value) = (Criterion::Contrast, Criterion::Value);
    [of(contrast, false), of(value, false), of(contrast, true), of(value, true)]
}

#[test]
fn contrast_wins_on_compact_luminaires_and_its_lead_shrinks_as_they_get_ragged() {
    // Report, section 3.2: "in this case we might as well give up, and just sample where it is bright".
    let mut work = Workspace::new();
    let mut ratio = Vec::new();
    for teeth in [0.0, 4.0, 16.0, 64.0, 256.0, 1024.0] {
        let [c, v, c2, v2] = contrast_and_value(teeth, 1024, &mut work);
        println!(
            "teeth {teeth}: one-stage contrast {c:.4} value {v:.4} ratio {:.2}; two-stage contrast {c2:.4} value {v2:.4} ratio {:.2}",
            v / c,
            v2 / c2
        );
        ratio.push((v / c, v2 / c2));
    }
    // One-stage, value never wins: cells that are dark by chance are never looked at again.
    assert!(ratio.iter().all(|r| r.0 > 5.0) && ratio[5].0 < 0.5 * ratio[0].0, "{ratio:?}");
    // With fresh samples the lead of contrast falls as the boundary grows.
    assert!(ratio[0].1 > 1.5 && ratio[5].1 < 0.6 * ratio[0].1, "{ratio:?}");
}

#[test]
fn delaunay_against_quadtree() {
    // Report, section 3.2: "We believe that the improvements will only be incremental".
    let mut work = Workspace::new();
    for area in [1e-1, 1e-2, 1e-3] {
        let r = (area / PI).sqrt();
        let at = |k: Key| {
            let p = k.uniform2_f64(3);
            disks(vec![(Uv::new(r + (1.0 - 2.0 * r) * p.u, r + (1.0 - 2.0 * r) * p.v), r, 1.0)], 0.5)
        };
        let exact = 0.5 * (1.0 - area) + 1.0;
        let mut of = |m: &dyn Method<f64>| rmse(100, exact, |k| m.integrate(&mut &at(k), 400, k, &mut work));
        let quadtree = of(&PainterSloan::default());
        let delaunay = of(&DelaunayAdaptive::default());
        let shrinking = of(&Shrinking::default());
        let both = of(&Shrinking { on: ShrinkingOn::Delaunay, ..Default::default() });
        println!(
            "A = {area}: quadtree {quadtree:.4} Delaunay {delaunay:.4} | shrinking: quadtree {shrinking:.4} Delaunay {both:.4}"
        );
        if area >= 1e-2 {
            // Found by both: several times better, which is more than incremental; shrinking has nothing to add.
            assert!(
                delaunay < 0.5 * quadtree && both < 0.7 * shrinking,
                "{delaunay} {quadtree} {both} {shrinking}"
            );
        } else {
            // Missed by both: the partition hardly matters, shrinking does.
            assert!((delaunay / quadtree - 1.0).abs() < 0.25, "{delaunay} {quadtree}");
            assert!(shrinking < 0.25 * quadtree && both < 0.25 * quadtree, "{shrinking} {both} {quadtree}");
        }
    }
}
