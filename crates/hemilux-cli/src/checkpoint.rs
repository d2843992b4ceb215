//! Films on disk: checkpoints of a render, and what a run that goes on from one must have in common with it.

use crate::args::SolutionArgs;
use crate::failure::Failure;
use crate::output;
use crate::talk::Talk;
use hemilux::checkpoint::{self, FilmFile, FilmFileError, Origin, Source, ZoneSource};
use hemilux::film::Film;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_image::atomic;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Writes the film every so often.
pub struct Keeper {
    path: Option<PathBuf>,
    every: Duration,
    last: Instant,
    talk: Talk,
    trouble: Option<String>,
    origin: Origin,
    notes: Vec<(String, String)>,
    source: Source,
}

impl Keeper {
    /// Keep films of `origin` and `source` at `path`, if there is one.
    pub fn new(
        path: Option<PathBuf>,
        every: Duration,
        talk: Talk,
        origin: Origin,
        notes: Vec<(String, String)>,
        source: Source,
    ) -> Keeper {
        Keeper { path, every, last: Instant::now(), talk, trouble: None, origin, notes, source }
    }

    /// Where films go.
    pub fn path(&self) -> Option<&Path> {
        self.path.as_deref()
    }

    /// Write the film if it is time to.
    pub fn look(&mut self, film: &Film) {
        if self.last.elapsed() >= self.every {
            self.keep(film);
        }
    }

    /// Write the film. A failure is told at once, and does not end the render: the old file is untouched, and the next
    /// attempt may find room on the disk.
    pub fn keep(&mut self, film: &Film) {
        let Some(path) = &self.path else { return };
        let body =
            |out: &mut BufWriter<File>| checkpoint::write(&self.origin, &self.notes, &self.source, film, out);
        let trouble = atomic::write(path, body).err().map(|e: io::Error| format!("{}: {e}", path.display()));
        if let Some(what) = &trouble
            && self.trouble.is_none()
        {
            self.talk.warning(&format!("no checkpoint could be written: {what}; the render goes on"));
        }
        self.trouble = trouble;
        self.last = Instant::now();
    }

    /// The failure of the last attempt to write.
    pub fn end(self) -> Result<(), Failure> {
        match self.trouble {
            Some(what) => Err(Failure::io(format!("the last checkpoint could not be written: {what}"))),
            None => Ok(()),
        }
    }
}

/// Read a film file.
pub fn read(path: &Path) -> Result<FilmFile, Failure> {
    let bytes = std::fs::read(path).map_err(|e| Failure::input(format!("{}: {e}", path.display())))?;
    FilmFile::read(&bytes).map_err(|e| refused(path, &e))
}

/// That a film cannot be used, and why.
pub fn refused(path: &Path, error: &FilmFileError) -> Failure {
    Failure::input(format!("{}: {error}", path.display()))
}

/// The one source of a film that is to be gone on with.
pub fn single_source(path: &Path, file: &FilmFile) -> Result<Source, Failure> {
    match file.sources.as_slice() {
        [(source, _)] => Ok(source.clone()),
        sources => Err(Failure::input(format!(
            "{}: a film of {} seeds cannot be gone on with; render another seed and merge",
            path.display(),
            sources.len()
        ))),
    }
}

/// That the run asks for the samples and the zones of the file. What the command line does not say of the zones is taken from
/// the file.
pub fn check_source(path: &Path, source: &Source, seed: u64, asked: &SolutionArgs) -> Result<(), Failure> {
    let differs = |what: &'static str, theirs: u64, ours: u64| {
        let (theirs, ours) = (theirs.to_string(), ours.to_string());
        Err(refused(path, &FilmFileError::Differs { what, theirs, ours }))
    };
    if source.seed != seed {
        return differs("seed", source.seed, seed);
    }
    match source.zones {
        ZoneSource::Solved { budget, .. } if asked.zone_budget.is_some_and(|n| n != budget as u64) => {
            differs("zone budget", budget as u64, asked.zone_budget.unwrap_or(0))
        }
        ZoneSource::Solved { particles, .. } if asked.particles.is_some_and(|n| n != particles) => {
            differs("number of particles", particles, asked.particles.unwrap_or(0))
        }
        _ => Ok(()),
    }
}

/// How the zones of this run came about.
pub fn zone_source(zones: Option<&Zones>, given: bool, solution: &ZoneOptions) -> ZoneSource {
    match zones {
        None => ZoneSource::None,
        Some(z) if given => ZoneSource::Given { fingerprint: z.fingerprint() },
        Some(z) => ZoneSource::Solved {
            budget: solution.budget,
            planned: solution.particles,
            particles: z.particles,
            seed: solution.seed,
            fingerprint: z.fingerprint(),
        },
    }
}

/// About how long writing a film of so many pixels takes, so that a time budget can keep it free.
pub fn writing_time(pixels: u64) -> Duration {
    // Half of its size in memory; packing and an ordinary disk make 100 MB/s.
    Duration::from_secs_f64(Film::bytes(pixels, 1) as f64 * 0.5 / 100e6) + Duration::from_millis(20)
}

/// That film files can be written at `path`.
pub fn check_path(path: &Path) -> Result<(), Failure> {
    if path.extension().is_none_or(|e| e != "hlxf") {
        return Err(Failure::usage(format!("{}: films are written as .hlxf", path.display())));
    }
    output::check_writable(path)
}
