//! One image at a time: picking a single virtual luminaire that is listed around a point, at a cost that does not grow with how
//! many are.
//!
//! A pick names a signature. A ray sent into its cone counts for it only if its specular chain has that signature, so the
//! density of the technique at a direction needs the cones of one signature alone, found by name: no sum over all that are
//! listed. Whether an image is seen from the very point is asked before a ray is spent.
//!
//! Invariant: [`Around::density`] of a name at a direction is the density over which [`Around::pick`] gives that direction for that
//! name.

use super::direction_in_cone;
use super::view::height_of;
use super::{Candidate, NONE, Records, Turns};
use crate::images::LONGEST;
use hemilux_scene::geom::Vec3;
use std::f32::consts::TAU;
use std::sync::OnceLock;

/// Share of the picks without regard to flux.
const EVENLY: f32 = 0.2;

/// What images are picked by: per leaf those of luminaires, in the order of their signatures. A leaf's are made when they are first
/// asked for (mode zonal never does), each leaf by itself, so that no thread waits for more than one leaf, nor for others' work.
#[derive(Default)]
pub(super) struct Picks(Vec<OnceLock<Box<[Image]>>>);

#[derive(Clone, Copy)]
struct Image {
    signature: u32,
    candidate: u32,
    /// Share of the leaf's picks, and with those before it.
    share: f32,
    cumulative: f32,
}

impl Picks {
    /// For so many leaves, none made yet.
    pub fn new(leaves: usize) -> Picks {
        Picks((0..leaves).map(|_| OnceLock::new()).collect())
    }

    pub fn memory_bytes(&self) -> usize {
        let made: usize = self.0.iter().filter_map(OnceLock::get).map(|images| images.len()).sum();
        made * size_of::<Image>() + self.0.len() * size_of::<OnceLock<Box<[Image]>>>()
    }
}

/// The images of a leaf.
fn images_of(records: &Records, leaf: usize) -> Box<[Image]> {
    let here = records.in_cell(leaf).iter().zip(records.first[leaf]..);
    let of_luminaire = |c: &Candidate| {
        let signature = &records.signatures[c.signature as usize];
        signature.kind == 0 && signature.turns.count().is_some_and(|n| n as usize <= LONGEST)
    };
    let image = |(c, candidate): (&Candidate, u32)| Image {
        signature: c.signature,
        candidate,
        share: c.share,
        cumulative: 0.0,
    };
    let mut images: Box<[Image]> = here.filter(|(c, _)| of_luminaire(c)).map(image).collect();
    images.sort_by_key(|i| (i.signature, i.candidate));
    let flux: f32 = images.iter().map(|i| i.share).sum::<f32>().max(f32::MIN_POSITIVE);
    let even = EVENLY / images.len().max(1) as f32;
    let mut sum = 0.0;
    for image in images.iter_mut() {
        image.share = (1.0 - EVENLY) * image.share / flux + even;
        sum += image.share;
        image.cumulative = sum;
    }
    for image in images.iter_mut() {
        image.share /= sum;
        image.cumulative /= sum;
    }
    images
}

/// The images listed around a point.
#[derive(Clone, Copy)]
pub(crate) struct Around<'a> {
    records: &'a Records,
    images: &'a [Image],
    x: Vec3,
    n: Vec3,
}

/// A direction for one of them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Picked {
    /// The signature it is meant for.
    pub name: u32,
    /// Which way its chain goes at each interface.
    pub turns: Turns,
    /// Unit.
    pub w: Vec3,
    /// Over solid angle, of this direction for this signature.
    pub density: f32,
}

impl Records {
    /// What is listed around `x` on a surface that faces unit `n`; `None` if no image of a luminaire is.
    pub(crate) fn around(&self, x: Vec3, n: Vec3) -> Option<Around<'_>> {
        let leaf = self.kd.leaf(x, n)?;
        let images = self.picks.0[leaf].get_or_init(|| images_of(self, leaf));
        (!images.is_empty()).then_some(Around { records: self, images, x, n })
    }
}

impl Around<'_> {
    /// A direction towards one of them; `None` if what was picked is not seen from here. `u` and `v` in [0, 1).
    pub fn pick(&self, u: f32, v: [f32; 2]) -> Option<Picked> {
        let k = self.images.partition_point(|i| i.cumulative <= u).min(self.images.len() - 1);
        let image = self.images[k];
        let (axis, height) = self.cone(&image)?;
        let w = direction_in_cone(axis, height, v);
        let others = self.of(image.signature).iter().filter(|i| i.candidate != image.candidate);
        let own = image.share / (TAU * height);
        let density = own + others.map(|i| self.density_of(i, w)).sum::<f32>();
        let (name, turns) = (
            self.records.names[image.signature as usize],
            self.records.signatures[image.signature as usize].turns,
        );
        Some(Picked { name, turns, w, density })
    }

    /// The density over solid angle of direction unit `w` for signature `name`.
    pub fn density(&self, name: u32, w: Vec3) -> f32 {
        match self.records.names.binary_search(&name) {
            Ok(signature) => self.of(signature as u32).iter().map(|i| self.density_of(i, w)).sum(),
            Err(_) => 0.0,
        }
    }

    fn of(&self, signature: u32) -> &[Image] {
        let from = self.images.partition_point(|i| i.signature < signature);
        let count = self.images[from..].iter().take_while(|i| i.signature == signature).count();
        &self.images[from..from + count]
    }

    fn density_of(&self, image: &Image, w: Vec3) -> f32 {
        match self.cone(image) {
            // 1 − cos by the chord.
            Some((axis, height)) if 0.5 * (w - axis).length_squared() <= height => {
                image.share / (TAU * height)
            }
            _ => 0.0,
        }
    }

    /// Axis and 1 − cos of the half-angle of an image's cone; `None` where it is not seen from here.
    fn cone(&self, image: &Image) -> Option<(Vec3, f32)> {
        let candidate = &self.records.candidates[image.candidate as usize];
        if candidate.linear != NONE {
            let linear = &self.records.linears[candidate.linear as usize];
            return Some((linear.dir(self.x), height_of(linear.sin2)));
        }
        let view = self.records.view(candidate, self.x, 0.0)?;
        let (centre, radius2) = view.shape.ball();
        let to = centre - self.x;
        let distance2 = to.length_squared().max(f32::MIN_POSITIVE);
        let sin2 = (radius2 / distance2).min(1.0);
        let axis = to / distance2.sqrt();
        (axis.dot(self.n) > -sin2.sqrt()).then(|| (axis, height_of(sin2)))
    }
}
