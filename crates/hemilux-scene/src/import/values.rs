//! The parts of a directive: strings, numbers, parameter lists, and what `-D` puts in their place.

use super::Env;
use super::lexer::{Kind, Token};
use super::params::{Param, TYPES, Type, Values};
use super::parser::{Parser, Read, Reported, is_directive};
use super::suggest::closest;
use crate::Span;
use std::cell::Cell;
use std::collections::HashSet;

/// Characters that `-D` may put into a scene.
const MAX_SUBSTITUTED: usize = 1 << 24;

impl Parser {
    /// A quoted string with its place.
    pub fn string(&mut self, what: &str) -> Read<(String, Span)> {
        let token = self.lexer().peek();
        if token.kind != Kind::Str {
            return self.expected(what, token);
        }
        self.lexer().consume(token);
        let span = self.span(token);
        Ok((self.string_value(token)?, span))
    }

    fn string_value(&mut self, token: Token) -> Read<String> {
        match self.lexer().unquote(token) {
            Ok(text) if text.contains('$') && !self.env.options.defines.is_empty() => {
                Ok(substitute(&self.env, &text))
            }
            Ok(text) => Ok(text),
            Err(c) => self.fail(token, format!("unknown escape \"\\{}\"", c.escape_debug())),
        }
    }

    /// A number, or what `$key` stands for.
    fn number(&mut self, token: Token, out: &mut Vec<f64>) -> Read<()> {
        let text = self.lexer().text(token);
        if let Some(v) = parse_number(text) {
            out.push(v);
            return Ok(());
        }
        if let Some(key) = text.strip_prefix('$') {
            let key = key.strip_prefix('{').and_then(|k| k.strip_suffix('}')).unwrap_or(key).to_owned();
            return self.defined_numbers(token, &key, out);
        }
        if text.parse::<f64>().is_ok_and(|v| v.is_finite()) {
            let message = format!("\"{text}\" is too large for single precision");
            return self.fail(token, message);
        }
        if text.parse::<f64>().is_ok() {
            let message = format!("\"{text}\" is not a finite number");
            return self.fail(token, message);
        }
        self.expected("a number", token)
    }

    fn defined_numbers(&mut self, token: Token, key: &str, out: &mut Vec<f64>) -> Read<()> {
        let value = self.define(token, key)?;
        for word in value.split_whitespace() {
            match parse_number(word) {
                Some(v) => out.push(v),
                None => {
                    let message = format!("${key} stands for \"{value}\", which is not a number");
                    return self.fail(token, message);
                }
            }
        }
        Ok(())
    }

    fn define(&mut self, token: Token, key: &str) -> Read<String> {
        let env = self.env.clone();
        let used = env.substituted.get();
        match env.define(key) {
            Some(v) if used + v.len() <= MAX_SUBSTITUTED => {
                env.substituted.set(used + v.len() + 1);
                Ok(v.to_owned())
            }
            Some(_) => self.fail(token, format!("${key} makes the scene too long")),
            None => {
                let span = self.span(token);
                let help = closest(key, env.options.defines.iter().map(|d| d.0.as_str()))
                    .map_or(format!("give it with -D {key}=VALUE"), |k| format!("did you mean \"{k}\"?"));
                env.log.error_help(span, format!("${key} is not defined"), help);
                Err(Reported)
            }
        }
    }

    /// Exactly `N` numbers, with or without brackets.
    pub fn numbers<const N: usize>(&mut self, directive: &str) -> Read<[f64; N]> {
        let mut out = Vec::with_capacity(N);
        let mut token = self.lexer().peek();
        let bracket = token.kind == Kind::Open;
        if bracket {
            self.lexer().consume(token);
        }
        while out.len() < N {
            token = self.lexer().peek();
            if token.kind != Kind::Word || is_directive(self.lexer().text(token)) {
                let found = self.describe(token);
                let n = out.len();
                return self.fail(token, format!("{directive} takes {N} numbers, found {found} after {n}"));
            }
            self.lexer().consume(token);
            self.number(token, &mut out)?;
        }
        if bracket {
            token = self.lexer().peek();
            if token.kind != Kind::Close {
                return self.expected("\"]\"", token);
            }
            self.lexer().consume(token);
        }
        match out.as_slice().try_into() {
            Ok(v) => Ok(v),
            Err(_) => self.fail(token, format!("{directive} takes {N} numbers, found {}", out.len())),
        }
    }

    /// The parameters that follow.
    pub fn params(&mut self) -> Read<Vec<Param>> {
        let mut list: Vec<Param> = Vec::new();
        // Long lists of repeated names would make the check quadratic.
        let mut names: HashSet<String> = HashSet::new();
        loop {
            let token = self.lexer().peek();
            match token.kind {
                Kind::Str => {}
                Kind::Unterminated => return self.expected("", token),
                _ => return Ok(list),
            }
            self.lexer().consume(token);
            let declaration = self.string_value(token)?;
            let whole = self.span(token);
            let mut words = declaration.split_whitespace();
            let (Some(ty), Some(name), None) = (words.next(), words.next(), words.next()) else {
                let shown = self.describe(token);
                let message = format!("a parameter is a type and a name in quotes, found {shown}");
                return self.fail(token, message);
            };
            let Some(&(_, ty)) = TYPES.iter().find(|t| t.0 == ty) else {
                let help = closest(ty, TYPES.iter().map(|t| t.0)).map(|k| format!("did you mean \"{k}\"?"));
                let message = format!("unknown parameter type \"{}\"", ty.escape_debug());
                self.env.log.unknown_help(whole, message, help);
                return Err(Reported);
            };
            let span = name_span(whole, &declaration, name);
            let (values, value_span) = self.values(ty)?;
            if !names.insert(name.to_owned()) {
                self.env.log.error(span, format!("parameter \"{name}\" is given twice"));
                continue;
            }
            list.push(Param {
                ty,
                name: name.to_owned(),
                span,
                value_span,
                values,
                space: self.builder.state.space,
                inherited: false,
                used: Cell::new(false),
            });
        }
    }

    /// One value, or several in brackets.
    fn values(&mut self, ty: Type) -> Read<(Values, Span)> {
        let mut token = self.lexer().next();
        let first = self.span(token);
        let bracket = token.kind == Kind::Open;
        let mut span = first;
        let (mut numbers, mut texts, mut bools) = (Vec::new(), Vec::new(), Vec::new());
        if bracket {
            token = self.lexer().next();
            span = self.span(token);
        }
        let what = if bracket { "a number or \"]\"" } else { "a number" };
        while !(bracket && token.kind == Kind::Close) {
            match (ty, token.kind) {
                (Type::Bool, Kind::Word | Kind::Str) => bools.push(self.boolean(token)?),
                (Type::Text | Type::Texture | Type::Spectrum, Kind::Str) if numbers.is_empty() => {
                    texts.push(self.string_value(token)?);
                }
                (Type::Text | Type::Texture, _) => return self.value_expected("a string in quotes", token),
                (_, Kind::Word) if texts.is_empty() => {
                    match parse_number(self.lexer().text(token)) {
                        Some(v) => numbers.push(v),
                        None if is_directive(self.lexer().text(token)) => {
                            return self.value_expected(what, token);
                        }
                        None => self.number(token, &mut numbers)?,
                    }
                    if ty == Type::Integer {
                        self.integral(token, &numbers)?;
                    }
                }
                _ => return self.value_expected(what, token),
            }
            if !bracket {
                break;
            }
            token = self.lexer().next();
        }
        let values = match ty {
            Type::Bool => Values::Bools(bools),
            Type::Text | Type::Texture => Values::Texts(texts),
            Type::Spectrum if !texts.is_empty() => Values::Texts(texts),
            _ => Values::Numbers(numbers),
        };
        Ok((values, span))
    }

    /// An error at a value; a directive in its place is not swallowed.
    fn value_expected<T>(&mut self, what: &str, token: Token) -> Read<T> {
        let result = self.expected(what, token);
        if token.kind == Kind::Word && is_directive(self.lexer().text(token)) {
            self.lexer().rewind(token);
        }
        result
    }

    fn integral(&mut self, token: Token, numbers: &[f64]) -> Read<()> {
        match numbers.last() {
            Some(v) if v.fract() != 0.0 => self.fail(token, format!("\"{v}\" is not an integer")),
            Some(&v) if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&v) => {
                self.fail(token, format!("\"{v}\" does not fit into 32 bits"))
            }
            _ => Ok(()),
        }
    }

    fn boolean(&mut self, token: Token) -> Read<bool> {
        let text = self.lexer().text(token).trim_matches('"').to_owned();
        let text = match text.strip_prefix('$') {
            Some(key) => {
                let key = key.strip_prefix('{').and_then(|k| k.strip_suffix('}')).unwrap_or(key);
                self.define(token, key)?
            }
            None => text,
        };
        match text.trim() {
            "true" => Ok(true),
            "false" => Ok(false),
            _ => self.value_expected("true or false", token),
        }
    }
}

/// A number that is finite in single precision, too.
fn parse_number(text: &str) -> Option<f64> {
    text.parse().ok().filter(|v: &f64| (*v as f32).is_finite())
}

/// The span of the name inside the quotes of a declaration.
fn name_span(whole: Span, declaration: &str, name: &str) -> Span {
    let offset = declaration.rfind(name).unwrap_or(0);
    let before = declaration[..offset].chars().count() as u32;
    let length = name.chars().count() as u32;
    // Escapes make the source longer than the string; then point at the whole.
    if declaration.chars().count() as u32 + 2 != whole.length {
        return whole;
    }
    Span { column: whole.column + 1 + before, length, ..whole }
}

/// Replace `$key` and `${key}` of known keys within a string; leave the rest.
fn substitute(env: &Env, text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(i) = rest.find('$') {
        out += &rest[..i];
        rest = &rest[i + 1..];
        let (key, after) = match rest.strip_prefix('{').and_then(|r| r.split_once('}')) {
            Some((key, after)) => (key, after),
            None => {
                let end =
                    rest.find(|c: char| !(c.is_alphanumeric() || c == '_' || c == '-')).unwrap_or(rest.len());
                rest.split_at(end)
            }
        };
        match env.define(key) {
            Some(v) if out.len() + v.len() < MAX_SUBSTITUTED => {
                out += v;
                rest = after;
            }
            _ => out.push('$'),
        }
    }
    out + rest
}
