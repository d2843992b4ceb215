//! Whether gathers over frozen zones have the right mean in every pixel: 200 independent renders against a long run.
//!
//!     cargo run --release -p hemilux --features wrong-physics --example unbiased -- SCENE [option=value]...
//!
//! Options: `size=32x24`, `renders=200` (of one sample per pixel, each with a seed of its own), `long=400` (samples per pixel of the long
//! run), `by=sobol|other` (what leads the long run: nothing but plain Sobol' points over each lobe, or `adaptive` over the records and
//! predicted field radiance of other particles; in both cases pixels expect nothing of the surfaces they span), `particles=262144`, `budget=20000`.
//!
//! Zones are written to a file and read back, as `render --zones FILE` does. Tails are heavy where images are missed, so the test is on
//! means of groups: 40 of either side, Welch's t per pixel on the luminance, against the limit for 39 degrees of freedom (fewer
//! than it has) at a false-alarm rate of 1e-3 over all pixels (Šidák). Printed besides: the root mean square of t (1.03 if all is
//! right) and t of the picture's mean. With the cargo feature `wrong-physics` the renders are done a second time with a
//! density that is wrong on purpose (cones and predicted field radiance count as 0.9 of theirs), and that must be found out.

use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::render::{Mode, RenderOptions, Renderer};
use hemilux::world::World;
use hemilux::zones::broad::Broad;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::Rgb;
use hemilux_scene::import::{LoadOptions, load};
use std::path::PathBuf;
use std::sync::atomic::AtomicU64;

type Failure = Box<dyn std::error::Error>;

/// Groups of renders on either side.
const GROUPS: u32 = 40;
/// |t| with 39 degrees of freedom exceeds this with probability 1.3e-6: once in 1000 runs over 768 pixels.
const LIMIT: f64 = 5.71;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, options @ ..] = args.as_slice() else {
        return Err("usage: unbiased SCENE [option=value]...".into());
    };
    let option = |key: &str, default: &str| -> String {
        let prefix = format!("{key}=");
        options.iter().find_map(|o| o.strip_prefix(&prefix)).unwrap_or(default).to_string()
    };
    let world = World::new(load(&[PathBuf::from(path)], &LoadOptions::default())?.scene);
    let (budget, particles) = (option("budget", "20000").parse()?, option("particles", "262144").parse()?);
    let solve = |seed| Zones::solve(&world, &ZoneOptions { budget, particles, seed });
    let mut file = Vec::new();
    solve(0).write(&world, budget, &mut file)?;
    let (zones, other) = (Zones::read(&world, &file)?, solve(1));
    let size = option("size", "32x24");
    let (width, height) = size.split_once('x').ok_or("size=WxH")?;
    let (width, height) = (width.parse()?, height.parse()?);
    let renders: u32 = option("renders", "200").parse()?;
    let long: u32 = option("long", "400").parse()?;
    let by = option("by", "other");
    let nothing = Broad::given(vec![Rgb::BLACK; 2 * zones.map().len()]);
    let run = |steer, strategy, renders: u32, seed: u64, expected: Option<&Broad>| {
        let plan = GatherPlan { rays: 16, shadow_rays: 8, strategy };
        let options = RenderOptions { mode: Mode::Zonal, plan, seed: 0, max_depth: u32::MAX };
        let mut renderer = Renderer::new(&world, Some(&zones), width, height, options).steered(steer);
        if let Some(expected) = expected {
            renderer = renderer.expecting(expected);
        }
        (0..GROUPS)
            .map(|g| group(&renderer, [width, height], seed + (g * renders) as u64, renders / GROUPS))
            .collect()
    };
    let truth: Vec<Vec<f64>> = match by.as_str() {
        "sobol" => run(&zones, Strategy::Sobol, long, 1 << 40, Some(&nothing)),
        "other" => run(&other, Strategy::Adaptive, long, 1 << 40, Some(&nothing)),
        _ => return Err("by=sobol or by=other".into()),
    };
    println!(
        "{path}: {size}, {renders} renders against {long} samples per pixel by {by}; limit of |t| {LIMIT}"
    );
    let right = compare("as it is", &run(&zones, Strategy::Adaptive, renders, 0, None), &truth);
    let wrong = control(|| {
        compare(
            "densities that lead count as 0.9",
            &run(&zones, Strategy::Adaptive, renders, 0, None),
            &truth,
        )
    });
    let failed = right.abs() > LIMIT || wrong.is_some_and(|t| t.abs() <= LIMIT);
    println!("{}", if failed { "FAIL" } else { "pass" });
    if failed { Err("the means do not agree, or the control was not found out".into()) } else { Ok(()) }
}

/// What `test` finds with wrong densities, in a build that can make them.
#[cfg(feature = "wrong-physics")]
fn control(test: impl FnOnce() -> f64) -> Option<f64> {
    hemilux::wrong::choose(hemilux::wrong::Wrong::Density);
    Some(test())
}

/// The same in a build that cannot: nothing, said aloud.
#[cfg(not(feature = "wrong-physics"))]
fn control(_: impl FnOnce() -> f64) -> Option<f64> {
    println!("built without the feature wrong-physics: the control was left out");
    None
}

/// The mean luminance of each pixel over `renders` renders of one sample per pixel.
fn group(renderer: &Renderer, [width, height]: [u32; 2], seed: u64, renders: u32) -> Vec<f64> {
    let mut mean = vec![0.0; (width * height) as usize];
    for i in 0..renders as u64 {
        let mut film = Film::new(width, height, [0, width, 0, height]);
        renderer.clone().with_seed(1 + seed + i).passes(&mut film, 0..1, &AtomicU64::new(0));
        film.for_each(|x, y, p| {
            mean[(y * width + x) as usize] += p.mean().luminance() as f64 / renders as f64
        });
    }
    mean
}

/// Welch's t per pixel; the largest by magnitude.
fn compare(name: &str, a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let statistics = |groups: &[Vec<f64>], of: &dyn Fn(&[f64]) -> f64| {
        let values: Vec<f64> = groups.iter().map(|g| of(g)).collect();
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0) / n)
    };
    let t = |of: &dyn Fn(&[f64]) -> f64| {
        let ((ma, va), (mb, vb)) = (statistics(a, of), statistics(b, of));
        if va + vb > 0.0 { (ma - mb) / (va + vb).sqrt() } else { 0.0 }
    };
    let pixels = a[0].len();
    let all: Vec<f64> = (0..pixels).map(|i| t(&|g: &[f64]| g[i])).collect();
    let worst = all.iter().fold(0.0f64, |w, t| if t.abs() > w.abs() { *t } else { w });
    let picture = |g: &[f64]| g.iter().sum::<f64>() / pixels as f64;
    let rms = (all.iter().map(|t| t * t).sum::<f64>() / pixels as f64).sqrt();
    let (ours, theirs) = (statistics(a, &picture), statistics(b, &picture));
    println!(
        "{name}: worst t {worst:.2}, {} pixels beyond the limit, rms t {rms:.3}; picture {:.6} ± {:.6} against {:.6} ± {:.6}, t {:.2}",
        all.iter().filter(|t| t.abs() > LIMIT).count(),
        ours.0,
        ours.1.sqrt(),
        theirs.0,
        theirs.1.sqrt(),
        t(&picture)
    );
    worst
}
