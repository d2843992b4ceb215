//! Radiance pictures (`.hdr`, `.pic`): three mantissas of 8 bits with a common exponent (Ward, "Real pixels",
//! Graphics Gems II, 1991).
//!
//! Reading understands flat pixels, the old run-length code (a pixel 1,1,1,n repeats the last one) and the new one
//! (scanlines by component), the eight orders of scanlines, and the header lines `FORMAT=`, `EXPOSURE=` and
//! `COLORCORR=` (multiplied up), `PRIMARIES=` and `VIEW=`. Pixels are returned as stored: divide by the exposure with
//! [`undo_exposure`] for radiance. XYZE pictures are converted to RGB in watts: their luminance is in cd/m², and
//! Radiance's white efficacy is 179 lm/W.
//!
//! A value m is stored as 256 m 2^-e rounded down and read back in the middle of its step, as Radiance does, so that
//! the mean keeps; the error is at most 1/256 of the largest component.

use std::io::Write;

use crate::buffer::Image;
use crate::error::{ImageError, checked_size};
use crate::srgb;

const FORMAT: &str = "Radiance HDR";

/// Lumens per watt of white light, by which Radiance turns radiance into luminance.
pub const WHITE_EFFICACY: f64 = 179.0;

/// The primaries Radiance assumes where `PRIMARIES=` is missing: (x, y) of red, green, blue and equal-energy white.
pub const RADIANCE_XY: [[f64; 2]; 4] = [[0.64, 0.33], [0.29, 0.60], [0.15, 0.06], [1.0 / 3.0, 1.0 / 3.0]];

const MAX_HEADER_LINES: usize = 100_000;
/// Scanlines of other lengths are not run-length coded in the new way.
const RLE_WIDTHS: std::ops::RangeInclusive<usize> = 8..=0x7fff;

/// What the lines before the pixels say.
pub(crate) struct Header {
    pub(crate) width: usize,
    pub(crate) height: usize,
    metadata: Vec<(String, String)>,
    xyze: bool,
    order: Order,
    data: usize,
}

/// How the scanlines run over the picture.
#[derive(Clone, Copy)]
struct Order {
    /// Scanlines are columns.
    columns: bool,
    /// x falls along the file (`-X`).
    mirror_x: bool,
    /// y grows along the file (`+Y`): the bottom row comes first.
    mirror_y: bool,
}

fn malformed(what: impl Into<String>) -> ImageError {
    ImageError::malformed(FORMAT, what)
}

fn line<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a [u8]> {
    let rest = bytes.get(*at..)?;
    let end = rest.iter().position(|&b| b == b'\n')?;
    *at += end + 1;
    Some(rest[..end].strip_suffix(b"\r").unwrap_or(&rest[..end]))
}

pub(crate) fn header(bytes: &[u8]) -> Result<Header, ImageError> {
    if !bytes.starts_with(b"#?") {
        return Err(malformed("it does not begin with #?"));
    }
    let mut at = 0;
    line(bytes, &mut at).ok_or_else(|| malformed("the header has no end"))?;
    let mut metadata: Vec<(String, String)> = Vec::new();
    let (mut xyze, mut exposure, mut correction) = (false, None, None);
    for count in 0.. {
        let text = line(bytes, &mut at).ok_or_else(|| malformed("the header has no end"))?;
        if text.is_empty() {
            break;
        }
        if count > MAX_HEADER_LINES {
            return Err(malformed("the header is too long"));
        }
        let text = String::from_utf8_lossy(text);
        let Some((key, value)) = text.split_once('=').filter(|(k, _)| is_key(k)) else {
            // Command lines of the programs that made the picture.
            metadata
                .push((if text.starts_with('#') { "COMMENT" } else { "COMMAND" }.into(), text.into_owned()));
            continue;
        };
        let value = value.trim();
        match key {
            "FORMAT" => match value {
                "32-bit_rle_rgbe" => xyze = false,
                "32-bit_rle_xyze" => xyze = true,
                other => return Err(ImageError::unsupported(format!("Radiance format {other}"))),
            },
            "EXPOSURE" => {
                let [factor] = numbers(value).ok_or_else(|| malformed(format!("EXPOSURE={value}")))?;
                exposure = Some(exposure.unwrap_or(1.0) * factor);
            }
            "COLORCORR" => {
                let factor: [f64; 3] =
                    numbers(value).ok_or_else(|| malformed(format!("COLORCORR={value}")))?;
                let old = correction.unwrap_or([1.0; 3]);
                correction = Some(std::array::from_fn(|i| old[i] * factor[i]));
            }
            _ => metadata.push((key.to_owned(), value.to_owned())),
        }
    }
    if let Some(factor) = exposure.filter(|f: &f64| f.is_finite() && *f > 0.0) {
        metadata.push(("EXPOSURE".to_owned(), factor.to_string()));
    } else if exposure.is_some() {
        return Err(malformed("the exposure is not a positive number"));
    }
    if let Some([r, g, b]) = correction {
        metadata.push(("COLORCORR".to_owned(), format!("{r} {g} {b}")));
    }
    let text = line(bytes, &mut at).ok_or_else(|| malformed("no resolution line"))?;
    let text = std::str::from_utf8(text).map_err(|_| malformed("the resolution line is not text"))?;
    let (width, height, order) =
        resolution(text).ok_or_else(|| malformed(format!("resolution line {text:?}")))?;
    checked_size(FORMAT, width, height, 3)?;
    Ok(Header { width: width as usize, height: height as usize, metadata, xyze, order, data: at })
}

fn is_key(key: &str) -> bool {
    !key.is_empty() && key.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
}

/// Exactly `N` finite numbers.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let values: Vec<f64> = text.split_whitespace().map(|w| w.parse().ok()).collect::<Option<_>>()?;
    values.try_into().ok().filter(|a: &[f64; N]| a.iter().all(|v| v.is_finite()))
}

fn resolution(text: &str) -> Option<(u64, u64, Order)> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let [first, n, second, m] = words[..] else { return None };
    let (n, m): (u64, u64) = (n.parse().ok()?, m.parse().ok()?);
    let (columns, x, y) = match (first.get(1..)?, second.get(1..)?) {
        ("Y", "X") => (false, second, first),
        ("X", "Y") => (true, first, second),
        _ => return None,
    };
    let sign = |word: &str| match word.as_bytes()[0] {
        b'+' => Some(true),
        b'-' => Some(false),
        _ => None,
    };
    let order = Order { columns, mirror_x: !sign(x)?, mirror_y: sign(y)? };
    Some(if columns { (n, m, order) } else { (m, n, order) })
}

/// Reads a Radiance picture. The factor of `EXPOSURE` lines is in the metadata, not divided out.
///
/// # Errors
/// A bad header, too large a picture, or pixels that end early or overrun their scanline.
pub fn decode(bytes: &[u8]) -> Result<Image, ImageError> {
    let header = header(bytes)?;
    let Header { width, height, order, .. } = header;
    let (length, lines) = if order.columns { (height, width) } else { (width, height) };
    let mut data = bytes.get(header.data..).unwrap_or(&[]);
    // Every scanline begins with a pixel of its own or a mark of the same length.
    if data.len() / 4 < lines {
        return Err(malformed(format!("{} bytes cannot hold {lines} scanlines", data.len())));
    }
    let mut planes = [vec![0.0_f32; width * height], vec![0.0; width * height], vec![0.0; width * height]];
    let mut scanline = vec![[0_u8; 4]; length];
    let to_rgb = if header.xyze { Some(xyz_to_rgb(&header)?) } else { None };
    for l in 0..lines {
        read_scanline(&mut data, &mut scanline)
            .ok_or_else(|| malformed(format!("scanline {l} of {lines} is damaged or cut off")))?;
        for (i, pixel) in scanline.iter().enumerate() {
            let (x, y) = if order.columns { (l, i) } else { (i, l) };
            let x = if order.mirror_x { width - 1 - x } else { x };
            let y = if order.mirror_y { height - 1 - y } else { y };
            let mut value = unpack(*pixel);
            if let Some(m) = &to_rgb {
                value = srgb::mul(m, value.map(f64::from)).map(|v| v as f32);
            }
            for (plane, v) in planes.iter_mut().zip(value) {
                plane[y * width + x] = v;
            }
        }
    }
    let mut image = Image::new(width, height);
    for (name, plane) in ["R", "G", "B"].into_iter().zip(planes) {
        image.set_channel(name, plane);
    }
    image.metadata = header.metadata;
    Ok(image)
}

fn xyz_to_rgb(header: &Header) -> Result<[[f64; 3]; 3], ImageError> {
    let given = header.metadata.iter().rev().find(|(k, _)| k == "PRIMARIES").map(|(_, v)| v);
    let xy = match given {
        None => RADIANCE_XY,
        Some(text) => {
            let v: [f64; 8] = numbers(text).ok_or_else(|| malformed(format!("PRIMARIES={text}")))?;
            std::array::from_fn(|i| [v[2 * i], v[2 * i + 1]])
        }
    };
    let m = srgb::rgb_to_xyz(xy).and_then(|m| srgb::invert(&m));
    let m = m.ok_or_else(|| malformed("the primaries span no colour space"))?;
    Ok(m.map(|row| row.map(|v| v / WHITE_EFFICACY)))
}

fn byte(data: &mut &[u8]) -> Option<u8> {
    data.split_off_first().copied()
}

fn pixel(data: &mut &[u8]) -> Option<[u8; 4]> {
    data.split_off(..4)?.try_into().ok()
}

fn read_scanline(data: &mut &[u8], out: &mut [[u8; 4]]) -> Option<()> {
    let new =
        RLE_WIDTHS.contains(&out.len()) && data.len() >= 4 && data[..2] == [2, 2] && data[2] & 0x80 == 0;
    if !new {
        return read_old(data, out);
    }
    let start = pixel(data)?;
    if usize::from(start[2]) << 8 | usize::from(start[3]) != out.len() {
        return None;
    }
    for component in 0..4 {
        let mut at = 0;
        while at < out.len() {
            let code = byte(data)?;
            let (count, run) = if code > 128 { (code - 128, true) } else { (code, false) };
            let slots = out.get_mut(at..at + usize::from(count))?;
            if run {
                let value = byte(data)?;
                slots.iter_mut().for_each(|p| p[component] = value);
            } else {
                let values = data.split_off(..usize::from(count))?;
                slots.iter_mut().zip(values).for_each(|(p, v)| p[component] = *v);
            }
            at += usize::from(count);
            // A count of zero would not advance.
            if count == 0 {
                return None;
            }
        }
    }
    Some(())
}

/// Flat pixels with runs: 1,1,1,n repeats the last pixel n times, and next to another such pixel n·256 times, …
fn read_old(data: &mut &[u8], out: &mut [[u8; 4]]) -> Option<()> {
    let (mut at, mut shift) = (0, 0);
    while at < out.len() {
        let p = pixel(data)?;
        if p[..3] == [1, 1, 1] {
            let count = usize::from(p[3]).checked_shl(shift).filter(|_| shift <= 24)?;
            let last = *out.get(at.checked_sub(1)?)?;
            out.get_mut(at..at.checked_add(count)?)?.fill(last);
            at += count;
            shift += 8;
        } else {
            out[at] = p;
            at += 1;
            shift = 0;
        }
    }
    Some(())
}

/// Four bytes to three values; exponent 0 is black.
#[must_use]
pub fn unpack([r, g, b, e]: [u8; 4]) -> [f32; 3] {
    if e == 0 {
        return [0.0; 3];
    }
    let step = 2.0_f64.powi(i32::from(e) - 136);
    [r, g, b].map(|m| ((f64::from(m) + 0.5) * step) as f32)
}

/// Three values to four bytes. NaN and negative values are stored as 0, values beyond the range as the largest
/// (1.7·10³⁸), a pixel below 10⁻³⁸ as black.
#[must_use]
pub fn pack(rgb: [f32; 3]) -> [u8; 4] {
    let rgb = rgb.map(|v| f64::from(v.clamp(0.0, f32::MAX)));
    let rgb = rgb.map(|v| if v.is_nan() { 0.0 } else { v });
    let largest = rgb.into_iter().fold(0.0, f64::max);
    if largest < 1e-38 {
        return [0; 4];
    }
    // largest = mantissa · 2^exponent with the mantissa in [1/2, 1), exactly.
    let exponent = ((largest.to_bits() >> 52) as i32 - 1022).min(127);
    let scale = 2.0_f64.powi(8 - exponent);
    let [r, g, b] = rgb.map(|v| (v * scale).min(255.0) as u8);
    [r, g, b, (exponent + 128) as u8]
}

/// Divides the picture by the `EXPOSURE` and `COLORCORR` of its metadata and removes these, which gives back the
/// radiance (or luminance) that was rendered.
pub fn undo_exposure(image: &mut Image) {
    let exposure = image.metadata_value("EXPOSURE").and_then(numbers).map_or(1.0, |[v]: [f64; 1]| v);
    let correction = image.metadata_value("COLORCORR").and_then(numbers).unwrap_or([1.0; 3]);
    for (name, factor) in ["R", "G", "B"].into_iter().zip(correction.map(|c: f64| c * exposure)) {
        if factor > 0.0 && factor != 1.0 {
            let channel = image.channels.iter_mut().filter(|c| c.name == name);
            channel.flat_map(|c| &mut c.data).for_each(|v| *v = (f64::from(*v) / factor) as f32);
        }
    }
    image.metadata.retain(|(k, _)| k != "EXPOSURE" && k != "COLORCORR");
}

/// Writes the picture (see [`Image::rgb`]) in run-length coded RGBE, top row first. The metadata become header lines
/// `key=value`; keys and values that would break the header are made harmless.
///
/// # Errors
/// No picture among the channels, or the writer fails.
pub fn encode(image: &Image, out: &mut impl Write) -> Result<(), ImageError> {
    image.check()?;
    let [r, g, b] = image.rgb().ok_or_else(|| ImageError::unfit("no R, G, B or Y to write as HDR"))?;
    let mut text = String::from("#?RADIANCE\n");
    for (key, value) in &image.metadata {
        let value = value.replace(['\n', '\r'], " ");
        match key.as_str() {
            "FORMAT" => {}
            "COMMENT" | "COMMAND" => text += &format!("{}\n", if value.is_empty() { "#" } else { &value }),
            _ => {
                let good = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
                let key: String = key.chars().map(|c| if good(c) { c } else { '_' }).collect();
                text += &format!("{}={value}\n", if key.is_empty() { "_" } else { &key });
            }
        }
    }
    text += &format!("FORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", image.height, image.width);
    out.write_all(text.as_bytes())?;
    let mut coded = Vec::new();
    for y in 0..image.height {
        let row = y * image.width..(y + 1) * image.width;
        let pixels: Vec<[u8; 4]> = row.map(|i| pack([r[i], g[i], b[i]])).collect();
        coded.clear();
        encode_scanline(&pixels, &mut coded);
        out.write_all(&coded)?;
    }
    out.flush()?;
    Ok(())
}

fn encode_scanline(pixels: &[[u8; 4]], out: &mut Vec<u8>) {
    if !RLE_WIDTHS.contains(&pixels.len()) {
        out.extend(pixels.iter().flatten());
        return;
    }
    out.extend([2, 2, (pixels.len() >> 8) as u8, pixels.len() as u8]);
    let mut values = Vec::with_capacity(pixels.len());
    for component in 0..4 {
        values.clear();
        values.extend(pixels.iter().map(|p| p[component]));
        encode_runs(&values, out);
    }
}

/// Runs of at least 4 equal bytes as (128 + n, byte), what is between as (n, bytes…); a run shorter than 4 does not
/// pay for the break.
fn encode_runs(values: &[u8], out: &mut Vec<u8>) {
    let run_at = |i: usize| values[i..].iter().take(127).take_while(|v| **v == values[i]).count();
    let mut at = 0;
    while at < values.len() {
        let run = run_at(at);
        if run >= 4 {
            out.extend([128 + run as u8, values[at]]);
            at += run;
            continue;
        }
        let mut end = at + run;
        while end < values.len() && end - at < 128 && run_at(end) < 4 {
            end += 1;
        }
        let end = end.min(at + 128);
        out.push((end - at) as u8);
        out.extend(&values[at..end]);
        at = end;
    }
}
