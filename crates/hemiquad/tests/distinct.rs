//! Every pair of methods differs in something that can be measured, by more than chance: none is a thin name over another.
//!
//! What is measured, over 60 keys: where the samples go (edge, bright side, luminaires), which of them are pilots or ask for larger
//! luminaires, how many there are, how large the errors are on four integrands and how large they are claimed to be. A name over another
//! method would agree in all of it, even if it drew other numbers.

use hemiquad::map::{Concentric, Map};
use hemiquad::method::*;
use hemiquad::partition::Parent;
use hemiquad::{Criterion, Dir, Integrand, Key, Method, Probe, Region, Shape, Size, Stage, Uv, Workspace};

const RUNS: u64 = 60;
const BUDGET: u32 = 512;

const LAMP: Shape = Shape::Disk { centre: Uv { u: 0.62, v: 0.31 }, radius: 0.03 };

/// A lamp with a fiftieth of the light of the first.
const DIM: Shape = Shape::Disk { centre: Uv { u: 0.2, v: 0.8 }, radius: 0.05 };

/// Two lamps on a step: an edge at u = 0.4, dark to its left.
fn scene(p: &Probe) -> f64 {
    let r = match p.size {
        Size::True => 0.03,
        Size::Times(k) => 0.03 * k.sqrt(),
        Size::AtLeast(least) => least.max(0.03),
    };
    let lit = (p.uv.u - 0.62).hypot(p.uv.v - 0.31) <= r;
    let step = if p.uv.u > 0.4 { 1.0 } else { 0.1 };
    let dim = if DIM.contains(p.uv) { 0.01 / DIM.area() } else { 0.0 };
    step + dim + if lit { 0.5 / (std::f64::consts::PI * r * r) } else { 0.0 }
}

/// One number per run, and whether it is an error (compared by size) or a share or count (compared by mean).
struct Feature {
    values: Vec<f64>,
    error: bool,
}

type Function<'a> = &'a dyn Fn(&Probe) -> f64;

/// One integral by the method in question.
type One<'a> = &'a dyn Fn(&mut dyn Integrand<f64>, Key, &mut Workspace<f64>) -> Run;

fn features(run: One<'_>) -> Vec<Feature> {
    let mut work = Workspace::new();
    let mut shares: Vec<Feature> = (0..9).map(|_| Feature { values: Vec::new(), error: false }).collect();
    for k in 0..RUNS {
        let mut seen = Vec::new();
        let mut record = |p: &Probe| {
            seen.push(*p);
            scene(p)
        };
        let r = run(&mut record, Key::new(k), &mut work);
        let share = |keep: &dyn Fn(&Probe) -> bool| {
            seen.iter().filter(|p| keep(p)).count() as f64 / seen.len().max(1) as f64
        };
        let measured = [
            share(&|p| (p.uv.u - 0.4).abs() < 0.03),
            share(&|p| p.uv.u > 0.4),
            share(&|p| LAMP.contains(p.uv)),
            share(&|p| DIM.contains(p.uv)),
            share(&|p| p.stage == Stage::Pilot),
            share(&|p| p.size != Size::True),
            share(&|p| Concentric.dir(p.uv).z < 0.02),
            seen.len() as f64,
            r.claimed,
        ];
        shares.iter_mut().zip(measured).for_each(|(f, x)| f.values.push(x));
    }
    let smooth = |p: &Probe| (p.uv.u + p.uv.v).exp();
    let plane = |p: &Probe| 1.0 + p.uv.u - 0.5 * p.uv.v;
    let cosine = |p: &Probe| {
        let d: Dir<f64> = Concentric.dir(p.uv);
        d.z
    };
    let lamp = 0.1 * 0.4 + 0.6 + 0.5 + 0.01;
    let integrands: [(Function<'_>, f64); 4] =
        [(&smooth, (std::f64::consts::E - 1.0).powi(2)), (&plane, 1.25), (&cosine, 0.5), (&scene, lamp)];
    for (f, exact) in integrands {
        let one = |k| run(&mut |p: &Probe| f(p), Key::new(k), &mut work).value - exact;
        shares.push(Feature { values: (0..RUNS).map(one).collect(), error: true });
    }
    shares
}

struct Run {
    value: f64,
    /// Standard error; -1 for none.
    claimed: f64,
}

/// Whether two features differ by more than chance.
fn differ(a: &Feature, b: &Feature) -> bool {
    let n = RUNS as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    if a.error {
        // The logarithm of an RMSE is uncertain by about 0.1 here: five standard deviations of a difference. Rounding is one thing.
        let rms = |x: &[f64]| mean(&x.iter().map(|e| e * e).collect::<Vec<_>>()).sqrt().max(1e-11);
        return (rms(&a.values) / rms(&b.values)).ln().abs() > 0.7;
    }
    let variance = |x: &[f64]| {
        let m = mean(x);
        x.iter().map(|v| (v - m).powi(2)).sum::<f64>() / (n - 1.0) / n
    };
    let apart = (mean(&a.values) - mean(&b.values)).abs();
    apart > 5.0 * (variance(&a.values) + variance(&b.values)).sqrt() + 1e-9
}

#[test]
fn every_pair_of_methods_can_be_told_apart() {
    // The first is told as two that overlap: the methods for known luminaires differ in who owns what.
    let beside = Shape::Disk { centre: Uv::new(0.64, 0.31), radius: 0.03 };
    let lamps = [(LAMP, 0.3), (beside, 0.2), (DIM, 0.01)].map(|(shape, weight)| Region { shape, weight });
    let wide = [Region { shape: Shape::Disk { centre: Uv::new(0.63, 0.32), radius: 0.06 }, weight: 0.5 }];
    let history = History::new(1);
    let mut trained = Trained::new();
    for round in 0..3 {
        trained.learn(&mut |p: &Probe| scene(p), 1024, 512, Key::new(900 + round), Default::default());
    }
    let painter =
        |criterion: Criterion<'static>, parent| PainterSloan { criterion: criterion.into(), parent };
    let (contrast, value) = (Criterion::Contrast, Criterion::Value);
    let methods: Vec<(&str, Box<dyn Method<f64> + '_>)> = vec![
        ("Jittered", Box::new(Jittered)),
        ("Sobol'", Box::new(Sobol)),
        ("Interlaced", Box::new(Interlaced)),
        ("ProductGauss square", Box::new(ProductGauss { rule: ProductRule::Square })),
        ("ProductGauss hemisphere", Box::new(ProductGauss { rule: ProductRule::Hemisphere })),
        ("DirectIndirect", Box::new(DirectIndirect::new(&lamps))),
        ("WardShadows", Box::new(WardShadows { luminaires: &lamps, tolerance: 0.2, history: &history })),
        ("ShirleyWang", Box::new(ShirleyWang::new(&lamps))),
        ("KirkArvo", Box::new(KirkArvo::new(&lamps))),
        ("PainterSloan contrast, keep", Box::new(painter(contrast, Parent::Keep))),
        ("PainterSloan contrast, drop", Box::new(painter(contrast, Parent::Drop))),
        ("PainterSloan value, keep", Box::new(painter(value, Parent::Keep))),
        ("PainterSloan value, drop", Box::new(painter(value, Parent::Drop))),
        ("Glassner", Box::new(Glassner::default())),
        ("BeyerLange", Box::new(BeyerLange::default())),
        ("Delaunay", Box::new(DelaunayAdaptive::default())),
        ("Enlarged", Box::new(Enlarged { k: 4.0, inner: Jittered })),
        ("Shrinking quadtree", Box::new(Shrinking::default())),
        ("Shrinking Delaunay", Box::new(Shrinking { on: ShrinkingOn::Delaunay, ..Default::default() })),
        ("TwoStage", Box::new(TwoStage::default())),
        ("TwoStage blind", Box::new(TwoStage::blind())),
        ("Sequential", Box::new(Sequential::default())),
        ("Predicted regions", Box::new(Predicted::from_regions(&wide))),
        ("Predicted partition", Box::new(Predicted::from_partition(&trained))),
        ("LinearControl", Box::new(LinearControl::default())),
        ("GenzMalik", Box::new(GenzMalik::default())),
    ];
    let measured: Vec<_> = methods
        .iter()
        .map(|(name, m)| {
            let of = |key: u64| {
                features(&|f, k, work| {
                    let e = m.integrate(f, BUDGET, k.with(key), work);
                    Run { value: e.value, claimed: e.std_error.unwrap_or(-1.0) }
                })
            };
            (name, of(0), of(1))
        })
        .collect();
    let alike = |a: &[Feature], b: &[Feature]| !a.iter().zip(b).any(|(a, b)| differ(a, b));
    let mut same = Vec::new();
    for (i, (a, features, again)) in measured.iter().enumerate() {
        // The control: the same method with other random numbers is recognised.
        assert!(alike(features, again), "{a} does not look like itself");
        for (b, others, _) in &measured[..i] {
            if alike(features, others) {
                same.push(format!("{b} and {a}"));
            }
        }
    }
    assert!(same.is_empty(), "not told apart: {same:?}");
}
