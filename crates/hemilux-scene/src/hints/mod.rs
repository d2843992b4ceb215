//! Hints: what a user knows of a scene that makes its light easier to find, from a file beside it (report, section 6: user
//! intervention "should not be considered taboo").
//!
//! A file of hints is JSON with `"hemilux-hints": 1`, in world space. Hints name casters and luminaires, regions and cones
//! that gather rays look into, windows of the image that deserve more samples, and a criterion. They become strata and
//! shares, never thresholds: what is computed from them has the same mean with any hints. `docs/cli.md` has the format.
//!
//! Invariants of [`Hints`] that [`load_hints`] returns: every index points into the scene, every number is finite, radii are
//! positive, axes have length 1, shares lie in [0, 1].

mod json;

use crate::geom::Vec3;
use crate::import::closest;
use crate::{Diagnostic, LoadError, MaterialKind, Scene, Severity, Shape, SourceFile, SourceMap, Span};
use json::{Node, Value};
use std::path::Path;

/// The version of the format that this program reads.
pub const VERSION: u32 = 1;
/// Larger files are refused (bytes).
const LARGEST: u64 = 1 << 20;
/// Hints of one kind at most.
const MOST: usize = 64;

/// A shape: one of the scene's own, or of an object (all of its instances).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShapeRef {
    /// `None`: [`Scene::shapes`]; else an index into [`Scene::objects`].
    pub object: Option<u32>,
    /// Index into its shapes.
    pub shape: u32,
}

/// A ball in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre (m).
    pub centre: Vec3,
    /// Radius (m).
    pub radius: f32,
}

/// "This is a caster": it throws virtual luminaires.
#[derive(Clone, Debug)]
pub struct CasterHint {
    /// As the file has it.
    pub name: String,
    /// What it names.
    pub shapes: Vec<ShapeRef>,
    /// Share of the light particles that are sent towards it.
    pub particles: f32,
    /// Gather rays towards it, as a share of a gather's.
    pub rays: f32,
}

/// "This luminaire matters".
#[derive(Clone, Debug)]
pub struct LuminaireHint {
    /// As the file has it.
    pub name: String,
    /// What it names.
    pub shapes: Vec<ShapeRef>,
    /// Indices into [`Scene::environments`] that it names.
    pub environments: Vec<u32>,
    /// Share of the light particles that start from it.
    pub particles: f32,
    /// Share of the shadow rays that go to it.
    pub shadow_rays: f32,
}

/// "Look there": a place in the scene.
#[derive(Clone, Debug)]
pub struct RegionHint {
    /// Where.
    pub ball: Ball,
    /// Gather rays towards it, as a share of a gather's.
    pub rays: f32,
}

/// "Look that way": a cone of directions.
#[derive(Clone, Debug)]
pub struct ConeHint {
    /// Unit axis, away from the gather point.
    pub axis: Vec3,
    /// Half-angle (radians), up to π.
    pub half_angle: f32,
    /// Where gather points must lie for it to count; `None`: anywhere.
    pub within: Option<Ball>,
    /// Gather rays in it, as a share of a gather's.
    pub rays: f32,
}

/// "This part of the picture deserves more".
#[derive(Clone, Debug)]
pub struct ImageHint {
    /// x0, x1, y0, y1 in [0, 1] of the whole picture; y goes down.
    pub window: [f32; 4],
    /// Camera samples per pixel and pass.
    pub samples: u32,
}

/// What strategies refine by (those that have a criterion).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CriterionHint {
    /// For compact features.
    Contrast,
    /// For ragged ones.
    Value,
    /// Predicted deviation.
    Deviation,
    /// For enlarged luminaires.
    Unresolved,
}

/// Criteria and their names.
pub const CRITERIA: [(&str, CriterionHint); 4] = [
    ("contrast", CriterionHint::Contrast),
    ("value", CriterionHint::Value),
    ("deviation", CriterionHint::Deviation),
    ("unresolved", CriterionHint::Unresolved),
];

/// All hints of a file.
#[derive(Clone, Debug, Default)]
pub struct Hints {
    /// Casters.
    pub casters: Vec<CasterHint>,
    /// Luminaires.
    pub luminaires: Vec<LuminaireHint>,
    /// Regions.
    pub regions: Vec<RegionHint>,
    /// Cones.
    pub cones: Vec<ConeHint>,
    /// Windows of the image.
    pub image: Vec<ImageHint>,
    /// Criterion.
    pub criterion: Option<CriterionHint>,
    /// Hash of the file (FNV-1a).
    pub hash: u64,
}

/// Hints, and what there is to say about them.
#[derive(Clone, Debug)]
pub struct LoadedHints {
    /// The hints.
    pub hints: Hints,
    /// Warnings.
    pub diagnostics: Vec<Diagnostic>,
    /// The file, for spans.
    pub sources: SourceMap,
}

/// Read the hints in the file at `path` about `scene`, which was read from `sources`.
///
/// # Errors
/// The file cannot be read, is not JSON, of another version, or names what there is not; each with its place.
pub fn load_hints(path: &Path, scene: &Scene, sources: &SourceMap) -> Result<LoadedHints, LoadError> {
    let unreadable = |what: String| {
        let files = vec![SourceFile { path: path.to_owned(), text: String::new(), included_from: None }];
        let error =
            Diagnostic { severity: Severity::Error, message: what, span: Span::default(), help: None };
        LoadError { diagnostics: vec![error], sources: SourceMap { files } }
    };
    let size = std::fs::metadata(path).map_err(|e| unreadable(e.to_string()))?.len();
    if size > LARGEST {
        return Err(unreadable(format!("a file of hints of more than {LARGEST} bytes")));
    }
    let text = std::fs::read_to_string(path).map_err(|e| unreadable(e.to_string()))?;
    parse_hints(&text, path, scene, sources)
}

/// The same from text; `path` is for messages.
///
/// # Errors
/// See [`load_hints`].
pub fn parse_hints(
    text: &str,
    path: &Path,
    scene: &Scene,
    sources: &SourceMap,
) -> Result<LoadedHints, LoadError> {
    let mut reader = Reader { scene, sources, found: Vec::new() };
    let mut hints = match json::parse(text) {
        Ok(node) => reader.hints(&node),
        Err((span, message)) => {
            reader.error(span, message, None);
            Hints::default()
        }
    };
    hints.hash =
        text.bytes().fold(0xcbf2_9ce4_8422_2325, |h: u64, b| (h ^ b as u64).wrapping_mul(0x100_0000_01b3));
    let file = SourceFile { path: path.to_owned(), text: text.to_owned(), included_from: None };
    let (diagnostics, own) = (reader.found, SourceMap { files: vec![file] });
    match diagnostics.iter().any(|d| d.severity == Severity::Error) {
        true => Err(LoadError { diagnostics, sources: own }),
        false => Ok(LoadedHints { hints, diagnostics, sources: own }),
    }
}

struct Reader<'a> {
    scene: &'a Scene,
    sources: &'a SourceMap,
    found: Vec<Diagnostic>,
}

/// The entries of an object that was checked for unknown keys.
struct Entries<'a> {
    entries: &'a [(String, Span, Node)],
    span: Span,
}

impl<'a> Entries<'a> {
    fn get(&self, key: &str) -> Option<&'a Node> {
        self.entries.iter().find(|e| e.0 == key).map(|e| &e.2)
    }
}

/// Default shares.
const PARTICLES: f32 = 0.2;
const CASTER_RAYS: f32 = 0.05;
const SHADOW_RAYS: f32 = 0.25;
const RAYS: f32 = 0.25;
/// Most samples per pixel and pass of a window.
const MOST_SAMPLES: f64 = 1024.0;

impl Reader<'_> {
    fn error(&mut self, span: Span, message: impl Into<String>, help: Option<String>) {
        self.found.push(Diagnostic { severity: Severity::Error, message: message.into(), span, help });
    }

    fn warning(&mut self, span: Span, message: impl Into<String>, help: Option<String>) {
        self.found.push(Diagnostic { severity: Severity::Warning, message: message.into(), span, help });
    }

    fn hints(&mut self, node: &Node) -> Hints {
        let keys = ["hemilux-hints", "casters", "luminaires", "regions", "cones", "image", "criterion"];
        let mut hints = Hints::default();
        let Some(all) = self.entries(node, &keys) else { return hints };
        match all.get("hemilux-hints").map(|n| (n.span, &n.value)) {
            Some((_, Value::Number(v))) if *v == VERSION as f64 => {}
            Some((span, Value::Number(v))) => self.error(
                span,
                format!("hints of version {v}, this program reads version {VERSION}"),
                Some("docs/cli.md describes the format".into()),
            ),
            Some((span, other)) => {
                self.error(span, format!("the version is a number, not {}", other.kind()), None);
            }
            None => self.error(
                node.span,
                "no version of the hints",
                Some(format!("add \"hemilux-hints\": {VERSION}")),
            ),
        }
        hints.casters = self.list(&all, "casters", Self::caster);
        hints.luminaires = self.list(&all, "luminaires", Self::luminaire);
        hints.regions = self.list(&all, "regions", Self::region);
        hints.cones = self.list(&all, "cones", Self::cone);
        hints.image = self.list(&all, "image", Self::window);
        hints.criterion = all.get("criterion").and_then(|n| self.criterion(n));
        hints
    }

    /// The entries of an object whose keys are among `known` (or "comment").
    fn entries<'n>(&mut self, node: &'n Node, known: &[&str]) -> Option<Entries<'n>> {
        let Value::Object(entries) = &node.value else {
            self.error(node.span, format!("expected an object, found {}", node.value.kind()), None);
            return None;
        };
        for (key, span, _) in entries {
            if key != "comment" && !known.contains(&key.as_str()) {
                let help = match closest(key, known.iter().copied()) {
                    Some(name) => format!("did you mean {name:?}?"),
                    None => format!("known are {}", known.join(", ")),
                };
                self.error(*span, format!("unknown key {key:?}"), Some(help));
            }
        }
        Some(Entries { entries, span: node.span })
    }

    fn list<T>(&mut self, all: &Entries, key: &str, read: impl Fn(&mut Self, &Node) -> Option<T>) -> Vec<T> {
        let Some(node) = all.get(key) else { return Vec::new() };
        let Value::Array(items) = &node.value else {
            self.error(node.span, format!("{key:?} is a list, not {}", node.value.kind()), None);
            return Vec::new();
        };
        if items.len() > MOST {
            self.error(node.span, format!("{} {key}, more than {MOST}", items.len()), None);
            return Vec::new();
        }
        items.iter().filter_map(|item| read(self, item)).collect()
    }

    fn caster(&mut self, node: &Node) -> Option<CasterHint> {
        let e = self.entries(node, &["object", "particles", "rays"])?;
        let particles = self.share(&e, "particles", PARTICLES);
        let rays = self.share(&e, "rays", CASTER_RAYS);
        let (name, span) = self.name(&e)?;
        let shapes = self.shapes(&name, span, |_| true)?;
        if shapes.iter().all(|s| self.is_diffuse(self.shape(*s))) {
            let message = format!("nothing of {name:?} reflects or refracts other than diffusely");
            self.warning(span, message, Some("particles are sent there all the same".into()));
        }
        Some(CasterHint { name, shapes, particles, rays })
    }

    fn luminaire(&mut self, node: &Node) -> Option<LuminaireHint> {
        let e = self.entries(node, &["object", "particles", "shadow-rays"])?;
        let particles = self.share(&e, "particles", PARTICLES);
        let shadow_rays = self.share(&e, "shadow-rays", SHADOW_RAYS);
        let (name, span) = self.name(&e)?;
        if name == "environment" && !self.scene.environments.is_empty() {
            let environments = (0..self.scene.environments.len() as u32).collect();
            return Some(LuminaireHint { name, shapes: Vec::new(), environments, particles, shadow_rays });
        }
        let shapes = self.shapes(&name, span, |s| s.emission.is_some())?;
        Some(LuminaireHint { name, shapes, environments: Vec::new(), particles, shadow_rays })
    }

    fn region(&mut self, node: &Node) -> Option<RegionHint> {
        let e = self.entries(node, &["centre", "radius", "low", "high", "rays"])?;
        let rays = self.share(&e, "rays", RAYS);
        let ball = match (e.get("low"), e.get("high")) {
            (None, None) => self.ball(&e)?,
            _ => {
                let (low, high) = (self.vector(&e, "low")?, self.vector(&e, "high")?);
                if e.get("centre").or(e.get("radius")).is_some() {
                    self.error(
                        node.span,
                        "a region is a ball (centre, radius) or a box (low, high), not both",
                        None,
                    );
                    return None;
                }
                Ball { centre: (low + high) * 0.5, radius: 0.5 * (high - low).length() }
            }
        };
        if ball.radius <= 0.0 {
            self.error(node.span, "the region has no extent", None);
            return None;
        }
        Some(RegionHint { ball, rays })
    }

    fn cone(&mut self, node: &Node) -> Option<ConeHint> {
        let e = self.entries(node, &["axis", "half-angle", "within", "rays"])?;
        let rays = self.share(&e, "rays", RAYS);
        let axis = self.vector(&e, "axis")?;
        let Some(axis) = axis.as_dvec3().try_normalize() else {
            self.error(e.get("axis")?.span, "the axis has no length", None);
            return None;
        };
        let degrees = self.number(&e, "half-angle")?;
        if !(degrees > 0.0 && degrees <= 180.0) {
            let span = e.get("half-angle")?.span;
            self.error(span, format!("a half-angle of {degrees} degrees is not above 0 and up to 180"), None);
            return None;
        }
        let within = match e.get("within") {
            None => None,
            Some(node) => {
                let e = self.entries(node, &["centre", "radius"])?;
                Some(self.ball(&e)?)
            }
        };
        Some(ConeHint { axis: axis.as_vec3(), half_angle: degrees.to_radians() as f32, within, rays })
    }

    fn window(&mut self, node: &Node) -> Option<ImageHint> {
        let e = self.entries(node, &["window", "samples"])?;
        let v = self.numbers::<4>(&e, "window")?;
        let inside = v.iter().all(|x| (0.0..=1.0).contains(x)) && v[0] < v[1] && v[2] < v[3];
        if !inside {
            let message = "a window is [x0, x1, y0, y1] with 0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1";
            self.error(e.get("window")?.span, message, None);
            return None;
        }
        let samples = self.number(&e, "samples")?;
        if samples.fract() != 0.0 || !(1.0..=MOST_SAMPLES).contains(&samples) {
            let message = format!("samples is a whole number from 1 to {MOST_SAMPLES}, not {samples}");
            self.error(e.get("samples")?.span, message, None);
            return None;
        }
        Some(ImageHint { window: v.map(|x| x as f32), samples: samples as u32 })
    }

    fn criterion(&mut self, node: &Node) -> Option<CriterionHint> {
        let names = || CRITERIA.iter().map(|c| c.0);
        let Value::Text(name) = &node.value else {
            self.error(node.span, format!("the criterion is a string, not {}", node.value.kind()), None);
            return None;
        };
        let known = CRITERIA.iter().find(|c| c.0 == name).map(|c| c.1);
        if known.is_none() {
            let help = match closest(name, names()) {
                Some(close) => format!("did you mean {close:?}?"),
                None => format!("known are {}", names().collect::<Vec<_>>().join(", ")),
            };
            self.error(node.span, format!("unknown criterion {name:?}"), Some(help));
        }
        known
    }

    fn ball(&mut self, e: &Entries) -> Option<Ball> {
        let (centre, radius) = (self.vector(e, "centre")?, self.number(e, "radius")?);
        if radius as f32 <= 0.0 {
            self.error(e.get("radius")?.span, format!("a radius of {radius} is not positive"), None);
            return None;
        }
        Some(Ball { centre, radius: radius as f32 })
    }

    fn vector(&mut self, e: &Entries, key: &str) -> Option<Vec3> {
        self.numbers::<3>(e, key).map(|v| Vec3::from(v.map(|x| x as f32)))
    }

    fn numbers<const N: usize>(&mut self, e: &Entries, key: &str) -> Option<[f64; N]> {
        let node = self.required(e, key)?;
        let numbers: Option<Vec<f64>> = match &node.value {
            Value::Array(items) => items.iter().map(|i| self.finite(i, key)).collect(),
            _ => None,
        };
        let numbers = numbers.and_then(|v| <[f64; N]>::try_from(v).ok());
        if numbers.is_none() {
            self.error(node.span, format!("{key:?} is a list of {N} numbers"), None);
        }
        numbers
    }

    fn number(&mut self, e: &Entries, key: &str) -> Option<f64> {
        let node = self.required(e, key)?;
        self.finite(node, key)
    }

    /// A number that a single-precision one can hold.
    fn finite(&mut self, node: &Node, key: &str) -> Option<f64> {
        match &node.value {
            Value::Number(v) if (*v as f32).is_finite() => Some(*v),
            Value::Number(v) => {
                self.error(node.span, format!("{v} is too large"), None);
                None
            }
            other => {
                self.error(node.span, format!("{key:?} wants a number, found {}", other.kind()), None);
                None
            }
        }
    }

    fn required<'n>(&mut self, e: &Entries<'n>, key: &str) -> Option<&'n Node> {
        let node = e.get(key);
        if node.is_none() {
            self.error(e.span, format!("{key:?} is missing"), None);
        }
        node
    }

    fn share(&mut self, e: &Entries, key: &str, default: f32) -> f32 {
        let Some(node) = e.get(key) else { return default };
        match self.finite(node, key) {
            Some(v) if (0.0..=1.0).contains(&v) => v as f32,
            Some(v) => {
                self.error(node.span, format!("a share of {v} is not in [0, 1]"), None);
                default
            }
            None => default,
        }
    }

    fn name(&mut self, e: &Entries) -> Option<(String, Span)> {
        let node = self.required(e, "object")?;
        match &node.value {
            Value::Text(name) => Some((name.clone(), node.span)),
            other => {
                self.error(node.span, format!("\"object\" is a name, not {}", other.kind()), None);
                None
            }
        }
    }

    fn shape(&self, at: ShapeRef) -> &Shape {
        let scene = self.scene;
        match at.object {
            None => &scene.shapes[at.shape as usize],
            Some(o) => &scene.objects[o as usize].shapes[at.shape as usize],
        }
    }

    fn is_diffuse(&self, s: &Shape) -> bool {
        let kind = &self.scene.materials[s.material.0 as usize].kind;
        matches!(
            kind,
            MaterialKind::Diffuse { .. } | MaterialKind::DiffuseTransmission { .. } | MaterialKind::Interface
        )
    }

    /// Every shape of this name that is `wanted`: by its own name, its object's, its material's, or where it was made
    /// (`file:line`).
    fn shapes(&mut self, name: &str, span: Span, wanted: impl Fn(&Shape) -> bool) -> Option<Vec<ShapeRef>> {
        let own = self.scene.shapes.iter().enumerate();
        let own = own.map(|(i, s)| (None, i, "", s));
        let objects = self.scene.objects.iter().enumerate().flat_map(|(o, object)| {
            let shapes = object.shapes.iter().enumerate();
            shapes.map(move |(i, s)| (Some(o as u32), i, object.name.as_str(), s))
        });
        let material = |s: &Shape| self.scene.materials[s.material.0 as usize].name.as_str();
        let place = name.rsplit_once(':').and_then(|(file, line)| Some((file, line.parse::<u32>().ok()?)));
        let made_at = |s: &Shape| {
            place.is_some_and(|(file, line)| {
                let path = self.sources.files.get(s.span.file as usize).map(|f| &f.path);
                s.span.line == line && path.is_some_and(|p| p.ends_with(file))
            })
        };
        let (mut found, mut named, mut names) = (Vec::new(), false, Vec::new());
        for (object, i, object_name, s) in own.chain(objects) {
            let is = s.name == name || object_name == name || material(s) == name || made_at(s);
            named |= is;
            if is && wanted(s) {
                found.push(ShapeRef { object, shape: i as u32 });
            } else if wanted(s) {
                names.extend([s.name.as_str(), object_name, material(s)]);
            }
        }
        if !found.is_empty() {
            return Some(found);
        }
        names.retain(|n| !n.is_empty());
        names.sort_unstable();
        names.dedup();
        let help = match closest(name, names.iter().copied()) {
            Some(close) => format!("did you mean {close:?}?"),
            None if names.is_empty() => {
                "shapes can also be named by the place where they are made: \"room.pbrt:17\"".into()
            }
            None => format!(
                "named are {}{}",
                names[..names.len().min(12)].join(", "),
                if names.len() > 12 { ", …" } else { "" }
            ),
        };
        let message = match named {
            true => format!("nothing of {name:?} emits"),
            false => format!("the scene has no object, shape or material {name:?}"),
        };
        self.error(span, message, Some(help));
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load_pbrt_str;

    const SCENE: &str = "WorldBegin
AttributeBegin
  AreaLightSource \"diffuse\" \"rgb L\" [ 5 5 5 ]
  Material \"diffuse\"
  Shape \"sphere\" \"float radius\" [ 0.1 ]
AttributeEnd
MakeNamedMaterial \"mirror\" \"string type\" \"conductor\" \"rgb reflectance\" [ 1 1 1 ] \"float roughness\" [ 0 ]
NamedMaterial \"mirror\"
Shape \"sphere\" \"float radius\" [ 3 ]
ObjectBegin \"pearl\"
  NamedMaterial \"mirror\"
  Shape \"sphere\" \"float radius\" [ 0.01 ]
ObjectEnd
ObjectInstance \"pearl\"
";

    fn read(text: &str) -> Result<LoadedHints, LoadError> {
        let loaded = load_pbrt_str(SCENE, Path::new(""), &crate::LoadOptions::default()).unwrap();
        let mut sources = loaded.sources;
        sources.files[0].path = "dir/scene.pbrt".into();
        parse_hints(text, Path::new("hints.json"), &loaded.scene, &sources)
    }

    #[test]
    fn every_kind_of_hint_is_read() {
        let read = read(
            "{ \"hemilux-hints\": 1, \"comment\": \"all\",
            \"casters\": [ { \"object\": \"pearl\", \"particles\": 0.5 }, { \"object\": \"mirror\" } ],
            \"luminaires\": [ { \"object\": \"scene.pbrt:5\", \"shadow-rays\": 0.125 } ],
            \"regions\": [ { \"centre\": [1, 2, 3], \"radius\": 0.5 }, { \"low\": [0, 0, 0], \"high\": [2, 0, 0] } ],
            \"cones\": [ { \"axis\": [0, 0, 2], \"half-angle\": 90, \"within\": { \"centre\": [0, 0, 0], \"radius\": 1 } } ],
            \"image\": [ { \"window\": [0, 0.5, 0.5, 1], \"samples\": 4 } ],
            \"criterion\": \"value\" }",
        )
        .unwrap();
        assert!(read.diagnostics.is_empty());
        let h = read.hints;
        let pearl = ShapeRef { object: Some(0), shape: 0 };
        assert_eq!(h.casters[0].shapes, [pearl]);
        assert_eq!(h.casters[1].shapes, [ShapeRef { object: None, shape: 1 }, pearl]);
        assert_eq!((h.casters[0].particles, h.casters[1].particles), (0.5, PARTICLES));
        assert_eq!(h.luminaires[0].shapes, [ShapeRef { object: None, shape: 0 }]);
        assert_eq!(h.regions[1].ball, Ball { centre: Vec3::X, radius: 1.0 });
        assert_eq!(h.cones[0].axis, Vec3::Z);
        assert!((h.cones[0].half_angle - std::f32::consts::FRAC_PI_2).abs() < 1e-6);
        assert_eq!(h.image[0].samples, 4);
        assert_eq!(h.criterion, Some(CriterionHint::Value));
    }

    #[test]
    fn mistakes_are_named_with_place_and_remedy() {
        for (text, line, column, what, help) in [
            ("{}", 1, 1, "no version of the hints", "add \"hemilux-hints\": 1"),
            (
                "{\"hemilux-hints\": 2}",
                1,
                19,
                "hints of version 2, this program reads version 1",
                "docs/cli.md",
            ),
            (
                "{\"hemilux-hints\": 1,\n \"caster\": []}",
                2,
                2,
                "unknown key \"caster\"",
                "did you mean \"casters\"?",
            ),
            (
                "{\"hemilux-hints\": 1,\n \"casters\": [{\"object\": \"perl\"}]}",
                2,
                25,
                "the scene has no object, shape or material \"perl\"",
                "did you mean \"pearl\"?",
            ),
            (
                "{\"hemilux-hints\": 1,\n \"luminaires\": [{\"object\": \"mirror\"}]}",
                2,
                28,
                "nothing of \"mirror\" emits",
                "by the place",
            ),
            (
                "{\"hemilux-hints\": 1, \"criterion\": \"valu\"}",
                1,
                35,
                "unknown criterion \"valu\"",
                "did you mean \"value\"?",
            ),
        ] {
            let e = read(text).unwrap_err();
            let d = &e.diagnostics[0];
            assert_eq!((d.span.line, d.span.column, d.message.as_str()), (line, column, what), "{text}");
            assert!(d.help.as_ref().unwrap().contains(help), "{:?}", d.help);
        }
        for (text, what) in [
            ("\"cones\": [{\"axis\": [0,0,0], \"half-angle\": 1}]", "the axis has no length"),
            ("\"cones\": [{\"axis\": [0,0,1], \"half-angle\": 181}]", "not above 0 and up to 180"),
            ("\"cones\": [{\"axis\": [0,0,1]}]", "\"half-angle\" is missing"),
            ("\"cones\": [{\"axis\": [0,1], \"half-angle\": 1}]", "\"axis\" is a list of 3 numbers"),
            ("\"cones\": {}", "\"cones\" is a list, not an object"),
            ("\"regions\": [{\"centre\": [0,0,0], \"radius\": 0}]", "not positive"),
            ("\"regions\": [{\"low\": [0,0,0], \"high\": [0,0,0]}]", "no extent"),
            ("\"regions\": [{\"centre\": [0,0,1e39], \"radius\": 1}]", "too large"),
            ("\"image\": [{\"window\": [0.5,0.5,0,1], \"samples\": 2}]", "a window is"),
            ("\"image\": [{\"window\": [0,1,0,1], \"samples\": 1.5}]", "a whole number from 1"),
            ("\"casters\": [{\"object\": \"pearl\", \"rays\": 2}]", "a share of 2 is not in [0, 1]"),
            ("\"casters\": [{\"object\": 3}]", "\"object\" is a name, not a number"),
            ("\"casters\": [3]", "expected an object, found a number"),
        ] {
            let e = read(&format!("{{\"hemilux-hints\": 1, {text}}}")).unwrap_err();
            assert!(e.diagnostics[0].message.contains(what), "{text}: {}", e.diagnostics[0].message);
            assert!(e.diagnostics[0].span.line == 1);
        }
    }
}
