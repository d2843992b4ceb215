//! The point that is probed: what a pixel sees, or a receiver given by position and normal.

use super::ProbeArgs;
use crate::failure::Failure;
use crate::values::Size;
use hemilux::bsdf::{Bsdf, LobeClass, Transport};
use hemilux::hints::LookCone;
use hemilux::sampler::Sampler;
use hemilux::sensor::sensor_surface;
use hemilux::strategies::{Domain, Known, virtual_cones};
use hemilux::transport::{Tally, Walker};
use hemilux::world::camera::Lens;
use hemilux::world::luminaire::Receiver;
use hemilux::world::{Surface, World};
use hemilux::zones::Zones;
use hemilux_scene::Rgb;
use hemilux_scene::geom::Vec3;
use hemiquad::{Dir, Region, Shape};

/// A point with everything that a gather there needs.
pub struct Spot<'a> {
    pub walker: Walker<'a>,
    pub surface: Surface,
    /// The lobes that reflect and are not mirrors.
    pub bsdf: Bsdf,
    /// Local.
    pub wo: Vec3,
    pub known: Known,
    /// Mirrors and glass between camera and point.
    pub passed: u32,
    /// What an integral is multiplied with: 1, or π for a white receiver whose irradiance is wanted.
    pub factor: f64,
    /// What is measured, and its unit.
    pub quantity: (&'static str, &'static str),
}

/// Mirrors and glass that a pixel is followed through.
const LONGEST: u32 = 32;

impl<'a> Spot<'a> {
    /// Find it.
    pub fn find(world: &'a World, zones: &'a Zones, args: &ProbeArgs) -> Result<Spot<'a>, Failure> {
        let (surface, bsdf, passed, factor, quantity) = match (&args.point, args.pixel) {
            (Some(point), _) => {
                let s = sensor_surface(point.position, point.normal);
                (s, Bsdf::diffuse(Rgb::WHITE), 0, std::f64::consts::PI, ("irradiance", "W/m2"))
            }
            (None, Some(pixel)) => {
                let (s, passed) = seen(world, args, pixel.0)?;
                let bsdf = reflecting(&world.bsdf(&s), s.frame.to_local(s.wo));
                (s, bsdf, passed, 1.0, ("surface radiance", "W/sr/m2"))
            }
            (None, None) => {
                return Err(Failure::usage("probe needs --pixel x,y or --point \"x y z nx ny nz\""));
            }
        };
        if bsdf.is_black() {
            return Err(Failure::input(
                "what this pixel sees reflects nothing but mirror images, or nothing at all",
            ));
        }
        let walker = Walker::zonal(world, zones);
        let wo = surface.frame.to_local(surface.wo);
        let mut known = Known::default();
        known.look(&walker, &surface, &bsdf, wo);
        Ok(Spot { walker, surface, bsdf, wo, known, passed, factor, quantity })
    }

    /// The integrand, with a stream of its own.
    pub fn domain<'s>(&'s self, sampler: Sampler, tally: &'s mut Tally) -> Domain<'s, 'a> {
        Domain {
            walker: &self.walker,
            surface: &self.surface,
            bsdf: &self.bsdf,
            wo: self.wo,
            sampler,
            next: 0,
            tally,
        }
    }

    /// Cones that hints ask to look into.
    pub fn hinted(&self) -> Vec<Region> {
        const SOME: u32 = 1000;
        let (s, side) = (&self.surface, 1f32.copysign(self.wo.z));
        let looks = self.walker.world.hints.looks(&Receiver::surface(s, &self.bsdf), SOME);
        let region = |look: &LookCone| {
            let (axis, height) = look.shape();
            let a = s.frame.to_local(axis);
            let axis = Dir::normalize(a.x as f64, a.y as f64, (side * a.z) as f64)?;
            let weight = look.rays as f64 / SOME as f64;
            Some(Region { shape: Shape::Cap { axis, height: height as f64 }, weight })
        };
        looks.cones().iter().filter_map(region).collect()
    }

    /// Cones of the luminaires, and of the virtual luminaires that the records expect.
    pub fn cones(&self) -> (Vec<Region>, Vec<Region>) {
        let s = &self.surface;
        let side = 1f32.copysign(self.wo.z);
        let mut virtuals = Vec::new();
        if let Some(zones) = self.walker.zones {
            let mut cones = Vec::new();
            virtual_cones(zones, s, &mut cones);
            for (axis, height, share) in cones {
                let a = s.frame.to_local(axis);
                let axis = Dir::normalize(a.x as f64, a.y as f64, (side * a.z) as f64).filter(|a| a.z > 0.0);
                virtuals.extend(axis.map(|axis| Region {
                    shape: Shape::Cap { axis, height: height as f64 },
                    weight: share as f64,
                }));
            }
        }
        (self.known.lamps.clone(), virtuals)
    }
}

/// What a pixel's centre sees, behind mirrors and glass, by the strongest branch at each.
fn seen(world: &World, args: &ProbeArgs, [x, y]: [u32; 2]) -> Result<(Surface, u32), Failure> {
    let film = &world.scene.film;
    let Size(w, h) = args.size.unwrap_or(Size(film.width, film.height));
    if x >= w || y >= h {
        return Err(Failure::usage(format!("--pixel {x},{y} lies outside of the picture of {w}x{h} pixels")));
    }
    let ray = Lens::new(&world.scene, w, h).ray(x, y, [0.5, 0.5], [0.5, 0.5]);
    let (mut origin, mut dir) = (ray.origin, ray.dir);
    for passed in 0..LONGEST {
        let Some(s) = world.closest(origin, dir, f32::INFINITY) else {
            return Err(Failure::input(format!("pixel {x},{y} sees no surface")));
        };
        let bsdf = world.bsdf(&s);
        let wo = s.frame.to_local(s.wo);
        if bsdf.has_non_delta() || !bsdf.has_delta() {
            return Ok((s, passed));
        }
        let branches = bsdf.lobes().iter().flat_map(|l| l.branches(wo, Transport::Radiance)).flatten();
        let Some(best) = branches.max_by(|a, b| a.weight.max().total_cmp(&b.weight.max())) else {
            return Ok((s, passed));
        };
        let wi = s.frame.to_world(best.wi).normalize();
        (origin, dir) = (s.leave(wi), wi);
    }
    Err(Failure::input(format!("pixel {x},{y} sees {LONGEST} mirrors and no end")))
}

/// The lobes that send back to the side of `wo` and only there, mirrors left out.
fn reflecting(bsdf: &Bsdf, wo: Vec3) -> Bsdf {
    let points = (0..16).map(|i| [(i % 4) as f32 / 4.0 + 0.1, (i / 4) as f32 / 4.0 + 0.1]);
    bsdf.keeping(|lobe| {
        lobe.kind() != LobeClass::Delta
            && points
                .clone()
                .filter_map(|u| lobe.sample(wo, u, Transport::Radiance))
                .all(|s| s.wi.z * wo.z > 0.0)
    })
}
