//! Every method does something that its neighbours in the list do not: none is a thin name over another.

use hemiquad::map::Map;
use hemiquad::method::*;
use hemiquad::partition::Parent;
use hemiquad::{Criterion, Estimate, Integrand, Key, Method, Probe, Shape, Size, Stage, Uv, Workspace};

type F = dyn Fn(Uv<f64>) -> f64;

fn run(m: &dyn Method<f64>, n: u32, f: &F) -> Estimate<f64> {
    m.integrate(&mut |p: &Probe| f(p.uv), n, Key::new(12), &mut Workspace::new())
}

/// Root mean square error over 40 keys.
fn rms(m: &dyn Method<f64>, n: u32, exact: f64, f: &F) -> f64 {
    let mut work = Workspace::new();
    let square =
        |k: u64| (m.integrate(&mut |p: &Probe| f(p.uv), n, Key::new(k), &mut work).value - exact).powi(2);
    ((0..40).map(square).sum::<f64>() / 40.0).sqrt()
}

/// Every probe of one call.
fn probes(m: &dyn Method<f64>, n: u32, f: &dyn Fn(&Probe) -> f64) -> Vec<Probe> {
    let mut seen = Vec::new();
    let _ = m.integrate(
        &mut |p: &Probe| {
            seen.push(*p);
            f(p)
        },
        n,
        Key::new(5),
        &mut Workspace::new(),
    );
    seen
}

fn disk(u: f64, v: f64, radius: f64) -> Shape {
    Shape::Disk { centre: Uv::new(u, v), radius }
}

fn region(shape: Shape, weight: f64) -> Region {
    Region { shape, weight }
}

const CONTRAST: PainterSloan = PainterSloan {
    criterion: hemiquad::Weighted { criterion: Criterion::Contrast, weight: None },
    parent: Parent::Keep,
};
const VALUE: PainterSloan = PainterSloan {
    criterion: hemiquad::Weighted { criterion: Criterion::Value, weight: None },
    parent: Parent::Keep,
};

#[test]
fn jittered_puts_one_sample_in_each_cell_and_nets_of_either_order_do_better_on_smooth_integrands() {
    let count = |m: &dyn Method<f64>| {
        let mut cells = [0; 256];
        for p in probes(m, 256, &|_| 0.0) {
            cells[(p.uv.v * 16.0) as usize * 16 + (p.uv.u * 16.0) as usize] += 1;
        }
        cells.iter().all(|c| *c == 1)
    };
    assert!(count(&Jittered));
    assert!(!count(&Sobol) && !count(&CONTRAST) && !count(&LinearControl::default()));
    let f = |p: Uv<f64>| (p.u + p.v).exp();
    let exact = (std::f64::consts::E - 1.0).powi(2);
    assert!(rms(&Sobol, 8192, exact, &f) < 0.3 * rms(&Jittered, 8192, exact, &f));
    // The second order pays where there are second derivatives, and only there.
    assert!(rms(&Interlaced, 8192, exact, &f) < 0.4 * rms(&Sobol, 8192, exact, &f));
    let disk = |p: Uv<f64>| f64::from((p.u - 0.43).hypot(p.v - 0.56) < 0.31);
    let area = std::f64::consts::PI * 0.31 * 0.31;
    assert!(rms(&Interlaced, 8192, area, &disk) > 0.5 * rms(&Sobol, 8192, area, &disk));
}

#[test]
fn product_gauss_is_exact_on_its_own_polynomials() {
    let hemisphere = ProductGauss { rule: ProductRule::Hemisphere };
    let square = ProductGauss { rule: ProductRule::Square };
    // A degree-6 polynomial of the direction: exact only where cos θ and φ are integrated as such.
    let of_direction = |p: Uv<f64>| {
        let d: hemiquad::Dir<f64> = hemiquad::map::Concentric.dir(p);
        d.x.powi(4) * d.z.powi(2) + d.y * d.y
    };
    // Means over the hemisphere: <x⁴z²> = 3/8 ∫(1 - z²)² z² = 3/8 · 8/105, <y²> = 1/3.
    let exact = 3.0 / 8.0 * 8.0 / 105.0 + 1.0 / 3.0;
    assert!((run(&hemisphere, 200, &of_direction).value - exact).abs() < 1e-13);
    assert!((run(&square, 200, &of_direction).value - exact).abs() > 1e-6);
    assert!((run(&Sobol, 200, &of_direction).value - exact).abs() > 1e-6);
    let of_square = |p: Uv<f64>| p.u.powi(9) * p.v.powi(7);
    assert!((run(&square, 200, &of_square).value - 1.0 / 80.0).abs() < 1e-15);
    assert!((run(&hemisphere, 200, &of_square).value - 1.0 / 80.0).abs() > 1e-7);
}

#[test]
fn direct_indirect_adds_two_integrals_where_a_partition_integrates_one() {
    // A luminaire that also reflects: Lr = 0.5 everywhere, Le = 3 over a disk of area 0.0707.
    let lamps = [region(disk(0.4, 0.6, 0.15), 1.0)];
    let mut reflected = |_: &Probe| 0.5;
    let mut emitted = |_: &Probe| 3.0;
    let area = lamps[0].shape.area();
    let both = DirectIndirect::new(&lamps).integrate_parts(
        &mut reflected,
        &mut emitted,
        64,
        Key::new(1),
        &mut Workspace::new(),
    );
    assert!((both.value - (0.5 + 3.0 * area)).abs() < 1e-12);
    // One integrand: inside it is the luminaire that is seen.
    let f = move |p: Uv<f64>| if lamps[0].shape.contains(p) { 3.0 } else { 0.5 };
    let partition = rms(&KirkArvo::new(&lamps), 64, 0.5 + 3.0 * area, &f);
    assert!(partition > 0.4 * area, "{partition}");
}

#[test]
fn the_cost_of_shirley_wang_does_not_grow_with_the_number_of_luminaires() {
    let lamp = |i: u64| {
        let p = Key::new(3).with(i).uniform2_f64(0);
        region(disk(0.01 + 0.98 * p.u, 0.01 + 0.98 * p.v, 0.002), 1.0)
    };
    let lamps: Vec<Region> = (0..1000).map(lamp).collect();
    let f = |_: Uv<f64>| 1.0;
    assert!(run(&ShirleyWang::new(&lamps), 256, &f).evaluations.total() <= 256);
    assert!(run(&DirectIndirect::new(&lamps), 256, &f).evaluations.total() >= 2000);
    assert!(run(&KirkArvo::new(&lamps), 256, &f).evaluations.total() >= 1900);
}

#[test]
fn overlapping_regions_tell_partition_split_and_mixture_apart() {
    // The same disk twice: a partition owns it once (the second is in vain), the split and the mixture share it.
    let twice = [region(disk(0.5, 0.5, 0.2), 1.0), region(disk(0.5, 0.5, 0.2), 1.0)];
    let shape = twice[0].shape;
    let inside =
        |m: &dyn Method<f64>| probes(m, 256, &|_| 1.0).iter().filter(|p| shape.contains(p.uv)).count();
    let split = inside(&DirectIndirect::new(&twice));
    assert_eq!(inside(&KirkArvo::new(&twice)), 64);
    assert_eq!(inside(&ShirleyWang::new(&twice)), 128);
    // The split's indirect part looks everywhere: about 128 × 0.126 more of them.
    assert!((134..160).contains(&split), "{split}");
    for m in
        [&KirkArvo::new(&twice) as &dyn Method<f64>, &ShirleyWang::new(&twice), &DirectIndirect::new(&twice)]
    {
        assert!(rms(m, 256, 1.0, &|_| 1.0) < 0.04);
    }
}

#[test]
fn ward_stops_testing_when_the_rest_cannot_matter() {
    let lamps: Vec<Region> =
        (0..20).map(|i| region(disk(0.02 + 0.048 * i as f64, 0.5, 0.01), 0.5f64.powi(i))).collect();
    let lit: Vec<Region> = lamps.clone();
    let f = move |p: Uv<f64>| {
        lit.iter().map(|l| if l.shape.contains(p) { l.weight / l.shape.area() } else { 0.0 }).sum()
    };
    let exact: f64 = lamps.iter().map(|l| l.weight).sum();
    let history = History::new(20);
    let ward = WardShadows { luminaires: &lamps, tolerance: 0.05, history: &history };
    // Tested: until the untested potential 2^-k falls below a twentieth, that is five of them.
    let dim = |m: &dyn Method<f64>| {
        let last = disk(0.02 + 0.048 * 10.0, 0.5, 0.01);
        probes(m, 400, &|p| f(p.uv)).iter().filter(|p| last.contains(p.uv)).count()
    };
    assert_eq!((dim(&ward), history.visibility(10)), (0, None));
    assert!(history.visibility(0).is_some_and(|v| (v - 1.0).abs() < 1e-3));
    assert!(dim(&DirectIndirect::new(&lamps)) >= 2);
    assert!((run(&ward, 400, &f).value - exact).abs() < 1e-3 * exact);
    // Biased: the untested are taken at the visibility of the others, here wrongly.
    let some = lamps.clone();
    let blocked = move |p: Uv<f64>| {
        some.iter().take(3).map(|l| if l.shape.contains(p) { l.weight / l.shape.area() } else { 0.0 }).sum()
    };
    let e =
        run(&WardShadows { luminaires: &lamps, tolerance: 0.2, history: &History::new(20) }, 400, &blocked);
    assert!(e.biased && e.value > 1.75 + 0.1, "{}", e.value);
}

#[test]
fn contrast_goes_to_edges_and_value_to_bright_areas() {
    let f = |p: &Probe| if p.uv.u > 0.7 { 5.0 } else { 1.0 };
    let share = |m: &dyn Method<f64>, low: f64, high: f64| {
        let all = probes(m, 512, &f);
        all.iter().filter(|p| p.uv.u > low && p.uv.u < high).count() as f64 / all.len() as f64
    };
    assert!(share(&CONTRAST, 0.65, 0.75) > 0.5 && share(&CONTRAST, 0.8, 1.0) < 0.2);
    assert!(share(&VALUE, 0.65, 0.75) < 0.3 && share(&VALUE, 0.8, 1.0) > 0.3);
    assert!(share(&TwoStage::blind(), 0.65, 0.75) > share(&Jittered, 0.65, 0.75));
    // A user's criterion and a weight are obeyed.
    let left = |c: &hemiquad::CellView<'_>| 1.0 - c.at.u;
    let user = PainterSloan { criterion: Criterion::User(&left).into(), parent: Parent::Keep };
    assert!(share(&user, 0.0, 0.3) > share(&VALUE, 0.0, 0.3) + 0.2);
    let up = |p: Uv<f64>| if p.v > 0.5 { 1.0 } else { 1e-3 };
    let weighted = PainterSloan {
        criterion: hemiquad::Weighted { criterion: Criterion::Value, weight: Some(&up) },
        parent: Parent::Keep,
    };
    let above =
        |m: &dyn Method<f64>| probes(m, 512, &f).iter().filter(|p| p.uv.v > 0.5).count() as f64 / 512.0;
    assert!(above(&weighted) > 0.8 && above(&VALUE) < 0.6);
}

#[test]
fn dropping_the_parents_sample_loses_what_was_found() {
    // One bright cell of the first grid: the kept sample stays in the answer, the dropped one goes.
    let lost = |parent| {
        let m = PainterSloan { criterion: Criterion::Value.into(), parent };
        let mut work = Workspace::new();
        (0..200u64)
            .filter(|k| {
                let mut calls = 0;
                // The tenth sample is bright, wherever it falls, and nothing else is.
                let mut f = |_: &Probe| {
                    calls += 1;
                    if calls == 10 { 1.0 } else { 0.0 }
                };
                m.integrate(&mut f, 64, Key::new(*k), &mut work).value == 0.0
            })
            .count()
    };
    assert_eq!((lost(Parent::Keep), lost(Parent::Drop)), (0, 200));
}

#[test]
fn delaunay_is_exact_for_planes_and_voronoi_weights_are_areas() {
    let plane = |p: Uv<f64>| 1.0 + 2.0 * p.u - 0.5 * p.v;
    assert!((run(&DelaunayAdaptive::default(), 300, &plane).value - 1.75).abs() < 1e-12);
    for m in [&Glassner::default() as &dyn Method<f64>, &CONTRAST] {
        assert!((run(m, 300, &plane).value - 1.75).abs() > 1e-5, "{}", m.name());
    }
    // Nearest-sample weights by counting on a lattice: Glassner's answer is that, the others' is not.
    let f = |p: Uv<f64>| if p.u + p.v > 0.9 { 3.0 + p.u } else { 0.2 };
    let error = |m: &dyn Method<f64>| {
        let points = probes(m, 150, &|p| f(p.uv));
        let n = 400;
        let mut sum = 0.0;
        for i in 0..n * n {
            let (u, v) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
            let distance = |p: &Probe| (p.uv.u - u).powi(2) + (p.uv.v - v).powi(2);
            let nearest = points.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            sum += f(nearest.expect("there are samples").uv);
        }
        let e = m.integrate(&mut |p: &Probe| f(p.uv), 150, Key::new(5), &mut Workspace::new());
        (e.value - sum / (n * n) as f64).abs()
    };
    assert!(error(&Glassner::default()) < 1e-3);
    assert!(
        error(&CONTRAST) > 2e-3 && error(&DelaunayAdaptive::default()) > 2e-3,
        "{} {}",
        error(&CONTRAST),
        error(&DelaunayAdaptive::default())
    );
}

#[test]
fn beyer_lange_has_the_pole_and_the_horizon_for_vertices() {
    let special = |m: &dyn Method<f64>| {
        let dirs: Vec<hemiquad::Dir<f64>> =
            probes(m, 100, &|p| p.uv.u).iter().map(|p| hemiquad::map::Concentric.dir(p.uv)).collect();
        (dirs.iter().filter(|d| d.z > 1.0 - 1e-12).count(), dirs.iter().filter(|d| d.z < 1e-9).count())
    };
    let (pole, horizon) = special(&BeyerLange::default());
    assert!(pole == 1 && horizon >= 4);
    assert_eq!(special(&DelaunayAdaptive::default()).0, 0);
    assert_eq!(special(&Glassner::default()), (0, 0));
}

#[test]
fn enlarging_costs_what_the_report_says() {
    // E = (k - 1)A/2 (section 4).
    let (area, k) = (1e-3, 20.0);
    let r = (area / std::f64::consts::PI).sqrt();
    let instance = hemiquad::suite::disks(vec![(Uv::new(0.43, 0.58), r, 1.0)], 0.5);
    let mean = |m: &dyn Method<f64>, runs: u64| {
        let mut work = Workspace::new();
        (0..runs).map(|s| m.integrate(&mut &instance, 1024, Key::new(s), &mut work).value).sum::<f64>()
            / runs as f64
    };
    let enlarged = mean(&Enlarged { k, inner: Jittered }, 4000);
    assert!((instance.exact - enlarged - (k - 1.0) * area / 2.0).abs() < 0.004, "{enlarged}");
    assert!(
        Enlarged { k, inner: Jittered }
            .integrate(&mut &instance, 64, Key::new(0), &mut Workspace::new())
            .biased
    );
}

#[test]
fn shrinking_luminaires_shrink_and_find() {
    let r = (1e-3 / std::f64::consts::PI).sqrt();
    let instance = hemiquad::suite::disks(vec![(Uv::new(0.43, 0.58), r, 1.0)], 0.5);
    for on in [ShrinkingOn::QuadTree, ShrinkingOn::Delaunay] {
        let m = Shrinking { criterion: Criterion::Contrast.into(), on };
        let sizes: Vec<f64> = probes(&m, 1024, &|p| (instance.function)(p))
            .iter()
            .map(|p| if let Size::AtLeast(r) = p.size { r } else { 0.0 })
            .collect();
        assert!(sizes[0] > 0.05 && sizes.iter().fold(1.0f64, |m, s| m.min(*s)) < r);
        let mut work = Workspace::new();
        let found = |m: &dyn Method<f64>, work: &mut Workspace<f64>| {
            (0..100u64).filter(|k| m.integrate(&mut &instance, 1024, Key::new(*k), work).value > 1.2).count()
        };
        assert!(found(&m, &mut work) >= 98);
        assert!(found(&CONTRAST, &mut work) < 75);
    }
}

#[test]
fn pilots_are_seen_as_pilots_and_leave_no_trace() {
    // An integrand that lies to the pilot: only methods that discard their pilots are right.
    let liar = |p: &Probe| if p.stage == Stage::Pilot { 100.0 * p.uv.u.sin() } else { p.uv.u };
    let mean = |m: &dyn Method<f64>| {
        let mut work = Workspace::new();
        let mut f = liar;
        (0..400u64).map(|k| m.integrate(&mut f, 256, Key::new(k), &mut work).value).sum::<f64>() / 400.0
    };
    for (m, pilot) in [
        (&TwoStage::default() as &dyn Method<f64>, true),
        (&LinearControl::default(), true),
        (&GenzMalik::default(), true),
        (&Sequential::default(), false),
        (&Jittered, false),
    ] {
        let stages = probes(m, 256, &liar);
        assert_eq!(stages.iter().any(|p| p.stage == Stage::Pilot), pilot, "{}", m.name());
        let e = run(m, 256, &|p| p.u);
        assert_eq!(e.evaluations.pilot > 0, pilot);
        assert!(e.evaluations.total() <= 256 && !e.biased);
        let mean = mean(m);
        assert!((mean - 0.5).abs() < 0.2, "{} {mean}", m.name());
    }
}

#[test]
fn control_variates_are_exact_where_they_should_be() {
    let plane = |p: Uv<f64>| 1.0 + 2.0 * p.u - 0.5 * p.v;
    let quartic = |p: Uv<f64>| (p.u - 0.3).powi(4) + p.u * p.u * p.v * p.v;
    let quartic_exact = (0.7f64.powi(5) + 0.3f64.powi(5)) / 5.0 + 1.0 / 9.0;
    let (linear, cubature, two) = (LinearControl::default(), GenzMalik::default(), TwoStage::blind());
    let error = |m: &dyn Method<f64>, f: &F, exact: f64| (run(m, 400, f).value - exact).abs();
    assert!(error(&linear, &plane, 1.75) < 1e-12 && error(&cubature, &plane, 1.75) < 1e-12);
    assert!(error(&two, &plane, 1.75) > 1e-5);
    assert!(error(&cubature, &quartic, quartic_exact) < 1e-12);
    assert!(error(&linear, &quartic, quartic_exact) > 1e-6);
}

#[test]
fn predictions_may_be_wrong_without_harm() {
    // The prediction points elsewhere; weights stay bounded because broad samples see everything.
    let wrong = [region(disk(0.2, 0.2, 0.1), 1.0)];
    let f = |p: Uv<f64>| 1.0 + p.u;
    let m = Predicted::<f64>::from_regions(&wrong);
    assert!(rms(&m, 256, 1.5, &f) < 0.12);
    // A mixture without broad samples would not be: that is ShirleyWang's business, which splits instead.
    let inside = probes(&m, 250, &|_| 1.0).iter().filter(|p| wrong[0].shape.contains(p.uv)).count();
    assert!(inside >= 200);
    // Trained on the integrand it beats the same number of jittered samples where the integrand has an edge.
    let edge = |p: Uv<f64>| if p.u * p.u + p.v * p.v < 0.5 { 1.0 } else { 0.0 };
    let mut trained = Trained::new();
    trained.start(3);
    for i in 0..4096u64 {
        let p = Key::new(1).with(i).uniform2_f64(0);
        trained.add(p, edge(p));
    }
    trained.refine(512, 4);
    trained.finish(Default::default());
    let exact = std::f64::consts::PI / 8.0;
    assert!(
        rms(&Predicted::from_partition(&trained), 256, exact, &edge)
            < 0.5 * rms(&Jittered, 256, exact, &edge)
    );
}

#[test]
fn vectors_batches_and_channels() {
    // Disjoint supports per channel; a batch integrand; all channels integrated from the same points.
    let f = |p: Uv<f64>| {
        [if p.u < 0.5 { 1.0 } else { 0.0 }, p.v, if p.u > 0.97 && p.v > 0.97 { 1000.0 } else { 0.0 }]
    };
    let mut batch = hemiquad::Batch(|at: &[Probe], out: &mut [[f64; 3]]| {
        for (o, p) in out.iter_mut().zip(at) {
            *o = f(p.uv);
        }
    });
    let e = Sequential::default().integrate(&mut batch, 4096, Key::new(4), &mut Workspace::new());
    let half = e.half_width_95().expect("it has an error");
    for (i, exact) in [0.5, 0.5, 0.9].iter().enumerate() {
        assert!((e.value[i] - exact).abs() < 2.0 * half[i] + 1e-3, "{i}: {} ± {}", e.value[i], half[i]);
    }
    // Luminance hardly sees blue (7 %); driven by the loudest channel the blue corner is sampled better.
    let blue =
        |p: Uv<f64>| [if p.u < 0.5 { 1.0 } else { 0.0 }, 0.0, if p.u > 0.6 && p.v > 0.6 { 1.5 } else { 0.0 }];
    let mut work = Workspace::new();
    let mut loud = Workspace::new();
    let (mut by_luminance, mut by_loudest) = (0.0, 0.0);
    for k in 0..60 {
        let mut a = |p: &Probe| blue(p.uv);
        let mut b = |p: &Probe| hemiquad::Loudest(blue(p.uv));
        by_luminance +=
            (TwoStage::blind().integrate(&mut a, 512, Key::new(k), &mut work).value[2] - 0.24f64).powi(2);
        by_loudest +=
            (TwoStage::blind().integrate(&mut b, 512, Key::new(k), &mut loud).value.0[2] - 0.24f64).powi(2);
    }
    assert!(by_loudest < by_luminance, "{by_loudest} {by_luminance}");
}

#[test]
fn nothing_is_never_claimed_to_be_known() {
    // HCubature.jl's "stubborn function": two small patches, and not one sample in them. No "0 ± 0".
    let patches = |p: Uv<f64>| if (p.u - 0.31).hypot(p.v - 0.52) < 1e-4 { 1.0 } else { 0.0 };
    let methods: [&dyn Method<f64>; 13] = [
        &Jittered,
        &Sobol,
        &Interlaced,
        &ProductGauss { rule: ProductRule::Square },
        &CONTRAST,
        &VALUE,
        &Glassner::default(),
        &DelaunayAdaptive::default(),
        &BeyerLange::default(),
        &TwoStage::default(),
        &Sequential::default(),
        &LinearControl::default(),
        &GenzMalik::default(),
    ];
    for m in methods {
        let e = run(m, 500, &patches);
        assert!(e.value == 0.0 && e.std_error.is_none(), "{}: {:?}", m.name(), e);
        assert!(
            e.unexplored > 0.02 && e.unexplored_cap() < std::f64::consts::PI,
            "{}: {}",
            m.name(),
            e.unexplored
        );
        assert!(e.evaluations.total() > 0 && e.evaluations.total() <= 500);
    }
}

#[test]
fn any_budget_is_survived() {
    let lamps = [region(disk(0.5, 0.5, 0.1), 1.0)];
    let none: [Region; 0] = [];
    let history = History::new(1);
    let trained = Trained::<f64>::new();
    let methods: [&dyn Method<f64>; 21] = [
        &Jittered,
        &Sobol,
        &Interlaced,
        &ProductGauss { rule: ProductRule::Square },
        &ProductGauss { rule: ProductRule::Hemisphere },
        &CONTRAST,
        &VALUE,
        &Glassner::default(),
        &DelaunayAdaptive::default(),
        &BeyerLange::default(),
        &TwoStage::default(),
        &Sequential::default(),
        &LinearControl::default(),
        &GenzMalik::default(),
        &DirectIndirect::new(&none),
        &ShirleyWang::new(&none),
        &KirkArvo::new(&none),
        &Predicted::<f64>::from_regions(&lamps),
        &WardShadows { luminaires: &lamps, tolerance: 0.1, history: &history },
        &Shrinking::default(),
        &Predicted::from_partition(&trained),
    ];
    for m in methods {
        for n in [0, 1, 2, 3, 5, 17, 100] {
            let e = run(m, n, &|p| 1.0 + p.u);
            assert!(e.value.is_finite() && e.evaluations.total() <= n.max(40), "{} {n}: {e:?}", m.name());
            let e = run(m, n, &|_| f64::NAN);
            assert!(e.evaluations.total() <= n.max(40), "{} {n}", m.name());
        }
    }
}

#[test]
fn the_same_key_gives_the_same_bits_whatever_came_before() {
    let f = |p: Uv<f64>| (p.u * 9.0).sin() + if p.v > 0.4 { 1.0 } else { 0.0 };
    let methods: [&dyn Method<f64>; 6] = [
        &CONTRAST,
        &Glassner::default(),
        &DelaunayAdaptive::default(),
        &TwoStage::default(),
        &Sequential::default(),
        &GenzMalik::default(),
    ];
    let mut used = Workspace::new();
    for m in methods {
        let fresh = run(m, 300, &f);
        let mut g = |p: &Probe| f(p.uv);
        let mut dynamic: Box<dyn Integrand<f64>> = Box::new(&mut g);
        let _ = m.integrate(&mut *dynamic, 777, Key::new(99), &mut used);
        drop(dynamic);
        let again = m.integrate(&mut g, 300, Key::new(12), &mut used);
        assert_eq!(fresh, again, "{}", m.name());
    }
}

#[test]
fn an_interval_yields_to_what_the_training_saw() {
    // A ring as thin as a hair: of 8192 training samples about one hits it, and what is learnt is a small bright spot.
    let ring = |c: Uv<f64>| move |p: Uv<f64>| f64::from(((p.u - c.u).hypot(p.v - c.v) - 0.3).abs() < 3.2e-5);
    let ring_area = 2.0 * std::f64::consts::PI * 0.3 * 6.4e-5;
    // What is learnt of a small luminaire looks the same, and is all there is.
    let spot = |c: Uv<f64>| move |p: Uv<f64>| f64::from((p.u - c.u).hypot(p.v - c.v) < 0.02);
    let spot_area = std::f64::consts::PI * 0.02f64.powi(2);
    // Coverage among the runs that claim an interval, and the median half-width relative to the integral.
    let measure = |f: &dyn Fn(Uv<f64>) -> Box<F>, exact: f64, control: bool| {
        let mut work = Workspace::new();
        let (mut held, mut widths) = (0.0, Vec::new());
        for r in 0..60u64 {
            let key = Key::new(r).with(3);
            let c = key.uniform2_f64(0);
            let g = f(Uv::new(0.4 + 0.2 * c.u, 0.4 + 0.2 * c.v));
            let mut integrand = |p: &Probe| g(p.uv);
            let mut trained = Trained::new();
            trained.start(3);
            for (round, n) in [8192, 2048, 2048].into_iter().enumerate() {
                trained.learn(&mut integrand, n, 2048.min(n), key.with(round as u64), Default::default());
            }
            let method = Predicted { control, ..Predicted::from_partition(&trained) };
            let e = method.integrate(&mut integrand, 1024, key.with(9), &mut work);
            if let Some(h) = e.half_width_95() {
                held += f64::from((e.value - exact).abs() <= h);
                widths.push(h / exact);
            }
        }
        widths.sort_by(f64::total_cmp);
        (held / widths.len() as f64, widths[widths.len() / 2])
    };
    let (rings, _) = measure(&|c| Box::new(ring(c)), ring_area, true);
    // The control: without the witness.
    let (deaf, _) = measure(&|c| Box::new(ring(c)), ring_area, false);
    let (spots, width) = measure(&|c| Box::new(spot(c)), spot_area, true);
    println!(
        "ring {:.0} %, without the training's word {:.0} %, spot {:.0} %, wide {width:.4}",
        1e2 * rings,
        1e2 * deaf,
        1e2 * spots
    );
    assert!(rings > 0.85 && deaf < 0.5, "{rings} {deaf}");
    assert!(spots > 0.85 && width < 0.02, "{spots} {width}");
}

#[test]
fn outlines_are_the_cells_that_the_areas_speak_of() {
    let mut f = |p: &Probe| f64::from((p.uv.u - 0.4).hypot(p.uv.v - 0.6) < 0.2);
    let mut work = Workspace::new();
    let shoelace = |p: &[Uv<f64>]| -> f64 {
        let twice = |i: usize| {
            let (a, b) = (p[i], p[(i + 1) % p.len()]);
            a.u * b.v - b.u * a.v
        };
        0.5 * (0..p.len()).map(twice).sum::<f64>().abs()
    };
    let methods: [(&dyn Method<f64>, f64); 5] = [
        (&CONTRAST, 1e-12),
        (&Glassner::default(), 1e-12),
        (&DelaunayAdaptive::default(), 1e-12),
        (&TwoStage::blind(), 1e-12),
        // Arcs are drawn as chains of chords.
        (&BeyerLange::default(), 2e-3),
    ];
    for (m, tolerance) in methods {
        let _ = m.integrate(&mut f, 256, Key::new(3), &mut work);
        let (mut cells, mut sum) = (0, 0.0);
        work.outlines(m.leaves().unwrap(), &mut |polygon, area| {
            cells += 1;
            sum += area;
            assert!((shoelace(polygon) - area).abs() < tolerance, "{}", m.name());
        });
        assert!(cells > 40 && (sum - 1.0).abs() < 1e-9, "{}: {cells} cells, {sum}", m.name());
    }
    assert!(Method::<f64>::leaves(&Jittered).is_none());
}
