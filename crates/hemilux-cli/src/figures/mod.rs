//! `hemilux figures`: the figures of Shirley and Chiu's report, drawn by the code that is about them.
//!
//! | file | report |
//! | --- | --- |
//! | figure-1.png | rendered image beside the zonal solution it is gathered from ([`room`]) |
//! | figure-2.svg | domains of integration ([`methods`]) |
//! | figure-3.svg | methods of integration, all on one integrand ([`methods`]) |
//! | figure-4.svg | from square to disk ([`maps`]) |
//! | figure-5.svg | a checkerboard on the hemisphere, and through (θ, φ) ([`maps`]) |
//! | section-4-missed.svg, -enlarged.svg, -detected.svg | small features ([`small`]) |
//! | thirty-years.svg | what became of it ([`years`]) |

mod args;
mod maps;
mod methods;
mod room;
mod small;
mod years;

use crate::failure::Failure;
use crate::output;
use crate::render::set_threads;
use crate::talk;
pub use args::FiguresArgs;
use hemilux_image::{ImageError, atomic};
use std::io::Write;
use std::path::Path;

/// A drawing and the name of its file.
type Drawing = (&'static str, fn(u64) -> String);

const DRAWINGS: [Drawing; 8] = [
    ("figure-2.svg", methods::domains),
    ("figure-3.svg", methods::methods),
    ("figure-4.svg", maps::square_to_disk),
    ("figure-5.svg", maps::checkerboard),
    ("section-4-missed.svg", small::missed),
    ("section-4-enlarged.svg", small::enlarged),
    ("section-4-detected.svg", small::detected),
    ("thirty-years.svg", years::thirty_years),
];

/// Draw all of them.
pub fn run(args: FiguresArgs) -> Result<(), Failure> {
    set_threads(args.threads)?;
    let directory = &args.directory;
    std::fs::create_dir_all(directory).map_err(|e| Failure::write(directory, &e))?;
    output::check_writable(&directory.join("figure-1.png"))?;
    let say = |name: &str| {
        if !args.talk.quiet {
            talk::line(&format!("wrote {}", directory.join(name).display()));
        }
    };
    for (name, draw) in DRAWINGS {
        write(&directory.join(name), &draw(args.seed))?;
        say(name);
    }
    if !args.no_render {
        room::write(&directory.join("figure-1.png"), args.spp, args.seed, &args.talk)?;
        say("figure-1.png");
    }
    Ok(())
}

/// Write text; the file is either the old one or the whole new one.
pub fn write(path: &Path, text: &str) -> Result<(), Failure> {
    atomic::write(path, |out| out.write_all(text.as_bytes()).map_err(ImageError::from))
        .map_err(|e| Failure::io(format!("{}: {e}", path.display())))
}
