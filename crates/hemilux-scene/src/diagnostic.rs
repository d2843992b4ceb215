//! Diagnostics: a message with the place it is about, the chain of includes that led there, and a remedy.

use std::fmt;
use std::path::PathBuf;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// For information: a decision the importer took (a point luminaire became a sphere).
    Note,
    /// Probably not what was meant; the scene loads.
    Warning,
    /// The scene does not load (unless `--lenient` covers this kind).
    Error,
}

/// A place in a source: file (index into [`SourceMap`]), line and column from 1, length in characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// Index into [`SourceMap::files`].
    pub file: u32,
    /// Line, from 1; 0 = the file as a whole.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// Length in characters (within the line).
    pub length: u32,
}

/// One file that was read.
#[derive(Clone, Debug)]
pub struct SourceFile {
    /// Path as the user would name it.
    pub path: PathBuf,
    /// Text, kept for quoting lines; empty for binary files.
    pub text: String,
    /// Where it was included from.
    pub included_from: Option<Span>,
}

/// All files of one load, so that spans can be shown.
#[derive(Clone, Debug, Default)]
pub struct SourceMap {
    /// The files; [`Span::file`] indexes here.
    pub files: Vec<SourceFile>,
}

/// A message about a place.
#[derive(Clone, Debug)]
pub struct Diagnostic {
    /// How bad it is.
    pub severity: Severity,
    /// One sentence, lower case, no full stop.
    pub message: String,
    /// Where.
    pub span: Span,
    /// What to do about it ("did you mean \"uroughness\"?").
    pub help: Option<String>,
}

impl SourceMap {
    /// `path:line:col` (only `path` for a whole file).
    pub fn locate(&self, span: Span) -> String {
        let path = self.files.get(span.file as usize).map_or("?".into(), |f| f.path.display().to_string());
        if span.line == 0 { path } else { format!("{path}:{}:{}", span.line, span.column) }
    }

    /// The one-line form, `path:line:col: error: message`, which editors jump by.
    pub fn one_line(&self, d: &Diagnostic) -> String {
        format!("{}: {}: {}", self.locate(d.span), d.severity, d.message)
    }

    /// The full form: the one line, the source line with carets, the chain of includes, the help.
    pub fn render(&self, d: &Diagnostic) -> String {
        let mut out = self.one_line(d);
        let file = self.files.get(d.span.file as usize);
        if let Some(line) =
            file.filter(|_| d.span.line > 0).and_then(|f| f.text.lines().nth(d.span.line as usize - 1))
        {
            let number = d.span.line.to_string();
            let pad = " ".repeat(number.len());
            // Long lines (a mesh in one line) are shown around the place only.
            let skip = (d.span.column as usize).saturating_sub(60);
            let shown: String = line.chars().skip(skip).take(110).collect();
            let indent = (d.span.column as usize).saturating_sub(1 + skip);
            let carets =
                "^".repeat((d.span.length.max(1) as usize).min(110usize.saturating_sub(indent)).max(1));
            out += &format!("\n {pad} |\n {number} | {shown}\n {pad} | {}{carets}", " ".repeat(indent));
        }
        let mut parent = file.and_then(|f| f.included_from);
        let mut depth = 0;
        while let Some(span) = parent.filter(|_| depth < 20) {
            out += &format!("\n  included from {}", self.locate(span));
            parent = self.files.get(span.file as usize).and_then(|f| f.included_from);
            depth += 1;
        }
        if let Some(help) = &d.help {
            out += &format!("\n  help: {help}");
        }
        out
    }
}

impl fmt::Display for Severity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Severity::Note => "note",
            Severity::Warning => "warning",
            Severity::Error => "error",
        })
    }
}
