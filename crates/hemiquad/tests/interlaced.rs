//! Interlaced Sobol' points of order two (J. Dick 2011): nets, unbiased, and steeper than n^-1.5 on every smooth family of the suite.

use hemiquad::map::{Concentric, Map, Polar};
use hemiquad::points::{interlaced, interlaced_bits, jittered_f64, sobol_f64};
use hemiquad::suite::{Class, Instance, problems};
use hemiquad::{Dir, Key, Probe, Uv};
use std::f64::consts::{FRAC_PI_2, LN_2};

/// The four Sobol' coordinates of an interlaced point.
fn components(index: u32, key: Key) -> [u32; 4] {
    let every_other = |x: u64| (0..32).fold(0u32, |d, k| d | ((((x >> (2 * k)) & 1) as u32) << k));
    let [a, b] = interlaced_bits(index, key);
    [every_other(a >> 1), every_other(a), every_other(b >> 1), every_other(b)]
}

fn top(x: u64, digits: u32, of: u32) -> u64 {
    if digits == 0 { 0 } else { x >> (of - digits) }
}

/// Whether every box with edges 2^-k₁ … 2^-k₄, Σ k = m - t, holds 2^t of the 2^m points.
fn is_net(points: &[[u32; 4]], t: u32) -> bool {
    let m = points.len().trailing_zeros();
    let s = m - t;
    let shapes = (0..=s)
        .flat_map(|a| (0..=s - a).flat_map(move |b| (0..=s - a - b).map(move |c| [a, b, c, s - a - b - c])));
    shapes.into_iter().all(|k| {
        let mut count = vec![0u32; 1 << s];
        for p in points {
            let cell = (0..4).fold(0, |cell, d| (cell << k[d]) | top(p[d] as u64, k[d], 32));
            count[cell as usize] += 1;
        }
        count.iter().all(|c| *c == 1 << t)
    })
}

#[test]
fn aligned_blocks_are_nets_in_four_dimensions_and_in_each_coordinate() {
    for seed in 0..4 {
        for (start, n) in [(0u32, 512u32), (4096, 256), (u32::MAX - 255, 256)] {
            let key = Key::new(seed);
            let block = start..=start + (n - 1);
            let p: Vec<_> = block.clone().map(|i| components(i, key)).collect();
            // The degrees of the polynomials less one add up to 3.
            assert!(is_net(&p, 3), "seed {seed}, start {start}");
            // Controls: the net is no better than that, and an unaligned block is none.
            assert!(!is_net(&p, 0));
            // In the first coordinate every interval of 2^-m holds one point.
            let m = n.ilog2();
            let mut first: Vec<u64> = block.map(|i| top(interlaced_bits(i, key)[0], m, 64)).collect();
            first.sort_unstable();
            assert!(first.iter().enumerate().all(|(i, x)| i as u64 == *x));
        }
        let p: Vec<_> = (100..100 + 256).map(|i| components(i, Key::new(seed))).collect();
        assert!(!is_net(&p, 3));
    }
}

/// z-score of the mean over `runs` keys of 16 points each, against the exact integral.
fn z(runs: u64, exact: f64, f: impl Fn(Uv<f64>) -> f64, point: impl Fn(u32, Key) -> Uv<f64>) -> f64 {
    let error = |r: u64| (0..16).map(|i| f(point(i, Key::new(21).with(r)))).sum::<f64>() / 16.0 - exact;
    let d: Vec<f64> = (0..runs).map(error).collect();
    let mean = d.iter().sum::<f64>() / runs as f64;
    let variance = d.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / runs as f64;
    mean / (variance / runs as f64).sqrt()
}

#[test]
fn interlaced_points_are_unbiased() {
    let e = std::f64::consts::E;
    let disk = |p: Uv<f64>| f64::from(u8::from((p.u - 0.43).hypot(p.v - 0.56) < 0.31));
    let area = std::f64::consts::PI * 0.31 * 0.31;
    let runs = 20_000;
    // Four z-tests at 4.5: false alarm 3e-5 together.
    for z in [
        z(runs, (e - 1.0).powi(2), |p| (p.u + p.v).exp(), interlaced),
        z(runs, area, disk, interlaced),
        z(runs, 0.25, |p| p.u * p.v, interlaced),
        // 25 points in: not only the first block.
        z(runs, 1.0 / 9.0, |p| (p.u * p.v).powi(2), |i, k| interlaced(i + 25, k)),
    ] {
        assert!(z.abs() < 4.5, "{z}");
    }
    // The control: one coordinate left as it is in all runs.
    let stiff = |i: u32, k: Key| Uv::new(interlaced(i, k).u, interlaced(i, Key::new(3)).v);
    assert!(z(runs, (e - 1.0).powi(2), |p| (p.u + p.v).exp(), stiff).abs() > 5.0);
}

#[test]
fn single_points_are_uniform() {
    // χ² over 16 × 16 cells, 255 degrees of freedom; beyond 345 by chance once in 7000.
    for index in [0u32, 5, 1000] {
        let n = 25_600;
        let mut count = [0u32; 256];
        for s in 0..n {
            let p = interlaced(index, Key::new(6).with(s));
            assert!(p.u > 0.0 && p.u < 1.0 && p.v > 0.0 && p.v < 1.0);
            count[(p.u * 16.0) as usize * 16 + (p.v * 16.0) as usize] += 1;
        }
        let expect = n as f64 / 256.0;
        let chi2: f64 = count.iter().map(|c| (*c as f64 - expect).powi(2) / expect).sum();
        assert!(chi2 < 345.0 && chi2 > 170.0, "index {index}: {chi2}");
    }
}

type Points = fn(u32, u32, Key) -> Uv<f64>;

/// Slopes of log relative RMSE over log n at 2^6, …, 2^14 points for three kinds of points, each over the same instances of a family.
/// `through` carries a point to the square of the family, with a weight.
fn slopes(
    runs: u64,
    family: impl Fn(Key) -> Instance,
    through: impl Fn(Uv<f64>) -> (Uv<f64>, f64),
) -> [f64; 3] {
    const FROM: u32 = 6;
    let kinds: [Points; 3] =
        [|i, _, k| interlaced(i, k), |i, _, k| sobol_f64(i, k), |i, n, k| jittered_f64(i, n, n, k)];
    let mut square = [[0.0; 5]; 3];
    for r in 0..runs {
        let key = Key::new(4711).with(r);
        let instance = family(key.with(1));
        let value = |p: Uv<f64>| {
            let (uv, weight) = through(p);
            (instance.function)(&Probe::at(uv)) * weight / instance.exact - 1.0
        };
        for (kind, square) in kinds.iter().zip(&mut square) {
            for (m, square) in square.iter_mut().enumerate() {
                let side = 1u32 << (FROM / 2 + m as u32);
                let n = side * side;
                let mean = (0..n).map(|i| value(kind(i, side, key))).sum::<f64>() / n as f64;
                *square += mean * mean / runs as f64;
            }
        }
    }
    // Least squares at x = -2, -1, 0, 1, 2 times log 4.
    square.map(|s| {
        let log = |m: usize| 0.5 * s[m].ln();
        (2.0 * (log(4) - log(0)) + log(3) - log(1)) / (10.0 * 2.0 * LN_2)
    })
}

#[test]
fn interlaced_sobol_is_steeper_than_three_halves_on_every_smooth_family() {
    let runs = 40;
    // The logarithm of an RMSE of `runs` normal errors is uncertain by 1/√(2 runs); Σ (x - mean)² is 10 (log 4)².
    let error = (0.5 / runs as f64 / (10.0 * (2.0 * LN_2).powi(2))).sqrt();
    // A function smooth over the hemisphere has kinks along the diagonals of the concentric square, so those families go through (θ, φ),
    // whose Jacobian against the concentric square (2π) is π/2 sin θ.
    let polar = |p: Uv<f64>| {
        let d: Dir<f64> = Polar.dir(p);
        let uv = Concentric.uv(d).expect("above the horizon");
        (uv, FRAC_PI_2 * (FRAC_PI_2 * p.u).sin())
    };
    let mut tested = 0;
    for p in problems().into_iter().filter(|p| p.class == Class::Smooth && p.name != "H1 constant") {
        let hemisphere = p.name.starts_with('H');
        let family = |k| p.instance(k);
        let [order_two, sobol, jittered] =
            if hemisphere { slopes(runs, family, polar) } else { slopes(runs, family, |p| (p, 1.0)) };
        println!(
            "{}{}: interlaced {order_two:.2}, Sobol' {sobol:.2}, jittered {jittered:.2}, each ± {error:.2}",
            p.name,
            if hemisphere { " through (θ, φ)" } else { "" }
        );
        // Four standard errors below -1.5. Controls: jittered points, and Sobol' points where u and v do something together.
        assert!(order_two < -1.5 - 4.0 * error, "{}: {order_two}", p.name);
        assert!(jittered > -1.5 + 4.0 * error, "{}: {jittered}", p.name);
        if p.name.starts_with('G') {
            assert!(sobol > -1.5, "{}: {sobol}", p.name);
        }
        tested += 1;
    }
    assert_eq!(tested, 8);
}

/// Where the integrand is not smooth the second order gains nothing.
#[test]
fn kinks_and_jumps_have_the_rate_of_sobol_points() {
    for p in
        problems().into_iter().filter(|p| ["H2 cos", "kinked maximum", "H13 half-space"].contains(&p.name))
    {
        let [order_two, sobol, _] = slopes(40, |k| p.instance(k), |p| (p, 1.0));
        println!("{}: interlaced {order_two:.2}, Sobol' {sobol:.2}", p.name);
        assert!(order_two > -1.6 && (order_two - sobol).abs() < 0.35, "{}: {order_two} {sobol}", p.name);
    }
}
