//! Broad irradiance: what a zone receives, known to a tenth by taking in as much of its surroundings as that needs.
//!
//! Zones are small, so that gather rays see detail, and each is noisy. Here every zone side is averaged with those around it that face the
//! same way and lie at about the same height over a plane of that facing, in boxes that double until the standard error of the
//! mean (from the spread of deposits) is a tenth of it. Made for pixels that span an edge or a texture
//! ([`crate::render`]): what they subtract and add again may be anything, so this steers and never biases.
//!
//! Invariant: a function of the solution alone.

use super::{ZonePlace, Zones};
use crate::world::World;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use std::collections::HashMap;

/// Relative standard error that is good enough.
const ENOUGH: f32 = 0.1;
/// A wider box that is more standard errors away from a narrower one is another place.
const SURELY: f32 = 2.0;
/// Boxes grow to this many times the zones' width at most (a power of two).
const WIDEST: u32 = 8;
/// Boxes are this many times flatter than wide.
const FLAT: f32 = 4.0;

/// Broad irradiance by zone × 2 + side (W·m⁻²).
#[derive(Clone, Debug, Default)]
pub struct Broad {
    irradiance: Vec<Rgb>,
}

/// What a box has gathered.
#[derive(Clone, Copy, Default)]
struct Sum {
    /// Flux (W).
    flux: Rgb,
    /// Area (m²).
    area: f32,
    /// Variance of the luminance of the flux.
    variance: f32,
}

impl Sum {
    fn add(&mut self, other: &Sum) {
        self.flux += other.flux;
        self.area += other.area;
        self.variance += other.variance;
    }

    /// Luminance of the irradiance, and its standard error.
    fn luminance(&self) -> (f32, f32) {
        let per_area = if self.area > 0.0 { 1.0 / self.area } else { 0.0 };
        (self.flux.luminance() * per_area, self.variance.sqrt() * per_area)
    }

    fn irradiance(&self) -> Rgb {
        if self.area > 0.0 { self.flux * (1.0 / self.area) } else { Rgb::BLACK }
    }
}

/// A box: the main axis that its members face (0 to 5), and where it lies in units of its own size.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
struct Place {
    facing: u8,
    at: [i32; 3],
}

impl Place {
    fn of(p: Vec3, n: Vec3, width: f32) -> Place {
        let size = n.abs();
        let axis = if size.x >= size.y.max(size.z) { 0 } else { 1 + (size.z > size.y) as usize };
        let facing = 2 * axis as u8 + (n[axis] < 0.0) as u8;
        let mut cells = p / width;
        cells[axis] *= FLAT;
        Place { facing, at: [0, 1, 2].map(|i| cells[i].floor() as i32) }
    }

    /// The box of twice the size that holds this one.
    fn wider(self) -> Place {
        Place { at: self.at.map(|c| c >> 1), ..self }
    }
}

impl Broad {
    /// Given values (W·m⁻²), by zone × 2 + side.
    pub fn given(irradiance: Vec<Rgb>) -> Broad {
        Broad { irradiance }
    }

    pub(super) fn new(zones: &Zones, world: &World) -> Broad {
        let (areas, width) = (zones.map.areas(), zones.map.target().max(f32::MIN_POSITIVE));
        let mut middle = vec![(Vec3::ZERO, Vec3::ZERO, 0f32); areas.len()];
        zones.map.for_each_cell(world, |corners, zone| {
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let (p, n, weight) = &mut middle[zone as usize];
            let mean = corners.iter().copied().sum::<Vec3>() / corners.len() as f32;
            let area = normal.length();
            (*p, *n, *weight) = (*p + mean * area, *n + normal, *weight + area);
        });
        let mut sides = vec![0u32; areas.len() * 2];
        let mut boxes: Vec<(Place, Sum)> = Vec::new();
        let mut known = HashMap::new();
        for (zone, (p, n, weight)) in middle.into_iter().enumerate() {
            let p = p / weight.max(f32::MIN_POSITIVE);
            for (side, n) in [n, -n].into_iter().enumerate() {
                let k = zone * 2 + side;
                let area = areas[zone];
                let error = zones.error[k] * area;
                let sum = Sum { flux: zones.total[k] * area, area, variance: error * error };
                sides[k] = put(&mut boxes, &mut known, Place::of(p, n, width), &sum);
            }
        }
        let mut levels = vec![boxes];
        let mut parents = Vec::new();
        for _ in 0..WIDEST {
            let (mut boxes, mut known) = (Vec::new(), HashMap::new());
            let below = &levels[levels.len() - 1];
            let up: Vec<u32> =
                below.iter().map(|(place, sum)| put(&mut boxes, &mut known, place.wider(), sum)).collect();
            parents.push(up);
            levels.push(boxes);
        }
        let irradiance = sides.into_iter().map(|start| {
            let mut at = start as usize;
            let mut best = &levels[0][at].1;
            // What all boxes so far leave possible.
            let (mut low, mut high) = (f32::NEG_INFINITY, f32::INFINITY);
            for (level, up) in levels[1..].iter().zip(&parents) {
                let (mean, error) = best.luminance();
                (low, high) = (low.max(mean - SURELY * error), high.min(mean + SURELY * error));
                if error <= ENOUGH * mean {
                    break;
                }
                at = up[at] as usize;
                let wider = &level[at].1;
                let mean = wider.luminance().0;
                if mean < low || mean > high {
                    break;
                }
                best = wider;
            }
            best.irradiance()
        });
        Broad { irradiance: irradiance.collect() }
    }

    /// Irradiance around `place`, on its side (W·m⁻²).
    #[inline]
    pub fn irradiance(&self, place: &ZonePlace) -> Rgb {
        self.irradiance[(place.zone * 2 + place.side) as usize]
    }
}

/// Add to the box at `place`; returns its index.
fn put(boxes: &mut Vec<(Place, Sum)>, known: &mut HashMap<Place, u32>, place: Place, sum: &Sum) -> u32 {
    let at = *known.entry(place).or_insert_with(|| {
        boxes.push((place, Sum::default()));
        boxes.len() as u32 - 1
    });
    boxes[at as usize].1.add(sum);
    at
}
