//! Writing a picture in the format of its extension, all or nothing.

use std::io::Write;
use std::path::Path;

use crate::buffer::Image;
use crate::error::ImageError;
use crate::read::Format;
use crate::{atomic, exr, hdr, pfm, png};

/// Writes `image` to `path` in the format of the extension, through [`atomic::write`].
///
/// # Errors
/// An extension that cannot be written, a picture the format cannot hold, or an I/O error; the old file is untouched
/// then. The error names the path.
pub fn write(path: impl AsRef<Path>, image: &Image) -> Result<(), ImageError> {
    let path = path.as_ref();
    let written = match Format::from_path(path) {
        Some(format) => atomic::write(path, |out| encode_to(image, format, out)),
        None => Err(crate::Reason::UnknownFormat.into()),
    };
    written.map_err(|e| e.at(path))
}

/// The bytes of a file in `format`.
///
/// # Errors
/// As [`encode_to`].
pub fn encode(image: &Image, format: Format) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    encode_to(image, format, &mut bytes)?;
    Ok(bytes)
}

/// Writes the bytes of a file in `format` to any writer, such as standard output.
///
/// # Errors
/// A format that is only read (JPEG, TGA), a picture the format cannot hold, or the writer fails.
pub fn encode_to(image: &Image, format: Format, out: &mut impl Write) -> Result<(), ImageError> {
    match format {
        Format::Exr => exr::encode(image, out),
        Format::Hdr => hdr::encode(image, out),
        Format::Pfm => pfm::encode(image, out),
        Format::Png => png::encode(image, out),
        Format::Jpeg | Format::Tga => Err(ImageError::unsupported(format!(
            "{format:?} is read but not written: use png, exr, hdr or pfm"
        ))),
    }
}
