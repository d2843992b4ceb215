//! Where pictures go: files by extension, or standard output; checked before anything is rendered.

use crate::args::{CurveName, ScreenArgs};
use crate::failure::Failure;
use crate::values::Exposure;
use hemilux::film::Film;
use hemilux_image::tone::{Curve, Exposure as Tone, ToneMap};
use hemilux_image::{Format, Image, ImageError, atomic, png, write};
use hemilux_scene::Scene;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Where one picture goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// A file, by the format of its extension.
    File(PathBuf, Format),
    /// EXR on standard output.
    Stdout,
}

/// The targets that were asked for; without any, the scene's own file name in the working directory.
pub fn targets(typed: &[PathBuf], scenes: &[PathBuf], scene: Option<&Scene>) -> Result<Vec<Target>, Failure> {
    let mut targets = Vec::new();
    for path in typed {
        let target = target(path)?;
        if targets.contains(&target) {
            return Err(Failure::usage(format!("{} is to be written twice", path.display())));
        }
        targets.push(target);
    }
    if targets.is_empty()
        && let Some(scene) = scene
    {
        targets.push(default_target(scene, scenes));
    }
    targets.iter().try_for_each(Target::check)?;
    Ok(targets)
}

fn target(path: &Path) -> Result<Target, Failure> {
    if path == Path::new("-") {
        return Ok(Target::Stdout);
    }
    match Format::from_path(path) {
        Some(format @ (Format::Exr | Format::Hdr | Format::Pfm | Format::Png)) => {
            Ok(Target::File(path.to_owned(), format))
        }
        _ => Err(Failure::usage(format!(
            "{}: pictures are written as .exr, .hdr, .png or .pfm",
            path.display()
        ))),
    }
}

fn default_target(scene: &Scene, scenes: &[PathBuf]) -> Target {
    let named = scene.film.filename.as_deref().and_then(|f| Path::new(f).file_name()).map(PathBuf::from);
    let named = named.unwrap_or_else(|| {
        let name = scenes.first().and_then(|p| p.file_name()).unwrap_or_default().to_string_lossy();
        let stem = name.strip_suffix(".gz").unwrap_or(&name);
        let stem = stem.strip_suffix(".pbrt").unwrap_or(stem);
        PathBuf::from(if matches!(stem, "" | "-") { "hemilux" } else { stem }).with_extension("exr")
    });
    target(&named).unwrap_or_else(|_| Target::File(named.with_extension("exr"), Format::Exr))
}

/// That a file can be made at `path`: its directory is there and takes files, and it is no directory itself.
pub fn check_writable(path: &Path) -> Result<(), Failure> {
    let failed = |e: io::Error| Failure::write(path, &e);
    match std::fs::metadata(path) {
        Ok(m) if m.is_dir() => return Err(failed(io::ErrorKind::IsADirectory.into())),
        Ok(m) if m.permissions().readonly() => return Err(failed(io::ErrorKind::PermissionDenied.into())),
        // A device or a pipe is written to as it is.
        Ok(m) if !m.is_file() => return Ok(()),
        _ => {}
    }
    let directory = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let probe = directory.join(format!(".hemilux-{}.tmp", std::process::id()));
    std::fs::OpenOptions::new().write(true).create_new(true).open(&probe).map_err(failed)?;
    std::fs::remove_file(&probe).map_err(failed)
}

/// What every picture carries besides its pixels.
#[derive(Clone, Debug, Default)]
pub struct Header {
    /// Key and value, in order.
    pub entries: Vec<(String, String)>,
    /// Further lines for Radiance.
    pub radiance: Vec<(String, String)>,
}

impl Target {
    /// The name of it.
    pub fn name(&self) -> String {
        match self {
            Target::File(path, _) => path.display().to_string(),
            Target::Stdout => "standard output".into(),
        }
    }

    fn check(&self) -> Result<(), Failure> {
        match self {
            Target::File(path, _) => check_writable(path),
            Target::Stdout if io::stdout().is_terminal() => Err(Failure::usage(
                "a picture is not for a terminal: redirect standard output, or name a file",
            )),
            Target::Stdout => Ok(()),
        }
    }

    /// Write `image`; says what was done to it for the screen, if anything.
    pub fn write(
        &self,
        image: &Image,
        header: &Header,
        screen: &ScreenArgs,
    ) -> Result<Option<String>, Failure> {
        match self {
            Target::Stdout => {
                let mut out = io::stdout().lock();
                encode(image, Format::Exr, header, screen, &mut out).map_err(|e| match e.reason {
                    hemilux_image::Reason::Io(e) => Failure::stdout(&e),
                    _ => e.into(),
                })
            }
            Target::File(path, format) => {
                let mut said = None;
                let body = |out: &mut io::BufWriter<std::fs::File>| {
                    said = encode(image, *format, header, screen, out)?;
                    Ok(())
                };
                atomic::write(path, body).map_err(|e: ImageError| e.at(path))?;
                Ok(said)
            }
        }
    }

    fn format(&self) -> Format {
        match self {
            Target::File(_, format) => *format,
            Target::Stdout => Format::Exr,
        }
    }
}

/// The bytes of a file.
fn encode(
    image: &Image,
    format: Format,
    header: &Header,
    screen: &ScreenArgs,
    out: &mut impl Write,
) -> Result<Option<String>, ImageError> {
    let mut said = None;
    match format {
        Format::Png => {
            let (pixels, words) = on_screen(image, screen)?;
            let mut entries = header.entries.clone();
            if let Some((key, _)) = entries.iter_mut().find(|(k, _)| k == "software") {
                // The keyword that PNG knows.
                *key = "Software".into();
            }
            entries.push(("exposure".into(), words.clone()));
            png::encode_rgb8(&pixels, &entries, out)?;
            said = Some(words);
        }
        Format::Hdr => {
            let mut image = Image { metadata: Vec::new(), ..image.clone() };
            for (key, value) in &header.entries {
                match key.as_str() {
                    // Radiance lists command lines as they are.
                    "command" => image.metadata.push(("COMMAND".into(), value.clone())),
                    key => image.metadata.push((key.to_ascii_uppercase(), value.clone())),
                }
            }
            image.metadata.extend(header.radiance.iter().cloned());
            write::encode_to(&image, format, out)?;
        }
        _ => {
            let image = Image { metadata: header.entries.clone(), ..image.clone() };
            write::encode_to(&image, format, out)?;
        }
    }
    Ok(said)
}

/// Pixels for a screen, and in words what was done to get them.
pub fn on_screen(
    image: &Image,
    screen: &ScreenArgs,
) -> Result<(hemilux_image::tone::Rgb8, String), ImageError> {
    let mut linear = image.clone();
    linear.to_linear();
    let (factor, how) = match screen.exposure {
        Exposure::Stops(stops) => (stops.exp2(), format!("{stops:+} stops")),
        Exposure::Auto => {
            let factor = Tone::Percentile { percent: 95.0, target: 0.8 }.factor(&linear)?;
            (factor, "auto".to_owned())
        }
    };
    let curve = match screen.curve {
        CurveName::Clamp => Curve::Clamp,
        CurveName::Reinhard => Curve::Reinhard { white: screen.white },
        CurveName::Hable => Curve::Hable,
        CurveName::Aces => Curve::Aces,
    };
    let map = ToneMap { exposure: Tone::Stops(factor.log2()), curve, dithered: false };
    let name = match screen.curve {
        CurveName::Clamp => "",
        CurveName::Reinhard => ", curve reinhard",
        CurveName::Hable => ", curve hable",
        CurveName::Aces => ", curve aces",
    };
    Ok((map.apply(&linear)?, format!("x{factor:.4} ({how}){name}")))
}

/// Rows of this length are written for practice.
const TRIAL_WIDTH: u32 = 128;
/// For synchronising a file with the disk.
const PER_FILE: Duration = Duration::from_millis(15);

/// How long writing a picture of so many pixels will take: by trial with noise that packs as badly as a render.
pub fn writing_time(targets: &[Target], pixels: u64, screen: &ScreenArgs) -> Duration {
    // The first trial starts threads and warms caches; the second one, of a sixteenth of the picture, counts.
    let rows = (pixels / 16 / TRIAL_WIDTH as u64).clamp(64, 1024) as u32;
    let trial = |rows: u32| {
        let noise = noise(rows);
        let begin = Instant::now();
        for target in targets {
            // Into memory: the disk has its own allowance. A failure will be told when it is in earnest.
            let _ = encode(&noise, target.format(), &Header::default(), screen, &mut Vec::new());
        }
        begin.elapsed()
    };
    trial(16);
    let per_pixel = trial(rows).as_secs_f64() / (rows * TRIAL_WIDTH) as f64;
    Duration::from_secs_f64(per_pixel * pixels as f64) + PER_FILE * targets.len() as u32
}

fn noise(rows: u32) -> Image {
    let film = Film::new(TRIAL_WIDTH, rows, [0, TRIAL_WIDTH, 0, rows]);
    let mut image = hemilux::picture::image(&film, &[]);
    let mut state = 1u32;
    // Colours and their errors are noise; surfaces are mostly flat, and pack well.
    let noisy = |name: &str| matches!(name, "R" | "G" | "B" | "depth.Z") || name.starts_with("stderr");
    for channel in image.channels.iter_mut().filter(|c| noisy(&c.name)) {
        channel.data.iter_mut().for_each(|v| {
            state = state.wrapping_mul(0x915f_77f5).wrapping_add(0x3c6e_f35f);
            *v = (state >> 8) as f32 / (1 << 24) as f32;
        });
    }
    image
}
