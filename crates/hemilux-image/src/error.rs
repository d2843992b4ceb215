//! What can go wrong with a picture, as a value: which file, and why.

use std::fmt;
use std::path::{Path, PathBuf};

/// A failed read, write or comparison: the file, when there is one, and the reason.
#[derive(Debug, thiserror::Error)]
pub struct ImageError {
    /// The file concerned; none for pictures in memory.
    pub path: Option<PathBuf>,
    /// Why it failed.
    #[source]
    pub reason: Reason,
}

/// Why a read, write or comparison failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Reason {
    /// The operating system refused: not found, no permission, disk full.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The bytes are not a valid file of the format.
    #[error("not a valid {format} file: {what}")]
    Malformed {
        /// Name of the format.
        format: &'static str,
        /// What is wrong.
        what: String,
    },
    /// Neither the first bytes nor the extension tell a known format.
    #[error("unknown image format (known: exr, hdr, pic, pfm, png, jpg, jpeg, tga)")]
    UnknownFormat,
    /// Valid perhaps, but beyond what is implemented.
    #[error("{0}")]
    Unsupported(String),
    /// The header promises more than the reader accepts.
    #[error("{width} x {height} pixels with {channels} channels are more than the limit of {pixels} pixels or {values} values", pixels = crate::MAX_PIXELS, values = crate::MAX_VALUES)]
    TooLarge {
        /// Width in pixels.
        width: u64,
        /// Height in pixels.
        height: u64,
        /// Number of channels.
        channels: u64,
    },
    /// The picture cannot be written, or two pictures cannot be compared, as they are.
    #[error("{0}")]
    Unfit(String),
}

impl fmt::Display for ImageError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.path {
            Some(path) => write!(f, "{}: {}", path.display(), self.reason),
            None => self.reason.fmt(f),
        }
    }
}

impl ImageError {
    pub(crate) fn malformed(format: &'static str, what: impl Into<String>) -> Self {
        Reason::Malformed { format, what: what.into() }.into()
    }

    pub(crate) fn unfit(what: impl Into<String>) -> Self {
        Reason::Unfit(what.into()).into()
    }

    pub(crate) fn unsupported(what: impl Into<String>) -> Self {
        Reason::Unsupported(what.into()).into()
    }

    /// The same error, told to be about `path`.
    #[must_use]
    pub fn at(mut self, path: &Path) -> Self {
        self.path = Some(path.to_owned());
        self
    }
}

impl From<Reason> for ImageError {
    fn from(reason: Reason) -> Self {
        Self { path: None, reason }
    }
}

impl From<std::io::Error> for ImageError {
    fn from(error: std::io::Error) -> Self {
        Reason::Io(error).into()
    }
}

/// The number of pixels, when a picture of this size may be allocated; dimensions of zero are malformed.
pub(crate) fn checked_size(
    format: &'static str,
    width: u64,
    height: u64,
    channels: u64,
) -> Result<usize, ImageError> {
    if width == 0 || height == 0 {
        return Err(ImageError::malformed(format, format!("empty picture ({width} x {height})")));
    }
    let pixels = width.checked_mul(height).filter(|&n| n <= crate::MAX_PIXELS as u64);
    let values = pixels.and_then(|n| n.checked_mul(channels)).filter(|&n| n <= crate::MAX_VALUES as u64);
    match (pixels, values) {
        (Some(pixels), Some(_)) => Ok(pixels as usize),
        _ => Err(Reason::TooLarge { width, height, channels }.into()),
    }
}
