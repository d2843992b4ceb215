//! The built binary, verb by verb: exit codes, messages, files.

mod common;

use common::{Bench, ROOM, pixels, text};
use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

#[test]
fn render_writes_every_format_with_its_header() {
    let b = Bench::new();
    let run = b.run(&[
        "render",
        "room.pbrt",
        "--strategy",
        "jittered",
        "--spp",
        "2",
        "-o",
        "a.exr",
        "-o",
        "a.png",
        "-o",
        "a.hdr",
        "-o",
        "a.pfm",
    ]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.out.is_empty(), "pictures to files, talk to stderr: {}", run.out);
    assert!(run.err.contains("2 samples per pixel") && run.err.contains("exposure x"), "{}", run.err);
    let exr = b.image("a.exr");
    assert_eq!((exr.width, exr.height), (40, 30));
    let names: Vec<&str> = exr.channels.iter().map(|c| c.name.as_str()).collect();
    for name in ["R", "G", "B", "stderr.G", "samples.N", "albedo.R", "N.X", "depth.Z"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    for (key, wanted) in [
        ("software", "hemilux 0."),
        ("mode", "zonal (biased by the zones)"),
        ("seed", "0"),
        ("samples_per_pixel", "2"),
        ("strategy", "jittered"),
        ("command", "hemilux render room.pbrt --strategy jittered"),
    ] {
        let value = exr.metadata_value(key).unwrap_or_default();
        assert!(value.starts_with(wanted), "{key}: {value}");
    }
    assert_eq!(exr.metadata_value("scene_hash").map(str::len), Some(16));
    for key in ["relative_error", "zone_median_error", "render_time", "rays", "zones", "particles"] {
        assert!(exr.metadata_value(key).is_some(), "{key}");
    }
    let hdr = b.image("a.hdr");
    assert!(hdr.metadata_value("VIEW").unwrap_or_default().starts_with("-vtv -vp 0 -3.5 1"));
    assert_eq!(hdr.metadata_value("EXPOSURE"), Some("1"));
    assert!(hdr.metadata_value("PRIMARIES").unwrap_or_default().starts_with("0.64 0.33"));
    assert!(hdr.metadata_value("COMMAND").unwrap_or_default().starts_with("hemilux render"));
    let png = b.image("a.png");
    assert!(png.metadata_value("exposure").unwrap_or_default().starts_with('x'));
    assert_eq!(pixels(&b.image("a.pfm")), pixels(&exr));
    // A red wall on the left, a green one on the right: the picture is not mirrored.
    let ratio = |x: usize| exr.get("R", x, 15).unwrap() / exr.get("G", x, 15).unwrap();
    assert!(ratio(5) > 1.5 && ratio(34) < 0.7, "{} {}", ratio(5), ratio(34));
}

#[test]
fn threads_do_not_show_and_seeds_do() {
    let b = Bench::new();
    for (name, more) in [("one.exr", ["-t", "1"]), ("two.exr", ["-t", "2"]), ("other.exr", ["--seed", "1"])] {
        let run = b.run(&[&["render", "room.pbrt", "--spp", "2", "-o", name], &more[..]].concat());
        assert_eq!(run.code, 0, "{}", run.err);
    }
    let [one, two, other] = ["one.exr", "two.exr", "other.exr"].map(|n| b.image(n));
    for (a, b) in one.channels.iter().zip(&two.channels) {
        let bits = |v: &[f32]| v.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!((&a.name, bits(&a.data)), (&b.name, bits(&b.data)));
    }
    assert_ne!(pixels(&one), pixels(&other));
}

#[test]
fn zones_are_written_read_back_and_recognised() {
    let b = Bench::new();
    let run = b.run(&[
        "zones",
        "room.pbrt",
        "-o",
        "room.hlxz",
        "-o",
        "room.ply",
        "--zone-budget",
        "400",
        "--particles",
        "20k",
    ]);
    assert_eq!(run.code, 0, "{}", run.err);
    for word in
        ["zones", "target width", "particles        20000", "median", "emitted", "absorbed", "escaped"]
    {
        assert!(run.out.contains(word), "{word} is not in {}", run.out);
    }
    assert!(std::fs::read(b.path("room.ply")).unwrap().starts_with(b"ply\n"));
    let render = |extra: &[&str]| b.run(&[&["render", "room.pbrt", "--spp", "1"], extra].concat());
    assert_eq!(render(&["-o", "read.exr", "--zones", "room.hlxz"]).code, 0);
    assert_eq!(render(&["-o", "made.exr", "--zone-budget", "400", "--particles", "20k"]).code, 0);
    assert_eq!(pixels(&b.image("read.exr")), pixels(&b.image("made.exr")));
    // Another camera is the same scene.
    b.write("view.pbrt", "Scale -1 1 1 LookAt 0 -2 1 0 0 1 0 0 1 Camera \"perspective\" \"float fov\" 70\n");
    let viewed = render(&["-o", "view.exr", "--zones", "room.hlxz", "--view", "view.pbrt"]);
    assert_eq!(viewed.code, 0, "{}", viewed.err);
    assert_ne!(pixels(&b.image("view.exr")), pixels(&b.image("read.exr")));
    let unused = render(&["-o", "path.exr", "--zones", "room.hlxz", "--mode", "path"]);
    assert_eq!(unused.code, 0);
    assert!(unused.err.contains("warning: --zones is not used in mode path"), "{}", unused.err);
    // Another room is not, and damage is seen.
    b.write("other.pbrt", &ROOM.replace("0.7 0.7 0.7", "0.6 0.7 0.7"));
    let foreign = b.run(&["render", "other.pbrt", "--spp", "1", "-o", "x.exr", "--zones", "room.hlxz"]);
    assert_eq!(foreign.code, 1);
    assert!(foreign.err.contains("error: room.hlxz: made from another scene"), "{}", foreign.err);
    let mut bytes = std::fs::read(b.path("room.hlxz")).unwrap();
    bytes[300] ^= 1;
    std::fs::write(b.path("bad.hlxz"), &bytes).unwrap();
    let damaged = render(&["-o", "x.exr", "--zones", "bad.hlxz"]);
    assert_eq!(damaged.code, 1);
    assert!(damaged.err.contains("damaged"), "{}", damaged.err);
    assert!(!b.path("x.exr").exists());
}

#[test]
fn a_view_must_have_a_camera() {
    let b = Bench::new();
    b.write("empty.pbrt", "Film \"rgb\" \"integer xresolution\" 3\n");
    let run = b.run(&["render", "room.pbrt", "--view", "empty.pbrt", "-o", "x.exr"]);
    assert_eq!(run.code, 1);
    assert!(run.err.contains("empty.pbrt: a view needs a Camera directive"), "{}", run.err);
    b.write("bad.pbrt", "Camera \"perspective\" \"float fov\" -3\n");
    let run = b.run(&["render", "room.pbrt", "--view", "bad.pbrt", "-o", "x.exr"]);
    assert_eq!(run.code, 1);
    assert!(run.err.contains("bad.pbrt:1:"), "{}", run.err);
}

#[test]
fn size_crop_and_the_default_name() {
    let b = Bench::new();
    let run = b.run(&[
        "render",
        "room.pbrt",
        "--mode",
        "path",
        "--spp",
        "1",
        "--size",
        "64x48",
        "--crop",
        "0.25,0.75,0,0.5",
    ]);
    assert_eq!(run.code, 0, "{}", run.err);
    let image = b.image("room-film.exr");
    assert_eq!((image.width, image.height), (32, 24));
    // The part is the same as in the whole.
    let all = b.run(&[
        "render",
        "room.pbrt",
        "--mode",
        "path",
        "--pixelsamples",
        "1",
        "--size",
        "64x48",
        "--outfile",
        "all.exr",
    ]);
    assert_eq!(all.code, 0, "{}", all.err);
    let all = b.image("all.exr");
    for (x, y) in [(0, 0), (31, 23), (7, 19)] {
        assert_eq!(image.rgb_at(x, y), all.rgb_at(x + 16, y));
    }
    b.write("plain.pbrt", &ROOM.replace("\"string filename\" \"somewhere/room-film.tiff\"", ""));
    assert_eq!(b.run(&["render", "plain.pbrt", "--mode", "path", "--spp", "1"]).code, 0);
    assert!(b.path("plain.exr").exists());
}

#[test]
fn what_cannot_be_written_is_refused_before_rendering() {
    let b = Bench::new();
    b.write("file", "");
    for (path, code, words) in [
        ("nowhere/a.exr", 3, "nowhere/a.exr"),
        ("file/a.exr", 3, "file/a.exr"),
        (".", 2, "pictures are written as"),
        ("a.jpg", 2, "a.jpg: pictures are written as"),
        ("a", 2, "a: pictures are written as"),
    ] {
        let begin = Instant::now();
        // A day of rendering, were it to begin.
        let run = b.run(&["render", "room.pbrt", "--spp", "100000000", "-o", path]);
        assert_eq!(run.code, code, "{path}: {}", run.err);
        assert!(run.err.contains(words) && run.err.starts_with("error: "), "{}", run.err);
        assert!(begin.elapsed() < Duration::from_secs(10));
    }
    std::fs::create_dir(b.path("dir.exr")).unwrap();
    assert_eq!(b.run(&["render", "room.pbrt", "-o", "dir.exr"]).code, 3);
    assert_eq!(b.run(&["render", "room.pbrt", "-o", "a.exr", "-o", "a.exr"]).code, 2);
    assert_eq!(b.run(&["zones", "room.pbrt", "-o", "nowhere/a.hlxz"]).code, 3);
    assert_eq!(b.run(&["zones", "room.pbrt", "-o", "a.exr"]).code, 2);
    let huge = b.run(&["render", "room.pbrt", "--size", "1000000x1000000", "-o", "a.exr"]);
    assert_eq!(huge.code, 3);
    assert!(huge.err.contains("a film of 1000000x1000000 pixels needs"), "{}", huge.err);
    // Nothing is left behind.
    let mut left: Vec<String> = b.files();
    left.sort();
    assert_eq!(left, ["dir.exr", "file", "room.pbrt"]);
}

#[test]
fn usage_errors_are_2_and_scene_errors_1() {
    let b = Bench::new();
    for args in [
        &["render"][..],
        &["render", "room.pbrt", "--spp", "0"],
        &["render", "room.pbrt", "--spp", "many"],
        &["render", "room.pbrt", "--time", "5 minutes"],
        &["render", "room.pbrt", "--mode", "magic"],
        &["render", "room.pbrt", "--crop", "0,2,0,1"],
        &["render", "room.pbrt", "--size", "0x5"],
        &["render", "room.pbrt", "-D", "novalue"],
        &["render", "room.pbrt", "--zones", "a.hlxz", "--particles", "5"],
        &["render", "room.pbrt", "--unknown"],
        &["frobnicate"],
        &[],
        &["image", "diff", "a.exr"],
        &["@missing-file"],
    ] {
        let run = b.run(args);
        assert_eq!(run.code, 2, "{args:?}: {}", run.err);
        assert!(run.out.is_empty() && !run.err.is_empty(), "{args:?}");
    }
    assert_eq!(b.run(&["render", "missing.pbrt", "-o", "a.exr"]).code, 1);
    b.write("typo.pbrt", &ROOM.replace("float fov", "float fob"));
    let human = b.run(&["render", "typo.pbrt", "-o", "a.exr"]);
    assert_eq!(human.code, 1);
    assert!(human.err.contains("typo.pbrt:3:") && human.err.contains("^"), "{}", human.err);
    assert_eq!(human.err.matches("error").count(), 1, "said once: {}", human.err);
    let short = b.run(&["info", "typo.pbrt", "--message-format", "short"]);
    assert_eq!((short.code, short.err.lines().count()), (1, 1), "{}", short.err);
    let json = b.run(&["info", "typo.pbrt", "--message-format", "json"]);
    let line: serde_json::Value = serde_json::from_str(json.err.lines().next().unwrap()).unwrap();
    assert_eq!((line["severity"].as_str(), line["line"].as_u64()), (Some("error"), Some(3)));
    let lenient = b.run(&["render", "typo.pbrt", "--lenient", "--mode", "path", "--spp", "1", "-o", "a.exr"]);
    assert_eq!(lenient.code, 0, "{}", lenient.err);
    assert!(lenient.err.contains("warning"), "{}", lenient.err);
}

#[test]
fn dark_scenes_are_warned_about() {
    let b = Bench::new();
    b.write("dark.pbrt", &ROOM.replace("AreaLightSource \"diffuse\" \"rgb L\" [ 20 20 20 ]", ""));
    let run = b.run(&["render", "dark.pbrt", "--spp", "1", "-o", "dark.exr"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.err.contains("warning") && run.err.contains("black"), "{}", run.err);
    assert!(pixels(&b.image("dark.exr")).iter().flatten().all(|v| *v == 0.0));
    let quiet = b.run(&["render", "dark.pbrt", "--spp", "1", "-o", "dark.exr", "-q"]);
    assert_eq!((quiet.code, quiet.err.as_str(), quiet.out.as_str()), (0, "", ""));
}

#[test]
fn progress_as_json_lines() {
    let b = Bench::new();
    let run = b.run(&["render", "room.pbrt", "--spp", "6", "-o", "a.exr", "--progress", "json"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let lines: Vec<serde_json::Value> =
        run.err.lines().map(|l| serde_json::from_str(l).unwrap_or_else(|e| panic!("{e}: {l}"))).collect();
    let stages: Vec<&str> = lines.iter().filter_map(|l| l["stage"].as_str()).collect();
    for stage in ["load", "prepare", "zones", "render", "write", "done"] {
        assert!(stages.contains(&stage), "{stage} is not in {stages:?}");
    }
    let times: Vec<f64> = lines.iter().map(|l| l["t"].as_f64().unwrap()).collect();
    assert!(times.is_sorted());
    assert!(lines.iter().any(|l| l["stage"] == "render" && l["pass"] == 6 && l["rays"].as_u64() > Some(0)));
    let last = lines.last().unwrap();
    assert_eq!((last["stage"].as_str(), last["spp"].as_u64()), (Some("done"), Some(6)));
    assert!(last["err"].as_f64() > Some(0.0));
    assert_eq!(b.run(&["render", "room.pbrt", "--spp", "1", "-o", "a.exr", "--progress", "none"]).err, "");
}

#[test]
fn a_time_budget_is_kept_and_one_too_short_is_said() {
    let b = Bench::new();
    let run = b.run(&["render", "room.pbrt", "--time", "1500ms", "-o", "a.exr"]);
    assert_eq!(run.code, 0, "{}", run.err);
    let spp = b.image("a.exr").metadata_value("samples_per_pixel").unwrap_or_default().to_owned();
    assert_ne!(spp, "1", "more than a second is more than a pass");
    let both = b.run(&["render", "room.pbrt", "--time", "500ms", "--spp", "1000000", "-o", "b.exr"]);
    assert_eq!(both.code, 4);
    assert!(both.err.contains("error: stopped by --time 500 ms at"), "{}", both.err);
    assert!(b.image("b.exr").metadata_value("stopped").is_some());
}

#[test]
fn pictures_on_standard_output() {
    let b = Bench::new();
    let out = b
        .command(&["render", "room.pbrt", "--mode", "path", "--spp", "1", "-o", "-", "-q"])
        .output()
        .unwrap();
    assert!(out.status.success());
    let image = hemilux_image::read_bytes(&out.stdout, None).unwrap();
    assert_eq!((image.width, image.height), (40, 30));
    // And back in.
    let mut info =
        b.command(&["image", "info", "-"]).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    info.stdin.take().unwrap().write_all(&out.stdout).unwrap();
    let said = info.wait_with_output().unwrap();
    assert!(text(&said.stdout).contains("EXR, 40 x 30 pixels"), "{}", text(&said.stdout));
}

#[test]
fn a_scene_from_standard_input_and_words_from_a_file() {
    let b = Bench::new();
    b.write("words", "# how\n--mode path\n--spp 1 -o 'with space.exr'");
    let mut child =
        b.command(&["render", "-", "@words"]).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(ROOM.as_bytes()).unwrap();
    let out = child.wait_with_output().unwrap();
    assert!(out.status.success(), "{}", text(&out.stderr));
    assert!(b.path("with space.exr").exists());
}

#[test]
#[cfg(unix)]
fn an_interrupt_writes_what_there_is() {
    let b = Bench::new();
    let mut child = b
        .command(&[
            "render",
            "room.pbrt",
            "--mode",
            "path",
            "--spp",
            "100000000",
            "-o",
            "a.exr",
            "--progress",
            "json",
        ])
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // The first pass must be done before there is something to write.
    let mut lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    assert!(lines.by_ref().map_while(Result::ok).any(|l| l.contains("\"pass\"")));
    let killed = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(killed.success());
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130), "{rest:?}");
    assert!(rest.iter().any(|l| l.starts_with("error: interrupted")), "{rest:?}");
    let image = b.image("a.exr");
    assert_eq!(image.metadata_value("stopped"), Some("interrupted"));
    assert!(image.channel("samples.N").unwrap().iter().all(|n| *n >= 1.0));
}

#[test]
fn info_of_scenes_and_pictures() {
    let b = Bench::new();
    let run = b.run(&["info", "room.pbrt"]);
    assert_eq!(run.code, 0, "{}", run.err);
    for word in [
        "40 x 30 pixels",
        "12 triangles, 1 quadrics",
        "3 diffuse",
        "scene hash",
        "-1 -1 0 to 1 1 2 m",
        "room.pbrt",
    ] {
        assert!(run.out.contains(word), "{word} is not in {}", run.out);
    }
    let json: serde_json::Value = serde_json::from_str(&b.run(&["info", "room.pbrt", "--json"]).out).unwrap();
    // A sphere of radius 0.15 m with 20 W/sr/m2: pi L x 4 pi r2.
    let power = std::f64::consts::PI * 20.0 * 4.0 * std::f64::consts::PI * 0.15 * 0.15;
    assert!((json["power_W"].as_f64().unwrap() / power - 1.0).abs() < 1e-4, "{}", json["power_W"]);
    let mut image = hemilux_image::Image::from_rgb(2, 1, &[[0.0, 1.0, 2.0], [4.0, f32::NAN, -2.0]]);
    image.set_metadata("note", "hello");
    hemilux_image::write(b.path("p.exr"), &image).unwrap();
    let json: serde_json::Value = serde_json::from_str(&b.run(&["info", "p.exr", "--json"]).out).unwrap();
    let channel = |name: &str| {
        json["channels"].as_array().unwrap().iter().find(|c| c["name"] == name).cloned().unwrap_or_default()
    };
    assert_eq!((channel("R")["mean"].as_f64(), channel("R")["max"].as_f64()), (Some(2.0), Some(4.0)));
    assert_eq!((channel("G")["nonfinite"].as_u64(), channel("G")["mean"].as_f64()), (Some(1), Some(1.0)));
    assert_eq!(channel("B")["min"].as_f64(), Some(-2.0));
    assert!(b.run(&["info", "p.exr"]).out.contains("note: hello"));
    assert_eq!(b.run(&["info", "missing.exr"]).code, 1);
    assert_eq!(b.run(&["info", "p.exr", "room.pbrt"]).code, 2);
}

#[test]
fn diff_of_known_pictures() {
    let b = Bench::new();
    b.flat("one.exr", 4, 2, 1.0);
    b.flat("more.exr", 4, 2, 1.1);
    let json = |args: &[&str]| {
        let run = b.run(&[&["image", "diff", "--json"], args].concat());
        (run.code, serde_json::from_str::<serde_json::Value>(&run.out).unwrap_or_default())
    };
    // (0.1)^2 / (1 + 0.01)
    let (code, figures) = json(&["more.exr", "one.exr"]);
    assert_eq!(code, 0);
    assert!((figures["relmse"].as_f64().unwrap() - 0.01 / 1.01).abs() < 1e-6, "{figures}");
    assert!((figures["mean_ratio"][1].as_f64().unwrap() - 1.1).abs() < 1e-6);
    assert_eq!(json(&["more.exr", "one.exr", "--tolerance", "0.01"]).0, 0);
    let over = b.run(&["image", "diff", "more.exr", "one.exr", "--tolerance", "0.0098"]);
    assert_eq!(over.code, 5);
    assert!(
        over.out.contains("relMSE") && over.err.starts_with("error: relmse 9.9"),
        "{} {}",
        over.out,
        over.err
    );
    assert_eq!(json(&["more.exr", "one.exr", "--metric", "mae", "--tolerance", "0.09"]).0, 5);
    assert_eq!(json(&["one.exr", "one.exr", "--metric", "flip", "--tolerance", "0"]).0, 0);
    // A reference twice as large, its halves, a mask.
    b.flat("big.exr", 8, 4, 1.0);
    assert!((json(&["more.exr", "big.exr"]).1["mae"].as_f64().unwrap() - 0.1).abs() < 1e-6);
    b.flat("low.exr", 4, 2, 0.9);
    let (_, halves) = json(&["more.exr", "one.exr", "--halves", "low.exr,more.exr"]);
    assert!(
        halves["relmse"].as_f64().unwrap().abs() < 1e-6 && halves["plain"].as_f64() > Some(0.009),
        "{halves}"
    );
    assert_eq!(json(&["more.exr", "one.exr", "--halves", "low.exr"]).0, 2);
    // Companions are taken by their names, and only then.
    b.flat("reference.exr", 4, 2, 1.0);
    b.flat("reference_a.exr", 4, 2, 0.9);
    b.flat("reference_b.exr", 4, 2, 1.1);
    assert!(json(&["more.exr", "reference.exr"]).1["relmse"].as_f64().unwrap().abs() < 1e-6);
    let (_, alone) = json(&["more.exr", "reference.exr", "--no-companions"]);
    assert!((alone["relmse"].as_f64().unwrap() - 0.01 / 1.01).abs() < 1e-6);
    // Pictures of the difference.
    assert_eq!(json(&["more.exr", "one.exr", "-o", "d.exr"]).0, 0);
    assert!((b.image("d.exr").rgb_at(1, 1).unwrap()[0] - 0.1).abs() < 1e-6);
    assert_eq!(json(&["more.exr", "one.exr", "-o", "d.png"]).0, 0);
    assert_eq!(b.image("d.png").height, 2);
    b.flat("odd.exr", 3, 2, 1.0);
    assert_eq!(json(&["more.exr", "odd.exr"]).0, 1);
}

#[test]
fn tone_map_and_false_colours() {
    let b = Bench::new();
    b.flat("half.exr", 4, 2, 0.25);
    let run = b.run(&["image", "tonemap", "half.exr", "-o", "half.png", "--exposure", "1"]);
    assert_eq!(run.code, 0, "{}", run.err);
    // 0.25 x 2 = 0.5 is code 188 in sRGB.
    let value = b.image("half.png").rgb_at(0, 0).unwrap()[1] * 255.0;
    assert!((value - 188.0).abs() < 0.01, "{value}");
    assert_eq!(
        b.run(&["image", "tonemap", "half.exr", "-o", "half.png", "--exposure", "-1", "--curve", "aces"])
            .code,
        0
    );
    let colours = [
        "image",
        "falsecolor",
        "half.exr",
        "-o",
        "f.png",
        "--max",
        "0.25",
        "--unit",
        "W",
        "--log",
        "--no-legend",
    ];
    let run = b.run(&colours);
    assert_eq!(run.code, 0, "{}", run.err);
    let top = b.image("f.png").rgb_at(0, 0).unwrap();
    assert!(top[0] > 0.7 && top[1] > 0.7, "the upper end of the palette is bright: {top:?}");
    assert_eq!(b.run(&["image", "falsecolor", "half.exr", "-o", "f.png", "--channel", "Q"]).code, 1);
    assert_eq!(b.run(&["image", "tonemap", "half.exr", "-o", "half.exr"]).code, 2);
}

#[test]
fn help_version_completions() {
    let b = Bench::new();
    for args in [
        &["--help"][..],
        &["render", "--help"],
        &["image", "diff", "--help"],
        &["--version"],
        &["completions", "bash"],
    ] {
        let run = b.run(args);
        assert_eq!(run.code, 0, "{args:?}");
        assert!(run.out.contains("hemilux") && run.err.is_empty());
    }
    for verb in ["render", "zones"] {
        assert!(b.run(&[verb, "--help"]).out.contains("Examples:"));
    }
}

#[test]
fn defaults_can_be_read_back() {
    let b = Bench::new();
    let list = b.run(&["render", "--defaults"]);
    assert_eq!((list.code, list.err.as_str()), (0, ""));
    for line in ["--gather-rays 48", "--mode zonal", "# --spp N", "# --lenient"] {
        assert!(list.out.lines().any(|l| l.starts_with(line)), "{line} is not in {}", list.out);
    }
    b.write("words", &list.out.replace("--mode zonal", "--mode path"));
    let run = b.run(&["render", "room.pbrt", "@words", "--spp", "1", "-o", "a.exr"]);
    assert_eq!(run.code, 0, "{}", run.err);
    assert_eq!(b.image("a.exr").metadata_value("mode"), Some("path (unbiased)"));
}

#[test]
#[cfg(unix)]
fn a_closed_pipe_is_quiet() {
    let b = Bench::new();
    let line = format!("{} completions bash | true", env!("CARGO_BIN_EXE_hemilux"));
    let out = Command::new("sh").args(["-c", &line]).current_dir(&b.dir).output().unwrap();
    assert_eq!(text(&out.stderr), "");
}

#[test]
fn our_own_scenes_load_without_a_warning() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut names: Vec<String> = std::fs::read_dir(&scenes)
        .unwrap()
        .map(|e| e.unwrap().path().display().to_string())
        .filter(|n| n.ends_with(".pbrt"))
        .collect();
    names.sort();
    assert!(names.len() >= 4);
    let b = Bench::new();
    for name in names {
        let run = b.run(&["info", &name]);
        assert!(run.code == 0 && !run.err.contains("warning"), "{name}: {}", run.err);
    }
    // The furnace has a closed form: every pixel is 2.
    let furnace = scenes.join("furnace.pbrt").display().to_string();
    let args = ["render", &furnace, "--mode", "path", "--spp", "64", "--size", "16x12", "-o", "f.exr"];
    assert_eq!(b.run(&args).code, 0);
    let all: Vec<f32> = pixels(&b.image("f.exr")).into_iter().flatten().collect();
    let mean = all.iter().sum::<f32>() / all.len() as f32;
    assert!((mean - 2.0).abs() < 0.02, "{mean}");
}
