//! Plots: two axes, linear or logarithmic, with lines, points, bars of error and a legend.

use super::{Anchor, Pen, Svg, filled, line};

/// One axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Logarithmic; both ends must be positive.
    pub log: bool,
    /// What it shows.
    pub label: &'a str,
}

impl Axis<'_> {
    /// Position of a value, 0 at the lower end, 1 at the upper.
    fn at(&self, v: f64) -> f64 {
        if self.log {
            (v.max(f64::MIN_POSITIVE) / self.low).ln() / (self.high / self.low).ln()
        } else {
            (v - self.low) / (self.high - self.low)
        }
    }

    /// Where ticks stand, and their words.
    fn ticks(&self) -> Vec<(f64, String)> {
        if self.log {
            let (a, b) = (self.low.log10().ceil() as i32, self.high.log10().floor() as i32);
            let step = ((b - a) / 8 + 1).max(1);
            return (a..=b).step_by(step as usize).map(|e| (10f64.powi(e), power(e))).collect();
        }
        let rough = (self.high - self.low) / 6.0;
        let unit = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|k| k * unit >= rough).unwrap_or(10.0) * unit;
        let digits = (-step.log10().floor()).max(0.0) as usize;
        let (first, last) =
            ((self.low / step - 1e-9).ceil() as i64, (self.high / step + 1e-9).floor() as i64);
        (first..=last).map(|i| (i as f64 * step, format!("{:.*}", digits, i as f64 * step))).collect()
    }
}

fn power(e: i32) -> String {
    match e {
        -2..=3 => format!("{}", 10f64.powi(e)),
        _ => format!("1e{e}"),
    }
}

/// A pair of axes on a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Plot<'a> {
    /// x, y, width, height of the area inside the axes.
    pub frame: [f64; 4],
    pub x: Axis<'a>,
    pub y: Axis<'a>,
}

impl Plot<'_> {
    /// Where a value lies on the sheet.
    pub fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [fx, fy, w, h] = self.frame;
        [fx + w * self.x.at(x), fy + h * (1.0 - self.y.at(y))]
    }

    /// Frame, ticks, words.
    pub fn axes(&self, svg: &mut Svg, title: &str) {
        let [fx, fy, w, h] = self.frame;
        for (v, word) in self.x.ticks() {
            let x = fx + w * self.x.at(v);
            svg.path(&[[x, fy], [x, fy + h]], false, line("#e4e4e4", 0.8));
            svg.text([x, fy + h + 15.0], 11.0, Anchor::Middle, &word);
        }
        for (v, word) in self.y.ticks() {
            let y = fy + h * (1.0 - self.y.at(v));
            svg.path(&[[fx, y], [fx + w, y]], false, line("#e4e4e4", 0.8));
            svg.text([fx - 6.0, y + 4.0], 11.0, Anchor::End, &word);
        }
        svg.rect(self.frame, line("#444444", 1.0));
        svg.text([fx + w / 2.0, fy + h + 34.0], 12.0, Anchor::Middle, self.x.label);
        svg.text_up([fx - 46.0, fy + h / 2.0], 12.0, self.y.label);
        svg.text([fx + w / 2.0, fy - 10.0], 13.0, Anchor::Middle, title);
    }

    /// A chain of lines through values; what lies outside is cut off.
    pub fn line(&self, svg: &mut Svg, values: &[[f64; 2]], pen: Pen<'_>) {
        let points: Vec<_> = values.iter().map(|v| self.place(*v)).collect();
        svg.clipped(self.frame, |svg| svg.path(&points, false, pen));
    }

    /// Points.
    pub fn dots(&self, svg: &mut Svg, values: &[[f64; 2]], radius: f64, colour: &str) {
        svg.clipped(self.frame, |svg| {
            for v in values {
                svg.circle(self.place(*v), radius, filled(colour));
            }
        });
    }

    /// Bars of ± error at values.
    pub fn bars(&self, svg: &mut Svg, values: &[[f64; 2]], errors: &[f64], colour: &str) {
        svg.clipped(self.frame, |svg| {
            for (v, e) in values.iter().zip(errors) {
                let ends = [self.place([v[0], v[1] - e]), self.place([v[0], v[1] + e])];
                svg.path(&ends, false, line(colour, 1.0));
            }
        });
    }

    /// Names of the lines, from the corner `at` (0 to 1 in both directions, from the top left) down.
    pub fn legend(&self, svg: &mut Svg, at: [f64; 2], entries: &[(&str, Pen<'_>)]) {
        let [fx, fy, w, h] = self.frame;
        let (x, mut y) = (fx + w * at[0], fy + h * at[1]);
        let widest = entries.iter().map(|e| e.0.chars().count()).max().unwrap_or(0) as f64;
        let height = 15.0 * entries.len() as f64;
        svg.rect([x - 4.0, y - 9.0, 34.0 + 6.4 * widest, height + 4.0], filled("#ffffff"));
        for (words, pen) in entries {
            if pen.stroke.is_empty() {
                svg.circle([x + 11.0, y], 3.0, *pen);
            } else {
                svg.path(&[[x, y], [x + 22.0, y]], false, *pen);
            }
            svg.text([x + 27.0, y + 4.0], 11.0, Anchor::Start, words);
            y += 15.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let words = |low: f64, high: f64, log: bool| -> Vec<String> {
            Axis { low, high, log, label: "" }.ticks().into_iter().map(|t| t.1).collect()
        };
        assert_eq!(words(0.0, 1.0, false), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(words(0.5, 20000.0, true), ["1", "10", "100", "1000", "1e4"]);
        assert_eq!(words(1e-6, 1.0, true), ["1e-6", "1e-5", "1e-4", "1e-3", "0.01", "0.1", "1"]);
    }
}
