//! Zones on any surface: from a hit to the piece of surface it belongs to, in constant time, with exact areas.
//!
//! Every primitive is cut in its own parameter domain into cells no wider than a target: a triangle into k² equal ones,
//! a quadric into a grid. A cell that is large enough is a zone of its own. Smaller ones share a zone with their
//! neighbours: those of the same shape, in the same voxel, facing the same way (one of 26 directions). A zone has two
//! sides. The target grows until the number of zones and cells is within the budget.
//!
//! Invariants: every point of every primitive belongs to exactly one zone; the areas of zones sum to that of the scene.

use crate::world::{Surface, World, convert};
use hemilux_accel::NO_INSTANCE;
use hemilux_scene::Geometry;
use hemilux_scene::geom::{DAffine3, DVec3, Vec3};
use std::collections::HashMap;

/// How a primitive is cut. `rows` = 0: all of it belongs to zone `first`.
#[derive(Clone, Copy, Debug)]
struct Cut {
    /// First cell (or the zone).
    first: u32,
    /// Triangle: k. Quadric: cells along v.
    rows: u16,
    /// Quadric: cells along u.
    columns: u16,
}

/// Where a hit lies on the zones.
#[derive(Clone, Copy, Debug)]
pub struct ZonePlace {
    /// Zone index.
    pub zone: u32,
    /// 0: the side of the geometric normal, 1: the other; the side the ray came from.
    pub side: u32,
    /// Radius of the zone (m).
    pub radius: f32,
}

/// The zones of a world.
#[derive(Clone, Debug)]
pub struct ZoneMap {
    /// Per group occurrence (the world, then each instance): first entry of `cuts`.
    occurrence: Vec<u32>,
    cuts: Vec<Cut>,
    /// Zone of each cell.
    cells: Vec<u32>,
    /// Area of each zone (m²), one side.
    areas: Vec<f32>,
    /// Radius of each zone (m).
    radii: Vec<f32>,
    target: f32,
}

/// No scene is cut into more cells than this many times its zone budget (or 4 million).
const CELLS_PER_ZONE: usize = 8;
const MOST_CELLS: usize = 1 << 22;
/// Instances whose primitives number more than this in all have one zone per shape instead of cells.
const MOST_INSTANCED: u64 = 1 << 24;

impl ZoneMap {
    /// Cut the world into at most `budget` zones.
    pub fn new(world: &World, budget: u32) -> ZoneMap {
        let budget = budget.max(16) as usize;
        let area = world_area(world);
        let diagonal = 2.0 * world.bound().1 as f64;
        let mut target = (area / budget as f64).sqrt().max(1e-6 * diagonal).max(f64::MIN_POSITIVE);
        loop {
            let map = Builder::new(world, target, budget).build();
            if let Some(map) = map
                && (map.areas.len() <= budget || target > 4.0 * diagonal)
            {
                return map;
            }
            target *= 1.25;
            if target > 1e3 * diagonal {
                // Not reached: at this size every shape is one zone per direction.
                return Builder::new(world, target, usize::MAX / 16).build().unwrap_or_else(ZoneMap::empty);
            }
        }
    }

    fn empty() -> ZoneMap {
        ZoneMap {
            occurrence: vec![0],
            cuts: Vec::new(),
            cells: Vec::new(),
            areas: Vec::new(),
            radii: Vec::new(),
            target: 0.0,
        }
    }

    /// Number of zones (each with two sides).
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Whether there is nothing to cut.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Areas of the zones (m²), one side.
    pub fn areas(&self) -> &[f32] {
        &self.areas
    }

    /// Radii of the zones (m).
    pub fn radii(&self) -> &[f32] {
        &self.radii
    }

    /// Width that cells were cut to (m).
    pub fn target(&self) -> f32 {
        self.target
    }

    /// Bytes in use.
    pub fn memory_bytes(&self) -> usize {
        self.cuts.len() * size_of::<Cut>() + self.cells.len() * 4 + self.areas.len() * 8
    }

    /// The zone of a hit. `jitter` in [0, 1)² shifts the point by up to half a cell within its primitive, which
    /// turns steps between zones into ramps on average; (0.5, 0.5) shifts nothing.
    #[inline]
    pub fn locate(&self, world: &World, s: &Surface, jitter: [f32; 2]) -> ZonePlace {
        let occurrence = if s.hit.instance == NO_INSTANCE { 0 } else { s.hit.instance as usize + 1 };
        let cut = self.cuts[self.occurrence[occurrence] as usize + s.hit.prim as usize];
        let zone = if cut.rows == 0 {
            cut.first
        } else {
            let triangle = matches!(world.shape(s.group, s.shape).geometry, Geometry::Mesh(_));
            let cell = if triangle {
                triangle_cell(cut.rows, s.hit.u, s.hit.v, jitter)
            } else {
                grid_cell(cut.rows, cut.columns, s.hit.u, s.hit.v, jitter)
            };
            self.cells[(cut.first + cell) as usize]
        };
        let side = !s.is_front(s.wo) as u32;
        ZonePlace { zone, side, radius: self.radii[zone as usize] }
    }

    /// [`ZoneMap::locate`] for a hit on a triangle of the world's own, met on its front or back.
    #[inline]
    pub(crate) fn locate_triangle(
        &self,
        hit: &hemilux_accel::Hit,
        front: bool,
        jitter: [f32; 2],
    ) -> ZonePlace {
        let cut = self.cuts[hit.prim as usize];
        let zone = match cut.rows {
            0 => cut.first,
            k => self.cells[(cut.first + triangle_cell(k, hit.u, hit.v, jitter)) as usize],
        };
        ZonePlace { zone, side: !front as u32, radius: self.radii[zone as usize] }
    }

    /// Every cell as a polygon (3 or 4 corners, world) with its zone: for drawing. Whole primitives are one cell.
    pub fn for_each_cell(&self, world: &World, mut f: impl FnMut(&[Vec3], u32)) {
        for_each_occurrence(world, |occurrence, group, to_world| {
            let base = self.occurrence[occurrence] as usize;
            for (prim, cut) in self.cuts[base..base + world.groups[group].prims() as usize].iter().enumerate()
            {
                for_each_piece(world, group, to_world, prim as u32, cut.rows, cut.columns, |cell, piece| {
                    let zone = match cut.rows {
                        0 => cut.first,
                        _ => self.cells[(cut.first + cell) as usize],
                    };
                    let corners = piece.corners.map(|c| c.as_vec3());
                    f(&corners[..piece.count], zone);
                });
            }
        });
    }
}

/// Cell of a triangle cut into k² equal ones, by strips of equal distance from vertex 0: strip s has 2s + 1 cells.
#[inline]
fn triangle_cell(k: u16, u: f32, v: f32, jitter: [f32; 2]) -> u32 {
    let k = k as f32;
    // Keep the shifted point inside the triangle.
    let x = (u * k + jitter[0] - 0.5).clamp(0.0, k);
    let y = (v * k + jitter[1] - 0.5).clamp(0.0, k - x);
    let strip = (x + y).floor().min(k - 1.0);
    let b = y.floor().min(strip);
    let a = x.floor();
    // Lower cells have a + b = strip, upper ones a + b = strip − 1.
    let upper = a + b < strip && b < strip;
    (strip * strip + 2.0 * b) as u32 + upper as u32
}

#[inline]
fn grid_cell(rows: u16, columns: u16, u: f32, v: f32, jitter: [f32; 2]) -> u32 {
    let at = |x: f32, n: u16, j: f32| (x * n as f32 + j - 0.5).clamp(0.0, n as f32 - 0.5) as u32;
    at(v, rows, jitter[1]) * columns as u32 + at(u, columns, jitter[0])
}

/// A cell of a primitive, in the world.
struct Piece {
    corners: [DVec3; 4],
    count: usize,
    centroid: DVec3,
    /// Area times normal.
    normal: DVec3,
    area: f64,
}

impl Piece {
    fn radius(&self) -> f64 {
        self.corners[..self.count].iter().map(|c| (*c - self.centroid).length()).fold(0.0, f64::max)
    }
}

fn for_each_occurrence(world: &World, mut f: impl FnMut(usize, usize, &DAffine3)) {
    f(0, 0, &DAffine3::IDENTITY);
    for (i, p) in world.placements.iter().enumerate() {
        f(i + 1, p.group as usize, &p.to_world);
    }
}

fn for_each_piece(
    world: &World,
    group: usize,
    to_world: &DAffine3,
    prim: u32,
    rows: u16,
    columns: u16,
    mut f: impl FnMut(u32, &Piece),
) {
    let g = &world.groups[group];
    let shape_index = g.prim_shape[prim as usize] as usize;
    match g.shapes[shape_index].geometry {
        Geometry::Mesh(id) => {
            let mesh = &world.scene.meshes[id.0 as usize];
            let t = mesh.indices[(prim - g.first_prim[shape_index]) as usize];
            let [a, b, c] = t.map(|i| to_world.transform_point3(mesh.positions[i as usize].as_dvec3()));
            triangle_pieces(a, b, c, rows.max(1) as u32, &mut f);
        }
        Geometry::Quadric(q, to_group) => {
            let placed = *to_world * to_group;
            quadric_pieces(&convert(q), &placed, rows.max(1) as u32, columns.max(1) as u32, &mut f);
        }
    }
}

fn triangle_pieces(a: DVec3, b: DVec3, c: DVec3, k: u32, f: &mut impl FnMut(u32, &Piece)) {
    let (e1, e2) = ((b - a) / k as f64, (c - a) / k as f64);
    let normal = e1.cross(e2) * 0.5;
    let at = |x: u32, y: u32| a + e1 * x as f64 + e2 * y as f64;
    for strip in 0..k {
        for j in 0..=strip {
            let i = strip - j;
            let lower = [at(i, j), at(i + 1, j), at(i, j + 1)];
            f(strip * strip + 2 * j, &triangle_piece(lower, normal));
            if j < strip {
                // The upper cell of this strip: a + b = strip − 1.
                let i = strip - 1 - j;
                let upper = [at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)];
                f(strip * strip + 2 * j + 1, &triangle_piece(upper, normal));
            }
        }
    }
}

fn triangle_piece(t: [DVec3; 3], normal: DVec3) -> Piece {
    let centroid = (t[0] + t[1] + t[2]) / 3.0;
    Piece { corners: [t[0], t[1], t[2], t[2]], count: 3, centroid, normal, area: normal.length() }
}

fn quadric_pieces(
    q: &hemilux_accel::Quadric,
    placed: &DAffine3,
    rows: u32,
    columns: u32,
    f: &mut impl FnMut(u32, &Piece),
) {
    // Four-point Gauss–Legendre in each direction: to 1e-12 of the area for the cells that occur.
    const NODES: [(f64, f64); 4] = [
        (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
        (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
        (0.930_568_155_797_026_2, 0.173_927_422_568_726_93),
    ];
    let world_at = |u: f64, v: f64| placed.transform_point3(q.eval(u, v).position);
    for j in 0..rows {
        for i in 0..columns {
            let (u0, v0) = (i as f64 / columns as f64, j as f64 / rows as f64);
            let (du, dv) = (1.0 / columns as f64, 1.0 / rows as f64);
            let (mut area, mut normal) = (0.0, DVec3::ZERO);
            for (x, wx) in NODES {
                for (y, wy) in NODES {
                    let at = q.eval(u0 + x * du, v0 + y * dv);
                    let cross = placed.transform_vector3(at.dpdu).cross(placed.transform_vector3(at.dpdv));
                    let w = wx * wy * du * dv;
                    area += w * cross.length();
                    normal += cross * w;
                }
            }
            let corners =
                [world_at(u0, v0), world_at(u0 + du, v0), world_at(u0 + du, v0 + dv), world_at(u0, v0 + dv)];
            let centroid = world_at(u0 + 0.5 * du, v0 + 0.5 * dv);
            f(j * columns + i, &Piece { corners, count: 4, centroid, normal, area });
        }
    }
}

/// Total area of all surfaces (m²), one side.
fn world_area(world: &World) -> f64 {
    let mut area = 0.0;
    for_each_occurrence(world, |_, group, to_world| {
        for prim in 0..world.groups[group].prims() {
            for_each_piece(world, group, to_world, prim, 1, 1, |_, piece| area += piece.area);
        }
    });
    area
}

struct Builder<'a> {
    world: &'a World,
    target: f64,
    most_cells: usize,
    map: ZoneMap,
    areas: Vec<f64>,
    radii: Vec<f64>,
    shared: HashMap<(u32, u32, [i32; 3], u8), u32>,
}

impl<'a> Builder<'a> {
    fn new(world: &'a World, target: f64, budget: usize) -> Builder<'a> {
        let most_cells = budget.saturating_mul(CELLS_PER_ZONE).max(MOST_CELLS);
        let mut map = ZoneMap::empty();
        map.occurrence.clear();
        map.target = target as f32;
        Builder {
            world,
            target,
            most_cells,
            map,
            areas: Vec::new(),
            radii: Vec::new(),
            shared: HashMap::new(),
        }
    }

    /// `None` if there would be too many cells.
    fn build(mut self) -> Option<ZoneMap> {
        let world = self.world;
        let instanced: u64 =
            world.placements.iter().map(|p| world.groups[p.group as usize].prims() as u64).sum();
        let coarse = instanced > MOST_INSTANCED;
        let mut fits = true;
        for_each_occurrence(world, |occurrence, group, to_world| {
            if !fits {
                return;
            }
            self.map.occurrence.push(self.map.cuts.len() as u32);
            for prim in 0..world.groups[group].prims() {
                self.cut(occurrence as u32, group, to_world, prim, coarse && occurrence > 0);
                if self.map.cells.len() > self.most_cells {
                    fits = false;
                    return;
                }
            }
        });
        self.map.areas = self.areas.iter().map(|&a| a as f32).collect();
        self.map.radii = self.radii.iter().map(|&r| r as f32).collect();
        fits.then_some(self.map)
    }

    fn cut(&mut self, occurrence: u32, group: usize, to_world: &DAffine3, prim: u32, coarse: bool) {
        let g = &self.world.groups[group];
        let shape = g.prim_shape[prim as usize];
        let (rows, columns) = if coarse { (1, 1) } else { self.divisions(group, to_world, prim) };
        if rows == 1 && columns == 1 {
            let mut zone = 0;
            let mut this = std::mem::take(&mut self.shared);
            for_each_piece(self.world, group, to_world, prim, 1, 1, |_, piece| {
                zone = self.zone_of(&mut this, occurrence, shape, piece, coarse);
            });
            self.shared = this;
            self.map.cuts.push(Cut { first: zone, rows: 0, columns: 0 });
            return;
        }
        let first = self.map.cells.len() as u32;
        let mut shared = std::mem::take(&mut self.shared);
        let triangle = matches!(g.shapes[shape as usize].geometry, Geometry::Mesh(_));
        let count = if triangle { rows as usize * rows as usize } else { rows as usize * columns as usize };
        self.map.cells.resize(first as usize + count, 0);
        for_each_piece(self.world, group, to_world, prim, rows, columns, |cell, piece| {
            let zone = self.zone_of(&mut shared, occurrence, shape, piece, false);
            self.map.cells[(first + cell) as usize] = zone;
        });
        self.shared = shared;
        self.map.cuts.push(Cut { first, rows, columns });
    }

    /// Into how many parts a primitive is cut.
    fn divisions(&self, group: usize, to_world: &DAffine3, prim: u32) -> (u16, u16) {
        let parts = |length: f64| (length / self.target).ceil().clamp(1.0, 1024.0) as u16;
        let g = &self.world.groups[group];
        let shape = g.prim_shape[prim as usize] as usize;
        match g.shapes[shape].geometry {
            Geometry::Mesh(_) => {
                let mut longest = 0.0;
                for_each_piece(self.world, group, to_world, prim, 1, 1, |_, p| {
                    let [a, b, c, _] = p.corners;
                    longest = (b - a).length().max((c - b).length()).max((a - c).length());
                });
                let k = parts(longest);
                (k, k)
            }
            Geometry::Quadric(q, to_group) => {
                let placed = *to_world * to_group;
                let q = convert(q);
                let step = |along_u: bool| {
                    let cells = [0.1, 0.3, 0.5, 0.7, 0.9].map(|v: f64| {
                        let at = if along_u { q.eval(0.5, v) } else { q.eval(v, 0.5) };
                        placed.transform_vector3(if along_u { at.dpdu } else { at.dpdv }).length()
                    });
                    cells.into_iter().fold(0.0, f64::max)
                };
                (parts(step(false)), parts(step(true)))
            }
        }
    }

    fn zone_of(
        &mut self,
        shared: &mut HashMap<(u32, u32, [i32; 3], u8), u32>,
        occurrence: u32,
        shape: u32,
        piece: &Piece,
        coarse: bool,
    ) -> u32 {
        let new = |this: &mut Self| {
            this.areas.push(0.0);
            this.radii.push(0.0);
            this.areas.len() as u32 - 1
        };
        let large = piece.area >= 0.2 * self.target * self.target;
        let zone = if large && !coarse {
            new(self)
        } else {
            let voxel = (piece.centroid / self.target).floor();
            let clamp = |v: f64| v.clamp(i32::MIN as f64, i32::MAX as f64) as i32;
            let voxel = if coarse { [0; 3] } else { [clamp(voxel.x), clamp(voxel.y), clamp(voxel.z)] };
            let key = (occurrence, shape, voxel, facing(piece.normal));
            *shared.entry(key).or_insert_with(|| new(self))
        };
        let z = zone as usize;
        self.areas[z] += piece.area;
        let radius = if large { piece.radius() } else { (0.9 * self.target).max(piece.radius()) };
        self.radii[z] = self.radii[z].max(radius);
        zone
    }
}

/// One of 26 directions (27 with the null vector).
fn facing(normal: DVec3) -> u8 {
    let n = normal.normalize_or_zero();
    let digit = |v: f64| if v > 0.4 { 2 } else { (v >= -0.4) as u8 };
    digit(n.x) * 9 + digit(n.y) * 3 + digit(n.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_of_a_triangle_are_numbered_once_and_found_again() {
        for k in [1u16, 2, 3, 7] {
            let (a, b, c) = (DVec3::ZERO, DVec3::X, DVec3::Y);
            let mut seen = vec![0; (k * k) as usize];
            let mut area = 0.0;
            triangle_pieces(a, b, c, k as u32, &mut |cell, piece| {
                seen[cell as usize] += 1;
                area += piece.area;
                // The centroid's own parameters are (x, y) in this triangle.
                let (u, v) = (piece.centroid.x as f32, piece.centroid.y as f32);
                assert_eq!(triangle_cell(k, u, v, [0.5, 0.5]), cell, "k = {k}, ({u}, {v})");
            });
            assert!(seen.iter().all(|&n| n == 1), "{k}: {seen:?}");
            assert!((area - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn shifted_points_stay_in_the_primitive() {
        for i in 0..4000u32 {
            let r = hemiquad::points::Key::new(5).with(i as u64);
            let (mut p, j) = (r.uniform2(0), r.uniform2(1));
            if p.u + p.v > 1.0 {
                p = hemiquad::map::Uv::new(1.0 - p.u, 1.0 - p.v);
            }
            assert!(triangle_cell(5, p.u, p.v, [j.u, j.v]) < 25);
            assert!(grid_cell(3, 4, p.u, p.v, [j.u, j.v]) < 12);
        }
    }
}
