//! Importers: files in, a [`Scene`] or diagnostics out.
//!
//! The pbrt-v4 importer is a loop over directives (`parser`) that drives a `Builder`; nothing recurses on what a file
//! contains. Limits, so that every input ends: 10,000 open blocks, 64 files inside one another, 100,000 files in all,
//! 20 errors, and a budget of bytes ([`LoadOptions::memory_limit`]) for what is read and for the film.
//!
//! Where this reader and pbrt-v4 part, it says so in a note or a warning: point luminaires become small spheres and
//! distant ones sun disks (nothing here is without extent); `power` of a mesh is that of the whole mesh; `illuminance`
//! of an environment map is met exactly; luminaires in object instances shine; media are ignored; sensors other than
//! `cie1931` and white balance are ignored.

mod area;
mod builder;
mod colour;
mod files;
mod finish;
mod lexer;
mod log;
mod params;
mod parser;
mod pbrt_camera;
mod pbrt_light;
mod pbrt_material;
mod pbrt_shape;
mod pbrt_texture;
pub mod ply;
mod radiance;
mod spectra;
mod suggest;
mod texture_file;
mod transform;
mod values;

use crate::{Diagnostic, Scene, SourceMap, Span};
use files::{Files, physical_memory};
use log::Log;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::path::{Path, PathBuf};
use std::rc::Rc;
pub(crate) use suggest::closest;

/// How to load.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// Skip what is not understood, with a warning.
    pub lenient: bool,
    /// `key=value` pairs. In a scene `$key` and `${key}` stand for the value, as a bare word or within a string. The key
    /// `light-radius` (metres) sets the radius of the spheres that stand for point luminaires.
    pub defines: Vec<(String, String)>,
    /// Bytes that files and film may take; `None`: 60% of the machine's memory.
    pub memory_limit: Option<u64>,
}

/// A scene and what there is to say about it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// Notes, warnings, and what `lenient` skipped.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that the spans speak of.
    pub sources: SourceMap,
}

/// Why there is no scene.
#[derive(Clone, Debug)]
pub struct LoadError {
    /// At least one error.
    pub diagnostics: Vec<Diagnostic>,
    /// The files that the spans speak of.
    pub sources: SourceMap,
}

impl fmt::Display for LoadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, d) in self.diagnostics.iter().enumerate() {
            if i > 0 {
                f.write_str("\n")?;
            }
            f.write_str(&self.sources.render(d))?;
        }
        Ok(())
    }
}

impl std::error::Error for LoadError {}

/// What everything that reads shares.
#[derive(Debug)]
struct Env {
    log: Log,
    files: RefCell<Files>,
    options: LoadOptions,
    used_defines: RefCell<Vec<bool>>,
    memory: u64,
    /// The length of what a define stood for so far; bounded.
    substituted: Cell<usize>,
}

impl Env {
    fn new(base: PathBuf, options: &LoadOptions) -> Self {
        let memory = options.memory_limit.unwrap_or_else(|| physical_memory() / 5 * 3);
        Env {
            log: Log::new(options.lenient),
            files: RefCell::new(Files::new(base, memory)),
            options: options.clone(),
            used_defines: RefCell::new(vec![false; options.defines.len()]),
            memory,
            substituted: Cell::new(0),
        }
    }

    fn resolve(&self, name: &str, from: u32) -> PathBuf {
        self.files.borrow().resolve(name, from)
    }

    fn read(&self, path: &Path) -> Result<Vec<u8>, String> {
        self.files.borrow_mut().read(path)
    }

    /// The value of a define; the last of equal keys counts.
    fn define(&self, key: &str) -> Option<&str> {
        let i = self.options.defines.iter().rposition(|d| d.0 == key)?;
        let mut used = self.used_defines.borrow_mut();
        for (j, d) in self.options.defines.iter().enumerate() {
            used[j] |= d.0 == key;
        }
        Some(&self.options.defines[i].1)
    }
}

/// Load one scene from one or several files.
///
/// The format is told by the extension: `.pbrt`, `.pbrt.gz`, or Radiance's `.rad`, `.rad.gz`, `.oct` and `.vf`.
///
/// Several pbrt files make one scene, as if concatenated, except that the options of all of them (what precedes
/// `WorldBegin`; the whole of a file that has no `WorldBegin` but a camera, film or the like) are read before any of
/// their worlds. Several Radiance files make one scene in their order; any of them may be a view (`.vf`, or a text whose
/// first line begins with `rvu` or `VIEW=`).
pub fn load(paths: &[PathBuf], options: &LoadOptions) -> Result<Loaded, LoadError> {
    let base = paths.first().and_then(|p| p.parent()).unwrap_or(Path::new("")).to_owned();
    let env = Rc::new(Env::new(base, options));
    let mut texts = Vec::new();
    if paths.is_empty() {
        env.log.error(Span::default(), "no scene file given");
    }
    for path in paths {
        let file = env.files.borrow_mut().add_source(path.clone(), String::new(), None);
        let span = Span { file, ..Span::default() };
        match read_scene_file(&env, path) {
            Ok(source) => texts.push((file, source)),
            Err(message) => env.log.error(span, message),
        }
    }
    import(env, texts)
}

/// Load a pbrt scene from a text; names in it are relative to `base_dir`.
pub fn load_pbrt_str(text: &str, base_dir: &Path, options: &LoadOptions) -> Result<Loaded, LoadError> {
    load_texts([(text, Source::Pbrt(text.to_owned()))], base_dir, options)
}

/// Load a Radiance scene from a text and perhaps the text of a view; names in it are relative to `base_dir`.
pub fn load_radiance_str(
    text: &str,
    view: Option<&str>,
    base_dir: &Path,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let rad = Source::Radiance(radiance::Source::Rad(text.to_owned()));
    let vf = view.map(|v| (v, Source::Radiance(radiance::Source::View(v.to_owned()))));
    load_texts([(text, rad)].into_iter().chain(vf), base_dir, options)
}

fn load_texts<'a>(
    texts: impl IntoIterator<Item = (&'a str, Source)>,
    base_dir: &Path,
    options: &LoadOptions,
) -> Result<Loaded, LoadError> {
    let env = Rc::new(Env::new(base_dir.to_owned(), options));
    let mut sources = Vec::new();
    for (i, (text, source)) in texts.into_iter().enumerate() {
        let name = if i == 0 { "<text>" } else { "<view>" };
        let file = {
            let mut files = env.files.borrow_mut();
            files.hash.write(text.as_bytes());
            files.add_source(PathBuf::from(name), String::new(), None)
        };
        if text.trim().is_empty() {
            env.log.error(Span { file, ..Span::default() }, "empty file");
        }
        sources.push((file, source));
    }
    import(env, sources)
}

/// The contents of a scene file by format.
enum Source {
    Pbrt(String),
    Radiance(radiance::Source),
}

fn read_scene_file(env: &Env, path: &Path) -> Result<Source, String> {
    use radiance::Source as Rad;
    if path.is_dir() {
        return Err("is a directory, not a scene file".into());
    }
    let name = path.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let stem = name.strip_suffix(".gz").unwrap_or(&name);
    let extension = stem.rsplit_once('.').map_or("", |e| e.1);
    let known = ["pbrt", "rad", "oct", "vf"].contains(&extension);
    if !known && !path.exists() {
        return Err("no such file".into());
    }
    let bytes = env.read(path)?;
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err("empty file".into());
    }
    Ok(match extension {
        "pbrt" => Source::Pbrt(text_of(bytes)),
        "rad" => Source::Radiance(Rad::Rad(text_of(bytes))),
        "oct" => Source::Radiance(Rad::Octree(bytes)),
        "vf" => Source::Radiance(Rad::View(text_of(bytes))),
        _ if radiance::octree::is_octree(&bytes) => Source::Radiance(Rad::Octree(bytes)),
        _ => {
            let text = text_of(bytes);
            if !radiance::view::is_view(&text) {
                return Err("unknown kind of file: scenes are .pbrt, .rad, .oct, with views in .vf".into());
            }
            Source::Radiance(Rad::View(text))
        }
    })
}

fn text_of(bytes: Vec<u8>) -> String {
    match String::from_utf8(bytes) {
        Ok(text) => text,
        Err(e) => String::from_utf8_lossy(e.as_bytes()).into_owned(),
    }
}

fn import(env: Rc<Env>, sources: Vec<(u32, Source)>) -> Result<Loaded, LoadError> {
    let scene = if env.log.errors() == 0 { read_sources(&env, sources) } else { None };
    let fallback = || Env::new(PathBuf::new(), &LoadOptions::default());
    let env = Rc::try_unwrap(env).unwrap_or_else(|_| fallback());
    let sources = env.files.into_inner().sources;
    let failed = env.log.errors() > 0;
    let mut diagnostics = env.log.into_diagnostics();
    match scene {
        Some(scene) if !failed => Ok(Loaded { scene, diagnostics, sources }),
        _ => {
            if !failed {
                diagnostics.push(Diagnostic {
                    severity: crate::Severity::Error,
                    message: "the scene could not be read".into(),
                    span: Span::default(),
                    help: None,
                });
            }
            Err(LoadError { diagnostics, sources })
        }
    }
}

fn read_sources(env: &Rc<Env>, sources: Vec<(u32, Source)>) -> Option<Scene> {
    let (mut pbrt, mut rad) = (Vec::new(), Vec::new());
    for (file, source) in sources {
        match source {
            Source::Pbrt(text) => pbrt.push((file, text)),
            Source::Radiance(source) => rad.push((file, source)),
        }
    }
    match (pbrt.is_empty(), rad.first()) {
        (false, Some((file, _))) => {
            let span = Span { file: *file, ..Span::default() };
            env.log.error(span, "pbrt and Radiance files do not make one scene");
            None
        }
        (true, Some(_)) => radiance::read(env, rad),
        _ => parser::read(env, pbrt),
    }
}
