//! No heap calls once a workspace has served a call: counted by an allocator.

use allocation_counter::measure;
use hemiquad::method::*;
use hemiquad::{Criterion, Key, Method, Probe, Region, Shape, Uv, Workspace};

fn calls(m: &dyn Method<f64>) -> (u64, u64) {
    let mut work = Workspace::new();
    let mut f = |p: &Probe| if (p.uv.u - 0.4).hypot(p.uv.v - 0.6) < 0.1 { 5.0 + p.uv.u } else { p.uv.v };
    let mut go = |key| {
        let e = m.integrate(&mut f, 1024, Key::new(key), &mut work);
        assert!(e.value.is_finite());
    };
    let first = measure(|| go(0)).count_total;
    // Other keys make somewhat other trees: let the buffers see a few of them.
    (1..40).for_each(&mut go);
    let later = measure(|| (40..60).for_each(&mut go)).count_total;
    (first, later)
}

#[test]
fn no_heap_calls_after_warm_up() {
    let regions = [Region { shape: Shape::Disk { centre: Uv::new(0.4, 0.6), radius: 0.12 }, weight: 1.0 }];
    let history = History::new(1);
    let mut trained = Trained::new();
    for i in 0..2000u64 {
        let p = Key::new(1).with(i).uniform2_f64(0);
        trained.add(p, p.u);
    }
    trained.refine(256, 4);
    trained.finish(Default::default());
    let methods: [&dyn Method<f64>; 21] = [
        &Jittered,
        &Sobol,
        &Interlaced,
        &ProductGauss::default(),
        &DirectIndirect::new(&regions),
        &ShirleyWang::new(&regions),
        &KirkArvo::new(&regions),
        &WardShadows { luminaires: &regions, tolerance: 0.1, history: &history },
        &PainterSloan::default(),
        &BeyerLange::default(),
        &Enlarged { k: 2.0, inner: Jittered },
        &Shrinking::default(),
        &TwoStage::default(),
        &Sequential::default(),
        &Predicted::from_regions(&regions),
        &Predicted::from_partition(&trained),
        &LinearControl::default(),
        &GenzMalik::default(),
        &DelaunayAdaptive { criterion: Criterion::Contrast.into() },
        &Glassner { criterion: Criterion::Contrast.into() },
        &Shrinking { on: ShrinkingOn::Delaunay, ..Default::default() },
    ];
    for m in methods {
        let (first, later) = calls(m);
        assert!(first > 0, "{}: the counter counts", m.name());
        assert_eq!(later, 0, "{}", m.name());
    }
}
