//! Figures 2 and 3: several bright disks on a dim ground, the domains of their integrals, and the methods of sections 3 and
//! 4 at work on them.

use crate::draw::chart::{Chart, View};
use crate::draw::{Anchor, Pen, Svg, dashed, filled, line};
use hemiquad::method::*;
use hemiquad::partition::Parent;
use hemiquad::suite::{Instance, disks};
use hemiquad::{Criterion, Key, Method, Probe, Region, Shape, Size, Uv, Workspace};
use std::cell::RefCell;

/// Centre and radius of the bright disks: lights seen in the distance.
const LIGHTS: [(f64, f64, f64); 8] = [
    (0.18, 0.76, 0.035),
    (0.31, 0.70, 0.030),
    (0.44, 0.66, 0.026),
    (0.56, 0.63, 0.022),
    (0.66, 0.61, 0.019),
    (0.75, 0.595, 0.016),
    (0.24, 0.22, 0.090),
    (0.80, 0.28, 0.060),
];
/// Value of the ground; disks have ten times as much.
const GROUND: f64 = 0.1;
/// Evaluations of each method in figure 3.
const BUDGET: u32 = 196;

fn integrand() -> Instance {
    let disk =
        |l: &(f64, f64, f64)| (Uv::new(l.0, l.1), l.2, 10.0 * GROUND * std::f64::consts::PI * l.2 * l.2);
    disks(LIGHTS.iter().map(disk).collect(), GROUND)
}

fn lights(svg: &mut Svg, chart: &Chart, scale: f64, pen: Pen<'_>) {
    let [x, y, side] = chart.frame;
    svg.clipped([x, y, side, side], |svg| {
        for (u, v, r) in LIGHTS {
            if let Some(at) = chart.place(Uv::new(u, v)) {
                svg.circle(at, r * scale * side, pen);
            }
        }
    });
}

const DIM: &str = "#5f6b7a";
const BRIGHT: &str = "#fff3c4";

/// Figure 2: "Domains of integration".
pub fn domains(_seed: u64) -> String {
    let mut svg = Svg::new(860.0, 330.0);
    let panels = ["L over Ω", "Lᵣ over Ωᵣ = Ω (indirect)", "Lₑ over Ωₑ (direct): the disks"];
    for (i, words) in panels.iter().enumerate() {
        let chart = Chart { frame: [20.0 + 280.0 * i as f64, 20.0, 260.0], view: View::Square };
        let [x, y, side] = chart.frame;
        if i < 2 {
            svg.rect([x, y, side, side], filled(DIM));
        }
        match i {
            0 => lights(&mut svg, &chart, 1.0, filled(BRIGHT)),
            // Luminaires reflect as well; what they emit is not here.
            1 => lights(&mut svg, &chart, 1.0, filled("#77818f")),
            _ => lights(&mut svg, &chart, 1.0, Pen { stroke: "#b07a00", width: 1.5, ..filled(BRIGHT) }),
        }
        chart.frame(&mut svg, if i < 2 { line("#222222", 1.5) } else { dashed("#999999", 1.0) });
        svg.text([x + side / 2.0, y + side + 22.0], 13.0, Anchor::Middle, words);
    }
    svg.text([430.0, 322.0], 12.0, Anchor::Middle, "I = ∫ Lᵣ dA over Ωᵣ + ∫ Lₑ dA over Ωₑ");
    svg.finish()
}

/// One panel of figure 3.
struct Panel {
    words: &'static str,
    /// The report's place for it.
    note: &'static str,
    method: Box<dyn Method<f64>>,
    /// Regions to be outlined.
    regions: Vec<Region>,
    /// Scale of the radii of the lights as the method sees them; 0 where it varies.
    scale: f64,
}

/// Methods that borrow their regions keep them for as long as the program runs: the figure is drawn once.
fn forever(regions: &[Region]) -> &'static [Region] {
    Box::leak(regions.to_vec().into_boxed_slice())
}

fn panels(instance: &Instance) -> Vec<Panel> {
    let known = forever(&instance.features);
    let wide: Vec<Region> = instance
        .features
        .iter()
        .enumerate()
        .map(|(i, r)| Region { shape: r.shape.misplaced(3.0, Key::new(i as u64)), ..*r })
        .collect();
    let wide = forever(&wide);
    let contrast = || Criterion::Contrast.into();
    let plain = |words, note, method: Box<dyn Method<f64>>| Panel {
        words,
        note,
        method,
        regions: vec![],
        scale: 1.0,
    };
    vec![
        Panel {
            regions: wide.to_vec(),
            ..plain("domain partitioning", "Kirk and Arvo; unbiased", Box::new(KirkArvo::new(wide)))
        },
        Panel {
            regions: known.to_vec(),
            ..plain("direct and indirect", "luminaires known; unbiased", Box::new(DirectIndirect::new(known)))
        },
        plain("not adaptive", "jittered; unbiased", Box::new(Jittered)),
        plain(
            "subdivision by contrast",
            "one stage, biased",
            Box::new(PainterSloan { criterion: contrast(), parent: Parent::Keep }),
        ),
        plain(
            "subdivision by value",
            "one stage, biased",
            Box::new(PainterSloan { criterion: Criterion::Value.into(), parent: Parent::Keep }),
        ),
        plain("Voronoi weights", "Glassner; one stage, biased", Box::new(Glassner { criterion: contrast() })),
        plain("Delaunay", "one stage, biased", Box::new(DelaunayAdaptive { criterion: contrast() })),
        plain(
            "triangles on the hemisphere",
            "Beyer and Lange; biased",
            Box::new(BeyerLange { criterion: contrast() }),
        ),
        Panel {
            scale: 2.0,
            ..plain(
                "enlarged luminaires, k = 4",
                "biased",
                Box::new(Enlarged {
                    k: 4.0,
                    inner: PainterSloan { criterion: contrast(), parent: Parent::Keep },
                }),
            )
        },
        Panel { scale: 0.0, ..plain("shrinking luminaires", "biased", Box::<Shrinking>::default()) },
        plain("two stages", "fresh samples; unbiased", Box::<TwoStage>::default()),
        Panel {
            regions: wide.to_vec(),
            ..plain(
                "predicted, three times too wide",
                "balance heuristic; unbiased",
                Box::new(Predicted::from_regions(wide)),
            )
        },
    ]
}

/// Figure 3: "Methods of integration".
pub fn methods(seed: u64) -> String {
    let instance = integrand();
    let panels = panels(&instance);
    let (columns, side, step) = (4, 230.0, [250.0, 292.0]);
    let rows = panels.len().div_ceil(columns);
    let mut svg = Svg::new(20.0 + step[0] * columns as f64, 44.0 + step[1] * rows as f64);
    let heading = format!(
        "one integrand, at most {BUDGET} evaluations, exact value {:.4}; orange: samples of the estimate, blue: pilots",
        instance.exact
    );
    svg.text([20.0, 26.0], 13.0, Anchor::Start, &heading);
    for (i, panel) in panels.iter().enumerate() {
        let corner = [20.0 + step[0] * (i % columns) as f64, 44.0 + step[1] * (i / columns) as f64];
        let chart = Chart { frame: [corner[0], corner[1], side], view: View::Square };
        draw(&mut svg, &chart, panel, &instance, seed);
    }
    svg.finish()
}

fn draw(svg: &mut Svg, chart: &Chart, panel: &Panel, instance: &Instance, seed: u64) {
    let seen = RefCell::new(Vec::new());
    let mut work = Workspace::new();
    let mut f = |p: &Probe| {
        seen.borrow_mut().push(*p);
        (instance.function)(p)
    };
    let e = panel.method.integrate(&mut f, BUDGET, Key::new(seed).with(3), &mut work);
    let [x, y, s] = chart.frame;
    svg.rect([x, y, s, s], filled(DIM));
    if panel.scale != 1.0 {
        // As large as the method takes them; shrinking ones begin at what the first cells cannot miss.
        let scale = if panel.scale > 0.0 { panel.scale } else { 1.0 };
        lights(svg, chart, scale, filled("#c9b98a"));
    }
    if panel.scale == 0.0 {
        for p in seen.borrow().iter().step_by(16) {
            if let Size::AtLeast(r) = p.size
                && let Some(l) = LIGHTS.iter().find(|l| (p.uv.u - l.0).hypot(p.uv.v - l.1) <= r && r > l.2)
                && let Some(at) = chart.place(Uv::new(l.0, l.1))
            {
                svg.clipped([x, y, s, s], |svg| svg.circle(at, r * s, dashed("#e8dcae", 0.7)));
            }
        }
    }
    lights(svg, chart, 1.0, filled(BRIGHT));
    if let Some(leaves) = panel.method.leaves() {
        work.outlines(leaves, &mut |polygon, _| chart.polygon(svg, polygon, 1, line("#b9c4d2", 0.5)));
    }
    svg.clipped([x, y, s, s], |svg| {
        for r in &panel.regions {
            if let Shape::Disk { centre, radius } = r.shape
                && let Some(at) = chart.place(centre)
            {
                svg.circle(at, radius * s, line("#5fd08a", 1.0));
            }
        }
    });
    for p in seen.borrow().iter() {
        let colour = if p.stage == hemiquad::Stage::Pilot { "#4ea8ff" } else { "#ff8a2a" };
        if let Some(at) = chart.place(p.uv) {
            svg.circle(at, 1.6, filled(colour));
        }
    }
    chart.frame(svg, line("#222222", 1.2));
    svg.text([x, y + s + 16.0], 12.5, Anchor::Start, panel.words);
    svg.text([x, y + s + 31.0], 10.5, Anchor::Start, panel.note);
    let error = e.half_width_95().map_or(String::new(), |h| format!(" ± {h:.3}"));
    svg.text([x + s, y + s + 31.0], 10.5, Anchor::End, &format!("{:.3}{error}", e.value));
}
