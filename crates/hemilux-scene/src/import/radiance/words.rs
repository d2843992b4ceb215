//! Radiance's tokens: words separated by white space, quoted or not; `#` begins a comment; a line that begins with `!`
//! is a command. Words are byte ranges; lines and columns are computed where a message needs them.

use crate::Span;
use std::rc::Rc;

/// A word: its bytes, quotes included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// First byte.
    pub start: usize,
    /// One past the last byte.
    pub end: usize,
}

/// Reads one text.
#[derive(Clone, Debug)]
pub struct Words {
    text: Rc<str>,
    position: usize,
    file: u32,
    // Cursor for spans: line and column (in characters) of byte `mark`.
    mark: usize,
    line: u32,
    column: u32,
}

impl Words {
    /// Words of `text`, whose spans name file `file`.
    pub fn new(text: Rc<str>, file: u32) -> Self {
        let position = if text.starts_with('\u{feff}') { 3 } else { 0 };
        Words { text, position, file, mark: position, line: 1, column: 1 }
    }

    /// What a word says, without quotes.
    pub fn text(&self, word: Word) -> &str {
        let raw = &self.text[word.start..word.end];
        let quote = raw.as_bytes().first().filter(|b| matches!(b, b'"' | b'\''));
        match quote {
            Some(&q) if raw.len() > 1 && raw.as_bytes()[raw.len() - 1] == q => &raw[1..raw.len() - 1],
            Some(_) => &raw[1..],
            None => raw,
        }
    }

    /// The next word.
    pub fn next(&mut self) -> Option<Word> {
        let bytes = self.text.as_bytes();
        let mut i = self.position;
        loop {
            match bytes.get(i)? {
                b if b.is_ascii_whitespace() || *b == 0x0b => i += 1,
                b'#' => {
                    while !matches!(bytes.get(i), None | Some(b'\n' | b'\r')) {
                        i += 1;
                    }
                }
                _ => break,
            }
            self.position = i;
        }
        let start = i;
        let quote = bytes[i];
        if quote == b'"' || quote == b'\'' {
            i += 1;
            while !matches!(bytes.get(i), None | Some(b'\n' | b'\r')) && bytes[i] != quote {
                i += 1;
            }
            if bytes.get(i) == Some(&quote) {
                i += 1;
            }
        } else {
            while bytes.get(i).is_some_and(|b| !b.is_ascii_whitespace() && *b != 0x0b) {
                i += 1;
            }
        }
        self.position = i;
        Some(Word { start, end: i })
    }

    /// The rest of the command whose first word is `word`: to the end of the line, a backslash continues it.
    pub fn command(&mut self, word: Word) -> Word {
        let bytes = self.text.as_bytes();
        let mut i = word.start;
        loop {
            match bytes.get(i) {
                None | Some(b'\n') => break,
                Some(b'\\') if bytes.get(i + 1) == Some(&b'\n') => i += 2,
                Some(b'\\') if bytes.get(i + 1) == Some(&b'\r') && bytes.get(i + 2) == Some(&b'\n') => i += 3,
                Some(_) => i += 1,
            }
        }
        self.position = i;
        Word { start: word.start, end: i }
    }

    /// The bytes of a word as they stand.
    pub fn raw(&self, word: Word) -> &str {
        &self.text[word.start..word.end]
    }

    /// Where a word is. Cheap when called in order.
    pub fn span(&mut self, word: Word) -> Span {
        let bytes = self.text.as_bytes();
        if word.start < self.mark {
            (self.mark, self.line, self.column) = (0, 1, 1);
            if self.text.starts_with('\u{feff}') {
                self.mark = 3;
            }
        }
        for &b in &bytes[self.mark..word.start] {
            if b == b'\n' {
                self.line += 1;
                self.column = 1;
            } else if b & 0xc0 != 0x80 && b != b'\r' {
                self.column += 1;
            }
        }
        self.mark = word.start;
        let inside = &bytes[word.start..word.end];
        let length = inside.iter().take_while(|b| **b != b'\n').filter(|&&b| b & 0xc0 != 0x80).count();
        Span { file: self.file, line: self.line, column: self.column, length: length.max(1) as u32 }
    }

    /// Where the text ends.
    pub fn end_span(&mut self) -> Span {
        let end = self.text.trim_end().len().max(self.mark.min(self.text.len()));
        self.span(Word { start: end, end })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_quotes_comments_and_spans() {
        let text = "\u{feff}void plastic \"a b\" # no\n  0 é 'x y' end";
        let mut words = Words::new(text.into(), 2);
        let mut all = Vec::new();
        while let Some(w) = words.next() {
            let s = words.span(w);
            all.push((words.text(w).to_owned(), s.line, s.column, s.length));
        }
        let expected = [
            ("void", 1, 1, 4),
            ("plastic", 1, 6, 7),
            ("a b", 1, 14, 5),
            ("0", 2, 3, 1),
            ("é", 2, 5, 1),
            ("x y", 2, 7, 5),
            ("end", 2, 13, 3),
        ];
        let expected: Vec<_> = expected.iter().map(|e| (e.0.to_owned(), e.1, e.2, e.3)).collect();
        assert_eq!(all, expected);
    }

    #[test]
    fn commands_end_with_their_line() {
        let mut words = Words::new("!genbox a \\\n b\nnext".into(), 0);
        let first = words.next().unwrap();
        let whole = words.command(first);
        assert_eq!(words.raw(whole), "!genbox a \\\n b");
        let next = words.next().unwrap();
        assert_eq!(words.text(next), "next");
        let mut open = Words::new("\"abc\n\"".into(), 0);
        let w = open.next().unwrap();
        assert_eq!(open.text(w), "abc");
    }
}
