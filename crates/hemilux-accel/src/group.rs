//! Geometry in one space: a tree of triangles and a tree of quadrics.

use std::marker::PhantomData;
use std::ops::Range;

use glam::{DAffine3, Vec3};

use crate::bounds::Bounds;
use crate::build::{Binary, Box4, build};
use crate::lanes::Lanes;
use crate::quadric::{PlacedQuadric, Quadric};
use crate::ray::LocalRay;
use crate::traverse::{Visit, traverse};
use crate::triangle::{LANES, TrianglePack, is_proper};
use crate::wide::Wide;

/// Collects the primitives of a [`Group`]. Their numbers follow the order of addition.
#[derive(Default)]
pub struct GroupBuilder {
    triangles: Vec<[Vec3; 3]>,
    /// First number of each mesh, and the index of its first triangle.
    meshes: Vec<(u32, u32)>,
    quadrics: Vec<(PlacedQuadric, DAffine3)>,
    next: u32,
}

impl GroupBuilder {
    /// An empty group.
    pub fn new() -> GroupBuilder {
        GroupBuilder::default()
    }

    /// Adds a triangle mesh and returns the numbers of its triangles. A triangle with an index out of range, a
    /// coordinate that is not finite or no area keeps its number but is never hit.
    pub fn add_mesh(&mut self, positions: &[Vec3], indices: &[[u32; 3]]) -> Range<u32> {
        let first = self.next;
        self.meshes.push((first, self.triangles.len() as u32));
        let vertex = |i: u32| positions.get(i as usize).copied().unwrap_or(Vec3::NAN);
        self.triangles.extend(indices.iter().map(|t| t.map(vertex)));
        self.next += indices.len() as u32;
        first..self.next
    }

    /// Adds a quadric placed by `to_group` (named `to_world` for the world's own group) and returns its number.
    pub fn add_quadric(&mut self, shape: Quadric, to_group: DAffine3) -> u32 {
        let prim = self.next;
        self.quadrics.push((PlacedQuadric::new(shape, to_group, prim), to_group));
        self.next += 1;
        prim
    }

    /// Builds the trees: O(n log n) time on any input.
    pub fn build(self) -> Group {
        let (mut boxes, mut order, mut number) = (Vec::new(), Vec::new(), Vec::new());
        let mut meshes = self.meshes.iter().peekable();
        let mut offset = 0;
        for (i, t) in self.triangles.iter().enumerate() {
            while let Some(&(first, start)) = meshes.next_if(|m| m.1 as usize <= i) {
                offset = first - start;
            }
            number.push(i as u32 + offset);
            if is_proper(t) {
                boxes.push(Box4::new(&t.iter().fold(Bounds::EMPTY, |b, &p| b.extended(p))));
                order.push(i as u32);
            }
        }
        let binary = build(boxes, order, LANES);
        let mut packs = Vec::with_capacity(binary.nodes.len() / 2 + 1);
        let triangles = Wide::from_binary(&binary, |leaf| {
            let mut pack = TrianglePack::new(leaf, |i| self.triangles[i as usize]);
            for (lane, &i) in leaf.iter().enumerate() {
                pack.prim[lane] = number[i as usize];
            }
            packs.push(pack);
            (packs.len() - 1) as u32
        });
        packs.shrink_to_fit();

        let (mut boxes, mut order) = (Vec::new(), Vec::new());
        for (i, (quadric, to_group)) in self.quadrics.iter().enumerate() {
            if let Some(b) = quadric.bounds(to_group) {
                boxes.push(Box4::new(&b));
                order.push(i as u32);
            }
        }
        let quadrics = Wide::from_binary(&single(boxes, order), |leaf| leaf[0]);
        let shapes = self.quadrics.into_iter().map(|(q, _)| q).collect();
        Group { triangles, packs, quadrics, shapes }
    }
}

/// A binary tree with one primitive per leaf.
pub(crate) fn single(boxes: Vec<Box4>, order: Vec<u32>) -> Binary {
    build(boxes, order, 1)
}

/// Built geometry, in its own space.
pub struct Group {
    triangles: Wide,
    packs: Vec<TrianglePack>,
    quadrics: Wide,
    shapes: Vec<PlacedQuadric>,
}

/// The best hit so far.
#[derive(Clone, Copy)]
pub(crate) enum Found {
    Triangle { pack: u32, lane: u32 },
    Quadric { prim: u32, u: f32, v: f32 },
}

impl Group {
    /// A box around everything that can be hit; empty if nothing can.
    pub fn bounds(&self) -> Bounds {
        self.triangles.bounds.union(self.quadrics.bounds)
    }

    /// Memory held, in bytes.
    pub fn memory_bytes(&self) -> usize {
        self.triangles.memory_bytes()
            + self.quadrics.memory_bytes()
            + self.packs.capacity() * size_of::<TrianglePack>()
            + self.shapes.capacity() * size_of::<PlacedQuadric>()
    }

    /// The nearest hit before `t_max`, which it lowers; with `ANY`, the first one met.
    #[inline(always)]
    pub(crate) fn trace<L: Lanes, const ANY: bool>(
        &self,
        ray: &LocalRay,
        t_min: f32,
        t_max: &mut f32,
    ) -> Option<Found> {
        let mut found = None;
        if !self.packs.is_empty() {
            let slab = ray.slab(&self.triangles.bounds);
            let mut visitor =
                Triangles::<L, ANY> { packs: &self.packs, ray, t_min, found, lanes: PhantomData };
            traverse::<L, _>(&self.triangles, &slab, t_min, t_max, &mut visitor);
            found = visitor.found;
        }
        if !(self.shapes.is_empty() || ANY && found.is_some()) {
            let slab = ray.slab(&self.quadrics.bounds);
            let mut visitor = Quadrics::<ANY> { shapes: &self.shapes, ray, t_min, found };
            traverse::<L, _>(&self.quadrics, &slab, t_min, t_max, &mut visitor);
            found = visitor.found;
        }
        found
    }

    /// Primitive number and surface parameters.
    pub(crate) fn resolve(&self, found: Found, ray: &LocalRay) -> (u32, f32, f32) {
        match found {
            Found::Triangle { pack, lane } => {
                let pack = &self.packs[pack as usize];
                let (u, v) = pack.barycentric(lane as usize, ray);
                (pack.prim[lane as usize], u, v)
            }
            Found::Quadric { prim, u, v } => (prim, u, v),
        }
    }
}

struct Triangles<'a, L, const ANY: bool> {
    packs: &'a [TrianglePack],
    ray: &'a LocalRay,
    t_min: f32,
    found: Option<Found>,
    lanes: PhantomData<L>,
}

impl<L: Lanes, const ANY: bool> Visit for Triangles<'_, L, ANY> {
    #[inline(always)]
    fn prefetch(&self, number: u32) {
        L::prefetch(&self.packs[number as usize]);
    }

    #[inline(always)]
    fn leaf(&mut self, number: u32, t_max: &mut f32) -> bool {
        let pack = &self.packs[number as usize];
        let mut lanes = pack.candidates::<L>(self.ray);
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let t = pack.distance(lane as usize, self.ray);
            if t > self.t_min && t < *t_max {
                *t_max = t;
                self.found = Some(Found::Triangle { pack: number, lane });
                if ANY {
                    return true;
                }
            }
        }
        false
    }
}

struct Quadrics<'a, const ANY: bool> {
    shapes: &'a [PlacedQuadric],
    ray: &'a LocalRay,
    t_min: f32,
    found: Option<Found>,
}

impl<const ANY: bool> Visit for Quadrics<'_, ANY> {
    #[inline(always)]
    fn leaf(&mut self, number: u32, t_max: &mut f32) -> bool {
        let quadric = &self.shapes[number as usize];
        let Some((t, u, v)) = quadric.intersect(self.ray.origin64, self.ray.dir64, self.t_min, *t_max) else {
            return false;
        };
        let t = t as f32;
        let nearer = t > self.t_min && t < *t_max;
        if nearer {
            *t_max = t;
            self.found = Some(Found::Quadric { prim: quadric.prim, u: u as f32, v: v as f32 });
        }
        nearer && ANY
    }
}
