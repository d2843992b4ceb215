//! Figures 4 and 5: the map from the square to the disk and to the hemisphere, beside (θ, φ) with its cut.

use crate::draw::chart::{Chart, View};
use crate::draw::{Anchor, Pen, Svg, filled, line};
use hemiquad::map::{Concentric, Map, Polar};
use hemiquad::{Dir, Uv};

/// Strips of the square.
const STRIPS: u32 = 8;
/// Squares per side of the checkerboard.
const BOARD: u32 = 16;
/// Pieces of a side where it bends.
const PIECES: u32 = 8;

/// Figure 4: "Area preserving transform from square to disk uses equal area strips".
pub fn square_to_disk(_seed: u64) -> String {
    let mut svg = Svg::new(720.0, 420.0);
    for (x, view, words) in
        [(30.0, View::Square, "strips of the square …"), (370.0, View::Disk, "… and of the disk")]
    {
        let chart = Chart { frame: [x, 30.0, 320.0], view };
        for strip in 0..STRIPS {
            for sector in 0..4 * STRIPS {
                let cell = strip_cell(strip, sector);
                let shade = match (strip + sector / (STRIPS / 2)) % 2 {
                    0 => "#c9d8ea",
                    _ => "#f4efe2",
                };
                chart.polygon(&mut svg, &cell, PIECES, Pen { stroke: "#5b6b80", ..filled_thin(shade) });
            }
        }
        chart.frame(&mut svg, line("#222222", 1.2));
        svg.text([x + 160.0, 372.0], 13.0, Anchor::Middle, words);
    }
    svg.text(
        [360.0, 402.0],
        12.0,
        Anchor::Middle,
        "a square strip of half-width r becomes the ring of radius r; all areas keep their ratio (4 to π)",
    );
    svg.finish()
}

fn filled_thin(fill: &str) -> Pen<'_> {
    Pen { width: 0.5, ..filled(fill) }
}

/// The `sector`-th of the equal parts of a strip between two concentric squares.
fn strip_cell(strip: u32, sector: u32) -> [Uv<f64>; 4] {
    let side = STRIPS;
    let (quarter, part) = (sector / side, (sector % side) as f64 / side as f64);
    let next = part + 1.0 / side as f64;
    let corner = |ring: u32, t: f64| {
        let r = ring as f64 / STRIPS as f64;
        let along = r * (2.0 * t - 1.0);
        let (x, y) = match quarter {
            0 => (r, along),
            1 => (-along, r),
            2 => (-r, -along),
            _ => (along, -r),
        };
        Uv::new(0.5 * (1.0 + x), 0.5 * (1.0 + y))
    };
    [corner(strip, part), corner(strip + 1, part), corner(strip + 1, next), corner(strip, next)]
}

/// Figure 5: "Map of a checkerboard on [0, 1]² to the hemisphere", from two angles; and the same through (θ, φ).
pub fn checkerboard(_seed: u64) -> String {
    let mut svg = Svg::new(940.0, 684.0);
    let angles = [
        ("from the side", View::Hemisphere { azimuth: -0.9, elevation: 0.35 }),
        ("from above", View::Hemisphere { azimuth: -0.9, elevation: 1.2 }),
    ];
    let maps: [(&str, &dyn Map<f64>); 2] =
        [("the report's map", &Concentric), ("through θ = (π/2) a, φ = 2π b", &Polar)];
    for (row, (name, map)) in maps.into_iter().enumerate() {
        let y = 30.0 + 320.0 * row as f64;
        svg.text([18.0, y - 8.0], 13.0, Anchor::Start, name);
        let square = Chart { frame: [20.0, y, 260.0], view: View::Square };
        for cell in 0..BOARD * BOARD {
            let corners = board_cell(cell);
            square.polygon(&mut svg, &corners, 1, filled(shade(cell)));
        }
        square.frame(&mut svg, line("#222222", 1.2));
        svg.text([150.0, y + 278.0], 12.0, Anchor::Middle, "the square");
        for (column, (words, view)) in angles.iter().enumerate() {
            let x = 320.0 + 310.0 * column as f64;
            let chart = Chart { frame: [x, y, 280.0], view: *view };
            for cell in 0..BOARD * BOARD {
                carried(&mut svg, &chart, map, &board_cell(cell), filled(shade(cell)));
            }
            chart.frame(&mut svg, line("#222222", 1.0));
            if row == 1 {
                let cut: Vec<Dir<f64>> = (0..=40).map(|k| map.dir(Uv::new(k as f64 / 40.0, 0.0))).collect();
                let points: Vec<_> =
                    cut.iter().filter_map(|d| Concentric.uv(*d).and_then(|p| chart.place(p))).collect();
                svg.path(&points, false, line("#cc2222", 2.5));
            }
            svg.text([x + 140.0, y + 293.0], 12.0, Anchor::Middle, words);
        }
        if row == 1 {
            for v in [0.0, 1.0] {
                let ends = [0.0, 1.0].map(|u| square.place(Uv::new(u, v)).unwrap_or_default());
                svg.path(&ends, false, line("#cc2222", 2.5));
            }
        }
    }
    svg.text(
        [470.0, 674.0],
        12.0,
        Anchor::Middle,
        "red: the cut; the edges b = 0 and b = 1 of the square are one line on the hemisphere (the printed substitution is the inverse)",
    );
    svg.finish()
}

fn shade(cell: u32) -> &'static str {
    if (cell % BOARD + cell / BOARD).is_multiple_of(2) { "#2f4a6d" } else { "#e9e2cf" }
}

fn board_cell(cell: u32) -> [Uv<f64>; 4] {
    let at = |x: u32, y: u32| Uv::new(x as f64 / BOARD as f64, y as f64 / BOARD as f64);
    let (x, y) = (cell % BOARD, cell / BOARD);
    [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)]
}

/// A polygon of the square, carried to the hemisphere by any map.
fn carried(svg: &mut Svg, chart: &Chart, map: &dyn Map<f64>, corners: &[Uv<f64>; 4], pen: Pen<'_>) {
    let mut points = Vec::new();
    for i in 0..4 {
        let (a, b) = (corners[i], corners[(i + 1) % 4]);
        for k in 0..PIECES {
            let w = k as f64 / PIECES as f64;
            let mix = |a: f64, b: f64| (a + w * (b - a)).clamp(0.0, 1.0 - 1e-12);
            let d = map.dir(Uv::new(mix(a.u, b.u), mix(a.v, b.v)));
            points.extend(Concentric.uv(d).and_then(|p| chart.place(p)));
        }
    }
    // What is partly behind the dome is left out where more than half of it is.
    if points.len() > 2 * PIECES as usize {
        svg.path(&points, true, pen);
    }
}
