//! Ctrl-C and SIGTERM: the first asks to stop and to write what there is, the second ends at once.

use crate::failure::{Failure, Kind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user wants an end.
#[derive(Clone, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    /// Whether there is something worth writing; before, an interrupt ends the program.
    armed: Arc<AtomicBool>,
}

impl Interrupt {
    /// Listen from now on.
    pub fn listen() -> Interrupt {
        let interrupt = Interrupt::default();
        let heard = interrupt.clone();
        // Without a handler an interrupt ends the program as everywhere else: nothing to report.
        let _ = ctrlc::set_handler(move || {
            if heard.asked.swap(true, Ordering::SeqCst) || !heard.armed.load(Ordering::SeqCst) {
                std::process::exit(Kind::Interrupted as i32);
            }
        });
        interrupt
    }

    /// From here on there is something to write.
    pub fn arm(&self) {
        self.armed.store(true, Ordering::SeqCst);
    }

    /// The flag that is set when the user asks.
    pub fn flag(&self) -> &AtomicBool {
        &self.asked
    }

    /// Whether the user asked.
    pub fn asked(&self) -> bool {
        self.asked.load(Ordering::SeqCst)
    }

    /// The end that an interrupt means, after writing.
    pub fn failure(what: &str) -> Failure {
        Failure::new(Kind::Interrupted, format!("interrupted: {what}"))
    }
}
