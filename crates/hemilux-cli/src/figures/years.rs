//! Thirty years in one plot: the error at a point that sees a lamp and its image in a flat mirror, as the lamp shrinks from
//! 30 cm to 1 mm at constant power, by the report's methods and by what came of them.

use crate::draw::plot::{Axis, Plot};
use crate::draw::{Svg, dashed, line};
use hemilux::bsdf::Bsdf;
use hemilux::gather::{GatherPlan, Strategy, gather};
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::strategies::{self, Report};
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::{LoadOptions, Rgb, load_pbrt_str};
use std::f64::consts::PI;
use std::path::Path;

/// Flux of the lamp (W).
const POWER: f64 = 100.0;
/// Gather rays.
const RAYS: u32 = 256;
const RUNS: u32 = 100;
const RADII: [f64; 8] = [0.3, 0.15, 0.07, 0.03, 0.015, 0.007, 0.003, 0.001];

/// A lamp at (1, 0, 2) over a black floor, beside a mirror that shows it at (3, 0, 2).
fn scene(radius: f64) -> Option<World> {
    let radiance = POWER / (4.0 * PI * PI * radius * radius);
    let text = format!(
        "Camera \"perspective\"\nWorldBegin\n\
         MakeNamedMaterial \"mirror\" \"string type\" \"conductor\" \"rgb reflectance\" [ 1 1 1 ] \"float roughness\" 0\n\
         Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]\n\
         Shape \"trianglemesh\" \"point3 P\" [ -1 -1.5 0  2 -1.5 0  2 1.5 0  -1 1.5 0 ] \"integer indices\" [ 0 1 2 0 2 3 ]\n\
         AttributeBegin\nTranslate 1 0 2\nAreaLightSource \"diffuse\" \"rgb L\" [ {radiance} {radiance} {radiance} ]\n\
         Shape \"sphere\" \"float radius\" {radius}\nAttributeEnd\n\
         NamedMaterial \"mirror\"\n\
         Shape \"trianglemesh\" \"point3 P\" [ 2 -3 0  2 3 0  2 3 5  2 -3 5 ] \"integer indices\" [ 0 1 2 0 2 3 ]\n"
    );
    load_pbrt_str(&text, Path::new(""), &LoadOptions::default()).ok().map(|l| World::new(l.scene))
}

/// The plot.
pub fn thirty_years(seed: u64) -> String {
    let shown = [
        (Strategy::Report(Report::Contrast), "#d62728"),
        (Strategy::Report(Report::Shrinking), "#ff7f0e"),
        (Strategy::Report(Report::TwoStage), "#2ca02c"),
        (Strategy::default(), "#1f77b4"),
    ];
    let mut lines: Vec<Vec<[f64; 2]>> = vec![Vec::new(); shown.len()];
    for radius in RADII {
        let Some(world) = scene(radius) else { continue };
        let zones = Zones::solve(&world, &ZoneOptions { budget: 1000, particles: 1 << 17, seed });
        for (values, (strategy, _)) in lines.iter_mut().zip(shown) {
            values.push([radius, error(&world, &zones, strategy, seed)]);
        }
    }
    let mut svg = Svg::new(860.0, 440.0);
    let plot = Plot {
        frame: [80.0, 50.0, 480.0, 320.0],
        x: Axis { low: 8e-4, high: 0.4, log: true, label: "radius of the lamp (m), its power constant" },
        y: Axis { low: 1e-3, high: 20.0, log: true, label: "relative error (root mean square)" },
    };
    let title = format!("a lamp and its image in a mirror, about {RAYS} gather rays, {RUNS} runs");
    plot.axes(&mut svg, &title);
    let mut entries = Vec::new();
    for (values, (strategy, colour)) in lines.iter().zip(shown) {
        let biased = strategies::is_biased(strategy);
        let pen = if biased { dashed(colour, 1.4) } else { line(colour, 1.6) };
        plot.line(&mut svg, values, pen);
        plot.dots(&mut svg, values, 3.0, colour);
        let what = match strategy {
            Strategy::Report(Report::Contrast) => " (1989)",
            Strategy::Report(Report::Shrinking) => " (1994)",
            Strategy::Report(_) => " (fresh samples)",
            _ => " (the default)",
        };
        entries.push((format!("{}{what}", strategies::name(strategy)), pen));
    }
    let entries: Vec<_> = entries.iter().map(|(n, p)| (n.as_str(), *p)).collect();
    plot.legend(&mut svg, [1.03, 0.05], &entries);
    svg.text(
        [320.0, 428.0],
        11.5,
        crate::draw::Anchor::Middle,
        "dashed: biased; an error of 1 is a lamp that was not found",
    );
    svg.finish()
}

/// Root mean square error of the irradiance at the origin, relative to the image method's.
fn error(world: &World, zones: &Zones, strategy: Strategy, seed: u64) -> f64 {
    let part = |x: f64| POWER / (4.0 * PI) * 2.0 / (x * x + 4.0f64).powf(1.5);
    let truth = part(1.0) + part(3.0);
    let walker = Walker::zonal(world, zones);
    let surface = sensor_surface(Vec3::new(0.0, 0.0, 1e-5), Vec3::Z);
    let white = Bsdf::diffuse(Rgb::WHITE);
    let plan = GatherPlan { rays: RAYS, shadow_rays: RAYS / 4, strategy };
    let square: f64 = (0..RUNS)
        .map(|i| {
            let mut sampler = Sampler::new(seed, i as u64, 0);
            let l = gather(&walker, &surface, &white, &plan, &mut sampler, &mut Tally::default());
            (PI * l[1] as f64 / truth - 1.0).powi(2)
        })
        .sum();
    (square / RUNS as f64).sqrt()
}
