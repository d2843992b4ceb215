//! `hemilux sense`: illuminance and its kin at points, each with an interval; answers come as points do.
//!
//! Input is one sensor a line, `x y z nx ny nz`; comments (`#`) and blank lines are kept, so that line n of the output
//! answers line n of the input.

use crate::args::{FormName, QuantityName, SenseArgs, SenseMode};
use crate::failure::{Failure, Kind};
use crate::render::{command_line, set_threads};
use crate::talk;
use crate::{hints, output, report};
use hemilux::prologue::SURPRISED;
use hemilux::sense::{GROUPS, Goal, Reading, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::Photometry;
use hemilux_scene::geom::Vec3;
use hemilux_scene::hints::Hints;
use serde_json::{Value, json};
use std::io::{self, BufRead, Write};
use std::time::{Duration, Instant};

/// What a line of input is.
enum Line {
    /// Blank or a comment: passed on.
    Kept,
    Sensor(Vec3, Vec3),
}

/// Zones and light particles of a solution that steers paths or carries residuals, where nobody says otherwise: residuals
/// make up for what larger zones get wrong, and gathers led by more particles were no less noisy.
const LEADING: (u64, u64) = (1000, 1 << 19);

/// Read sensors, write values.
pub fn run(args: SenseArgs, begin: Instant) -> Result<(), Failure> {
    set_threads(args.threads)?;
    args.report.as_deref().map(output::check_writable).transpose()?;
    let (scene, given) = hints::scene(&args.scene, &args.hints, &args.talk)?;
    let photometry = scene.photometry;
    let world = hints::world(scene, given.as_ref());
    let zones = match args.mode {
        SenseMode::Path => Vec::new(),
        SenseMode::Corrected => {
            let budget = args.solution.zone_budget.unwrap_or(LEADING.0);
            let particles = args.solution.particles.unwrap_or(LEADING.1);
            solutions(&world, &args, Some(budget), Some(particles), 1)?
        }
        SenseMode::Zonal => {
            solutions(&world, &args, args.solution.zone_budget, args.solution.particles, GROUPS as u64)?
        }
    };
    let steering = match args.mode {
        SenseMode::Path => {
            let options = crate::plan::solution(
                args.solution.zone_budget.or(Some(LEADING.0)),
                args.solution.particles.or(Some(LEADING.1)),
                args.seed,
                false,
            )?;
            solve_leading(&world, &options)
        }
        _ => None,
    };
    let sense = match args.mode {
        SenseMode::Corrected => Sense::corrected(&world, &zones, options(&args, &photometry)),
        _ => Sense::new(&world, &zones, options(&args, &photometry)),
    };
    let sense = match &steering {
        Some(zones) => sense.steered(zones),
        None => sense,
    };
    let mut writer = Writer::new(&args, photometry);
    if !args.talk.quiet {
        talk::line(&preamble(&args, &photometry, &zones, begin.elapsed()));
    }
    writer.begin()?;
    let mut log = Log::default();
    let mut answer = |number: u64, text: &str, writer: &mut Writer| -> Result<(), Failure> {
        match parse(text).map_err(|what| Failure::input(format!("line {number} of the sensors: {what}")))? {
            Line::Kept => writer.kept(text),
            Line::Sensor(p, n) => {
                let reading = sense.read(log.count, p, n);
                log.note(&reading);
                if args.report.is_some() {
                    log.readings.push(record(&args, &photometry, p, n, &reading));
                }
                writer.reading(p, n, &reading)
            }
        }
    };
    match &args.grid {
        Some(grid) => {
            for (number, line) in grid.lines().enumerate() {
                answer(number as u64 + 1, &line, &mut writer)?;
            }
        }
        None => {
            for (number, line) in io::stdin().lock().lines().enumerate() {
                let line =
                    line.map_err(|e| Failure::input(format!("line {} of the sensors: {e}", number + 1)))?;
                answer(number as u64 + 1, &line, &mut writer)?;
            }
        }
    }
    writer.end()?;
    if !args.talk.quiet {
        hints::lines(&world).iter().for_each(|l| talk::line(&format!("# {l}")));
    }
    if let Some(text) = log.warning() {
        args.talk.warning(&text);
    }
    let Log { count, missed, .. } = log;
    if let Some(path) = &args.report {
        report::write(path, &whole(&args, &world, given.as_ref(), log, begin.elapsed()))?;
    }
    if missed > 0 {
        let message = format!(
            "{missed} of {count} sensors did not reach the target; their values are printed all the same"
        );
        return Err(Failure::new(Kind::Short, message));
    }
    Ok(())
}

/// What the end of a run says of all its readings.
#[derive(Default)]
struct Log {
    count: u64,
    missed: u64,
    /// How many were surprised; the one that was most, counted from 1, and how much.
    surprised: u64,
    worst: (u64, f64),
    /// For `--report`.
    readings: Vec<Value>,
}

impl Log {
    fn note(&mut self, reading: &Reading) {
        self.count += 1;
        self.missed += !reading.met as u64;
        let surprise = reading.surprise.unwrap_or(0.0);
        self.surprised += (surprise > SURPRISED) as u64;
        if surprise > self.worst.1 {
            self.worst = (self.count, surprise);
        }
    }

    /// What to say of sensors whose gathers were surprised.
    fn warning(&self) -> Option<String> {
        let (number, most) = (self.worst.0, 100.0 * self.worst.1);
        let of = match self.surprised {
            0 => return None,
            1 => format!("sensor {number} of {}: {most:.1} % of its luminance", self.count),
            n => format!(
                "{n} of {} sensors: more than {:.0} % of their luminance (sensor {number}: {most:.1} %)",
                self.count,
                100.0 * SURPRISED
            ),
        };
        Some(format!(
            "{of} came by rays that nothing had led there: noise is larger than need be, and --particles or --hints help"
        ))
    }
}

/// What is known of one reading.
fn record(args: &SenseArgs, photometry: &Photometry, p: Vec3, n: Vec3, r: &Reading) -> Value {
    json!({
        "position": p.to_array(), "normal": n.to_array(),
        "quantity": args.quantity.name(), "unit": args.quantity.unit(),
        "photometry": photometry.name,
        "value": r.scalar, "half_width_95": r.half_width, "rgb": r.value.0,
        "unseen": r.unseen, "surprise": r.surprise, "gathers": r.gathers, "rays": r.rays, "met": r.met,
        "zonal_bias": r.bias.map(|b| json!({"value": b.scalar, "half_width_95": b.half_width})),
    })
}

/// What `--report` writes.
fn whole(args: &SenseArgs, world: &World, given: Option<&Hints>, log: Log, time: Duration) -> Value {
    json!({
        "software": format!("hemilux {}", env!("CARGO_PKG_VERSION")),
        "command": command_line(),
        "scene": args.scene.scenes.iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        "scene_hash": format!("{:016x}", world.scene.content_hash),
        "mode": args.mode.name(), "unbiased": args.mode != SenseMode::Zonal,
        "seed": args.seed,
        "sensors": {"count": log.count, "missed": log.missed, "surprised": log.surprised},
        "surprise": (log.worst.0 > 0).then_some(log.worst.1),
        "hints": given.map(|g| hints::report(world, g)),
        "seconds": time.as_secs_f64(),
        "readings": log.readings,
    })
}

/// What light particles find steers paths, where there is anything to find.
pub fn steering(world: &World, seed: u64) -> Option<Zones> {
    solve_leading(world, &ZoneOptions { budget: LEADING.0 as u32, particles: LEADING.1, seed })
}

fn solve_leading(world: &World, options: &ZoneOptions) -> Option<Zones> {
    world.has_casters().then(|| Zones::solve_seen(world, options, None, |_| false))
}

fn solutions(
    world: &World,
    args: &SenseArgs,
    budget: Option<u64>,
    particles: Option<u64>,
    count: u64,
) -> Result<Vec<Zones>, Failure> {
    let options = crate::plan::solution(budget, particles, args.seed, false)?;
    // The particles are shared out: as many in all as one solution would have.
    let each = (options.particles / count).max(1);
    Ok((0..count)
        .map(|g| {
            let seed = options.seed.wrapping_mul(count).wrapping_add(g);
            Zones::solve_seen(world, &ZoneOptions { particles: each, seed, ..options }, None, |_| false)
        })
        .collect())
}

fn options(args: &SenseArgs, photometry: &Photometry) -> SenseOptions {
    let goal = match (args.time, args.spp, args.target_error) {
        (Some(t), _, _) => Goal::Time(t),
        (None, Some(n), _) => Goal::Gathers(n),
        (None, None, target) => Goal::RelativeError(target.0),
    };
    let efficacy = if args.quantity.is_photometric() { photometry.efficacy } else { 1.0 };
    SenseOptions {
        receiver: args.quantity.receiver(),
        goal,
        limit: args.limit,
        seed: args.seed,
        weights: photometry.weights.map(|w| w * efficacy),
    }
}

impl QuantityName {
    fn is_photometric(self) -> bool {
        matches!(self, QuantityName::Lux | QuantityName::Luminance)
    }

    fn receiver(self) -> Receiver {
        match self {
            QuantityName::Lux | QuantityName::Irradiance => Receiver::Irradiance,
            QuantityName::Radiance | QuantityName::Luminance => Receiver::Radiance,
        }
    }

    fn unit(self) -> &'static str {
        match self {
            QuantityName::Lux => "lx",
            QuantityName::Irradiance => "W/m2",
            QuantityName::Radiance => "W/sr/m2",
            QuantityName::Luminance => "cd/m2",
        }
    }
}

/// What the numbers mean, said once.
fn preamble(args: &SenseArgs, photometry: &Photometry, zones: &[Zones], prepared: Duration) -> String {
    let convention = format!("photometry: {}", photometry.name);
    let interval = match zones {
        _ if args.mode == SenseMode::Corrected => {
            "intervals: 95 %, Student over 16 independent groups; gather rays end on zones with residuals (unbiased)".to_string()
        }
        [] => {
            "intervals: 95 %, Student over 16 independent groups; gather rays continued as paths (unbiased)"
                .to_string()
        }
        zones => {
            let error = zones.iter().map(|z| z.relative_errors().0).sum::<f32>() / zones.len() as f32;
            format!(
                "intervals: 95 %, Student over 16 independent groups, each with zones of its own (median zone error {:.0} %); \
                 the bias that zones bring is not in them: --ci adds it, zonal less true, with a half-width of its own",
                100.0 * error
            )
        }
    };
    format!(
        "# {} in {}; {convention}; {interval}; ready after {prepared:.2?}",
        args.quantity.name(),
        args.quantity.unit()
    )
}

fn parse(text: &str) -> Result<Line, String> {
    let text = text.trim();
    if text.is_empty() || text.starts_with('#') {
        return Ok(Line::Kept);
    }
    let words: Vec<&str> = text.split([' ', '\t', ',', ';']).filter(|w| !w.is_empty()).collect();
    if words.len() != 6 {
        return Err(format!("expected 6 numbers (x y z nx ny nz), found {}", words.len()));
    }
    let mut v = [0f32; 6];
    for (v, word) in v.iter_mut().zip(&words) {
        *v = word.parse().map_err(|_| format!("{word:?} is not a number"))?;
        if !v.is_finite() {
            return Err(format!("{word:?} is not finite"));
        }
    }
    let normal = glam_normal(v[3], v[4], v[5]).ok_or("the normal has no length")?;
    Ok(Line::Sensor(Vec3::new(v[0], v[1], v[2]), normal))
}

fn glam_normal(x: f32, y: f32, z: f32) -> Option<Vec3> {
    hemilux_scene::geom::DVec3::new(x as f64, y as f64, z as f64).try_normalize().map(|n| n.as_vec3())
}

/// Writes answers in the form asked for, flushing each.
struct Writer<'a> {
    args: &'a SenseArgs,
    photometry: Photometry,
    first: bool,
}

impl<'a> Writer<'a> {
    fn new(args: &'a SenseArgs, photometry: Photometry) -> Writer<'a> {
        Writer { args, photometry, first: true }
    }

    fn put(&self, text: &str) -> Result<(), Failure> {
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| Failure::stdout(&e))
    }

    fn begin(&self) -> Result<(), Failure> {
        let (q, unit) = (self.args.quantity.name(), self.args.quantity.unit());
        match self.args.format {
            FormName::Csv => {
                let bias = match self.args.mode {
                    SenseMode::Zonal => format!(",zonal bias [{unit}],half-width of the bias [{unit}]"),
                    _ => String::new(),
                };
                self.put(&format!(
                    "x,y,z,nx,ny,nz,{q} [{unit}],half-width 95 % [{unit}],gathers,rays,met{bias},surprise\n"
                ))
            }
            FormName::Json => self.put("[\n"),
            FormName::Plain | FormName::Rtrace => Ok(()),
        }
    }

    fn kept(&self, text: &str) -> Result<(), Failure> {
        match self.args.format {
            FormName::Plain | FormName::Rtrace => self.put(&format!("{text}\n")),
            FormName::Csv | FormName::Json => Ok(()),
        }
    }

    fn reading(&mut self, p: Vec3, n: Vec3, r: &Reading) -> Result<(), Failure> {
        match self.args.format {
            FormName::Plain if self.args.ci => {
                let bias = r
                    .bias
                    .map_or(String::new(), |b| format!(" {} {}", number(b.scalar), number(b.half_width)));
                self.put(&format!("{} {}{bias}\n", number(r.scalar), number(r.half_width)))
            }
            FormName::Plain => self.put(&format!("{}\n", number(r.scalar))),
            FormName::Rtrace => {
                let v = r.value.0;
                self.put(&format!("{:e}\t{:e}\t{:e}\t\n", v[0], v[1], v[2]))
            }
            FormName::Csv => {
                let bias = r.bias.map_or(String::new(), |b| format!(",{},{}", b.scalar, b.half_width));
                let surprise = r.surprise.map_or(String::new(), |u| format!("{u:.5}"));
                self.put(&format!(
                    "{},{},{},{},{},{},{},{},{},{},{}{bias},{surprise}\n",
                    p.x, p.y, p.z, n.x, n.y, n.z, r.scalar, r.half_width, r.gathers, r.rays, r.met
                ))
            }
            FormName::Json => {
                let record = record(self.args, &self.photometry, p, n, r);
                let comma = if std::mem::take(&mut self.first) { "" } else { ",\n" };
                self.put(&format!("{comma}{record}"))
            }
        }
    }

    fn end(&self) -> Result<(), Failure> {
        match self.args.format {
            FormName::Json => self.put("\n]\n"),
            _ => Ok(()),
        }
    }
}

/// Six significant digits, plain where that is short.
fn number(v: f64) -> String {
    if v != 0.0 && !(1e-4..1e7).contains(&v.abs()) {
        return format!("{v:.5e}");
    }
    let digits = if v == 0.0 { 0 } else { (5 - v.abs().log10().floor() as i32).max(0) };
    let text = format!("{v:.*}", digits as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        for (v, text) in [
            (1234.5678, "1234.57"),
            (0.0, "0"),
            (1e-9, "1.00000e-9"),
            (2.5, "2.5"),
            (0.00123456789, "0.00123457"),
        ] {
            assert_eq!(number(v), text);
        }
    }

    #[test]
    fn lines_are_sensors_comments_or_named_errors() {
        assert!(matches!(parse("1 2 3 0 0 2"), Ok(Line::Sensor(_, n)) if n == Vec3::Z));
        assert!(matches!(parse("  # desk"), Ok(Line::Kept)) && matches!(parse(""), Ok(Line::Kept)));
        for (text, what) in [
            ("1 2 3", "expected 6 numbers (x y z nx ny nz), found 3"),
            ("1 2 x 0 0 1", "\"x\" is not a number"),
            ("1 2 nan 0 0 1", "\"nan\" is not finite"),
            ("1 2 3 0 0 0", "the normal has no length"),
        ] {
            assert_eq!(parse(text).err().as_deref(), Some(what));
        }
    }
}
