//! Bright zones as sources: what is lit so strongly that gathers look for it, and for its images, as they do for luminaires.
//!
//! A zone is bright if its irradiance is many times the scene's mean. Bright zones that lie in one plane, side by side and of
//! like irradiance, are one source: their images are too, and a hundred of them would be asked for one by one.
//!
//! Invariant: every bright zone side belongs to exactly one source.

use super::map::ZoneMap;
use crate::world::World;
use crate::world::outline::Outline;
use hemilux_scene::geom::Vec3;
use std::collections::{HashMap, HashSet};

/// A zone is bright if its irradiance is this many times the mean over the scene's lit surfaces.
const OUTSHINES: f64 = 10.0;
/// A source is no wider than this many zones, ...
const WIDEST: f32 = 4.0;
/// ... its zones' irradiances differ by no more than this factor, ...
const ALIKE: f64 = 3.0;
/// ... and they fill at least this much of its outline.
const FILLED: f32 = 0.6;

/// One source.
#[derive(Clone, Copy, Debug)]
pub(super) struct BrightSource {
    /// A zone side of it; no other source has it.
    pub name: u32,
    /// Centre and radius of a ball around it (m).
    pub centre: Vec3,
    pub radius: f32,
    /// Its outline, if it is flat.
    pub outline: Option<Outline>,
    /// Irradiance over π, as an even outline or zone would have it (luminance, W·sr⁻¹·m⁻²).
    pub radiance: f32,
}

/// All sources.
#[derive(Debug, Default)]
pub(super) struct Bright {
    known: bool,
    /// Source of each bright zone side.
    of: HashMap<u32, u32>,
    sources: Vec<BrightSource>,
    /// Of the scene's lit surfaces (luminance, W/m²).
    mean: f32,
}

/// A bright zone side.
struct Zone {
    side: u32,
    irradiance: f64,
    area: f32,
    centre: Vec3,
    triangles: Vec<[Vec3; 3]>,
}

impl Bright {
    /// The sources among zone sides of `irradiances` (W/m²).
    pub fn new(world: &World, map: &ZoneMap, irradiances: &[f64]) -> Bright {
        let area = |side: usize| map.areas()[side / 2] as f64;
        let lit = irradiances.iter().enumerate().filter(|(_, e)| **e > 0.0);
        let (flux, lit_area) = lit.fold((0.0, 0.0), |s, (i, e)| (s.0 + e * area(i), s.1 + area(i)));
        let mean = if lit_area > 0.0 { flux / lit_area } else { f64::INFINITY };
        let threshold = OUTSHINES * mean;
        let is_bright = |side: u32| irradiances[side as usize] > threshold;
        let mut bright = Bright { known: true, mean: mean as f32, ..Bright::default() };
        if !(0..irradiances.len() as u32).any(is_bright) {
            return bright;
        }
        let mut pieces: HashMap<u32, Vec<[Vec3; 3]>> = HashMap::new();
        // Cells of quadrics are curved even where their corners lie in one plane.
        let mut curved: HashSet<u32> = HashSet::new();
        map.for_each_cell(world, |corners, zone| {
            if is_bright(2 * zone) || is_bright(2 * zone + 1) {
                let fan = (2..corners.len()).map(|i| [corners[0], corners[i - 1], corners[i]]);
                pieces.entry(zone).or_default().extend(fan);
                if corners.len() > 3 {
                    curved.insert(zone);
                }
            }
        });
        // Flat ones by side and plane; the others stay alone.
        let mut planes: HashMap<(u32, [i32; 4]), Vec<Zone>> = HashMap::new();
        for side in (0..irradiances.len() as u32).filter(|side| is_bright(*side)) {
            let triangles = pieces.get(&(side / 2)).cloned().unwrap_or_default();
            let (e, area) = (irradiances[side as usize], map.areas()[side as usize / 2]);
            let count = 3.0 * triangles.len().max(1) as f32;
            let centre = triangles.iter().flatten().sum::<Vec3>() / count;
            let zone = Zone { side, irradiance: e, area, centre, triangles };
            match Outline::around(&zone.triangles).filter(|_| !curved.contains(&(side / 2))) {
                Some(outline) => {
                    planes.entry(plane(&outline, side & 1, map.target())).or_default().push(zone)
                }
                None => bright.push(map, vec![zone], None),
            }
        }
        let mut planes: Vec<_> = planes.into_iter().collect();
        planes.sort_by_key(|p| p.0);
        planes.into_iter().for_each(|(_, zones)| bright.split(map, zones));
        bright
    }

    /// Make sources of zones in one plane, halving them until they are alike.
    fn split(&mut self, map: &ZoneMap, mut zones: Vec<Zone>) {
        let triangles: Vec<[Vec3; 3]> = zones.iter().flat_map(|z| z.triangles.iter().copied()).collect();
        let outline = Outline::around(&triangles);
        let (least, most) =
            zones.iter().fold((f64::MAX, 0f64), |r, z| (r.0.min(z.irradiance), r.1.max(z.irradiance)));
        let area: f32 = zones.iter().map(|z| z.area).sum();
        let whole = outline.is_some_and(|o| {
            o.sides.iter().all(|s| s.length() <= WIDEST * map.target()) && area >= FILLED * o.area()
        });
        if zones.len() == 1 || whole && most <= ALIKE * least {
            return self.push(map, zones, outline);
        }
        let low = zones.iter().fold(Vec3::INFINITY, |m, z| m.min(z.centre));
        let high = zones.iter().fold(Vec3::NEG_INFINITY, |m, z| m.max(z.centre));
        let extent = (high - low).to_array();
        let axis = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
        let middle = 0.5 * (low + high)[axis];
        zones.sort_by_key(|z| (z.centre[axis] >= middle, z.side));
        let at = zones.partition_point(|z| z.centre[axis] < middle);
        // All in one place: by number.
        let at = if at == 0 || at == zones.len() { zones.len() / 2 } else { at };
        let rest = zones.split_off(at);
        self.split(map, zones);
        self.split(map, rest);
    }

    fn push(&mut self, map: &ZoneMap, zones: Vec<Zone>, outline: Option<Outline>) {
        let number = self.sources.len() as u32;
        let flux: f64 = zones.iter().map(|z| z.irradiance * z.area as f64).sum();
        let area: f32 = zones.iter().map(|z| z.area).sum();
        let (centre, radius) = match outline {
            Some(outline) => outline.ball(),
            None => (zones[0].centre, map.radii()[zones[0].side as usize / 2]),
        };
        let over = outline.map_or(area, |o| o.area()).max(f32::MIN_POSITIVE);
        let radiance = (flux / over as f64 / std::f64::consts::PI) as f32;
        let name = zones.iter().map(|z| z.side).min().unwrap_or(0);
        self.of.extend(zones.iter().map(|z| (z.side, number)));
        self.sources.push(BrightSource { name, centre, radius, outline, radiance });
    }

    /// Whether it has been decided what is bright.
    pub fn is_known(&self) -> bool {
        self.known
    }

    /// All of them.
    pub fn sources(&self) -> &[BrightSource] {
        &self.sources
    }

    /// Whether a side of a zone is bright.
    #[inline]
    pub fn has(&self, zone: u32) -> bool {
        !self.of.is_empty() && (self.of.contains_key(&(2 * zone)) || self.of.contains_key(&(2 * zone + 1)))
    }

    /// The zones of which a side is bright, in order.
    pub fn zones(&self) -> Vec<u32> {
        let mut zones: Vec<u32> = self.of.keys().map(|side| side / 2).collect();
        zones.sort_unstable();
        zones.dedup();
        zones
    }

    /// Mean irradiance of the scene's lit surfaces (luminance, W/m²).
    pub fn mean(&self) -> f32 {
        self.mean
    }

    /// The source that a zone side is part of, if it is bright.
    #[inline]
    pub fn of(&self, side: u32) -> Option<&BrightSource> {
        self.of.get(&side).map(|n| &self.sources[*n as usize])
    }
}

/// A name for the plane of `outline` and the side of it: normal in 64ths, and distance from the origin in quarters of `width`.
fn plane(outline: &Outline, side: u32, width: f32) -> (u32, [i32; 4]) {
    let n = outline.sides[0].cross(outline.sides[1]).normalize_or_zero();
    // Either way round is the same plane.
    let flip = if n.x + 1e-3 * n.y + 1e-6 * n.z < 0.0 { -1.0 } else { 1.0 };
    let [x, y, z] = (n * (64.0 * flip)).to_array().map(|v| v.round() as i32);
    let side = if flip < 0.0 { 1 - side } else { side };
    (side, [x, y, z, (flip * n.dot(outline.corner) * 4.0 / width).round() as i32])
}
