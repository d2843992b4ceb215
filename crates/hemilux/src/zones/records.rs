//! Records of specular chains, and where they say virtual luminaires are: the predictor of the gather.
//!
//! A light particle that reaches a surface straight from a luminaire through mirrors and glass leaves a [`Record`]:
//! where, from which direction, how far the luminaire is along the chain, and the chain's *signature* (luminaire and
//! smooth patches met). Records near one another are grouped by signature; within a group the direction is regressed
//! linearly on the position, which removes parallax to first order (the slope is the curvature of the wave front, learnt
//! instead of computed), unless one place for the image explains the group as well, as it does behind flat mirrors. Each group becomes a [`Candidate`]: a cone of
//! directions that a gather may sample. H. W. Jensen 1995 (importance from photons); P. Shirley and K. Chiu 1994,
//! section 6 ("a good predictor").
//!
//! Candidates only steer: gathers weigh their samples by density, so a bad candidate costs noise and never bias.

use hemilux_scene::geom::{Frame, Vec3};

/// One arrival through a specular chain.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    /// Where (m).
    pub p: Vec3,
    /// Normal on the side of arrival, unit.
    pub n: Vec3,
    /// Unit direction back along the last segment.
    pub dir: Vec3,
    /// Length of the chain (m).
    pub length: f32,
    /// Luminaire and smooth patches of the chain, hashed.
    pub signature: u32,
    /// Radius of the luminaire (m).
    pub radius: f32,
    /// Luminance of the flux.
    pub flux: f32,
}

/// Records of one signature in one neighbourhood.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    model: Model,
    /// Cumulative share of samples within its leaf, ending at 1.
    cumulative: f32,
}

/// Where an image is seen, as a function of the point that sees it.
#[derive(Clone, Copy, Debug)]
enum Model {
    /// At a fixed place: exact for chains of flat mirrors. Place (m) and radius (m).
    Place { image: Vec3, radius: f32 },
    /// Direction linear in position: mean position, mean direction with its tangent frame, slope, 1 − cos of the cone.
    Linear { p: Vec3, frame: Frame, slope: [[f32; 2]; 2], height: f32 },
}

/// A cone of directions at a point.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    /// Unit axis.
    pub axis: Vec3,
    /// 1 − cos of the half-angle.
    pub height: f32,
    /// Probability that a sample is taken from it.
    pub share: f32,
}

enum Node {
    Split { axis: u8, at: f32, children: [u32; 2] },
    Leaf { first: u32, count: u32 },
}

/// All candidates, found by place and facing.
pub struct Records {
    nodes: Vec<Node>,
    /// Root per facing (±x, ±y, ±z), `u32::MAX` where there is nothing.
    roots: [u32; 6],
    candidates: Vec<Candidate>,
    records: usize,
}

impl std::fmt::Debug for Records {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Records({} in {} candidates)", self.records, self.candidates.len())
    }
}

/// Records in a leaf at most.
const LEAF: usize = 256;
/// Candidates of a leaf at most; the faintest are left out.
pub const MOST: usize = 192;
/// Luminaires that look wider than this along the chain (half-angle, radians) are left to the broad strata.
const LARGE: f32 = 0.3;
/// No cone is wider than this (1 − cos): where records scatter more, an image is only guessed at.
const WIDEST: f32 = 0.15;
/// A cone is this much wider than the luminaire seen along the chain.
const INFLATE: f32 = 1.6;

impl Default for Records {
    fn default() -> Self {
        Records { nodes: Vec::new(), roots: [u32::MAX; 6], candidates: Vec::new(), records: 0 }
    }
}

impl Records {
    /// Group the records. The order of `records` matters for the last bits only; it is deterministic.
    pub fn new(mut records: Vec<Record>) -> Records {
        let mut all = Records { records: records.len(), ..Records::default() };
        records.sort_by_key(|r| facing(r.n));
        let mut rest = records.as_mut_slice();
        for side in 0..6 {
            let count = rest.partition_point(|r| facing(r.n) <= side);
            let (here, later) = rest.split_at_mut(count);
            rest = later;
            if !here.is_empty() {
                all.roots[side] = all.build(here);
            }
        }
        all
    }

    /// Number of records behind the candidates.
    pub fn len(&self) -> usize {
        self.records
    }

    /// Whether there is nothing to find.
    pub fn is_empty(&self) -> bool {
        self.candidates.is_empty()
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        self.nodes.len() * size_of::<Node>() + self.candidates.len() * size_of::<Candidate>()
    }

    fn build(&mut self, records: &mut [Record]) -> u32 {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for r in records.iter() {
            (low, high) = (low.min(r.p), high.max(r.p));
        }
        let extent = high - low;
        let axis =
            if extent.x >= extent.y && extent.x >= extent.z { 0 } else { 1 + (extent.z > extent.y) as usize };
        if records.len() <= LEAF || extent[axis] <= 0.0 {
            let leaf = self.leaf(records);
            self.nodes.push(leaf);
            return self.nodes.len() as u32 - 1;
        }
        let middle = records.len() / 2;
        records.select_nth_unstable_by(middle, |a, b| a.p[axis].total_cmp(&b.p[axis]));
        let at = records[middle].p[axis];
        let (left, right) = records.split_at_mut(middle);
        let children = [self.build(left), self.build(right)];
        self.nodes.push(Node::Split { axis: axis as u8, at, children });
        self.nodes.len() as u32 - 1
    }

    fn leaf(&mut self, records: &mut [Record]) -> Node {
        // The whole key: equal signatures in an order that does not depend on how the tree was cut.
        records.sort_by(|a, b| {
            (a.signature, a.p.x.to_bits(), a.p.y.to_bits(), a.p.z.to_bits()).cmp(&(
                b.signature,
                b.p.x.to_bits(),
                b.p.y.to_bits(),
                b.p.z.to_bits(),
            ))
        });
        let mut found: Vec<(Candidate, f32)> = Vec::new();
        for group in records.chunk_by(|a, b| a.signature == b.signature) {
            let flux: f32 = group.iter().map(|r| r.flux).sum();
            if let Some(c) = Candidate::fit(group) {
                found.push((c, flux));
            }
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        found.truncate(MOST);
        let (total, count) = (found.iter().map(|f| f.1).sum::<f32>(), found.len() as f32);
        let mut sum = 0.0;
        let first = self.candidates.len() as u32;
        for (mut c, flux) in found {
            // Half by flux, half evenly: a chain that few particles found may matter.
            sum += if total > 0.0 { 0.5 * flux / total + 0.5 / count } else { 1.0 / count };
            c.cumulative = sum;
            self.candidates.push(c);
        }
        Node::Leaf { first, count: self.candidates.len() as u32 - first }
    }

    /// The candidates near `p` on a surface that faces `n`.
    pub fn near(&self, p: Vec3, n: Vec3) -> &[Candidate] {
        let mut node = self.roots[facing(n)];
        while let Some(Node::Split { axis, at, children }) = self.nodes.get(node as usize) {
            node = children[(p[*axis as usize] >= *at) as usize];
        }
        match self.nodes.get(node as usize) {
            Some(Node::Leaf { first, count }) => {
                &self.candidates[*first as usize..(*first + *count) as usize]
            }
            _ => &[],
        }
    }
}

/// Which of ±x, ±y, ±z a normal is closest to.
fn facing(n: Vec3) -> usize {
    let a = n.abs();
    let axis = if a.x >= a.y && a.x >= a.z { 0 } else { 1 + (a.z > a.y) as usize };
    axis * 2 + (n[axis] < 0.0) as usize
}

impl Candidate {
    /// The model that explains the group best. `None` where the image is so large that broad strata find it.
    fn fit(group: &[Record]) -> Option<Candidate> {
        let count = group.len() as f32;
        let mean = |f: &dyn Fn(&Record) -> Vec3| group.iter().fold(Vec3::ZERO, |s, r| s + f(r)) / count;
        let image = mean(&|r| r.p + r.dir * r.length);
        let length = group.iter().map(|r| r.length).sum::<f32>() / count;
        let radius = group.iter().map(|r| r.radius).fold(0.0, f32::max);
        // Root mean square of what is left of the directions, per tangent axis.
        let rms = |sum: f32, free: f32| (0.5 * sum / (count - free).max(1.0)).sqrt();
        let place = rms(
            group.iter().map(|r| ((image - r.p).normalize_or_zero() - r.dir).length_squared()).sum(),
            1.0,
        );
        let seen = radius / length.max(1e-9);
        // Records come from anywhere on the luminaire; few of them do not show its extent.
        let half_angle =
            |spread: f32| INFLATE * (3.0 * spread).max(if count < 4.0 { 2.0 * seen } else { 1.1 * seen });
        let mut angle = half_angle(place);
        let mut model = Model::Place { image, radius: angle * length };
        if group.len() >= 8 && place > 0.8 * seen {
            let p = mean(&|r| r.p);
            let frame = Frame::from_normal(mean(&|r| r.dir).try_normalize()?);
            let plane = |v: Vec3| [frame.s.dot(v), frame.t.dot(v)];
            if let Some(slope) = regress(group, p, &plane) {
                let off = |r: &Record| {
                    let (x, d) = (plane(r.p - p), plane(r.dir));
                    (0..2).map(|i| (d[i] - slope[i][0] * x[0] - slope[i][1] * x[1]).powi(2)).sum::<f32>()
                };
                let linear = rms(group.iter().map(off).sum(), 3.0);
                if linear < 0.8 * place {
                    angle = half_angle(linear);
                    model = Model::Linear { p, frame, slope, height: (0.5 * angle * angle).min(WIDEST) };
                }
            }
        }
        (angle > 0.0 && seen < LARGE).then_some(Candidate { model, cumulative: 0.0 })
    }

    /// The cone at `x`; `previous` is the cumulative share before this candidate.
    #[inline]
    pub fn cone(&self, x: Vec3, previous: f32) -> Cone {
        let share = self.cumulative - previous;
        match &self.model {
            Model::Place { image, radius } => {
                let to = *image - x;
                let distance2 = to.length_squared().max(1e-30);
                let height = (0.5 * radius * radius / distance2).min(WIDEST);
                Cone { axis: to / distance2.sqrt(), height, share }
            }
            Model::Linear { p, frame, slope, height } => {
                let d = x - *p;
                let (u, v) = (frame.s.dot(d), frame.t.dot(d));
                let a = slope[0][0] * u + slope[0][1] * v;
                let b = slope[1][0] * u + slope[1][1] * v;
                Cone { axis: (frame.n + frame.s * a + frame.t * b).normalize(), height: *height, share }
            }
        }
    }

    /// Cumulative share up to and including this candidate.
    pub fn cumulative(&self) -> f32 {
        self.cumulative
    }
}

/// Least squares: the 2 × 2 matrix that carries tangential displacement to change of direction.
fn regress(group: &[Record], p: Vec3, plane: &impl Fn(Vec3) -> [f32; 2]) -> Option<[[f32; 2]; 2]> {
    let (mut xx, mut dx) = ([[0f64; 2]; 2], [[0f64; 2]; 2]);
    for r in group {
        let (x, d) = (plane(r.p - p), plane(r.dir));
        for i in 0..2 {
            for j in 0..2 {
                xx[i][j] += x[i] as f64 * x[j] as f64;
                dx[i][j] += d[i] as f64 * x[j] as f64;
            }
        }
    }
    let determinant = xx[0][0] * xx[1][1] - xx[0][1] * xx[1][0];
    if determinant <= 1e-6 * (xx[0][0] + xx[1][1]).powi(2) {
        return None;
    }
    let inverse = [
        [xx[1][1] / determinant, -xx[0][1] / determinant],
        [-xx[1][0] / determinant, xx[0][0] / determinant],
    ];
    Some(
        [0, 1].map(|i: usize| {
            [0, 1].map(|j: usize| (dx[i][0] * inverse[0][j] + dx[i][1] * inverse[1][j]) as f32)
        }),
    )
}

impl Cone {
    /// Whether unit `w` lies within.
    #[inline]
    pub fn contains(&self, w: Vec3) -> bool {
        // 1 − cos by the chord, which keeps its digits for small angles.
        0.5 * (w - self.axis).length_squared() <= self.height
    }

    /// Density per steradian within.
    #[inline]
    pub fn density(&self) -> f32 {
        1.0 / (2.0 * std::f32::consts::PI * self.height)
    }

    /// A direction uniform over the cone.
    pub fn sample(&self, u: [f32; 2]) -> Vec3 {
        let x = u[0] * self.height;
        let sin = (x * (2.0 - x)).max(0.0).sqrt();
        let (s, c) = (2.0 * std::f32::consts::PI * u[1]).sin_cos();
        Frame::from_normal(self.axis).to_world(Vec3::new(sin * c, sin * s, 1.0 - x)).normalize()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::{Key, sobol};

    /// Records on the floor of a point luminaire's image, as a flat mirror throws them.
    fn flat(image: Vec3, spread: f32, n: u32) -> Vec<Record> {
        (0..n)
            .map(|i| {
                let u = sobol(i, Key::new(4));
                let p = Vec3::new((u.u - 0.5) * spread, (u.v - 0.5) * spread, 0.0);
                let to = image - p;
                Record {
                    p,
                    n: Vec3::Z,
                    dir: to.normalize(),
                    length: to.length(),
                    signature: 7,
                    radius: 0.002,
                    flux: 1.0,
                }
            })
            .collect()
    }

    #[test]
    fn the_image_of_a_flat_mirror_is_found_from_anywhere_near() {
        let image = Vec3::new(1.0, 0.4, 2.0);
        for n in [1, 3, 20, 200] {
            let records = Records::new(flat(image, 0.2, n));
            for x in [Vec3::ZERO, Vec3::new(0.08, -0.05, 0.0)] {
                let candidates = records.near(x, Vec3::Z);
                assert_eq!(candidates.len(), 1);
                let cone = candidates[0].cone(x, 0.0);
                let angle = (cone.axis - (image - x).normalize()).length();
                assert!(angle < 1e-4, "{n} records at {x}: off by {angle}");
                assert!(cone.contains((image - x).normalize()), "{n} records at {x}");
                assert!(cone.height < 1e-4, "tight: {}", cone.height);
            }
        }
    }

    #[test]
    fn cones_are_sampled_evenly_and_hold_their_samples() {
        let cone = Cone { axis: Vec3::new(0.6, 0.0, 0.8), height: 1e-5, share: 1.0 };
        for i in 0..500 {
            let u = sobol(i, Key::new(1));
            let w = cone.sample([u.u, u.v]);
            assert!(0.5 * (w - cone.axis).length_squared() <= cone.height * 1.01, "{w}");
        }
    }
}
