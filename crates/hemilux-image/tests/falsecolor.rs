//! False colours: the palettes' promises, the scales and the legend.

use hemilux_image::Image;
use hemilux_image::falsecolor::{FalseColor, NOT_A_NUMBER, Palette, Scale};
use hemilux_image::srgb;

/// CIE lightness of an sRGB colour.
fn lightness(colour: [u8; 3]) -> f32 {
    let light = colour.map(|v| srgb::decode(f32::from(v) / 255.0));
    let y: f32 = light.iter().zip(srgb::LUMINANCE).map(|(v, w)| v * w).sum();
    116.0 * y.cbrt() - 16.0
}

#[test]
fn the_perceptual_palette_gets_lighter_all_the_way_and_the_rainbow_does_not() {
    let along = |p: Palette| (0..=64).map(|i| lightness(p.colour(i as f32 / 64.0))).collect::<Vec<_>>();
    let even = along(Palette::Perceptual);
    assert!(even.is_sorted() && even[64] - even[0] > 75.0, "{even:?}");
    let steps: Vec<f32> = even.windows(2).skip(8).map(|w| w[1] - w[0]).collect();
    assert!(steps.iter().all(|s| (0.4..2.6).contains(s)), "{steps:?}");
    assert!(!along(Palette::Spectral).is_sorted());
    for i in 0..=64 {
        assert_ne!(Palette::Perceptual.colour(i as f32 / 64.0), NOT_A_NUMBER);
    }
}

#[test]
fn the_rainbow_has_its_knots() {
    let at = |t: f32| Palette::Spectral.colour(t);
    assert_eq!([at(0.0), at(0.25), at(0.5)], [[0, 0, 255], [0, 255, 255], [0, 255, 0]]);
    assert_eq!(
        [at(0.75), at(1.0), at(9.0), at(-1.0)],
        [[255, 255, 0], [255, 0, 0], [255, 0, 0], [0, 0, 255]]
    );
    assert_eq!(at(f32::NAN), NOT_A_NUMBER);
}

fn plain(scale: Scale, max: Option<f32>) -> FalseColor {
    FalseColor { scale, max, legend: false, palette: Palette::Spectral, ..FalseColor::default() }
}

#[test]
fn scales_put_values_where_they_belong() {
    let image = Image::from_channel(5, 1, "Y", vec![0.0, 0.1, 1.0, 100.0, f32::NAN]);
    let linear = plain(Scale::Linear, Some(2.0)).render(&image).unwrap();
    assert_eq!(linear.data[6..9], [0, 255, 0]);
    assert_eq!(linear.data[9..], [255, 0, 0, 128, 128, 128]);
    let log = plain(Scale::Log { decades: 4.0 }, Some(100.0)).render(&image).unwrap();
    assert_eq!(log.data[..3], [0, 0, 255]);
    assert_eq!(log.data[3..6], Palette::Spectral.colour(256.0 / 1023.0));
    assert_eq!(log.data[9..12], [255, 0, 0]);
    // 179 lm/W: 1 W is half of 358.
    let candela = FalseColor { factor: 179.0, ..plain(Scale::Linear, Some(358.0)) }.render(&image).unwrap();
    assert_eq!(candela.data[6..9], [0, 255, 0]);
    // Automatic: the 99.5th percentile is 100, a round number already.
    let auto = plain(Scale::Linear, None).render(&image).unwrap();
    assert_eq!(auto, plain(Scale::Linear, Some(100.0)).render(&image).unwrap());
}

#[test]
fn what_cannot_be_shown_is_an_error() {
    let image = Image::from_channel(2, 1, "Y", vec![0.0, 1.0]);
    for bad in [
        plain(Scale::Linear, Some(0.0)),
        plain(Scale::Linear, Some(f32::NAN)),
        plain(Scale::Log { decades: 0.0 }, None),
    ] {
        assert!(bad.render(&image).is_err());
    }
    let missing = FalseColor { channel: Some("Z".into()), ..FalseColor::default() };
    assert!(missing.render(&image).unwrap_err().to_string().contains("no channel Z"));
    let black = Image::from_channel(2, 1, "Y", vec![0.0; 2]);
    assert_eq!(plain(Scale::Linear, None).render(&black).unwrap().data, [0, 0, 255, 0, 0, 255]);
}

#[test]
fn the_legend_stands_left_of_the_picture_where_there_is_room() {
    for height in [1, 20, 40, 60, 200, 720] {
        let image = Image::from_channel(3, height, "Y", vec![1.0; 3 * height]);
        let settings = FalseColor { units: "cd/m2".into(), ..FalseColor::default() };
        let with = settings.render(&image).unwrap();
        let without = FalseColor { legend: false, ..settings }.render(&image).unwrap();
        assert_eq!(with.data.len(), 3 * with.width * with.height);
        assert_eq!(with.width > without.width, height >= 60, "{height}");
        for y in 0..height {
            let (a, b) = (3 * ((y + 1) * with.width - 3), 3 * y * 3);
            assert_eq!(with.data[a..a + 9], without.data[b..b + 9], "the picture itself is untouched");
        }
        if height >= 60 {
            assert!(with.data.chunks_exact(3).any(|p| p == [255; 3]), "numbers are drawn");
        }
    }
}
