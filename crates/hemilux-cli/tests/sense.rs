//! `hemilux sense` and `hemilux rtrace`, run as programs.

use std::io::Write;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;

/// A lamp of 10 cm radius over a black floor, its irradiance at the origin known: π L sin² of its half-angle, over the
/// cosine: straight up.
const LAMP: &str = "void light lamp 0 0 3 100 100 100\nlamp sphere bulb 0 0 4 0 0 2 .1\n";

fn run(arguments: &[&str], input: &str) -> Output {
    // Written once: tests run side by side.
    static DIRECTORY: OnceLock<PathBuf> = OnceLock::new();
    let directory = DIRECTORY.get_or_init(|| {
        let directory = std::env::temp_dir().join(format!("hemilux-sense-{}", std::process::id()));
        std::fs::create_dir_all(&directory).expect("a directory for the scene");
        std::fs::write(directory.join("lamp.rad"), LAMP).expect("the scene");
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
    let _ = child.stdin.take().expect("its input").write_all(input.as_bytes());
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
