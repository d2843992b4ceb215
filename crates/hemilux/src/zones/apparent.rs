//! Where the middle of a luminaire is seen behind flat surfaces, as one light particle tells it.
//!
//! A particle that comes to a point through panes, prisms or a rippled pool of flat pieces left some point of the luminaire, not its middle, and
//! refraction moves what is seen nearer or farther. Both are known along the way: each plane scales the distance by the ratio of the
//! indices (the sagittal image of the Coddington equations, exact for rays beside one another across the plane of incidence) and turns what
//! lies aside as it turns the way. So a single record says where the image is and how large, where many different chains leave one record each.
//!
//! Invariant: with mirrors alone the image is that of [`super::records::Exact`].

use crate::bsdf::BsdfSample;
use crate::world::Surface;
use glam::Quat;
use hemilux_scene::geom::Vec3;

/// The source as it is seen from where the way has come, back along it.
#[derive(Clone, Copy)]
pub(super) struct Apparent {
    /// How far away it seems (m): refraction at a plane brings what is seen nearer or takes it farther by the ratio of the indices, for
    /// rays beside one another across the plane of incidence.
    pub distance: f32,
    /// From where the way began to the middle of the source, turned as the way was (m).
    pub aside: Vec3,
}

impl Apparent {
    /// Through a plane at `s`, or mirrored in it, and on along unit `on`.
    pub fn pass(self, s: &Surface, on: Vec3, next: &BsdfSample) -> Apparent {
        let distance = self.distance + s.t;
        match next.transmitted {
            true => Apparent {
                distance: distance * next.eta,
                aside: Quat::from_rotation_arc(-s.wo, on) * self.aside,
            },
            false => Apparent { distance, aside: self.aside - s.ng * (2.0 * s.ng.dot(self.aside)) },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::records::{Cones, Record, Records};
    use super::super::{Making, ZoneOptions};
    use crate::bsdf::Transport;
    use crate::validate::scenes::{diffuse, emission, empty, material, quad, sphere};
    use crate::world::World;
    use hemilux_scene::geom::Vec3;
    use hemilux_scene::{FloatParam, MaterialKind, Roughness};

    const RADIUS: f32 = 0.2;

    /// A floor under sloping water, a lamp above.
    fn pool() -> World {
        let mut scene = empty();
        let floor = diffuse(&mut scene, 0.5);
        let smooth = Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: false };
        let water = material(&mut scene, MaterialKind::Dielectric { eta: 1.33, roughness: smooth });
        quad(&mut scene, [-3.0, -3.0, 0.0], [6.0, 0.0, 0.0], [0.0, 6.0, 0.0], floor, None);
        quad(&mut scene, [-3.0, -3.0, 0.5], [6.0, 0.0, 0.6], [0.0, 6.0, -0.4], water, None);
        sphere(&mut scene, [0.4, 0.2, 3.0], RADIUS as f64, false, floor, emission(10.0));
        World::new(scene)
    }

    /// The mean of the directions around `axis` from `x` that lead to the lamp through the water, and their solid angle.
    fn lamp_from(world: &World, x: Vec3, axis: Vec3) -> (Vec3, f32) {
        let (s, t) = axis.any_orthonormal_pair();
        let (n, wide) = (60, 4.0 * RADIUS / 3.0);
        let (mut sum, mut count) = (Vec3::ZERO, 0);
        for i in 0..n * n {
            let on = |k: i32| ((k as f32 + 0.5) / n as f32 - 0.5) * wide;
            let w = (axis + s * on(i % n) + t * on(i / n)).normalize();
            let surface = world.closest(x, w, f32::INFINITY).expect("the water");
            let through = world
                .bsdf(&surface)
                .branches(surface.frame.to_local(surface.wo), Transport::Radiance)
                .find(|b| b.transmitted);
            let Some(through) = through else { continue };
            let on = surface.frame.to_world(through.wi).normalize();
            let met = world.closest(surface.leave(on), on, f32::INFINITY);
            if met.is_some_and(|s| s.p.z > 2.0) {
                (sum, count) = (sum + w, count + 1);
            }
        }
        (sum.normalize(), count as f32 * (wide / n as f32).powi(2))
    }

    #[test]
    fn one_particle_tells_the_middle_of_the_lamp_behind_water() {
        let world = pool();
        let mut making = Making::new(&world, &ZoneOptions { budget: 100, particles: 1 << 14, seed: 1 }, None);
        making.trace(1 << 14, |_| false);
        let finds = &making.deposits.finds;
        let near = |r: &&Record| r.p.z < 1e-3 && r.p.length() < 1.0;
        let (mut asked, mut close, mut fakes) = (0, 0, 0);
        for r in finds.records.iter().filter(near).take(60) {
            let (middle, solid_angle) = lamp_from(&world, r.p + Vec3::Z * 1e-4, r.dir);
            let radius = (solid_angle / std::f32::consts::PI).sqrt();
            let holds = |r: Record| {
                let records = Records::new(vec![r], &finds.exact);
                let cones = Cones::new(&records, r.p, r.n);
                let (axis, height, _) = cones.iter().next().expect("a cone");
                let larger = std::f32::consts::TAU * height / solid_angle;
                (axis - middle).length() < 0.15 * radius && (1.0..1.6).contains(&larger)
            };
            asked += 1;
            close += holds(*r) as u32;
            // The fake takes the point that the particle left for the middle.
            fakes += holds(Record { aside: None, ..*r }) as u32;
        }
        assert!(asked == 60 && close >= 57 && fakes < 12, "{close} and, by the fake, {fakes} of {asked}");
    }
}
