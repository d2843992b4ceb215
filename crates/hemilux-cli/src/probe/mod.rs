//! `hemilux probe`: the hemisphere at one point laid open. What arrives, where a strategy looks, what it makes of it, and what a
//! long run says ([`measure`]); as JSON ([`report`]), as a drawing ([`sheet`]) and as EXR of the field radiance.

mod args;
mod measure;
mod report;
mod sheet;
mod spot;

use crate::failure::Failure;
use crate::figures::write as write_text;
use crate::render::set_threads;
use crate::talk;
use crate::{hints, load, output, plan};
pub use args::ProbeArgs;
use hemilux::gather::Strategy;
use hemilux::strategies;
use hemilux::zones::Zones;
use hemilux_image::{Image, write};
use spot::Spot;
use std::path::Path;

/// Everything a probe found.
pub struct Findings<'a> {
    pub spot: &'a Spot<'a>,
    pub field: measure::Field,
    pub reference: measure::LongRun,
    pub zones: measure::LongRun,
    pub shown: measure::Run,
    pub compared: Vec<measure::Compared>,
}

/// Probe.
pub fn run(args: ProbeArgs) -> Result<(), Failure> {
    set_threads(args.threads)?;
    for path in &args.outputs {
        form(path)?;
        output::check_writable(path)?;
    }
    let strategies = compared(&args)?;
    let (mut scene, given) = hints::scene(&args.scene, &args.hints, &args.talk)?;
    if let Some(path) = &args.view {
        scene.camera = load::camera(path, &args.scene.defines, &args.talk)?;
    }
    let world = hints::world(scene, given.as_ref());
    let options = plan::solution(args.solution.zone_budget, args.solution.particles, args.seed, false)?;
    let zones = Zones::solve(&world, &options);
    let spot = Spot::find(&world, &zones, &args)?;
    let field = measure::field(&spot, args.resolution, args.seed);
    let reference = measure::reference(&spot, args.gathers, args.seed);
    let zones_part = measure::zones_part(&spot, args.seed);
    let shown = measure::run(&spot, args.strategy, args.rays, args.seed, true);
    let compared = strategies.iter().map(|s| measure::compare(&spot, *s, &args, &reference)).collect();
    let found = Findings { spot: &spot, field, reference, zones: zones_part, shown, compared };
    if args.outputs.is_empty() {
        return talk::data(&format!("{:#}\n", report::json(&found)));
    }
    for path in &args.outputs {
        match form(path)? {
            Form::Json => write_text(path, &format!("{:#}\n", report::json(&found)))?,
            Form::Svg => write_text(path, &sheet::draw(&found))?,
            Form::Exr => write(path, &picture(&found))?,
        }
        if !args.talk.quiet {
            talk::line(&format!("wrote {}", path.display()));
        }
    }
    if !args.talk.quiet {
        talk::data(&report::summary(&found))?;
        hints::lines(&world).iter().for_each(|l| talk::line(l));
    }
    Ok(())
}

enum Form {
    Json,
    Svg,
    Exr,
}

fn form(path: &Path) -> Result<Form, Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("json") => Ok(Form::Json),
        Some("svg") => Ok(Form::Svg),
        Some("exr") => Ok(Form::Exr),
        _ => Err(Failure::usage(format!("{}: probes are written as .json, .svg or .exr", path.display()))),
    }
}

/// The strategies that `--compare` names.
fn compared(args: &ProbeArgs) -> Result<Vec<Strategy>, Failure> {
    let Some(text) = &args.compare else { return Ok(Vec::new()) };
    if text == "all" {
        let plain = Strategy::ALL.iter().map(|n| n.1);
        let report = strategies::NAMES.iter().map(|n| Strategy::Report(n.1));
        return Ok(plain.chain(report).chain(strategies::parse("report1994:enlarged:20")).collect());
    }
    text.split(',').map(|name| crate::values::strategy(name.trim()).map_err(Failure::usage)).collect()
}

/// The field radiance over the unit square, row 0 at v = 1, and the zones' part of it.
fn picture(found: &Findings) -> Image {
    let n = found.field.side;
    let mut image = Image::new(n, n);
    for (prefix, part) in [("", &found.field.all), ("zones.", &found.field.zones)] {
        for (c, band) in ["R", "G", "B"].iter().enumerate() {
            image.set_channel(&format!("{prefix}{band}"), part.iter().map(|v| v.0[c]).collect());
        }
    }
    let s = &found.spot.surface;
    image.set_metadata("software", format!("hemilux {}", env!("CARGO_PKG_VERSION")));
    image.set_metadata(
        "quantity",
        "field radiance, W/sr/m2, over the unit square of Shirley and Chiu's hemisphere map",
    );
    image.set_metadata("position", format!("{} {} {}", s.p.x, s.p.y, s.p.z));
    let n = s.frame.n;
    image.set_metadata("normal", format!("{} {} {}", n.x, n.y, n.z));
    image
}
