//! Drawings as SVG text: shapes, words, embedded pictures; [`plot`] has axes, [`chart`] unit squares, disks and hemispheres.
//!
//! Coordinates are in pixels, y down. Numbers are written with two decimals, so that equal drawings are equal bytes.

pub mod chart;
pub mod plot;

use hemilux_image::png;
use hemilux_image::tone::Rgb8;
use std::fmt::Write;

/// How a shape is drawn. Colours are SVG's; empty means none.
#[derive(Clone, Copy, Debug)]
pub struct Pen<'a> {
    /// Outline.
    pub stroke: &'a str,
    /// Width of the outline.
    pub width: f64,
    /// Inside.
    pub fill: &'a str,
    /// Lengths of dash and gap; (0, 0) for a solid line.
    pub dash: (f64, f64),
}

/// An outline only.
pub fn line(stroke: &str, width: f64) -> Pen<'_> {
    Pen { stroke, width, fill: "", dash: (0.0, 0.0) }
}

/// A dashed outline only.
pub fn dashed(stroke: &str, width: f64) -> Pen<'_> {
    Pen { dash: (4.0 * width + 1.0, 3.0 * width + 1.0), ..line(stroke, width) }
}

/// An inside only.
pub fn filled(fill: &str) -> Pen<'_> {
    Pen { stroke: "", width: 0.0, fill, dash: (0.0, 0.0) }
}

/// Where a word stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// A drawing in the making.
#[derive(Clone, Debug)]
pub struct Svg {
    width: f64,
    height: f64,
    body: String,
    clips: u32,
}

/// A number with at most two decimals.
struct Number(f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let v = (self.0 * 100.0).round() / 100.0;
        // No "-0", no NaN.
        if v == 0.0 || !v.is_finite() { f.write_str("0") } else { write!(f, "{v}") }
    }
}

impl Svg {
    /// An empty white sheet.
    pub fn new(width: f64, height: f64) -> Svg {
        let mut svg = Svg { width, height, body: String::new(), clips: 0 };
        svg.rect([0.0, 0.0, width, height], filled("#ffffff"));
        svg
    }

    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = self.body.write_fmt(text);
    }

    fn pen(&mut self, pen: Pen<'_>) {
        let none = |c: &str| if c.is_empty() { "none".to_string() } else { c.to_string() };
        self.put(format_args!(" fill=\"{}\"", none(pen.fill)));
        if !pen.stroke.is_empty() {
            self.put(format_args!(" stroke=\"{}\" stroke-width=\"{}\"", pen.stroke, Number(pen.width)));
        }
        if pen.dash.0 > 0.0 {
            self.put(format_args!(" stroke-dasharray=\"{} {}\"", Number(pen.dash.0), Number(pen.dash.1)));
        }
        self.body.push_str("/>\n");
    }

    /// A rectangle: x, y, width, height.
    pub fn rect(&mut self, [x, y, w, h]: [f64; 4], pen: Pen<'_>) {
        self.put(format_args!(
            "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"",
            Number(x),
            Number(y),
            Number(w),
            Number(h)
        ));
        self.pen(pen);
    }

    /// A circle.
    pub fn circle(&mut self, [x, y]: [f64; 2], r: f64, pen: Pen<'_>) {
        self.put(format_args!("<circle cx=\"{}\" cy=\"{}\" r=\"{}\"", Number(x), Number(y), Number(r)));
        self.pen(pen);
    }

    /// A chain of lines, closed or not.
    pub fn path(&mut self, points: &[[f64; 2]], closed: bool, pen: Pen<'_>) {
        if points.len() < 2 {
            return;
        }
        self.body.push_str("<path d=\"");
        for (i, p) in points.iter().enumerate() {
            let command = if i == 0 { 'M' } else { 'L' };
            self.put(format_args!("{command}{} {}", Number(p[0]), Number(p[1])));
        }
        self.body.push_str(if closed { "Z\"" } else { "\" stroke-linejoin=\"round\"" });
        self.pen(pen);
    }

    /// A word.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, words: &str) {
        self.write(x, y, size, anchor, 0.0, words);
    }

    /// A word that runs upwards.
    pub fn text_up(&mut self, [x, y]: [f64; 2], size: f64, words: &str) {
        self.write(x, y, size, Anchor::Middle, -90.0, words);
    }

    fn write(&mut self, x: f64, y: f64, size: f64, anchor: Anchor, turn: f64, words: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let turn = if turn == 0.0 {
            String::new()
        } else {
            format!(" transform=\"rotate({} {} {})\"", Number(turn), Number(x), Number(y))
        };
        self.put(format_args!(
            "<text x=\"{}\" y=\"{}\" font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"{}\" \
             text-anchor=\"{anchor}\" fill=\"#222222\"{turn}>{}</text>\n",
            Number(x),
            Number(y),
            Number(size),
            escaped(words)
        ));
    }

    /// A picture, stretched to x, y, width, height; its pixels stay squares.
    pub fn image(&mut self, [x, y, w, h]: [f64; 4], picture: &Rgb8) {
        let mut bytes = Vec::new();
        if png::encode_rgb8(picture, &[], &mut bytes).is_err() {
            return;
        }
        self.put(format_args!(
            "<image x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" \
             style=\"image-rendering:pixelated\" href=\"data:image/png;base64,{}\"/>\n",
            Number(x),
            Number(y),
            Number(w),
            Number(h),
            base64(&bytes)
        ));
    }

    /// Draws `body` cut off outside of a rectangle.
    pub fn clipped(&mut self, [x, y, w, h]: [f64; 4], body: impl FnOnce(&mut Svg)) {
        self.clips += 1;
        let id = self.clips;
        self.put(format_args!(
            "<clipPath id=\"c{id}\"><rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\"/></clipPath>\n\
             <g clip-path=\"url(#c{id})\">\n",
            Number(x),
            Number(y),
            Number(w),
            Number(h)
        ));
        body(self);
        self.body.push_str("</g>\n");
    }

    /// The file.
    pub fn finish(self) -> String {
        let (w, h) = (Number(self.width), Number(self.height));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{w}\" height=\"{h}\" viewBox=\"0 0 {w} {h}\">\n{}</svg>\n",
            self.body
        )
    }
}

fn escaped(words: &str) -> String {
    words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let all = chunk.iter().fold(0u32, |a, b| a << 8 | *b as u32) << (8 * (3 - chunk.len()));
        for i in 0..4 {
            let digit = DIGITS[(all >> (18 - 6 * i) & 63) as usize];
            text.push(if i <= chunk.len() { digit as char } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_rfc() {
        for (plain, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }

    #[test]
    fn words_cannot_break_out_and_numbers_are_plain() {
        let mut svg = Svg::new(10.0, 10.0);
        svg.text([1.0, -0.0001], 8.0, Anchor::Start, "a < b & \"c\"");
        svg.circle([1.0 / 3.0, f64::NAN], 2.0, line("#000000", 0.5));
        let text = svg.finish();
        assert!(text.contains("a &lt; b &amp; &quot;c&quot;") && text.contains("cx=\"0.33\" cy=\"0\""));
        assert!(text.contains("x=\"1\" y=\"0\"") && !text.contains("NaN"));
    }
}
