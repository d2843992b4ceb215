//! Luminaires and casters as balls: what methods need that are told where to look (regions of the hemisphere), or that
//! enlarge luminaires (report, section 4).
//!
//! A ball stands for one emitting shape (a sun for itself, far away) or one shape that reflects or refracts other than
//! diffusely. Skies that fill the sky are no balls.

use super::World;
use super::emitter_points::shape_ball;
use hemilux_scene::geom::{DAffine3, Vec3};
use hemilux_scene::{Environment, Rgb};

/// A ball around a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre (m).
    pub centre: Vec3,
    /// Radius (m).
    pub radius: f32,
}

/// What shines from a ball.
#[derive(Clone, Debug)]
enum Light {
    /// Luminaires of these numbers: first, and one past the last.
    Shape(u32, u32),
    /// A sun of this radiance (W·sr⁻¹·m⁻²).
    Sun(Rgb),
}

/// All of them.
#[derive(Clone, Debug, Default)]
pub struct Balls {
    lamps: Vec<(Ball, Light)>,
    casters: Vec<Ball>,
}

/// A sun is put at this many radii of the scene.
const FAR: f32 = 1e4;

impl Balls {
    /// List them.
    pub fn new(world: &World) -> Balls {
        let mut all = Balls::default();
        all.group(world, 0, &DAffine3::IDENTITY);
        for placement in &world.placements {
            all.group(world, placement.group, &placement.to_world);
        }
        // Luminaires are numbered in the same order: shape by shape, placement by placement.
        let mut next = 0;
        for (_, light) in &mut all.lamps {
            if let Light::Shape(first, end) = light {
                let count = *end;
                (*first, *end) = (next, next + count);
                next += count;
            }
        }
        let (centre, reach) = world.bound();
        for e in &world.scene.environments {
            if let Environment::Sun { direction, cos_half_angle, radiance } = e {
                let sin = (1.0 - cos_half_angle * cos_half_angle).max(0.0).sqrt();
                let distance = FAR * reach;
                let ball = Ball { centre: centre + *direction * distance, radius: distance * sin as f32 };
                all.lamps.push((ball, Light::Sun(*radiance)));
            }
        }
        all
    }

    fn group(&mut self, world: &World, group: u32, to_world: &DAffine3) {
        let group = &world.groups[group as usize];
        for (i, shape) in group.shapes.iter().enumerate() {
            let emits = shape.emission.is_some();
            let casts = !world.is_diffuse(shape.material);
            if !emits && !casts {
                continue;
            }
            let (centre, radius) = shape_ball(world, &shape.geometry, to_world);
            let ball = Ball { centre: centre.as_vec3(), radius };
            if emits {
                let count = group.first_prim[i + 1] - group.first_prim[i];
                self.lamps.push((ball, Light::Shape(0, count)));
            } else {
                self.casters.push(ball);
            }
        }
    }

    /// Number of luminaires.
    pub fn len(&self) -> usize {
        self.lamps.len()
    }

    /// Whether there is no luminaire that is a ball.
    pub fn is_empty(&self) -> bool {
        self.lamps.is_empty()
    }

    /// Luminaires.
    pub fn lamps(&self) -> impl Iterator<Item = Ball> + '_ {
        self.lamps.iter().map(|l| l.0)
    }

    /// Shapes that reflect or refract other than diffusely and do not emit.
    pub fn casters(&self) -> &[Ball] {
        &self.casters
    }

    /// Radiant intensity (W·sr⁻¹) of lamp `i` towards unit `w`, nothing being in the way: exact for flat shapes and spheres of
    /// uniform emission, else from a few points.
    pub fn intensity(&self, world: &World, i: usize, w: Vec3) -> Rgb {
        match &self.lamps[i] {
            (ball, Light::Sun(radiance)) => *radiance * (std::f32::consts::PI * ball.radius * ball.radius),
            (_, Light::Shape(first, end)) => (*first..*end)
                .map(|l| world.luminaires.intensity(&world.scene, l, w))
                .fold(Rgb::BLACK, |a, b| a + b),
        }
    }
}
