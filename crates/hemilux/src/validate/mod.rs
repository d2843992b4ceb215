//! Validation: closed forms, case by case, each with the value that this program computes, its interval and a verdict.
//!
//! Every line of the list of closed forms is a row; one that is not computed is a row too, and a red one. Statistical cases
//! are judged by |z| < 4.4 against the standard error that the program states (a right program fails one row in 20,000;
//! seeds are fixed), and must be sharp enough to reject a plausible wrong answer. Exact ones are held to a
//! stated tolerance. The cases are library code, so that `hemilux validate` and tests run the very same.

mod artificial;
mod curved;
mod daylight;
mod estimators;
mod furnace;
mod luminaires;
mod machinery;
mod mirrors;
pub mod oracle;
mod refraction;
pub mod scenes;
mod zonal;

use crate::sense::{Goal, Receiver, Sense, SenseOptions};
use crate::world::World;
use crate::zones::{ZoneOptions, Zones};
use hemilux_scene::geom::Vec3;
use hemilux_scene::{LoadOptions, load_radiance_str};
use std::path::Path;
use std::time::{Duration, Instant};

/// Student's 97.5 % quantile with 15 degrees of freedom: what `sense` multiplies a standard error by.
const STUDENT_15: f64 = 2.131449546;
/// The same with 60: of the pooled estimates here.
const STUDENT_60: f64 = 2.000297804;
/// Readings pooled in one estimate.
const READINGS: u64 = 4;
/// Standard errors that an estimate may be away.
pub const LIMIT: f64 = 4.4;
/// Scenes are kept in single precision: a standard error cannot say less, relative to the value.
const ROUNDING: f64 = 5e-6;

/// Whether a row is as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// It is.
    Pass,
    /// It is not, and why.
    Fail(String),
    /// Nobody computes it.
    Missing(String),
}

/// One case.
#[derive(Clone, Debug)]
pub struct Row {
    /// Part of the list.
    pub section: &'static str,
    /// What is computed.
    pub case: String,
    /// What it must be.
    pub reference: f64,
    /// What it is.
    pub value: f64,
    /// 95 % half-width; for exact cases the tolerance.
    pub half_width: f64,
    /// Standard errors between value and reference; `None` for exact cases.
    pub z: Option<f64>,
    /// What it took.
    pub time: Duration,
    /// The verdict.
    pub verdict: Verdict,
}

/// A mean and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
}

impl Estimate {
    fn z(self, truth: f64) -> f64 {
        (self.mean - truth) / self.error.max(ROUNDING * truth.abs()).max(1e-30)
    }

    /// A row: agrees with the truth, and is sharp enough to reject `wrong`.
    fn check(self, page: &mut Page, case: &str, truth: f64, wrong: f64) {
        let (z, control) = (self.z(truth), self.z(wrong));
        // What is not a number passes neither.
        let (agrees, tells) = (z.abs() < LIMIT, control.abs() > LIMIT);
        let verdict = match (agrees, tells) {
            (true, true) => Verdict::Pass,
            (true, false) => Verdict::Fail(format!("too uncertain to tell the reference from {wrong:.6}")),
            (false, _) => Verdict::Fail(format!("{z:+.1} standard errors from the reference")),
        };
        page.push(case, truth, self.mean, STUDENT_60 * self.error, Some(z), verdict);
    }
}

/// Rows as they come.
pub struct Page<'a> {
    section: &'static str,
    since: Instant,
    rows: Vec<Row>,
    told: &'a mut dyn FnMut(&Row),
}

impl Page<'_> {
    fn push(
        &mut self,
        case: &str,
        reference: f64,
        value: f64,
        half_width: f64,
        z: Option<f64>,
        verdict: Verdict,
    ) {
        let time = self.since.elapsed();
        let row =
            Row { section: self.section, case: case.into(), reference, value, half_width, z, time, verdict };
        (self.told)(&row);
        self.rows.push(row);
        self.since = Instant::now();
    }

    /// A row without noise: within `tolerance` of the truth.
    fn exact(&mut self, case: &str, value: f64, truth: f64, tolerance: f64) {
        let verdict = match (value - truth).abs() <= tolerance {
            true => Verdict::Pass,
            false => Verdict::Fail(format!("off by {:.3e}", value - truth)),
        };
        self.push(case, truth, value, tolerance, None, verdict);
    }

    /// A row without noise: no more than `bound`.
    fn at_most(&mut self, case: &str, value: f64, bound: f64) {
        let verdict = match value <= bound {
            true => Verdict::Pass,
            false => Verdict::Fail(format!("above the bound by {:.3e}", value - bound)),
        };
        self.push(&format!("{case} (at most)"), bound, value, 0.0, None, verdict);
    }

    /// A row without noise: no less than `bound`.
    fn at_least(&mut self, case: &str, value: f64, bound: f64) {
        let verdict = match value >= bound {
            true => Verdict::Pass,
            false => Verdict::Fail(format!("below the bound by {:.3e}", bound - value)),
        };
        self.push(&format!("{case} (at least)"), bound, value, 0.0, None, verdict);
    }

    /// A row that nobody computes.
    fn missing(&mut self, case: &str, why: &str) {
        self.push(case, f64::NAN, f64::NAN, f64::NAN, None, Verdict::Missing(why.into()));
    }

    /// Something that must hold for the cases around it to mean anything; a row only where it does not.
    fn form(&mut self, holds: bool, what: &str) {
        if !holds {
            self.push(what, 1.0, 0.0, 0.0, None, Verdict::Fail("does not hold".into()));
        }
    }
}

/// Some cases of one section.
type Cases = fn(&mut Page);

/// All cases, by section.
const ALL: &[(&str, &[Cases])] = &[
    (
        "8.2 irradiance and form factors",
        &[
            luminaires::a_uniform_sky_gives_pi,
            luminaires::the_overcast_sky,
            luminaires::the_overcast_sky_of_gensky,
            luminaires::disks,
            luminaires::spheres_above_and_across_the_horizon,
            luminaires::polygons,
            luminaires::form_factors_of_points,
            luminaires::form_factors_of_rectangles,
            luminaires::a_luminaire_in_a_coordinate_plane_does_not_hide_itself,
        ],
    ),
    (
        "8.3 furnace and energy",
        &[
            furnace::white_furnace_of_every_material,
            furnace::white_furnace_in_every_mode,
            furnace::radiance_inside_glass,
            furnace::rough_metal_reflects_what_ward_says,
            furnace::an_emitting_sphere,
            furnace::a_lamp_at_the_centre_of_a_sphere,
            furnace::concentric_spheres,
            zonal::grey_enclosure_and_books,
        ],
    ),
    (
        "8.4 virtual luminaires, planar",
        &[
            mirrors::a_shrinking_lamp_and_its_image,
            mirrors::a_square_in_an_unbounded_mirror_and_in_a_window_of_it,
            mirrors::domes_on_one_to_three_mirrors,
            mirrors::two_facing_mirrors,
            mirrors::a_beam_turned_by_a_mirror,
            mirrors::a_fan_of_facets,
        ],
    ),
    (
        "8.5 virtual luminaires, curved reflectors",
        &[curved::mirror_ball, curved::bowl, curved::paraboloid, curved::ellipsoid],
    ),
    (
        "8.6 refraction",
        &[
            refraction::fresnel_values,
            refraction::panes,
            refraction::a_slab_brings_the_lamp_nearer,
            refraction::under_water,
            refraction::glass_ball,
        ],
    ),
    (
        "8.7 statistical machinery",
        &[
            machinery::slopes,
            machinery::detection,
            estimators::unbiased_methods,
            estimators::negative_controls,
            machinery::coverage,
            estimators::coverage_of_the_suite,
            machinery::corrected_is_path,
            machinery::determinism,
        ],
    ),
    (
        "8.8 cases modelled on CIE 171",
        &[
            artificial::case_5_2_a_point_source,
            artificial::case_5_3_area_sources,
            artificial::case_5_4_flux_is_kept,
            artificial::case_5_5_transmittance_of_a_slab,
            artificial::case_5_6_reflection_of_an_evenly_lit_board,
            artificial::case_5_7_with_an_obstruction,
            artificial::case_5_8_interreflection_in_a_cube,
            daylight::case_5_9_a_roof_opening_under_general_skies,
            daylight::case_5_10_a_glazed_roof_opening,
            daylight::case_5_11_a_facade_opening,
            daylight::case_5_12_a_glazed_facade_opening,
            daylight::cases_5_13_and_5_14_masks,
        ],
    ),
    ("8.9 the zonal solver alone", &[zonal::six_zones, zonal::refinement, zonal::leaks]),
];

/// Run the sections whose name contains one of `wanted` (all, if it is empty); `told` sees every row as it comes.
pub fn run(wanted: &[&str], told: &mut dyn FnMut(&Row)) -> Vec<Row> {
    let mut page = Page { section: "", since: Instant::now(), rows: Vec::new(), told };
    for (section, cases) in ALL {
        if wanted.is_empty() || wanted.iter().any(|w| section.contains(w)) {
            page.section = section;
            for case in *cases {
                page.since = Instant::now();
                case(&mut page);
            }
        }
    }
    page.rows
}

/// A scene in Radiance's words. The words are ours; if they were wrong, the scene would be empty and its rows red.
fn rad(text: &str) -> World {
    let loaded = load_radiance_str(text, None, Path::new("."), &LoadOptions::default());
    World::new(loaded.map_or_else(|_| scenes::empty(), |l| l.scene))
}

/// A parallelogram with normal `e1` × `e2`, in Radiance's words.
fn quad(modifier: &str, p: [f64; 3], e1: [f64; 3], e2: [f64; 3]) -> String {
    let at =
        |a: f64, b: f64| -> String { (0..3).map(|i| format!(" {}", p[i] + a * e1[i] + b * e2[i])).collect() };
    format!("{modifier} polygon q 0 0 12{}{}{}{}\n", at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0))
}

fn options(world: &World, receiver: Receiver, gathers: u64) -> SenseOptions {
    SenseOptions {
        receiver,
        goal: Goal::Gathers(gathers),
        limit: Duration::from_secs(3600),
        seed: 1,
        weights: world.scene.photometry.weights,
    }
}

fn pooled(sense: &Sense, p: [f64; 3], n: [f64; 3]) -> Estimate {
    let (p, n) = (p.map(|x| x as f32), Vec3::from(n.map(|x| x as f32)).normalize());
    let (mut mean, mut variance) = (0.0, 0.0);
    for index in 0..READINGS {
        let r = sense.read(index, Vec3::from(p), n);
        mean += r.scalar / READINGS as f64;
        variance += ((r.half_width - r.unseen) / STUDENT_15 / READINGS as f64).powi(2);
    }
    Estimate { mean, error: variance.sqrt() }
}

/// Irradiance at a point by `gathers` gathers continued as paths.
fn sensed(world: &World, p: [f64; 3], n: [f64; 3], gathers: u64) -> Estimate {
    let o = options(world, Receiver::Irradiance, gathers / READINGS);
    pooled(&Sense::new(world, &[], o), p, n)
}

/// A zonal solution by particles alone.
fn solved(world: &World, budget: u32, particles: u64, seed: u64) -> Zones {
    Zones::solve(world, &ZoneOptions { budget, particles, seed })
}

/// Irradiance at a point by `gathers` gathers over zones with residuals: unbiased, records of virtual luminaires included.
fn sensed_with_residuals(world: &World, p: [f64; 3], n: [f64; 3], gathers: u64, particles: u64) -> Estimate {
    let zones = [solved(world, 2000, particles, 1)];
    let o = options(world, Receiver::Irradiance, gathers / READINGS);
    pooled(&Sense::corrected(world, &zones, o), p, n)
}

/// Radiance that arrives from a direction.
fn radiance(world: &World, p: [f64; 3], d: [f64; 3], gathers: u64) -> Estimate {
    let o = options(world, Receiver::Radiance, gathers / READINGS);
    pooled(&Sense::new(world, &[], o), p, d)
}

/// Mean irradiance over a parallelogram, on the side of `e1` × `e2`, lifted by `lift` (m), less what is `known` at each
/// point: sixteen independent sets of sensors, jittered in `cells` × `cells` strata, each read once with sixteen gathers.
fn mean_over(
    world: &World,
    [p, e1, e2]: [[f64; 3]; 3],
    lift: f64,
    cells: u32,
    known: impl Fn([f64; 3]) -> f64,
) -> Estimate {
    const SETS: u64 = 16;
    let sense = Sense::new(world, &[], options(world, Receiver::Irradiance, 16));
    let n = oracle::unit(oracle::cross(e1, e2));
    let mut values = Vec::new();
    let mut index = 0;
    for _ in 0..SETS {
        let mut sum = 0.0;
        for cell in 0..cells * cells {
            index += 1;
            let a = ((cell % cells) as f64 + oracle::random(2 * index)) / cells as f64;
            let b = ((cell / cells) as f64 + oracle::random(2 * index + 1)) / cells as f64;
            let at = [0, 1, 2].map(|i| p[i] + a * e1[i] + b * e2[i] + lift * n[i]);
            let single = Vec3::from(at.map(|x| x as f32));
            sum += sense.read(index, single, Vec3::from(n.map(|x| x as f32))).scalar - known(at);
        }
        values.push(sum / (cells * cells) as f64);
    }
    let mean = values.iter().sum::<f64>() / SETS as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (SETS * (SETS - 1)) as f64;
    // Student's quantiles with 15 degrees of freedom are wider than the normal ones: made up for here.
    Estimate { mean, error: variance.sqrt() * 1.35 }
}

/// Nothing is known beforehand.
fn nothing(_: [f64; 3]) -> f64 {
    0.0
}

/// Sum over zone sides (0: facing the normal, 1: away from it) of irradiance times area (W, green).
fn flux(zones: &Zones, side: u32) -> f64 {
    let areas = zones.map().areas();
    let of = |z: u32| zones.irradiance(z, side)[1] as f64 * areas[z as usize] as f64;
    (0..zones.map().len() as u32).map(of).sum()
}

/// Something that zonal solutions say, by eight independent ones that share `particles`.
fn by_replicates(world: &World, budget: u32, particles: u64, of: impl Fn(&Zones) -> f64) -> Estimate {
    let values: Vec<f64> = (0..8).map(|seed| of(&solved(world, budget, particles / 8, seed))).collect();
    let mean = values.iter().sum::<f64>() / 8.0;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 56.0;
    // Student's quantiles with 7 degrees of freedom are wider than the normal ones: made up for here.
    Estimate { mean, error: variance.sqrt() * 1.7 }
}
