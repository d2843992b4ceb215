//! The camera's specular tree: mirrors and glass that it sees, followed both ways at each interface.
//!
//! Unbiased: what is left out by chance counts as much more where it stays (Russian roulette, J. Arvo and D. Kirk 1990).

use super::Renderer;
use crate::bsdf::Bsdf;
use crate::sampler::Sampler;
use crate::transport::{Arrival, Tally};
use crate::world::Surface;
use crate::world::camera::CameraRay;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;

/// A branch of the camera's specular tree counts at least this much where it ends in a gather, or survives by roulette; ...
const THINNEST_BRANCH: f32 = 0.05;
/// ... and this much where something shines: twice reflected by glass.
const FAINTEST_BRANCH: f32 = 1e-3;
/// Branches waiting at once.
const MOST_BRANCHES: usize = 16;
/// Specular events from the camera; cut off beyond with less than 1e-6 of the radiance in any real scene.
const LONGEST_CHAIN: u32 = 128;

/// Part of the camera's specular tree that is still to be followed.
struct Stem {
    origin: Vec3,
    dir: Vec3,
    hit: Option<Surface>,
    /// What counts of what shines there, and of what is scattered there.
    shines: Rgb,
    scatters: Rgb,
    depth: u32,
}

/// What a branch counts: 1 if it is no thinner than `thinnest` and not `crowded` out; otherwise it is left to chance, 0 or as much more.
fn survives(strength: f32, thinnest: f32, crowded: bool, sampler: &mut Sampler) -> f32 {
    if strength >= thinnest && !crowded {
        return 1.0;
    }
    let survive = (strength / thinnest).clamp(0.02, 0.9);
    if sampler.next1() < survive { 1.0 / survive } else { 0.0 }
}

impl Renderer<'_> {
    /// Follow mirrors and glass from the camera, both ways at each interface: call `scatters` wherever something scatters otherwise,
    /// with what the way there leaves, and return what shines on the way. Chance decides about thin branches where something scatters
    /// (a gather is dear, and what it brings is known to be weak); what shines may be a thousand times brighter, so it is asked along thinner ones.
    pub(super) fn specular_tree(
        &self,
        ray: &CameraRay,
        first: Option<Surface>,
        scatters: &mut impl FnMut(&Surface, &Bsdf, Rgb, &mut Sampler, &mut Tally),
        sampler: &mut Sampler,
        tally: &mut Tally,
    ) -> Rgb {
        let walker = self.walker();
        let stem = Stem {
            origin: ray.origin,
            dir: ray.dir,
            hit: first,
            shines: Rgb::WHITE,
            scatters: Rgb::WHITE,
            depth: 0,
        };
        let mut waiting = vec![stem];
        let mut radiance = Rgb::BLACK;
        while let Some(stem) = waiting.pop() {
            let Some(s) = stem.hit else {
                radiance += stem.shines * walker.sky(stem.origin, stem.dir, Arrival::Full);
                continue;
            };
            radiance += stem.shines * walker.emission(&s, Arrival::Full);
            let bsdf = self.world.bsdf(&s);
            if bsdf.has_non_delta() && !stem.scatters.is_black() {
                scatters(&s, &bsdf, stem.scatters, sampler, tally);
            }
            if !bsdf.has_delta() || stem.depth >= LONGEST_CHAIN {
                continue;
            }
            let wo = s.frame.to_local(s.wo);
            for lobe in bsdf.lobes() {
                for branch in lobe.branches(wo, crate::bsdf::Transport::Radiance).into_iter().flatten() {
                    let wi = s.frame.to_world(branch.wi).normalize();
                    let (shines, scatters) = (stem.shines * branch.weight, stem.scatters * branch.weight);
                    let crowded = waiting.len() >= MOST_BRANCHES;
                    let shines = shines * survives(shines.max(), FAINTEST_BRANCH, crowded, sampler);
                    if shines.is_black() || s.is_front(wi) != (branch.wi.z > 0.0) {
                        continue;
                    }
                    let scatters = match scatters.is_black() {
                        true => scatters,
                        false => scatters * survives(scatters.max(), THINNEST_BRANCH, crowded, sampler),
                    };
                    tally.rays += 1;
                    let origin = s.leave(wi);
                    let hit = self.world.closest(origin, wi, f32::INFINITY);
                    waiting.push(Stem { origin, dir: wi, hit, shines, scatters, depth: stem.depth + 1 });
                }
            }
        }
        radiance
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::{GatherPlan, Strategy};
    use crate::render::{Mode, RenderOptions};
    use crate::validate::scenes::{cuboid, diffuse, empty, material, sphere};
    use crate::world::World;
    use hemilux_scene::{FloatParam, MaterialKind, Roughness};

    /// Through a glass ball in a room: what all branches count sums to 1 in the mean, and no gather counts more than what arrives. Were gathers
    /// along thin branches let live by what shines there, they would count many times as much.
    #[test]
    fn thin_branches_count_no_more_than_what_arrives() {
        let mut scene = empty();
        let wall = diffuse(&mut scene, 0.5);
        let roughness =
            Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
        let glass = material(&mut scene, MaterialKind::Dielectric { eta: 1.5, roughness });
        cuboid(&mut scene, [-3.0; 3], [3.0; 3], true, wall);
        sphere(&mut scene, [0.0; 3], 1.0, false, glass, None);
        let world = World::new(scene);
        let plan = GatherPlan { rays: 1, shadow_rays: 1, strategy: Strategy::Sobol };
        let options = RenderOptions { mode: Mode::Zonal, plan, seed: 0, max_depth: u32::MAX };
        let renderer = Renderer::new(&world, None, 8, 8, options);
        let (mut sum, mut squares, mut largest) = (0.0f64, 0.0f64, 0.0f32);
        let n = 20_000;
        for i in 0..n {
            let mut sampler = Sampler::new(1, i, 0);
            let [u, v] = sampler.next2();
            let origin = Vec3::new(-2.0, 1.9 * (u - 0.5), 1.9 * (v - 0.5));
            let ray = CameraRay { origin, dir: Vec3::X, weight: 1.0 };
            let first = world.closest(ray.origin, ray.dir, f32::INFINITY);
            let mut all = 0.0;
            let mut scatters = |_: &Surface, _: &Bsdf, beta: Rgb, _: &mut Sampler, _: &mut Tally| {
                (all, largest) = (all + beta.max(), largest.max(beta.max()));
            };
            renderer.specular_tree(&ray, first, &mut scatters, &mut sampler, &mut Tally::default());
            (sum, squares) = (sum + all as f64, squares + (all as f64).powi(2));
        }
        let mean = sum / n as f64;
        let error = ((squares / n as f64 - mean * mean) / n as f64).sqrt();
        // |z| < 4: false alarm 6e-5.
        assert!((mean - 1.0).abs() < 4.0 * error, "{mean} ± {error}");
        assert!(largest < 1.01, "{largest}");
    }
}
