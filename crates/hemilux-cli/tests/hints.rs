//! `--hints FILE`, by the built binary.

mod common;

use common::{Bench, pixels};
use serde_json::Value;

/// The room with a mirror ball that has a name.
const BALL: &str = r#"MakeNamedMaterial "chrome" "string type" "conductor" "rgb reflectance" [ 0.9 0.9 0.9 ] "float roughness" 0
NamedMaterial "chrome"
AttributeBegin
  Translate -0.4 0.2 0.3
  Shape "sphere" "float radius" 0.1
AttributeEnd
"#;

fn bench() -> Bench {
    let b = Bench::new();
    b.write("ball.pbrt", &format!("{}{BALL}", common::ROOM));
    b
}

const ALL: &str = r#"{
  "hemilux-hints": 1,
  "comment": "everything at once",
  "casters": [ { "object": "chrome" } ],
  "luminaires": [ { "object": "ball.pbrt:18" } ],
  "regions": [ { "centre": [-0.4, 0.2, 0.3], "radius": 0.1 } ],
  "cones": [ { "axis": [0, 0, 1], "half-angle": 10 } ],
  "image": [ { "window": [0, 0.5, 0, 1], "samples": 2 } ],
  "criterion": "deviation"
}
"#;

fn render<'a>(rest: &[&'a str]) -> Vec<&'a str> {
    ["render", "ball.pbrt", "--spp", "2"].into_iter().chain(rest.iter().copied()).collect()
}

#[test]
fn the_report_says_what_each_hint_changed() {
    let b = bench();
    b.write("h.json", ALL);
    let run = b.run(&render(&["--hints", "h.json", "-o", "a.exr", "--report", "r.json"]));
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(
        run.err.contains("hint caster \"chrome\": ") && run.err.contains("of them met it"),
        "{}",
        run.err
    );
    let report: Value = serde_json::from_str(&std::fs::read_to_string(b.path("r.json")).unwrap()).unwrap();
    let hints = report["hints"].as_array().unwrap();
    let kinds: Vec<&str> = hints.iter().map(|h| h["hint"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["caster", "luminaire", "region", "cone", "image", "criterion"]);
    let number = |i: usize, path: &str| {
        let at = path.split('.').fold(&hints[i], |v, key| &v[key]);
        at.as_f64().unwrap_or_else(|| panic!("{path} in {}", hints[i]))
    };
    // A fifth of the particles each; the ball is met by many of those that are sent and by few others.
    for i in [0, 1] {
        let part =
            number(i, "particles.sent") / (number(i, "particles.sent") + number(i, "particles.others"));
        assert!((part - 0.2).abs() < 0.02, "{part}");
    }
    let met = number(0, "met.sent") / number(0, "particles.sent");
    let others = number(0, "met.others") / number(0, "particles.others");
    assert!(met > 10.0 * others && met > 0.2, "{met} and {others}");
    assert_eq!(number(1, "shadow_ray_share"), 0.25);
    assert!(number(2, "gather_rays") > 0.0 && number(3, "luminance_brought") > 0.0);
    // The file is named in the picture.
    assert!(b.image("a.exr").metadata_value("hints").unwrap().starts_with("h.json ("));
    // Threads do not show.
    let run = b.run(&render(&["--hints", "h.json", "-o", "b.exr", "--threads", "1"]));
    assert_eq!(run.code, 0, "{}", run.err);
    assert_eq!(pixels(&b.image("a.exr")), pixels(&b.image("b.exr")));
}

#[test]
fn sense_probe_and_zones_take_hints() {
    let b = bench();
    b.write("h.json", ALL);
    let small = ["--zone-budget", "500", "--particles", "20k"];
    let sense =
        ["sense", "ball.pbrt", "--hints", "h.json", "--grid", "0,0,0,0.2,0,0,0,0.2,0,1,1", "--spp", "64"];
    let run = b.run(&sense);
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.err.contains("# hint cone:"), "{}", run.err);
    // The same lux within what 64 gathers tell.
    let plain = b.run(&[&sense[..2], &sense[4..]].concat());
    let value = |r: &common::Run| r.out.trim().parse::<f64>().unwrap();
    assert!((value(&run) / value(&plain) - 1.0).abs() < 0.05, "{} {}", run.out, plain.out);
    let probe = [
        "probe",
        "ball.pbrt",
        "--hints",
        "h.json",
        "--point",
        "0.5 0 0 0 0 1",
        "--strategy",
        "adaptive",
        "--gathers",
        "64",
        "--resolution",
        "16",
        "-o",
        "p.json",
        "-o",
        "p.svg",
    ];
    let run = b.run(&[&probe[..], &small].concat());
    assert_eq!(run.code, 0, "{}", run.err);
    let found: Value = serde_json::from_str(&std::fs::read_to_string(b.path("p.json")).unwrap()).unwrap();
    // The caster's ball, the region and the cone, and rays in them.
    assert_eq!(found["hints"].as_array().unwrap().len(), 3);
    let drawn = found["run"]["drawn"].as_array().unwrap();
    let of = |name: &str| drawn.iter().filter(|d| d["stratum"] == name).count();
    assert!(
        of("hint") >= 3 && of("luminaires") > 10 && of("lobe") + of("prediction") > 100,
        "{}",
        drawn.len()
    );
    let run = b.run(&[&["zones", "ball.pbrt", "--hints", "h.json", "-o", "z.hlxz"][..], &small].concat());
    assert!(run.code == 0 && run.err.contains("of them met it"), "{}", run.err);
}

#[test]
fn films_remember_their_hints() {
    let b = bench();
    b.write("h.json", ALL);
    let args = ["--hints", "h.json", "-o", "a.exr", "--resume"];
    let first = b.run(&render(&["--hints", "h.json", "-o", "a.exr", "--checkpoint", "f.hlxf"]));
    assert_eq!(first.code, 0, "{}", first.err);
    let whole = pixels(&b.image("a.exr"));
    assert_eq!(b.run(&render(&[&args[..], &["f.hlxf"]].concat())).code, 0);
    assert_eq!(pixels(&b.image("a.exr")), whole);
    let run = b.run(&render(&["-o", "a.exr", "--resume", "f.hlxf"]));
    assert_eq!(run.code, 1);
    assert!(run.err.contains("made with another file of hints"), "{}", run.err);
}

#[test]
fn mistakes_name_their_place_and_a_remedy() {
    let b = bench();
    for (text, what) in [
        ("{ \"hemilux-hints\": 3 }", "h.json:1:20: error: hints of version 3, this program reads version 1"),
        (
            "{ \"hemilux-hints\": 1,\n  \"caster\": [] }",
            "h.json:2:3: error: unknown key \"caster\"\n   |\n 2 |   \"caster\": [] }\n   |   ^^^^^^^^\n  help: did you mean \"casters\"?",
        ),
        (
            "{ \"hemilux-hints\": 1,\n  \"casters\": [ { \"object\": \"crome\" } ] }",
            "h.json:2:28: error: the scene has no object, shape or material \"crome\"",
        ),
        (
            "{ \"hemilux-hints\": 1,\n  \"casters\": [ { \"object\": \"crome\" } ] }",
            "did you mean \"chrome\"?",
        ),
        ("{ \"hemilux-hints\": 1", "h.json:1:21: error: expected ',' or '}', found the end of the file"),
    ] {
        b.write("h.json", text);
        for verb in ["render", "sense", "zones"] {
            let run = match verb {
                "zones" => b.run(&["zones", "ball.pbrt", "--hints", "h.json", "-o", "z.hlxz"]),
                verb => b.run(&[verb, "ball.pbrt", "--hints", "h.json"]),
            };
            assert_eq!(run.code, 1, "{verb}: {}", run.err);
            assert!(run.err.contains(what), "{verb} {text}: {}", run.err);
        }
    }
    let run = b.run(&["render", "ball.pbrt", "--hints", "nowhere.json"]);
    assert!(run.code == 1 && run.err.contains("nowhere.json: error: "), "{}", run.err);
}
