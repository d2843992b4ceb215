//! Runs that are cut off and gone on with, films that are joined; by the built binary.

mod common;

use common::{Bench, ROOM};
use hemilux_image::Image;
use std::process::Stdio;
use std::time::{Duration, Instant};

/// Every channel's bits.
fn bits(image: &Image) -> Vec<(String, Vec<u32>)> {
    image.channels.iter().map(|c| (c.name.clone(), c.data.iter().map(|v| v.to_bits()).collect())).collect()
}

/// Run `args` until it ends by itself, killing it (-9) after spells of time given by `spell`; resumes from `film`.
/// Says how many kills there were and how many runs found a film to go on from.
fn with_kills(b: &Bench, args: &[&str], film: &str, spell: impl Fn(u32) -> Duration) -> (u32, u32) {
    let (mut kills, mut resumed) = (0, 0);
    for attempt in 0..500 {
        let mut all = args.to_vec();
        all.extend(["--checkpoint", film, "--checkpoint-every", "20ms"]);
        if b.path(film).exists() {
            all.extend(["--resume", film]);
            resumed += 1;
        }
        let mut child = b.command(&all).stderr(Stdio::null()).spawn().unwrap();
        let end = Instant::now() + spell(attempt);
        let status = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break Some(status);
            }
            if Instant::now() >= end {
                child.kill().unwrap();
                child.wait().unwrap();
                break None;
            }
            std::thread::sleep(Duration::from_millis(2));
        };
        match status {
            Some(status) => {
                assert!(status.success(), "{status}");
                return (kills, resumed);
            }
            None => kills += 1,
        }
    }
    panic!("never finished");
}

#[test]
fn killed_runs_end_with_the_same_bits() {
    let b = Bench::new();
    for (mode, spp) in [("path", "600"), ("zonal", "60")] {
        let args = |out: &'static str| ["render", "room.pbrt", "--mode", mode, "--spp", spp, "-o", out];
        let begin = Instant::now();
        let plain = b.run(&args("plain.exr"));
        assert_eq!(plain.code, 0, "{}", plain.err);
        // Spells from a fifth of the whole up, growing so that the test ends on a slow machine too.
        let whole = begin.elapsed();
        let spell = |n: u32| whole.mul_f64(0.2 + 0.618_034 * n as f64 % 0.5 + 0.02 * n as f64);
        let film = format!("{mode}.hlxf");
        let (kills, resumed) = with_kills(&b, &args("killed.exr"), &film, spell);
        println!("{mode}: {kills} kills, {resumed} runs went on from a film");
        assert!(kills >= 1 && resumed >= 1, "{kills} kills, {resumed} resumed");
        assert_eq!(bits(&b.image("plain.exr")), bits(&b.image("killed.exr")), "{mode}");
    }
}

#[test]
#[cfg(unix)]
fn an_interrupt_keeps_the_film() {
    let b = Bench::new();
    let args = ["render", "room.pbrt", "--mode", "path", "--spp", "2000", "-o", "a.exr"];
    let keep = ["--checkpoint", "a.hlxf", "--progress", "json"];
    let mut child = b.command(&[&args[..], &keep[..]].concat()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    assert!(lines.by_ref().map_while(Result::ok).any(|l| l.contains("\"pass\"")));
    let killed = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    assert!(killed.unwrap().success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    let part = b.image("a.exr").channel("samples.N").unwrap()[0];
    assert!((1.0..2000.0).contains(&part), "{part}");
    // The film of the interrupted run holds what its picture shows, and goes on to the whole.
    let on = b.run(&[
        "render",
        "room.pbrt",
        "--mode",
        "path",
        "--spp",
        "2000",
        "-o",
        "b.exr",
        "--resume",
        "a.hlxf",
    ]);
    assert_eq!(on.code, 0, "{}", on.err);
    let plain = b.run(&["render", "room.pbrt", "--mode", "path", "--spp", "2000", "-o", "c.exr"]);
    assert_eq!(plain.code, 0);
    assert_eq!(bits(&b.image("b.exr")), bits(&b.image("c.exr")));
}

/// Particles that time ended are traced again to the same number, so the zones are the same.
#[test]
fn zones_that_time_ended_are_made_again() {
    let b = Bench::new();
    let timed = b.run(&[
        "render",
        "room.pbrt",
        "--time",
        "1500ms",
        "--spp",
        "100000",
        "-o",
        "a.exr",
        "--checkpoint",
        "a.hlxf",
        "--zone-budget",
        "300",
    ]);
    assert_eq!(timed.code, 4, "{}", timed.err);
    let a = b.image("a.exr");
    let most = a.channel("samples.N").unwrap().iter().fold(0f32, |m, v| m.max(*v)) as u32;
    let (spp, particles) = ((most + 2).to_string(), a.metadata_value("particles").unwrap().to_owned());
    let on = b.run(&[
        "render",
        "room.pbrt",
        "--spp",
        &spp,
        "-o",
        "b.exr",
        "--resume",
        "a.hlxf",
        "--zone-budget",
        "300",
    ]);
    assert_eq!(on.code, 0, "{}", on.err);
    let plain = b.run(&[
        "render",
        "room.pbrt",
        "--spp",
        &spp,
        "-o",
        "c.exr",
        "--zone-budget",
        "300",
        "--particles",
        &particles,
    ]);
    assert_eq!(plain.code, 0, "{}", plain.err);
    assert_eq!(bits(&b.image("b.exr")), bits(&b.image("c.exr")));
}

#[test]
fn films_of_something_else_are_refused() {
    let b = Bench::new();
    let make = b.run(&["render", "room.pbrt", "--spp", "2", "-o", "a.exr", "--checkpoint", "a.hlxf"]);
    assert_eq!(make.code, 0, "{}", make.err);
    b.write("other.pbrt", &ROOM.replace("0.7 0.7 0.7", "0.6 0.7 0.7"));
    b.write("view.pbrt", "LookAt 0 -2 1 0 0 1 0 0 1 Camera \"perspective\" \"float fov\" 70\n");
    let resume = |scene: &str, more: &[&str]| {
        b.run(&[&["render", scene, "--spp", "3", "-o", "x.exr", "--resume", "a.hlxf"], more].concat())
    };
    for (run, word) in [
        (resume("other.pbrt", &[]), "made with another scene"),
        (resume("room.pbrt", &["--view", "view.pbrt"]), "made with another view"),
        (resume("room.pbrt", &["--mode", "path"]), "mode: zonal in the file, path here"),
        (resume("room.pbrt", &["--seed", "4"]), "seed: 0 in the file, 4 here"),
        (resume("room.pbrt", &["--size", "20x20"]), "picture size: 40x30 in the file, 20x20 here"),
        (resume("room.pbrt", &["--crop", "0,0.5,0,1"]), "crop"),
        (resume("room.pbrt", &["--zone-budget", "70", "--particles", "20k"]), "zone budget: 500"),
        (resume("room.pbrt", &["--zone-budget", "500", "--particles", "9k"]), "particles: 20000"),
    ] {
        assert_eq!(run.code, 1, "{}", run.err);
        assert!(
            run.err.contains("a.hlxf: made with another") && run.err.contains(word),
            "{word}: {}",
            run.err
        );
    }
    let good = std::fs::read(b.path("a.hlxf")).unwrap();
    for (name, bytes, word) in [
        ("cut.hlxf", good[..good.len() / 2].to_vec(), "damaged"),
        ("empty.hlxf", Vec::new(), "not a film"),
        ("old.hlxf", [&good[..8], &[0, 0, 0, 0], &good[12..]].concat(), "version 0"),
    ] {
        std::fs::write(b.path(name), bytes).unwrap();
        let run = b.run(&["render", "room.pbrt", "--spp", "3", "-o", "x.exr", "--resume", name]);
        assert_eq!(run.code, 1);
        assert!(run.err.contains(name) && run.err.contains(word), "{word}: {}", run.err);
    }
    assert_eq!(b.run(&["render", "room.pbrt", "-o", "x.exr", "--resume", "none.hlxf"]).code, 1);
    assert!(!b.path("x.exr").exists());
    assert_eq!(std::fs::read(b.path("a.hlxf")).unwrap(), good, "refusing leaves the film alone");
    // Negative control: the right one is taken.
    assert_eq!(resume("room.pbrt", &[]).code, 0);
}

#[test]
fn places_that_cannot_be_written_lose_nothing() {
    let b = Bench::new();
    for (path, code) in [("no/such/a.hlxf", 3), ("a.film", 2)] {
        let run = b.run(&["render", "room.pbrt", "--spp", "1", "-o", "x.exr", "--checkpoint", path]);
        assert_eq!(run.code, code, "{}", run.err);
        assert!(!b.path("x.exr").exists(), "refused before rendering");
    }
    // A directory that goes away in the middle: told at once, the picture is written, the exit code says it.
    std::fs::create_dir(b.path("gone")).unwrap();
    let args = [
        "render",
        "room.pbrt",
        "--mode",
        "path",
        "--spp",
        "1200",
        "-o",
        "y.exr",
        "--checkpoint",
        "gone/a.hlxf",
        "--checkpoint-every",
        "20ms",
    ];
    let child = b.command(&args).stderr(Stdio::piped()).spawn().unwrap();
    let begin = Instant::now();
    while !b.path("gone/a.hlxf").exists() {
        assert!(begin.elapsed() < Duration::from_secs(60), "no checkpoint within a minute");
        std::thread::sleep(Duration::from_millis(2));
    }
    std::fs::rename(b.path("gone"), b.path("kept")).unwrap();
    let out = child.wait_with_output().unwrap();
    let err = common::text(&out.stderr);
    assert_eq!(out.status.code(), Some(3), "{err}");
    assert!(err.contains("no checkpoint could be written") && err.contains("the render goes on"), "{err}");
    assert_eq!(b.image("y.exr").channel("samples.N").unwrap()[0], 1200.0);
    // The last good film is as it was.
    let on =
        ["render", "room.pbrt", "--mode", "path", "--spp", "1200", "-o", "z.exr", "--resume", "kept/a.hlxf"];
    assert_eq!(b.run(&on).code, 0);
    assert_eq!(bits(&b.image("y.exr")), bits(&b.image("z.exr")));
}

#[test]
fn parts_join_to_the_whole() {
    let b = Bench::new();
    let part = |name: &str, more: &[&str]| {
        let film = format!("{name}.hlxf");
        let fixed = ["render", "room.pbrt", "-o", "part.exr", "--checkpoint", &film];
        let run = b.run(&[&fixed[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.err);
    };
    part("whole", &["--spp", "6"]);
    part("left", &["--passes", "0..4", "--crop", "0,0.3,0,1"]);
    part("right", &["--passes", "0..4", "--crop", "0.3,1,0,1"]);
    part("late", &["--passes", "4..6"]);
    part("seed", &["--spp", "6", "--seed", "9"]);
    let merge = |words: &[&str]| b.run(&[&["merge"], words].concat());
    let run = merge(&[
        "late.hlxf",
        "right.hlxf",
        "left.hlxf",
        "-o",
        "joined.exr",
        "-o",
        "joined.hlxf",
        "-o",
        "j.png",
    ]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.err.contains("joined 3 films, 1 seed, 6 samples per pixel"), "{}", run.err);
    let whole = b.run(&["render", "room.pbrt", "--spp", "6", "-o", "whole.exr"]);
    assert_eq!(whole.code, 0);
    assert_eq!(bits(&b.image("joined.exr")), bits(&b.image("whole.exr")));
    for (key, wanted) in [("samples_per_pixel", "6"), ("mode", "zonal (biased by the zones)"), ("seed", "0")]
    {
        assert_eq!(b.image("joined.exr").metadata_value(key), Some(wanted), "{key}");
    }
    // A joined film is a film: it goes on, and joins further.
    let on = b.run(&["render", "room.pbrt", "--spp", "6", "-o", "again.exr", "--resume", "joined.hlxf"]);
    assert_eq!(on.code, 0, "{}", on.err);
    assert_eq!(bits(&b.image("again.exr")), bits(&b.image("whole.exr")));
    assert_eq!(merge(&["joined.hlxf", "seed.hlxf", "-o", "both.hlxf", "-o", "both.exr"]).code, 0);
    let samples = b.image("both.exr").channel("samples.N").unwrap()[0];
    assert_eq!(samples, 12.0);
    let refused = b.run(&["render", "room.pbrt", "--spp", "20", "-o", "x.exr", "--resume", "both.hlxf"]);
    assert_eq!(refused.code, 1);
    assert!(refused.err.contains("2 seeds cannot be gone on with"), "{}", refused.err);
    // Overlap and gaps are refused with a reason.
    let overlap = merge(&["whole.hlxf", "late.hlxf", "-o", "x.exr"]);
    assert_eq!(overlap.code, 1);
    assert!(overlap.err.contains("both hold pass 4"), "{}", overlap.err);
    assert_eq!(merge(&["left.hlxf", "late.hlxf", "-o", "x.exr"]).code, 1);
    assert!(!b.path("x.exr").exists());
}
