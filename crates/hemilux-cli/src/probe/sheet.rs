//! A probe as a drawing: square, disk and hemisphere; with `--compare`, a column per strategy and errors against rays.

use super::Findings;
use super::measure::{Compared, Run};
use super::report::with_error;
use crate::draw::chart::{Chart, View, heat, hex};
use crate::draw::plot::{Axis, Plot};
use crate::draw::{Anchor, Svg, dashed, filled, line};
use hemilux::gather::Stratum;
use hemilux::strategies;
use hemilux_scene::Rgb;
use hemiquad::map::{Cone, Map};
use hemiquad::{Dir, Region, Shape, Stage, Uv, turn};

/// Pixels per side of the pictures in the charts.
const RASTER: usize = 192;
/// 1 - cos of the smallest ring that is drawn round a cone (1.6°).
const SMALLEST: f64 = 4e-4;
/// Powers of ten that the colours span.
const DECADES: f64 = 4.0;
const WIDTH: f64 = 1180.0;
const COLOURS: [&str; 7] = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#8c564b", "#e377c2", "#17becf"];

/// Draw it.
pub fn draw(found: &Findings) -> String {
    let columns = 4;
    let rows = found.compared.len().div_ceil(columns);
    let height = 450.0 + if rows > 0 { 340.0 * rows as f64 + 520.0 } else { 0.0 };
    let mut svg = Svg::new(WIDTH, height);
    head(&mut svg, found);
    let top = found.field.all.iter().map(|v| v.luminance() as f64).fold(0.0, f64::max).max(1e-12);
    let views = [View::Square, View::Disk, View::Hemisphere { azimuth: -1.2, elevation: 0.9 }];
    for (i, view) in views.into_iter().enumerate() {
        let chart = Chart { frame: [20.0 + 285.0 * i as f64, 76.0, 265.0], view };
        chart.raster(&mut svg, RASTER, |uv| {
            heat(at(found, &found.field.all, uv), top * 10f64.powf(-DECADES), top)
        });
        overlay(&mut svg, &chart, found, &found.shown);
        let words = ["unit square", "disk", "hemisphere"][i];
        svg.text([chart.frame[0] + 132.0, 358.0], 12.0, Anchor::Middle, words);
    }
    let chart = Chart { frame: [875.0, 76.0, 265.0], view: View::Square };
    chart.raster(&mut svg, RASTER, |uv| {
        heat(at(found, &found.field.zones, uv), top * 10f64.powf(-DECADES), top)
    });
    chart.frame(&mut svg, line("#222222", 1.0));
    svg.text([1007.0, 358.0], 12.0, Anchor::Middle, "the zones' part (square)");
    legend(&mut svg, top);
    for (i, c) in found.compared.iter().enumerate() {
        let corner = [20.0 + 290.0 * (i % columns) as f64, 460.0 + 340.0 * (i / columns) as f64];
        column(&mut svg, found, c, corner, top);
    }
    if rows > 0 {
        errors(&mut svg, found, 470.0 + 340.0 * rows as f64);
    }
    svg.finish()
}

fn at(found: &Findings, values: &[Rgb], uv: Uv<f64>) -> f64 {
    let n = found.field.side;
    let index = |x: f64| ((x * n as f64) as usize).min(n - 1);
    values[(n - 1 - index(uv.v)) * n + index(uv.u)].luminance() as f64
}

fn head(svg: &mut Svg, found: &Findings) {
    let spot = found.spot;
    let (s, r) = (&spot.surface, &found.reference);
    let point = format!(
        "point ({:.4}, {:.4}, {:.4}), normal ({:.3}, {:.3}, {:.3}); {} {} {} by a long run of {} rays; by the zones {}",
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
        with_error(found.zones.value, None),
    );
    svg.text([20.0, 26.0], 13.0, Anchor::Start, &point);
    svg.text([20.0, 50.0], 13.0, Anchor::Start, &words(&found.shown));
}

fn words(run: &Run) -> String {
    format!(
        "{}{}: {}, {} rays, {:.2} ms",
        strategies::name(run.strategy),
        if strategies::is_biased(run.strategy) { " (biased)" } else { "" },
        with_error(run.value, run.half_width),
        run.rays,
        1e3 * run.time.as_secs_f64()
    )
}

/// Cells, luminaires, samples.
fn overlay(svg: &mut Svg, chart: &Chart, found: &Findings, run: &Run) {
    for cell in &run.cells {
        chart.polygon(svg, cell, 4, line("#ffffff", 0.35));
    }
    let n = run.samples.len().max(1) as f64;
    for (i, (p, _)) in run.samples.iter().enumerate() {
        let Some(place) = chart.place(p.uv) else { continue };
        // Early ones dark, late ones light; pilots blue.
        let t = (120.0 + 135.0 * i as f64 / n) as u8;
        let colour =
            if p.stage == Stage::Pilot { [60, t / 2 + 40, t] } else { [t, (t as f64 * 0.55) as u8, 20] };
        svg.circle(place, 1.3, filled(&hex(colour)));
    }
    for (uv, stratum) in &run.drawn {
        let Some(place) = chart.place(*uv) else { continue };
        svg.circle(place, 1.3, filled(&hex(colour(*stratum))));
    }
    for r in &found.spot.hinted() {
        chart.curve(svg, &rim(r), dashed("#ff70ff", 1.4));
    }
    let (lamps, virtuals) = found.spot.cones();
    for r in virtuals.iter().take(64) {
        chart.curve(svg, &rim(r), line("#10301a", 2.4));
        chart.curve(svg, &rim(r), dashed("#7dff9c", 1.4));
    }
    for r in &lamps {
        chart.curve(svg, &rim(r), line("#10301a", 2.4));
        chart.curve(svg, &rim(r), line("#7dff9c", 1.4));
    }
    chart.frame(svg, line("#222222", 1.0));
}

/// Colours of the rays of plain strategies.
const STRATA: [(Stratum, [u8; 3], &str); 5] = [
    (Stratum::Lobe, [255, 140, 20], "own chart"),
    (Stratum::Prediction, [250, 220, 60], "predicted field radiance"),
    (Stratum::Cones, [60, 200, 255], "cones"),
    (Stratum::Luminaires, [255, 255, 255], "shadow rays"),
    (Stratum::Hint, [255, 112, 255], "hints"),
];

fn colour(stratum: Stratum) -> [u8; 3] {
    STRATA.iter().find(|s| s.0 == stratum).map_or([0; 3], |s| s.1)
}

/// Directions on the rim of a cone, at least as wide as can be seen.
fn rim(r: &Region) -> Vec<Dir<f64>> {
    let Shape::Cap { axis, height } = r.shape else { return Vec::new() };
    let Some(cone) = Cone::from_height(height.max(SMALLEST)) else { return Vec::new() };
    // The cone's own map puts the border of the square on the rim.
    let border = |t: f64| {
        let (side, x) = ((t * 4.0) as u32, (t * 4.0).fract());
        let e = 1.0 - 1e-9;
        match side {
            0 => Uv::new(x, 0.0),
            1 => Uv::new(e, x),
            2 => Uv::new(e * (1.0 - x), e),
            _ => Uv::new(0.0, e * (1.0 - x)),
        }
    };
    (0..48).map(|k| turn(axis, cone.dir(border(k as f64 / 48.0)))).collect()
}

fn legend(svg: &mut Svg, top: f64) {
    let (x, y, w) = (20.0, 384.0, 300.0);
    for i in 0..100 {
        let v = top * 10f64.powf(DECADES * (i as f64 / 99.0 - 1.0));
        let colour = heat(v, top * 10f64.powf(-DECADES), top);
        svg.rect([x + w * i as f64 / 100.0, y, w / 100.0 + 0.5, 12.0], filled(&hex(colour)));
    }
    for k in 0..=DECADES as u32 {
        let v = top * 10f64.powf(k as f64 - DECADES);
        svg.text([x + w * k as f64 / DECADES, y + 26.0], 10.5, Anchor::Middle, &format!("{v:.1e}"));
    }
    svg.text([x, y + 44.0], 11.0, Anchor::Start, "field radiance, luminance of W/sr/m2, logarithmic");
    let x = 400.0;
    svg.path(&[[x, y + 6.0], [x + 24.0, y + 6.0]], false, line("#36b35a", 1.6));
    svg.text([x + 30.0, y + 10.0], 11.0, Anchor::Start, "luminaires (balls around them)");
    svg.path(&[[x, y + 24.0], [x + 24.0, y + 24.0]], false, dashed("#36b35a", 1.6));
    svg.text(
        [x + 30.0, y + 28.0],
        11.0,
        Anchor::Start,
        "virtual luminaires, as light particles predict them",
    );
    svg.circle([x + 340.0, y + 6.0], 2.5, filled(&hex([120, 66, 20])));
    svg.circle([x + 350.0, y + 6.0], 2.5, filled(&hex([255, 140, 20])));
    svg.text([x + 360.0, y + 10.0], 11.0, Anchor::Start, "samples: early to late");
    svg.circle([x + 345.0, y + 24.0], 2.5, filled(&hex([60, 140, 255])));
    svg.text([x + 360.0, y + 28.0], 11.0, Anchor::Start, "pilot samples");
    let mut x = x;
    for (_, colour, name) in STRATA {
        svg.circle([x + 4.0, y + 40.0], 3.4, filled("#444444"));
        svg.circle([x + 4.0, y + 40.0], 2.5, filled(&hex(colour)));
        svg.text([x + 12.0, y + 44.0], 11.0, Anchor::Start, name);
        x += 26.0 + 6.2 * name.len() as f64;
    }
    svg.text([x, y + 44.0], 11.0, Anchor::Start, "(adaptive, jittered, sobol)");
}

fn column(svg: &mut Svg, found: &Findings, c: &Compared, [x, y]: [f64; 2], top: f64) {
    let side = 260.0;
    let chart = Chart { frame: [x, y, side], view: View::Square };
    chart.raster(svg, 96, |uv| heat(at(found, &found.field.all, uv), top * 10f64.powf(-DECADES), top));
    overlay(svg, &chart, found, &c.shown);
    let run = &c.shown;
    let biased = if strategies::is_biased(run.strategy) { " (biased)" } else { "" };
    svg.text(
        [x, y + side + 16.0],
        12.0,
        Anchor::Start,
        &format!("{}{biased}", strategies::name(run.strategy)),
    );
    let off = 100.0 * (run.value / found.reference.value - 1.0);
    let text = format!("{}: {off:+.1} %", with_error(run.value, run.half_width));
    svg.text([x, y + side + 32.0], 11.0, Anchor::Start, &text);
    let text = format!("{} rays, {:.2} ms", run.rays, 1e3 * run.time.as_secs_f64());
    svg.text([x, y + side + 47.0], 11.0, Anchor::Start, &text);
}

fn errors(svg: &mut Svg, found: &Findings, y: f64) {
    let all = || found.compared.iter().flat_map(|c| &c.levels).filter(|l| l.rmse > 0.0);
    let (low, high) = all().fold((f64::INFINITY, 0f64), |(a, b), l| (a.min(l.rmse), b.max(l.rmse)));
    let (first, last) = all().fold((f64::INFINITY, 0f64), |(a, b), l| (a.min(l.rays), b.max(l.rays)));
    if !(low > 0.0 && high > 0.0 && first > 0.0) {
        return;
    }
    let plot = Plot {
        frame: [80.0, y + 20.0, 700.0, 400.0],
        x: Axis { low: first * 0.8, high: last * 1.25, log: true, label: "rays" },
        y: Axis { low: low * 0.7, high: high * 1.4, log: true, label: "relative error (root mean square)" },
    };
    plot.axes(svg, "error against rays; dashed: biased by itself");
    let mut entries = Vec::new();
    for (i, c) in found.compared.iter().enumerate() {
        let colour = COLOURS[i % COLOURS.len()];
        let biased = strategies::is_biased(c.shown.strategy);
        let width = if i < COLOURS.len() { 1.2 } else { 2.4 };
        let pen = if biased { dashed(colour, width) } else { line(colour, width) };
        let values: Vec<_> = c.levels.iter().map(|l| [l.rays, l.rmse]).collect();
        plot.line(svg, &values, pen);
        plot.dots(svg, &values, 2.5, colour);
        entries.push((strategies::name(c.shown.strategy), pen));
    }
    let entries: Vec<_> = entries.iter().map(|(n, p)| (n.as_str(), *p)).collect();
    plot.legend(svg, [1.03, 0.04], &entries);
}
