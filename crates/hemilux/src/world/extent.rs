//! Where emitting shapes lie, as wholes: what specular chains are named and grouped by, and what their images are looked for in.

use super::World;
use super::emitter_points::shape_ball;
use super::luminaire::{Emitter, Luminaires};
use super::outline::Outline;
use hemilux_scene::geom::{DAffine3, Vec3};
use hemilux_scene::{Geometry, Scene};

/// Where an emitting shape lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ShapeExtent {
    /// Of a ball around it (m).
    pub centre: Vec3,
    pub radius: f32,
    /// If it is flat.
    pub outline: Option<Outline>,
    /// How much of the ball's disk it fills as it is seen, on average.
    pub fill: f32,
}

impl ShapeExtent {
    /// That of a placed shape of `area` (m²).
    pub(super) fn of(world: &World, geometry: &Geometry, to_world: &DAffine3, area: f32) -> ShapeExtent {
        let (centre, radius) = shape_ball(world, geometry, to_world);
        let outline = flat_outline(&world.scene, geometry, to_world);
        // A convex body shows a quarter of its surface (Cauchy), a flat piece at most all of it.
        let shown = if outline.is_some() { area } else { 0.25 * area };
        let fill = shown / (std::f32::consts::PI * radius * radius).max(f32::MIN_POSITIVE);
        ShapeExtent { centre: centre.as_vec3(), radius, outline, fill: fill.clamp(0.02, 1.0) }
    }
}

impl Luminaires {
    /// Name and size of what luminaire `i` is part of, for grouping specular chains: a number for the emitting shape
    /// (or sky), and the radius (m) of a ball around it with the distance (m) it counts as being away beyond the start
    /// of the chain. `None` where it fills too much of the sky for its images to be small.
    pub fn identity(&self, scene: &Scene, i: u32) -> Option<(u32, f32, f32)> {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(s) => match &scene.environments[s] {
                hemilux_scene::Environment::Sun { cos_half_angle, .. } => {
                    let far = 1e4 * self.bound.1;
                    let tan = (1.0 - cos_half_angle * cos_half_angle).max(0.0).sqrt() / cos_half_angle;
                    Some((u32::MAX - s as u32, far * tan as f32, far))
                }
                _ => None,
            },
            // What a sphere shows lies two thirds of its radius before its centre on average: with that much added, the
            // ends of chains gather round the centre from wherever it is seen.
            Emitter::Quadric { sphere: Some((_, r)), .. } => {
                Some((item.emission, r as f32, 2.0 / 3.0 * r as f32))
            }
            _ => Some((item.emission, self.extents[item.emission as usize].radius, 0.0)),
        }
    }

    /// Where the emitting shape lies that luminaire `i` is part of; nothing of a sky.
    pub(crate) fn place(&self, i: u32) -> Option<&ShapeExtent> {
        let item = &self.items[i as usize];
        match item.emitter {
            Emitter::Sky(_) => None,
            _ => Some(&self.extents[item.emission as usize]),
        }
    }
}

/// Triangles of an emitting mesh that an outline is looked for around.
const OUTLINED: usize = 4096;

/// The outline of an emitting shape, if it is flat.
fn flat_outline(scene: &Scene, geometry: &Geometry, to_world: &DAffine3) -> Option<Outline> {
    let Geometry::Mesh(id) = geometry else { return None };
    let mesh = &scene.meshes[id.0 as usize];
    if mesh.indices.len() > OUTLINED {
        return None;
    }
    let corner = |i: u32| to_world.transform_point3(mesh.positions[i as usize].as_dvec3()).as_vec3();
    let triangles: Vec<[Vec3; 3]> = mesh.indices.iter().map(|t| t.map(corner)).collect();
    Outline::around(&triangles)
}
