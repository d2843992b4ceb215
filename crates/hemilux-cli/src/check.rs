//! `hemilux check`: what a lighting model probably does not mean.
//!
//! The scene is read leniently, so that everything is said at once: what the importer has to say and what
//! [`hemilux::check`] finds. One line on standard output counts both.

use crate::args::CheckArgs;
use crate::failure::{Failure, Kind};
use crate::{load, talk};
use hemilux::world::World;
use hemilux_scene::Severity;

/// Say everything; with `--strict` anything said is an error.
pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let loaded = load::checked(&args.scenes, &args.defines, &args.talk)?;
    let imported = loaded.diagnostics.iter().filter(|d| d.severity >= Severity::Warning).count();
    let found = hemilux::check::findings(&World::new(loaded.scene));
    args.talk.diagnostics(&found, &loaded.sources);
    let total = imported + found.len();
    talk::data(&format!("{total} finding{}\n", if total == 1 { "" } else { "s" }))?;
    match total > 0 && args.strict {
        true => Err(Failure::silent(Kind::Tolerance)),
        false => Ok(()),
    }
}
