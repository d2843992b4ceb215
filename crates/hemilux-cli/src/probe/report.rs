//! A probe in words and as JSON.

use super::Findings;
use super::measure::{Compared, LongRun, Run};
use crate::plan::seconds;
use hemilux::gather::Stratum;
use hemilux::strategies;
use hemilux_scene::geom::Vec3;
use hemiquad::{Region, Shape, Size, Stage};
use serde_json::{Value, json};

/// Version of the JSON form.
const VERSION: u32 = 1;

/// Everything, as JSON.
pub fn json(found: &Findings) -> Value {
    let spot = found.spot;
    let s = &spot.surface;
    let (lamps, virtuals) = spot.cones();
    json!({
        "version": VERSION,
        "position": s.p.to_array(),
        "normal": s.frame.n.to_array(),
        "towards": s.wo.to_array(),
        "mirrors_passed": spot.passed,
        "quantity": spot.quantity.0,
        "unit": spot.quantity.1,
        "square": "Shirley and Chiu's map of the unit square to the hemisphere, z the shading normal",
        "reference": long_run(&found.reference),
        "zones_part": long_run(&found.zones),
        "luminaires": lamps.iter().map(|r| region(found, r)).collect::<Vec<_>>(),
        "virtual_luminaires": virtuals.iter().map(|r| region(found, r)).collect::<Vec<_>>(),
        "hints": spot.hinted().iter().map(|r| region(found, r)).collect::<Vec<_>>(),
        "run": run(&found.shown, true),
        "compared": found.compared.iter().map(compared).collect::<Vec<_>>(),
    })
}

fn long_run(r: &LongRun) -> Value {
    json!({"value": r.value, "rgb": r.rgb, "standard_error": r.std_error, "rays": r.rays})
}

fn region(found: &Findings, r: &Region) -> Value {
    let Shape::Cap { axis, height } = r.shape else { return Value::Null };
    let side = 1f32.copysign(found.spot.wo.z);
    let local = Vec3::new(axis.x as f32, axis.y as f32, side * axis.z as f32);
    let world = found.spot.surface.frame.to_world(local);
    json!({
        "direction": world.to_array(),
        "local": local.to_array(),
        "half_angle": (1.0 - height).clamp(-1.0, 1.0).acos(),
        "weight": r.weight,
    })
}

fn run(r: &Run, all: bool) -> Value {
    let mut v = json!({
        "strategy": strategies::name(r.strategy),
        "biased": strategies::is_biased(r.strategy),
        "value": r.value,
        "rgb": r.rgb,
        "half_width_95": r.half_width,
        "unexplored_cap": r.unexplored,
        "rays": r.rays,
        "time_s": r.time.as_secs_f64(),
    });
    if let (true, Some(map)) = (all, v.as_object_mut()) {
        let sample = |(p, value): &(hemiquad::Probe, f64)| {
            let size = match p.size {
                Size::True => Value::Null,
                Size::Times(k) => json!({"times": k}),
                Size::AtLeast(r) => json!({"at_least": r}),
            };
            let pilot = p.stage == Stage::Pilot;
            json!({"u": p.uv.u, "v": p.uv.v, "value": value, "pilot": pilot, "luminaire_size": size})
        };
        let name = |s: &Stratum| match s {
            Stratum::Lobe => "lobe",
            Stratum::Prediction => "prediction",
            Stratum::Cones => "cones",
            Stratum::Luminaires => "luminaires",
            Stratum::Hint => "hint",
        };
        let drawn = r.drawn.iter().map(|(uv, s)| json!({"u": uv.u, "v": uv.v, "stratum": name(s)}));
        map.insert("drawn".into(), drawn.collect());
        map.insert("samples".into(), r.samples.iter().map(sample).collect());
        let cell = |c: &Vec<hemiquad::Uv<f64>>| json!(c.iter().map(|p| [p.u, p.v]).collect::<Vec<_>>());
        map.insert("cells".into(), r.cells.iter().map(cell).collect());
    }
    v
}

fn compared(c: &Compared) -> Value {
    let level = |l: &super::measure::Level| {
        json!({
            "asked": l.asked, "rays": l.rays, "relative_rmse": l.rmse, "relative_bias": l.bias,
            "bias_standard_error": l.bias_error, "time_s": l.time.as_secs_f64(),
        })
    };
    json!({"run": run(&c.shown, false), "levels": c.levels.iter().map(level).collect::<Vec<_>>()})
}

/// A value with its interval.
pub fn with_error(value: f64, half: Option<f64>) -> String {
    half.map_or(format!("{value:.5}"), |h| format!("{value:.5} ± {h:.5}"))
}

/// A few lines for people.
pub fn summary(found: &Findings) -> String {
    let spot = found.spot;
    let s = &spot.surface;
    let (lamps, virtuals) = spot.cones();
    let r = &found.reference;
    let mut text = format!(
        "point            {} {} {}   normal {} {} {}\n\
         {:16} {} {} (95 %, {} rays)\n\
         by the zones     {} {}\n\
         luminaires       {}, virtual {}\n\
         {:16} {}, {} rays, {}{}\n",
        s.p.x,
        s.p.y,
        s.p.z,
        s.frame.n.x,
        s.frame.n.y,
        s.frame.n.z,
        spot.quantity.0,
        with_error(r.value, Some(1.96 * r.std_error)),
        spot.quantity.1,
        r.rays,
        with_error(found.zones.value, Some(1.96 * found.zones.std_error)),
        spot.quantity.1,
        lamps.len(),
        virtuals.len(),
        "one run",
        with_error(found.shown.value, found.shown.half_width),
        found.shown.rays,
        seconds(found.shown.time),
        if strategies::is_biased(found.shown.strategy) { ", biased" } else { "" },
    );
    if spot.passed > 0 {
        text += &format!("seen through     {} mirrors or panes\n", spot.passed);
    }
    if !found.compared.is_empty() {
        text +=
            "\n| strategy | rays | error | bias | time | biased |\n| --- | --- | --- | --- | --- | --- |\n";
        for c in &found.compared {
            for l in &c.levels {
                text += &format!(
                    "| {} | {:.0} | {:.2} % | {:+.2} ± {:.2} % | {} | {} |\n",
                    strategies::name(c.shown.strategy),
                    l.rays,
                    100.0 * l.rmse,
                    100.0 * l.bias,
                    100.0 * 1.96 * l.bias_error,
                    time(l.time.as_secs_f64()),
                    if strategies::is_biased(c.shown.strategy) { "yes" } else { "no" },
                );
            }
        }
    }
    text
}

fn time(s: f64) -> String {
    if s < 1e-3 { format!("{:.0} µs", 1e6 * s) } else { format!("{:.1} ms", 1e3 * s) }
}
