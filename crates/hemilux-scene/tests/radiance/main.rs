//! Radiance scenes: what they become, and what broken ones earn.

mod broken;
mod contents;

use std::fs;
use std::path::PathBuf;

/// A directory of its own per test, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    /// A fresh, empty directory.
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("hemilux-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        Scratch(dir)
    }

    /// Write a file.
    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
