//! Radiance scenes: `.rad` descriptions, unfrozen `.oct` octrees, `.vf` views.
//!
//! A [`Reader`] walks through primitives and commands in order. Modifiers bind to the latest earlier definition of their
//! name. Commands are never executed: those that are known here ([`command::KNOWN`]) are computed natively, their output
//! read as if it stood in the file; everything else is refused. Every input ends: by [`MAX_DEPTH`] files inside one
//! another, the budget of bytes that all reading shares, and the limits of each command.
//!
//! # What is approximate
//!
//! - Anisotropic roughness becomes its geometric mean.
//! - `cone` and `cup` are tessellated into [`surface::FACETS`] inscribed facets with smooth normals: radius within
//!   3 parts in 10,000.
//! - Skies become images of 1024 × 512 cells that hold exact cell means: irradiance is that of the sky to about 0.1 %,
//!   radiance is constant over 0.35°.
//! - `mirror`, `illum` and the radius of `glow` steer Radiance's direct calculation and are not needed: a mirror is a
//!   mirror, an illum is its alternative material or nothing.

mod command;
mod expr;
mod finish;
mod generate;
mod generate_sky;
mod material;
pub mod octree;
mod polygon;
mod sky;
mod sun;
mod surface;
mod transform;
mod types;
pub mod view;
mod words;

use super::Env;
use crate::{Scene, Span};
use material::Definition;
use std::collections::{HashMap, HashSet};
use std::path::PathBuf;
use std::rc::Rc;
use surface::Build;
use transform::Similarity;
use types::Class;
use words::{Word, Words};

/// Files and commands inside one another.
const MAX_DEPTH: usize = 48;

/// What a scene file is.
#[derive(Debug)]
pub enum Source {
    /// A scene description.
    Rad(String),
    /// A view.
    View(String),
    /// An octree.
    Octree(Vec<u8>),
}

/// One argument of a command and where it stands.
#[derive(Clone, Debug, PartialEq)]
pub struct Argument {
    /// What it says.
    pub text: String,
    /// Where.
    pub span: Span,
}

/// What an enclosing `xform` does to what is read.
#[derive(Clone, Debug)]
struct Context {
    map: Similarity,
    /// Replaces the modifier of every surface.
    modifier: Option<Argument>,
    /// Surfaces face the other way.
    invert: bool,
    depth: usize,
}

/// Everything read so far.
struct Reader {
    env: Rc<Env>,
    definitions: Vec<Definition>,
    names: HashMap<String, usize>,
    /// Names whose absence has been reported.
    reported: HashSet<String>,
    /// Files being read, to tell cycles.
    open: Vec<PathBuf>,
    build: Build,
    view: view::ViewState,
    /// Files by canonical path, and what commands generated: read once, placed often.
    texts: HashMap<PathBuf, (Rc<str>, u32)>,
    generated: HashMap<String, (Rc<str>, u32)>,
    /// Bytes that commands have made so far.
    work: u64,
    hints: Hints,
}

/// What the files say to steer Radiance's direct calculation.
#[derive(Clone, Copy, Debug, Default)]
struct Hints {
    illums: usize,
    mirrors: usize,
    glow_radii: usize,
}

/// One primitive's arguments.
struct Primitive {
    kind: &'static types::Type,
    modifier: Word,
    modifier_span: Span,
    id: Word,
    head: Span,
    strings: Vec<Word>,
    reals: Vec<f64>,
    numbers: Vec<Word>,
    /// The word that says how many reals there are.
    count: Word,
}

/// Read all files of one scene.
pub fn read(env: &Rc<Env>, sources: Vec<(u32, Source)>) -> Option<Scene> {
    let mut reader = Reader {
        env: env.clone(),
        definitions: Vec::new(),
        names: HashMap::new(),
        reported: HashSet::new(),
        open: Vec::new(),
        build: Build::default(),
        view: view::ViewState::default(),
        texts: HashMap::new(),
        generated: HashMap::new(),
        work: 0,
        hints: Hints::default(),
    };
    let top = Context { map: Similarity::IDENTITY, modifier: None, invert: false, depth: 0 };
    for (file, source) in sources {
        if env.log.full() {
            break;
        }
        match source {
            Source::Rad(text) => {
                let path = env.files.borrow().sources.files.get(file as usize).map(|f| f.path.clone());
                reader.open.extend(path.and_then(|p| p.canonicalize().ok()));
                reader.read_text(text.into(), file, &top);
                reader.open.clear();
            }
            Source::View(text) => {
                view::read(env, &mut reader.view, &text, file);
                reader.keep_text(file, text);
            }
            Source::Octree(bytes) => reader.read_octree(&bytes, file, &top),
        }
    }
    reader.finish()
}

impl Reader {
    fn keep_text(&self, file: u32, text: String) {
        if let Some(f) = self.env.files.borrow_mut().sources.files.get_mut(file as usize) {
            f.text = text;
        }
    }

    /// Read a text to its end, or to its first error of syntax.
    fn read_text(&mut self, text: Rc<str>, file: u32, context: &Context) {
        self.keep_text(file, text.to_string());
        self.read_copy(text, file, context);
    }

    /// The same, when the text is already kept for messages.
    fn read_copy(&mut self, text: Rc<str>, file: u32, context: &Context) {
        let mut words = Words::new(text, file);
        while let Some(word) = words.next() {
            if self.env.log.full() {
                return;
            }
            if words.raw(word).starts_with('!') {
                let line = words.command(word);
                self.run(&mut words, line, context);
            } else if self.primitive(&mut words, word, context).is_none() {
                return;
            }
        }
    }

    /// One primitive; `None` when reading cannot go on.
    fn primitive(&mut self, words: &mut Words, modifier: Word, context: &Context) -> Option<()> {
        // In the order of the text, which is what makes spans cheap.
        let modifier_span = words.span(modifier);
        let kind = self.expect(words, "the type of a primitive")?;
        let id = self.expect(words, "the identifier of a primitive")?;
        if words.text(kind) == "alias" {
            let reference = self.expect(words, "what the alias stands for")?;
            self.alias(words, (modifier, modifier_span), id, reference);
            return Some(());
        }
        let known = types::find(words.text(kind));
        let owner = format!("{} \"{}\"", words.text(kind), words.text(id));
        if known.is_none() {
            let (name, span) = (words.text(kind).to_owned(), words.span(kind));
            let names = types::TYPES.iter().map(|t| t.name).chain(["alias"]);
            self.env.log.unknown_among(span, format!("unknown type \"{name}\""), &name, names);
        }
        let head = words.span(kind);
        let (_, strings) = self.counted(words, "strings", &owner)?;
        let (_, integers) = self.counted(words, "integers", &owner)?;
        let (count, numbers) = self.counted(words, "numbers", &owner)?;
        if let Some(&first) = integers.first() {
            let span = words.span(first);
            self.env.log.error(span, format!("{owner} takes no integers"));
            return None;
        }
        let mut reals = Vec::with_capacity(numbers.len());
        for &word in &numbers {
            reals.push(self.real(words, word, &owner)?);
        }
        let Some(kind) = known else {
            // Left out: what names it must not be reported again.
            let definition = Definition::broken(words.text(id), head);
            self.define(definition);
            return Some(());
        };
        let primitive = Primitive { kind, modifier, modifier_span, id, head, strings, reals, numbers, count };
        self.checked(words, primitive, context);
        Some(())
    }

    fn checked(&mut self, words: &mut Words, p: Primitive, context: &Context) {
        let owner = self.owner(words, &p);
        let (least, most) = p.kind.reals;
        let surface = p.kind.class == Class::Surface;
        if !p.kind.supported {
            self.refuse(words, &p);
            return;
        }
        if p.reals.len() < least || p.reals.len() > most {
            let span = words.span(p.count);
            let message = format!("{owner} takes {}, not {}", p.kind.reals_wanted(), p.reals.len());
            self.env.log.error(span, message);
            self.leave_out(words, &p, surface);
            return;
        }
        if p.strings.len() < p.kind.strings {
            let message = format!("{owner} takes {} strings, not {}", p.kind.strings, p.strings.len());
            self.env.log.error(p.head, message);
            self.leave_out(words, &p, surface);
            return;
        }
        if surface {
            let modifier = match &context.modifier {
                Some(m) => self.modifier(&m.text, m.span),
                None => self.modifier(words.text(p.modifier), p.modifier_span),
            };
            match modifier {
                Some(modifier) => self.surface(words, modifier, &p, context),
                None => self.leave_out(words, &p, surface),
            }
        } else {
            let Some(modifier) = self.modifier(words.text(p.modifier), p.modifier_span) else {
                self.leave_out(words, &p, surface);
                return;
            };
            self.material(words, modifier, &p, context);
        }
    }

    /// What has been reported must not be reported again by those who use it.
    fn leave_out(&mut self, words: &Words, p: &Primitive, surface: bool) {
        if !surface {
            self.define(Definition::broken(words.text(p.id), p.head));
        }
    }

    /// A type that exists but not here.
    fn refuse(&mut self, words: &Words, p: &Primitive) {
        let name = p.kind.name;
        let help = match name {
            "instance" => Some("put the files the octree was made of in its place, with !xform".to_owned()),
            "mesh" => Some("put the surfaces the mesh was made of in its place".to_owned()),
            "antimatter" => Some("cut the surfaces themselves".to_owned()),
            _ => None,
        };
        let class = match p.kind.class {
            Class::Surface => "surface",
            Class::Material => "material",
            Class::Pattern => "pattern or texture",
            Class::Mixture => "mixture",
        };
        self.env.log.unknown_help(p.head, format!("{class} \"{name}\" is not supported"), help);
        if p.kind.class == Class::Surface {
            return;
        }
        // A pattern that is left out lets what it modifies through; a material or mixture is left out as a whole.
        let mut definition = Definition::broken(words.text(p.id), p.head);
        if p.kind.class == Class::Pattern {
            let below = self.modifier(words.text(p.modifier), p.modifier_span).flatten();
            definition = Definition::pass(words.text(p.id), p.head, below);
        }
        self.define(definition);
    }

    fn owner(&self, words: &Words, p: &Primitive) -> String {
        format!("{} \"{}\"", p.kind.name, words.text(p.id))
    }

    fn expect(&self, words: &mut Words, what: &str) -> Option<Word> {
        let word = words.next();
        if word.is_none() {
            let span = words.end_span();
            self.env.log.error(span, format!("expected {what}, found the end of the file"));
        }
        word
    }

    /// A count and as many words.
    fn counted(&self, words: &mut Words, what: &str, owner: &str) -> Option<(Word, Vec<Word>)> {
        let count = self.expect(words, &format!("the count of {what} of {owner}"))?;
        let text = words.text(count);
        let Ok(n) = text.parse::<u64>() else {
            let message = format!("expected the count of {what} of {owner}, found \"{text}\"");
            let span = words.span(count);
            self.env.log.error(span, message);
            return None;
        };
        let mut list = Vec::new();
        for i in 0..n {
            match words.next() {
                Some(word) => list.push(word),
                None => {
                    let span = words.end_span();
                    let message = format!("{owner} has {n} {what}, found the end of the file after {i}");
                    self.env.log.error(span, message);
                    return None;
                }
            }
        }
        Some((count, list))
    }

    fn real(&self, words: &mut Words, word: Word, owner: &str) -> Option<f64> {
        let text = words.text(word);
        let message = match text.parse::<f64>() {
            Ok(v) if v.is_finite() => return Some(v),
            Ok(_) => format!("\"{text}\" is not a finite number"),
            Err(_) => format!("expected a number of {owner}, found \"{text}\""),
        };
        let span = words.span(word);
        self.env.log.error(span, message);
        None
    }

    /// The definition that a modifier's name means now (`None`: void); an error unless there is one.
    fn modifier(&mut self, name: &str, span: Span) -> Option<Option<usize>> {
        if name == "void" {
            return Some(None);
        }
        if let Some(&i) = self.names.get(name) {
            return Some(Some(i));
        }
        if self.reported.insert(name.to_owned()) {
            let known = self.names.keys().map(String::as_str).chain(["void"]);
            self.env.log.unknown_among(span, format!("modifier \"{name}\" is not defined"), name, known);
        }
        None
    }

    fn define(&mut self, definition: Definition) {
        let known = self.names.get(&definition.name).is_some_and(|&i| self.definitions[i].means(&definition));
        if known {
            return;
        }
        self.names.insert(definition.name.clone(), self.definitions.len());
        self.definitions.push(definition);
    }

    /// `modifier alias id reference`: the reference under a new name; any modifier but `inherit` takes the place of its own.
    fn alias(&mut self, words: &mut Words, (modifier, span): (Word, Span), id: Word, reference: Word) {
        let (name, target) = (words.text(modifier).to_owned(), words.text(reference).to_owned());
        let modifier = if name == "inherit" { None } else { Some(self.modifier(&name, span)) };
        let target_span = words.span(reference);
        let target = self.modifier(&target, target_span);
        let id = words.text(id).to_owned();
        match (modifier, target) {
            (Some(None), _) | (_, None) => self.define(Definition::broken(&id, span)),
            (_, Some(None)) => self.define(Definition::pass(&id, span, None)),
            (None, Some(Some(target))) => {
                self.names.insert(id, target);
            }
            (Some(Some(modifier)), Some(Some(target))) => {
                let mut copy = self.definitions[target].clone();
                copy.name = id;
                copy.modifier = modifier;
                self.define(copy);
            }
        }
    }
}
