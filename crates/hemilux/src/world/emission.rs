//! What luminaires emit by place and direction, and the particles that leave them: a luminaire in proportion to power, a
//! point by area, a direction by cosine (or by its profile).

use super::luminaire::{Emitter, Luminaire, Luminaires};
use super::texture;
use super::unit::{Density, LuminairePoint};
use hemilux_accel::offset_origin;
use hemilux_scene::geom::{DVec3, Frame, Vec2, Vec3};
use hemilux_scene::{Emission, Profile, Rgb, Scene, Wrap};
use std::f32::consts::PI;

/// A particle as it leaves a luminaire.
#[derive(Clone, Copy, Debug)]
pub struct EmittedParticle {
    /// Where it starts (already off the surface).
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// Power it would carry if it were the only one (W): divide by the number of particles.
    pub flux: Rgb,
    /// Which luminaire.
    pub luminaire: u32,
}

impl Luminaires {
    /// A particle: `u_pick` chooses the luminaire, `u_point` where, `u_dir` whither.
    pub fn emit(
        &self,
        scene: &Scene,
        u_pick: f32,
        u_point: [f32; 2],
        u_dir: [f32; 2],
    ) -> Option<EmittedParticle> {
        if self.is_empty() {
            return None;
        }
        let (i, rest) = self.pick_by_power(u_pick);
        let item = &self.items[i];
        if let Emitter::Sky(s) = item.emitter {
            return self.emit_sky(scene, s, i, u_point, u_dir);
        }
        let emission = &self.emissions[item.emission as usize];
        // Directions first where that is possible, so that those that matter are a region of two numbers.
        let outward = |sign: f64| sign > 0.0 && !emission.two_sided && emission.image.is_none();
        if let Emitter::Quadric { sphere: Some((centre, r)), sign, .. } = &item.emitter
            && (emission.profile != Profile::Uniform || outward(*sign))
        {
            return emit_profile(scene, emission, item, i, *centre, *r, u_point, u_dir);
        }
        let LuminairePoint { q, error, n, uv, density: Density::Area(pdf), .. } = item.area_point(u_point)?
        else {
            return None;
        };
        // Two-sided emitters use what is left of the pick to choose the side.
        let (n, sides) = match emission.two_sided {
            true => (if rest < 0.5 { n } else { -n }, 2.0),
            false => (n, 1.0),
        };
        let local = cosine_direction(u_dir);
        let dir = Frame::from_normal(n).to_world(local).normalize();
        let radiance = emitted(scene, emission, n, uv, dir);
        let flux = radiance * (PI * sides / (pdf * item.pick));
        Some(EmittedParticle { origin: offset_origin(q, error, n, dir), dir, flux, luminaire: i as u32 })
    }

    fn emit_sky(
        &self,
        scene: &Scene,
        sky: usize,
        i: usize,
        u_point: [f32; 2],
        u_dir: [f32; 2],
    ) -> Option<EmittedParticle> {
        let (towards, pdf) = self.skies[sky].sample(scene, u_dir);
        let dir = -towards;
        let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u_point[0], u_point[1]));
        let frame = Frame::from_normal(dir);
        let (centre, radius) = self.bound;
        // A little wider than the ball, so that rounding does not cut its rim.
        let radius = radius * 1.0001;
        let origin = centre + (frame.s * x + frame.t * y) * radius - dir * (radius * 1.001);
        let radiance = {
            // Seen from behind the scene: a portal anywhere on the way counts.
            let end = centre + (frame.s * x + frame.t * y) * radius + dir * radius;
            self.skies[sky].radiance(scene, end, towards)
        };
        let flux = radiance * (PI * radius * radius / (pdf * self.items[i].pick));
        (pdf > 0.0).then_some(EmittedParticle { origin, dir, flux, luminaire: i as u32 })
    }
}

pub(super) fn emitted(scene: &Scene, e: &Emission, n: Vec3, uv: Vec2, w: Vec3) -> Rgb {
    if !e.two_sided && n.dot(w) <= 0.0 {
        return Rgb::BLACK;
    }
    let mut radiance = e.radiance;
    if let Some(image) = e.image {
        radiance *= texture::lookup(&scene.images[image.0 as usize], uv, Wrap::Clamp, false);
    }
    match &e.profile {
        Profile::Uniform => radiance,
        profile => radiance * profile_factor(scene, profile, w),
    }
}

fn profile_factor(scene: &Scene, profile: &Profile, w: Vec3) -> Rgb {
    match profile {
        Profile::Uniform => Rgb::WHITE,
        Profile::Spot { axis, cos_start, cos_end } => {
            let cos = axis.dot(w);
            let x = ((cos - cos_end) / (cos_start - cos_end).max(1e-9)).clamp(0.0, 1.0);
            Rgb::splat(x * x * (3.0 - 2.0 * x))
        }
        Profile::Goniometric { image, to_local } => {
            let d = to_local.transform_vector3(w.as_dvec3()).normalize_or_zero().as_vec3();
            let layout = hemilux_scene::EnvironmentLayout::EqualAreaOctahedral;
            let uv = super::environment::direction_to_uv(layout, d);
            texture::lookup(&scene.images[image.0 as usize], Vec2::new(uv.x, 1.0 - uv.y), Wrap::Clamp, false)
        }
        Profile::Projection { image, to_local, half_window } => {
            let d = to_local.transform_vector3(w.as_dvec3()).as_vec3();
            if d.z <= 0.0 {
                return Rgb::BLACK;
            }
            let st = Vec2::new(d.x / d.z / half_window.x, d.y / d.z / half_window.y);
            if st.x.abs() > 1.0 || st.y.abs() > 1.0 {
                return Rgb::BLACK;
            }
            let st = (st + Vec2::ONE) * 0.5;
            texture::lookup(&scene.images[image.0 as usize], st, Wrap::Clamp, false)
        }
    }
}

/// Emitted power per area by luminance (W·m⁻²).
pub(super) fn power_per_area(scene: &Scene, e: &Emission) -> f64 {
    let mut radiance = e.radiance;
    if let Some(image) = e.image {
        let texels = &scene.images[image.0 as usize].texels;
        let sum = texels.iter().fold([0f64; 3], |s, t| [0, 1, 2].map(|c| s[c] + t[c] as f64));
        radiance *= Rgb(sum.map(|v| (v / texels.len().max(1) as f64) as f32));
    }
    let mean = match &e.profile {
        Profile::Uniform => 1.0,
        Profile::Spot { cos_start, cos_end, .. } => 0.5 * (1.0 - 0.5 * (cos_start + cos_end)) as f64,
        // Mean over directions by a fixed set.
        profile => {
            let layout = hemilux_scene::EnvironmentLayout::EqualAreaOctahedral;
            let n = 64;
            let cell = |i: usize| (i as f32 + 0.5) / n as f32;
            let at = |x, y| super::environment::uv_to_direction(layout, Vec2::new(cell(x), cell(y)));
            let sum: f64 =
                (0..n * n).map(|i| profile_factor(scene, profile, at(i % n, i / n)).luminance() as f64).sum();
            sum / (n * n) as f64
        }
    };
    let sides = if e.two_sided { 2.0 } else { 1.0 };
    radiance.luminance().max(0.0) as f64 * std::f64::consts::PI * sides * mean
}

/// A particle of a small sphere whose radiance depends on direction only: direction first, then a point of the disk
/// that the sphere shows to it.
fn emit_profile(
    scene: &Scene,
    emission: &Emission,
    item: &Luminaire,
    i: usize,
    centre: DVec3,
    r: f64,
    u_point: [f32; 2],
    u_dir: [f32; 2],
) -> Option<EmittedParticle> {
    let (dir, pdf) = match emission.profile {
        Profile::Spot { axis, cos_end, .. } => {
            let height = 1.0 - cos_end;
            let x = u_dir[0] * height;
            let sin = (x * (2.0 - x)).max(0.0).sqrt();
            let (s, c) = (2.0 * PI * u_dir[1]).sin_cos();
            let local = Vec3::new(sin * c, sin * s, 1.0 - x);
            (Frame::from_normal(axis).to_world(local).normalize(), 0.5 / PI / height)
        }
        _ => {
            let z = 1.0 - 2.0 * u_dir[0];
            let rho = (1.0 - z * z).max(0.0).sqrt();
            let (s, c) = (2.0 * PI * u_dir[1]).sin_cos();
            (Vec3::new(rho * c, rho * s, z), 0.25 / PI)
        }
    };
    let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u_point[0], u_point[1]));
    let z = (1.0 - x * x - y * y).max(0.0).sqrt();
    let n = Frame::from_normal(dir).to_world(Vec3::new(x, y, z));
    let q = centre + n.as_dvec3() * r;
    let radiance = emission.radiance * profile_factor(scene, &emission.profile, dir);
    let flux = radiance * (PI * (r * r) as f32 / (pdf * item.pick));
    let error = (q.abs() * (2.0 * f32::EPSILON as f64)).as_vec3();
    Some(EmittedParticle {
        origin: offset_origin(q.as_vec3(), error, n, dir),
        dir,
        flux,
        luminaire: i as u32,
    })
}

fn cosine_direction(u: [f32; 2]) -> Vec3 {
    let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u[0], u[1]));
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}
