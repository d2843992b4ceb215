//! The world: its own group, and instances of other groups under a top-level tree.

use std::marker::PhantomData;

use glam::DAffine3;

use crate::bounds::Bounds;
use crate::build::Box4;
use crate::group::{Found, Group, single};
#[cfg(target_arch = "x86_64")]
use crate::lanes::Avx2;
use crate::lanes::{Lanes, Portable};
use crate::ray::{Hit, LocalRay, NO_INSTANCE, Ray};
use crate::traverse::{Visit, traverse};
use crate::wide::Wide;

/// Collects the groups and instances of an [`Accel`].
pub struct SceneBuilder {
    world: Group,
    groups: Vec<Group>,
    instances: Vec<(u32, DAffine3)>,
}

impl SceneBuilder {
    /// Starts from the geometry that is in world space already (perhaps none).
    pub fn new(world: Group) -> SceneBuilder {
        SceneBuilder { world, groups: Vec::new(), instances: Vec::new() }
    }

    /// Adds a group to be instanced and returns its number.
    pub fn add_group(&mut self, group: Group) -> u32 {
        self.groups.push(group);
        (self.groups.len() - 1) as u32
    }

    /// Places a group and returns the instance's number. An instance of a group that does not exist, or with a
    /// transform that is singular or not finite, keeps its number but is never hit.
    pub fn add_instance(&mut self, group: u32, to_world: DAffine3) -> u32 {
        self.instances.push((group, to_world));
        (self.instances.len() - 1) as u32
    }

    /// Builds the top-level tree.
    pub fn build(self) -> Accel {
        let (mut boxes, mut order) = (Vec::new(), Vec::new());
        let mut instances = Vec::with_capacity(self.instances.len());
        for (i, (group, to_world)) in self.instances.into_iter().enumerate() {
            let to_group = to_world.inverse();
            let bounds =
                self.groups.get(group as usize).map_or(Bounds::EMPTY, |g| g.bounds().transformed(&to_world));
            if !bounds.is_empty() && bounds.is_finite() && to_group.is_finite() {
                boxes.push(Box4::new(&bounds));
                order.push(i as u32);
            }
            instances.push(Instance { group, to_group });
        }
        let top = Wide::from_binary(&single(boxes, order), |leaf| leaf[0]);
        Accel { world: self.world, groups: self.groups, instances, top, vectors: Vectors::detect() }
    }
}

struct Instance {
    group: u32,
    to_group: DAffine3,
}

/// The instruction set of the traversal.
#[derive(Clone, Copy, PartialEq)]
enum Vectors {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
}

impl Vectors {
    fn detect() -> Vectors {
        #[cfg(target_arch = "x86_64")]
        if std::arch::is_x86_feature_detected!("avx2") {
            return Vectors::Avx2;
        }
        Vectors::Portable
    }
}

/// A scene ready to be traced, immutable and shared between threads.
pub struct Accel {
    world: Group,
    groups: Vec<Group>,
    instances: Vec<Instance>,
    top: Wide,
    vectors: Vectors,
}

impl Accel {
    /// The nearest hit of the ray, if any.
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        match self.vectors {
            Vectors::Portable => self.closest_portable(ray),
            // SAFETY: this variant is made only by `detect`, after AVX2 was found.
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => unsafe { self.closest_avx2(ray) },
        }
    }

    /// True when anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match self.vectors {
            Vectors::Portable => self.occluded_portable(ray),
            // SAFETY: this variant is made only by `detect`, after AVX2 was found.
            #[cfg(target_arch = "x86_64")]
            Vectors::Avx2 => unsafe { self.occluded_avx2(ray) },
        }
    }

    /// [`closest`](Self::closest) without special instructions: the same bits, for comparison.
    #[inline(never)]
    pub fn closest_portable(&self, ray: &Ray) -> Option<Hit> {
        self.trace::<Portable, false>(ray)
    }

    /// [`occluded`](Self::occluded) without special instructions: the same answer, for comparison.
    #[inline(never)]
    pub fn occluded_portable(&self, ray: &Ray) -> bool {
        self.trace::<Portable, true>(ray).is_some()
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn closest_avx2(&self, ray: &Ray) -> Option<Hit> {
        self.trace::<Avx2, false>(ray)
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2")]
    fn occluded_avx2(&self, ray: &Ray) -> bool {
        self.trace::<Avx2, true>(ray).is_some()
    }

    /// A box around everything that can be hit; empty if nothing can.
    pub fn bounds(&self) -> Bounds {
        self.world.bounds().union(self.top.bounds)
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.world.memory_bytes()
            + self.groups.iter().map(Group::memory_bytes).sum::<usize>()
            + self.top.memory_bytes()
            + self.instances.capacity() * size_of::<Instance>()
    }

    #[inline(always)]
    fn trace<L: Lanes, const ANY: bool>(&self, ray: &Ray) -> Option<Hit> {
        let world_ray = LocalRay::from_world(ray)?;
        let mut t_max = ray.t_max;
        let mut best = None;
        if let Some(found) = self.world.trace::<L, ANY>(&world_ray, ray.t_min, &mut t_max) {
            best = Some((found, NO_INSTANCE));
        }
        if !(self.instances.is_empty() || ANY && best.is_some()) {
            best = self.trace_instances::<L, ANY>(&world_ray, ray.t_min, &mut t_max).or(best);
        }
        let (found, instance) = best?;
        if ANY {
            return Some(Hit { t: t_max, u: 0.0, v: 0.0, prim: 0, instance });
        }
        let (prim, u, v) = if instance == NO_INSTANCE {
            self.world.resolve(found, &world_ray)
        } else {
            let (group, local) = self.enter(instance, &world_ray)?;
            group.resolve(found, &local)
        };
        Some(Hit { t: t_max, u, v, prim, instance })
    }

    #[inline(always)]
    fn trace_instances<L: Lanes, const ANY: bool>(
        &self,
        ray: &LocalRay,
        t_min: f32,
        t_max: &mut f32,
    ) -> Option<(Found, u32)> {
        let slab = ray.slab(&self.top.bounds);
        let mut visitor = Instances::<L, ANY> { accel: self, ray, t_min, found: None, lanes: PhantomData };
        traverse::<L, _>(&self.top, &slab, t_min, t_max, &mut visitor);
        visitor.found
    }

    /// The group of an instance, and the ray in its space. The direction keeps its scale there, so `t` means the same.
    #[inline(always)]
    fn enter(&self, instance: u32, ray: &LocalRay) -> Option<(&Group, LocalRay)> {
        let Instance { group, to_group } = &self.instances[instance as usize];
        let origin = to_group.transform_point3(ray.origin64);
        let dir = to_group.transform_vector3(ray.dir64);
        Some((&self.groups[*group as usize], LocalRay::new(origin, dir)?))
    }
}

struct Instances<'a, L, const ANY: bool> {
    accel: &'a Accel,
    ray: &'a LocalRay,
    t_min: f32,
    found: Option<(Found, u32)>,
    lanes: PhantomData<L>,
}

impl<L: Lanes, const ANY: bool> Visit for Instances<'_, L, ANY> {
    #[inline(always)]
    fn leaf(&mut self, number: u32, t_max: &mut f32) -> bool {
        let Some((group, local)) = self.accel.enter(number, self.ray) else { return false };
        let Some(found) = group.trace::<L, ANY>(&local, self.t_min, t_max) else { return false };
        self.found = Some((found, number));
        ANY
    }
}
