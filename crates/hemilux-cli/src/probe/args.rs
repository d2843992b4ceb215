//! What can be typed behind `hemilux probe`.

use crate::args::{SceneArgs, SolutionArgs};
use crate::hints::HintArgs;
use crate::talk::Talk;
use crate::values::{self, Size};
use clap::Args;
use hemilux::gather::Strategy;
use std::path::PathBuf;

/// `probe`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux probe room.pbrt --pixel 240,180                              JSON to standard output
  hemilux probe room.pbrt --point '0 0 0.75 0 0 1' -o probe.svg -o field.exr
  hemilux probe room.pbrt --pixel 240,180 --compare all -o probe.svg -o probe.json")]
pub struct ProbeArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// What the user knows of it.
    #[command(flatten)]
    pub hints: HintArgs,
    /// The point that this pixel's centre sees, behind mirrors and glass; 0,0 is the upper left
    #[arg(long, value_name = "x,y", required_unless_present = "point", conflicts_with = "point")]
    pub pixel: Option<values::Pixel>,
    /// A receiver: position and normal
    #[arg(long, value_name = "x y z nx ny nz", allow_hyphen_values = true)]
    pub point: Option<values::Point>,
    /// File to write (.json, .svg, .exr of the field radiance); may be repeated; none: JSON to standard output
    #[arg(short, long = "output", visible_alias = "outfile", value_name = "FILE")]
    pub outputs: Vec<PathBuf>,
    /// The strategy that is shown (see `hemilux render --help`)
    #[arg(long, value_name = "NAME", default_value = "two-stage", value_parser = values::strategy)]
    pub strategy: Strategy,
    /// Its gather rays
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(4..=1_048_576))]
    pub rays: u32,
    /// Strategies to compare with a long run: names with commas between, or all
    #[arg(long, value_name = "NAMES|all")]
    pub compare: Option<String>,
    /// Runs of each compared strategy at each number of rays
    #[arg(long, value_name = "N", default_value_t = 32, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    pub runs: u32,
    /// Gathers (of 64 rays) of the long run
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(16..=100_000_000))]
    pub gathers: u32,
    /// Values of the field radiance across the unit square
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(8..=4096))]
    pub resolution: u32,
    /// Picture size instead of the scene's, for --pixel
    #[arg(long, value_name = "WxH")]
    pub size: Option<Size>,
    /// Camera from this file instead of the scene's
    #[arg(long, value_name = "FILE")]
    pub view: Option<PathBuf>,
    /// How the zonal solution is made.
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
