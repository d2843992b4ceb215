//! The maps and the partition's density as distributions: χ² tests, areas, Lipschitz bounds, look-ups.

use hemiquad::map::{Concentric, Cone, Cosine, GgxVisible, Map, Octant, Polar, Sphere};
use hemiquad::method::Trained;
use hemiquad::partition::Partition;
use hemiquad::{Dir, Key, Probe, Uv};
use std::f64::consts::PI;

/// P(χ² with `dof` degrees of freedom > x), by Wilson and Hilferty's normal approximation.
fn tail(x: f64, dof: f64) -> f64 {
    let t = 2.0 / (9.0 * dof);
    let z = ((x / dof).cbrt() - (1.0 - t)) / t.sqrt();
    // Complementary error function (Abramowitz and Stegun 7.1.26).
    let a = z.abs() / 2f64.sqrt();
    let k = 1.0 / (1.0 + 0.327_591_1 * a);
    let poly = k
        * (0.254_829_592
            + k * (-0.284_496_736 + k * (1.421_413_741 + k * (-1.453_152_027 + k * 1.061_405_429))));
    let upper = 0.5 * poly * (-a * a).exp();
    if z > 0.0 { upper } else { 1.0 - upper }
}

/// 400 000 directions of a map in a 16 × 16 histogram over the sphere, against the map's own density integrated there.
fn p_value(sample: &dyn Map<f64>, density: &dyn Map<f64>) -> f64 {
    const SIDE: usize = 16;
    const FINE: usize = 48;
    let n = 400_000u64;
    let mut count = vec![0.0; SIDE * SIDE];
    for i in 0..n {
        let d = sample.dir(Key::new(77).with(i).uniform2_f64(0));
        let at = Sphere.uv(d).expect("the sphere holds every direction");
        count[(at.v * SIDE as f64) as usize * SIDE + (at.u * SIDE as f64) as usize] += 1.0;
    }
    let mut expect = vec![0.0; SIDE * SIDE];
    let total = SIDE * FINE;
    for i in 0..total * total {
        let (x, y) = (i % total, i / total);
        let at = Uv::new((x as f64 + 0.5) / total as f64, (y as f64 + 0.5) / total as f64);
        let w = 4.0 * PI / (total * total) as f64 * n as f64;
        expect[(y / FINE) * SIDE + x / FINE] += w * density.pdf_solid_angle(Sphere.dir(at));
    }
    // Cells with few expected points are pooled; the midpoint rule is not exact where a density has an edge, so cells may be off
    // by a little of their content.
    let (mut chi2, mut dof, mut few, mut few_expected) = (0.0, -1.0, 0.0, 0.0);
    for (c, e) in count.iter().zip(&expect) {
        if *e < 20.0 {
            few += c;
            few_expected += e;
        } else {
            let off = ((c - e).abs() - 0.002 * e).max(0.0);
            chi2 += off * off / e;
            dof += 1.0;
        }
    }
    if few_expected > 20.0 {
        chi2 += (few - few_expected) * (few - few_expected) / few_expected;
        dof += 1.0;
    }
    assert!(few_expected > 20.0 || few < 60.0, "points where the density is zero: {few}");
    tail(chi2, dof)
}

#[test]
fn maps_sample_their_densities() {
    let wo = Dir::from_unit(0.6, 0.0, 0.8);
    let ggx = GgxVisible::new(wo, 0.5, 0.3).expect("a valid surface");
    let cone = Cone::from_half_angle(1.2).expect("a valid cone");
    let maps: [&dyn Map<f64>; 6] = [&Concentric, &Octant, &Cosine, &Sphere, &ggx, &Polar];
    // Šidák: 1 - (1 - 0.01)^(1/6).
    let alpha = 1.0 - 0.99f64.powf(1.0 / 6.0);
    for (i, m) in maps.iter().enumerate() {
        let p = p_value(*m, *m);
        assert!(p > alpha, "map {i}: p = {p:e}");
    }
    // Negative controls: another map's density, and a cone against the hemisphere.
    assert!(p_value(&Cosine, &Concentric) < 1e-9);
    assert!(p_value(&cone, &Concentric) < 1e-9);
}

#[test]
fn areas_of_images_of_rectangles() {
    // The solid angle of the image of a rectangle, by the triangles of its finely sampled boundary about its centre.
    let solid = |a: Dir<f64>, b: Dir<f64>, c: Dir<f64>| {
        let triple =
            a.x * (b.y * c.z - b.z * c.y) + a.y * (b.z * c.x - b.x * c.z) + a.z * (b.x * c.y - b.y * c.x);
        2.0 * triple.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    };
    for i in 0..300u64 {
        let (p, q) = (Key::new(2).with(i).uniform2_f64(0), Key::new(2).with(i).uniform2_f64(1));
        let (low, high) = (Uv::new(p.u.min(q.u), p.v.min(q.v)), Uv::new(p.u.max(q.u), p.v.max(q.v)));
        let n = 4000;
        let boundary: Vec<Dir<f64>> = (0..4 * n)
            .map(|k| {
                let t = (k % n) as f64 / n as f64;
                let (u, v) = match k / n {
                    0 => (t, 0.0),
                    1 => (1.0, t),
                    2 => (1.0 - t, 1.0),
                    _ => (0.0, 1.0 - t),
                };
                Concentric.dir(Uv::new(low.u + u * (high.u - low.u), low.v + v * (high.v - low.v)))
            })
            .collect();
        let centre = Concentric.dir(Uv::new(0.5 * (low.u + high.u), 0.5 * (low.v + high.v)));
        let area: f64 = (0..4 * n).map(|k| solid(centre, boundary[k], boundary[(k + 1) % (4 * n)])).sum();
        let expect = 2.0 * PI * (high.u - low.u) * (high.v - low.v);
        assert!((area - expect).abs() < 2e-6, "{area} {expect}");
    }
}

#[test]
fn neighbours_stay_neighbours() {
    let mut worst: f64 = 0.0;
    for i in 0..200_000u64 {
        let (p, w) = (Key::new(3).with(i).uniform2_f64(0), Key::new(3).with(i).uniform2_f64(1));
        let scale = 10f64.powf(-4.0 * Key::new(3).with(i).uniform64(2));
        let q =
            Uv::new((p.u + scale * (w.u - 0.5)).clamp(0.0, 1.0), (p.v + scale * (w.v - 0.5)).clamp(0.0, 1.0));
        let (d, e): (Dir<f64>, Dir<f64>) = (Concentric.dir(p), Concentric.dir(q));
        let apart = ((d.x - e.x).powi(2) + (d.y - e.y).powi(2) + (d.z - e.z).powi(2)).sqrt();
        worst = worst.max(apart / (p.u - q.u).hypot(p.v - q.v));
    }
    assert!(worst <= Concentric::LARGEST_STRETCH && worst > 4.0, "{worst}");
}

#[test]
fn a_trained_density_integrates_to_one_and_finds_its_leaves_again() {
    let mut trained = Trained::new();
    let mut f = |p: &Probe| if (p.uv.u - 0.3).hypot(p.uv.v - 0.6) < 0.05 { 100.0 } else { p.uv.u };
    for round in 0..3 {
        trained.learn(&mut f, 2000, 800, Key::new(round), Default::default());
    }
    let (tree, density) = (trained.tree(), trained.density());
    let total: f64 = tree.leaves().map(|l| density.of_leaf(l) * tree.area(l)).sum();
    assert!((total - 1.0).abs() < 1e-12, "{total}");
    let mut cursor = 0;
    for i in 0..1_000_000u64 {
        let placed = density
            .place(tree, Key::new(9).with(i).uniform64(0), &mut cursor)
            .expect("every position falls somewhere");
        // Out to the hemisphere and back: the same leaf, unless rounding crosses an edge within 1e-13.
        let back = Concentric.uv(Concentric.dir(placed.uv)).expect("a direction of the hemisphere");
        let cell = tree.cell(placed.cell);
        let edge = |x: f64, k: u32| {
            let t = x / cell.side() - k as f64;
            t.min(1.0 - t) * cell.side()
        };
        let near_edge = edge(placed.uv.u, cell.x).min(edge(placed.uv.v, cell.y)) < 1e-13;
        assert!(tree.leaf_at(back) == placed.cell || near_edge, "{placed:?}");
        assert!((density.pdf_square(tree, placed.uv) * placed.weight - 1.0).abs() < 1e-12);
    }
}

#[test]
fn closed_forms_of_the_benchmark() {
    // Genz's families against the midpoint rule, and Lambert's formula against known values.
    for (i, (exact, midpoint)) in hemiquad::suite::genz_spot_values().iter().enumerate() {
        let limit = if i == 5 { 3e-3 } else { 1e-5 };
        assert!((exact - midpoint).abs() < limit * exact.abs().max(1.0), "{i}: {exact} {midpoint}");
    }
    let spots = [
        -0.179_967_190_931,
        17.299_400_521_149,
        0.048_611_111_111,
        0.388_027_882_410,
        0.306_324_635_286,
        0.564_408_313_112,
    ];
    for ((exact, _), spot) in hemiquad::suite::genz_spot_values().iter().zip(spots) {
        assert!((exact - spot).abs() < 1e-9, "{exact} {spot}");
    }
    let square: Vec<Dir<f64>> = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .iter()
        .map(|(x, y)| Dir::normalize(*x, *y, 1.0).expect("a direction"))
        .collect();
    assert!((hemiquad::suite::lambert(&square) - 1.740_839_503).abs() < 1e-8);
    // Every problem against a fine jittered estimate, where that can see it: within 5 of its (safe) standard errors.
    for p in hemiquad::suite::problems() {
        let i = p.instance(Key::new(6));
        if matches!(p.class, hemiquad::suite::Class::Compact | hemiquad::suite::Class::Ragged) {
            continue;
        }
        let e = hemiquad::Method::integrate(
            &hemiquad::method::Jittered,
            &mut &i,
            1 << 18,
            Key::new(1),
            &mut hemiquad::Workspace::new(),
        );
        let limit = 5.0 * e.std_error.unwrap_or(0.0) + 1e-9;
        assert!((e.value - i.exact).abs() < limit, "{}: {} {} ± {limit}", p.name, e.value, i.exact);
    }
}
