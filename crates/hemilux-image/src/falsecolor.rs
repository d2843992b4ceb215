//! One quantity as colours, with a legend: luminance in cd/m², illuminance in lux, a channel of any unit.
//!
//! The default palette is even to the eye by construction: in Oklab (Ottosson, "A perceptual color space for image
//! processing", 2020) its lightness rises linearly from 0.14 to 0.97 while the hue turns from blue over red to yellow,
//! with nine tenths of the chroma the screen can show, at most 0.2. It prints in grey as well. The other palette is
//! the rainbow known from lighting tools: blue, cyan, green, yellow, red.

use crate::buffer::Image;
use crate::error::ImageError;
use crate::font::{self, ADVANCE, HEIGHT};
use crate::srgb;
use crate::tone::Rgb8;

/// From number to colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Palette {
    /// Dark blue, red, yellow; lightness rises linearly.
    #[default]
    Perceptual,
    /// Blue, cyan, green, yellow, red; familiar, but uneven to the eye.
    Spectral,
}

/// How values spread over the palette.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// From 0 to the maximum.
    Linear,
    /// This many powers of ten up to the maximum.
    Log {
        /// Positive, at most 30.
        decades: f32,
    },
}

/// What is shown and how.
#[derive(Clone, Debug, PartialEq)]
pub struct FalseColor {
    /// The channel; none for the luminance of the picture.
    pub channel: Option<String>,
    /// Values are multiplied by this first: 179 makes Radiance's luminance of radiance.
    pub factor: f32,
    /// From number to colour.
    pub palette: Palette,
    /// How values spread over the palette.
    pub scale: Scale,
    /// The value at the upper end; none for the 99.5th percentile rounded up to 1, 2 or 5 times a power of ten.
    pub max: Option<f32>,
    /// Written over the legend: `cd/m2`, `lux`, `W/m2`.
    pub units: String,
    /// Whether a legend is put to the left of the picture.
    pub legend: bool,
}

impl Default for FalseColor {
    fn default() -> Self {
        Self {
            channel: None,
            factor: 1.0,
            palette: Palette::default(),
            scale: Scale::Linear,
            max: None,
            units: String::new(),
            legend: true,
        }
    }
}

/// Values that are no number are shown in this grey, which is in neither palette.
pub const NOT_A_NUMBER: [u8; 3] = [128; 3];

/// Oklab to linear sRGB.
fn oklab_to_rgb([l, a, b]: [f64; 3]) -> [f64; 3] {
    let cone = [
        l + 0.396_337_777_4 * a + 0.215_803_757_3 * b,
        l - 0.105_561_345_8 * a - 0.063_854_172_8 * b,
        l - 0.089_484_177_5 * a - 1.291_485_548_0 * b,
    ];
    let m = [
        [4.076_741_662_1, -3.307_711_591_3, 0.230_969_929_2],
        [-1.268_438_004_6, 2.609_757_401_1, -0.341_319_396_5],
        [-0.004_196_086_3, -0.703_418_614_7, 1.707_614_701_0],
    ];
    srgb::mul(&m, cone.map(|v| v.powi(3)))
}

fn perceptual(t: f64) -> [f64; 3] {
    let (lightness, hue) = (0.14 + 0.83 * t, (270.0 + 190.0 * t).to_radians());
    let at = |chroma: f64| oklab_to_rgb([lightness, chroma * hue.cos(), chroma * hue.sin()]);
    let shown = |chroma: f64| at(chroma).iter().all(|v| (-1e-9..=1.0 + 1e-9).contains(v));
    let (mut low, mut high) = (0.0, 0.4);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if shown(middle) { low = middle } else { high = middle }
    }
    at((0.9 * low).min(0.2)).map(|v| v.clamp(0.0, 1.0))
}

impl Palette {
    /// The sRGB colour at `t` in 0..1 (cut outside); grey for NaN.
    #[must_use]
    pub fn colour(self, t: f32) -> [u8; 3] {
        if t.is_nan() {
            return NOT_A_NUMBER;
        }
        let t = t.clamp(0.0, 1.0);
        match self {
            Self::Perceptual => perceptual(f64::from(t)).map(|v| srgb::encode_u8(v as f32)),
            Self::Spectral => {
                // Each primary is a trapezium over the five knots.
                let ramp = |v: f32| (v.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
                let x = 4.0 * t;
                [ramp(x - 2.0), ramp(x.min(4.0 - x)), ramp(2.0 - x)]
            }
        }
    }

    fn table(self) -> Vec<[u8; 3]> {
        (0..=1023).map(|i| self.colour(i as f32 / 1023.0)).collect()
    }
}

impl Scale {
    fn place(self, value: f32, max: f32) -> f32 {
        match self {
            _ if value.is_nan() => f32::NAN,
            Self::Linear => value / max,
            Self::Log { decades } if value > 0.0 => 1.0 + (value / max).log10() / decades,
            Self::Log { .. } => 0.0,
        }
    }

    fn value(self, t: f32, max: f32) -> f32 {
        match self {
            Self::Linear => t * max,
            Self::Log { decades } => max * 10.0_f32.powf((t - 1.0) * decades),
        }
    }
}

/// The next of …, 0.1, 0.2, 0.5, 1, 2, 5, 10, … at or above a positive value.
fn round_up(value: f64) -> f64 {
    let power = 10.0_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|s| s * power);
    steps.into_iter().find(|s| *s >= value * (1.0 - 1e-6)).unwrap_or(10.0 * power)
}

/// At most three significant digits, without trailing zeros; exponents beyond 0.001 and 99999.
fn number(value: f32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(f64::from(value));
    if (0.001..99_999.5).contains(&rounded.abs()) { format!("{rounded}") } else { format!("{rounded:e}") }
}

impl FalseColor {
    /// The picture in false colours, with the legend to its left if there is room for one.
    ///
    /// # Errors
    /// No such channel, a maximum that is not positive, or decades out of range.
    pub fn render(&self, image: &Image) -> Result<Rgb8, ImageError> {
        image.check()?;
        if let Scale::Log { decades } = self.scale
            && !(decades > 0.0 && decades <= 30.0)
        {
            return Err(ImageError::unfit(format!("{decades} decades are not in 0..30")));
        }
        let values = self.values(image)?;
        let max = match self.max {
            Some(max) => max,
            None => automatic_max(&values),
        };
        if !(max > 0.0 && max.is_finite()) {
            return Err(ImageError::unfit(format!("the maximum {max} is not positive")));
        }
        let strip = if self.legend { self.legend_strip(image.height, max) } else { None };
        let left = strip.as_ref().map_or(0, |s| s.width);
        let mut out = Rgb8 {
            width: left + image.width,
            height: image.height,
            data: vec![0; 3 * (left + image.width) * image.height],
        };
        let table = self.palette.table();
        for (y, row) in values.chunks_exact(image.width).enumerate() {
            let start = 3 * y * out.width;
            if let Some(strip) = &strip {
                let line = &strip.data[3 * y * left..3 * (y + 1) * left];
                out.data[start..start + 3 * left].copy_from_slice(line);
            }
            for (x, v) in row.iter().enumerate() {
                let t = self.scale.place(*v, max);
                let colour = if t.is_nan() {
                    NOT_A_NUMBER
                } else {
                    table[(t.clamp(0.0, 1.0) * 1023.0 + 0.5) as usize]
                };
                let at = start + 3 * (left + x);
                out.data[at..at + 3].copy_from_slice(&colour);
            }
        }
        Ok(out)
    }

    fn values(&self, image: &Image) -> Result<Vec<f32>, ImageError> {
        let mut values = match &self.channel {
            Some(name) => {
                let found = image.channel(name);
                found.ok_or_else(|| ImageError::unfit(format!("no channel {name}")))?.to_vec()
            }
            None => {
                let mut linear = image.clone();
                linear.to_linear();
                linear.luminance().ok_or_else(|| ImageError::unfit("no R, G, B or Y for luminance"))?
            }
        };
        values.iter_mut().for_each(|v| *v *= self.factor);
        Ok(values)
    }

    /// Colours from bottom to top with numbers beside them and the unit above; none where there is no room.
    fn legend_strip(&self, height: usize, max: f32) -> Option<Rgb8> {
        let scale = (height / 360).max(1);
        let line = (HEIGHT + 4) * scale;
        let head = if self.units.is_empty() { line / 2 } else { line + line / 2 };
        let bar = height.checked_sub(head + line / 2).filter(|b| *b >= 2 * line)?;
        let labels = self.labels(bar / line, max);
        let letters = labels.iter().map(|(_, l)| l).chain([&self.units]).map(|l| l.chars().count()).max()?;
        let (margin, thick) = (4 * scale, 12 * scale);
        let width = (2 * margin + thick + letters * ADVANCE * scale + margin).max(thick);
        let mut strip = Rgb8 { width, height, data: vec![0; 3 * width * height] };
        for y in 0..bar {
            let t = 1.0 - (y as f32 + 0.5) / bar as f32;
            font::fill(&mut strip, margin, head + y, thick, 1, self.palette.colour(t));
        }
        let x = 2 * margin + thick;
        for (t, text) in &labels {
            let y = head + ((1.0 - t) * bar as f32).round() as usize;
            font::draw(&mut strip, text, x, y.saturating_sub(HEIGHT * scale / 2), scale, [255; 3]);
        }
        font::draw(&mut strip, &self.units, margin, scale, scale, [255; 3]);
        Some(strip)
    }

    /// Numbers with their places (0..1) on the bar, at most `room` and one: tenths, fifths, … of the maximum; on a
    /// logarithmic scale the maximum and what lies at least one line below it of 1, 2, 5 times the powers of ten.
    fn labels(&self, room: usize, max: f32) -> Vec<(f32, String)> {
        let Scale::Log { decades } = self.scale else {
            let steps = [10, 5, 4, 2, 1].into_iter().find(|s| *s <= room).unwrap_or(1);
            let place = |k: usize| k as f32 / steps as f32;
            return (0..=steps).map(|k| (place(k), number(self.scale.value(place(k), max)))).collect();
        };
        let (top, bottom) = (max.log10().floor() as i32, (max.log10() - decades).floor() as i32);
        let gap = 1.0 / room.max(1) as f32;
        let within = |digits: &[f64]| -> Vec<(f32, String)> {
            let round = (bottom..=top).flat_map(|n| digits.iter().map(move |d| d * 10.0_f64.powi(n)));
            let placed = round.map(|v| (self.scale.place(v as f32, max), number(v as f32)));
            placed.filter(|(t, _)| (-1e-5..=1.0 - gap).contains(t)).collect()
        };
        let fits = |l: &Vec<(f32, String)>| l.windows(2).all(|w| w[1].0 - w[0].0 >= gap);
        let lists = [within(&[1.0, 2.0, 5.0]), within(&[1.0])];
        let mut labels = lists.into_iter().find(fits).unwrap_or_default();
        labels.push((1.0, number(max)));
        labels
    }
}

/// The 99.5th percentile of the positive values, rounded up; 1 where there is none.
fn automatic_max(values: &[f32]) -> f32 {
    let mut positive: Vec<f32> = values.iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    if positive.is_empty() {
        return 1.0;
    }
    let index = ((positive.len() - 1) as f64 * 0.995).round() as usize;
    let (_, level, _) = positive.select_nth_unstable_by(index, f32::total_cmp);
    (round_up(f64::from(*level)) as f32).clamp(f32::MIN_POSITIVE, f32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_labels_are_round_numbers() {
        let at = |decades: f32, room: usize, max: f32| {
            let scale = FalseColor { scale: Scale::Log { decades }, ..FalseColor::default() };
            scale.labels(room, max).into_iter().map(|(_, text)| text).collect::<Vec<_>>()
        };
        assert_eq!(at(2.0, 20, 500.0), ["5", "10", "20", "50", "100", "200", "500"]);
        assert_eq!(at(3.0, 6, 500.0), ["1", "10", "100", "500"]);
        assert_eq!(at(30.0, 6, 1.0), ["1"]);
    }

    #[test]
    fn numbers_are_short_and_rounded_up_in_1_2_5() {
        let got = [0.0, 1.0, 0.2, 1234.0, 0.05, 250_000.0, 1e-5, 99_999.9, 1e-30].map(number);
        assert_eq!(got, ["0", "1", "0.2", "1230", "0.05", "2.5e5", "1e-5", "1e5", "1e-30"]);
        for (v, want) in [(1.0, 1.0), (1.01, 2.0), (3.0, 5.0), (5.1, 10.0), (0.011, 0.02), (700.0, 1000.0)] {
            assert!((round_up(v) / want - 1.0).abs() < 1e-9, "{v}");
        }
    }
}
