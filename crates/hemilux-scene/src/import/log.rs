//! Where importers put what they have to say. Bounded, so that one slip in a large file is not a flood.

use super::suggest::closest;
use crate::{Diagnostic, Severity, Span};
use std::cell::{Cell, RefCell};

/// Errors after which reading stops.
pub const MAX_ERRORS: usize = 20;
/// Notes and warnings kept; further ones are counted only.
const MAX_REMARKS: usize = 1000;

/// Diagnostics after which suggestions are no longer looked for.
const MAX_SUGGESTIONS: usize = 50;

/// Names in a file may hold line ends; messages are lines.
fn escaped(message: &str) -> String {
    let mut out = String::new();
    for c in message.chars() {
        if c.is_control() { out.extend(c.escape_debug()) } else { out.push(c) }
    }
    out
}

/// The diagnostics of one load. Shared by reference: everything that reads may complain.
#[derive(Debug, Default)]
pub struct Log {
    diagnostics: RefCell<Vec<Diagnostic>>,
    errors: Cell<usize>,
    dropped: Cell<usize>,
    stopped: Cell<bool>,
    lenient: bool,
}

impl Log {
    /// An empty log; `lenient` turns what [`Log::unknown`] reports into warnings.
    pub fn new(lenient: bool) -> Self {
        Log { lenient, ..Log::default() }
    }

    fn push(&self, severity: Severity, span: Span, message: String, help: Option<String>) {
        let mut list = self.diagnostics.borrow_mut();
        if severity == Severity::Error {
            if self.full() {
                return;
            }
            self.errors.set(self.errors.get() + 1);
        } else if list.len() >= MAX_REMARKS {
            self.dropped.set(self.dropped.get() + 1);
            return;
        }
        let message = if message.contains(char::is_control) { escaped(&message) } else { message };
        list.push(Diagnostic { severity, message, span, help });
    }

    /// The scene cannot be loaded.
    pub fn error(&self, span: Span, message: impl Into<String>) {
        self.push(Severity::Error, span, message.into(), None);
    }

    /// The scene cannot be loaded, and here is a remedy.
    pub fn error_help(&self, span: Span, message: impl Into<String>, help: impl Into<String>) {
        self.push(Severity::Error, span, message.into(), Some(help.into()));
    }

    /// Something that is not understood: an error, or a warning when lenient (the caller then skips it).
    pub fn unknown(&self, span: Span, message: impl Into<String>) {
        self.unknown_help(span, message, None);
    }

    /// [`Log::unknown`] with the closest of `known` to `got` as a suggestion.
    pub fn unknown_among<'a>(
        &self,
        span: Span,
        message: impl Into<String>,
        got: &str,
        known: impl IntoIterator<Item = &'a str>,
    ) {
        let flood = self.diagnostics.borrow().len() > MAX_SUGGESTIONS;
        let best = if flood { None } else { closest(got, known) };
        let help = best.map(|k| format!("did you mean \"{k}\"?"));
        self.unknown_help(span, message, help);
    }

    /// [`Log::unknown`] with a remedy.
    pub fn unknown_help(&self, span: Span, message: impl Into<String>, help: Option<String>) {
        let severity = if self.lenient { Severity::Warning } else { Severity::Error };
        self.push(severity, span, message.into(), help);
    }

    /// Probably not what was meant.
    pub fn warning(&self, span: Span, message: impl Into<String>) {
        self.push(Severity::Warning, span, message.into(), None);
    }

    /// A decision worth knowing.
    pub fn note(&self, span: Span, message: impl Into<String>) {
        self.push(Severity::Note, span, message.into(), None);
    }

    /// Number of errors so far.
    pub fn errors(&self) -> usize {
        self.errors.get()
    }

    /// Make reading stop: what was reported last would repeat itself.
    pub fn stop(&self) {
        self.stopped.set(true);
    }

    /// Whether to stop reading.
    pub fn full(&self) -> bool {
        self.stopped.get() || self.errors.get() >= MAX_ERRORS
    }

    /// Everything said, in order.
    pub fn into_diagnostics(self) -> Vec<Diagnostic> {
        let mut list = self.diagnostics.into_inner();
        if self.dropped.get() > 0 {
            list.push(Diagnostic {
                severity: Severity::Note,
                message: format!("{} further notes and warnings are not shown", self.dropped.get()),
                span: Span::default(),
                help: None,
            });
        }
        list
    }
}
