//! Parameter lists of pbrt: typed, named values that remember whether anybody asked for them. What nobody asked for is
//! reported, with the closest name that was asked for.

use super::colour::{ColourSpace, Meaning};
use super::log::Log;
use super::{Env, colour, spectra};
use crate::geom::{DVec2, DVec3};
use crate::{FloatParam, Rgb, RgbParam, Span, TextureId};
use std::cell::{Cell, RefCell};
use std::collections::HashMap;
use std::rc::Rc;

/// The type a parameter declares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    /// `integer`
    Integer,
    /// `float`
    Float,
    /// `point2`
    Point2,
    /// `vector2`
    Vector2,
    /// `point3`, `point`
    Point3,
    /// `vector3`, `vector`
    Vector3,
    /// `normal3`, `normal`
    Normal3,
    /// `rgb`
    Rgb,
    /// `spectrum`
    Spectrum,
    /// `blackbody`
    Blackbody,
    /// `bool`
    Bool,
    /// `string`
    Text,
    /// `texture`
    Texture,
}

/// The spellings of the types.
pub const TYPES: [(&str, Type); 16] = [
    ("integer", Type::Integer),
    ("float", Type::Float),
    ("point2", Type::Point2),
    ("vector2", Type::Vector2),
    ("point3", Type::Point3),
    ("point", Type::Point3),
    ("vector3", Type::Vector3),
    ("vector", Type::Vector3),
    ("normal3", Type::Normal3),
    ("normal", Type::Normal3),
    ("rgb", Type::Rgb),
    ("spectrum", Type::Spectrum),
    ("blackbody", Type::Blackbody),
    ("bool", Type::Bool),
    ("string", Type::Text),
    ("texture", Type::Texture),
];

impl Type {
    /// The first spelling.
    pub fn name(self) -> &'static str {
        TYPES.iter().find(|t| t.1 == self).map_or("?", |t| t.0)
    }
}

/// The values of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Every numeric type.
    Numbers(Vec<f64>),
    /// Strings; names of textures and spectra.
    Texts(Vec<String>),
    /// Truth values.
    Bools(Vec<bool>),
}

impl Values {
    fn len(&self) -> usize {
        match self {
            Values::Numbers(v) => v.len(),
            Values::Texts(v) => v.len(),
            Values::Bools(v) => v.len(),
        }
    }
}

/// One parameter.
#[derive(Clone, Debug)]
pub struct Param {
    /// Declared type.
    pub ty: Type,
    /// Name.
    pub name: String,
    /// Of the name.
    pub span: Span,
    /// Of the first value.
    pub value_span: Span,
    /// Values.
    pub values: Values,
    /// In which RGB values are meant.
    pub space: ColourSpace,
    /// Came from an `Attribute` directive: may stay unused.
    pub inherited: bool,
    /// Whether anybody asked.
    pub used: Cell<bool>,
}

/// Named textures of one kind.
pub type TextureNames = HashMap<Rc<str>, TextureId>;

/// A parameter list and whose it is.
#[derive(Clone, Debug)]
pub struct Params {
    /// Whose: `material "conductor"`, for messages.
    pub owner: String,
    /// Of the owner's name.
    pub span: Span,
    /// The parameters, in the order of the file.
    pub items: Vec<Param>,
    asked: RefCell<Vec<&'static str>>,
}

impl Params {
    /// A list.
    pub fn new(owner: String, span: Span, items: Vec<Param>) -> Self {
        Params { owner, span, items, asked: RefCell::default() }
    }

    /// Add what `Attribute` set, unless given.
    pub fn inherit(&mut self, attributes: &[Param]) {
        for a in attributes {
            if !self.items.iter().any(|p| p.name == a.name) {
                let p = Param { inherited: true, used: Cell::new(false), ..a.clone() };
                self.items.push(p);
            }
        }
    }

    /// Whether a parameter of this name is given; does not count as asking.
    pub fn has(&self, name: &str) -> bool {
        self.items.iter().any(|p| p.name == name)
    }

    /// Where the parameter is, or the owner.
    pub fn span_of(&self, name: &str) -> Span {
        self.items.iter().find(|p| p.name == name).map_or(self.span, |p| p.span)
    }

    /// Where the value of the parameter is, or the owner.
    pub fn value_span(&self, name: &str) -> Span {
        self.items.iter().find(|p| p.name == name).map_or(self.span, |p| p.value_span)
    }

    /// The parameter `name` if it has one of the types; another type is reported.
    pub fn find(&self, log: &Log, name: &'static str, types: &[Type]) -> Option<&Param> {
        if !self.asked.borrow().contains(&name) {
            self.asked.borrow_mut().push(name);
        }
        let p = self.items.iter().find(|p| p.name == name)?;
        let first = !p.used.replace(true);
        if types.contains(&p.ty) {
            return Some(p);
        }
        if first {
            let mut wanted: Vec<&str> = types.iter().map(|t| t.name()).collect();
            wanted.dedup();
            log.unknown(
                p.span,
                format!(
                    "parameter \"{name}\" of {} must be {}, not {}",
                    self.owner,
                    wanted.join(" or "),
                    p.ty.name()
                ),
            );
        }
        None
    }

    /// Accept parameters that mean nothing here.
    pub fn ignore(&self, names: &[&'static str]) {
        for &name in names {
            if !self.asked.borrow().contains(&name) {
                self.asked.borrow_mut().push(name);
            }
            if let Some(p) = self.items.iter().find(|p| p.name == name) {
                p.used.set(true);
            }
        }
    }

    /// Accept everything.
    pub fn ignore_all(&self) {
        self.items.iter().for_each(|p| p.used.set(true));
    }

    /// Report the parameters that nobody asked for.
    pub fn finish(&self, log: &Log) {
        for p in &self.items {
            if !p.used.get() && !p.inherited {
                log.unknown_among(
                    p.span,
                    format!("unknown parameter \"{}\" for {}", p.name, self.owner),
                    &p.name,
                    self.asked.borrow().iter().copied(),
                );
            }
        }
    }

    fn count(&self, log: &Log, p: &Param, wanted: usize) -> bool {
        let n = p.values.len();
        if n == wanted {
            return true;
        }
        let s = if wanted == 1 { "" } else { "s" };
        log.unknown(
            p.span,
            format!("parameter \"{}\" of {} takes {wanted} value{s}, not {n}", p.name, self.owner),
        );
        false
    }

    fn numbers(&self, log: &Log, name: &'static str, types: &[Type]) -> Option<(&Param, &[f64])> {
        let p = self.find(log, name, types)?;
        match &p.values {
            Values::Numbers(v) => Some((p, v)),
            _ => None,
        }
    }

    fn fixed<const N: usize>(&self, log: &Log, name: &'static str, ty: Type) -> Option<[f64; N]> {
        let (p, v) = self.numbers(log, name, &[ty])?;
        if !self.count(log, p, N) {
            return None;
        }
        v.try_into().ok()
    }

    /// One float.
    pub fn float_opt(&self, log: &Log, name: &'static str) -> Option<f64> {
        self.fixed::<1>(log, name, Type::Float).map(|[v]| v)
    }

    /// One float, or its default.
    pub fn float(&self, log: &Log, name: &'static str, default: f64) -> f64 {
        self.float_opt(log, name).unwrap_or(default)
    }

    /// One float that must satisfy `ok`, which `what` puts in words ("positive").
    pub fn float_in(
        &self,
        log: &Log,
        name: &'static str,
        default: f64,
        what: &str,
        ok: impl Fn(f64) -> bool,
    ) -> f64 {
        let v = self.float(log, name, default);
        if ok(v) {
            return v;
        }
        log.error(
            self.value_span(name),
            format!("parameter \"{name}\" of {} must be {what}, not {v}", self.owner),
        );
        default
    }

    /// One positive float.
    pub fn positive(&self, log: &Log, name: &'static str, default: f64) -> f64 {
        self.float_in(log, name, default, "positive", |v| v as f32 > 0.0)
    }

    /// One float ≥ 0.
    pub fn not_negative(&self, log: &Log, name: &'static str, default: f64) -> f64 {
        self.float_in(log, name, default, "zero or positive", |v| v >= 0.0)
    }

    /// One integer.
    pub fn integer_opt(&self, log: &Log, name: &'static str) -> Option<i32> {
        self.fixed::<1>(log, name, Type::Integer).map(|[v]| v as i32)
    }

    /// One truth value, or its default.
    pub fn boolean(&self, log: &Log, name: &'static str, default: bool) -> bool {
        let Some(p) = self.find(log, name, &[Type::Bool]) else { return default };
        match &p.values {
            Values::Bools(v) if self.count(log, p, 1) => v[0],
            _ => default,
        }
    }

    /// Strings.
    pub fn texts(&self, log: &Log, name: &'static str) -> Option<&[String]> {
        match &self.find(log, name, &[Type::Text])?.values {
            Values::Texts(v) => Some(v),
            _ => None,
        }
    }

    /// One string.
    pub fn text(&self, log: &Log, name: &'static str) -> Option<&str> {
        let p = self.find(log, name, &[Type::Text])?;
        match &p.values {
            Values::Texts(v) if self.count(log, p, 1) => Some(&v[0]),
            _ => None,
        }
    }

    /// One of several words; another is reported.
    pub fn choice<T: Copy>(
        &self,
        log: &Log,
        name: &'static str,
        default: T,
        choices: &[(&'static str, T)],
    ) -> T {
        let Some(text) = self.text(log, name) else { return default };
        if let Some(c) = choices.iter().find(|c| c.0 == text) {
            return c.1;
        }
        log.unknown_among(
            self.value_span(name),
            format!("unknown {name} \"{text}\" for {}", self.owner),
            text,
            choices.iter().map(|c| c.0),
        );
        default
    }

    /// Exactly `N` floats.
    pub fn floats_n<const N: usize>(&self, log: &Log, name: &'static str) -> Option<[f64; N]> {
        self.fixed(log, name, Type::Float)
    }

    /// Integers, any number.
    pub fn integers(&self, log: &Log, name: &'static str) -> Option<&[f64]> {
        self.numbers(log, name, &[Type::Integer]).map(|(_, v)| v)
    }

    /// Exactly `N` integers.
    pub fn integers_n<const N: usize>(&self, log: &Log, name: &'static str) -> Option<[i32; N]> {
        self.fixed::<N>(log, name, Type::Integer).map(|v| v.map(|x| x as i32))
    }

    /// Tuples of `N`, any number of them.
    pub fn tuples<const N: usize>(
        &self,
        log: &Log,
        name: &'static str,
        types: &[Type],
    ) -> Option<Vec<[f64; N]>> {
        let (p, v) = self.numbers(log, name, types)?;
        let (tuples, rest) = v.as_chunks::<N>();
        if !rest.is_empty() {
            log.unknown(
                p.span,
                format!(
                    "parameter \"{name}\" of {} takes multiples of {N} values, not {}",
                    self.owner,
                    v.len()
                ),
            );
            return None;
        }
        Some(tuples.to_vec())
    }

    /// One point.
    pub fn point3(&self, log: &Log, name: &'static str, default: DVec3) -> DVec3 {
        self.fixed::<3>(log, name, Type::Point3).map_or(default, DVec3::from)
    }

    /// One vector.
    pub fn vector3(&self, log: &Log, name: &'static str, default: DVec3) -> DVec3 {
        self.fixed::<3>(log, name, Type::Vector3).map_or(default, DVec3::from)
    }

    /// One 2-D float pair under two names.
    pub fn pair(&self, log: &Log, x: &'static str, y: &'static str, default: f64) -> DVec2 {
        DVec2::new(self.float(log, x, default), self.float(log, y, default))
    }

    /// A spectral value given in any of the ways pbrt has.
    pub fn spectrum(&self, env: &Env, name: &'static str, meaning: Meaning) -> Option<Rgb> {
        let p = self.find(&env.log, name, &[Type::Rgb, Type::Spectrum, Type::Blackbody])?;
        self.spectral_value(env, p, meaning)
    }

    fn spectral_value(&self, env: &Env, p: &Param, meaning: Meaning) -> Option<Rgb> {
        let log = &env.log;
        match (p.ty, &p.values) {
            (Type::Rgb, Values::Numbers(v)) => {
                if !self.count(log, p, 3) {
                    return None;
                }
                if v.iter().any(|&x| x < 0.0) {
                    let message =
                        format!("parameter \"{}\" of {} has a negative component", p.name, self.owner);
                    log.error(p.value_span, message);
                    return None;
                }
                if meaning == Meaning::Albedo && v.iter().any(|&x| x > 1.0) {
                    log.warning(
                        p.value_span,
                        format!("parameter \"{}\" of {} exceeds 1: clamped", p.name, self.owner),
                    );
                }
                Some(colour::from_rgb(p.space, [v[0], v[1], v[2]], meaning))
            }
            (Type::Blackbody, Values::Numbers(v)) => {
                if !self.count(log, p, 1) {
                    return None;
                }
                if !(v[0] >= 100.0 && v[0] <= 1e7) {
                    log.error(
                        p.value_span,
                        format!("temperature must be between 100 and 10,000,000 K, not {}", v[0]),
                    );
                    return None;
                }
                Some(spectra::blackbody(v[0]))
            }
            (Type::Spectrum, Values::Numbers(v)) => match spectra::from_pairs(v, meaning) {
                Ok(c) => Some(c),
                Err(e) => {
                    log.unknown(p.span, format!("parameter \"{}\" of {}: {e}", p.name, self.owner));
                    None
                }
            },
            (Type::Spectrum, Values::Texts(v)) => {
                if !self.count(log, p, 1) {
                    return None;
                }
                spectra::named_or_file(env, &v[0], p.value_span, meaning)
            }
            _ => None,
        }
    }

    /// A spectral value or a texture.
    pub fn rgb_param(
        &self,
        env: &Env,
        names: &TextureNames,
        name: &'static str,
        meaning: Meaning,
    ) -> Option<RgbParam> {
        let types = [Type::Rgb, Type::Spectrum, Type::Blackbody, Type::Texture];
        let p = self.find(&env.log, name, &types)?;
        match p.ty {
            Type::Texture => self.texture(env, names, p, "spectrum").map(RgbParam::Texture),
            _ => self.spectral_value(env, p, meaning).map(RgbParam::Constant),
        }
    }

    /// A float or a texture.
    pub fn float_param(&self, env: &Env, names: &TextureNames, name: &'static str) -> Option<FloatParam> {
        let p = self.find(&env.log, name, &[Type::Float, Type::Texture])?;
        match &p.values {
            Values::Texts(_) => self.texture(env, names, p, "float").map(FloatParam::Texture),
            Values::Numbers(v) if self.count(&env.log, p, 1) => Some(FloatParam::Constant(v[0] as f32)),
            _ => None,
        }
    }

    fn texture(&self, env: &Env, names: &TextureNames, p: &Param, kind: &str) -> Option<TextureId> {
        let Values::Texts(v) = &p.values else { return None };
        if !self.count(&env.log, p, 1) {
            return None;
        }
        if let Some(&id) = names.get(v[0].as_str()) {
            return Some(id);
        }
        env.log.unknown_among(
            p.value_span,
            format!("{kind} texture \"{}\" is not defined", v[0]),
            &v[0],
            names.keys().map(|k| &**k),
        );
        None
    }
}
