//! Portable float map: `PF` (colour) or `Pf` (grey), width, height, a scale whose sign is the byte order (negative =
//! little endian), then rows of 32-bit floats from the bottom up.
//!
//! The size of the scale has no agreed meaning; it is not applied, but kept as metadata `PFM_SCALE` when it is not 1.

use std::io::{self, Write};

use crate::buffer::Image;
use crate::error::{ImageError, checked_size};

const FORMAT: &str = "PFM";

pub(crate) struct Header {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) colour: bool,
    scale: f64,
    data: usize,
}

pub(crate) fn header(bytes: &[u8]) -> Result<Header, ImageError> {
    let bad = |what: &str| ImageError::malformed(FORMAT, what);
    let colour = match bytes.get(..2) {
        Some(b"PF") => true,
        Some(b"Pf") => false,
        _ => return Err(bad("it does not begin with PF or Pf")),
    };
    let mut at = 2;
    let mut word = || {
        let start = at + bytes.get(at..)?.iter().position(|b| !b.is_ascii_whitespace())?;
        let end = start + bytes.get(start..)?.iter().take(64).position(u8::is_ascii_whitespace)?;
        if start == at {
            return None;
        }
        at = end;
        std::str::from_utf8(&bytes[start..end]).ok()
    };
    let width: u64 = word().and_then(|w| w.parse().ok()).ok_or_else(|| bad("no width"))?;
    let height: u64 = word().and_then(|w| w.parse().ok()).ok_or_else(|| bad("no height"))?;
    let scale: f64 = word().and_then(|w| w.parse().ok()).ok_or_else(|| bad("no scale"))?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(bad("the scale is zero or not finite"));
    }
    checked_size(FORMAT, width, height, if colour { 3 } else { 1 })?;
    // Exactly one white-space byte ends the header; what follows may look like white space and be data.
    Ok(Header { width: width as usize, height: height as usize, colour, scale, data: at + 1 })
}

/// Reads a PFM.
///
/// # Errors
/// A bad header, too large a picture, or fewer bytes than the header promises.
pub fn decode(bytes: &[u8]) -> Result<Image, ImageError> {
    let header = header(bytes)?;
    let names: &[&str] = if header.colour { &["R", "G", "B"] } else { &["Y"] };
    let row = header.width * names.len() * 4;
    let data = bytes.get(header.data..).unwrap_or(&[]);
    let needed = row * header.height;
    if data.len() < needed {
        let what = format!("{} bytes of pixels where {needed} are needed", data.len());
        return Err(ImageError::malformed(FORMAT, what));
    }
    let float = if header.scale < 0.0 { f32::from_le_bytes } else { f32::from_be_bytes };
    let mut image = Image::new(header.width, header.height);
    for (c, name) in names.iter().enumerate() {
        let mut plane = Vec::with_capacity(image.len());
        for line in data[..needed].chunks_exact(row).rev() {
            let values = line.as_chunks::<4>().0;
            plane.extend(values.iter().skip(c).step_by(names.len()).map(|v| float(*v)));
        }
        image.set_channel(name, plane);
    }
    if header.scale.abs() != 1.0 {
        image.set_metadata("PFM_SCALE", header.scale.abs().to_string());
    }
    Ok(image)
}

/// Writes the picture (see [`Image::rgb`]) as a little-endian PFM; grey when all there is is one grey channel. Other
/// channels and metadata have no place in the format.
///
/// # Errors
/// No picture among the channels, or the writer fails.
pub fn encode(image: &Image, out: &mut impl Write) -> Result<(), ImageError> {
    image.check()?;
    let planes = image.rgb().ok_or_else(|| ImageError::unfit("no R, G, B or Y to write as PFM"))?;
    let grey = std::ptr::eq(planes[0], planes[1]);
    let planes = if grey { &planes[..1] } else { &planes[..] };
    writeln!(out, "{}\n{} {}\n-1.0", if grey { "Pf" } else { "PF" }, image.width, image.height)?;
    let mut line = Vec::with_capacity(image.width * planes.len() * 4);
    for y in (0..image.height).rev() {
        line.clear();
        for x in 0..image.width {
            for plane in planes {
                line.extend(plane[y * image.width + x].to_le_bytes());
            }
        }
        out.write_all(&line)?;
    }
    Ok::<(), io::Error>(out.flush()?).map_err(ImageError::from)
}
