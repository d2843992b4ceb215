//! Where gathers are surprised, the prologue makes more particles by itself, says so, and does the same for every part of a picture.

mod common;
use common::Bench;
use hemilux_image::Image;
use std::fmt::Write;

/// A floor under a board, lit through `mirrors` × 4 small mirrors around it, each of which about one particle in ten million would meet.
fn scene(mirrors: u32, board: bool) -> String {
    let mut text = "LookAt 0 -0.01 0.9  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" 90\n\
        Film \"rgb\" \"integer xresolution\" 48 \"integer yresolution\" 48 \"string filename\" \"x.exr\"\nWorldBegin\n\
        AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 100 90 80 ] Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n\
        Translate 0 0 20 Shape \"sphere\" \"float radius\" 2 AttributeEnd\n\
        Material \"diffuse\" \"rgb reflectance\" [ 0.3 0.3 0.3 ]\n\
        Shape \"trianglemesh\" \"point3 P\" [ -1 -1 0 1 -1 0 1 1 0 -1 1 0 ] \"integer indices\" [ 0 1 2 0 2 3 ]\n"
        .to_owned();
    if board {
        text += "Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n\
            Shape \"trianglemesh\" \"point3 P\" [ -1.15 -1.15 1 1.15 -1.15 1 1.15 1.15 1 -1.15 1.15 1 ] \"integer indices\" [ 0 1 2 0 2 3 ]\n";
    }
    text += "Material \"conductor\" \"rgb reflectance\" [ 0.9 0.9 0.9 ] \"float roughness\" 0\n";
    for side in 0..4 {
        for i in 0..mirrors {
            // Tilted so that the lamp is thrown down onto the floor, each a little otherwise.
            let (y, z) =
                (-1.0 + 2.0 * (i / 4) as f32 / (mirrors / 4).max(1) as f32, 0.25 + 0.17 * (i % 4) as f32);
            let tilt = -60.0 + 1.3 * (i % 7) as f32;
            writeln!(
                text,
                "AttributeBegin Rotate {} 0 0 1 Translate 1.4 {y} {z} Rotate {tilt} 0 1 0 \
                 Shape \"trianglemesh\" \"point3 P\" [ -0.006 -0.006 0 0.006 -0.006 0 0.006 0.006 0 -0.006 0.006 0 ] \
                 \"integer indices\" [ 0 1 2 0 2 3 ] AttributeEnd",
                90 * side
            )
            .unwrap();
        }
    }
    text
}

/// Every channel's bits.
fn bits(image: &Image) -> Vec<(String, Vec<u32>)> {
    image.channels.iter().map(|c| (c.name.clone(), c.data.iter().map(|v| v.to_bits()).collect())).collect()
}

fn report(b: &Bench, name: &str) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(b.path(name)).unwrap()).unwrap()
}

fn surprises(report: &serde_json::Value) -> Vec<(u64, f64)> {
    let pilots = report["zones"]["pilots"].as_array().unwrap();
    pilots.iter().map(|p| (p["particles"].as_u64().unwrap(), p["surprise"].as_f64().unwrap())).collect()
}

#[test]
fn surprise_makes_more_particles_and_every_part_the_same() {
    let b = Bench::new();
    b.write("mirrors.pbrt", &scene(100, true));
    let render = |spp: &str, more: &[&str]| {
        let args = ["render", "mirrors.pbrt", "--zone-budget", "500", "--gather-rays", "32", "--spp", spp];
        let run = b.run(&[&args, more].concat());
        assert_eq!(run.code, 0, "{}", run.err);
        run
    };
    let whole = render("2", &["-o", "whole.exr", "--report", "whole.json"]);
    let report = report(&b, "whole.json");
    let seen = surprises(&report);
    println!("{seen:?}\n{}", whole.err);
    let traced = report["zones"]["particles"].as_u64().unwrap();
    assert!(seen[0].0 == 1 << 21 && seen[0].1 > 0.03, "{seen:?}");
    assert!(
        traced > seen[0].0 && traced <= 1 << 23 && seen.last().unwrap().1 < 0.3 * seen[0].1,
        "{traced}, {seen:?}"
    );
    assert!(whole.err.contains("particles instead of 2.10 M"), "{}", whole.err);

    render("2", &["-o", "left.exr", "--crop", "0,0.4,0,1", "--checkpoint", "left.hlxf"]);
    render("2", &["-o", "right.exr", "--crop", "0.4,1,0,1", "--checkpoint", "right.hlxf"]);
    let merged = b.run(&["merge", "left.hlxf", "right.hlxf", "-o", "merged.exr"]);
    assert_eq!(merged.code, 0, "{}", merged.err);
    assert_eq!(bits(&b.image("whole.exr")), bits(&b.image("merged.exr")));

    let on = render("3", &["-o", "on.exr", "--crop", "0,0.4,0,1", "--resume", "left.hlxf"]);
    assert!(!on.err.contains("instead of"), "a film knows how many particles it has: {}", on.err);
    let straight = render("3", &["-o", "three.exr", "--crop", "0,0.4,0,1"]);
    assert!(straight.err.contains("instead of"), "{}", straight.err);
    assert_eq!(bits(&b.image("on.exr")), bits(&b.image("three.exr")));
}

/// Control: the floor in the open holds no surprise.
#[test]
fn without_surprise_nothing_changes() {
    let b = Bench::new();
    b.write("open.pbrt", &scene(0, false));
    for (name, more) in [("a", &[][..]), ("b", &["--particles", "2097152"][..])] {
        let (exr, json) = (format!("{name}.exr"), format!("{name}.json"));
        let args =
            ["render", "open.pbrt", "--zone-budget", "500", "--spp", "1", "-o", &exr, "--report", &json];
        let run = b.run(&[&args[..], more].concat());
        assert_eq!(run.code, 0, "{}", run.err);
        assert!(!run.err.contains("instead of"), "{}", run.err);
        let report = report(&b, &json);
        assert_eq!(report["zones"]["particles"], 2_097_152);
        // What the user says of particles is not asked again.
        let seen = surprises(&report);
        assert!(if name == "a" { seen.len() == 1 && seen[0].1 < 0.03 } else { seen.is_empty() }, "{seen:?}");
    }
    assert_eq!(bits(&b.image("a.exr")), bits(&b.image("b.exr")));
}
