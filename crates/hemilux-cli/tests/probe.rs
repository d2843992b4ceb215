//! `hemilux probe`, `hemilux figures` and the report's strategies, by the built binary.

mod common;

use common::Bench;
use serde_json::Value;

const SMALL: [&str; 8] =
    ["--zone-budget", "500", "--particles", "20k", "--gathers", "256", "--resolution", "32"];

fn probe<'a>(rest: &[&'a str]) -> Vec<&'a str> {
    ["probe", "room.pbrt"].into_iter().chain(rest.iter().copied()).chain(SMALL).collect()
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn a_receiver_is_laid_open() {
    let b = Bench::new();
    let run = b.run(&probe(&["--point", "0.5 0 0 0 0 1", "-o", "p.svg", "-o", "p.json", "-o", "p.exr"]));
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.out.contains("irradiance") && run.out.contains("by the zones"), "{}", run.out);
    let found = json(&std::fs::read_to_string(b.path("p.json")).unwrap());
    assert_eq!((&found["version"], &found["unit"]), (&Value::from(1), &Value::from("W/m2")));
    // The lamp alone, by its power: L A cos / (d² π) · π, and what the room adds.
    let direct = 20.0 * std::f64::consts::PI * 0.15 * 0.15 * 1.6 / (0.25 + 1.6f64 * 1.6).powf(1.5);
    let (all, zones) = (&found["reference"], found["zones_part"]["value"].as_f64().unwrap());
    let rest = all["value"].as_f64().unwrap() - zones;
    let error = 5.0 * all["standard_error"].as_f64().unwrap() + 0.02 * direct;
    assert!((rest - direct).abs() < error, "{rest} of {all}, {direct}");
    // One lamp, and it is up there: (0, 0, 1.6) from (0.5, 0, 0).
    let lamps = found["luminaires"].as_array().unwrap();
    let d: Vec<f64> = lamps[0]["direction"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    let length = (0.25 + 1.6f64 * 1.6).sqrt();
    assert!(
        lamps.len() == 1 && (d[0] + 0.5 / length).abs() < 1e-4 && (d[2] - 1.6 / length).abs() < 1e-4,
        "{d:?}"
    );
    let run = &found["run"];
    assert!(run["samples"].as_array().unwrap().len() >= 200 && run["cells"].as_array().unwrap().len() > 20);
    assert_eq!((&run["strategy"], &run["biased"]), (&Value::from("two-stage"), &Value::from(false)));
    let svg = std::fs::read_to_string(b.path("p.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n") && svg.contains("data:image/png;base64,"));
    let exr = b.image("p.exr");
    assert_eq!((exr.width, exr.channel("zones.G").map(<[f32]>::len)), (32, Some(32 * 32)));
    // The lamp is in the one and not in the other.
    let top = |name: &str| exr.channel(name).unwrap().iter().copied().fold(0f32, f32::max);
    assert!(top("G") > 5.0 && top("zones.G") < 3.0, "{} {}", top("G"), top("zones.G"));
}

#[test]
fn a_pixel_is_compared() {
    let b = Bench::new();
    let run = b.run(&probe(&[
        "--pixel",
        "20,25",
        "--compare",
        "sobol,luminaires,report1994:enlarged:4",
        "--runs",
        "4",
    ]));
    assert_eq!(run.code, 0, "{}", run.err);
    let found = json(&run.out);
    let compared = found["compared"].as_array().unwrap();
    let names: Vec<&str> = compared.iter().map(|c| c["run"]["strategy"].as_str().unwrap()).collect();
    assert_eq!(names, ["sobol", "luminaires", "report1994:enlarged:4"]);
    let biased: Vec<bool> = compared.iter().map(|c| c["run"]["biased"].as_bool().unwrap()).collect();
    assert_eq!(biased, [false, false, true]);
    for c in compared {
        let levels = c["levels"].as_array().unwrap();
        let rmse = |i: usize| levels[i]["relative_rmse"].as_f64().unwrap();
        // 64 times the rays: at the very least not worse by half.
        assert!(levels.len() == 4 && rmse(3) < 1.5 * rmse(0) && rmse(3) < 0.5, "{c}");
    }
    // The same command, the same bits, but for times.
    let again = json(&b.run(&probe(&["--pixel", "20,25", "--threads", "1"])).out);
    assert_eq!(again["reference"], found["reference"]);
    assert_eq!(again["run"]["samples"], found["run"]["samples"]);
}

#[test]
fn probes_that_cannot_be_say_why() {
    let b = Bench::new();
    for (args, code, what) in [
        (vec!["--pixel", "40,0"], 2, "--pixel 40,0 lies outside of the picture of 40x30 pixels"),
        (vec!["--pixel", "0,0"], 1, "pixel 0,0 sees no surface"),
        (vec!["--pixel", "x"], 2, "is no pixel such as 320,240"),
        (vec!["--point", "1 2 3"], 2, "is not six numbers"),
        (vec!["--point", "0 0 0 0 0 0"], 2, "the normal has no length"),
        (vec![], 2, "--pixel"),
        (vec!["--pixel", "20,25", "-o", "a.png"], 2, "probes are written as .json, .svg or .exr"),
        (vec!["--pixel", "20,25", "--compare", "sobol,nothing"], 2, "\"nothing\" is none of"),
        (vec!["--pixel", "20,25", "--strategy", "report1994:enlarged:0"], 2, "report1994:enlarged:K"),
    ] {
        let run = b.run(&probe(&args));
        assert_eq!(run.code, code, "{args:?}: {}", run.err);
        assert!(run.err.contains(what), "{args:?}: {}", run.err);
    }
}

#[test]
fn biased_strategies_say_so_in_log_and_picture() {
    let b = Bench::new();
    let render = |strategy: &str, file: &str| {
        b.run(&["render", "room.pbrt", "--strategy", strategy, "--spp", "1", "--size", "12x9", "-o", file])
    };
    let run = render("report1994:subdivision:contrast", "a.exr");
    assert_eq!(run.code, 0, "{}", run.err);
    assert!(run.err.contains("report1994:subdivision:contrast is biased"), "{}", run.err);
    let said = |file: &str| b.image(file).metadata_value("strategy").unwrap_or_default().to_string();
    assert_eq!(said("a.exr"), "report1994:subdivision:contrast (biased)");
    let run = render("regions", "b.exr");
    assert!(run.code == 0 && !run.err.contains("biased"), "{}", run.err);
    assert_eq!(said("b.exr"), "regions");
    let help = b.run(&["render", "--help"]).out;
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words.contains("Biased: luminaires:ward, and the report's one-stage methods, report1994:voronoi")
    );
}

#[test]
fn figures_are_drawn() {
    let b = Bench::new();
    let run = b.run(&["figures", "-o", "figures", "--no-render", "--quiet"]);
    assert_eq!(run.code, 0, "{}", run.err);
    for name in [
        "figure-2.svg",
        "figure-3.svg",
        "figure-4.svg",
        "figure-5.svg",
        "section-4-missed.svg",
        "section-4-enlarged.svg",
        "section-4-detected.svg",
        "thirty-years.svg",
    ] {
        let text = std::fs::read_to_string(b.path("figures").join(name)).unwrap();
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n") && text.len() > 2000, "{name}");
        assert!(!text.contains("NaN") && !text.contains("inf"), "{name}");
    }
    let run = b.run(&["figures", "-o", "room.pbrt/x", "--no-render"]);
    assert_eq!(run.code, 3, "{}", run.err);
}
