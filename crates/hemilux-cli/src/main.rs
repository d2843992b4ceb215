//! The hemilux command: arguments in, exit code out.
//!
//! [`args`] is what was typed, [`values`] its typed words. Each verb has a room of its own; what they share is
//! [`load`] (scenes and what there is to say about them), [`output`] (pictures and their headers), [`progress`],
//! [`interrupt`] and [`failure`] (every way to end). Data goes to standard output, talk to standard error.

mod args;
mod check;
mod checkpoint;
mod completions;
mod defaults;
mod draw;
mod failure;
mod figures;
mod hints;
mod image;
mod info;
mod interrupt;
mod load;
mod machine;
mod merge;
mod output;
mod pilot;
mod plan;
mod probe;
mod progress;
mod prologue;
mod radiance;
mod render;
mod report;
mod rtrace;
mod sense;
mod splice;
mod talk;
mod validate;
mod values;
mod zones;

use args::{Cli, Verb};
use clap::Parser;
use failure::Failure;
use std::process::ExitCode;
use std::time::Instant;
use talk::Talk;

fn main() -> ExitCode {
    let begin = Instant::now();
    failure::remember_panics();
    let typed = match splice::splice(std::env::args_os().collect()) {
        Ok(typed) => typed,
        Err(failure) => return failure.end(&Talk::default()),
    };
    if let Some(list) = defaults::asked(&typed) {
        return talk::data(&list).map_or_else(|f| f.end(&Talk::default()), |()| ExitCode::SUCCESS);
    }
    let cli = match Cli::try_parse_from(typed) {
        Ok(cli) => cli,
        Err(message) => {
            // Nobody may be listening, and there is nobody else to tell.
            let _ = message.print();
            return ExitCode::from(message.exit_code().clamp(0, 255) as u8);
        }
    };
    let talk = cli.verb.talk();
    match failure::guarded(|| dispatch(cli, begin)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => failure.end(&talk),
    }
}

fn dispatch(cli: Cli, begin: Instant) -> Result<(), Failure> {
    match cli.verb {
        Verb::Render(args) => render::run(*args, begin),
        Verb::Merge(args) => merge::run(args),
        Verb::Validate(args) => validate::run(args, begin),
        Verb::Zones(args) => zones::run(args, begin),
        Verb::Rtrace { words } => rtrace::run(&words),
        Verb::Sense(args) => sense::run(args, begin),
        Verb::Probe(args) => probe::run(*args),
        Verb::Figures(args) => figures::run(args),
        Verb::Info(args) => info::run(&args),
        Verb::Check(args) => check::run(&args),
        Verb::Image(verb) => image::run(verb),
        Verb::Completions { shell } => completions::run(shell),
    }
}
