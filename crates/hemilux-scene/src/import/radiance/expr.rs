//! The arithmetic of generator commands: numbers, variables, functions, `+ - * / ^`, parentheses; definitions
//! `name = expression`, `name(a, b) = expression`. A name defined later replaces the earlier one.

use std::collections::HashMap;
use std::rc::Rc;

/// Expressions inside one another, and functions that call functions.
const MAX_DEPTH: usize = 64;
/// Operations of one evaluation.
const MAX_STEPS: u32 = 100_000;
/// Nodes of one expression.
const MAX_NODES: usize = 10_000;

/// A parsed expression.
#[derive(Clone, Debug, PartialEq)]
pub enum Expr {
    Number(f64),
    Name(String),
    Call(String, Vec<Expr>),
    Negative(Box<Expr>),
    Binary(char, Box<Expr>, Box<Expr>),
}

#[derive(Clone, Debug)]
struct Function {
    parameters: Vec<String>,
    body: Expr,
}

/// Names and what they mean.
#[derive(Clone, Debug, Default)]
pub struct Scope {
    functions: HashMap<String, Rc<Function>>,
    values: HashMap<String, f64>,
}

struct Parser<'a> {
    bytes: &'a [u8],
    at: usize,
    depth: usize,
    nodes: usize,
}

/// Parse one expression.
pub fn parse(text: &str) -> Result<Expr, String> {
    let mut p = Parser { bytes: text.as_bytes(), at: 0, depth: 0, nodes: 0 };
    let e = p.sum()?;
    p.skip();
    match p.bytes.get(p.at) {
        None => Ok(e),
        Some(_) => {
            Err(format!("\"{}\" after the end of an expression", text[p.at..].chars().next().unwrap_or(' ')))
        }
    }
}

impl Parser<'_> {
    fn skip(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    fn peek(&mut self) -> Option<u8> {
        self.skip();
        self.bytes.get(self.at).copied()
    }

    fn deeper(&mut self) -> Result<(), String> {
        self.depth += 1;
        self.nodes += 1;
        if self.depth > MAX_DEPTH || self.nodes > MAX_NODES {
            return Err("an expression that is too complex".into());
        }
        Ok(())
    }

    fn sum(&mut self) -> Result<Expr, String> {
        self.deeper()?;
        let mut left = self.product()?;
        while let Some(op @ (b'+' | b'-')) = self.peek() {
            self.at += 1;
            self.nodes += 1;
            left = Expr::Binary(op as char, Box::new(left), Box::new(self.product()?));
            if self.nodes > MAX_NODES / 10 {
                return Err("an expression that is too complex".into());
            }
        }
        self.depth -= 1;
        Ok(left)
    }

    fn product(&mut self) -> Result<Expr, String> {
        let mut left = self.power()?;
        while let Some(op @ (b'*' | b'/')) = self.peek() {
            self.at += 1;
            self.nodes += 1;
            left = Expr::Binary(op as char, Box::new(left), Box::new(self.power()?));
            if self.nodes > MAX_NODES / 10 {
                return Err("an expression that is too complex".into());
            }
        }
        Ok(left)
    }

    fn power(&mut self) -> Result<Expr, String> {
        let base = self.unary()?;
        if self.peek() == Some(b'^') {
            self.at += 1;
            self.deeper()?;
            // To the right: 2^3^2 is 2^9.
            let exponent = self.power()?;
            self.depth -= 1;
            return Ok(Expr::Binary('^', Box::new(base), Box::new(exponent)));
        }
        Ok(base)
    }

    fn unary(&mut self) -> Result<Expr, String> {
        match self.peek() {
            Some(b'-') => {
                self.at += 1;
                self.deeper()?;
                let e = self.unary()?;
                self.depth -= 1;
                Ok(Expr::Negative(Box::new(e)))
            }
            Some(b'+') => {
                self.at += 1;
                self.deeper()?;
                let e = self.unary()?;
                self.depth -= 1;
                Ok(e)
            }
            Some(b'(') => {
                self.at += 1;
                let e = self.sum()?;
                self.close()?;
                Ok(e)
            }
            Some(b) if b.is_ascii_digit() || b == b'.' => self.number(),
            Some(b) if b.is_ascii_alphabetic() || b == b'_' => self.name(),
            Some(b) => Err(format!("unexpected \"{}\" in an expression", b.escape_ascii())),
            None => Err("an expression that ends too early".into()),
        }
    }

    fn close(&mut self) -> Result<(), String> {
        if self.peek() != Some(b')') {
            return Err("a parenthesis that is not closed".into());
        }
        self.at += 1;
        Ok(())
    }

    fn number(&mut self) -> Result<Expr, String> {
        let start = self.at;
        let digits = |p: &mut Self| {
            while p.bytes.get(p.at).is_some_and(u8::is_ascii_digit) {
                p.at += 1;
            }
        };
        digits(self);
        if self.bytes.get(self.at) == Some(&b'.') {
            self.at += 1;
            digits(self);
        }
        if matches!(self.bytes.get(self.at), Some(b'e' | b'E')) {
            let mark = self.at;
            self.at += 1;
            if matches!(self.bytes.get(self.at), Some(b'+' | b'-')) {
                self.at += 1;
            }
            if self.bytes.get(self.at).is_some_and(u8::is_ascii_digit) {
                digits(self);
            } else {
                self.at = mark;
            }
        }
        let text = String::from_utf8_lossy(&self.bytes[start..self.at]);
        text.parse().map(Expr::Number).map_err(|_| format!("\"{text}\" in an expression"))
    }

    fn name(&mut self) -> Result<Expr, String> {
        let start = self.at;
        while self.bytes.get(self.at).is_some_and(|b| b.is_ascii_alphanumeric() || matches!(b, b'_' | b'.')) {
            self.at += 1;
        }
        let name = String::from_utf8_lossy(&self.bytes[start..self.at]).into_owned();
        if self.peek() != Some(b'(') {
            return Ok(Expr::Name(name));
        }
        self.at += 1;
        let mut arguments = Vec::new();
        if self.peek() == Some(b')') {
            self.at += 1;
            return Ok(Expr::Call(name, arguments));
        }
        loop {
            arguments.push(self.sum()?);
            if self.peek() == Some(b',') {
                self.at += 1;
            } else {
                self.close()?;
                return Ok(Expr::Call(name, arguments));
            }
        }
    }
}

impl Scope {
    /// Give a variable a value.
    pub fn set(&mut self, name: &str, value: f64) {
        self.values.insert(name.to_owned(), value);
    }

    /// Definitions separated by `;`: `name = e`, `name : e`, `name(a, b) = e`.
    pub fn define(&mut self, text: &str) -> Result<(), String> {
        for part in text.split(';').filter(|p| !p.trim().is_empty()) {
            let Some(cut) = part.find(['=', ':']) else {
                return Err(format!("\"{}\" is no definition", part.trim()));
            };
            let (head, body) = (part[..cut].trim(), parse(&part[cut + 1..])?);
            let (name, parameters) = match parse(head)? {
                Expr::Name(name) => (name, Vec::new()),
                Expr::Call(name, arguments) => {
                    let names = arguments.into_iter().map(|a| match a {
                        Expr::Name(n) => Ok(n),
                        _ => Err(format!("\"{head}\" cannot be defined")),
                    });
                    (name, names.collect::<Result<_, _>>()?)
                }
                _ => return Err(format!("\"{head}\" cannot be defined")),
            };
            self.functions.insert(name, Rc::new(Function { parameters, body }));
        }
        Ok(())
    }

    /// Whether a function of that name is defined.
    pub fn has(&self, name: &str) -> bool {
        self.functions.contains_key(name)
    }

    /// Parse and evaluate.
    pub fn evaluate(&self, text: &str) -> Result<f64, String> {
        self.value(&parse(text)?)
    }

    /// The value of an expression; not finite is an error.
    pub fn value(&self, e: &Expr) -> Result<f64, String> {
        let mut steps = MAX_STEPS;
        let v = self.eval(e, &HashMap::new(), 0, &mut steps)?;
        if v.is_finite() { Ok(v) } else { Err("a value that is not finite".into()) }
    }

    fn eval(
        &self,
        e: &Expr,
        locals: &HashMap<&str, f64>,
        depth: usize,
        steps: &mut u32,
    ) -> Result<f64, String> {
        *steps = steps.checked_sub(1).ok_or("an expression that takes too long")?;
        match e {
            Expr::Number(v) => Ok(*v),
            Expr::Negative(a) => Ok(-self.eval(a, locals, depth, steps)?),
            Expr::Binary(op, a, b) => {
                let (a, b) = (self.eval(a, locals, depth, steps)?, self.eval(b, locals, depth, steps)?);
                Ok(match op {
                    '+' => a + b,
                    '-' => a - b,
                    '*' => a * b,
                    '/' => a / b,
                    _ => a.powf(b),
                })
            }
            Expr::Name(n) => {
                if let Some(v) = locals.get(n.as_str()).or(self.values.get(n)) {
                    return Ok(*v);
                }
                if let Some(f) = self.functions.get(n).filter(|f| f.parameters.is_empty()) {
                    return self.call(&f.clone(), &[], depth, steps);
                }
                if n == "PI" {
                    return Ok(std::f64::consts::PI);
                }
                Err(format!("\"{n}\" is not defined"))
            }
            Expr::Call(n, arguments) => {
                // Only the branch that is taken has a value.
                if n == "if" && arguments.len() == 3 && !self.functions.contains_key(n) {
                    let condition = self.eval(&arguments[0], locals, depth, steps)?;
                    return self.eval(&arguments[if condition > 0.0 { 1 } else { 2 }], locals, depth, steps);
                }
                let mut values = Vec::with_capacity(arguments.len());
                for a in arguments {
                    values.push(self.eval(a, locals, depth, steps)?);
                }
                if let Some(f) = self.functions.get(n) {
                    return self.call(&f.clone(), &values, depth, steps);
                }
                builtin(n, &values)
            }
        }
    }

    fn call(&self, f: &Function, values: &[f64], depth: usize, steps: &mut u32) -> Result<f64, String> {
        if values.len() != f.parameters.len() {
            return Err(format!(
                "a function of {} arguments called with {}",
                f.parameters.len(),
                values.len()
            ));
        }
        if depth >= MAX_DEPTH {
            return Err("functions that call one another too deeply".into());
        }
        let locals = f.parameters.iter().map(String::as_str).zip(values.iter().copied()).collect();
        self.eval(&f.body, &locals, depth + 1, steps)
    }
}

fn builtin(name: &str, v: &[f64]) -> Result<f64, String> {
    Ok(match (name, v) {
        ("sin", [x]) => x.sin(),
        ("cos", [x]) => x.cos(),
        ("tan", [x]) => x.tan(),
        ("asin" | "Asin", [x]) => x.clamp(-1.0, 1.0).asin(),
        ("acos" | "Acos", [x]) => x.clamp(-1.0, 1.0).acos(),
        ("atan", [x]) => x.atan(),
        ("atan2", [y, x]) => y.atan2(*x),
        ("sqrt" | "Sqrt", [x]) => x.max(0.0).sqrt(),
        ("exp" | "Exp", [x]) => x.exp(),
        ("log", [x]) => x.ln(),
        ("log10", [x]) => x.log10(),
        ("floor", [x]) => x.floor(),
        ("ceil", [x]) => x.ceil(),
        ("abs", [x]) => x.abs(),
        ("min", [a, b]) => a.min(*b),
        ("max", [a, b]) => a.max(*b),
        ("mod", [a, b]) => a - (a / b).floor() * b,
        // Cubic curves through two points with two slopes; of four control points; B-spline of four.
        ("hermite", [p0, p1, r0, r1, t]) => {
            let (t2, t3) = (t * t, t * t * t);
            p0 * (2.0 * t3 - 3.0 * t2 + 1.0)
                + p1 * (3.0 * t2 - 2.0 * t3)
                + r0 * (t3 - 2.0 * t2 + t)
                + r1 * (t3 - t2)
        }
        ("bezier", [a, b, c, d, t]) => {
            let u = 1.0 - t;
            a * u * u * u + 3.0 * b * t * u * u + 3.0 * c * t * t * u + d * t * t * t
        }
        ("bspline", [a, b, c, d, t]) => {
            let u = 1.0 - t;
            let weights = [
                u * u * u,
                3.0 * t * t * t - 6.0 * t * t + 4.0,
                3.0 * (t + t * t - t * t * t) + 1.0,
                t * t * t,
            ];
            (a * weights[0] + b * weights[1] + c * weights[2] + d * weights[3]) / 6.0
        }
        ("if", [c, a, b]) => {
            if *c > 0.0 {
                *a
            } else {
                *b
            }
        }
        (_, _) => return Err(format!("no function \"{name}\" of {} arguments", v.len())),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        Scope::default().evaluate(text).unwrap_or_else(|e| panic!("{text}: {e}"))
    }

    #[test]
    fn arithmetic() {
        assert_eq!(value("1+2*3-4/2"), 5.0);
        assert_eq!(value("2^3^2"), 512.0);
        // The sign binds first.
        assert_eq!(value("-2^2"), 4.0);
        assert_eq!(value("-(1+2)*-3"), 9.0);
        assert_eq!(value(" 1.5e1 + .5 "), 15.5);
        assert!((value("sin(PI/6)") - 0.5).abs() < 1e-15);
        assert!((value("sqrt(2)^2") - 2.0).abs() < 1e-15);
        assert_eq!(value("if(1-2, 1/0, 7)"), 7.0);
        assert_eq!(value("mod(-1,3)"), 2.0);
        assert_eq!(value("bezier(0,1,2,3,.5)"), 1.5);
        assert_eq!(value("hermite(0,1,0,0,.5)"), 0.5);
        assert!((value("bspline(1,1,1,1,.3)") - 1.0).abs() < 1e-15);
    }

    #[test]
    fn definitions() {
        let mut scope = Scope::default();
        scope.define("a : 3; f(x) = a*x^2; g = f(2)+t").unwrap();
        scope.set("t", 1.0);
        assert_eq!(scope.evaluate("g").unwrap(), 13.0);
        assert!(scope.has("f") && !scope.has("h"));
        assert_eq!(scope.evaluate("f(1,2)").unwrap_err(), "a function of 1 arguments called with 2");
    }

    #[test]
    fn what_is_wrong_ends() {
        let error = |t: &str| Scope::default().evaluate(t).unwrap_err();
        assert_eq!(error("1+"), "an expression that ends too early");
        assert_eq!(error("(1"), "a parenthesis that is not closed");
        assert_eq!(error("x"), "\"x\" is not defined");
        assert_eq!(error("1/0"), "a value that is not finite");
        assert_eq!(error("foo(1)"), "no function \"foo\" of 1 arguments");
        assert!(parse(&"(".repeat(100_000)).is_err() && parse(&"-".repeat(100_000)).is_err());
        let mut scope = Scope::default();
        scope.define("f(x)=f(x)+f(x)").unwrap();
        assert!(scope.evaluate("f(1)").is_err());
        assert!(parse(&"1+".repeat(100_000)).is_err());
    }
}
