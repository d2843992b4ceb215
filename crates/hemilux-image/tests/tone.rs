//! Exposure and tone curves against values worked out by hand.

use hemilux_image::tone::{Curve, Exposure, ToneMap, dither};
use hemilux_image::{Encoding, Image};

const CURVES: [Curve; 4] = [Curve::Clamp, Curve::Reinhard { white: 4.0 }, Curve::Hable, Curve::Aces];

#[test]
fn curves_rise_from_black_and_take_anything() {
    for curve in CURVES {
        let at = |v: f32| curve.apply([v; 3])[0];
        assert!(at(0.0).abs() < 1e-6, "{curve:?}");
        let values: Vec<f32> = (0..200).map(|i| at(1e-4 * 1.08_f32.powi(i))).collect();
        assert!(values.is_sorted(), "{curve:?}");
        for wild in [f32::NAN, f32::NEG_INFINITY, f32::INFINITY, f32::MAX, -1.0] {
            assert!(at(wild).is_finite() && at(wild) >= -1e-6, "{curve:?} {wild}");
        }
    }
    // Reinhard's white is white, half of it is 2 (1 + 2/16)/3.
    let reinhard = |v: f32| CURVES[1].apply([v; 3])[1];
    assert!((reinhard(4.0) - 1.0).abs() < 1e-5 && (reinhard(2.0) - 0.75).abs() < 1e-5);
    assert!((CURVES[2].apply([11.2; 3])[2] - 1.0).abs() < 1e-6);
    // Narkowicz's fit at 1: 2.54 / 3.16.
    assert!((CURVES[3].apply([1.0; 3])[0] - 2.54 / 3.16).abs() < 1e-6);
}

#[test]
fn exposure_brings_the_level_to_its_target() {
    let image = Image::from_channel(4, 1, "Y", vec![0.0, 1.0, 4.0, f32::INFINITY]);
    let factor = |e: Exposure| e.factor(&image);
    let near = |a: f32, b: f32| assert!((a / b - 1.0).abs() < 1e-5, "{a} {b}");
    near(factor(Exposure::Stops(-2.0)).unwrap(), 0.25);
    near(factor(Exposure::LogAverage { key: 0.18 }).unwrap(), 0.09);
    near(factor(Exposure::Percentile { percent: 100.0, target: 1.0 }).unwrap(), 0.25);
    assert!(factor(Exposure::Percentile { percent: 101.0, target: 1.0 }).is_err());
    assert!(factor(Exposure::LogAverage { key: 0.0 }).is_err());
    let black = Image::from_channel(1, 1, "Y", vec![0.0]);
    near(Exposure::LogAverage { key: 0.18 }.factor(&black).unwrap(), 1.0);
    let wrong = ToneMap { curve: Curve::Reinhard { white: 0.0 }, ..ToneMap::default() };
    assert!(wrong.apply(&image).is_err());
}

#[test]
fn the_default_shows_srgb_pictures_as_they_are() {
    let mut image = Image::from_channel(256, 1, "Y", (0..256).map(|i| i as f32 / 255.0).collect());
    image.encoding = Encoding::Srgb;
    let shown = ToneMap::default().apply(&image).unwrap();
    assert!(
        (0..256).all(|i| usize::from(shown.data[3 * i]) == i && shown.data[3 * i] == shown.data[3 * i + 2])
    );
    let bright = ToneMap { exposure: Exposure::Stops(1.0), ..ToneMap::default() };
    let half = Image::from_channel(1, 1, "Y", vec![0.25]);
    assert_eq!(bright.apply(&half).unwrap().data, [188; 3]);
}

#[test]
fn dithering_keeps_the_mean_that_rounding_loses() {
    let sum: f32 = (0..64).map(|i| dither(i % 8, i / 8)).sum();
    let mut ranks: Vec<i32> = (0..64).map(|i| ((dither(i % 8, i / 8) + 0.5) * 64.0) as i32).collect();
    ranks.sort_unstable();
    assert!(sum.abs() < 1e-6 && ranks == (0..64).collect::<Vec<_>>());
    // Code value 100.3 everywhere.
    let mut image = Image::from_channel(8, 8, "Y", vec![100.3 / 255.0; 64]);
    image.encoding = Encoding::Srgb;
    let mean = |dithered: bool| {
        let shown = ToneMap { dithered, ..ToneMap::default() }.apply(&image).unwrap();
        shown.data.iter().map(|v| f64::from(*v)).sum::<f64>() / 192.0
    };
    assert_eq!(mean(false), 100.0);
    assert!((mean(true) - 100.3).abs() < 0.02, "{}", mean(true));
}
