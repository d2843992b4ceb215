//! Unfrozen octrees: the list of scene files in their header. The tree itself is not needed.
//!
//! A header of lines ends with an empty one and says `FORMAT=Radiance_octree`; then come a two-byte format number, the
//! cube as four strings and the scene files, each ended by a zero byte, an empty one after the last.

use super::{Context, Reader};
use crate::Span;

/// Longest string and most files that are read.
const MAX_STRING: usize = 4096;
const MAX_FILES: usize = 4096;
/// The format number without the bytes that an object's index takes.
const MAGIC: u32 = 283;

/// Whether the bytes begin like an octree.
pub fn is_octree(bytes: &[u8]) -> bool {
    bytes.starts_with(b"#?RADIANCE")
        && header(bytes).is_some_and(|(h, _)| h.contains("FORMAT=Radiance_octree"))
}

/// The header and where it ends.
fn header(bytes: &[u8]) -> Option<(String, usize)> {
    let end = bytes.windows(2).take(1 << 16).position(|w| w == b"\n\n")?;
    Some((String::from_utf8_lossy(&bytes[..end]).into_owned(), end + 2))
}

/// The scene files of an octree.
pub fn scene_files(bytes: &[u8]) -> Result<Vec<String>, &'static str> {
    let (text, mut at) = header(bytes).ok_or("the header of the octree has no end")?;
    if !text.contains("FORMAT=Radiance_octree") {
        return Err("not an octree: no FORMAT=Radiance_octree");
    }
    let magic = bytes.get(at..at + 2).ok_or("truncated octree")?;
    let number = u32::from(magic[0]) << 8 | u32::from(magic[1]);
    if !(MAGIC + 1..=MAGIC + 8).contains(&number) {
        return Err("an octree of an unknown version");
    }
    at += 2;
    let mut string = || {
        let rest = &bytes[at.min(bytes.len())..];
        let length = rest.iter().take(MAX_STRING).position(|b| *b == 0).ok_or("truncated octree")?;
        at += length + 1;
        Ok::<_, &'static str>(String::from_utf8_lossy(&rest[..length]).into_owned())
    };
    for _ in 0..4 {
        string()?.trim().parse::<f64>().map_err(|_| "the cube of the octree is not four numbers")?;
    }
    let mut files = Vec::new();
    loop {
        let name = string()?;
        if name.is_empty() {
            break;
        }
        if files.len() >= MAX_FILES {
            return Err("an octree of too many files");
        }
        files.push(name);
    }
    if files.is_empty() {
        return Err("a frozen octree is not supported: give the scene files it was made of");
    }
    Ok(files)
}

impl Reader {
    /// Read the scene files that an octree names.
    pub(super) fn read_octree(&mut self, bytes: &[u8], file: u32, context: &Context) {
        let span = Span { file, ..Span::default() };
        match scene_files(bytes) {
            Ok(files) => {
                for name in files {
                    match name.strip_prefix('!') {
                        Some(command) => self.run_text(command, span, context),
                        None => self.include(&name, span, context),
                    }
                }
            }
            Err(message) => self.env.log.error(span, message),
        }
    }
}
