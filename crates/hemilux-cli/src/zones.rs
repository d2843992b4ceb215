//! `hemilux zones`: the zonal solution of a scene, to a file.

use crate::args::ZonesArgs;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use crate::plan::{self, seconds};
use crate::progress::{Progress, percent};
use crate::prologue::solve;
use crate::render::set_threads;
use crate::{hints, machine, output, talk};
use hemilux::world::World;
use hemilux::zones::{Zones, mesh};
use hemilux_image::atomic;
use hemilux_scene::Rgb;
use serde_json::json;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Hlxz,
    Ply,
}

/// Solve and write.
pub fn run(args: ZonesArgs, begin: Instant) -> Result<(), Failure> {
    let interrupt = Interrupt::listen();
    let mut progress = Progress::new(args.progress, &args.talk, begin);
    set_threads(args.threads)?;
    let outputs = args.outputs.iter().map(|p| checked(p)).collect::<Result<Vec<_>, _>>()?;
    let options =
        plan::solution(args.solution.zone_budget, args.solution.particles, args.seed, args.time.is_some())?;

    progress.stage("load");
    let (scene, given) = hints::scene(&args.scene, &args.hints, &args.talk)?;
    progress.stage("prepare");
    let world = hints::world(scene, given.as_ref());
    progress.remark(format!("{} primitives", machine::count(world.primitives() as f64)));

    progress.stage("zones");
    interrupt.arm();
    let deadline = args.time.map(|t| begin + t);
    let zones = solve(&world, &options, deadline, None, &interrupt, &mut progress);
    if zones.particles == 0 {
        return Err(Interrupt::failure("before the first particles; nothing is written"));
    }
    progress.remark(format!("{} particles", machine::count(zones.particles as f64)));

    progress.stage("write");
    for (path, format) in &outputs {
        let body = |out: &mut io::BufWriter<std::fs::File>| match format {
            Format::Hlxz => zones.write(&world, options.budget, out),
            Format::Ply => mesh::write_ply(&world, &zones, out),
        };
        atomic::write(path, body).map_err(|e: io::Error| Failure::write(path, &e))?;
    }
    let names: Vec<String> = outputs.iter().map(|o| o.0.display().to_string()).collect();
    let time = begin.elapsed();
    progress.end(
        &[format!("wrote {} in {}", names.join(", "), seconds(time))],
        json!({"files": names, "time_s": time.as_secs_f64()}),
    );
    if !args.talk.quiet {
        talk::data(&report(&world, &zones))?;
        hints::lines(&world).iter().for_each(|l| talk::line(l));
    }
    if interrupt.asked() {
        return Err(Interrupt::failure("the solution of fewer particles is written"));
    }
    Ok(())
}

fn checked(path: &Path) -> Result<(PathBuf, Format), Failure> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let format = match extension.as_deref() {
        Some("hlxz") => Format::Hlxz,
        Some("ply") => Format::Ply,
        _ => {
            let message = format!("{}: zonal solutions are written as .hlxz or .ply", path.display());
            return Err(Failure::usage(message));
        }
    };
    output::check_writable(path)?;
    Ok((path.to_owned(), format))
}

fn report(world: &World, zones: &Zones) -> String {
    let (median, high) = zones.relative_errors();
    let areas = zones.map().areas();
    let area: f64 = areas.iter().map(|a| *a as f64).sum();
    let l = &zones.ledger;
    let watts = |v: [f64; 3]| {
        format!("{:>12.6} W   ({:.4} {:.4} {:.4})", Rgb(v.map(|x| x as f32)).luminance(), v[0], v[1], v[2])
    };
    format!(
        "zones            {}\n\
         target width     {:.4} m\n\
         area             {:.4} m2\n\
         particles        {}\n\
         rays             {}\n\
         standard error   {} median, {} at the 95th percentile (lit zones by area)\n\
         caustics         {}\n\
         emitted  {}\n\
         absorbed {}\n\
         escaped  {}\n\
         scene hash       {:016x}\n",
        zones.map().len(),
        zones.map().target(),
        area,
        zones.particles,
        l.rays,
        percent(median),
        percent(high),
        if zones.has_caustics() { "yes" } else { "no" },
        watts(l.emitted),
        watts(l.absorbed),
        watts(l.escaped),
        world.scene.content_hash,
    )
}
