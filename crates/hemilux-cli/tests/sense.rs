//! `hemilux sense`, `hemilux rtrace` and `hemilux check`, run as programs.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// A lamp of 10 cm radius over a black floor, its irradiance at the origin known: π L sin² of its half-angle, over the
/// cosine: straight up.
const LAMP: &str = "void light lamp 0 0 3 100 100 100\nlamp sphere bulb 0 0 4 0 0 2 .1\n";

/// The same lamp in the other convention's words.
const PBRT: &str = "WorldBegin Translate 0 0 2 AreaLightSource \"diffuse\" \"rgb L\" [100 100 100]\n\
                    Material \"diffuse\" \"rgb reflectance\" [0 0 0] Shape \"sphere\" \"float radius\" 0.1\n";

/// A lamp of 1 cm in a mirrored dome (all of it, closed below by a black disk): too much to ask of half a second.
const DOME: &str = "void light lamp 0 0 3 1e4 1e4 1e4\nlamp sphere bulb 0 0 4 0 0 2 .01\nvoid metal m 0 0 5 .9 .9 .9 1 0\n\
                    m bubble dome 0 0 4 0 0 0 3\nvoid plastic k 0 0 5 0 0 0 0 0\nk ring floor 0 0 8 0 0 -.01 0 0 1 0 2.9995\n";

/// The same with a dimmer lamp of 10 cm, which gather rays meet by chance now and then.
const BROAD: &str = "void light lamp 0 0 3 1e2 1e2 1e2\nlamp sphere bulb 0 0 4 0 0 2 .1\nvoid metal m 0 0 5 .9 .9 .9 1 0\n\
                     m bubble dome 0 0 4 0 0 0 3\nvoid plastic k 0 0 5 0 0 0 0 0\nk ring floor 0 0 8 0 0 -.01 0 0 1 0 2.9995\n";

fn run(arguments: &[&str], input: &str) -> Output {
    run_bytes(arguments, input.as_bytes())
}

fn run_bytes(arguments: &[&str], input: &[u8]) -> Output {
    // Written once: tests run side by side.
    static DIRECTORY: OnceLock<PathBuf> = OnceLock::new();
    let directory = DIRECTORY.get_or_init(|| {
        let directory = std::env::temp_dir().join(format!("hemilux-sense-{}", std::process::id()));
        std::fs::create_dir_all(&directory).expect("a directory for the scene");
        for (name, text) in
            [("lamp.rad", LAMP), ("lamp.pbrt", PBRT), ("dome.rad", DOME), ("broad.rad", BROAD)]
        {
            std::fs::write(directory.join(name), text).expect("the scene");
        }
        directory
    });
    let mut child = Command::new(env!("CARGO_BIN_EXE_hemilux"))
        .args(arguments)
        .current_dir(directory)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    // A program that has ended early does not read: that is for the assertions to say.
    let _ = child.stdin.take().expect("its input").write_all(input);
    child.wait_with_output().expect("the program ends")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Irradiance at the origin, W/m².
const TRUTH: f64 = std::f64::consts::PI * 100.0 * (0.1 / 2.0) * (0.1 / 2.0);

#[test]
fn one_value_a_line_with_comments_and_blank_lines_kept() {
    let out = run(&["sense", "lamp.rad", "--ci"], "# desk\n0 0 0 0 0 1\n\n0 0 0 0 0 -1\n");
    assert!(out.status.success(), "{}", text(&out.stderr));
    let lines: Vec<String> = text(&out.stdout).lines().map(str::to_owned).collect();
    assert_eq!(
        (lines.len(), lines[0].as_str(), lines[2].as_str(), lines[3].as_str()),
        (4, "# desk", "", "0 0")
    );
    let numbers: Vec<f64> = lines[1].split(' ').map(|w| w.parse().expect("a number")).collect();
    // Lux of a Radiance scene: 179 lm/W. The lamp is sampled by its cone: hardly any noise.
    assert!((numbers[0] / (179.0 * TRUTH) - 1.0).abs() < 1e-3, "{numbers:?}");
    assert!(numbers[1] < 0.01 * numbers[0]);
    assert!(text(&out.stderr).contains("179 lm/W"), "{}", text(&out.stderr));
}

#[test]
fn forms_and_quantities() {
    let out =
        run(&["sense", "lamp.rad", "-q", "--quantity", "irradiance", "--format", "csv"], "0 0 0 0 0 1\n");
    let csv = text(&out.stdout);
    let mut lines = csv.lines();
    assert!(lines.next().is_some_and(|h| h.starts_with("x,y,z,nx,ny,nz,irradiance [W/m2]")), "{csv}");
    let value: f64 =
        lines.next().and_then(|l| l.split(',').nth(6)).and_then(|v| v.parse().ok()).expect("a value");
    assert!((value / TRUTH - 1.0).abs() < 1e-3);
    let out =
        run(&["sense", "lamp.rad", "-q", "--format", "json", "--quantity", "luminance"], "0 0 0 0 0 1\n");
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).expect("JSON");
    assert_eq!(
        (json[0]["unit"].as_str(), json[0]["value"].as_f64().map(|v| v.round())),
        (Some("cd/m2"), Some(17900.0))
    );
    let out = run(&["sense", "lamp.rad", "-q", "--grid", "-1,-1,0,2,0,0,0,2,0,3,2"], "");
    assert_eq!(text(&out.stdout).lines().count(), 6);
    let out = run(&["rtrace", "-I", "-h", "-ab", "3", "lamp.rad"], "0 0 0 0 0 1\n");
    let first: f64 = text(&out.stdout).split('\t').next().and_then(|v| v.parse().ok()).expect("a value");
    assert!((first / TRUTH - 1.0).abs() < 1e-3);
}

#[test]
fn what_goes_wrong_is_said_and_numbered() {
    let out = run(&["sense", "lamp.rad"], "0 0 0 0 0 1\n0 0 0 0 zero 1\n");
    assert_eq!(out.status.code(), Some(1));
    assert!(
        text(&out.stderr).contains("line 2 of the sensors: \"zero\" is not a number"),
        "{}",
        text(&out.stderr)
    );
    // The answer before it has come all the same.
    assert_eq!(text(&out.stdout).lines().count(), 1);
    let out = run(&["sense", "lamp.rad", "--target-error", "200%"], "");
    assert_eq!(out.status.code(), Some(2));
    let out = run(&["sense", "nowhere.rad"], "");
    assert_eq!(out.status.code(), Some(1));
    let out = run(&["rtrace", "-I", "-fff", "lamp.rad"], "");
    assert_eq!(out.status.code(), Some(2));
}

/// 179 lm/W with Radiance's weights for .rad, 683 lm/W with CIE Y for the rest: a grey lamp's lux differ by just that, and the output
/// says which.
#[test]
fn efficacy_is_that_of_the_kind_of_scene() {
    for (scene, efficacy) in [("lamp.rad", 179.0), ("lamp.pbrt", 683.0)] {
        let out = run(&["sense", scene], "0 0 0 0 0 1\n");
        let lux: f64 = text(&out.stdout).trim().parse().expect("a number");
        assert!((lux / (efficacy * TRUTH) - 1.0).abs() < 1e-3, "{scene}: {lux}");
        let said = text(&out.stderr);
        let (right, wrong) = (format!("{efficacy} lm/W"), format!("{} lm/W", 862.0 - efficacy));
        assert!(said.contains(&right) && !said.contains(&wrong), "{said}");
    }
}

/// A missed target is exit code 4, its value and interval are there all the same, and hold the truth.
#[test]
fn a_missed_target_is_exit_code_four() {
    let arguments = [
        "sense",
        "dome.rad",
        "--quantity",
        "irradiance",
        "--format",
        "csv",
        "--limit",
        "500ms",
        "--target-error",
        "0.001%",
    ];
    let out = run(&arguments, "# kept in plain form only\n1 0 0 0 0 1\n");
    assert_eq!(out.status.code(), Some(4));
    assert!(text(&out.stderr).contains("1 of 1 sensors did not reach the target"), "{}", text(&out.stderr));
    let csv = text(&out.stdout);
    let row: Vec<&str> = csv.lines().nth(1).expect("a row").split(',').collect();
    let (value, half): (f64, f64) = (row[6].parse().expect("a value"), row[7].parse().expect("a half-width"));
    assert!((value - 1.340).abs() < half + 0.01 && row[10] == "false", "{csv}");
    assert_eq!(run(&["sense", "lamp.rad", "--spp", "64"], "0 0 0 0 0 1\n").status.code(), Some(0));
}

/// A lamp's image in a dome that hardly any particle has met is a surprise: in JSON, in the report, in the last column, and a
/// warning. With the usual particles it is none, and nothing is said.
#[test]
fn surprise_is_told_for_each_sensor() {
    let report = std::env::temp_dir().join(format!("hemilux-sense-{}.json", std::process::id()));
    let read = |more: &[&str]| {
        let path = report.to_str().expect("a path");
        let run = run(
            &[&["sense", "broad.rad", "--spp", "4096", "--report", path], more].concat(),
            "1 0 0 0 0 1\n",
        );
        assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
        let report = std::fs::read(&report).expect("the report");
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        (text(&run.stdout), text(&run.stderr), report)
    };
    let (json, said, written) = read(&["--particles", "1", "--format", "json"]);
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let blind = json[0]["surprise"].as_f64().expect("a number");
    assert!(blind > 0.03, "{json}");
    assert_eq!((&written["readings"], written["sensors"]["surprised"].as_u64()), (&json, Some(1)));
    assert_eq!(written["surprise"].as_f64(), Some(blind));
    let warning = format!("warning: sensor 1 of 1: {:.1} % of its luminance", 100.0 * blind);
    assert!(said.contains(&warning), "{said}");
    let (plain, said, written) = read(&["--ci"]);
    let led = written["readings"][0]["surprise"].as_f64().expect("a number");
    println!("surprise {blind} by one particle, {led} by half a million");
    assert!(led < 0.01 && plain.trim().split(' ').count() == 2, "{led} {plain}");
    assert!(!said.contains("nothing had led there"), "{said}");
    let (csv, ..) = read(&["--format", "csv"]);
    let last: Vec<&str> = csv.lines().filter_map(|l| l.rsplit(',').next()).collect();
    assert_eq!(last, ["surprise", &format!("{led:.5}")]);
    std::fs::remove_file(&report).expect("it is ours");
}

/// Bytes that are no text are named by their line; groups over zones of their own are said to be just that.
#[test]
fn lines_that_are_no_text_and_zones_are_named() {
    let out = run_bytes(&["sense", "lamp.rad"], b"0 0 0 0 0 1\n\xff\xfe\n");
    assert_eq!(out.status.code(), Some(1));
    assert!(text(&out.stderr).contains("line 2 of the sensors"), "{}", text(&out.stderr));
    let out = run(&["sense", "lamp.rad", "--ci", "--mode", "zonal", "--particles", "1000"], "0 0 0 0 0 1\n");
    // Value, noise, and the zones' bias with its own noise: never one number.
    assert_eq!(text(&out.stdout).trim().split(' ').count(), 4, "{}", text(&out.stdout));
    assert!(text(&out.stderr).contains("each with zones of its own"), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("is not in them"), "{}", text(&out.stderr));
}

/// Findings are counted on standard output and said on standard error; `--strict` makes exit code 5 of them.
#[test]
fn check_counts_and_is_strict_when_asked() {
    let out = run(&["check", "dome.rad"], "");
    // The dome is open below: between its floor and its rim light leaves.
    assert!(out.status.success(), "{}", text(&out.stderr));
    let counted: u32 = text(&out.stdout).split(' ').next().and_then(|n| n.parse().ok()).expect("a count");
    let strict = run(&["check", "--strict", "dome.rad"], "");
    assert_eq!(strict.status.code(), Some(if counted == 0 { 0 } else { 5 }), "{}", text(&out.stderr));
    // A lamp alone: all that it emits leaves, and it lights nothing.
    let out = run(&["check", "--strict", "--message-format", "short", "lamp.rad"], "");
    assert_eq!((out.status.code(), text(&out.stdout).as_str()), (Some(5), "2 findings\n"));
    let said = text(&out.stderr);
    assert!(said.contains("lamp.rad:2:6: warning: a luminaire lights nothing"), "{said}");
    assert!(said.contains("100 % of what the luminaires emit leaves the scene"), "{said}");
    assert_eq!(run(&["check", "nowhere.rad"], "").status.code(), Some(1));
}

/// `rtrace` is steered as `sense` is: a small lamp's light by way of the dome is there, and it says what leads it.
#[test]
fn rtrace_is_steered_like_sense() {
    let out = run(&["rtrace", "-I", "-h", "-ab", "2", "dome.rad"], "1 0 0 0 0 1\n");
    let value: f64 = text(&out.stdout).split('\t').next().and_then(|v| v.parse().ok()).expect("a value");
    assert!(out.status.success() && (value / 1.340 - 1.0).abs() < 0.02, "{value} {}", text(&out.stderr));
    assert!(text(&out.stderr).contains("gather rays are led by what 524288 light particles found"));
    // Where nothing casts images, nothing leads and nothing is said.
    let out = run(&["rtrace", "-I", "-h", "lamp.rad"], "0 0 0 0 0 1\n");
    assert!(!text(&out.stderr).contains("led by"), "{}", text(&out.stderr));
}
