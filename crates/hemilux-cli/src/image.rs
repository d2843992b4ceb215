//! `hemilux image`: comparing pictures, showing them, saying what they hold.

mod diff;
mod info;
mod show;

use crate::args::ImageVerb;
use crate::failure::Failure;
use hemilux_image::{Format, Image, ImageError, MAX_FILE_BYTES, read_bytes};
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

pub use info::run as info;

/// Dispatch.
pub fn run(verb: ImageVerb) -> Result<(), Failure> {
    match verb {
        ImageVerb::Diff(args) => diff::run(&args),
        ImageVerb::Tonemap(args) => show::tonemap(&args),
        ImageVerb::Falsecolor(args) => show::falsecolor(&args),
        ImageVerb::Info(args) => info::run(&args),
    }
}

/// A picture from a file, or from standard input by the name `-`.
fn open(path: &Path) -> Result<Image, Failure> {
    open_with_format(path).map(|o| o.0)
}

/// The same, with the format of the file.
fn open_with_format(path: &Path) -> Result<(Image, Option<Format>), Failure> {
    let failed = |e: ImageError| Failure::input(format!("{}: {}", name(path), e.reason));
    let bytes = bytes(path).map_err(|e| failed(e.into()))?;
    let format = Format::from_magic(&bytes).or(Format::from_path(path));
    Ok((read_bytes(&bytes, format).map_err(failed)?, format))
}

fn name(path: &Path) -> String {
    if path == Path::new("-") { "standard input".into() } else { path.display().to_string() }
}

fn bytes(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    if path == Path::new("-") {
        io::stdin().lock().take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    } else {
        File::open(path)?.take(MAX_FILE_BYTES).read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}
