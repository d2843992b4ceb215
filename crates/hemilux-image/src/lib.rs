//! Pixels with metadata: what comes out of a render, what goes into a texture, and how far two pictures are apart.
//!
//! An [`Image`] is planar `f32` with named channels and ordered text metadata. [`read`](read::read) opens EXR,
//! Radiance HDR, PFM, PNG, JPEG and TGA; [`write`](write::write) makes EXR, HDR, PFM and PNG, always through
//! [`atomic::write`], so that a file is either the old one or the whole new one. [`tone`] and [`falsecolor`] turn
//! radiance into something to look at; [`metrics`] and [`flip`] say how different two pictures are.
//!
//! ```
//! use hemilux_image::{Format, Image, read_bytes, write::encode};
//!
//! let mut image = Image::from_rgb(2, 1, &[[0.5, 1.0, 2.0], [0.0, 0.25, 4.0]]);
//! image.set_metadata("seed", "7");
//! let bytes = encode(&image, Format::Exr)?;
//! let back = read_bytes(&bytes, None)?;
//! assert_eq!(back.rgb_at(1, 0), Some([0.0, 0.25, 4.0]));
//! assert_eq!(back.metadata_value("seed"), Some("7"));
//! # Ok::<(), hemilux_image::ImageError>(())
//! ```
//!
//! Invariants: nothing here panics on what a file holds; no header, however corrupt, makes a reader allocate for
//! more than [`MAX_PIXELS`] pixels or [`MAX_VALUES`] channel values.

pub mod atomic;
pub mod buffer;
pub mod error;
pub mod exr;
pub mod falsecolor;
pub mod flip;
mod font;
pub mod hdr;
pub mod metrics;
pub mod pfm;
pub mod png;
mod raster;
pub mod read;
pub mod srgb;
pub mod tone;
pub mod write;

pub use buffer::{Channel, Encoding, Image};
pub use error::{ImageError, Reason};
pub use read::{Format, probe, read, read_bytes};
pub use write::{encode, write};

/// The most pixels (width × height) a reader accepts: 2²⁸, a square of 16384.
pub const MAX_PIXELS: usize = 1 << 28;

/// The most channel values (width × height × channels, over all parts) a reader accepts: 2³⁰, that is 4 GiB of `f32`.
pub const MAX_VALUES: usize = 1 << 30;

/// The longest file a reader accepts: 2³² bytes.
pub const MAX_FILE_BYTES: u64 = 1 << 32;
