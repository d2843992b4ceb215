//! `hemilux merge`: films of parts of a picture, joined.

use crate::args::MergeArgs;
use crate::checkpoint;
use crate::failure::Failure;
use crate::output::{self, Header};
use crate::talk;
use hemilux::checkpoint::FilmFile;
use hemilux::picture;
use hemilux_image::atomic;
use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;

/// Join films and write them.
pub fn run(args: MergeArgs) -> Result<(), Failure> {
    let (films, pictures): (Vec<PathBuf>, Vec<PathBuf>) =
        args.outputs.into_iter().partition(|p| p.extension().is_some_and(|e| e == "hlxf"));
    films.iter().try_for_each(|p| checkpoint::check_path(p))?;
    let targets = output::targets(&pictures, &[], None)?;
    let read = |path: &PathBuf| Ok::<_, Failure>((path.display().to_string(), checkpoint::read(path)?));
    let parts = args.films.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    let joined = hemilux::checkpoint::join(&parts).map_err(|e| Failure::input(e.to_string()))?;
    for path in &films {
        let body = |out: &mut io::BufWriter<std::fs::File>| joined.write(out);
        atomic::write(path, body).map_err(|e: io::Error| Failure::write(path, &e))?;
    }
    let header = header(&joined);
    let image = picture::image(&joined.film, &[]);
    for target in &targets {
        target.write(&image, &header, &args.screen)?;
    }
    if !args.talk.quiet {
        let names = films.iter().map(|p| p.display().to_string());
        let names: Vec<String> = names.chain(targets.iter().map(output::Target::name)).collect();
        talk::line(&format!(
            "joined {} film{}, {} seed{}, {} samples per pixel; wrote {}",
            parts.len(),
            if parts.len() == 1 { "" } else { "s" },
            joined.sources.len(),
            if joined.sources.len() == 1 { "" } else { "s" },
            spread(joined.film.samples()),
            names.join(", ")
        ));
    }
    Ok(())
}

fn spread((least, most): (u32, u32)) -> String {
    if least == most { least.to_string() } else { format!("{least} to {most}") }
}

/// What the films say of themselves, each key once, and what is known of the whole.
fn header(joined: &FilmFile) -> Header {
    let mut notes: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (key, value) in &joined.notes {
        let values = notes.entry(key).or_default();
        if !values.contains(&value.as_str()) {
            values.push(value);
        }
    }
    let (mut entries, mut radiance) = (Vec::new(), Vec::new());
    for (key, values) in notes {
        let (list, key) = match key.strip_prefix("radiance.") {
            Some(key) => (&mut radiance, key),
            None => (&mut entries, key),
        };
        list.push((key.to_owned(), values.join(" + ")));
    }
    let seeds: Vec<String> = joined.sources.iter().map(|(s, _)| s.seed.to_string()).collect();
    entries.push(("seed".into(), seeds.join(" ")));
    entries.push(("samples_per_pixel".into(), spread(joined.film.samples())));
    if let Some(e) = joined.film.relative_error() {
        entries.push(("relative_error".into(), format!("{e:.5}")));
    }
    Header { entries, radiance }
}
