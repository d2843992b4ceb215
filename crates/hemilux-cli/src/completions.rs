//! `hemilux completions`: a script that teaches a shell our words.

use crate::args::Cli;
use crate::failure::Failure;
use crate::talk;
use clap::CommandFactory;
use clap_complete::Shell;

/// Print the script.
pub fn run(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "hemilux", &mut script);
    talk::data(&String::from_utf8_lossy(&script))
}
