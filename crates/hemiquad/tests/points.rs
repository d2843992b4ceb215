//! The points: nets, independence of keys, slopes.

use hemiquad::Key;
use hemiquad::points::{jittered, sobol, sobol_bits, sobol_f64};

fn is_net(points: &[[u32; 2]]) -> bool {
    let m = points.len().trailing_zeros();
    (0..=m).all(|k| {
        let mut seen = vec![false; points.len()];
        points.iter().all(|p| {
            let top = |x: u32, n: u32| if n == 0 { 0 } else { x >> (32 - n) };
            let cell = ((top(p[0], k) << (m - k)) | top(p[1], m - k)) as usize;
            !std::mem::replace(&mut seen[cell], true)
        })
    })
}

#[test]
fn every_aligned_block_is_a_net() {
    for seed in 0..20 {
        for (start, n) in [(0u32, 1024u32), (4096, 256), (3 << 20, 64), (u32::MAX - 1023, 1024), (48, 16)] {
            let p: Vec<_> = (start..=start + (n - 1)).map(|i| sobol_bits(i, Key::new(seed))).collect();
            assert!(is_net(&p), "seed {seed}, start {start}");
        }
    }
    // Negative controls: an unaligned block, and jittered points, are no nets.
    let p: Vec<_> = (8..8 + 256).map(|i| sobol_bits(i, Key::new(1))).collect();
    assert!(!is_net(&p));
    let p: Vec<_> = (0..256)
        .map(|i| jittered(i, 16, 16, Key::new(1)))
        .map(|p| [p.u, p.v].map(|x| (x * 16_777_216.0) as u32 * 256))
        .collect();
    assert!(!is_net(&p));
}

#[test]
fn keys_shuffle_the_order_and_are_independent() {
    // The first point of a block is uniform over keys: a χ² over 16×16 cells, 255 degrees of freedom; 345 is passed by
    // chance once in 7000 (false alarm 1.4e-4).
    let n = 25_600;
    for index in [0u32, 1, 77] {
        let mut count = [0u32; 256];
        for s in 0..n {
            let p = sobol(index, Key::new(5).with(s));
            count[(p.u * 16.0) as usize * 16 + (p.v * 16.0) as usize] += 1;
        }
        let expect = n as f64 / 256.0;
        let chi2: f64 = count.iter().map(|c| (*c as f64 - expect).powi(2) / expect).sum();
        assert!(chi2 < 345.0 && chi2 > 170.0, "index {index}: {chi2}");
    }
    // Two keys, same index: no correlation (5.3 standard deviations, 1e-7).
    let c: f64 = (0..n)
        .map(|s| {
            let (a, b) = (sobol_f64(3, Key::new(s)), sobol_f64(3, Key::new(s).with(1)));
            (a.u - 0.5) * (b.u - 0.5) * 12.0
        })
        .sum::<f64>()
        / n as f64;
    assert!(c.abs() < 5.3 / (n as f64).sqrt(), "{c}");
}

#[test]
fn addresses_do_not_collide_or_commute() {
    let a = Key::new(1).with(2).with(3);
    let b = Key::new(1).with(3).with(2);
    assert_ne!(a, b);
    assert_ne!(a.bits(0), a.bits(1));
    let mut all: Vec<u64> =
        (0..300u64).flat_map(|i| (0..300u64).map(move |j| Key::new(0).with(i).with(j).bits64(0))).collect();
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), 90_000);
    assert!((0..100_000).all(|i| {
        let x = Key::new(9).uniform(i);
        (0.0..1.0).contains(&x)
    }));
}

#[test]
fn jittered_points_stay_in_their_cells() {
    for i in 0..35 * 21 {
        let p = jittered(i, 35, 21, Key::new(4));
        assert!(p.u < 1.0 && p.v < 1.0);
        assert!(
            (p.u * 35.0 - (i % 35) as f32 - 0.5).abs() < 0.5001
                && (p.v * 21.0 - (i / 35) as f32 - 0.5).abs() < 0.5001
        );
    }
    let p = jittered(7, 0, 0, Key::new(4));
    assert!(p.u < 1.0 && p.v < 1.0);
}

fn rmse(n: u32, point: impl Fn(u32, Key) -> (f64, f64)) -> f64 {
    // exp(x + y), exact (e - 1)².
    let exact = (std::f64::consts::E - 1.0).powi(2);
    let runs = 100;
    let sum: f64 = (0..runs)
        .map(|r| {
            let key = Key::new(77).with(r);
            let mean: f64 = (0..n)
                .map(|i| {
                    let (x, y) = point(i, key);
                    (x + y).exp()
                })
                .sum::<f64>()
                / n as f64;
            (mean - exact).powi(2)
        })
        .sum();
    (sum / runs as f64).sqrt()
}

#[test]
fn scrambled_sobol_converges_with_slope_three_halves_on_smooth_integrands() {
    let sobol = |n| {
        rmse(n, |i, k| {
            let p = sobol_f64(i, k);
            (p.u, p.v)
        })
    };
    let slope = (sobol(16384) / sobol(64)).log2() / 8.0;
    println!("one net of 64 to 16384 points: slope {slope:.2}");
    assert!(slope < -1.4, "{slope}");
    // Plain Monte Carlo as the control: -1/2.
    let plain = |n| {
        rmse(n, |i, k| {
            let p = k.with(i as u64).uniform2_f64(0);
            (p.u, p.v)
        })
    };
    let slope = (plain(4096) / plain(64)).log2() / 6.0;
    assert!(slope > -0.65, "{slope}");
}
