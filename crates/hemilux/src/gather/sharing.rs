//! Residuals that the gathers of neighbouring pixels share (mode corrected).
//!
//! A residual costs a hundred rays, and what it says of the place where a gather ray ended holds for every gather that sees that place. So
//! each goes to all gathers of a block of pixels: P. Bekaert, M. Sbert and J. Halton, "Accelerating path tracing by re-using paths" (2002), with
//! the balance heuristic (E. Veach 1997) over the densities with which the gathers would have taken it there. In area measure at the place y, gather k
//! receives f_k · r · c_k / Σ_j d_j q_j c_j, where f is BRDF × cosine, r the residual towards it, c the cosine at y over the squared distance,
//! d the rays per steradian and q the residuals per ray, and the sum goes over all gathers whose own ray would have ended so: that see y
//! straight, from far enough to trust its zone. With one gather it is f r / (d q).
//!
//! Invariant: whether a gather takes part at y depends on y and on the gather alone, never on who found it. So no mean changes. What comes by
//! mirrors or glass, and what is not diffuse in the same way to all sides ([`Bsdf::diffuse_view`]), is not shared.

use super::Point;
use crate::bsdf::{Bsdf, Transport as Quantity};
use crate::transport::{Tally, ZONE_TRUST};
use crate::world::Surface;
use crate::zones::map::ZonePlace;
use hemilux_scene::Rgb;

/// Residuals at the end of one gather ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    /// Where.
    pub s: Surface,
    pub bsdf: Bsdf,
    pub place: ZonePlace,
    /// Sum of path less zone, surface radiance per unit of [`Bsdf::diffuse_view`].
    pub residual: Rgb,
    /// What the zone is expected to send (luminance), in the same unit.
    pub expected: f32,
    /// Rays per steradian of the gather ray that found it.
    pub density: f32,
}

/// A gather that takes part in what was found somewhere.
#[derive(Clone, Copy, Debug)]
struct Share {
    /// f · c, times the view of the place from here.
    value: Rgb,
    /// d · q · c.
    density: f32,
}

/// What number `from` of `gathers` has found, for each that takes part: `give` gets its number and the surface radiance to add. Only those
/// that `are_together` share with one another; it is an equivalence.
pub(crate) fn share(
    gathers: &[Point],
    from: usize,
    found: &Found,
    are_together: impl Fn(usize, usize) -> bool,
    tally: &mut Tally,
    give: impl FnMut(usize, Rgb),
) {
    let sees = |k: usize| {
        tally.rays += 1;
        gathers[k].sees(&found.s)
    };
    deal(gathers, from, found, are_together, sees, give);
}

/// The same, where gather k `sees` the place. `from` does.
fn deal(
    gathers: &[Point],
    from: usize,
    found: &Found,
    are_together: impl Fn(usize, usize) -> bool,
    mut sees: impl FnMut(usize) -> bool,
    mut give: impl FnMut(usize, Rgb),
) {
    let (mut shares, mut density) = (Vec::with_capacity(gathers.len().min(32)), 0.0);
    for (k, gather) in gathers.iter().enumerate().filter(|(k, _)| are_together(from, *k)) {
        let own = (k == from).then_some(found.density);
        let Some(share) = gather.share_of(found, own).filter(|_| own.is_some() || sees(k)) else { continue };
        density += share.density;
        shares.push((k, share.value));
    }
    if density > 0.0 {
        for (k, value) in shares {
            give(k, value * found.residual * (1.0 / density));
        }
    }
}

impl Point<'_> {
    /// Its share of what was found, unless something stands between; `own`: the density of its ray, if it has found it itself.
    #[inline]
    fn share_of(&self, found: &Found, own: Option<f32>) -> Option<Share> {
        let (y, to) = (&found.s, found.s.p - self.s.p);
        let far = to.length();
        let w = to / far;
        if own.is_none() && (far < ZONE_TRUST * found.place.radius || y.is_front(-w) != y.is_front(y.wo)) {
            return None;
        }
        let (wi, wo) = (self.s.frame.to_local(w), y.frame.to_local(-w));
        if self.s.is_front(w) != (wi.z > 0.0) || (wo.z > 0.0) != (y.frame.n.dot(y.wo) > 0.0) {
            return None;
        }
        let f = self.bsdf.eval(self.wo, wi, Quantity::Radiance) * wi.z.abs();
        let density = own.unwrap_or_else(|| self.density(w, wi));
        if f.is_black() || density <= 0.0 {
            return None;
        }
        let view = found.bsdf.diffuse_view(wo)?;
        let q = self.walker.residuals(self.worth(f, density) * found.expected * view, self.worth > 0.0);
        let cosine = y.ng.dot(w).abs() / (far * far);
        Some(Share { value: f * (view * cosine), density: density * q * cosine })
    }

    /// Whether nothing stands between it and `y`.
    fn sees(&self, y: &Surface) -> bool {
        let origin = self.s.leave((y.p - self.s.p).normalize());
        let to = y.leave(origin - y.p) - origin;
        let far = to.length();
        !self.walker.world.occluded(origin, to / far, far)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::{GatherPlan, Part, Strategy};
    use crate::sampler::Sampler;
    use crate::transport::{Residual, Walker};
    use crate::validate::scenes::{diffuse, emission, empty, quad};
    use crate::world::World;
    use crate::zones::{ZoneOptions, Zones};
    use hemilux_scene::geom::Vec3;

    /// A floor under a lit ceiling, from which a wall hangs down to half a metre: points of the floor see different parts of the ceiling.
    fn world() -> World {
        let mut scene = empty();
        let grey = diffuse(&mut scene, 0.7);
        quad(&mut scene, [-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0], grey, None);
        quad(&mut scene, [-2.0, -2.0, 2.0], [0.0, 4.0, 0.0], [4.0, 0.0, 0.0], grey, None);
        quad(&mut scene, [0.0, -2.0, 0.5], [0.0, 4.0, 0.0], [0.0, 0.0, 1.5], grey, None);
        quad(&mut scene, [0.6, -0.3, 0.7], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0], grey, emission(10.0));
        World::new(scene)
    }

    /// Means and their standard errors at four points, with residuals dealt out by `sees` (given the true answer), or each to its own.
    fn readings(world: &World, zones: &Zones, sees: Option<&dyn Fn(bool) -> bool>) -> Vec<(f64, f64)> {
        let walker =
            Walker { residual: Residual::new(0.5), sharing: sees.is_some(), ..Walker::zonal(world, zones) };
        let plan = GatherPlan { rays: 16, shadow_rays: 2, strategy: Strategy::Adaptive };
        let down = |x: f32| world.closest(Vec3::new(x, 0.1, 0.1), -Vec3::Z, 1.0).expect("the floor");
        let floor = [-0.7, -0.2, 0.2, 0.7].map(down);
        let bsdfs = floor.map(|s| world.bsdf(&s));
        let (mut sums, mut squares) = ([0f64; 4], [0f64; 4]);
        let n = 4000;
        for i in 0..n {
            let mut tally = Tally::default();
            let (mut values, mut points, mut until) = ([Rgb::BLACK; 4], Vec::new(), Vec::new());
            for k in 0..4 {
                let mut sampler = Sampler::new(5, i * 4 + k as u64, 0);
                let point = Point::new(&walker, &floor[k], &bsdfs[k], &plan, Part::WHOLE);
                values[k] = point.gather(&mut sampler, &mut tally).whole;
                points.push(point);
                until.push(tally.found.len());
            }
            let mut next = 0;
            for (from, until) in until.into_iter().enumerate() {
                for found in &tally.found[next..until] {
                    let sees = |k: usize| sees.is_some_and(|sees| sees(points[k].sees(&found.s)));
                    deal(&points, from, found, |_, _| true, sees, |k, more| values[k] += more);
                }
                next = until;
            }
            for k in 0..4 {
                let v = values[k].luminance() as f64;
                (sums[k], squares[k]) = (sums[k] + v, squares[k] + v * v);
            }
        }
        let n = n as f64;
        (0..4).map(|k| (sums[k] / n, ((squares[k] / n - (sums[k] / n).powi(2)) / n).sqrt())).collect()
    }

    /// Shared residuals say what residuals of one's own say, with less noise. By the fake, everyone sees everything.
    #[test]
    fn sharing_changes_no_mean() {
        let world = world();
        let zones = Zones::solve(&world, &ZoneOptions { particles: 3000, seed: 2, budget: 150 });
        let own = readings(&world, &zones, None);
        let shared = readings(&world, &zones, Some(&|sees| sees));
        let fake = readings(&world, &zones, Some(&|_| true));
        let z = |a: &[(f64, f64)]| {
            let one = |(a, b): (&(f64, f64), &(f64, f64))| (a.0 - b.0) / a.1.hypot(b.1);
            a.iter().zip(&own).map(one).fold(0f64, |m, z| m.max(z.abs()))
        };
        println!("own {own:?}\nshared {shared:?}: {}\nfake {fake:?}: {}", z(&shared), z(&fake));
        // |z| < 4.4, four times: false alarm 4e-5.
        assert!(z(&shared) < 4.4, "{shared:?}, own {own:?}");
        assert!(z(&fake) > 6.0, "the fake passes: {fake:?}, own {own:?}");
        let noise = |a: &[(f64, f64)]| a.iter().map(|v| v.1 * v.1).sum::<f64>();
        // Most of it is that of the gathers.
        assert!(noise(&shared) < 0.8 * noise(&own), "{} and {}", noise(&shared), noise(&own));
    }
}
