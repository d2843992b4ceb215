//! Glances: camera rays beside those that gather, which know at little cost what a pixel spans.
//!
//! A pixel on an edge, or on a texture, varies more than its gathers are noisy. So a camera sample takes [`COUNT`] rays. All of them
//! ask what shines, and what is *expected* of the surfaces they meet: diffuse albedo times [broad irradiance](crate::zones::broad).
//! [`PLACES`] of them gather (all, where what they expect is too [steep](are_steep)), each a part of one gather's rays ([`crate::gather::Part`]). The sample is the mean of what is expected, plus what was
//! gathered less what was expected there: a control variate, so its mean does not depend on what is expected, whatever that is.
//!
//! Surfaces that several rays meet close together in one plane share one expected irradiance, the mean of theirs: steps
//! between boxes of the broad irradiance do not show, and only albedo differs. What is expected of one ray thus depends on the others. That
//! is no bias as long as, given all rays, those that gather are any of the ways to choose them with equal probability. So it is on
//! a lattice shifted by a uniform point, which looks the same from each of its points; those that gather are a lattice within it.
//!
//! Where mirrors or glass are curved, lamps are seen small and in many places; glances there ask what shines at a few more places around
//! ([`mean_around`]).
//!
//! Invariant: [`expected_more`] of the same surfaces, with each glance in turn as the first, sums to nothing.

use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// Camera rays of a sample.
pub const COUNT: usize = 8;
/// How many of them gather, each with its part of the rays. Divides [`COUNT`].
pub const PLACES: u32 = 2;
/// Steps from one to the next on the unit torus, in units of 1 / COUNT.
const STEP: [u32; 2] = [1, 3];
/// How far apart they are, about.
const APART: f32 = 0.35;
/// Places around a glance that is worth more of them. (Of 1, 3 and 7 on the glass ball of a picture, 3 was the best for its time.)
pub const AROUND: usize = 3;
/// More surfaces than this in a sample do not share.
const MOST: usize = 64;
/// No glance expects more than so many times what another one does.
const STEEPEST: f32 = 4.0;
/// Cosine between normals of one plane.
const PARALLEL: f32 = 0.99;
/// Slope of the line between two points of one plane.
const SLOPE: f32 = 0.1;

/// A surface that a glance met, straight or by mirrors and glass.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Which glance.
    pub glance: u32,
    /// Where (m).
    pub p: Vec3,
    /// Normal on its side, unit.
    pub n: Vec3,
    /// Within this distance it shares with others (m).
    pub reach: f32,
    /// Radiance of the pixel per irradiance (sr⁻¹).
    pub weight: Rgb,
    /// Expected irradiance (W·m⁻²).
    pub irradiance: Rgb,
}

impl Seen {
    fn is_beside(&self, other: &Seen) -> bool {
        let d = other.p - self.p;
        let far = d.length();
        let reach = self.reach.min(other.reach);
        self.n.dot(other.n) > PARALLEL
            && far <= reach
            && self.n.dot(d).abs().max(other.n.dot(d).abs()) <= SLOPE * far
    }
}

/// Glance `k` of the one at `u`, on the unit torus.
pub fn place(u: [f32; 2], k: u32) -> [f32; 2] {
    let n = COUNT as u32;
    [0, 1].map(|i: usize| (u[i] + (k * STEP[i] % n) as f32 / n as f32).fract())
}

/// The mean of `own`, found at `u` of the unit torus, and of what is found by short steps from there. `at`: what is found at a place, if that is
/// as `u` is; otherwise the step stays and counts as `u` does. Each is a step of N. Metropolis and others (1953): it leaves points that are even
/// over all that is alike as even as they were, so the mean of the whole stays, whatever is alike.
pub fn mean_around(
    u: [f32; 2],
    own: Rgb,
    steps: [[f32; 2]; AROUND],
    mut at: impl FnMut([f32; 2]) -> Option<Rgb>,
) -> Rgb {
    let to = |step: [f32; 2]| [0, 1].map(|i: usize| (u[i] + (step[i] - 0.5) * APART).rem_euclid(1.0));
    let sum = steps.into_iter().fold(own, |sum, step| sum + at(to(step)).unwrap_or(own));
    sum * (1.0 / (AROUND + 1) as f32)
}

/// Whether glance `k` gathers where `places` of them do. Any of the ways to choose them is as likely as another, for they are a lattice too.
pub fn gathers(k: u32, places: u32) -> bool {
    k.is_multiple_of(COUNT as u32 / places)
}

/// Whether those of the glances that would gather in `places` places do not see the same surfaces, close together in one plane each. The same from
/// each of them, so gathering in fewer places where they do not differ moves no mean.
pub fn differ(seen: &[Seen], places: u32) -> bool {
    let of = |k: u32| seen.iter().filter(move |s| s.glance == k);
    (0..COUNT as u32)
        .filter(|k| *k > 0 && gathers(*k, places))
        .any(|k| of(0).count() != of(k).count() || !of(0).zip(of(k)).all(|(a, b)| a.is_beside(b)))
}

/// What each glance expects; `seen` share it afterwards.
fn expected(seen: &mut [Seen]) -> [Rgb; COUNT] {
    share(seen);
    let mut each = [Rgb::BLACK; COUNT];
    for s in seen.iter() {
        each[s.glance as usize] += s.weight * s.irradiance;
    }
    each
}

/// The least that one of them expects, of those that expect anything.
fn least(each: &[Rgb; COUNT]) -> f32 {
    each.iter().map(|e| e.luminance()).filter(|l| *l > 0.0).fold(f32::INFINITY, f32::min)
}

/// Whether one of the glances expects so much more than another that [`expected_more`] does not believe it: a few places would tell little of such a
/// pixel. The same from each of them.
pub fn are_steep(seen: &mut [Seen]) -> bool {
    let each = expected(seen);
    let most = STEEPEST * least(&each);
    each.iter().any(|e| e.luminance() > most)
}

/// What is expected of the mean of all glances, less what is expected of the mean of the `places` that gather.
pub fn expected_more(seen: &mut [Seen], places: u32) -> Rgb {
    let mut each = expected(seen);
    // Beside a shadow's edge a zone may promise many times what is there.
    let most = STEEPEST * least(&each);
    for e in &mut each {
        if e.luminance() > most {
            *e *= most / e.luminance();
        }
    }
    // By differences, so that glances that see the same leave exactly nothing.
    let (all, there) = (1.0 / COUNT as f32, 1.0 / places as f32);
    let weight = |k: u32| if gathers(k, places) { all - there } else { all };
    (1..COUNT as u32).fold(Rgb::BLACK, |sum, k| sum + (each[k as usize] - each[0]) * weight(k))
}

/// Give all that lie in one plane, each beside another, the mean of their irradiances.
fn share(seen: &mut [Seen]) {
    let n = seen.len();
    if n > MOST {
        return;
    }
    let mut group = [0u8; MOST];
    for (i, g) in group.iter_mut().enumerate() {
        *g = i as u8;
    }
    for i in 1..n {
        for j in 0..i {
            let (a, b) = (group[i], group[j]);
            if a != b && seen[i].is_beside(&seen[j]) {
                group[..n].iter_mut().filter(|g| **g == a.max(b)).for_each(|g| *g = a.min(b));
            }
        }
    }
    let mut sums = [(Rgb::BLACK, 0u32); MOST];
    for (s, g) in seen.iter().zip(group) {
        let (sum, count) = &mut sums[g as usize];
        (*sum, *count) = (*sum + s.irradiance, *count + 1);
    }
    for (s, g) in seen.iter_mut().zip(group) {
        let (sum, count) = sums[g as usize];
        s.irradiance = sum * (1.0 / count as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::Key;

    /// A lattice looks the same from each of its points; steps that are no lattice do not.
    #[test]
    fn glances_look_alike_from_each_of_them() {
        let set = |of: &dyn Fn(u32) -> [f32; 2]| {
            let mut all: Vec<[i32; 2]> =
                (0..COUNT as u32).map(|k| of(k).map(|x| (x * 1024.0).round() as i32)).collect();
            all.sort_unstable();
            all
        };
        let u = [0.125, 0.3125];
        let from_first = set(&|k| place(u, k));
        assert!(from_first.windows(2).all(|w| w[0] != w[1]));
        let none_lattice =
            |u: [f32; 2], k: u32| [0.0, 0.05].map(|s| (u[0] + (k * k) as f32 * 0.0625 + s).fract());
        let mut differ = 0;
        for j in 0..COUNT as u32 {
            assert_eq!(set(&|k| place(place(u, j), k)), from_first);
            differ += (set(&|k| none_lattice(none_lattice(u, j), k)) != set(&|k| none_lattice(u, k))) as u32;
        }
        assert!(differ > 0, "the control passes");
    }

    /// A bright spot in a disk that is worth more places. By the fake, steps that leave the disk find nothing.
    #[test]
    fn more_places_change_no_mean() {
        let is_alike = |u: [f32; 2]| (u[0] - 0.4).hypot(u[1] - 0.5) < 0.3;
        // At the rim of the disk, where steps lead out of it.
        let found = |u: [f32; 2]| Rgb::splat(if (u[0] - 0.67).hypot(u[1] - 0.5) < 0.06 { 50.0 } else { 1.0 });
        let n = 200_000;
        let mean = |estimate: &dyn Fn([f32; 2], [[f32; 2]; AROUND]) -> f32| {
            let one = |i: u32| {
                let x = |d: u32| Key::new(3).with(i as u64).uniform(d);
                let steps = std::array::from_fn(|k| [x(2 + 2 * k as u32), x(3 + 2 * k as u32)]);
                let u = [x(0), x(1)];
                (if is_alike(u) { estimate(u, steps) } else { 0.0 }) as f64
            };
            let values: Vec<f64> = (0..n).map(one).collect();
            let mean = values.iter().sum::<f64>() / n as f64;
            let squares = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64;
            (mean, squares, (squares / n as f64).sqrt())
        };
        let alike = |u: [f32; 2]| is_alike(u).then(|| found(u));
        let (plain, variance, error) = mean(&|u, _| found(u).0[0]);
        let (more, less, smaller) = mean(&|u, steps| mean_around(u, found(u), steps, alike).0[0]);
        // |z| < 4: false alarm 6e-5.
        assert!((more - plain).abs() < 4.0 * error.hypot(smaller), "{more} and {plain}");
        assert!(less < 0.6 * variance, "{less} of {variance}");
        let (fake, _, error) = mean(&|u, steps| {
            mean_around(u, found(u), steps, |to| Some(alike(to).unwrap_or(Rgb::BLACK))).0[0]
        });
        assert!((fake - plain).abs() > 4.0 * error, "the fake passes: {fake} and {plain}");
    }

    fn surfaces(key: Key) -> Vec<Seen> {
        (0..COUNT as u32 * 2)
            .map(|i| {
                let x = |d: u32| key.with(i as u64).uniform(d);
                // Two planes, some of the points close together.
                let p = Vec3::new(x(0), x(1), (i % 2) as f32);
                let (weight, irradiance) = (Rgb([x(2), x(3), 0.5]), Rgb([x(4), 1.0, x(5)]));
                Seen { glance: i / 2, p, n: Vec3::Z, reach: 0.4, weight, irradiance }
            })
            .collect()
    }

    /// The same surfaces with glance `j` as the one that gathers.
    fn from(j: u32, seen: &[Seen]) -> Vec<Seen> {
        let n = COUNT as u32;
        let turned = |s: &Seen| Seen { glance: (s.glance + n - j) % n, ..*s };
        let mut turned: Vec<Seen> = seen.iter().map(turned).collect();
        turned.sort_by_key(|s| s.glance);
        turned
    }

    #[test]
    fn what_is_expected_changes_no_mean() {
        for seed in 0..50 {
            let seen = surfaces(Key::new(seed));
            let all = |expected: &dyn Fn(&mut [Seen]) -> Rgb| {
                (0..COUNT as u32).fold(Rgb::BLACK, |sum, j| sum + expected(&mut from(j, &seen)))
            };
            for places in [1, 2, 4, 8] {
                let sum = all(&|seen| expected_more(seen, places));
                assert!(sum.0.iter().all(|v| v.abs() < 2e-5), "{sum:?}");
            }
            // The fake: everything shares what the gathering glance expects.
            let fake = all(&|seen| {
                let first = seen[0].irradiance;
                seen.iter_mut().for_each(|s| s.irradiance = first);
                let mean = 1.0 / COUNT as f32;
                seen.iter().fold(Rgb::BLACK, |sum, s| {
                    sum + s.weight * s.irradiance * if s.glance == 0 { mean - 1.0 } else { mean }
                })
            });
            assert!(fake.0.iter().any(|v| v.abs() > 1e-3), "the fake passes: {fake:?}");
        }
    }

    /// Gathering in one place where two would see the same, or in all where they are steep. The fake asks whether the surface at one of them alone is near something.
    #[test]
    fn fewer_places_change_no_mean() {
        let mut counts = [0; 2];
        let mut worst = [0f32; 2];
        let mut all_steep = 0;
        for seed in 0..200 {
            let seen = surfaces(Key::new(seed));
            let sum = |differ: &mut dyn FnMut(&[Seen]) -> bool| {
                (0..COUNT as u32).fold(Rgb::BLACK, |sum, j| {
                    let mut seen = from(j, &seen);
                    let places = if differ(&seen) { 2 } else { 1 };
                    sum + expected_more(&mut seen, places)
                })
            };
            let right = sum(&mut |seen| {
                counts[differ(seen, 2) as usize] += 1;
                differ(seen, 2)
            });
            let steep = (0..COUNT as u32).fold(Rgb::BLACK, |sum, j| {
                let mut seen = from(j, &seen);
                let places = if are_steep(&mut seen.clone()) { COUNT as u32 } else { 2 };
                all_steep += (places != 2) as u32;
                sum + expected_more(&mut seen, places)
            });
            let fake = sum(&mut |seen| seen[0].p.x > 0.5);
            let most = |v: Rgb| v.0.iter().fold(0f32, |m, v| m.max(v.abs()));
            worst = [worst[0].max(most(right)).max(most(steep)), worst[1].max(most(fake))];
        }
        assert!(counts.iter().all(|c| *c > 50), "{counts:?}");
        assert!((50..1550).contains(&all_steep), "{all_steep}");
        assert!(worst[0] < 2e-5 && worst[1] > 1e-2, "{worst:?}");
    }

    #[test]
    fn neighbours_in_a_plane_share_and_others_do_not() {
        let at = |x: f32, z: f32, irradiance: f32| Seen {
            glance: 0,
            p: Vec3::new(x, 0.0, z),
            n: Vec3::Z,
            reach: 0.1,
            weight: Rgb::WHITE,
            irradiance: Rgb::splat(irradiance),
        };
        let mut seen = [
            at(0.0, 0.0, 1.0),
            at(0.08, 0.0, 3.0),
            at(0.16, 0.0, 8.0),
            at(0.02, 0.05, 7.0),
            at(1.0, 0.0, 5.0),
        ];
        share(&mut seen);
        assert_eq!(seen.map(|s| s.irradiance.0[0]), [4.0, 4.0, 4.0, 7.0, 5.0]);
    }
}
