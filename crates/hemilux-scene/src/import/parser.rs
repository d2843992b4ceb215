//! pbrt's directives: reads tokens, parameter lists and includes, and tells the [`Builder`] what they say.

use super::builder::{BlockKind, Builder, State};
use super::lexer::{Kind, Lexer, Token};
use super::params::Params;
use super::{Env, colour, text_of};
use crate::geom::{DAffine3, DVec3};
use crate::{Scene, Span};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Blocks that may be open at once.
pub const MAX_NESTING: usize = 10_000;
/// Files that may include one another.
pub const MAX_INCLUDES: usize = 64;

const DIRECTIVES: [&str; 37] = [
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Filter",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
];
const MORE_DIRECTIVES: [&str; 4] = ["TransformEnd", "TransformTimes", "Translate", "WorldBegin"];

fn directives() -> impl Iterator<Item = &'static str> {
    DIRECTIVES.into_iter().chain(MORE_DIRECTIVES)
}

/// Whether a word is one of pbrt's directives.
pub fn is_directive(word: &str) -> bool {
    DIRECTIVES.binary_search(&word).is_ok() || MORE_DIRECTIVES.contains(&word)
}

/// A reported error; the reader skips to the next directive.
pub struct Reported;
/// What reading a part of a directive gives.
pub type Read<T> = Result<T, Reported>;

/// A file being read.
struct Frame {
    lexer: Lexer,
    path: PathBuf,
    /// For `Import`: what to return to.
    import: Option<(State, usize)>,
}

/// The reader of one scene.
pub struct Parser {
    pub env: Rc<Env>,
    pub builder: Builder,
    frames: Vec<Frame>,
}

/// Read the files of one scene.
pub fn read(env: &Rc<Env>, texts: Vec<(u32, String)>) -> Option<Scene> {
    let mut parser = Parser { env: env.clone(), builder: Builder::new(env.clone()), frames: Vec::new() };
    let several = texts.len() > 1;
    let mut later = Vec::new();
    let mut world = false;
    let first = texts.first().map_or(0, |t| t.0);
    for (file, text) in texts {
        let kind = if several { classify(&text) } else { FileKind::Both };
        let path = env.files.borrow().sources.files[file as usize].path.clone();
        let path = path.canonicalize().unwrap_or(path);
        let frame = Frame { lexer: Lexer::new(text, file), path, import: None };
        if kind != FileKind::World {
            parser.frames.push(frame);
            if !parser.run(true) {
                continue;
            }
            world = true;
            later.push((std::mem::take(&mut parser.frames), true));
        } else {
            later.push((vec![frame], false));
        }
    }
    if !world && !env.log.full() {
        env.log.error(Span { file: first, ..Span::default() }, "no WorldBegin");
    }
    for (frames, fresh) in later {
        parser.frames = frames;
        if world {
            parser.builder.world_begin(fresh);
            parser.run(false);
        }
        parser.close_frames();
    }
    let Parser { builder, .. } = parser;
    if !world || env.log.full() { None } else { builder.finish() }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum FileKind {
    /// Options, perhaps followed by a world.
    Both,
    /// A part of a world.
    World,
}

/// What a file is that was given beside others.
fn classify(text: &str) -> FileKind {
    let mut lexer = Lexer::new(text.to_owned(), 0);
    loop {
        let t = lexer.next();
        match t.kind {
            Kind::End | Kind::Unterminated => return FileKind::World,
            Kind::Word => {
                let options = [
                    "WorldBegin",
                    "Camera",
                    "Film",
                    "Sampler",
                    "Integrator",
                    "PixelFilter",
                    "Filter",
                    "Option",
                ];
                if options.contains(&lexer.text(t)) {
                    return FileKind::Both;
                }
            }
            _ => {}
        }
    }
}

impl Parser {
    pub fn lexer(&mut self) -> &mut Lexer {
        // `run` and what it calls hold at least one frame.
        let last = self.frames.len() - 1;
        &mut self.frames[last].lexer
    }

    pub fn span(&mut self, token: Token) -> Span {
        self.lexer().span(token)
    }

    /// Read until the end or, if `stop`, until WorldBegin (true). Stops at the first file's end too.
    fn run(&mut self, stop: bool) -> bool {
        while !self.frames.is_empty() && !self.env.log.full() {
            let token = self.lexer().next();
            match token.kind {
                Kind::End => self.end_of_file(),
                Kind::Word => {
                    let word = self.lexer().text(token).to_owned();
                    if word == "WorldBegin" && stop {
                        return true;
                    }
                    let span = self.span(token);
                    if self.directive(&word, span).is_err() {
                        self.resync();
                    }
                }
                _ => {
                    let found = self.describe(token);
                    let span = self.span(token);
                    self.env.log.error(span, format!("expected a directive, found {found}"));
                    self.resync();
                }
            }
        }
        self.close_frames();
        false
    }

    /// Hand the texts to the source map, where messages quote them.
    fn close_frames(&mut self) {
        while let Some(frame) = self.frames.pop() {
            self.keep_text(frame.lexer);
        }
    }

    fn keep_text(&self, lexer: Lexer) {
        let file = lexer.file() as usize;
        self.env.files.borrow_mut().sources.files[file].text = lexer.into_text();
    }

    fn end_of_file(&mut self) {
        let Some(frame) = self.frames.pop() else { return };
        if let Some((state, depth)) = frame.import {
            self.builder.close_blocks(depth);
            self.builder.state = state;
        } else if self.frames.is_empty() {
            self.builder.close_blocks(0);
        }
        self.keep_text(frame.lexer);
    }

    /// After an error: skip what caused it, then up to what may be a directive: a known one, or a capitalised word
    /// outside brackets.
    fn resync(&mut self) {
        let Some(frame) = self.frames.last_mut() else { return };
        let (mut first, mut depth) = (true, 0i64);
        loop {
            let token = frame.lexer.peek();
            match token.kind {
                Kind::End => return,
                Kind::Open => depth += 1,
                Kind::Close => depth = (depth - 1).max(0),
                Kind::Word => {
                    let word = frame.lexer.text(token);
                    let capital = word.starts_with(|c: char| c.is_ascii_uppercase());
                    if is_directive(word) || (!first && depth == 0 && capital) {
                        return;
                    }
                }
                Kind::Str | Kind::Unterminated => {}
            }
            frame.lexer.consume(token);
            first = false;
        }
    }

    pub fn describe(&mut self, token: Token) -> String {
        let text = self.lexer().text(token);
        let short = |t: &str| -> String {
            let s: String = t.chars().take(40).flat_map(char::escape_debug).collect();
            if t.chars().count() > 40 { s + "…" } else { s }
        };
        match token.kind {
            Kind::Word => format!("\"{}\"", short(text)),
            Kind::Str => format!("the string \"{}\"", short(&text[1..text.len() - 1])),
            Kind::Open => "\"[\"".into(),
            Kind::Close => "\"]\"".into(),
            Kind::End => "the end of the file".into(),
            Kind::Unterminated => "a string without an end".into(),
        }
    }

    pub fn fail<T>(&mut self, token: Token, message: String) -> Read<T> {
        let span = self.span(token);
        self.env.log.error(span, message);
        Err(Reported)
    }

    pub fn expected<T>(&mut self, what: &str, token: Token) -> Read<T> {
        if token.kind == Kind::Unterminated {
            return self.fail(token, "the string has no end on its line".into());
        }
        let found = self.describe(token);
        self.fail(token, format!("expected {what}, found {found}"))
    }

    fn vector3(&mut self, directive: &str) -> Read<DVec3> {
        self.numbers::<3>(directive).map(DVec3::from)
    }

    fn named(&mut self, what: &str, quoted: &str) -> Read<(String, Params)> {
        let (name, span) = self.string(quoted)?;
        let items = self.params()?;
        let owner = format!("{what} \"{name}\"");
        Ok((name, Params::new(owner, span, items)))
    }

    fn directive(&mut self, word: &str, at: Span) -> Read<()> {
        match word {
            "Identity" => self.builder.set_transform(DAffine3::IDENTITY, at),
            "Translate" => {
                let v = self.vector3(word)?;
                self.builder.concat(DAffine3::from_translation(v), at);
            }
            "Scale" => {
                let v = self.vector3(word)?;
                self.builder.concat(DAffine3::from_scale(v), at);
            }
            "Rotate" => {
                let v = self.numbers::<4>(word)?;
                self.builder.rotate(v, at);
            }
            "LookAt" => {
                let v = self.numbers::<9>(word)?;
                self.builder.look_at(v, at);
            }
            "Transform" | "ConcatTransform" => {
                let v = self.numbers::<16>(word)?;
                self.builder.matrix(&v, word == "ConcatTransform", at);
            }
            "CoordinateSystem" | "CoordSysTransform" => {
                let (name, span) = self.string("the name of a coordinate system")?;
                self.builder.coordinate_system(name, word == "CoordinateSystem", span);
            }
            "TransformTimes" => {
                self.numbers::<2>(word)?;
                self.env.log.warning(at, "TransformTimes is ignored: nothing moves");
            }
            "ActiveTransform" => self.active_transform(at)?,
            "TransformBegin" => self.builder.open(BlockKind::Transform, at),
            "TransformEnd" => self.builder.close(BlockKind::Transform, at),
            "AttributeBegin" => self.builder.open(BlockKind::Attribute, at),
            "AttributeEnd" => self.builder.close(BlockKind::Attribute, at),
            "ObjectBegin" => {
                let (name, span) = self.string("the name of an object")?;
                self.builder.object_begin(name, at, span);
            }
            "ObjectEnd" => self.builder.close(BlockKind::Object, at),
            "ObjectInstance" => {
                let (name, span) = self.string("the name of an object")?;
                self.builder.object_instance(name, at, span);
            }
            "ReverseOrientation" => self.builder.state.reverse = !self.builder.state.reverse,
            "WorldBegin" => self.env.log.error(at, "a second WorldBegin"),
            "Include" | "Import" => {
                let (name, span) = self.string("the name of a file")?;
                self.include(&name, span, word == "Import");
            }
            "ColorSpace" => self.colour_space()?,
            "Attribute" => {
                let (target, span) = self.string("what the attribute is for")?;
                let items = self.params()?;
                self.builder.attribute(&target, span, items);
            }
            "Option" => {
                let items = self.params()?;
                self.builder.option(Params::new("Option".into(), at, items));
            }
            "MediumInterface" => {
                let (inside, span) = self.string("the name of a medium")?;
                let mut names = vec![inside];
                if self.lexer().peek().kind == Kind::Str {
                    names.push(self.string("the name of a medium")?.0);
                }
                self.builder.medium_interface(&names, span);
            }
            "NamedMaterial" => {
                let (name, span) = self.string("the name of a material")?;
                self.builder.named_material(&name, at, span);
            }
            "Texture" => {
                let (name, name_span) = self.string("the name of a texture")?;
                let (kind, kind_span) = self.string("\"float\" or \"spectrum\"")?;
                let (class, params) = self.named("texture", "the class of a texture")?;
                self.builder.texture(&name, name_span, &kind, kind_span, &class, params, at);
            }
            "Accelerator" => {
                self.named("accelerator", "the name of an accelerator")?;
            }
            _ => return self.typed_directive(word, at),
        }
        Ok(())
    }

    /// Directives of the form: a type in quotes, parameters.
    fn typed_directive(&mut self, word: &str, at: Span) -> Read<()> {
        type Handler = fn(&mut Builder, &str, Params, Span);
        let (what, handler): (&str, Handler) = match word {
            "Camera" => ("camera", Builder::camera),
            "Film" => ("film", Builder::film),
            "Filter" | "PixelFilter" => ("filter", Builder::filter),
            "Sampler" => ("sampler", Builder::sampler),
            "Integrator" => ("integrator", Builder::integrator),
            "MakeNamedMedium" => ("medium", Builder::make_named_medium),
            "Material" => ("material", Builder::material),
            "MakeNamedMaterial" => ("material", Builder::make_named_material),
            "LightSource" => ("light source", Builder::light_source),
            "AreaLightSource" => ("area light source", Builder::area_light_source),
            "Shape" => ("shape", Builder::shape),
            _ => {
                let shown: String = word.chars().take(40).flat_map(char::escape_debug).collect();
                let message = format!("unknown directive \"{shown}\"");
                self.env.log.unknown_among(at, message, word, directives());
                return Err(Reported);
            }
        };
        let (name, params) = self.named(what, &format!("the type of the {what} in quotes"))?;
        handler(&mut self.builder, &name, params, at);
        Ok(())
    }

    fn active_transform(&mut self, at: Span) -> Read<()> {
        let token = self.lexer().next();
        let frozen = match self.lexer().text(token) {
            "StartTime" | "All" => false,
            "EndTime" => true,
            _ => return self.expected("StartTime, EndTime or All", token),
        };
        self.builder.state.frozen = frozen;
        self.env.log.warning(at, "ActiveTransform: nothing moves, the transform at the start counts");
        Ok(())
    }

    fn colour_space(&mut self) -> Read<()> {
        let (name, span) = self.string("the name of a colour space")?;
        match colour::NAMES.iter().find(|n| n.0 == name) {
            Some(n) => self.builder.state.space = n.1,
            None => self.env.log.unknown_among(
                span,
                format!("unknown colour space \"{name}\""),
                &name,
                colour::NAMES.iter().map(|n| n.0),
            ),
        }
        Ok(())
    }

    fn include(&mut self, name: &str, span: Span, import: bool) {
        let env = self.env.clone();
        if import && !self.builder.in_world {
            env.log.error(span, "Import must come after WorldBegin");
            return;
        }
        let path = env.resolve(name, span.file);
        let canonical = path.canonicalize().unwrap_or(path.clone());
        if let Some(i) = self.frames.iter().position(|f| f.path == canonical) {
            let chain: Vec<String> = self.frames[i..]
                .iter()
                .map(|f| f.path.as_path())
                .chain([canonical.as_path()])
                .map(short)
                .collect();
            env.log.error(span, format!("cyclic include: {}", chain.join(" -> ")));
            return;
        }
        if self.frames.len() >= MAX_INCLUDES {
            env.log.error(span, format!("includes nested deeper than {MAX_INCLUDES}"));
            return;
        }
        match env.read(&path) {
            Ok(bytes) => {
                let file = env.files.borrow_mut().add_source(path, String::new(), Some(span));
                let import = import.then(|| (self.builder.state.clone(), self.builder.depth()));
                self.frames.push(Frame { lexer: Lexer::new(text_of(bytes), file), path: canonical, import });
            }
            Err(e) => {
                env.log.error(span, format!("{}: {e}", path.display()));
                if env.files.borrow().exhausted() {
                    env.log.stop();
                }
            }
        }
    }
}

fn short(path: &Path) -> String {
    path.file_name().map_or_else(|| path.display().to_string(), |n| n.to_string_lossy().into_owned())
}
