//! What the tests of the importer share.

use hemilux_scene::{LoadOptions, Loaded, Scene, load_pbrt_str};
use std::fs;
use std::path::{Path, PathBuf};

/// Load a text that must load.
pub fn loaded(text: &str) -> Loaded {
    load_pbrt_str(text, Path::new("."), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

/// Load the body of a world.
pub fn world(text: &str) -> Scene {
    loaded(&format!("WorldBegin\n{text}")).scene
}

/// The one-line forms of everything that was said.
pub fn said(loaded: &Loaded) -> Vec<String> {
    loaded.diagnostics.iter().map(|d| loaded.sources.one_line(d)).collect()
}

/// A directory of its own per test, removed at the end.
pub struct Scratch(pub PathBuf);

impl Scratch {
    /// A fresh, empty directory.
    pub fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("hemilux-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        Scratch(dir)
    }

    /// Write a file.
    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}
