//! `hemilux info`: what a scene or a picture holds.

use crate::args::{ImageInfoArgs, InfoArgs};
use crate::failure::Failure;
use crate::{image, load, talk};
use hemilux_image::Format;
use std::path::Path;

mod scene;

/// Scenes together make one; each picture stands for itself.
pub fn run(args: &InfoArgs) -> Result<(), Failure> {
    let is_picture = |p: &&std::path::PathBuf| Format::from_path(p).is_some();
    let pictures: Vec<_> = args.files.iter().filter(is_picture).cloned().collect();
    if pictures.len() == args.files.len() {
        return image::info(&ImageInfoArgs { images: pictures, json: args.json, talk: args.talk });
    }
    if !pictures.is_empty() {
        return Err(Failure::usage("either scenes or pictures, not both at once"));
    }
    if let Some(name) = args.files.iter().find(|p| is_zones(p)) {
        let message = "a zonal solution belongs to its scene: use render --zones";
        return Err(Failure::input(format!("{}: {message}", name.display())));
    }
    let scene = load::scene(&args.files, &args.defines, args.lenient, &args.talk)?;
    let facts = scene::facts(scene);
    let text = if args.json { format!("{facts:#}\n") } else { scene::describe(&facts) };
    talk::data(&text)
}

fn is_zones(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hlxz"))
}
