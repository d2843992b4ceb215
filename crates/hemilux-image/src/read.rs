//! Reading a picture of any known format, by its first bytes, or by the extension where these do not tell.

use std::fs::File;
use std::io::Read;
use std::path::Path;

use image::ImageFormat;

use crate::buffer::Image;
use crate::error::{ImageError, Reason};
use crate::{exr, hdr, pfm, png, raster};

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR.
    Exr,
    /// Radiance RGBE or XYZE.
    Hdr,
    /// Portable float map.
    Pfm,
    /// Portable network graphics.
    Png,
    /// JPEG; read only.
    Jpeg,
    /// Truevision TGA; read only.
    Tga,
}

impl Format {
    /// By the extension, whatever its case.
    #[must_use]
    pub fn from_path(path: &Path) -> Option<Self> {
        Self::from_extension(path.extension()?.to_str()?)
    }

    /// By the extension without its dot, whatever its case.
    #[must_use]
    pub fn from_extension(extension: &str) -> Option<Self> {
        Some(match extension.to_ascii_lowercase().as_str() {
            "exr" => Self::Exr,
            "hdr" | "pic" | "rgbe" | "xyze" => Self::Hdr,
            "pfm" => Self::Pfm,
            "png" => Self::Png,
            "jpg" | "jpeg" | "jpe" => Self::Jpeg,
            "tga" => Self::Tga,
            _ => return None,
        })
    }

    /// By the first bytes. TGA has no mark of its own.
    #[must_use]
    pub fn from_magic(bytes: &[u8]) -> Option<Self> {
        const MARKS: [(&[u8], Format); 6] = [
            (&[0x76, 0x2f, 0x31, 0x01], Format::Exr),
            (b"#?", Format::Hdr),
            (b"PF", Format::Pfm),
            (b"Pf", Format::Pfm),
            (b"\x89PNG\r\n\x1a\n", Format::Png),
            (&[0xff, 0xd8, 0xff], Format::Jpeg),
        ];
        MARKS.iter().find(|(mark, _)| bytes.starts_with(mark)).map(|(_, format)| *format)
    }
}

/// What a header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Summary {
    /// The format.
    pub format: Format,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The names of the picture's channels.
    pub channels: Vec<String>,
}

/// Reads a picture file.
///
/// # Errors
/// The file cannot be opened, is of no known format, damaged, or beyond the limits of this package. The error names
/// the path.
pub fn read(path: impl AsRef<Path>) -> Result<Image, ImageError> {
    let path = path.as_ref();
    load(path).and_then(|bytes| read_bytes(&bytes, Format::from_path(path))).map_err(|e| e.at(path))
}

/// Format, size and channels of a picture file, without decoding its pixels.
///
/// # Errors
/// As [`read`], as far as the header tells.
pub fn probe(path: impl AsRef<Path>) -> Result<Summary, ImageError> {
    let path = path.as_ref();
    load(path).and_then(|bytes| probe_bytes(&bytes, Format::from_path(path))).map_err(|e| e.at(path))
}

fn load(path: &Path) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    File::open(path)?.take(crate::MAX_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > crate::MAX_FILE_BYTES {
        return Err(ImageError::unsupported("files of more than 4 GiB are not read"));
    }
    Ok(bytes)
}

fn format(bytes: &[u8], hint: Option<Format>) -> Result<Format, ImageError> {
    // The bytes know better than a name, except for TGA, which may begin with anything.
    Format::from_magic(bytes).or(hint).ok_or_else(|| Reason::UnknownFormat.into())
}

/// Reads a picture from memory; `hint` says the format where the first bytes do not.
///
/// # Errors
/// As [`read`], without a path.
pub fn read_bytes(bytes: &[u8], hint: Option<Format>) -> Result<Image, ImageError> {
    let image = match format(bytes, hint)? {
        Format::Exr => exr::decode(bytes),
        Format::Hdr => hdr::decode(bytes),
        Format::Pfm => pfm::decode(bytes),
        Format::Png => guarded("PNG", || png::decode(bytes)),
        Format::Jpeg => guarded("JPEG", || raster::decode(bytes, ImageFormat::Jpeg)),
        Format::Tga => guarded("TGA", || raster::decode(bytes, ImageFormat::Tga)),
    }?;
    image.check()?;
    Ok(image)
}

/// Format, size and channels of a picture in memory.
///
/// # Errors
/// As [`probe`], without a path.
pub fn probe_bytes(bytes: &[u8], hint: Option<Format>) -> Result<Summary, ImageError> {
    let format = format(bytes, hint)?;
    let names = |list: &[&str]| list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
    let (width, height, channels) = match format {
        Format::Exr => exr::probe(bytes)?,
        Format::Hdr => {
            let h = hdr::header(bytes)?;
            (h.width, h.height, names(&["R", "G", "B"]))
        }
        Format::Pfm => {
            let h = pfm::header(bytes)?;
            (h.width, h.height, names(if h.colour { &["R", "G", "B"] } else { &["Y"] }))
        }
        Format::Png => guarded("PNG", || png::probe(bytes))?,
        Format::Jpeg => guarded("JPEG", || raster::probe(bytes, ImageFormat::Jpeg))?,
        Format::Tga => guarded("TGA", || raster::probe(bytes, ImageFormat::Tga))?,
    };
    Ok(Summary { format, width, height, channels })
}

/// Runs a decoder that is not ours; a panic in it becomes an error.
fn guarded<T>(format: &'static str, body: impl FnOnce() -> Result<T, ImageError>) -> Result<T, ImageError> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(body))
        .unwrap_or_else(|_| Err(ImageError::malformed(format, "the decoder failed")))
}
