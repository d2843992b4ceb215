//! What a render says of its own errors, and how it stops at one.

mod common;

use common::{Bench, pixels};
use serde_json::Value;

fn report(b: &Bench, name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(b.path(name)).unwrap()).unwrap()
}

/// The picture is that of `--spp N`, N found by a pilot that is not part of it: the same bits.
#[test]
fn a_target_error_is_met_without_its_pilot() {
    let b = Bench::new();
    let run = |words: &[&str]| b.run(&[&["render", "room.pbrt", "--mode", "path"], words].concat());
    let goal = run(&["--target-error", "15%", "-o", "goal.exr", "--report", "goal.json"]);
    assert_eq!(goal.code, 0, "{}", goal.err);
    assert!(goal.err.contains("thrown away"), "{}", goal.err);
    let json = report(&b, "goal.json");
    let error = json["noise"]["typical_relative_error_of_a_pixel"].as_f64().unwrap();
    assert!(error <= 0.15, "{error}");
    // Not far more than needed either: variance goes as 1 / N.
    let n = json["noise"]["samples_per_pixel"]["least"].as_u64().unwrap();
    assert!(error > 0.8 * 0.15 && n > 4, "{error} after {n}");
    assert_eq!(json["budget"]["met"], true);
    let plain = run(&["--spp", &n.to_string(), "-o", "plain.exr"]);
    assert_eq!(plain.code, 0);
    assert_eq!(pixels(&b.image("goal.exr")), pixels(&b.image("plain.exr")));
    // A target that the limit does not allow: exit code 4, picture and report are written and say so.
    for limit in [["--spp", "5"], ["--time", "400ms"]] {
        let words = ["--target-error", "0.1%", "-o", "far.exr", "--report", "far.json"];
        let far = run(&[&words[..], &limit].concat());
        assert_eq!(far.code, 4, "{}", far.err);
        assert!(far.err.contains("not the 0.10 % asked for"), "{}", far.err);
        assert_eq!(report(&b, "far.json")["budget"]["met"], false);
        assert!(b.image("far.exr").metadata_value("stopped").unwrap().contains("asked for"));
    }
    for bad in ["0", "100%", "-1%", "nan", "x"] {
        assert_eq!(run(&["--target-error", bad, "-o", "x.exr"]).code, 2, "{bad}");
    }
}

#[test]
fn reports_hold_noise_and_bias_apart() {
    let b = Bench::new();
    for mode in ["zonal", "corrected", "path"] {
        let run = b.run(&[
            "render",
            "room.pbrt",
            "--mode",
            mode,
            "--spp",
            "6",
            "-o",
            "a.exr",
            "--report",
            "a.json",
        ]);
        assert_eq!(run.code, 0, "{}", run.err);
        let json = report(&b, "a.json");
        let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
        let noise = &json["noise"];
        let pixel = number(&noise["typical_relative_error_of_a_pixel"]);
        let mean = number(&noise["relative_error_of_the_mean"]);
        assert!(pixel > 0.0 && mean > 0.0 && mean < pixel, "{noise}");
        let firefly = number(&noise["firefly_index"]);
        assert!(firefly > 1.0 / (6.0 * 1200.0) && firefly < 0.1, "{firefly}");
        assert!((0.0..0.5).contains(&number(&noise["pixels_dominated_by_one_sample"])));
        assert_eq!(json["unbiased"], mode != "zonal");
        for stage in ["load", "render", "write", "total"] {
            assert!(number(&json["seconds"][stage]) >= 0.0, "{stage}");
        }
        assert!(json["rays"]["picture"].as_u64().unwrap() > 7200);
        let bias = &json["zonal_bias"];
        match mode {
            "path" => assert!(bias.is_null() && json["zones"].is_null()),
            _ => {
                assert!(
                    number(&bias["relative"]).abs() < 0.2 && number(&bias["standard_error"]) > 0.0,
                    "{bias}"
                );
                assert_eq!(bias["in_the_picture"], mode == "zonal");
                assert!(number(&json["zones"]["relative_error_median"]) > 0.0);
            }
        }
        let share = &json["residual_share"];
        assert!(if mode == "corrected" { (0.02..=0.5).contains(&number(share)) } else { share.is_null() });
        let mode = b.image("a.exr").metadata_value("mode").unwrap().to_owned();
        assert_eq!(mode.contains("unbiased"), json["unbiased"] == true);
    }
    let refused = b.run(&["render", "room.pbrt", "--spp", "1", "-o", "x.exr", "--report", "no/such/a.json"]);
    assert_eq!(refused.code, 3);
    assert!(!b.path("x.exr").exists());
}

/// The share of residuals is part of what samples depend on: a run goes on with the one of its film.
#[test]
fn corrected_runs_go_on_with_their_share() {
    let b = Bench::new();
    let run = |words: &[&str]| {
        let run = b.run(&[&["render", "room.pbrt", "--mode", "corrected"], words].concat());
        assert_eq!(run.code, 0, "{}", run.err);
    };
    run(&["--spp", "3", "-o", "a.exr", "--checkpoint", "a.hlxf"]);
    run(&["--spp", "6", "-o", "b.exr", "--resume", "a.hlxf"]);
    run(&["--spp", "6", "-o", "c.exr"]);
    assert_eq!(pixels(&b.image("b.exr")), pixels(&b.image("c.exr")));
    let other = b.run(&[
        "render",
        "room.pbrt",
        "--mode",
        "corrected",
        "--spp",
        "6",
        "-o",
        "x.exr",
        "--resume",
        "a.hlxf",
        "--residuals",
        "0.3",
    ]);
    assert_eq!(other.code, 1);
    assert!(other.err.contains("share of residuals"), "{}", other.err);
}

/// Numbers of samples by tile: their mean is what was asked for, they differ, every sample is that of the even picture (so a
/// film goes on from one to the other), and the picture's mean stays.
#[test]
fn adaptive_numbers_of_samples_keep_their_mean() {
    let b = Bench::new();
    let run = |words: &[&str]| {
        let run = b.run(&[&["render", "room.pbrt", "--mode", "path", "--size", "64x48"], words].concat());
        assert_eq!(run.code, 0, "{}", run.err);
    };
    run(&["--spp", "32", "--adaptive", "-o", "a.exr", "--report", "a.json", "--checkpoint", "a.hlxf"]);
    run(&["--spp", "32", "-o", "even.exr", "--report", "even.json"]);
    let (image, even) = (b.image("a.exr"), b.image("even.exr"));
    let samples = image.channel("samples.N").unwrap();
    let mean = samples.iter().map(|n| *n as f64).sum::<f64>() / samples.len() as f64;
    assert!((mean / 32.0 - 1.0).abs() < 0.05, "{mean}");
    let counts = &report(&b, "a.json")["noise"]["samples_per_pixel"];
    let (least, most) = (counts["least"].as_u64().unwrap(), counts["most"].as_u64().unwrap());
    assert!(least < 32 && most > 32, "{counts}");
    let of = |name: &str, key: &str| report(&b, name)["noise"][key].as_f64().unwrap();
    let (m, e) = (of("a.json", "mean_luminance"), of("even.json", "mean_luminance"));
    let error =
        of("a.json", "relative_error_of_the_mean").hypot(of("even.json", "relative_error_of_the_mean"));
    assert!((m / e - 1.0).abs() < 4.4 * error, "{m} {e} {error}");
    assert_eq!(even.channel("samples.N").unwrap().iter().copied().fold(0.0, f32::max), 32.0);
    // Where a tile happens to have more, going on evenly to that number gives the even picture.
    let most = most.to_string();
    run(&["--spp", &most, "--resume", "a.hlxf", "-o", "on.exr"]);
    run(&["--spp", &most, "-o", "whole.exr"]);
    assert_eq!(pixels(&b.image("on.exr")), pixels(&b.image("whole.exr")));
}
