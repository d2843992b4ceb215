//! Aimed emission: which of the numbers that a particle starts from lead to light that matters.
//!
//! A particle starts from five numbers in [0, 1): the luminaire's pick, a point on it, a direction. Their unit cube is cut
//! into boxes, alternating wherever it tells most, by what earlier particles brought to surfaces that the eye sees; later
//! particles are drawn from the boxes in proportion to the root mean square of that, and carry their flux over the
//! density. One box tree serves every kind of luminaire, sky and caster: it knows only numbers and outcomes (adaptive
//! importance sampling of the primary space, as in G. P. Lepage's VEGAS, with a tree instead of a product).
//!
//! Invariants: the density integrates to 1 and is at least [`FLOOR`] everywhere, so sums over aimed particles are unbiased
//! and no particle counts more than 1 / [`FLOOR`] times its plain flux.

/// Numbers that a particle starts from.
pub const DIMENSIONS: usize = 5;
/// A start.
pub type Start = [f32; DIMENSIONS];

/// A start and what came of it.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    /// Where in the cube.
    pub start: Start,
    /// Use: flux brought to surfaces that matter, per plain flux.
    pub use_: f32,
}

/// Least density.
pub const FLOOR: f32 = 0.1;
/// A box with fewer trials is not cut.
const FEWEST: usize = 48;
/// Cuts on any way from the whole cube to a box.
const DEEPEST: u32 = 24;
/// A box is cut across the dimension whose slices differ most, if their relative variance is beyond this.
const UNEVEN: f32 = 0.05;
/// Slices of a box that are compared, so that what lies in its middle shows too.
const SLICES: usize = 8;

#[derive(Clone, Copy, Debug)]
enum Node {
    /// Halved across a dimension; probability of the lower half.
    Cut {
        dimension: u8,
        low: f32,
        children: [u32; 2],
    },
    Box,
}

/// The boxes.
#[derive(Clone, Debug)]
pub struct Aim {
    nodes: Vec<Node>,
}

impl Default for Aim {
    /// No preference.
    fn default() -> Self {
        Aim { nodes: vec![Node::Box] }
    }
}

impl Aim {
    /// Learn from trials, in whatever density they were made.
    pub fn learn(mut trials: Vec<Trial>) -> Aim {
        let mut aim = Aim { nodes: Vec::new() };
        let whole = rms(&trials);
        if whole > 0.0 {
            aim.cut(&mut trials, [0.0; DIMENSIONS], [1.0; DIMENSIONS], [0, DEEPEST], whole);
            aim.mix();
        } else {
            aim.nodes.push(Node::Box);
        }
        aim
    }

    /// The boxes cut further, and all shares anew, by trials drawn from these boxes: within each they are even, so that each is
    /// judged by itself. At most `deepest` cuts lead to a box.
    pub fn refined(&self, mut trials: Vec<Trial>, deepest: u32) -> Aim {
        let mut aim = Aim { nodes: Vec::new() };
        aim.recut(self, 0, &mut trials, [0.0; DIMENSIONS], [1.0; DIMENSIONS], [0, deepest]);
        aim.mix();
        aim
    }

    fn recut(
        &mut self,
        old: &Aim,
        node: u32,
        trials: &mut [Trial],
        low: Start,
        high: Start,
        [depth, deepest]: [u32; 2],
    ) -> (u32, f32) {
        let Node::Cut { dimension, children, .. } = old.nodes[node as usize] else {
            return self.cut(trials, low, high, [depth, deepest], 0.0);
        };
        let (index, d) = (self.nodes.len(), dimension as usize);
        self.nodes.push(Node::Box);
        let middle = 0.5 * (low[d] + high[d]);
        trials.sort_by(|a, b| (a.start[d] >= middle).cmp(&(b.start[d] >= middle)));
        let split = trials.partition_point(|t| t.start[d] < middle);
        let (lower, upper) = trials.split_at_mut(split);
        let (mut mid_high, mut mid_low) = (high, low);
        (mid_high[d], mid_low[d]) = (middle, middle);
        let (left, a) = self.recut(old, children[0], lower, low, mid_high, [depth + 1, deepest]);
        let (right, b) = self.recut(old, children[1], upper, mid_low, high, [depth + 1, deepest]);
        let share = if a + b > 0.0 { a / (a + b) } else { 0.5 };
        self.nodes[index] = Node::Cut { dimension, low: share, children: [left, right] };
        (index as u32, a + b)
    }

    /// Cut a box; returns its node and leaves in `low` the integral of the target over the lower half for now.
    fn cut(
        &mut self,
        trials: &mut [Trial],
        low: Start,
        high: Start,
        [depth, deepest]: [u32; 2],
        whole: f32,
    ) -> (u32, f32) {
        let index = self.nodes.len();
        self.nodes.push(Node::Box);
        let volume: f32 = (0..DIMENSIONS).map(|d| high[d] - low[d]).product();
        let here = rms(trials);
        if trials.len() < 2 * FEWEST || depth >= deepest {
            return (index as u32, volume * here);
        }
        let worth = here > 0.02 * whole || depth < 2 * DIMENSIONS as u32;
        let (d, unevenness) = (0..DIMENSIONS)
            .map(|d| (d, unevenness(trials, d, low[d], high[d])))
            .fold((0, 0.0), |best, x| if x.1 > best.1 { x } else { best });
        if unevenness < UNEVEN || !worth {
            return (index as u32, volume * here);
        }
        let middle = 0.5 * (low[d] + high[d]);
        trials.sort_by(|a, b| (a.start[d] >= middle).cmp(&(b.start[d] >= middle)));
        let split = trials.partition_point(|t| t.start[d] < middle);
        let (lower, upper) = trials.split_at_mut(split);
        let (mut mid_high, mut mid_low) = (high, low);
        (mid_high[d], mid_low[d]) = (middle, middle);
        let (left, a) = self.cut(lower, low, mid_high, [depth + 1, deepest], whole);
        let (right, b) = self.cut(upper, mid_low, high, [depth + 1, deepest], whole);
        let share = if a + b > 0.0 { a / (a + b) } else { 0.5 };
        self.nodes[index] = Node::Cut { dimension: d as u8, low: share, children: [left, right] };
        (index as u32, a + b)
    }

    /// Mix the learnt density with the even one.
    fn mix(&mut self) {
        self.mix_below(0, 1.0, 1.0);
    }

    /// `learnt` and `even` are the probabilities of the node under either.
    fn mix_below(&mut self, node: u32, learnt: f32, even: f32) {
        if let Node::Cut { dimension, low, children } = self.nodes[node as usize] {
            let (a, b) = (learnt * low, learnt * (1.0 - low));
            let of = |l: f32, e: f32| (1.0 - FLOOR) * l + FLOOR * e;
            let share = of(a, 0.5 * even) / of(learnt, even);
            self.nodes[node as usize] = Node::Cut { dimension, low: share, children };
            self.mix_below(children[0], a, 0.5 * even);
            self.mix_below(children[1], b, 0.5 * even);
        }
    }

    /// Number of boxes.
    pub fn len(&self) -> usize {
        self.nodes.iter().filter(|n| matches!(n, Node::Box)).count()
    }

    /// Whether nothing has been learnt.
    pub fn is_empty(&self) -> bool {
        self.nodes.len() == 1
    }

    /// The density at a start.
    pub fn density(&self, start: &Start) -> f32 {
        let (mut low, mut size, mut density) = ([0f32; DIMENSIONS], [1f32; DIMENSIONS], 1.0);
        let mut node = 0u32;
        while let Node::Cut { dimension, low: share, children } = self.nodes[node as usize] {
            let d = dimension as usize;
            size[d] *= 0.5;
            let upper = start[d] >= low[d] + size[d];
            low[d] += if upper { size[d] } else { 0.0 };
            density *= 2.0 * if upper { 1.0 - share } else { share };
            node = children[upper as usize];
        }
        density
    }

    /// The start that `u` is carried to, and the density there (1 where nothing is preferred).
    pub fn start(&self, u: Start) -> (Start, f32) {
        let (mut u, mut low, mut size, mut density) = (u, [0f32; DIMENSIONS], [1f32; DIMENSIONS], 1.0);
        let mut node = 0u32;
        while let Node::Cut { dimension, low: share, children } = self.nodes[node as usize] {
            let d = dimension as usize;
            let upper = u[d] >= share;
            size[d] *= 0.5;
            let part = if upper { 1.0 - share } else { share };
            u[d] = if upper { (u[d] - share) / part } else { u[d] / part };
            low[d] += if upper { size[d] } else { 0.0 };
            density *= 2.0 * part;
            node = children[upper as usize];
        }
        let mut start = [0.0; DIMENSIONS];
        for d in 0..DIMENSIONS {
            start[d] = (low[d] + size[d] * u[d].clamp(0.0, BELOW_ONE)).min(BELOW_ONE);
        }
        (start, density)
    }
}

/// The largest number below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Relative variance of the mean squares of a box's slices across dimension `d`, beyond what chance would make it.
fn unevenness(trials: &[Trial], d: usize, low: f32, high: f32) -> f32 {
    let (mut sums, mut counts) = ([0f64; SLICES], [0f64; SLICES]);
    let (mut all, mut fourth) = (0f64, 0f64);
    for t in trials {
        let slice = ((t.start[d] - low) / (high - low) * SLICES as f32) as usize;
        let square = (t.use_ as f64).powi(2);
        sums[slice.min(SLICES - 1)] += square;
        counts[slice.min(SLICES - 1)] += 1.0;
        all += square;
        fourth += square * square;
    }
    if all <= 0.0 {
        return 0.0;
    }
    let mean = all / trials.len() as f64;
    let filled = counts.iter().filter(|c| **c > 0.0).count() as f64;
    let differences = sums.iter().zip(&counts).filter(|(_, c)| **c > 0.0);
    let variance = differences.map(|(s, c)| (s / c / mean - 1.0).powi(2)).sum::<f64>() / filled;
    let chance = SLICES as f64 * fourth / (all * all);
    (variance - 2.0 * chance) as f32
}

fn rms(trials: &[Trial]) -> f32 {
    let sum: f64 = trials.iter().map(|t| (t.use_ as f64).powi(2)).sum();
    (sum / trials.len().max(1) as f64).sqrt() as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::Key;

    fn point(i: u64) -> Start {
        let key = Key::new(3).with(i);
        [0, 1, 2, 3, 4].map(|d| key.uniform(d))
    }

    fn useful(s: &Start) -> f32 {
        let inside = (s[1] - 0.7).abs() < 0.05 && (s[3] - 0.2).abs() < 0.05;
        if inside { 1.0 + s[0] } else { 0.0 }
    }

    #[test]
    fn aimed_starts_find_what_is_rare_and_keep_the_mean() {
        let trials = (0..100_000).map(|i| Trial { start: point(i), use_: useful(&point(i)) }).collect();
        let aim = Aim::learn(trials);
        assert!(aim.len() > 8);
        let n = 200_000;
        let (mut hits, mut sum, mut squares, mut weights) = (0u32, 0f64, 0f64, 0f64);
        for i in 0..n {
            let (start, density) = aim.start(point(1_000_000 + i));
            assert!(density >= FLOOR * 0.999, "{density}");
            assert_eq!(density, aim.density(&start));
            let value = (useful(&start) / density) as f64;
            hits += (value > 0.0) as u32;
            sum += value;
            squares += value * value;
            weights += 1.0 / density as f64;
        }
        let mean = sum / n as f64;
        let error = ((squares / n as f64 - mean * mean) / n as f64).sqrt();
        // 0.01 of the cube, 1.5 on average; z beyond 4.5: 7e-6.
        assert!((mean - 0.015).abs() < 4.5 * error, "{mean} ± {error}");
        assert!((weights / n as f64 - 1.0).abs() < 0.02, "{weights}");
        assert!(hits as u64 > n / 4, "{hits} of {n}");
    }

    #[test]
    fn refining_follows_what_shrinks() {
        let meets = |s: &Start, r: f32| (s[1] - 0.7).abs() < r && (s[3] - 0.2).abs() < r;
        let mut aim = Aim::default();
        let radii = [0.1, 0.03, 0.01, 0.003, 0.001, 0.0003, 0.0003, 0.0003];
        for (round, r) in radii.into_iter().enumerate() {
            let trial = |i: u64| {
                let start = aim.start(point((round as u64) << 32 | i)).0;
                Trial { start, use_: meets(&start, r) as u32 as f32 }
            };
            aim = aim.refined((0..32_768).map(trial).collect(), 48);
        }
        let (n, mut hits, mut sum, mut at_faces) = (100_000, 0u32, 0f64, 0u32);
        for i in 0..n {
            let (start, density) = aim.start(point(1 << 40 | i));
            // At the faces of boxes single precision decides which one it is.
            at_faces += (density != aim.density(&start)) as u32;
            let hit = meets(&start, 0.0003);
            hits += hit as u32;
            sum += if hit { 1.0 / density as f64 } else { 0.0 };
        }
        assert!(at_faces < 100, "{at_faces} of {n}");
        // 3.6e-7 of the cube; no hit counts more than a few times another.
        assert!(hits as u64 > n / 3, "{hits} of {n}");
        assert!((sum / n as f64 / 3.6e-7 - 1.0).abs() < 0.05, "{}", sum / n as f64);
    }

    #[test]
    fn nothing_learnt_is_no_preference() {
        let aim = Aim::learn(vec![Trial { start: [0.5; 5], use_: 0.0 }]);
        assert!(aim.is_empty());
        assert_eq!(aim.start([0.1, 0.2, 0.3, 0.4, 0.5]), ([0.1, 0.2, 0.3, 0.4, 0.5], 1.0));
    }
}
