//! `hemilux image`: comparing pictures, showing them, saying what they hold.

mod diff;
mod info;
mod show;

use crate::args::ImageVerb;
use crate::failure::Failure;
use hemilux_image::{Image, MAX_FILE_BYTES, read, read_bytes};
use std::io::Read;
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
    if path != Path::new("-") {
        return read(path).map_err(Failure::unreadable);
    }
    let mut bytes = Vec::new();
    let read = std::io::stdin().lock().take(MAX_FILE_BYTES).read_to_end(&mut bytes);
    read.map_err(|e| Failure::input(format!("standard input: {e}")))?;
    read_bytes(&bytes, None).map_err(|e| Failure::input(format!("standard input: {e}")))
}
