//! What the generator commands write, as scene text: `genbox`, `genprism`, `gensurf`, `genrev`, `genworm`. Orientations are those of the originals: the shapes that they make differ in which side is out.

use super::expr::{Expr, Scope, parse};
use super::transform::Wrong;
use super::{Argument, Reader, generate_sky};
use crate::geom::{DVec2, DVec3};
use std::fmt::Write;

pub type Made = Result<String, Wrong>;

/// Segments of curves, facets of surfaces along one side.
const MAX_SEGMENTS: u64 = 65_536;
/// Characters that one primitive may take.
const PRIMITIVE: usize = 400;

/// The text that `arguments` (program name first) write, of at most `budget` characters.
pub fn run(reader: &mut Reader, name: &str, arguments: &[Argument], budget: usize) -> Made {
    let mut a = Arguments { all: arguments, at: 1, program: name };
    match name {
        "genbox" => genbox(&mut a),
        "genprism" => genprism(reader, &mut a),
        "gensurf" => gensurf(reader, &mut a, budget),
        "genrev" => genrev(reader, &mut a, budget),
        "genworm" => genworm(reader, &mut a, budget),
        "gensky" => generate_sky::gensky(reader, &mut a),
        _ => generate_sky::gendaylit(reader, &mut a),
    }
}

/// The arguments of a command, read in order.
pub struct Arguments<'a> {
    pub all: &'a [Argument],
    pub at: usize,
    pub program: &'a str,
}

impl<'a> Arguments<'a> {
    pub fn peek(&self) -> Option<&'a Argument> {
        self.all.get(self.at)
    }

    pub fn fail<T>(&self, i: usize, message: impl Into<String>) -> Result<T, Wrong> {
        Err(Wrong(i.min(self.all.len().saturating_sub(1)), message.into()))
    }

    pub fn next(&mut self, what: &str) -> Result<&'a Argument, Wrong> {
        match self.all.get(self.at) {
            Some(a) => {
                self.at += 1;
                Ok(a)
            }
            None => self.fail(self.at, format!("{} lacks {what}", self.program)),
        }
    }

    pub fn number(&mut self, what: &str) -> Result<f64, Wrong> {
        let text = &self.next(what)?.text;
        match text.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(v),
            _ => self
                .fail(self.at - 1, format!("{what} of {}: \"{text}\" is not a finite number", self.program)),
        }
    }

    pub fn positive(&mut self, what: &str) -> Result<f64, Wrong> {
        let v = self.number(what)?;
        if v > 0.0 {
            return Ok(v);
        }
        self.fail(self.at - 1, format!("{what} of {} must be positive, not {v}", self.program))
    }

    pub fn count(&mut self, what: &str, least: u64, most: u64) -> Result<u64, Wrong> {
        let text = &self.next(what)?.text;
        match text.parse::<u64>() {
            Ok(n) if (least..=most).contains(&n) => Ok(n),
            Ok(n) => self.fail(
                self.at - 1,
                format!("{what} of {} must be between {least} and {most}, not {n}", self.program),
            ),
            Err(_) => {
                self.fail(self.at - 1, format!("{what} of {}: \"{text}\" is not a count", self.program))
            }
        }
    }

    /// A word that begins with a sign and is no number.
    pub fn option(&mut self) -> Result<Option<&'a str>, Wrong> {
        let Some(a) = self.peek() else { return Ok(None) };
        self.at += 1;
        Ok(Some(&a.text))
    }

    pub fn unknown<T>(&self) -> Result<T, Wrong> {
        let text = self.all.get(self.at - 1).map_or("", |a| a.text.as_str());
        self.fail(self.at - 1, format!("unknown option \"{text}\" of {}", self.program))
    }

    /// Modifier and name of what is made: words without white space.
    pub fn names(&mut self) -> Result<(String, String), Wrong> {
        let mut word = |what: &str| {
            let text = &self.next(what)?.text;
            let bad = text.is_empty()
                || text.chars().any(char::is_whitespace)
                || text.starts_with(['!', '#', '"', '\'']);
            if bad {
                return self
                    .fail(self.at - 1, format!("{what} of {}: \"{text}\" is not a name", self.program));
            }
            Ok(text.clone())
        };
        Ok((word("a modifier")?, word("a name")?))
    }
}

/// Text of primitives of one modifier.
struct Output {
    text: String,
    modifier: String,
    name: String,
}

impl Output {
    fn new(names: (String, String)) -> Output {
        Output { text: String::new(), modifier: names.0, name: names.1 }
    }

    fn primitive(&mut self, kind: &str, suffix: &str, numbers: &[f64]) {
        let _ = write!(self.text, "{} {kind} {}.{suffix} 0 0 {}", self.modifier, self.name, numbers.len());
        for v in numbers {
            let _ = write!(self.text, " {v}");
        }
        self.text.push('\n');
    }

    fn polygon(&mut self, suffix: &str, points: &[DVec3]) {
        let numbers: Vec<f64> = points.iter().flat_map(|p| p.to_array()).collect();
        self.primitive("polygon", suffix, &numbers);
    }

    /// A conical surface around `axis0`–`axis1`, or the cylinder or ring that it degenerates to.
    fn frustum(&mut self, suffix: &str, a: DVec3, b: DVec3, r0: f64, r1: f64) {
        let n = [a.x, a.y, a.z, b.x, b.y, b.z];
        if r0 == r1 {
            self.primitive("cylinder", suffix, &[&n[..], &[r0]].concat());
        } else {
            self.primitive("cone", suffix, &[&n[..], &[r0, r1]].concat());
        }
    }
}

fn genbox(a: &mut Arguments) -> Made {
    let mut out = Output::new(a.names()?);
    let (x, y, z) = (a.positive("a size")?, a.positive("a size")?, a.positive("a size")?);
    let (mut inward, mut bevel, mut round) = (false, 0.0, 0.0);
    while let Some(option) = a.option()? {
        match option {
            "-i" => inward = true,
            "-b" => bevel = a.positive("a bevel")?,
            "-r" => round = a.positive("a radius")?,
            _ => return a.unknown(),
        }
    }
    let m = if bevel > 0.0 { bevel } else { round };
    if 2.0 * m >= x.min(y).min(z) {
        return a.fail(a.at - 1, "genbox: the rounding is larger than the box");
    }
    let size = DVec3::new(x, y, z);
    // Coordinate of corner bit b at inset m along axis k.
    let at = |bits: usize, insets: [f64; 3]| {
        DVec3::from_array([0, 1, 2].map(|k| if bits >> k & 1 == 1 { size[k] - insets[k] } else { insets[k] }))
    };
    let mut faces: Vec<Vec<DVec3>> = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut inset = [m; 3];
        inset[axis] = 0.0;
        for side in [0, 1 << axis] {
            faces.push([0, 1 << u, 1 << u | 1 << v, 1 << v].map(|bits| at(bits | side, inset)).to_vec());
        }
    }
    if m > 0.0 {
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for side in [0, 1 << u, 1 << v, 1 << u | 1 << v] {
                if bevel > 0.0 {
                    let (mut on_u, mut on_v) = ([m; 3], [m; 3]);
                    (on_u[u], on_v[v]) = (0.0, 0.0);
                    let (low, high) = (side, side | 1 << axis);
                    faces.push(vec![at(low, on_u), at(high, on_u), at(high, on_v), at(low, on_v)]);
                } else {
                    let (p, q) = (at(side, [m; 3]), at(side | 1 << axis, [m; 3]));
                    let kind = if inward { "tube" } else { "cylinder" };
                    let numbers = [&p.to_array()[..], &q.to_array()[..], &[m]].concat();
                    out.primitive(kind, &format!("e{axis}{side}"), &numbers);
                }
            }
        }
        for corner in 0..8 {
            if bevel > 0.0 {
                let p = [0, 1, 2].map(|k| {
                    let mut inset = [m; 3];
                    inset[k] = 0.0;
                    at(corner, inset)
                });
                faces.push(p.to_vec());
            } else {
                let p = at(corner, [m; 3]);
                let kind = if inward { "bubble" } else { "sphere" };
                out.primitive(kind, &format!("c{corner}"), &[p.x, p.y, p.z, m]);
            }
        }
    }
    for (i, face) in faces.iter_mut().enumerate() {
        let normal = super::polygon::area_vector(face);
        let out_of = face.iter().sum::<DVec3>() / face.len() as f64 - size * 0.5;
        if (normal.dot(out_of) < 0.0) != inward {
            face.reverse();
        }
        out.polygon(&format!("f{i}"), face);
    }
    Ok(out.text)
}

fn genprism(reader: &mut Reader, a: &mut Arguments) -> Made {
    let mut out = Output::new(a.names()?);
    let first = a.next("its vertices")?;
    let mut points: Vec<DVec2> = Vec::new();
    if let Ok(n) = first.text.parse::<u64>() {
        if !(3..=100_000).contains(&n) {
            return a.fail(a.at - 1, format!("genprism takes between 3 and 100000 vertices, not {n}"));
        }
        for _ in 0..n {
            points.push(DVec2::new(a.number("a coordinate")?, a.number("a coordinate")?));
        }
    } else if first.text == "-" {
        return a.fail(a.at - 1, "genprism: vertices from standard input are not supported");
    } else {
        let numbers = numbers_of(reader, first, a)?;
        points.extend(numbers.chunks_exact(2).map(|c| DVec2::new(c[0], c[1])));
        if points.len() < 3 {
            return a.fail(a.at - 1, "genprism takes at least 3 vertices");
        }
    }
    let mut l = DVec3::Z;
    let (mut ends, mut closed) = (true, true);
    while let Some(option) = a.option()? {
        match option {
            "-l" => {
                l = DVec3::new(a.number("a length")?, a.number("a length")?, a.number("a length")?);
                if l.z == 0.0 {
                    return a.fail(a.at - 1, "genprism: the prism has no height");
                }
            }
            "-e" => ends = false,
            "-c" => closed = false,
            "-r" => return a.fail(a.at - 1, "genprism: rounded edges (-r) are not supported"),
            _ => return a.unknown(),
        }
    }
    let n = points.len();
    let low: Vec<DVec3> = points.iter().map(|p| p.extend(0.0)).collect();
    let high: Vec<DVec3> = low.iter().map(|p| *p + l).collect();
    if ends {
        out.polygon("b", &low);
        out.polygon("t", &high.iter().rev().copied().collect::<Vec<_>>());
    }
    let sides = if closed { n } else { n - 1 };
    for i in 0..sides {
        let j = (i + 1) % n;
        if low[i] != low[j] {
            out.polygon(&format!("{}", i + 1), &[low[i], high[i], high[j], low[j]]);
        }
    }
    Ok(out.text)
}

/// All numbers of a data file.
fn numbers_of(reader: &mut Reader, name: &Argument, a: &Arguments) -> Result<Vec<f64>, Wrong> {
    let Some((text, ..)) = reader.file_text(name) else {
        // Reported where the file was looked for.
        return Ok(Vec::new());
    };
    let mut numbers = Vec::new();
    for word in text.split_whitespace() {
        match word.parse::<f64>() {
            Ok(v) if v.is_finite() => numbers.push(v),
            _ => return a.fail(a.at - 1, format!("{}: \"{word}\" is not a finite number", name.text)),
        }
    }
    Ok(numbers)
}

/// Options of the generators that know expressions: definitions, smoothing.
fn definitions(reader: &mut Reader, a: &mut Arguments, scope: &mut Scope) -> Result<(), Wrong> {
    while let Some(option) = a.option()? {
        match option {
            "-e" => {
                let text = &a.next("a definition")?.text;
                scope.define(text).or_else(|e| a.fail(a.at - 1, format!("{}: {e}", a.program)))?;
            }
            "-f" => {
                let file = a.next("a file")?;
                if let Some((text, ..)) = reader.file_text(file) {
                    let text = without_comments(&text);
                    scope.define(&text).or_else(|e| a.fail(a.at - 1, format!("{}: {e}", file.text)))?;
                }
            }
            "-s" => {
                let span = a.all[a.at - 1].span;
                let message = format!("{}: smoothing (-s) is left out, facets stay flat", a.program);
                reader.env.log.warning(span, message);
            }
            _ => return a.unknown(),
        }
    }
    Ok(())
}

/// Without `{ ... }`.
fn without_comments(text: &str) -> String {
    let mut depth = 0;
    let keep = text.chars().filter(|c| {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => {
                depth -= 1;
                return false;
            }
            _ => {}
        }
        depth == 0
    });
    keep.collect()
}

fn expression(a: &mut Arguments, what: &str) -> Result<(usize, Expr), Wrong> {
    let text = &a.next(what)?.text;
    match parse(text) {
        Ok(e) => Ok((a.at - 1, e)),
        Err(e) => a.fail(a.at - 1, format!("{what} of {}: {e}", a.program)),
    }
}

fn evaluate(a: &Arguments, scope: &Scope, (i, e): &(usize, Expr)) -> Result<f64, Wrong> {
    scope.value(e).or_else(|e| a.fail(*i, format!("{}: {e}", a.program)))
}

fn fits(a: &Arguments, primitives: u64, budget: usize) -> Result<(), Wrong> {
    if primitives.saturating_mul(PRIMITIVE as u64) > budget as u64 {
        return a.fail(0, format!("{} makes more than the memory limit", a.program));
    }
    Ok(())
}

/// Values at `n` + 1 places: an expression in `t`, or the numbers of a file.
fn gensurf(reader: &mut Reader, a: &mut Arguments, budget: usize) -> Made {
    let mut out = Output::new(a.names()?);
    let start = a.at;
    for what in ["x(s,t)", "y(s,t)", "z(s,t)"] {
        a.next(what)?;
    }
    let m = a.count("the first count", 1, MAX_SEGMENTS)? as usize;
    let n = a.count("the second count", 1, MAX_SEGMENTS)? as usize;
    fits(a, 2 * m as u64 * n as u64, budget)?;
    let mut scope = Scope::default();
    definitions(reader, a, &mut scope)?;
    let mut grid: [Vec<f64>; 3] = Default::default();
    for k in 0..3 {
        let argument = &a.all[start + k];
        let source = parse(&argument.text);
        let file = reader.env.resolve(&argument.text, argument.span.file).is_file();
        if file {
            let numbers = numbers_of(reader, argument, a)?;
            // A file of three columns is all three coordinates.
            let (same, wanted) =
                (a.all[start..start + 3].iter().all(|o| o.text == argument.text), (m + 1) * (n + 1));
            grid[k] = match numbers.len() {
                l if l == wanted => numbers,
                l if same && l == 3 * wanted => numbers.chunks_exact(3).map(|c| c[k]).collect(),
                l => {
                    let message = format!("{}: expected {wanted} numbers, found {l}", argument.text);
                    return a.fail(start + k, message);
                }
            };
            continue;
        }
        let e = source.or_else(|e| a.fail(start + k, format!("gensurf: {e}")))?;
        grid[k].reserve((m + 1) * (n + 1));
        for i in 0..=m {
            scope.set("s", i as f64 / m as f64);
            for j in 0..=n {
                scope.set("t", j as f64 / n as f64);
                grid[k].push(evaluate(a, &scope, &(start + k, e.clone()))?);
            }
        }
    }
    let valid = match scope.has("valid") {
        false => vec![true; (m + 1) * (n + 1)],
        true => {
            let mut all = Vec::with_capacity((m + 1) * (n + 1));
            let e = parse("valid(s,t)").or_else(|e| a.fail(0, e))?;
            for i in 0..=m {
                scope.set("s", i as f64 / m as f64);
                for j in 0..=n {
                    scope.set("t", j as f64 / n as f64);
                    all.push(evaluate(a, &scope, &(0, e.clone()))? > 0.0);
                }
            }
            all
        }
    };
    let point = |i: usize, j: usize| {
        let k = i * (n + 1) + j;
        DVec3::new(grid[0][k], grid[1][k], grid[2][k])
    };
    let mut number = 0;
    for i in 0..m {
        for j in 0..n {
            let corners = [(i + 1, j), (i + 1, j + 1), (i, j + 1), (i, j)];
            let kept: Vec<DVec3> =
                corners.iter().filter(|(p, q)| valid[p * (n + 1) + q]).map(|(p, q)| point(*p, *q)).collect();
            for facet in facets(&kept) {
                number += 1;
                out.polygon(&number.to_string(), &facet);
            }
        }
    }
    Ok(out.text)
}

/// A quadrilateral as one polygon if it is planar, or else as two triangles; nothing of what has no area.
fn facets(p: &[DVec3]) -> Vec<Vec<DVec3>> {
    let has_area = |q: &[DVec3]| {
        let size2 = q.iter().map(|v| (*v - q[0]).length_squared()).fold(0.0, f64::max);
        super::polygon::area_vector(q).length() > 1e-12 * size2
    };
    let list = match p {
        [a, b, c, d] => {
            let area = super::polygon::area_vector(p);
            let normal = area.normalize_or_zero();
            if super::polygon::out_of_plane(p, normal) < 1e-6 {
                vec![p.to_vec()]
            } else {
                vec![vec![*a, *b, *d], vec![*d, *b, *c]]
            }
        }
        [_, _, _] => vec![p.to_vec()],
        _ => Vec::new(),
    };
    list.into_iter().filter(|q| has_area(q)).collect()
}

fn genrev(reader: &mut Reader, a: &mut Arguments, budget: usize) -> Made {
    let mut out = Output::new(a.names()?);
    let (z, r) = (expression(a, "z(t)")?, expression(a, "r(t)")?);
    let n = a.count("the number of segments", 1, MAX_SEGMENTS)?;
    fits(a, n, budget)?;
    let mut scope = Scope::default();
    definitions(reader, a, &mut scope)?;
    let mut at = |i: u64| {
        scope.set("t", i as f64 / n as f64);
        Ok::<_, Wrong>((evaluate(a, &scope, &z)?, evaluate(a, &scope, &r)?))
    };
    let (mut z0, mut r0) = at(0)?;
    for i in 1..=n {
        let (z1, r1) = at(i)?;
        let suffix = i.to_string();
        // As small as rounding counts as none.
        let tiny = 1e-9 * (r0.abs() + r1.abs() + z0.abs() + z1.abs());
        if (r0 < -tiny) || (r1 < -tiny) {
            return a.fail(r.0, "genrev: a negative radius");
        }
        let (r0c, r1c) = (if r0 < tiny { 0.0 } else { r0 }, if r1 < tiny { 0.0 } else { r1 });
        if (z1 - z0).abs() <= tiny {
            if (r1c - r0c).abs() > tiny {
                // Outward is the side on the left of the curve.
                let up = if r1c > r0c { -1.0 } else { 1.0 };
                out.primitive("ring", &suffix, &[0.0, 0.0, z0, 0.0, 0.0, up, r0c, r1c]);
            }
        } else if r0c > 0.0 || r1c > 0.0 {
            let outward = z1 > z0;
            let cylinder = (r1c - r0c).abs() <= tiny;
            let (kind, radii) = match (cylinder, outward) {
                (true, true) => ("cylinder", vec![r0c]),
                (true, false) => ("tube", vec![r0c]),
                (false, true) => ("cone", vec![r0c, r1c]),
                (false, false) => ("cup", vec![r0c, r1c]),
            };
            out.primitive(kind, &suffix, &[&[0.0, 0.0, z0, 0.0, 0.0, z1][..], &radii].concat());
        }
        (z0, r0) = (z1, r1);
    }
    Ok(out.text)
}

fn genworm(reader: &mut Reader, a: &mut Arguments, budget: usize) -> Made {
    let mut out = Output::new(a.names()?);
    let curve =
        [expression(a, "x(t)")?, expression(a, "y(t)")?, expression(a, "z(t)")?, expression(a, "r(t)")?];
    let n = a.count("the number of segments", 1, MAX_SEGMENTS)?;
    fits(a, 2 * n, budget)?;
    let mut scope = Scope::default();
    definitions(reader, a, &mut scope)?;
    let mut at = |i: u64| {
        scope.set("t", i as f64 / n as f64);
        let mut v = [0.0; 4];
        for (v, e) in v.iter_mut().zip(&curve) {
            *v = evaluate(a, &scope, e)?;
        }
        if v[3] <= 0.0 {
            return a.fail(curve[3].0, "genworm: the radius must be positive");
        }
        Ok((DVec3::new(v[0], v[1], v[2]), v[3]))
    };
    let (mut p, mut r) = at(0)?;
    out.primitive("sphere", "s0", &[p.x, p.y, p.z, r]);
    for i in 1..=n {
        let (q, s) = at(i)?;
        if (q - p).length() > (s - r).abs() {
            // Tangent to both spheres: the circles of contact.
            let d = q - p;
            let slope = (r - s) / d.length_squared();
            let narrow = (1.0 - (r - s) * slope).max(0.0).sqrt();
            let (a, b) = (p + d * (slope * r), q + d * (slope * s));
            if a != b {
                out.frustum(&format!("c{i}"), a, b, r * narrow, s * narrow);
            }
        }
        out.primitive("sphere", &format!("s{i}"), &[q.x, q.y, q.z, s]);
        (p, r) = (q, s);
    }
    Ok(out.text)
}
