//! What the eye sees, coarsely: surfaces that matter to a picture or to sensors, directly or after a few scatterings.
//!
//! The importance of B. Smits, J. Arvo and D. Salesin 1992, reduced to a yes or no per voxel and facing. It steers where
//! particles are sent; it never enters an estimate.

use super::kd::facing;
use crate::bsdf::Transport;
use crate::world::World;
use crate::world::camera::Lens;
use hemilux_scene::geom::Vec3;
use hemiquad::points::Key;

/// Voxels along the longest side.
const VOXELS: usize = 48;
/// Scatterings that are followed.
const BOUNCES: u32 = 2;
/// Specular events that are followed between them.
const LONGEST_CHAIN: u32 = 16;
/// Camera rays across and down.
const GRID: u32 = 96;

/// Which places matter.
#[derive(Clone, Debug)]
pub struct Sight {
    low: Vec3,
    scale: f32,
    seen: Vec<bool>,
}

impl Sight {
    /// From the scene's camera.
    pub fn of_camera(world: &World) -> Sight {
        let lens = Lens::new(&world.scene, GRID, GRID);
        Sight::new(
            world,
            (0..GRID * GRID).map(|i| {
                let key = Key::new(0x51_6874).with(i as u64);
                let (film, on_lens) = (key.uniform2(0), key.uniform2(1));
                let ray = lens.ray(i % GRID, i / GRID, [film.u, film.v], [on_lens.u, on_lens.v]);
                (ray.origin, ray.dir)
            }),
        )
    }

    /// From rays that look.
    pub fn new(world: &World, rays: impl Iterator<Item = (Vec3, Vec3)>) -> Sight {
        let (centre, radius) = world.bound();
        let low = centre - Vec3::splat(radius);
        let mut sight =
            Sight { low, scale: VOXELS as f32 / (2.0 * radius), seen: vec![false; VOXELS.pow(3) * 6] };
        for (i, (origin, dir)) in rays.enumerate() {
            sight.look(world, origin, dir, Key::new(0x51_6875).with(i as u64));
        }
        sight
    }

    fn look(&mut self, world: &World, mut origin: Vec3, mut dir: Vec3, key: Key) {
        let (mut bounces, mut chain) = (0, 0);
        for d in 0.. {
            let Some(s) = world.closest(origin, dir, f32::INFINITY) else { return };
            let bsdf = world.bsdf(&s);
            if bsdf.has_non_delta() {
                let index = self.index(s.p, s.facing());
                self.seen[index] = true;
            }
            let (u_lobe, u) = (key.uniform(2 * d), key.uniform2(2 * d + 1));
            let next = bsdf.sample(s.frame.to_local(s.wo), u_lobe, [u.u, u.v], Transport::Radiance);
            let Some(next) = next else { return };
            (bounces, chain) = if next.delta { (bounces, chain + 1) } else { (bounces + 1, 0) };
            if bounces > BOUNCES || chain > LONGEST_CHAIN {
                return;
            }
            dir = s.frame.to_world(next.wi).normalize();
            origin = s.leave(dir);
        }
    }

    fn index(&self, p: Vec3, n: Vec3) -> usize {
        let v = ((p - self.low) * self.scale).clamp(Vec3::ZERO, Vec3::splat(VOXELS as f32 - 1.0));
        ((v.x as usize * VOXELS + v.y as usize) * VOXELS + v.z as usize) * 6 + facing(n)
    }

    /// Whether what arrives at `p` on the side of unit `n` matters.
    pub fn sees(&self, p: Vec3, n: Vec3) -> bool {
        self.seen[self.index(p, n)]
    }
}
