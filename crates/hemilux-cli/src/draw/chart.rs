//! The domain of a gather, drawn three ways: the unit square, the disk and the hemisphere behind it (report, section 5).

use super::{Pen, Svg};
use hemilux_image::falsecolor::Palette;
use hemilux_image::tone::Rgb8;
use hemiquad::map::{Concentric, square_to_disk};
use hemiquad::{Dir, Map, Uv};

/// How the unit square is shown.
#[derive(Clone, Copy, Debug)]
pub enum View {
    /// As it is, u to the right, v up.
    Square,
    /// As the disk that the map makes of it: the hemisphere from above, areas kept.
    Disk,
    /// As the hemisphere, seen from azimuth and elevation (radians), in parallel projection.
    Hemisphere { azimuth: f64, elevation: f64 },
}

/// The square from direction `d`, x to the right and y up; `None` where the hemisphere turns away.
fn project(d: Dir<f64>, azimuth: f64, elevation: f64) -> Option<[f64; 2]> {
    let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
    let towards = ce * (ca * d.x + sa * d.y) + se * d.z;
    let right = -sa * d.x + ca * d.y;
    let up = -se * (ca * d.x + sa * d.y) + ce * d.z;
    (towards >= -1e-9).then_some([right, up])
}

/// A chart on a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// x, y and side of the square that holds it.
    pub frame: [f64; 3],
    pub view: View,
}

impl Chart {
    /// Where a point of the unit square lies on the sheet, if it is to be seen.
    pub fn place(&self, p: Uv<f64>) -> Option<[f64; 2]> {
        let [x, y, side] = self.frame;
        let inside = Uv::new(p.u.clamp(0.0, 1.0 - 1e-12), p.v.clamp(0.0, 1.0 - 1e-12));
        match self.view {
            View::Square => Some([x + side * p.u, y + side * (1.0 - p.v)]),
            View::Disk => {
                let (a, b) = square_to_disk(inside);
                Some([x + side * 0.5 * (1.0 + a), y + side * 0.5 * (1.0 - b)])
            }
            View::Hemisphere { azimuth, elevation } => {
                let [a, b] = project(Concentric.dir(inside), azimuth, elevation)?;
                // The dome fills the frame's width; its foot stands near the lower edge.
                let foot = 0.5 * elevation.sin();
                Some([x + side * 0.5 * (1.0 + a), y + side * (0.97 - foot - 0.5 * b)])
            }
        }
    }

    /// A closed polygon of the unit square; its sides are broken into `pieces` where the chart bends them. Left out where a
    /// part of it cannot be seen.
    pub fn polygon(&self, svg: &mut Svg, corners: &[Uv<f64>], pieces: u32, pen: Pen<'_>) {
        let pieces = if matches!(self.view, View::Square) { 1 } else { pieces.max(1) };
        let mut points = Vec::new();
        for (i, a) in corners.iter().enumerate() {
            let b = corners[(i + 1) % corners.len()];
            for k in 0..pieces {
                let w = k as f64 / pieces as f64;
                let Some(p) = self.place(Uv::new(a.u + w * (b.u - a.u), a.v + w * (b.v - a.v))) else {
                    return;
                };
                points.push(p);
            }
        }
        svg.path(&points, true, pen);
    }

    /// A closed curve of directions (the rim of a cone); broken where it cannot be seen or crosses the horizon.
    pub fn curve(&self, svg: &mut Svg, dirs: &[Dir<f64>], pen: Pen<'_>) {
        let mut piece: Vec<[f64; 2]> = Vec::new();
        let reach = 0.2 * self.frame[2];
        for i in 0..=dirs.len() {
            let d = dirs[i % dirs.len().max(1)];
            let at = if d.z > 0.0 { Concentric.uv(d).and_then(|p| self.place(p)) } else { None };
            let jump = |p: [f64; 2]| {
                piece.last().is_some_and(|l: &[f64; 2]| (l[0] - p[0]).hypot(l[1] - p[1]) > reach)
            };
            if at.is_none() || at.is_some_and(jump) {
                svg.path(&piece, false, pen);
                piece.clear();
            }
            piece.extend(at);
        }
        svg.path(&piece, false, pen);
    }

    /// The outline of the domain.
    pub fn frame(&self, svg: &mut Svg, pen: Pen<'_>) {
        let n = 128;
        let [x, y, side] = self.frame;
        match self.view {
            View::Square => svg.rect([x, y, side, side], pen),
            View::Disk => svg.circle([x + 0.5 * side, y + 0.5 * side], 0.5 * side, pen),
            View::Hemisphere { azimuth, elevation } => {
                let foot = 0.5 * elevation.sin();
                let at = |a: f64, b: f64| [x + side * 0.5 * (1.0 + a), y + side * (0.97 - foot - 0.5 * b)];
                let angle = |k: u32| 2.0 * std::f64::consts::PI * k as f64 / n as f64;
                // The near half of the horizon; the dome hides the other.
                let horizon: Vec<_> = (0..=n / 2)
                    .map(|k| {
                        let (s, c) = (azimuth + angle(k) - 0.5 * std::f64::consts::PI).sin_cos();
                        let right = -azimuth.sin() * c + azimuth.cos() * s;
                        let up = -elevation.sin() * (azimuth.cos() * c + azimuth.sin() * s);
                        at(right, up)
                    })
                    .collect();
                svg.path(&horizon, false, pen);
                let arch: Vec<_> = (0..=n / 2).map(|k| at(angle(k).cos(), angle(k).sin())).collect();
                svg.path(&arch, false, pen);
            }
        }
    }

    /// A picture of values over the square: `colour` is asked at the middle of each of `n` × `n` pixels of the frame, with
    /// the point of the square that is seen there.
    pub fn raster(&self, svg: &mut Svg, n: usize, colour: impl Fn(Uv<f64>) -> [u8; 3]) {
        let [x, y, side] = self.frame;
        let mut data = Vec::with_capacity(3 * n * n);
        for j in 0..n {
            for i in 0..n {
                let (a, b) = ((i as f64 + 0.5) / n as f64, (j as f64 + 0.5) / n as f64);
                data.extend(self.under([a, b]).map_or([255, 255, 255], &colour));
            }
        }
        svg.image([x, y, side, side], &Rgb8 { width: n, height: n, data });
    }

    /// The point of the square seen at a place of the frame (0 to 1 from its top left).
    fn under(&self, [a, b]: [f64; 2]) -> Option<Uv<f64>> {
        match self.view {
            View::Square => Some(Uv::new(a, 1.0 - b)),
            View::Disk => {
                let (x, y) = (2.0 * a - 1.0, 1.0 - 2.0 * b);
                if x * x + y * y > 1.0 { None } else { hemiquad::map::disk_to_square(x, y) }
            }
            View::Hemisphere { azimuth, elevation } => {
                let (right, up) = (2.0 * a - 1.0, 2.0 * (0.97 - 0.5 * elevation.sin() - b));
                let rest = 1.0 - right * right - up * up;
                if rest < 0.0 {
                    return None;
                }
                let ((sa, ca), (se, ce)) = (azimuth.sin_cos(), elevation.sin_cos());
                let t = rest.sqrt();
                let (forward, z) = (ce * t - se * up, se * t + ce * up);
                let d = Dir::normalize(ca * forward - sa * right, sa * forward + ca * right, z)?;
                if d.z < 0.0 { None } else { Concentric.uv(d) }
            }
        }
    }
}

/// A colour for a value between `low` and `high`, logarithmic.
pub fn heat(v: f64, low: f64, high: f64) -> [u8; 3] {
    let t = if v > 0.0 { (v / low).ln() / (high / low).ln() } else { 0.0 };
    Palette::Perceptual.colour(t.clamp(0.0, 1.0) as f32)
}

/// A colour as SVG writes it.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_at_a_place_is_what_is_drawn_there() {
        let views = [View::Square, View::Disk, View::Hemisphere { azimuth: 0.7, elevation: 0.5 }];
        for view in views {
            let chart = Chart { frame: [10.0, 20.0, 100.0], view };
            let mut seen = 0;
            for i in 0..400 {
                let p = Uv::new((i % 20) as f64 / 20.0 + 0.013, (i / 20) as f64 / 20.0 + 0.021);
                let Some([x, y]) = chart.place(p) else { continue };
                let back = chart.under([(x - 10.0) / 100.0, (y - 20.0) / 100.0]).unwrap();
                assert!((back.u - p.u).hypot(back.v - p.v) < 1e-6, "{view:?} {p:?} {back:?}");
                seen += 1;
            }
            assert!(seen > 150);
        }
    }
}
