//! What can be typed behind `hemilux figures`.

use crate::talk::Talk;
use clap::Args;
use std::path::PathBuf;

/// `figures`.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  hemilux figures -o figures                 all figures; the rendered one takes most of the time
  hemilux figures -o figures --no-render     the drawings only, a few seconds")]
pub struct FiguresArgs {
    /// Directory to write to; made if it is not there
    #[arg(short = 'o', long = "output", value_name = "DIR")]
    pub directory: PathBuf,
    /// Leave out figure 1, which is rendered
    #[arg(long)]
    pub no_render: bool,
    /// Samples per pixel of figure 1
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: u32,
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
