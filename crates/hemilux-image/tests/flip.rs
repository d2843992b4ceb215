//! FLIP against the figures of another implementation, and its own rules.
//!
//! The stored figures come from PyPI `flip-evaluator` 1.7 (`evaluate(ref, test, "LDR" or "HDR", applyMagma=False,
//! parameters={"ppd": …})`) on the pictures made here by formula, as 32-bit floats.

use hemilux_image::flip::{PIXELS_PER_DEGREE, hdr_flip, ldr_flip};
use hemilux_image::{Encoding, Image};

fn pair(width: usize, height: usize, formula: impl Fn(f64, f64) -> [[f64; 3]; 2]) -> [Image; 2] {
    let pixels: Vec<_> =
        (0..width * height).map(|i| formula((i % width) as f64, (i / width) as f64)).collect();
    [0, 1].map(|k| {
        let pixels: Vec<[f32; 3]> = pixels.iter().map(|p| p[k].map(|v| v as f32)).collect();
        Image::from_rgb(width, height, &pixels)
    })
}

/// Slow waves in sRGB; the test adds a fine pattern in red and thin dark lines in blue.
fn screen(width: usize, height: usize) -> [Image; 2] {
    let mut images = pair(width, height, |x, y| {
        let r =
            [0.5 + 0.4 * (x * 0.21).sin(), 0.5 + 0.4 * (y * 0.17).cos(), 0.5 + 0.4 * ((x + y) * 0.11).sin()];
        let line = f64::from(u8::from((x + 2.0 * y) % 11.0 < 3.0));
        let t = [r[0] + 0.08 * (x * 1.3).sin() * (y * 0.9).cos(), r[1], r[2] - 0.1 * line];
        [r.map(|v| v.clamp(0.0, 1.0)), t.map(|v| v.clamp(0.0, 1.0))]
    });
    images.iter_mut().for_each(|i| i.encoding = Encoding::Srgb);
    images
}

/// Slow waves over some stops in linear light; the test adds a fine pattern and bright green dots.
fn scene(width: usize, height: usize, spread: f64) -> [Image; 2] {
    pair(width, height, |x, y| {
        let wave = [4.0 * (x * 0.13).sin(), 3.0 * (y * 0.19).cos(), 2.0 * ((x - y) * 0.07).sin()];
        let r = wave.map(|w| (w * spread).exp2() * 0.5);
        let ripple = 1.0 + 0.3 * (x * 0.9).sin() * (y * 0.7).sin();
        let dot = if (x + 3.0 * y) % 17.0 < 2.0 { 4.0 } else { 1.0 };
        [r, [r[0] * ripple, r[1] * ripple * dot, r[2] * ripple]]
    })
}

fn near(got: f64, want: f64, what: &str) {
    assert!((got - want).abs() < 1e-4, "{what}: {got} instead of {want}");
}

#[test]
fn screen_pictures_match_the_stored_figures() {
    for (w, h, ppd, mean, inner, corner) in [
        (64, 48, PIXELS_PER_DEGREE, 0.103010, 0.148670, 0.184038),
        (64, 48, 30.0, 0.140721, 0.234138, 0.283133),
        (41, 67, PIXELS_PER_DEGREE, 0.105984, 0.149192, 0.184038),
        (41, 67, 30.0, 0.148781, 0.234138, 0.283133),
    ] {
        let [reference, test] = screen(w, h);
        let flip = ldr_flip(&reference, &test, ppd).unwrap();
        near(flip.mean, mean, "mean");
        near(f64::from(flip.map[40 * w + 30]), inner, "inner");
        near(f64::from(flip.map[0]), corner, "corner");
        assert!(flip.exposures.is_empty());
        // Negative control: at a slightly other resolution the figures are beyond the tolerance.
        let other = ldr_flip(&reference, &test, ppd * 0.97).unwrap();
        assert!((other.mean - mean).abs() > 2e-4, "{} {mean}", other.mean);
    }
}

#[test]
fn high_range_pictures_match_the_stored_figures() {
    for (w, h, spread, ppd, mean, inner, corner) in [
        (64, 48, 1.0, PIXELS_PER_DEGREE, 0.231632, 0.374286, 0.349235),
        (64, 48, 1.0, 30.0, 0.282595, 0.396432, 0.457203),
        (41, 67, 1.0, PIXELS_PER_DEGREE, 0.237465, 0.374644, 0.347647),
        (41, 67, 1.0, 30.0, 0.292526, 0.395884, 0.455384),
        (64, 48, 2.5, PIXELS_PER_DEGREE, 0.186281, 0.363285, 0.507828),
        (41, 67, 2.5, PIXELS_PER_DEGREE, 0.186218, 0.374395, 0.507828),
    ] {
        let [reference, test] = scene(w, h, spread);
        let flip = hdr_flip(&reference, &test, ppd).unwrap();
        near(flip.mean, mean, "mean");
        near(f64::from(flip.map[40 * w + 30]), inner, "inner");
        near(f64::from(flip.map[0]), corner, "corner");
    }
    let [reference, test] = scene(64, 48, 2.5);
    let exposures = hdr_flip(&reference, &test, PIXELS_PER_DEGREE).unwrap().exposures;
    assert_eq!(exposures.len(), 4);
    near(f64::from(exposures[0]), -6.359_783, "first exposure");
    near(f64::from(exposures[3]), -2.938_949, "last exposure");
}

#[test]
fn equal_pictures_have_none_and_wild_ones_stay_in_range() {
    let [reference, mut test] = scene(20, 9, 1.0);
    for f in [ldr_flip, hdr_flip] {
        assert_eq!(f(&reference, &reference, PIXELS_PER_DEGREE).unwrap().mean, 0.0);
        let there = f(&reference, &test, PIXELS_PER_DEGREE).unwrap();
        assert!(there.map.iter().all(|v| (0.0..=1.0).contains(v)) && there.mean > 0.01);
        assert!(f(&reference, &test, 0.0).is_err() && f(&reference, &test, f32::NAN).is_err());
        assert!(f(&reference, &scene(9, 20, 1.0)[0], PIXELS_PER_DEGREE).is_err());
    }
    for (i, wild) in [f32::NAN, f32::INFINITY, -1e30, 1e38, f32::MIN_POSITIVE].into_iter().enumerate() {
        test.set("G", i, 3, wild);
    }
    let black = Image::from_rgb(20, 9, &[]);
    for (a, b) in [(&reference, &test), (&test, &reference), (&black, &test)] {
        let flip = hdr_flip(a, b, PIXELS_PER_DEGREE).unwrap();
        assert!(flip.map.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}
