//! Every way in which a command can end badly: an exit code, and one message that is printed once.

use crate::talk::Talk;
use hemilux_image::{ImageError, Reason};
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::process::ExitCode;
use std::sync::Mutex;

/// What the exit code says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The scene or another input is wrong.
    Input = 1,
    /// The command line is.
    Usage = 2,
    /// A file cannot be written, or memory does not suffice.
    Io = 3,
    /// The time was over before the target was reached; the result is written.
    Short = 4,
    /// A comparison is over its tolerance.
    Tolerance = 5,
    /// A defect of this program.
    Internal = 70,
    /// Interrupted; what there was is written.
    Interrupted = 130,
}

/// A bad end.
#[derive(Debug)]
pub struct Failure {
    kind: Kind,
    /// `None`: all has been said.
    message: Option<String>,
}

impl Failure {
    /// With a message.
    pub fn new(kind: Kind, message: impl Into<String>) -> Failure {
        Failure { kind, message: Some(message.into()) }
    }

    /// Without one: the user has been told, or nobody listens.
    pub fn silent(kind: Kind) -> Failure {
        Failure { kind, message: None }
    }

    /// The input is wrong.
    pub fn input(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Input, message)
    }

    /// The command line is wrong.
    pub fn usage(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Usage, message)
    }

    /// A file cannot be written, or memory does not suffice.
    pub fn io(message: impl Into<String>) -> Failure {
        Failure::new(Kind::Io, message)
    }

    /// A failed write to `path`.
    pub fn write(path: &Path, error: &io::Error) -> Failure {
        Failure::io(format!("{}: {error}", path.display()))
    }

    /// A failed write to standard output: quiet when its reader has gone away.
    pub fn stdout(error: &io::Error) -> Failure {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Failure::silent(Kind::Io),
            _ => Failure::io(format!("standard output: {error}")),
        }
    }

    /// Say it, and give the exit code.
    pub fn end(self, talk: &Talk) -> ExitCode {
        if let Some(message) = &self.message {
            talk.error(message);
        }
        ExitCode::from(self.kind as u8)
    }
}

/// Pictures that cannot be written, compared or shown.
impl From<ImageError> for Failure {
    fn from(error: ImageError) -> Failure {
        let kind = if matches!(error.reason, Reason::Io(_)) { Kind::Io } else { Kind::Input };
        Failure::new(kind, error.to_string())
    }
}

static LAST_PANIC: Mutex<String> = Mutex::new(String::new());

/// Keep the message of a panic instead of printing it: decoders of other people's making are caught and become errors.
pub fn remember_panics() {
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
        let what = info.payload();
        let text = what
            .downcast_ref::<&str>()
            .map(ToString::to_string)
            .or_else(|| what.downcast_ref::<String>().cloned())
            .unwrap_or_default();
        if let Ok(mut last) = LAST_PANIC.lock() {
            *last = format!("{text}{place}");
        }
    }));
}

/// Run `body`; a panic that nobody caught is a defect of this program, and is reported as such.
pub fn guarded(body: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    catch_unwind(AssertUnwindSafe(body)).unwrap_or_else(|_| {
        let what = LAST_PANIC.lock().map(|m| m.clone()).unwrap_or_default();
        Err(Failure::new(Kind::Internal, format!("internal error, please report: {what}")))
    })
}
