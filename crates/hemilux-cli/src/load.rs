//! Scenes from files, with all there is to say about them.

use crate::failure::{Failure, Kind};
use crate::talk::Talk;
use hemilux_scene::{Camera, LoadError, LoadOptions, Loaded, Scene, load, load_pbrt_str};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Read a scene; what the importer says is printed.
pub fn scene(
    paths: &[PathBuf],
    defines: &[(String, String)],
    lenient: bool,
    talk: &Talk,
) -> Result<Scene, Failure> {
    Ok(loaded(paths, defines, lenient, talk)?.scene)
}

/// The same with the places that its spans speak of.
pub fn loaded(
    paths: &[PathBuf],
    defines: &[(String, String)],
    lenient: bool,
    talk: &Talk,
) -> Result<Loaded, Failure> {
    all(paths, defines, lenient, talk)
}

/// Read a scene as far as it can be read, with all there was to say and the places it was about.
pub fn checked(paths: &[PathBuf], defines: &[(String, String)], talk: &Talk) -> Result<Loaded, Failure> {
    all(paths, defines, true, talk)
}

fn all(
    paths: &[PathBuf],
    defines: &[(String, String)],
    lenient: bool,
    talk: &Talk,
) -> Result<Loaded, Failure> {
    let options = LoadOptions { lenient, defines: defines.to_vec(), memory_limit: None };
    let loaded = if paths.iter().any(|p| p == Path::new("-")) {
        if paths.len() > 1 {
            return Err(Failure::usage("standard input must be the only scene"));
        }
        let mut text = String::new();
        let read = std::io::stdin().lock().read_to_string(&mut text);
        read.map_err(|e| Failure::input(format!("standard input: {e}")))?;
        load_pbrt_str(&text, Path::new(""), &options).map(|l| renamed(l, Path::new("<stdin>")))
    } else {
        load(paths, &options)
    };
    said(loaded, talk)
}

/// The camera of a file that holds nothing else. Names it as the scene of its own that it is, so that the hash of the
/// scene proper, by which zonal solutions are recognised, does not depend on where one looks from.
pub fn camera(path: &Path, defines: &[(String, String)], talk: &Talk) -> Result<Camera, Failure> {
    let text =
        std::fs::read_to_string(path).map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
    let base = path.parent().unwrap_or(Path::new(""));
    let used = |d: &&(String, String)| {
        text.contains(&format!("${}", d.0)) || text.contains(&format!("${{{}}}", d.0))
    };
    let defines = defines.iter().filter(used).cloned().collect();
    let options = LoadOptions { lenient: false, defines, memory_limit: None };
    let loaded = load_pbrt_str(&format!("{text}\nWorldBegin\n"), base, &options);
    let loaded = match loaded {
        Ok(mut l) => {
            // A view has no luminaire.
            l.diagnostics.retain(|d| d.span.line > 0);
            Ok(renamed(l, path))
        }
        Err(mut e) => {
            if let Some(file) = e.sources.files.first_mut() {
                file.path = path.to_owned();
            }
            Err(e)
        }
    };
    let loaded = said(loaded, talk)?;
    let camera = loaded.scene.camera;
    if camera.span.line == 0 {
        return Err(Failure::input(format!("{}: a view needs a Camera directive", path.display())));
    }
    Ok(camera)
}

fn renamed(mut loaded: Loaded, name: &Path) -> Loaded {
    if let Some(file) = loaded.sources.files.first_mut() {
        file.path = name.to_owned();
    }
    loaded
}

fn said(loaded: Result<Loaded, LoadError>, talk: &Talk) -> Result<Loaded, Failure> {
    match loaded {
        Ok(loaded) => {
            talk.diagnostics(&loaded.diagnostics, &loaded.sources);
            Ok(loaded)
        }
        Err(error) => {
            talk.diagnostics(&error.diagnostics, &error.sources);
            Err(Failure::silent(Kind::Input))
        }
    }
}
