//! pbrt's tokens: words, quoted strings, brackets; `#` begins a comment. Tokens are byte ranges; lines and columns are
//! computed only where a message or a shape needs them, by a cursor that moves forward with the text.

use crate::Span;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A run of characters: a directive, a number, `true`, `$key`.
    Word,
    /// A quoted string.
    Str,
    /// `[`
    Open,
    /// `]`
    Close,
    /// The end of the text.
    End,
    /// A quoted string without an end on its line.
    Unterminated,
}

/// A token: its kind and bytes (quotes included).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Token {
    /// What it is.
    pub kind: Kind,
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// Reads one text.
#[derive(Debug)]
pub struct Lexer {
    text: String,
    position: usize,
    file: u32,
    // Cursor for spans: line and column (in characters) of byte `mark`.
    mark: usize,
    line: u32,
    column: u32,
}

impl Lexer {
    /// A lexer over `text`, whose spans name file `file`.
    pub fn new(mut text: String, file: u32) -> Self {
        if text.starts_with('\u{feff}') {
            text.drain(..3);
        }
        Lexer { text, position: 0, file, mark: 0, line: 1, column: 1 }
    }

    /// Index of the file in the source map.
    pub fn file(&self) -> u32 {
        self.file
    }

    /// The text, when reading is over.
    pub fn into_text(self) -> String {
        self.text
    }

    /// The bytes of a token.
    pub fn text(&self, token: Token) -> &str {
        &self.text[token.start..token.end]
    }

    /// The next token without consuming it.
    pub fn peek(&self) -> Token {
        let bytes = self.text.as_bytes();
        let mut i = self.position;
        loop {
            match bytes.get(i) {
                None => return Token { kind: Kind::End, start: i, end: i },
                Some(b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c) => i += 1,
                Some(b'#') => {
                    while !matches!(bytes.get(i), None | Some(b'\n' | b'\r')) {
                        i += 1;
                    }
                }
                Some(b'[') => return Token { kind: Kind::Open, start: i, end: i + 1 },
                Some(b']') => return Token { kind: Kind::Close, start: i, end: i + 1 },
                Some(b'"') => return self.string(i),
                Some(_) => {
                    let start = i;
                    while !matches!(
                        bytes.get(i),
                        None | Some(b' ' | b'\t' | b'\n' | b'\r' | 0x0b | 0x0c | b'#' | b'[' | b']' | b'"')
                    ) {
                        i += 1;
                    }
                    return Token { kind: Kind::Word, start, end: i };
                }
            }
        }
    }

    fn string(&self, start: usize) -> Token {
        let bytes = self.text.as_bytes();
        let mut i = start + 1;
        loop {
            match bytes.get(i) {
                None | Some(b'\n' | b'\r') => return Token { kind: Kind::Unterminated, start, end: i },
                Some(b'"') => return Token { kind: Kind::Str, start, end: i + 1 },
                // The byte after a backslash is ASCII or the start of a character: both are safe to skip.
                Some(b'\\') if !matches!(bytes.get(i + 1), None | Some(b'\n' | b'\r')) => i += 2,
                Some(_) => i += 1,
            }
        }
    }

    /// The next token.
    pub fn next(&mut self) -> Token {
        let token = self.peek();
        self.position = token.end;
        token
    }

    /// Consume a token that [`Lexer::peek`] returned.
    pub fn consume(&mut self, token: Token) {
        self.position = token.end;
    }

    /// Put a token back.
    pub fn rewind(&mut self, token: Token) {
        self.position = token.start;
    }

    /// What a quoted string says, escapes resolved; `Err` names an escape that means nothing.
    pub fn unquote(&self, token: Token) -> Result<String, char> {
        let raw = &self.text[token.start + 1..token.end - 1];
        if !raw.contains('\\') {
            return Ok(raw.to_owned());
        }
        let mut out = String::with_capacity(raw.len());
        let mut chars = raw.chars();
        while let Some(c) = chars.next() {
            if c != '\\' {
                out.push(c);
                continue;
            }
            out.push(match chars.next() {
                Some('n') => '\n',
                Some('r') => '\r',
                Some('t') => '\t',
                Some('b') => '\u{8}',
                Some('f') => '\u{c}',
                Some(c @ ('\\' | '"' | '\'')) => c,
                Some(c) => return Err(c),
                None => return Err('\\'),
            });
        }
        Ok(out)
    }

    /// Where a token is.
    pub fn span(&mut self, token: Token) -> Span {
        self.span_of(token.start, token.end)
    }

    /// Where the bytes `start..end` are. Cheap when called in order of `start`.
    pub fn span_of(&mut self, start: usize, end: usize) -> Span {
        let bytes = self.text.as_bytes();
        if start < self.mark {
            (self.mark, self.line, self.column) = (0, 1, 1);
        }
        for &b in &bytes[self.mark..start] {
            if b == b'\n' {
                self.line += 1;
                self.column = 1;
            } else if b & 0xc0 != 0x80 && b != b'\r' {
                self.column += 1;
            }
        }
        self.mark = start;
        let length = bytes[start..end].iter().filter(|&&b| b & 0xc0 != 0x80).count().max(1);
        Span { file: self.file, line: self.line, column: self.column, length: length as u32 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(Kind, String)> {
        let mut lexer = Lexer::new(text.to_owned(), 0);
        let mut out = Vec::new();
        loop {
            let t = lexer.next();
            if t.kind == Kind::End {
                return out;
            }
            out.push((t.kind, lexer.text(t).to_owned()));
        }
    }

    #[test]
    fn words_strings_brackets_comments() {
        let tokens = all("Shape \"a b\"[1 -2.5e3]# no\n\"x\" ]#end");
        let text: Vec<&str> = tokens.iter().map(|t| t.1.as_str()).collect();
        assert_eq!(text, ["Shape", "\"a b\"", "[", "1", "-2.5e3", "]", "\"x\"", "]"]);
        assert_eq!(tokens[1].0, Kind::Str);
        assert_eq!(tokens[0].0, Kind::Word);
    }

    #[test]
    fn strings_end_on_their_line() {
        assert_eq!(all("\"abc\n\"")[0].0, Kind::Unterminated);
        assert_eq!(all("\"abc\\\n\"")[0].0, Kind::Unterminated);
        assert_eq!(all("\"abc\\")[0].0, Kind::Unterminated);
        assert_eq!(all("\"a\\\"b\"")[0], (Kind::Str, "\"a\\\"b\"".into()));
    }

    #[test]
    fn escapes() {
        let mut lexer = Lexer::new(r#""a\"\\\n\t" "\q""#.into(), 0);
        let t = lexer.next();
        assert_eq!(lexer.unquote(t).unwrap(), "a\"\\\n\t");
        let t = lexer.next();
        assert_eq!(lexer.unquote(t), Err('q'));
    }

    #[test]
    fn spans_count_characters() {
        let mut lexer = Lexer::new("\u{feff}a é\r\n  bcd \"ü\"".into(), 3);
        let spans: Vec<Span> = (0..4)
            .map(|_| {
                let t = lexer.next();
                lexer.span(t)
            })
            .collect();
        let at = |line, column, length| Span { file: 3, line, column, length };
        assert_eq!(spans, [at(1, 1, 1), at(1, 3, 1), at(2, 3, 3), at(2, 7, 3)]);
        assert_eq!(lexer.span_of(0, 1), at(1, 1, 1), "backwards is slow, not wrong");
    }
}
