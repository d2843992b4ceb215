//! `--defaults`: every option of a command with its value and a line of explanation, in the form that `@FILE` reads.

use crate::args::Cli;
use clap::{Command, CommandFactory};
use std::ffi::OsString;

/// The list, if the words ask for it; they name the command, and need not be complete otherwise.
pub fn asked(words: &[OsString]) -> Option<String> {
    let words: Vec<&str> = words.iter().filter_map(|w| w.to_str()).take_while(|w| *w != "--").collect();
    if !words.contains(&"--defaults") {
        return None;
    }
    let cli = Cli::command();
    let mut command = &cli;
    for word in &words[1..] {
        if let Some(inner) = command.find_subcommand(word) {
            command = inner;
        }
    }
    Some(list(command))
}

fn list(command: &Command) -> String {
    let mut out = format!("# hemilux {}\n", command.get_name());
    for arg in command.get_arguments() {
        let Some(long) = arg.get_long().filter(|l| !matches!(*l, "help" | "version" | "defaults")) else {
            continue;
        };
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        let value =
            arg.get_default_values().iter().map(|v| v.to_string_lossy()).collect::<Vec<_>>().join(",");
        let takes = arg.get_action().takes_values();
        let line = match (takes, value.as_str()) {
            (true, "") => {
                let name = arg.get_value_names().and_then(|n| n.first()).map_or("VALUE", |n| n.as_str());
                format!("# --{long} {name}")
            }
            (true, value) => format!("--{long} {value}"),
            (false, _) => format!("# --{long}"),
        };
        out += &format!("{line:<36} # {help}\n");
    }
    out
}
