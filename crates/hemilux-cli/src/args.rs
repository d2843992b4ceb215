//! What can be typed. Defaults that depend on something else are resolved in [`crate::plan`].

use crate::figures::FiguresArgs;
use crate::hints::HintArgs;
use crate::probe::ProbeArgs;
use crate::talk::Talk;
use crate::values::{self, Crop, Depth, Exposure, Passes, Share, Size};
use clap::{Args, Parser, Subcommand, ValueEnum};
use hemilux::gather::Strategy;
use hemilux::render::Mode;
use std::path::PathBuf;
use std::time::Duration;

/// Render scenes by gathering over a zonal solution
#[derive(Parser, Debug)]
#[command(
    name = "hemilux",
    version,
    propagate_version = true,
    subcommand_required = true,
    arg_required_else_help = true
)]
#[command(after_help = "\
Examples:
  hemilux render scenes/mirror-room.pbrt -o room.exr -o room.png
  hemilux render scene.pbrt --time 30s --size 640x480 -o quick.png
  hemilux zones scene.pbrt -o scene.ply
  hemilux image diff room.exr reference.exr --tolerance 0.01
  hemilux info scene.pbrt

An argument @FILE stands for the words in that file.
Exit codes: 0 done, 1 the scene or input is wrong, 2 the command line is, 3 files or memory,
4 stopped before the target, 5 over the tolerance, 130 interrupted (what there was is written).")]
pub struct Cli {
    /// Print every option of a command with its default, fit to be edited and read back as @FILE
    #[arg(long, global = true)]
    pub defaults: bool,
    /// What to do.
    #[command(subcommand)]
    pub verb: Verb,
}

/// What to do.
#[derive(Subcommand, Debug)]
pub enum Verb {
    /// Render a scene to pictures
    Render(Box<RenderArgs>),
    /// Join films (.hlxf) of parts of a picture, or of the same picture with other passes or seeds
    Merge(MergeArgs),
    /// Compute the zonal solution of a scene and store it
    Zones(ZonesArgs),
    /// Read illuminance (or irradiance, radiance, luminance) at points, each with an interval
    Sense(SenseArgs),
    /// Stand in for Radiance's rtrace: rays from standard input, values to standard output
    #[command(disable_help_flag = true)]
    Rtrace {
        /// Options and scene (.oct or .rad) as rtrace takes them
        #[arg(trailing_var_arg = true, allow_hyphen_values = true, value_name = "RTRACE WORDS")]
        words: Vec<String>,
    },
    /// Lay open the hemisphere at one point: what arrives, where strategies look, what they make of it
    Probe(Box<ProbeArgs>),
    /// Draw the figures of Shirley and Chiu's report
    Figures(FiguresArgs),
    /// Compute every closed form of the validation list and write a page of verdicts
    Validate(ValidateArgs),
    /// Say what a scene or a picture holds
    Info(InfoArgs),
    /// Look for what a lighting model probably does not mean: open glass, doubled surfaces, lamps that light nothing
    Check(CheckArgs),
    /// Compare pictures and make them fit for a screen
    #[command(subcommand)]
    Image(ImageVerb),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
}

impl Verb {
    /// How this command talks.
    pub fn talk(&self) -> Talk {
        match self {
            Verb::Render(a) => a.talk,
            Verb::Merge(a) => a.talk,
            Verb::Zones(a) => a.talk,
            Verb::Sense(a) => a.talk,
            Verb::Probe(a) => a.talk,
            Verb::Figures(a) => a.talk,
            Verb::Validate(a) => a.talk,
            Verb::Info(a) => a.talk,
            Verb::Check(a) => a.talk,
            Verb::Image(ImageVerb::Diff(a)) => a.talk,
            Verb::Image(ImageVerb::Tonemap(a)) => a.talk,
            Verb::Image(ImageVerb::Falsecolor(a)) => a.talk,
            Verb::Image(ImageVerb::Info(a)) => a.talk,
            Verb::Rtrace { .. } | Verb::Completions { .. } => Talk::default(),
        }
    }
}

/// Files that make one scene, and how they are read.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// Scene files (.pbrt, .pbrt.gz; - is standard input); several make one scene
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// $KEY in the scene stands for VALUE
    #[arg(short = 'D', long = "define", value_name = "KEY=VALUE", value_parser = values::define)]
    pub defines: Vec<(String, String)>,
    /// Skip what is not understood, with a warning
    #[arg(long)]
    pub lenient: bool,
}

/// `render`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux render room.pbrt                              32 samples per pixel to the scene's own file name
  hemilux render room.pbrt --time 2m -o room.exr -o room.png
  hemilux render room.pbrt --mode path --spp 256 --max-depth file -o path.exr
  hemilux render room.pbrt --zones room.hlxz --view door.pbrt -o door.png
  hemilux render room.pbrt --spp 4 -o - | hemilux image info -")]
pub struct RenderArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What the user knows of it.
    #[command(flatten)]
    pub hints: HintArgs,
    /// Picture to write (.exr, .hdr, .png, .pfm; - is EXR on standard output); may be repeated
    #[arg(short, long = "output", visible_alias = "outfile", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,
    /// Samples per pixel [default without --time: 32; path: 128; zones: 4]
    #[arg(long, visible_alias = "pixelsamples", value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Time from the start of the program to the written file, such as 30s, 2m, 1h30m
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    pub time: Option<Duration>,
    /// Typical relative error of a pixel to reach, such as 2%; a pilot decides how many samples that takes, and is thrown away
    #[arg(long, value_name = "E", conflicts_with = "passes")]
    pub target_error: Option<Share>,
    /// More samples where a pilot, thrown away, finds more noise: numbers by tile, their mean as asked for
    #[arg(long, conflicts_with = "passes")]
    pub adaptive: bool,
    /// Only these of the samples of every pixel, A up to but not B: a share of the work of several machines (see merge)
    #[arg(long, value_name = "A..B", conflicts_with = "spp")]
    pub passes: Option<Passes>,
    /// JSON file to write: noise, fireflies, the zones' noise and bias, rays, times, budget
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Film (.hlxf) to write every so often, at an interrupt and at the end, for --resume and merge
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,
    /// How often the film is written
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = values::duration)]
    pub checkpoint_every: Duration,
    /// Film to go on from, of the same scene and options; it is also the checkpoint unless another is named
    #[arg(long, value_name = "FILE")]
    pub resume: Option<PathBuf>,
    /// What is computed: zonal (gathering; biased by the zones), corrected (the same without the bias), path (unbiased reference), zones (the zonal solution)
    #[arg(long, value_name = "MODE", default_value = "zonal", value_parser = named(&Mode::ALL))]
    pub mode: Mode,
    /// How the strata of a gather are chosen. Unbiased: jittered, sobol; over the whole hemisphere at once: uniform, luminaires,
    /// regions, two-stage. Biased: luminaires:ward, and the report's one-stage methods, report1994:voronoi,
    /// report1994:subdivision:contrast, report1994:subdivision:value, report1994:triangles, report1994:delaunay,
    /// report1994:enlarged:K, report1994:shrinking; these want 64 gather rays and more
    #[arg(long, value_name = "NAME", default_value = name_of(&Strategy::ALL, Strategy::default()), value_parser = values::strategy)]
    pub strategy: Strategy,
    /// Picture size instead of the scene's
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Camera from this file instead of the scene's (a .pbrt file with camera directives)
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    /// Part of the picture, in [0, 1]
    #[arg(long, visible_alias = "cropwindow", value_name = "x0,x1,y0,y1")]
    pub crop: Option<Crop>,
    /// Seed of all randomness
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: one per core]
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Most scattering events of a path (mode path); "file" takes the scene's [default: no limit]
    #[arg(long, value_name = "N|file")]
    pub max_depth: Option<Depth>,
    /// Share of the gather rays on zones that go on as paths (mode corrected) [default: measured]
    #[arg(long, value_name = "SHARE")]
    pub residuals: Option<Share>,
    /// Zonal solution to gather over, made by `hemilux zones` from the same scene
    #[arg(long, value_name = "FILE", conflicts_with_all = ["zone_budget", "particles"])]
    pub zones: Option<PathBuf>,
    /// How the zonal solution is made.
    #[command(flatten)]
    pub solution: SolutionArgs,
    /// Gather rays per visible point
    #[arg(long, value_name = "N", default_value_t = 48, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub gather_rays: u32,
    /// Shadow rays per visible point
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub shadow_rays: u32,
    /// Looks of PNG files.
    #[command(flatten)]
    pub screen: ScreenArgs,
    /// How to show progress (on standard error): a bar on a terminal, else a few lines at the end; JSON lines; nothing
    #[arg(long, value_enum, default_value = "auto", value_name = "FORM", help_heading = "Messages")]
    pub progress: ProgressForm,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// The name of a value in one of the library's lists.
pub fn name_of<T: PartialEq>(list: &[(&'static str, T)], value: T) -> &'static str {
    list.iter().find(|n| n.1 == value).map_or("", |n| n.0)
}

/// Clap's parser of a name from one of the library's lists.
fn named<T: Copy + Send + Sync + 'static>(
    list: &'static [(&'static str, T)],
) -> impl clap::builder::TypedValueParser<Value = T> {
    use clap::builder::{PossibleValuesParser, TypedValueParser};
    let names = PossibleValuesParser::new(list.iter().map(|n| n.0));
    names.try_map(move |name: String| list.iter().find(|n| n.0 == name).map(|n| n.1).ok_or("unknown name"))
}

/// How the zonal solution is made.
#[derive(Args, Clone, Copy, Debug)]
pub struct SolutionArgs {
    /// Most zones [default: 60000; with --time above 60 s: more, by its root, up to 480000 (render)]
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub zone_budget: Option<u64>,
    /// Most light particles [default: 2097152; with --time: as many as 10 % of it allow; more where gathers are surprised (render)]
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub particles: Option<u64>,
}

/// How a picture is made fit for a screen.
#[derive(Args, Clone, Copy, Debug)]
pub struct ScreenArgs {
    /// Brightness of PNG files: stops, or auto (the 95th percentile of luminance comes to 0.8)
    #[arg(long, value_name = "STOPS|auto", default_value = "auto", allow_hyphen_values = true)]
    pub exposure: Exposure,
    /// Tone curve of PNG files
    #[arg(long, value_enum, default_value = "clamp")]
    pub curve: CurveName,
    /// Luminance that becomes white (curve reinhard)
    #[arg(long, value_name = "L", default_value = "4", value_parser = values::positive)]
    pub white: f32,
}

/// Tone curves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CurveName {
    /// Cut at white.
    Clamp,
    /// Reinhard et al. 2002, on luminance.
    Reinhard,
    /// Hable 2010.
    Hable,
    /// Narkowicz 2015.
    Aces,
}

/// Forms of progress.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ProgressForm {
    /// A bar on a terminal, else a few lines at the end.
    Auto,
    /// A bar.
    Bar,
    /// One JSON object per line.
    Json,
    /// Nothing.
    None,
}

/// `merge`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux render room.pbrt --crop 0,0.5,0,1 --checkpoint left.hlxf      on one machine, and the right half on another
  hemilux render room.pbrt --passes 16..32 --checkpoint second.hlxf     other samples of the same picture
  hemilux merge left.hlxf right.hlxf -o room.exr -o room.png
  hemilux merge seed-*.hlxf -o all.hlxf                                 a film again, to be merged further")]
pub struct MergeArgs {
    /// Films
    #[arg(required = true, value_name = "FILM")]
    pub films: Vec<PathBuf>,
    /// Picture (.exr, .hdr, .png, .pfm) or film (.hlxf) to write; may be repeated
    #[arg(short, long = "output", visible_alias = "outfile", value_name = "FILE", required = true)]
    pub outputs: Vec<PathBuf>,
    /// Looks of PNG files.
    #[command(flatten)]
    pub screen: ScreenArgs,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `zones`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux zones room.pbrt -o room.hlxz           for `hemilux render --zones room.hlxz`
  hemilux zones room.pbrt -o room.ply            a coloured mesh to look at
  hemilux zones room.pbrt -o room.hlxz --particles 50M --zone-budget 200k")]
pub struct ZonesArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What the user knows of it.
    #[command(flatten)]
    pub hints: HintArgs,
    /// File to write: .hlxz (for `render --zones`) or .ply (coloured mesh); may be repeated
    #[arg(short, long = "output", visible_alias = "outfile", value_name = "FILE", required = true)]
    pub outputs: Vec<PathBuf>,
    /// How the solution is made.
    #[command(flatten)]
    pub solution: SolutionArgs,
    /// Time from the start of the program to the written file
    #[arg(long, value_name = "TIME", value_parser = values::duration)]
    pub time: Option<Duration>,
    /// Seed of the particles
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: one per core]
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// How to show progress
    #[arg(long, value_enum, default_value = "auto", value_name = "FORM", help_heading = "Messages")]
    pub progress: ProgressForm,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `validate`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux validate -o validation             every case, to validation/index.html and validation/validation.md
  hemilux validate -o v --only 8.4 --only 8.5

Exit code 5 if a case fails or is not computed.")]
pub struct ValidateArgs {
    /// Directory for the page; it is made if need be
    #[arg(short, long = "output", value_name = "DIR", required = true)]
    pub output: PathBuf,
    /// Only sections whose name contains this; may be repeated
    #[arg(long, value_name = "WORD")]
    pub only: Vec<String>,
    /// A deliberate mistake: cosine, mirrors, fresnel (only in builds for testing the tests)
    #[cfg(feature = "wrong-physics")]
    #[arg(long, value_name = "MISTAKE", value_parser = named(&hemilux::wrong::Wrong::ALL))]
    pub wrong: Option<hemilux::wrong::Wrong>,
    /// Threads [default: one per core]
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `info`.
#[derive(Args, Debug)]
#[command(after_help = "Examples:\n  hemilux info scene.pbrt\n  hemilux info --json picture.exr")]
pub struct InfoArgs {
    /// Scenes (.pbrt, .pbrt.gz; several make one scene) or pictures
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// $KEY in the scene stands for VALUE
    #[arg(short = 'D', long = "define", value_name = "KEY=VALUE", value_parser = values::define)]
    pub defines: Vec<(String, String)>,
    /// Skip what is not understood, with a warning
    #[arg(long)]
    pub lenient: bool,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// What to do with pictures.
#[derive(Subcommand, Debug)]
pub enum ImageVerb {
    /// Say how far a picture is from a reference
    Diff(DiffArgs),
    /// Make a PNG to look at
    Tonemap(TonemapArgs),
    /// Make a PNG that shows one quantity as colours, with a legend
    Falsecolor(FalsecolorArgs),
    /// Say what a picture holds
    Info(ImageInfoArgs),
}

/// `check`.
#[derive(Args, Debug)]
pub struct CheckArgs {
    /// Scene files; several make one scene
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// $KEY in the scene stands for VALUE
    #[arg(short = 'D', long = "define", value_name = "KEY=VALUE", value_parser = values::define)]
    pub defines: Vec<(String, String)>,
    /// Anything found is an error (exit code 5)
    #[arg(long)]
    pub strict: bool,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `image diff`.
#[derive(Args, Debug)]
#[command(after_help = "\
Beside a reference called reference.exr, its halves reference_a.exr and reference_b.exr and its mask valid.png are used
when they exist. A reference larger than the picture by whole factors is box-filtered first.

Examples:
  hemilux image diff room.exr reference.exr
  hemilux image diff a.png b.png --metric flip --tolerance 0.02 -o flip.png")]
pub struct DiffArgs {
    /// The picture (- is standard input)
    pub image: PathBuf,
    /// What it is compared with
    pub reference: PathBuf,
    /// Only pixels where this picture is white count
    #[arg(long, value_name = "FILE")]
    pub mask: Option<PathBuf>,
    /// Two independent halves of the reference, so that its own noise does not count
    #[arg(long, value_name = "A,B", value_delimiter = ',')]
    pub halves: Option<Vec<PathBuf>>,
    /// Do not look for halves and mask beside the reference
    #[arg(long)]
    pub no_companions: bool,
    /// The figure that --tolerance is about
    #[arg(long, value_enum, default_value = "relmse")]
    pub metric: Metric,
    /// Exit with 5 when the metric is above this (psnr: below)
    #[arg(long, value_name = "X", allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// Picture of the difference: .png is FLIP in false colours, .exr, .hdr and .pfm are picture minus reference
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// Figures of difference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Metric {
    /// Relative mean squared error, free of the reference's noise where halves are known.
    Relmse,
    /// The same without the worst thousandth of the pixels.
    Trimmed,
    /// Relative mean squared error against the reference itself.
    Plain,
    /// Mean squared error.
    Mse,
    /// Its root.
    Rmse,
    /// Mean absolute error.
    Mae,
    /// Symmetric mean absolute percentage error, 0 to 1.
    Smape,
    /// Peak signal-to-noise ratio, dB.
    Psnr,
    /// FLIP, 0 to 1.
    Flip,
}

/// `image tonemap`.
#[derive(Args, Debug)]
#[command(after_help = "Example:\n  hemilux image tonemap room.exr -o room.png --exposure 1.5 --curve aces")]
pub struct TonemapArgs {
    /// The picture (- is standard input)
    pub image: PathBuf,
    /// PNG to write
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Looks.
    #[command(flatten)]
    pub screen: ScreenArgs,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `image falsecolor`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux image falsecolor room.exr -o lux.png --factor 179 --unit cd/m2 --log
  hemilux image falsecolor room.exr -o error.png --channel stderr.G --palette spectral")]
pub struct FalsecolorArgs {
    /// The picture (- is standard input)
    pub image: PathBuf,
    /// PNG to write
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Channel to show [default: luminance]
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Value at the upper end [default: the 99.5th percentile, rounded up]
    #[arg(long, value_name = "X", value_parser = values::positive)]
    pub max: Option<f32>,
    /// Logarithmic scale
    #[arg(long)]
    pub log: bool,
    /// Powers of ten of the logarithmic scale
    #[arg(long, value_name = "N", default_value = "3", value_parser = values::positive)]
    pub decades: f32,
    /// Unit, for the legend
    #[arg(long, visible_alias = "units", value_name = "TEXT", default_value = "")]
    pub unit: String,
    /// Factor on the values
    #[arg(long, value_name = "X", default_value = "1", value_parser = values::positive)]
    pub factor: f32,
    /// Colours
    #[arg(long, value_enum, default_value = "perceptual")]
    pub palette: PaletteName,
    /// No legend
    #[arg(long)]
    pub no_legend: bool,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// Palettes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PaletteName {
    /// Dark blue to yellow, even to the eye.
    Perceptual,
    /// The rainbow.
    Spectral,
}

/// `image info`.
#[derive(Args, Debug)]
pub struct ImageInfoArgs {
    /// Pictures (- is standard input)
    #[arg(required = true, value_name = "IMAGE")]
    pub images: Vec<PathBuf>,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// `hemilux sense`.
#[derive(Args, Clone, Debug)]
pub struct SenseArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What the user knows of it.
    #[command(flatten)]
    pub hints: HintArgs,
    /// Also print the 95 % half-width behind each value
    #[arg(long)]
    pub ci: bool,
    /// What is measured
    #[arg(long, value_enum, default_value = "lux", value_name = "NAME")]
    pub quantity: QuantityName,
    /// Form of the answers
    #[arg(long, value_enum, default_value = "plain", value_name = "FORM")]
    pub format: FormName,
    /// Sensors on a rectangle instead of standard input, at the centres of its cells, facing u × v
    #[arg(long, value_name = "ox,oy,oz,ux,uy,uz,vx,vy,vz,columns,rows", allow_hyphen_values = true)]
    pub grid: Option<values::Grid>,
    /// Stop at this 95 % half-width relative to the value
    #[arg(long, value_name = "ERROR", default_value = "1%")]
    pub target_error: values::Share,
    /// Spend this long on each sensor instead
    #[arg(long, value_name = "TIME", value_parser = values::duration, conflicts_with = "spp")]
    pub time: Option<Duration>,
    /// Take this many gathers (of 64 rays) per sensor instead
    #[arg(long, value_name = "N", value_parser = values::count)]
    pub spp: Option<u64>,
    /// Most time for one sensor
    #[arg(long, value_name = "TIME", default_value = "30s", value_parser = values::duration)]
    pub limit: Duration,
    /// JSON file to write: every reading with its surprise, rays and time
    #[arg(long, value_name = "FILE")]
    pub report: Option<PathBuf>,
    /// Where gather rays end: on zones with residuals (unbiased), continued as paths (unbiased), or on zones (biased by them)
    #[arg(long, value_enum, default_value = "corrected", value_name = "NAME")]
    pub mode: SenseMode,
    /// How the zonal solutions are made; in modes path and corrected what leads gathers, smaller by default.
    #[command(flatten)]
    pub solution: SolutionArgs,
    /// Seed of all randomness
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Threads [default: one per core]
    #[arg(short, long, visible_alias = "nthreads", value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// How to talk.
    #[command(flatten)]
    pub talk: Talk,
}

/// What a sensor measures.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuantityName {
    /// Illuminance.
    Lux,
    /// Irradiance.
    Irradiance,
    /// Radiance from the direction of the "normal".
    Radiance,
    /// Luminance from there.
    Luminance,
}

impl QuantityName {
    /// As typed.
    pub fn name(self) -> &'static str {
        match self {
            QuantityName::Lux => "lux",
            QuantityName::Irradiance => "irradiance",
            QuantityName::Radiance => "radiance",
            QuantityName::Luminance => "luminance",
        }
    }
}

/// Form of sensor answers.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormName {
    /// One number a line (two with --ci).
    Plain,
    /// Three radiometric values, as rtrace prints them.
    Rtrace,
    /// Comma-separated, with a header.
    Csv,
    /// An array of records.
    Json,
}

/// Where gather rays of sensors end.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum SenseMode {
    /// Continued as paths: unbiased.
    Path,
    /// On zones, with residuals that take their bias away: unbiased.
    Corrected,
    /// On zones, an independent solution per group: biased by the size of zones.
    Zonal,
}

impl SenseMode {
    /// As typed.
    pub fn name(self) -> &'static str {
        match self {
            SenseMode::Path => "path",
            SenseMode::Corrected => "corrected",
            SenseMode::Zonal => "zonal",
        }
    }
}
