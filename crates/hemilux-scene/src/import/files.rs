//! Reading the files of one load: a budget of bytes and files, gzip by magic number, the hash of everything read.

use crate::{SourceFile, SourceMap, Span};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

/// Files one load may open; an include that doubles itself ends here.
pub const MAX_FILES: usize = 100_000;

/// 64-bit FNV-1a.
#[derive(Clone, Copy, Debug)]
pub struct Fnv(pub u64);

impl Default for Fnv {
    fn default() -> Self {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    /// Hash further bytes, their number first, so that the cut between files counts.
    pub fn write(&mut self, bytes: &[u8]) {
        for &b in (bytes.len() as u64).to_le_bytes().iter().chain(bytes) {
            self.0 = (self.0 ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// The files of one load.
#[derive(Debug)]
pub struct Files {
    /// For spans.
    pub sources: SourceMap,
    /// What was read, in order of first use.
    pub paths: Vec<PathBuf>,
    /// Of the contents as decompressed.
    pub hash: Fnv,
    /// Where relative names are looked up first: the directory of the scene file.
    pub base: PathBuf,
    /// Bytes that may still be read.
    budget: u64,
    opened: usize,
}

impl Files {
    /// Nothing read yet; at most `budget` bytes to come.
    pub fn new(base: PathBuf, budget: u64) -> Self {
        let (sources, paths, hash) = Default::default();
        Files { sources, paths, hash, base, budget, opened: 0 }
    }

    /// A source of which spans may speak.
    pub fn add_source(&mut self, path: PathBuf, text: String, included_from: Option<Span>) -> u32 {
        self.sources.files.push(SourceFile { path, text, included_from });
        self.sources.files.len() as u32 - 1
    }

    /// The path a file's text names: absolute, or relative to the scene, or else to the file that names it.
    pub fn resolve(&self, name: &str, from: u32) -> PathBuf {
        let path = Path::new(name);
        let first = self.base.join(path);
        if path.is_absolute() || first.exists() {
            return first;
        }
        let beside =
            self.sources.files.get(from as usize).and_then(|f| f.path.parent()).map(|d| d.join(path));
        match beside {
            Some(p) if p.exists() => p,
            _ => first,
        }
    }

    /// Whether no further file may be opened.
    pub fn exhausted(&self) -> bool {
        self.opened >= MAX_FILES
    }

    /// The bytes of a file, decompressed if gzipped; the error is half a sentence ("no such file").
    pub fn read(&mut self, path: &Path) -> Result<Vec<u8>, String> {
        if self.exhausted() {
            return Err(format!("more than {MAX_FILES} files"));
        }
        self.opened += 1;
        // A device or a pipe could wait for ever.
        let kind = std::fs::metadata(path).map_err(|e| explain(&e))?;
        if kind.is_dir() {
            return Err("is a directory".into());
        }
        if !kind.is_file() {
            return Err("is not a regular file".into());
        }
        let file = File::open(path).map_err(|e| explain(&e))?;
        let mut bytes = Vec::new();
        file.take(self.budget.saturating_add(1)).read_to_end(&mut bytes).map_err(|e| explain(&e))?;
        self.charge(bytes.len())?;
        if bytes.starts_with(&[0x1f, 0x8b]) {
            bytes = self.gunzip(&bytes)?;
        }
        self.hash.write(&bytes);
        if !self.paths.iter().rev().take(64).any(|p| p == path) {
            self.paths.push(path.to_owned());
        }
        Ok(bytes)
    }

    fn charge(&mut self, bytes: usize) -> Result<(), String> {
        if bytes as u64 > self.budget {
            return Err("too large for the memory limit".into());
        }
        self.budget -= bytes as u64;
        Ok(())
    }

    /// Decompress within the budget.
    fn gunzip(&mut self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let mut out = Vec::new();
        flate2::read::MultiGzDecoder::new(bytes)
            .take(self.budget.saturating_add(1))
            .read_to_end(&mut out)
            .map_err(|e| match e.kind() {
                std::io::ErrorKind::UnexpectedEof => "truncated gzip data".to_owned(),
                _ => "corrupt gzip data".to_owned(),
            })?;
        self.charge(out.len())?;
        Ok(out)
    }
}

/// What the system says, in our words where they are clearer.
fn explain(e: &std::io::Error) -> String {
    match e.kind() {
        std::io::ErrorKind::NotFound => "no such file".into(),
        std::io::ErrorKind::PermissionDenied => "permission denied".into(),
        std::io::ErrorKind::IsADirectory => "is a directory".into(),
        _ => e.to_string(),
    }
}

/// Bytes of memory of this machine; 8 GiB where it cannot be told.
pub fn physical_memory() -> u64 {
    std::fs::read_to_string("/proc/meminfo")
        .ok()
        .and_then(|text| {
            let line = text.lines().find(|l| l.starts_with("MemTotal:"))?.to_owned();
            line.split_whitespace().nth(1)?.parse::<u64>().ok()
        })
        .map_or(8 << 30, |kib| kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_sees_the_cut() {
        let hash = |parts: &[&str]| {
            let mut h = Fnv::default();
            parts.iter().for_each(|p| h.write(p.as_bytes()));
            h.0
        };
        assert_ne!(hash(&["ab", "c"]), hash(&["a", "bc"]));
        assert_eq!(hash(&["ab", "c"]), hash(&["ab", "c"]));
        // Published test vector of FNV-1a over "a", by hand without the length.
        assert_eq!((Fnv::default().0 ^ 0x61).wrapping_mul(0x0100_0000_01b3), 0xaf63_dc4c_8601_ec8c);
    }
}
