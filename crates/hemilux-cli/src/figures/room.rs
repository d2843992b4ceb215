//! Figure 1: "Left: rendered image. Right: low resolution radiosity image".

use crate::failure::{Failure, Kind};
use crate::talk::Talk;
use hemilux::film::Film;
use hemilux::gather::{GatherPlan, Strategy};
use hemilux::picture;
use hemilux::render::{Mode, RenderOptions, Renderer, Stop};
use hemilux::world::World;
use hemilux::zones::{ZoneOptions, Zones};
use hemilux_image::tone::{Exposure, Rgb8, ToneMap};
use hemilux_image::{Image, ImageError, atomic, png};
use hemilux_scene::{LoadOptions, load_pbrt_str};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// The scene of the figure, so that the command needs no file.
const SCENE: &str = include_str!("../../../../scenes/figure-1.pbrt");
/// Zones of the right half: few, so that one sees them.
const ZONES: u32 = 6000;
/// Pixels between the halves.
const GAP: usize = 8;

/// Render both halves with one exposure.
pub fn write(path: &Path, spp: u32, seed: u64, talk: &Talk) -> Result<(), Failure> {
    let loaded = load_pbrt_str(SCENE, Path::new(""), &LoadOptions::default()).map_err(|e| {
        talk.diagnostics(&e.diagnostics, &e.sources);
        Failure::silent(Kind::Internal)
    })?;
    let world = World::new(loaded.scene);
    let zones = Zones::solve(&world, &ZoneOptions { budget: ZONES, seed, ..ZoneOptions::default() });
    let left = render(&world, &zones, Mode::Zonal, spp, seed);
    let right = render(&world, &zones, Mode::Zones, 4, seed);
    let tone = Exposure::Percentile { percent: 95.0, target: 0.8 };
    let stops = tone.factor(&left)?.log2();
    let map = ToneMap { exposure: Exposure::Stops(stops), ..ToneMap::default() };
    let pair = beside(&map.apply(&left)?, &map.apply(&right)?);
    atomic::write(path, |out| png::encode_rgb8(&pair, &[], out))
        .map_err(|e: ImageError| Failure::io(format!("{}: {e}", path.display())))
}

fn render(world: &World, zones: &Zones, mode: Mode, spp: u32, seed: u64) -> Image {
    let (w, h) = (world.scene.film.width, world.scene.film.height);
    let plan = GatherPlan { rays: 16, shadow_rays: 4, strategy: Strategy::default() };
    let options = RenderOptions { mode, plan, seed, max_depth: u32::MAX };
    let mut film = Film::new(w, h, [0, w, 0, h]);
    let renderer = Renderer::new(world, Some(zones), w, h, options);
    let _ = renderer.run(&mut film, Stop { passes: spp, deadline: None }, &AtomicBool::new(false), |_| ());
    picture::image(&film, &[])
}

fn beside(left: &Rgb8, right: &Rgb8) -> Rgb8 {
    let height = left.height.min(right.height);
    let width = left.width + GAP + right.width;
    let mut data = Vec::with_capacity(3 * width * height);
    for y in 0..height {
        let row = |p: &Rgb8| p.data[3 * p.width * y..3 * p.width * (y + 1)].to_vec();
        data.extend(row(left));
        data.extend(std::iter::repeat_n(255, 3 * GAP));
        data.extend(row(right));
    }
    Rgb8 { width, height, data }
}
