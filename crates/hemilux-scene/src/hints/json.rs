//! JSON (RFC 8259) with the place of every value: what messages about a file of hints need.
//!
//! Limits, so that every input ends without a panic: nesting of [`DEEPEST`] levels. Numbers are finite.

use crate::Span;

/// Levels of arrays and objects in one another.
const DEEPEST: u32 = 32;

/// A value and where it is written.
#[derive(Clone, Debug)]
pub struct Node {
    /// What.
    pub value: Value,
    /// Where.
    pub span: Span,
}

/// A JSON value.
#[derive(Clone, Debug)]
pub enum Value {
    /// `null`.
    Null,
    /// `true` or `false`.
    Bool,
    /// A finite number.
    Number(f64),
    /// A string, unescaped.
    Text(String),
    /// An array.
    Array(Vec<Node>),
    /// An object: keys with their places, in the order of the file.
    Object(Vec<(String, Span, Node)>),
}

impl Value {
    /// What it is, in words.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::Null => "null",
            Value::Bool => "true or false",
            Value::Number(_) => "a number",
            Value::Text(_) => "a string",
            Value::Array(_) => "a list",
            Value::Object(_) => "an object",
        }
    }
}

/// Read one value and nothing else.
///
/// # Errors
/// Where the text is not JSON, and why.
pub fn parse(text: &str) -> Result<Node, (Span, String)> {
    let mut at = Parser { chars: text.chars().collect(), next: 0, line: 1, column: 1 };
    at.space();
    let node = at.value(0)?;
    at.space();
    match at.peek() {
        None => Ok(node),
        Some(c) => Err((at.here(1), format!("{c:?} after the end of the hints"))),
    }
}

struct Parser {
    chars: Vec<char>,
    next: usize,
    line: u32,
    column: u32,
}

impl Parser {
    fn peek(&self) -> Option<char> {
        self.chars.get(self.next).copied()
    }

    fn take(&mut self) -> Option<char> {
        let c = self.peek()?;
        self.next += 1;
        (self.line, self.column) = if c == '\n' { (self.line + 1, 1) } else { (self.line, self.column + 1) };
        Some(c)
    }

    fn space(&mut self) {
        while matches!(self.peek(), Some(' ' | '\t' | '\n' | '\r')) {
            self.take();
        }
    }

    fn here(&self, length: u32) -> Span {
        Span { file: 0, line: self.line, column: self.column, length }
    }

    /// The place from `start` to here, within its line.
    fn since(&self, start: Span) -> Span {
        let length = if self.line == start.line { self.column - start.column } else { 1 };
        Span { length: length.max(1), ..start }
    }

    fn expected<T>(&self, what: &str) -> Result<T, (Span, String)> {
        let found = self.peek().map_or("the end of the file".into(), |c| format!("{c:?}"));
        Err((self.here(1), format!("expected {what}, found {found}")))
    }

    fn value(&mut self, depth: u32) -> Result<Node, (Span, String)> {
        let start = self.here(1);
        if depth > DEEPEST {
            return Err((start, format!("nested more than {DEEPEST} deep")));
        }
        let value = match self.peek() {
            Some('{') => self.object(depth)?,
            Some('[') => self.array(depth)?,
            Some('"') => Value::Text(self.text()?),
            Some('-' | '0'..='9') => self.number()?,
            Some('a'..='z') => self.word()?,
            _ => return self.expected("a value"),
        };
        let span = match value {
            Value::Array(_) | Value::Object(_) => start,
            _ => self.since(start),
        };
        Ok(Node { value, span })
    }

    fn object(&mut self, depth: u32) -> Result<Value, (Span, String)> {
        let mut entries: Vec<(String, Span, Node)> = Vec::new();
        self.take();
        self.space();
        while self.peek() != Some('}') {
            if !entries.is_empty() {
                self.comma('}')?;
            }
            let start = self.here(1);
            if self.peek() != Some('"') {
                return self.expected("a key in quotes");
            }
            let key = self.text()?;
            let span = self.since(start);
            if entries.iter().any(|e| e.0 == key) {
                return Err((span, format!("{key:?} is given twice")));
            }
            self.space();
            if self.peek() != Some(':') {
                return self.expected("':'");
            }
            self.take();
            self.space();
            let node = self.value(depth + 1)?;
            entries.push((key, span, node));
            self.space();
        }
        self.take();
        Ok(Value::Object(entries))
    }

    fn array(&mut self, depth: u32) -> Result<Value, (Span, String)> {
        let mut items = Vec::new();
        self.take();
        self.space();
        while self.peek() != Some(']') {
            if !items.is_empty() {
                self.comma(']')?;
            }
            items.push(self.value(depth + 1)?);
            self.space();
        }
        self.take();
        Ok(Value::Array(items))
    }

    fn comma(&mut self, end: char) -> Result<(), (Span, String)> {
        if self.peek() != Some(',') {
            return self.expected(&format!("',' or {end:?}"));
        }
        self.take();
        self.space();
        Ok(())
    }

    fn text(&mut self) -> Result<String, (Span, String)> {
        let start = self.here(1);
        self.take();
        let mut text = String::new();
        loop {
            match self.take() {
                Some('"') => return Ok(text),
                Some('\\') => text.push(self.escape()?),
                Some(c) if c >= ' ' => text.push(c),
                _ => return Err((start, "this string has no end in its line".into())),
            }
        }
    }

    fn escape(&mut self) -> Result<char, (Span, String)> {
        let start = self.here(1);
        match self.take() {
            Some(c @ ('"' | '\\' | '/')) => Ok(c),
            Some('n') => Ok('\n'),
            Some('t') => Ok('\t'),
            Some('r') => Ok('\r'),
            Some('b') => Ok('\u{8}'),
            Some('f') => Ok('\u{c}'),
            Some('u') => {
                let mut code = self.hex(start)?;
                // A pair of surrogates is one character.
                if (0xd800..0xdc00).contains(&code) && self.take() == Some('\\') && self.take() == Some('u') {
                    let low = self.hex(start)?;
                    code = 0x1_0000 + ((code - 0xd800) << 10) + (low.wrapping_sub(0xdc00) & 0x3ff);
                }
                char::from_u32(code).ok_or((start, "\\u without a character".into()))
            }
            _ => Err((start, "unknown escape in a string".into())),
        }
    }

    fn hex(&mut self, start: Span) -> Result<u32, (Span, String)> {
        let mut code = 0;
        for _ in 0..4 {
            let digit = self.take().and_then(|c| c.to_digit(16));
            code = 16 * code + digit.ok_or((start, "\\u takes four hexadecimal digits".to_string()))?;
        }
        Ok(code)
    }

    fn number(&mut self) -> Result<Value, (Span, String)> {
        let (start, first) = (self.here(1), self.next);
        while matches!(self.peek(), Some('-' | '+' | '.' | '0'..='9' | 'a'..='z' | 'A'..='Z')) {
            self.take();
        }
        let word: String = self.chars[first..self.next].iter().collect();
        match word.parse::<f64>() {
            Ok(v) if v.is_finite() => Ok(Value::Number(v)),
            Ok(_) => Err((self.since(start), format!("{word} is not finite"))),
            Err(_) => Err((self.since(start), format!("{word} is not a number"))),
        }
    }

    fn word(&mut self) -> Result<Value, (Span, String)> {
        let (start, first) = (self.here(1), self.next);
        while matches!(self.peek(), Some('a'..='z')) {
            self.take();
        }
        let word: String = self.chars[first..self.next].iter().collect();
        match word.as_str() {
            "null" => Ok(Value::Null),
            "true" | "false" => Ok(Value::Bool),
            _ => Err((self.since(start), format!("{word} is not a value; strings stand in quotes"))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_know_their_places() {
        let node = parse("{\n  \"a\": [1, -2.5e1],\n  \"b\": \"x\\u00e9\\ud83d\\ude00\\n\"\n}").unwrap();
        let Value::Object(entries) = node.value else { panic!() };
        assert_eq!((entries[0].0.as_str(), entries[0].1.line, entries[0].1.column), ("a", 2, 3));
        let Value::Array(items) = &entries[0].2.value else { panic!() };
        assert!(matches!(items[1].value, Value::Number(v) if v == -25.0));
        assert_eq!((items[1].span.line, items[1].span.column, items[1].span.length), (2, 12, 6));
        assert!(matches!(&entries[1].2.value, Value::Text(t) if t == "xé😀\n"));
    }

    #[test]
    fn what_is_not_json_is_named_with_its_place() {
        for (text, line, column, what) in [
            ("", 1, 1, "expected a value, found the end of the file"),
            ("{\"a\": 1,\n \"a\": 2}", 2, 2, "\"a\" is given twice"),
            ("[1 2]", 1, 4, "expected ',' or ']', found '2'"),
            ("[1,]", 1, 4, "expected a value, found ']'"),
            ("{a: 1}", 1, 2, "expected a key in quotes, found 'a'"),
            ("[1e999]", 1, 2, "1e999 is not finite"),
            ("[0x1]", 1, 2, "0x1 is not a number"),
            ("[\"a\n\"]", 1, 2, "this string has no end in its line"),
            ("[\"\\ud800\"]", 1, 4, "\\u without a character"),
            ("[yes]", 1, 2, "yes is not a value; strings stand in quotes"),
            ("{} x", 1, 4, "'x' after the end of the hints"),
        ] {
            let (span, message) = parse(text).unwrap_err();
            assert_eq!((span.line, span.column, message.as_str()), (line, column, what), "{text}");
        }
        assert!(parse(&"[".repeat(100_000)).unwrap_err().1.contains("deep"));
    }
}
