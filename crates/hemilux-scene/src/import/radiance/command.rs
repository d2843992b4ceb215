//! `!` commands. None is ever executed: those in [`KNOWN`] are computed here, pipes into `xform` included; everything
//! else is refused.

use super::transform::{self, MAX_COPIES, Similarity, Wrong};
use super::words::{Word, Words};
use super::{Argument, Context, MAX_DEPTH, Reader, generate};
use crate::Span;
use crate::import::text_of;
use std::path::PathBuf;
use std::rc::Rc;

/// What is computed natively.
pub const KNOWN: &[&str] =
    &["xform", "cat", "genbox", "gensurf", "genprism", "genrev", "genworm", "gensky", "gendaylit"];

/// Bytes of work that any command or copy counts for, besides the text that is read.
const COMMAND_COST: u64 = 256;
/// Words of one command.
const MAX_ARGUMENTS: usize = 100_000;
/// Generated texts that are kept for further copies.
const MAX_KEPT: usize = 10_000;

/// A text and where copies of it go.
struct Piece {
    text: Rc<str>,
    file: u32,
    path: Option<PathBuf>,
    copies: Vec<Local>,
}

/// What the commands around a text do to it.
#[derive(Clone)]
struct Local {
    map: Similarity,
    modifier: Option<Argument>,
    invert: bool,
}

/// Split a command line into stages of a pipe.
fn stages(words: &mut Words, line: Word) -> Result<Vec<Vec<Argument>>, (Span, String)> {
    let text: Rc<str> = words.raw(line).into();
    let bytes = text.as_bytes();
    let mut all = vec![Vec::new()];
    let mut count = 0;
    let mut i = 1;
    while i < bytes.len() {
        let b = bytes[i];
        let continued = b == b'\\' && matches!(bytes.get(i + 1), Some(b'\n' | b'\r'));
        if b.is_ascii_whitespace() || continued {
            i += 1;
            continue;
        }
        let at = |start: usize, end: usize| Word { start: line.start + start, end: line.start + end };
        if b == b'|' {
            all.push(Vec::new());
            i += 1;
            continue;
        }
        if b == b'#' {
            break;
        }
        let start = i;
        let mut word = Vec::new();
        let mut quote = None;
        while i < bytes.len() {
            let b = bytes[i];
            match quote {
                Some(q) if b == q => quote = None,
                Some(_) => word.push(b),
                None if b == b'\'' || b == b'"' => quote = Some(b),
                None if b.is_ascii_whitespace() || b == b'|' => break,
                None if b == b'\\' && matches!(bytes.get(i + 1), Some(b'\n' | b'\r')) => break,
                None if b == b'\\' && i + 1 < bytes.len() => {
                    i += 1;
                    word.push(bytes[i]);
                }
                None if matches!(b, b';' | b'&' | b'<' | b'>' | b'`' | b'$') => {
                    let span = words.span(at(i, i + 1));
                    return Err((span, format!("\"{}\" in a command is not supported", b as char)));
                }
                None => word.push(b),
            }
            i += 1;
        }
        let span = words.span(at(start, i));
        if quote.is_some() {
            return Err((span, "a quoted word of the command has no end".into()));
        }
        count += 1;
        if count > MAX_ARGUMENTS {
            return Err((span, format!("a command of more than {MAX_ARGUMENTS} words")));
        }
        let text = String::from_utf8_lossy(&word).into_owned();
        if let Some(stage) = all.last_mut() {
            stage.push(Argument { text, span });
        }
    }
    Ok(all)
}

impl Reader {
    /// Run the command on `line`, natively.
    pub(super) fn run(&mut self, words: &mut Words, line: Word, context: &Context) {
        let whole = words.span(line);
        let pieces = match stages(words, line) {
            Ok(stages) => self.pipe(&stages, whole),
            Err((span, message)) => {
                self.env.log.unknown(span, message);
                None
            }
        };
        for piece in pieces.into_iter().flatten() {
            self.read_piece(piece, whole, context);
        }
    }

    /// The same for a command that is no part of a file.
    pub(super) fn run_text(&mut self, command: &str, span: Span, context: &Context) {
        let mut words = Words::new(format!("!{command}").into(), span.file);
        if let Some(first) = words.next() {
            let line = words.command(first);
            self.run(&mut words, line, context);
        }
    }

    /// Read a file as part of the scene.
    pub(super) fn include(&mut self, name: &str, span: Span, context: &Context) {
        let argument = Argument { text: name.to_owned(), span };
        if let Some(piece) = self.file_piece(&argument) {
            self.read_piece(piece, span, context);
        }
    }

    fn read_piece(&mut self, piece: Piece, span: Span, context: &Context) {
        if context.depth >= MAX_DEPTH {
            let message = format!("files and commands nested deeper than {MAX_DEPTH}");
            self.env.log.error(span, message);
            self.env.log.stop();
            return;
        }
        if let Some(path) = &piece.path {
            if self.open.contains(path) {
                self.env.log.error(span, format!("{} includes itself", path.display()));
                self.env.log.stop();
                return;
            }
            self.open.push(path.clone());
        }
        for copy in piece.copies {
            if self.env.log.full() || !self.charge(piece.text.len() as u64 + COMMAND_COST, span) {
                break;
            }
            let map = copy.map.then(&context.map);
            if !map.is_sound() {
                self.env.log.error(span, "the transformation is not finite");
                break;
            }
            let inner = Context {
                map,
                modifier: context.modifier.clone().or(copy.modifier),
                invert: context.invert != copy.invert,
                depth: context.depth + 1,
            };
            self.read_copy(piece.text.clone(), piece.file, &inner);
        }
        if piece.path.is_some() {
            self.open.pop();
        }
    }

    /// Count work against the memory that loading may take, so that copies of copies end.
    fn charge(&mut self, bytes: u64, span: Span) -> bool {
        self.work = self.work.saturating_add(bytes);
        if self.work <= self.env.memory / 2 {
            return true;
        }
        self.env.log.error(span, "the commands make more than the memory limit");
        self.env.log.stop();
        false
    }

    fn pipe(&mut self, stages: &[Vec<Argument>], whole: Span) -> Option<Vec<Piece>> {
        let (last, before) = stages.split_last()?;
        let Some(program) = last.first() else {
            self.env.log.error(whole, "an empty command");
            return None;
        };
        let name = program.text.rsplit('/').next().unwrap_or("").to_owned();
        if !KNOWN.contains(&name.as_str()) {
            let message = format!("command \"{}\" is refused: nothing is ever executed", program.text);
            self.env.log.unknown_among(program.span, message, &name, KNOWN.iter().copied());
            return None;
        }
        match name.as_str() {
            "xform" => self.xform(&last[1..], before, program.span),
            _ if !before.is_empty() => {
                self.env.log.error(program.span, format!("{name} takes nothing from a pipe"));
                None
            }
            "cat" => {
                let mut pieces = Vec::new();
                for file in &last[1..] {
                    pieces.push(self.file_piece(file)?);
                }
                Some(pieces)
            }
            _ => self.generated(&name, last, whole),
        }
    }

    fn generated(&mut self, name: &str, arguments: &[Argument], whole: Span) -> Option<Vec<Piece>> {
        let key = arguments.iter().map(|a| a.text.as_str()).collect::<Vec<_>>().join("\u{0}");
        let (text, file) = match self.generated.get(&key) {
            Some(known) => known.clone(),
            None => {
                let budget = (self.env.memory / 2).saturating_sub(self.work) as usize;
                let text = match generate::run(self, name, arguments, budget) {
                    Ok(text) => Rc::<str>::from(text),
                    Err(Wrong(i, message)) => {
                        let span = arguments.get(i).map_or(whole, |a| a.span);
                        self.env.log.error(span, message);
                        return None;
                    }
                };
                let path = PathBuf::from(format!("!{name}"));
                let file = self.env.files.borrow_mut().add_source(path, String::new(), Some(whole));
                if self.generated.len() < MAX_KEPT {
                    self.generated.insert(key, (text.clone(), file));
                }
                (text, file)
            }
        };
        let copies = vec![Local { map: Similarity::IDENTITY, modifier: None, invert: false }];
        Some(vec![Piece { text, file, path: None, copies }])
    }

    /// A file's text, read once however often it is used.
    pub(super) fn file_text(&mut self, name: &Argument) -> Option<(Rc<str>, u32, PathBuf)> {
        let path = self.env.resolve(&name.text, name.span.file);
        let key = path.canonicalize().unwrap_or(path.clone());
        if let Some((text, file)) = self.texts.get(&key) {
            return Some((text.clone(), *file, key));
        }
        match self.env.read(&path) {
            Ok(bytes) => {
                let text = text_of(bytes);
                let file = self.env.files.borrow_mut().add_source(path, text.clone(), Some(name.span));
                let text: Rc<str> = text.into();
                self.texts.insert(key.clone(), (text.clone(), file));
                Some((text, file, key))
            }
            Err(e) => {
                self.env.log.error(name.span, format!("{}: {e}", path.display()));
                None
            }
        }
    }

    fn file_piece(&mut self, name: &Argument) -> Option<Piece> {
        let (text, file, path) = self.file_text(name)?;
        let copies = vec![Local { map: Similarity::IDENTITY, modifier: None, invert: false }];
        Some(Piece { text, file, path: Some(path), copies })
    }

    fn xform(&mut self, args: &[Argument], before: &[Vec<Argument>], program: Span) -> Option<Vec<Piece>> {
        let mut local = Local { map: Similarity::IDENTITY, modifier: None, invert: false };
        let mut i = 0;
        let mut maps = Vec::new();
        // Options come before or between transformations; what is neither is a file.
        while let Some(a) = args.get(i) {
            match a.text.as_str() {
                "-c" | "-e" | "-l" => i += 1,
                "-I" => {
                    local.invert = !local.invert;
                    i += 1;
                }
                "-n" | "-m" | "-f" => {
                    let Some(value) = args.get(i + 1) else {
                        self.env.log.error(a.span, format!("option {} of xform lacks a name", a.text));
                        return None;
                    };
                    match a.text.as_str() {
                        "-m" => local.modifier = Some(value.clone()),
                        "-f" => return self.xform_lines(args, i, value, before, program),
                        _ => {}
                    }
                    i += 2;
                }
                text if text.starts_with('-') && text.len() > 1 => {
                    let (copies, used) = match transform::parse(&args[i..]) {
                        Ok(parsed) => parsed,
                        Err(Wrong(k, message)) => {
                            let span = args.get(i + k).map_or(program, |a| a.span);
                            self.env.log.error(span, message);
                            return None;
                        }
                    };
                    if used == 0 {
                        let known = [
                            "-t", "-rx", "-ry", "-rz", "-s", "-mx", "-my", "-mz", "-i", "-a", "-n", "-m",
                            "-f",
                        ];
                        self.env.log.unknown_among(
                            a.span,
                            format!("unknown option \"{text}\" of xform"),
                            text,
                            known,
                        );
                        return None;
                    }
                    maps = if maps.is_empty() { copies } else { multiplied(&maps, &copies) };
                    i += used;
                }
                _ => break,
            }
        }
        if maps.is_empty() {
            maps.push(Similarity::IDENTITY);
        }
        let files = &args[i..];
        let mut pieces = Vec::new();
        if !files.is_empty() {
            for file in files {
                pieces.push(self.file_piece(file)?);
            }
        } else if before.is_empty() {
            self.env.log.error(program, "xform has no file");
            return None;
        } else {
            pieces = self.pipe(before, program)?;
        }
        for piece in &mut pieces {
            if piece.copies.len().saturating_mul(maps.len()) as u64 > MAX_COPIES {
                self.env.log.error(program, format!("xform -a makes more than {MAX_COPIES} copies"));
                return None;
            }
            let mut copies = Vec::with_capacity(piece.copies.len() * maps.len());
            for map in &maps {
                for c in &piece.copies {
                    copies.push(Local {
                        map: c.map.then(map),
                        modifier: local.modifier.clone().or(c.modifier.clone()),
                        invert: c.invert != local.invert,
                    });
                }
            }
            piece.copies = copies;
        }
        Some(pieces)
    }

    /// `-f file`: one copy per line of the file, whose words stand in the option's place.
    fn xform_lines(
        &mut self,
        args: &[Argument],
        i: usize,
        name: &Argument,
        before: &[Vec<Argument>],
        program: Span,
    ) -> Option<Vec<Piece>> {
        let (text, file, _) = self.file_text(name)?;
        let mut pieces = Vec::new();
        for (number, line) in text.lines().enumerate() {
            if line.trim().is_empty() || line.starts_with('#') {
                continue;
            }
            if !self.charge(line.len() as u64 + COMMAND_COST, name.span) {
                return None;
            }
            let span = Span { file, line: number as u32 + 1, column: 1, length: line.chars().count() as u32 };
            let words = line.split_whitespace().map(|w| Argument { text: w.to_owned(), span });
            let mut all = args[..i].to_vec();
            all.extend(words.filter(|w| w.text != "-f"));
            all.extend_from_slice(&args[i + 2..]);
            if pieces.len() as u64 > MAX_COPIES {
                self.env.log.error(name.span, format!("xform -f makes more than {MAX_COPIES} copies"));
                return None;
            }
            pieces.extend(self.xform(&all, before, program)?);
        }
        Some(pieces)
    }
}

fn multiplied(first: &[Similarity], then: &[Similarity]) -> Vec<Similarity> {
    let most = MAX_COPIES as usize + 1;
    first.iter().flat_map(|a| then.iter().map(move |b| a.then(b))).take(most).collect()
}
