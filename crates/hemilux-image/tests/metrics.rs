//! The metrics against values worked out by hand.

use hemilux_image::metrics::{Reference, compare, fireflies};
use hemilux_image::{Encoding, Image, read};

fn grey(values: &[f32]) -> Image {
    Image::from_rgb(values.len(), 1, &values.iter().map(|v| [*v; 3]).collect::<Vec<_>>())
}

fn near(got: f64, want: f64) {
    assert!((got - want).abs() <= 1e-9 * want.abs().max(1e-3), "{got} instead of {want}");
}

#[test]
fn two_pixels_by_hand() {
    // Reference 1 and 3: mean 2, floor 0.04. Picture 2 and 2: errors 1/1.04 and 1/9.04.
    let (image, truth) = (grey(&[2.0, 2.0]), grey(&[1.0, 3.0]));
    let c = compare(&image, &Reference::new(&truth)).unwrap();
    near(c.relmse, (1.0 / 1.04 + 1.0 / 9.04) / 2.0);
    near(c.relmse_plain, c.relmse);
    assert_eq!((c.nonfinite, c.negative, c.left_out), (0, 0, 0));
    assert_eq!(c.mean_ratio, [1.0; 3]);
    assert_eq!((c.mse, c.rmse, c.mae), (1.0, 1.0, 1.0));
    near(c.psnr, 10.0 * 9.0_f64.log10());
    near(c.smape, (1.0 / 3.0 + 1.0 / 5.0) / 2.0);
    // Of two pixels the trimmed figure keeps one (0.999 · 2 rounded down): the better.
    near(c.relmse_trimmed, 1.0 / 9.04);
    let same = compare(&truth, &Reference::new(&truth)).unwrap();
    assert_eq!((same.relmse, same.smape, same.psnr), (0.0, 0.0, f64::INFINITY));
}

#[test]
fn halves_take_the_noise_of_the_reference_out() {
    let (image, truth) = (grey(&[2.0, 2.0]), grey(&[1.0, 3.0]));
    let (a, b) = (grey(&[0.5, 3.0]), grey(&[1.5, 3.0]));
    let reference = Reference { halves: Some([&a, &b]), ..Reference::new(&truth) };
    let c = compare(&image, &reference).unwrap();
    near(c.relmse, (1.5 * 0.5 / 1.04 + 1.0 / 9.04) / 2.0);
    near(c.relmse_plain, (1.0 / 1.04 + 1.0 / 9.04) / 2.0);
}

#[test]
fn channels_count_alike_and_the_floor_is_of_all_of_them() {
    let truth = Image::from_rgb(1, 1, &[[1.0, 2.0, 6.0]]);
    let image = Image::from_rgb(1, 1, &[[2.0, 2.0, 3.0]]);
    let c = compare(&image, &Reference::new(&truth)).unwrap();
    near(c.relmse, (1.0 / (1.0 + 0.09) + 9.0 / (36.0 + 0.09)) / 3.0);
    assert_eq!(c.mean_ratio, [2.0, 1.0, 0.5]);
}

#[test]
fn bad_values_are_counted_and_taken_as_black() {
    let mut image = grey(&[1.0, 1.0, 1.0]);
    image.set("R", 0, 0, f32::NAN);
    image.set("G", 1, 0, f32::INFINITY);
    image.set("B", 2, 0, -0.5);
    let c = compare(&image, &Reference::new(&grey(&[1.0, 1.0, 1.0]))).unwrap();
    assert_eq!((c.nonfinite, c.negative), (2, 1));
    near(c.relmse, (1.0 + 1.0 + 2.25) / 1.01 / 9.0);
}

#[test]
fn masks_leave_out_and_larger_references_shrink() {
    let truth = Image::from_channel(4, 2, "Y", vec![1.0, 1.0, 2.0, 4.0, 1.0, 1.0, 2.0, 4.0]);
    let mut mask = Image::from_channel(4, 2, "Y", vec![1.0; 8]);
    mask.encoding = Encoding::Srgb;
    let image = Image::from_channel(2, 1, "Y", vec![2.0, 3.0]);
    let whole = compare(&image, &Reference { mask: Some(&mask), ..Reference::new(&truth) }).unwrap();
    near(whole.relmse, 1.0 / 1.04 / 2.0);
    assert_eq!(whole.left_out, 0);
    // One of four pixels invalid is enough; the floor is still of the whole reference.
    mask.set("Y", 1, 1, 0.0);
    let c = compare(&image, &Reference { mask: Some(&mask), ..Reference::new(&truth) }).unwrap();
    assert_eq!((c.left_out, c.relmse, c.mean_ratio[0]), (1, 0.0, 1.0));
    mask.channels[0].data.fill(0.0);
    assert!(compare(&image, &Reference { mask: Some(&mask), ..Reference::new(&truth) }).is_err());
    let wrong = compare(&grey(&[1.0; 3]), &Reference::new(&truth)).unwrap_err();
    assert!(wrong.to_string().contains("reference: sizes do not fit"), "{wrong}");
}

#[test]
fn the_trimmed_figure_leaves_out_one_in_a_thousand() {
    let truth = grey(&[1.0; 2000]);
    let mut values = vec![1.1; 2000];
    (values[7], values[1500]) = (50.0, 60.0);
    let image = grey(&values);
    let c = compare(&image, &Reference::new(&truth)).unwrap();
    near(c.relmse_trimmed, f64::from(1.1_f32 - 1.0).powi(2) / 1.01);
    values[9] = 40.0;
    let c = compare(&grey(&values), &Reference::new(&truth)).unwrap();
    assert!(c.relmse_trimmed > 0.5, "a third bad pixel stays");
}

#[test]
fn a_reference_of_another_program_reads_with_its_published_mean() {
    // A folder of scenes with reference pictures made elsewhere, too large to keep here.
    let folder = std::env::var_os("HEMILUX_SCENES").map(|f| std::path::PathBuf::from(f).join("box"));
    let Some(folder) = folder.filter(|f| f.join("reference.exr").exists()) else {
        println!("SKIPPED: HEMILUX_SCENES names no folder with box/reference.exr");
        return;
    };
    let [truth, a, b] = ["", "_a", "_b"].map(|n| read(folder.join(format!("reference{n}.exr"))).unwrap());
    let mask = read(folder.join("valid.png")).unwrap();
    for (plane, want) in truth.rgb().unwrap().into_iter().zip([0.169168, 0.135534, 0.0906899]) {
        let mean = plane.iter().map(|v| f64::from(*v)).sum::<f64>() / plane.len() as f64;
        assert!((mean / want - 1.0).abs() < 1e-5, "{mean} {want}");
    }
    let reference = Reference { halves: Some([&truth, &b]), mask: Some(&mask), ..Reference::new(&truth) };
    let c = compare(&a, &reference).unwrap();
    assert_eq!((c.nonfinite, c.left_out), (0, 113));
    // The halves lie on either side of their mean.
    assert!(c.relmse < c.relmse_plain * 2.5 && c.relmse > c.relmse_plain);
}

/// One pixel of a 7 × 5 picture stands out; it does not count where the reference has it, too.
#[test]
fn fireflies_stand_out_of_their_neighbourhood() {
    let flat = |special: Option<(usize, f32)>| {
        let mut pixels = [[0.5f32; 3]; 35];
        if let Some((i, v)) = special {
            pixels[i] = [v; 3];
        }
        Image::from_rgb(7, 5, &pixels)
    };
    let bright = flat(Some((2 * 7 + 6, 10.1)));
    assert_eq!(fireflies(&bright, &flat(None), 20.0).unwrap(), [[6, 2]]);
    assert!(fireflies(&bright, &bright, 20.0).unwrap().is_empty());
    assert!(fireflies(&flat(Some((9, 9.9))), &flat(None), 20.0).unwrap().is_empty());
}
