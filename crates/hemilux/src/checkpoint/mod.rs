//! The film on disk (`.hlxf`): checkpoints that a run goes on from, and parts of a picture that are joined.
//!
//! A film file holds the exact sums of every tile, which passes are in them, and everything the samples depend on: hashes
//! of scene and view, the options, and per *source* (a seed with its zonal solution) what re-derives the solution. The
//! solution itself is not stored: it is a function of scene, zone budget, seed and the numbers of particles planned and
//! traced, also where time ended the particles; its fingerprint is stored, so that a solution that came out differently is noticed
//! and refused. What a renderer learns before its first pass is stored as parameters (opaque bytes) that re-derive it.
//!
//! Layout, little-endian: magic `HLXFILM\n`, version u32, program version (text), scene hash u64, view hash u64, film
//! (width, height, x0, x1, y0, y1: u32), options (mode and strategy as text, gather rays, shadow rays, longest path u32,
//! share of residuals f32), notes (pairs of text), sources (seed, zonal solution, prologue, passes per tile), tiles (pixel
//! by pixel, variable-length integers), CRC-32 (IEEE) of all before it. Texts and lists begin with their length (u32).
//!
//! Invariants: a file that is read has as many samples in every pixel as passes cover its tile; [`join`] gives the same
//! bytes whatever the order of its films.

mod join;

use crate::film::{Film, Pixel};
use crate::render::{Mode, RenderOptions};
use crate::strategies;
use crate::zones::Zones;
use hemilux_scene::Scene;
use hemiquad::points::Key;
use std::io::{self, Write};
use std::ops::Range;

pub use join::{JoinError, join};

const MAGIC: &[u8; 8] = b"HLXFILM\n";
/// Version of the layout.
const VERSION: u32 = 1;
/// Version of the program: other versions may draw other samples.
const PROGRAM: &str = if cfg!(feature = "wrong-physics") {
    concat!(env!("CARGO_PKG_VERSION"), " with wrong physics")
} else {
    env!("CARGO_PKG_VERSION")
};

/// Why a film file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FilmFileError {
    /// Reading or writing failed.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// Something else.
    #[error("not a film of hemilux (.hlxf)")]
    Magic,
    /// Another layout.
    #[error("a film file of version {0}, this program reads version {VERSION}")]
    Version(u32),
    /// Another program version.
    #[error("written by hemilux {0}, this is {PROGRAM}: its samples may differ")]
    Program(String),
    /// Cut short or altered.
    #[error("the file is damaged: {0}")]
    Damaged(&'static str),
    /// Made for something else.
    #[error("made with another {what}: {theirs} in the file, {ours} here")]
    Differs {
        /// What differs.
        what: &'static str,
        /// In the file.
        theirs: String,
        /// Wanted.
        ours: String,
    },
}

/// What all samples of a film have in common: everything they depend on but the seed and the zonal solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Origin {
    /// Hash of all files of the scene.
    pub scene: u64,
    /// Hash of camera, filter and film scale.
    pub view: u64,
    /// Pixels across and down of the whole picture.
    pub size: [u32; 2],
    /// What shapes the samples; its seed does not count.
    pub options: RenderOptions,
    /// Share of gather rays that carry a residual (mode corrected).
    pub residual: f32,
}

/// How a zonal solution came about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ZoneSource {
    /// There is none.
    None,
    /// Particles were traced.
    Solved {
        /// Most zones.
        budget: u32,
        /// Particles that were planned: the solution may depend on the plan.
        planned: u64,
        /// Particles traced.
        particles: u64,
        /// Their seed.
        seed: u64,
        /// [`Zones::fingerprint`] of the result.
        fingerprint: u64,
    },
    /// It was read from a file.
    Given {
        /// [`Zones::fingerprint`] of it.
        fingerprint: u64,
    },
}

/// Where samples come from: a seed and what was learned before the passes.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Source {
    /// Seed of the samples.
    pub seed: u64,
    /// The zonal solution.
    pub zones: ZoneSource,
    /// Parameters that re-derive whatever else was learned before the first pass.
    pub prologue: Vec<u8>,
}

/// Passes by tile, or by source within a tile.
pub type Coverage = Vec<Vec<Range<u32>>>;

/// A film with its provenance.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// What the samples depend on.
    pub origin: Origin,
    /// Keys and values for people, and for the header of pictures.
    pub notes: Vec<(String, String)>,
    /// Sources, in order, and which passes of each are in which tile.
    pub sources: Vec<(Source, Coverage)>,
    /// The sums. Tiles name their passes only where there is one source.
    pub film: Film,
}

/// Hash of what the film file of `scene` depends on besides its files: camera (also one from elsewhere) and filter.
pub fn view_hash(scene: &Scene) -> u64 {
    let c = &scene.camera;
    let text = format!(
        "{:?} {:?} {:?} {:?} {:?} {:?} {:?}",
        c.projection,
        c.to_world,
        c.screen_window,
        c.lens_radius,
        c.focal_distance,
        scene.filter,
        scene.film.scale
    );
    text.bytes().fold(Key::new(0x71_e3), |key, b| key.with(b as u64)).bits64(0)
}

impl Origin {
    /// That a film of origin `self` may be continued with, or joined to, one of `ours`.
    ///
    /// # Errors
    /// The first thing that differs.
    pub fn check(&self, ours: &Origin) -> Result<(), FilmFileError> {
        let name = |m: Mode| Mode::ALL.iter().find(|n| n.1 == m).map_or("", |n| n.0).to_owned();
        let strategy = strategies::name;
        let hash = |h: u64| format!("{h:016x}");
        let size = |s: [u32; 2]| format!("{}x{}", s[0], s[1]);
        let depth = |d: u32| if d == u32::MAX { "none".to_owned() } else { d.to_string() };
        let (a, b) = (&self.options, &ours.options);
        for (what, theirs, ours) in [
            ("scene", hash(self.scene), hash(ours.scene)),
            ("picture size", size(self.size), size(ours.size)),
            ("view", hash(self.view), hash(ours.view)),
            ("mode", name(a.mode), name(b.mode)),
            ("strategy", strategy(a.plan.strategy), strategy(b.plan.strategy)),
            ("number of gather rays", a.plan.rays.to_string(), b.plan.rays.to_string()),
            ("number of shadow rays", a.plan.shadow_rays.to_string(), b.plan.shadow_rays.to_string()),
            ("max depth", depth(a.max_depth), depth(b.max_depth)),
            ("share of residuals", self.residual.to_string(), ours.residual.to_string()),
        ] {
            if theirs != ours {
                return Err(FilmFileError::Differs { what, theirs, ours });
            }
        }
        Ok(())
    }
}

impl ZoneSource {
    /// The fingerprint of the solution, if there is one.
    pub fn fingerprint(&self) -> Option<u64> {
        match *self {
            ZoneSource::None => None,
            ZoneSource::Solved { fingerprint, .. } | ZoneSource::Given { fingerprint } => Some(fingerprint),
        }
    }

    /// That `zones` is the solution this describes.
    ///
    /// # Errors
    /// It is another one.
    pub fn check(&self, zones: Option<&Zones>) -> Result<(), FilmFileError> {
        let (theirs, ours) = (self.fingerprint(), zones.map(Zones::fingerprint));
        if theirs == ours {
            return Ok(());
        }
        let say = |f: Option<u64>| f.map_or("none".to_owned(), |f| format!("{f:016x}"));
        Err(FilmFileError::Differs { what: "zonal solution", theirs: say(theirs), ours: say(ours) })
    }
}

/// Write a film of one source, as it is now.
pub fn write(
    origin: &Origin,
    notes: &[(String, String)],
    source: &Source,
    film: &Film,
    out: &mut dyn Write,
) -> io::Result<()> {
    let passes = |tile: usize| film.tiles()[tile].passes();
    write_sources(origin, notes, &[(source, &passes)], film, out)
}

type Passes<'a> = &'a dyn Fn(usize) -> &'a [Range<u32>];

fn write_sources(
    origin: &Origin,
    notes: &[(String, String)],
    sources: &[(&Source, Passes)],
    film: &Film,
    out: &mut dyn Write,
) -> io::Result<()> {
    let mut out = Summed { out, crc: crc32fast::Hasher::new() };
    let mut head = Vec::new();
    head.extend_from_slice(MAGIC);
    put32(&mut head, VERSION);
    put_text(&mut head, PROGRAM.as_bytes());
    put64(&mut head, origin.scene);
    put64(&mut head, origin.view);
    let [w, h] = origin.size;
    [w, h].into_iter().chain(film.region()).for_each(|v| put32(&mut head, v));
    let o = &origin.options;
    let mode = Mode::ALL.iter().find(|n| n.1 == o.mode).map_or("", |n| n.0);
    let strategy = strategies::name(o.plan.strategy);
    put_text(&mut head, mode.as_bytes());
    put_text(&mut head, strategy.as_bytes());
    [o.plan.rays, o.plan.shadow_rays, o.max_depth, origin.residual.to_bits()]
        .into_iter()
        .for_each(|v| put32(&mut head, v));
    put32(&mut head, notes.len() as u32);
    for (key, value) in notes {
        put_text(&mut head, key.as_bytes());
        put_text(&mut head, value.as_bytes());
    }
    put32(&mut head, sources.len() as u32);
    for (source, passes) in sources {
        put64(&mut head, source.seed);
        put_zones(&mut head, &source.zones);
        put_text(&mut head, &source.prologue);
        for tile in 0..film.tiles().len() {
            let passes = passes(tile);
            put32(&mut head, passes.len() as u32);
            passes.iter().for_each(|r| [r.start, r.end].into_iter().for_each(|v| put32(&mut head, v)));
        }
    }
    out.put(&head)?;
    let mut bytes = Vec::new();
    for tile in film.tiles() {
        bytes.clear();
        tile.pixels.iter().for_each(|p| p.encode(&mut bytes));
        out.put(&bytes)?;
    }
    let crc = out.crc.finalize();
    out.out.write_all(&crc.to_le_bytes())
}

/// A writer that keeps the checksum.
struct Summed<'a> {
    out: &'a mut dyn Write,
    crc: crc32fast::Hasher,
}

impl Summed<'_> {
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.crc.update(bytes);
        self.out.write_all(bytes)
    }
}

fn put32(out: &mut Vec<u8>, v: u32) {
    out.extend_from_slice(&v.to_le_bytes());
}

fn put64(out: &mut Vec<u8>, v: u64) {
    out.extend_from_slice(&v.to_le_bytes());
}

fn put_text(out: &mut Vec<u8>, text: &[u8]) {
    put32(out, text.len() as u32);
    out.extend_from_slice(text);
}

fn put_zones(out: &mut Vec<u8>, zones: &ZoneSource) {
    match *zones {
        ZoneSource::None => out.push(0),
        ZoneSource::Solved { budget, planned, particles, seed, fingerprint } => {
            out.push(1);
            put32(out, budget);
            [planned, particles, seed, fingerprint].into_iter().for_each(|v| put64(out, v));
        }
        ZoneSource::Given { fingerprint } => {
            out.push(2);
            put64(out, fingerprint);
        }
    }
}

impl FilmFile {
    /// Write it, as [`write`] does.
    pub fn write(&self, out: &mut dyn Write) -> io::Result<()> {
        let passes: Vec<_> =
            self.sources.iter().map(|(_, c)| move |tile: usize| c[tile].as_slice()).collect();
        let sources: Vec<(&Source, Passes)> =
            self.sources.iter().zip(&passes).map(|((s, _), p)| (s, p as Passes)).collect();
        write_sources(&self.origin, &self.notes, &sources, &self.film, out)
    }

    /// Read one.
    ///
    /// # Errors
    /// Not a film file, another version, or damaged; never a panic, and never more memory than some ten times the file.
    pub fn read(bytes: &[u8]) -> Result<FilmFile, FilmFileError> {
        if bytes.len() < MAGIC.len() || &bytes[..MAGIC.len()] != MAGIC {
            return Err(FilmFileError::Magic);
        }
        let mut at = Reader { bytes: &bytes[MAGIC.len()..] };
        let version = at.u32()?;
        if version != VERSION {
            return Err(FilmFileError::Version(version));
        }
        let body = bytes.len().saturating_sub(4);
        let crc = u32::from_le_bytes(bytes[body..].try_into().unwrap_or_default());
        if crc32fast::hash(&bytes[..body]) != crc {
            return Err(FilmFileError::Damaged("its checksum does not match (truncated or altered)"));
        }
        at.bytes = &bytes[MAGIC.len() + 4..body];
        let program = at.text()?;
        if program != PROGRAM {
            return Err(FilmFileError::Program(program));
        }
        let (scene, view) = (at.u64()?, at.u64()?);
        let mut shape = [0; 6];
        for v in &mut shape {
            *v = at.u32()?;
        }
        let [width, height, x0, x1, y0, y1] = shape;
        if x0 >= x1 || x1 > width || y0 >= y1 || y1 > height {
            return Err(FilmFileError::Damaged("its region is not in its picture"));
        }
        if (x1 - x0) as u64 * (y1 - y0) as u64 * Pixel::LEAST_BYTES as u64 > at.bytes.len() as u64 {
            return Err(FilmFileError::Damaged("it ends too early"));
        }
        let (options, residual) = at.options()?;
        let mut notes = Vec::new();
        for _ in 0..at.u32()? {
            notes.push((at.text()?, at.text()?));
        }
        let mut film = Film::new(width, height, [x0, x1, y0, y1]);
        let mut sources: Vec<(Source, Coverage)> = Vec::new();
        for _ in 0..at.u32()? {
            let source = Source { seed: at.u64()?, zones: at.zones()?, prologue: at.bytes()?.to_vec() };
            let coverage = film.tiles().iter().map(|_| at.passes()).collect::<Result<Vec<_>, _>>()?;
            if sources.last().is_some_and(|(s, _)| *s >= source) {
                return Err(FilmFileError::Damaged("its sources are not in order"));
            }
            sources.push((source, coverage));
        }
        let single = sources.len() == 1;
        for (i, tile) in film.tiles_mut().iter_mut().enumerate() {
            let all = sources.iter().flat_map(|(_, c)| &c[i]);
            let samples = all.map(|r| (r.end - r.start) as u64).sum::<u64>();
            for pixel in &mut tile.pixels {
                *pixel =
                    Pixel::decode(&mut at.bytes).ok_or(FilmFileError::Damaged("a pixel is no number"))?;
                if pixel.samples() as u64 != samples {
                    return Err(FilmFileError::Damaged("its samples are not those of its passes"));
                }
            }
            if single {
                sources[0].1[i].iter().cloned().for_each(|r| {
                    // Disjoint, as read.
                    let _ = tile.cover(r);
                });
            }
        }
        if !at.bytes.is_empty() {
            return Err(FilmFileError::Damaged("something follows its end"));
        }
        let origin = Origin { scene, view, size: [width, height], options, residual };
        Ok(FilmFile { origin, notes, sources, film })
    }
}

struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    fn take<const N: usize>(&mut self) -> Result<[u8; N], FilmFileError> {
        let short = FilmFileError::Damaged("it ends too early");
        let (head, rest) = self.bytes.split_first_chunk::<N>().ok_or(short)?;
        self.bytes = rest;
        Ok(*head)
    }

    fn u32(&mut self) -> Result<u32, FilmFileError> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn u64(&mut self) -> Result<u64, FilmFileError> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn bytes(&mut self) -> Result<&'a [u8], FilmFileError> {
        let n = self.u32()? as usize;
        let short = FilmFileError::Damaged("it ends too early");
        let (head, rest) = self.bytes.split_at_checked(n).ok_or(short)?;
        self.bytes = rest;
        Ok(head)
    }

    fn text(&mut self) -> Result<String, FilmFileError> {
        let bytes = self.bytes()?.to_vec();
        String::from_utf8(bytes).map_err(|_| FilmFileError::Damaged("a text is not UTF-8"))
    }

    fn options(&mut self) -> Result<(RenderOptions, f32), FilmFileError> {
        let (mode, strategy) = (self.text()?, self.text()?);
        let unknown = FilmFileError::Damaged("an unknown mode or strategy");
        let mode = Mode::ALL.iter().find(|n| n.0 == mode).map(|n| n.1);
        let strategy = strategies::parse(&strategy);
        let (Some(mode), Some(strategy)) = (mode, strategy) else { return Err(unknown) };
        let plan = crate::gather::GatherPlan { rays: self.u32()?, shadow_rays: self.u32()?, strategy };
        let options = RenderOptions { mode, plan, seed: 0, max_depth: self.u32()? };
        Ok((options, f32::from_bits(self.u32()?)))
    }

    fn zones(&mut self) -> Result<ZoneSource, FilmFileError> {
        Ok(match self.take()? {
            [0] => ZoneSource::None,
            [1] => ZoneSource::Solved {
                budget: self.u32()?,
                planned: self.u64()?,
                particles: self.u64()?,
                seed: self.u64()?,
                fingerprint: self.u64()?,
            },
            [2] => ZoneSource::Given { fingerprint: self.u64()? },
            _ => return Err(FilmFileError::Damaged("an unknown kind of zonal solution")),
        })
    }

    fn passes(&mut self) -> Result<Vec<Range<u32>>, FilmFileError> {
        let (mut passes, mut end) = (Vec::new(), None);
        for _ in 0..self.u32()? {
            let range = self.u32()?..self.u32()?;
            if range.is_empty() || end.is_some_and(|e| range.start <= e) {
                return Err(FilmFileError::Damaged("its passes are not in order"));
            }
            end = Some(range.end);
            passes.push(range);
        }
        Ok(passes)
    }
}
