//! Talk goes to standard error, data to standard output; neither panics when nobody listens.

use crate::failure::Failure;
use clap::{Args, ValueEnum};
use hemilux_scene::{Diagnostic, Severity, SourceMap};
use serde_json::json;
use std::io::{self, Write};

/// The form of messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum MessageFormat {
    /// One line per message: `file:line:col: error: message`.
    Short,
    /// With the source line, the chain of includes and what to do.
    #[default]
    Human,
    /// One JSON object per line.
    Json,
}

/// How much to say, and in what form.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct Talk {
    /// Say nothing but errors
    #[arg(short, long, help_heading = "Messages")]
    pub quiet: bool,
    /// Also say notes: what was taken for what
    #[arg(short, long, conflicts_with = "quiet", help_heading = "Messages")]
    pub verbose: bool,
    /// Form of messages
    #[arg(long, value_enum, default_value = "human", value_name = "FORM", help_heading = "Messages")]
    pub message_format: MessageFormat,
}

/// One line to standard error. Should it be closed, there is nobody to tell.
pub fn line(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Text to standard output.
pub fn data(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| Failure::stdout(&e))
}

impl Talk {
    fn message(&self, severity: Severity, text: &str) {
        match self.message_format {
            MessageFormat::Json => {
                line(&json!({"severity": severity.to_string(), "message": text}).to_string())
            }
            MessageFormat::Short | MessageFormat::Human => line(&format!("{severity}: {text}")),
        }
    }

    /// What ends the program.
    pub fn error(&self, text: &str) {
        self.message(Severity::Error, text);
    }

    /// What the user should know.
    pub fn warning(&self, text: &str) {
        if !self.quiet {
            self.message(Severity::Warning, text);
        }
    }

    /// Everything a load had to say: errors always, warnings unless quiet, notes when verbose (counted otherwise).
    pub fn diagnostics(&self, list: &[Diagnostic], sources: &SourceMap) {
        let mut hidden = 0;
        for d in list {
            match d.severity {
                Severity::Warning if self.quiet => {}
                Severity::Note if !self.verbose => hidden += 1,
                _ => line(&self.diagnostic(d, sources)),
            }
        }
        if hidden > 0 && !self.quiet && self.message_format == MessageFormat::Human {
            let s = if hidden == 1 { "" } else { "s" };
            line(&format!("{hidden} note{s} about the scene (shown with -v)"));
        }
    }

    fn diagnostic(&self, d: &Diagnostic, sources: &SourceMap) -> String {
        match self.message_format {
            MessageFormat::Human => sources.render(d),
            MessageFormat::Short => sources.one_line(d),
            MessageFormat::Json => {
                let file = sources.files.get(d.span.file as usize).map(|f| f.path.display().to_string());
                json!({
                    "severity": d.severity.to_string(), "message": d.message, "file": file, "line": d.span.line,
                    "column": d.span.column, "length": d.span.length, "help": d.help,
                })
                .to_string()
            }
        }
    }
}
