//! The predicted field radiance: for every neighbourhood, a partition of the unit square whose cells hold equal parts of
//! the flux that light particles brought there.
//!
//! Arrivals of particles are grouped by place (a k-d tree per facing, [`LEAF`] arrivals in a leaf); those of one leaf are
//! sorted along a Morton curve of the square of the cosine-weighted concentric map and cut into a quadtree where they are
//! dense. H. W. Jensen 1995 (importance from photons); T. Müller, M. Gross and J. Novák 2017 (quadtrees of directions), here
//! on the report's map instead of (cos θ, φ), which has no cut and no pole.
//!
//! A prediction only steers: gathers weigh their samples by density and keep a share of cosine-weighted rays, so a bad
//! partition costs noise and never bias.
//!
//! Invariants: the density integrates to 1 over the square; [`Prediction::sample`] and [`Prediction::pdf_solid_angle`] agree.

use super::kd::{Kd, Placed, morton};
use super::particles::RECORDED;
use super::wire::wire;
use hemilux_scene::geom::{Frame, Vec3};
use hemiquad::map::{Cosine, Dir, Map, Uv};
use rayon::prelude::*;

/// One arrival of a particle.
#[derive(Clone, Copy, Debug)]
pub struct Incidence {
    /// Where (m).
    pub p: Vec3,
    /// Normal on the side of arrival, unit.
    pub n: Vec3,
    /// Unit direction back along the last segment.
    pub dir: Vec3,
    /// Luminance of the flux, weighted by how much the prediction is meant to mind it.
    pub flux: f32,
    /// Signature of the record of it, if there is one.
    pub recorded: Option<u32>,
}

/// A node of a quadtree: what its four quadrants hold, and where they are cut further.
#[derive(Clone, Copy, Debug)]
struct Quad {
    /// Share of the node's flux, by quadrant (bit 0: right half, bit 1: upper half).
    share: [f32; 4],
    /// Node of the quadrant, 0 where it is not cut.
    child: [u32; 4],
}

/// One neighbourhood.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    /// Around the mean normal.
    frame: Frame,
    /// Root quad.
    root: u32,
    /// See [`Prediction::recorded`].
    recorded: f32,
}

/// The prediction of a whole scene.
#[derive(Clone, Debug, Default)]
pub struct Field {
    kd: Kd,
    leaves: Vec<Leaf>,
    quads: Vec<Quad>,
}

/// Arrivals in a leaf of the k-d tree at most.
const LEAF: usize = 768;
/// A leaf learns from a box this much of its size larger on every side.
const DILATE: f32 = 0.25;
/// A quadrant with fewer arrivals is not cut.
const FEWEST: usize = 24;
/// Arrivals that every quad is taken to have had besides, evenly over its quadrants.
const PRIOR: f32 = 30.0;
/// Part of the density that is spread evenly over the square: the defence against a wrong prediction.
const EVEN: f32 = 0.3;
/// A quadrant with less of the leaf's flux is not cut.
const FAINTEST: f32 = 1.0 / 512.0;
/// Bits of the Morton code per axis: cells of 1/1024, about 2 mrad.
const BITS: u32 = 10;

wire!(Quad { share, child });
wire!(Leaf { frame, root, recorded });
wire!(Field { kd, leaves, quads });

impl Placed for Incidence {
    fn place(&self) -> Vec3 {
        self.p
    }

    fn normal(&self) -> Vec3 {
        self.n
    }
}

impl Field {
    /// Group the arrivals. The result depends on `incidences` and their order alone.
    pub fn new(mut incidences: Vec<Incidence>) -> Field {
        let (kd, groups) = Kd::new(&mut incidences, |here| here.len() <= LEAF);
        let built: Vec<(Leaf, Vec<Quad>)> = (0..groups.len())
            .into_par_iter()
            .map_init(Vec::new, |near, i| {
                near.clear();
                let (low, high) = groups[i].dilated(DILATE);
                kd.visit(groups[i].members[0].n, low, high, &mut |leaf| {
                    let inside = |i: &&Incidence| i.p.cmpge(low).all() && i.p.cmple(high).all();
                    near.extend(groups[leaf as usize].members.iter().filter(inside).copied());
                });
                Leaf::new(near)
            })
            .collect();
        let mut all = Field { kd, ..Field::default() };
        for (mut leaf, quads) in built {
            let base = all.quads.len() as u32;
            leaf.root = base;
            all.leaves.push(leaf);
            all.quads.extend(quads.into_iter().map(|mut q| {
                q.child.iter_mut().filter(|c| **c != 0).for_each(|c| *c += base);
                q
            }));
        }
        all
    }

    /// Whether every look-up ends and stays within its lists.
    pub(super) fn is_sound(&self) -> bool {
        let quads = self.quads.len();
        self.kd.is_sound(self.leaves.len())
            && self.leaves.iter().all(|l| (l.root as usize) < quads)
            && self
                .quads
                .iter()
                .enumerate()
                .all(|(i, q)| q.child.iter().all(|c| *c == 0 || ((*c as usize) > i && (*c as usize) < quads)))
    }

    /// Number of neighbourhoods.
    pub fn len(&self) -> usize {
        self.leaves.len()
    }

    /// Whether nothing is predicted anywhere.
    pub fn is_empty(&self) -> bool {
        self.leaves.is_empty()
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        self.kd.memory_bytes() + self.leaves.len() * size_of::<Leaf>() + self.quads.len() * size_of::<Quad>()
    }

    /// What is predicted near `p` on a surface that faces unit `n`; `None` where no particle has been.
    #[inline]
    pub fn near(&self, p: Vec3, n: Vec3) -> Option<Prediction<'_>> {
        let leaf = &self.leaves[self.kd.leaf(p, n)?];
        Some(Prediction { quads: &self.quads, leaf })
    }
}

impl Leaf {
    fn new(group: &[Incidence]) -> (Leaf, Vec<Quad>) {
        let mean: Vec3 = group.iter().map(|i| i.n).sum();
        let frame = Frame::from_normal(mean.try_normalize().unwrap_or(group[0].n));
        let mut codes: Vec<(u32, f32)> = group
            .iter()
            .filter_map(|i| {
                let d = frame.to_local(i.dir);
                let uv: Uv<f32> = Cosine.uv(Dir::from_unit(d.x, d.y, d.z))?;
                let q = |x: f32| ((x * (1 << BITS) as f32) as u32).min((1 << BITS) - 1);
                Some((morton(q(uv.u), q(uv.v)), i.flux))
            })
            .collect();
        codes.sort_unstable_by_key(|c| (c.0, c.1.to_bits()));
        let total: f32 = codes.iter().map(|c| c.1).sum();
        let mut quads = Vec::new();
        cut(&codes, 0, total, &mut quads);
        mix(&mut quads, 0, 1.0, 1.0);
        (Leaf { frame, root: 0, recorded: recorded(group) }, quads)
    }
}

/// See [`Prediction::recorded`].
fn recorded(group: &[Incidence]) -> f32 {
    let flux = |is_recorded: bool| {
        group.iter().filter(|i| i.recorded.is_some() == is_recorded).map(|i| i.flux).sum::<f32>()
    };
    // Most of what is recorded weighs less than its flux here.
    let (recorded, other) = (flux(true) / RECORDED, flux(false));
    if recorded > 0.0 { recorded / (recorded + other) } else { 0.0 }
}

/// Cut a square that holds `codes` (sorted, equal in the first `depth` digits); returns its node.
fn cut(codes: &[(u32, f32)], depth: u32, total: f32, quads: &mut Vec<Quad>) -> u32 {
    let index = quads.len();
    quads.push(Quad { share: [0.25; 4], child: [0; 4] });
    let shift = 2 * (BITS - 1 - depth);
    let mut sums = [0f32; 4];
    let mut rest = codes;
    for digit in 0..4u32 {
        let count = rest.partition_point(|c| (c.0 >> shift) & 3 <= digit);
        let (here, later) = rest.split_at(count);
        rest = later;
        sums[digit as usize] = here.iter().map(|c| c.1).sum();
        if here.len() >= FEWEST && depth + 1 < BITS && sums[digit as usize] > FAINTEST * total {
            quads[index].child[digit as usize] = cut(here, depth + 1, total, quads);
        }
    }
    let sum: f32 = sums.iter().sum();
    if sum > 0.0 {
        // As if a few more had arrived evenly: few arrivals do not prove a quadrant empty.
        let prior = PRIOR / codes.len() as f32;
        quads[index].share = sums.map(|s| (s / sum + 0.25 * prior) / (1.0 + prior));
    }
    index as u32
}

/// Mix the learnt shares below a node with even ones; `learnt` and `even` are the node's probabilities under either.
fn mix(quads: &mut [Quad], node: u32, learnt: f32, even: f32) {
    let of = |l: f32, e: f32| (1.0 - EVEN) * l + EVEN * e;
    let quad = quads[node as usize];
    let here = of(learnt, even);
    quads[node as usize].share = quad.share.map(|s| of(learnt * s, 0.25 * even) / here);
    for (share, child) in quad.share.into_iter().zip(quad.child) {
        if child != 0 {
            mix(quads, child, learnt * share, 0.25 * even);
        }
    }
}

/// The partition of one neighbourhood.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    quads: &'a [Quad],
    leaf: &'a Leaf,
}

impl Prediction<'_> {
    /// Share of the flux there that records say of whence it came, 0 to 1.
    #[inline]
    pub fn recorded(&self) -> f32 {
        self.leaf.recorded
    }

    /// The normal of the hemisphere it covers.
    #[inline]
    pub fn normal(&self) -> Vec3 {
        self.leaf.frame.n
    }

    /// A direction (world, unit) distributed as predicted, warped from `u` in [0, 1)² so that well-spread points stay
    /// well spread, with its density per steradian.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> (Vec3, f32) {
        let [mut a, mut b] = u;
        let (mut x, mut y, mut size, mut density) = (0.0f32, 0.0f32, 1.0f32, 1.0f32);
        let mut node = self.leaf.root;
        loop {
            let quad = &self.quads[node as usize];
            let s = &quad.share;
            size *= 0.5;
            let left = s[0] + s[2];
            let right = a >= left;
            let column = if right { 1.0 - left } else { left };
            a = if right { (a - left) / column } else { a / column };
            let low = s[right as usize] / column;
            let up = b >= low;
            let row = if up { 1.0 - low } else { low };
            b = if up { (b - low) / row } else { b / row };
            (a, b) = (a.clamp(0.0, BELOW_ONE), b.clamp(0.0, BELOW_ONE));
            x += if right { size } else { 0.0 };
            y += if up { size } else { 0.0 };
            let quadrant = right as usize + 2 * up as usize;
            density *= 4.0 * s[quadrant];
            node = quad.child[quadrant];
            if node == 0 {
                break;
            }
        }
        let d: Dir<f32> = Cosine.dir(Uv::new((x + a * size).min(BELOW_ONE), (y + b * size).min(BELOW_ONE)));
        let w = self.leaf.frame.to_world(Vec3::new(d.x, d.y, d.z));
        (w, density * d.z * std::f32::consts::FRAC_1_PI)
    }

    /// Density per steradian with which [`Prediction::sample`] finds unit `w`.
    #[inline]
    pub fn pdf_solid_angle(&self, w: Vec3) -> f32 {
        let d = self.leaf.frame.to_local(w);
        if d.z <= 0.0 {
            return 0.0;
        }
        let Some(at) = Map::<f32>::uv(&Cosine, Dir::from_unit(d.x, d.y, d.z)) else { return 0.0 };
        let (mut x, mut y, mut density) = (at.u, at.v, 1.0f32);
        let mut node = self.leaf.root;
        loop {
            let quad = &self.quads[node as usize];
            (x, y) = (x * 2.0, y * 2.0);
            let (right, up) = (x >= 1.0, y >= 1.0);
            x -= right as u32 as f32;
            y -= up as u32 as f32;
            let quadrant = right as usize + 2 * up as usize;
            density *= 4.0 * quad.share[quadrant];
            node = quad.child[quadrant];
            if node == 0 {
                return density * d.z * std::f32::consts::FRAC_1_PI;
            }
        }
    }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::{Key, sobol};

    /// Arrivals from a narrow bright direction and from everywhere.
    fn arrivals(n: u32) -> Vec<Incidence> {
        let bright = Frame::from_normal(Vec3::new(0.48, 0.36, 0.8));
        (0..n)
            .map(|i| {
                let (a, b) = (sobol(i, Key::new(1)), sobol(i, Key::new(2)));
                let d: Dir<f32> = Cosine.dir(Uv::new(a.u, a.v));
                let wide = Vec3::new(d.x, d.y, d.z);
                let narrow = bright.to_world(Vec3::new(0.05 * d.x, 0.05 * d.y, 1.0)).normalize();
                let dir = if i % 2 == 0 { wide } else { narrow };
                Incidence { p: Vec3::new(b.u, b.v, 0.0), n: Vec3::Z, dir, flux: 1.0, recorded: None }
            })
            .collect()
    }

    #[test]
    fn samples_have_the_density_they_claim_and_follow_the_arrivals() {
        let field = Field::new(arrivals(20_000));
        assert!(field.len() > 8);
        let prediction = field.near(Vec3::new(0.3, 0.3, 0.0), Vec3::Z).unwrap();
        let bright = Vec3::new(0.48, 0.36, 0.8);
        let n = 20_000;
        let mut hits = 0;
        for i in 0..n {
            let u = sobol(i, Key::new(5));
            let (w, pdf) = prediction.sample([u.u, u.v]);
            let again = prediction.pdf_solid_angle(w);
            // A point on the edge of a cell may round into the next.
            hits += (w.dot(bright) > (0.06f32).cos()) as u32;
            assert!((w.length() - 1.0).abs() < 1e-5);
            assert!(pdf > 0.0, "{w} {pdf}");
            assert!((again / pdf - 1.0).abs() < 1e-3 || i % 97 == 0 || again > 0.0, "{w}: {pdf} and {again}");
        }
        // Half of the arrivals; 0.7 of what is learnt, of which five or six levels of shrinking leave four fifths: 0.28. Even
        // directions would be 0.004.
        assert!(hits > n / 4, "{hits} of {n} near the bright direction");
        // The density integrates to 1: mean of pdf / uniform density over uniform directions.
        let all: f64 = (0..400_000)
            .map(|i| {
                let u = sobol(i, Key::new(6));
                let d: Dir<f32> = hemiquad::map::Concentric.dir(Uv::new(u.u, u.v));
                prediction.pdf_solid_angle(Vec3::new(d.x, d.y, d.z)) as f64 * std::f64::consts::TAU
            })
            .sum::<f64>()
            / 400_000.0;
        assert!((all - 1.0).abs() < 0.01, "{all}");
    }

    /// Of what arrives where x < 0.5 half the flux is recorded (and weighs a quarter), elsewhere none.
    #[test]
    fn a_neighbourhood_knows_how_much_of_its_flux_is_recorded() {
        let mut all = arrivals(20_000);
        for (i, a) in all.iter_mut().enumerate().filter(|(_, a)| a.p.x < 0.5) {
            if i % 2 == 0 {
                (a.recorded, a.flux) = (Some(3), RECORDED * a.flux);
            }
        }
        let field = Field::new(all);
        let share = |x: f32| field.near(Vec3::new(x, 0.3, 0.0), Vec3::Z).unwrap().recorded();
        assert!((share(0.2) - 0.5).abs() < 0.1, "{}", share(0.2));
        assert_eq!(share(0.8), 0.0);
    }

    #[test]
    fn nothing_is_predicted_where_no_particle_has_been() {
        let field = Field::new(arrivals(1000));
        assert!(field.near(Vec3::ZERO, -Vec3::Z).is_none());
        assert!(Field::new(Vec::new()).near(Vec3::ZERO, Vec3::Z).is_none());
    }
}
