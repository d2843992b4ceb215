//! Luminaires: infinite ones become environments, those without extent wait to become spheres ([`super::finish`]).
//!
//! pbrt divides every emission spectrum by its luminance, so that `L`, `I` and `scale` are luminances (up to 683 lm/W);
//! an RGB value keeps its own luminance. `power` replaces the scale by what makes a white emitter of that total power.

use super::builder::{AreaLight, Builder, PointLight};
use super::colour::Meaning;
use super::params::{Params, Type};
use super::pbrt_texture::{half_window, mean_luminance};
use super::texture_file::Encoding;
use crate::geom::{DAffine3, DVec3};
use crate::{Emission, Environment, EnvironmentLayout, ImageId, Profile, Rgb, Span, TextureImage};
use glam::DMat3;
use std::f64::consts::PI;
use std::path::PathBuf;
use std::rc::Rc;

/// Angular radius of the sun, degrees.
pub const SUN_RADIUS: f64 = 0.2665;

const KINDS: [&str; 6] = ["point", "spot", "distant", "infinite", "goniometric", "projection"];

impl Builder {
    pub fn area_light_source(&mut self, kind: &str, mut params: Params, at: Span) {
        if !self.require_world("AreaLightSource", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        if kind != "diffuse" {
            log.unknown_among(
                params.span,
                format!("unknown area light source \"{kind}\""),
                kind,
                ["diffuse"],
            );
            return;
        }
        params.inherit(&self.state.attributes.light);
        let radiance = params.spectrum(&env, "L", Meaning::Illuminant);
        let image = self.light_image(&params);
        if image.is_some() && radiance.is_some() {
            log.error(params.span_of("filename"), "an area light source has either \"L\" or \"filename\"");
        }
        let scale = params.not_negative(log, "scale", 1.0);
        let power = params.float_opt(log, "power").filter(|p| *p > 0.0);
        let two_sided = params.boolean(log, "twosided", false);
        params.finish(log);
        let radiance = radiance.unwrap_or(Rgb::WHITE) * scale as f32;
        let emission = Emission { radiance, image, two_sided, profile: Profile::Uniform };
        self.state.area_light = Some(Rc::new(AreaLight { emission, power, span: at }));
    }

    fn light_image(&mut self, params: &Params) -> Option<ImageId> {
        let file = params.text(&self.env.clone().log, "filename")?.to_owned();
        self.image(&file, params.value_span("filename"), Encoding::Srgb)
    }

    /// The emission of one shape of `area` (m²).
    pub fn emission(&self, light: &AreaLight, area: f64) -> Emission {
        let mut emission = light.emission.clone();
        if let Some(power) = light.power {
            let sides = if emission.two_sided { 2.0 } else { 1.0 };
            let image = emission.image.map_or(1.0, |i| mean_luminance(&self.images[i.0 as usize]));
            let k = area * PI * sides * image;
            if k > 0.0 {
                emission.radiance *= (power / k) as f32;
            }
        }
        emission
    }

    pub fn light_source(&mut self, kind: &str, mut params: Params, at: Span) {
        if !self.require_world("LightSource", at) {
            return;
        }
        params.inherit(&self.state.attributes.light);
        match kind {
            "infinite" => self.infinite(&params),
            "distant" => self.distant(&params, at),
            "point" => self.point(&params, at),
            "spot" => self.spot(&params, at),
            "goniometric" => self.goniometric(&params, at),
            "projection" => self.projection(&params, at),
            _ => {
                let message = format!("unknown light source \"{kind}\"");
                self.env.log.unknown_among(params.span, message, kind, KINDS);
                return;
            }
        }
        params.finish(&self.env.log);
    }

    fn infinite(&mut self, params: &Params) {
        let env = self.env.clone();
        let log = &env.log;
        let radiance = params.spectrum(&env, "L", Meaning::Illuminant);
        let mut scale = params.not_negative(log, "scale", 1.0);
        let illuminance = params.float_opt(log, "illuminance").filter(|e| *e > 0.0);
        let portal = self.portal(params);
        let has_image = params.has("filename");
        if has_image && radiance.is_some() {
            log.error(params.span_of("L"), "an infinite light source has either \"L\" or \"filename\"");
        }
        let image = self.light_image(params);
        if has_image && image.is_none() {
            return;
        }
        let radiance = radiance.unwrap_or(Rgb::WHITE);
        let image = match (image, portal) {
            (Some(image), _) => {
                let file = &self.images[image.0 as usize];
                if file.width != file.height {
                    let (w, h) = (file.width, file.height);
                    let message = format!(
                        "an environment map is square (equal-area octahedral), this one has {w} x {h} pixels"
                    );
                    let help = "convert a latitude-longitude map with pbrt's \"imgtool makeequiarea\"";
                    log.error_help(params.value_span("filename"), message, help);
                    return;
                }
                if let Some(e) = illuminance {
                    let now = upper_illuminance(file);
                    scale *= if now > 0.0 { e / now } else { 0.0 };
                    let message =
                        "\"illuminance\" is met exactly (pbrt's environment maps come out twice as bright)";
                    log.note(params.span_of("illuminance"), message);
                }
                image
            }
            (None, None) => {
                let scale = illuminance.map_or(scale, |e| scale * e / PI);
                self.environments.push(Environment::Constant { radiance: radiance * scale as f32 });
                return;
            }
            (None, Some(_)) => {
                scale *= illuminance.map_or(1.0, |e| e / PI);
                let (texels, path) = (vec![Rgb::WHITE], PathBuf::new());
                self.add_image(TextureImage { width: 1, height: 1, texels, alpha: None, path })
            }
        };
        self.environments.push(Environment::Image {
            image,
            scale: radiance * scale as f32,
            layout: EnvironmentLayout::EqualAreaOctahedral,
            to_world: DAffine3::from_mat3(self.state.ctm.matrix3),
            portal,
        });
    }

    fn portal(&self, params: &Params) -> Option<[crate::geom::Vec3; 4]> {
        let log = &self.env.log;
        let points = params.tuples::<3>(log, "portal", &[Type::Point3])?;
        let corners: Result<[[f64; 3]; 4], _> = points.as_slice().try_into();
        let Ok(corners) = corners else {
            let message = format!("a portal has 4 points, not {}", points.len());
            log.error(params.value_span("portal"), message);
            return None;
        };
        let p = corners.map(DVec3::from);
        let (a, b) = (p[1] - p[0], p[3] - p[0]);
        let size = a.length().max(b.length());
        let parallelogram = (p[0] + a + b - p[2]).length() <= 1e-3 * size;
        let square_on = a.dot(b).abs() <= 1e-3 * a.length() * b.length();
        if !(parallelogram && square_on && a.cross(b).length() > 0.0) {
            log.error(params.value_span("portal"), "a portal must be a rectangle");
            return None;
        }
        Some(p.map(|v| v.as_vec3()))
    }

    /// Emission times scale of a luminaire that may also be given by `from` and `to`.
    fn strength(&self, params: &Params, name: &'static str) -> Rgb {
        let value = params.spectrum(&self.env, name, Meaning::Illuminant).unwrap_or(Rgb::WHITE);
        value * params.not_negative(&self.env.log, "scale", 1.0) as f32
    }

    fn power(&self, params: &Params) -> Option<f64> {
        params.float_opt(&self.env.log, "power").filter(|p| *p > 0.0)
    }

    fn distant(&mut self, params: &Params, at: Span) {
        let env = self.env.clone();
        let log = &env.log;
        let mut irradiance = self.strength(params, "L");
        if let Some(e) = params.float_opt(log, "illuminance").filter(|e| *e > 0.0) {
            irradiance *= e as f32;
        }
        let from = params.point3(log, "from", DVec3::ZERO);
        let to = params.point3(log, "to", DVec3::Z);
        let Some(direction) = self.state.ctm.transform_vector3(from - to).try_normalize() else {
            log.error(params.span_of("to"), "\"from\" and \"to\" must not coincide");
            return;
        };
        let (sin, cos) = SUN_RADIUS.to_radians().sin_cos();
        let radiance = irradiance * (1.0 / (PI * sin * sin)) as f32;
        log.note(at, format!("the distant light source became a disk of angular radius {SUN_RADIUS}°"));
        let direction = direction.as_vec3().normalize();
        self.environments.push(Environment::Sun { direction, cos_half_angle: cos, radiance });
    }

    fn add_point(&mut self, from: DVec3, intensity: Rgb, profile: Profile, span: Span) {
        let position = self.state.ctm.transform_point3(from);
        self.point_lights.push(PointLight { position, intensity, profile, span });
    }

    fn point(&mut self, params: &Params, at: Span) {
        let mut intensity = self.strength(params, "I");
        if let Some(power) = self.power(params) {
            intensity *= (power / (4.0 * PI)) as f32;
        }
        let from = params.point3(&self.env.log, "from", DVec3::ZERO);
        self.add_point(from, intensity, Profile::Uniform, at);
    }

    fn spot(&mut self, params: &Params, at: Span) {
        let env = self.env.clone();
        let log = &env.log;
        let mut intensity = self.strength(params, "I");
        let inside = |v: f64| v > 0.0 && v <= 180.0;
        let cone = params.float_in(log, "coneangle", 30.0, "between 0 and 180 degrees", inside);
        let delta = params.float_in(log, "conedeltaangle", 5.0, "between 0 and the cone angle", |v| {
            (0.0..=cone).contains(&v)
        });
        let (start, end) = ((cone - delta).to_radians().cos(), cone.to_radians().cos());
        if let Some(power) = self.power(params) {
            // ∫ smoothstep over its band is half the band.
            let k = 2.0 * PI * ((1.0 - start) + (start - end) / 2.0);
            intensity *= (power / k) as f32;
        }
        let from = params.point3(log, "from", DVec3::ZERO);
        let to = params.point3(log, "to", DVec3::Z);
        let Some(axis) = self.state.ctm.transform_vector3(to - from).try_normalize() else {
            log.error(params.span_of("to"), "\"from\" and \"to\" must not coincide");
            return;
        };
        let axis = axis.as_vec3().normalize();
        let profile = Profile::Spot { axis, cos_start: start as f32, cos_end: end as f32 };
        self.add_point(from, intensity, profile, at);
    }

    fn goniometric(&mut self, params: &Params, at: Span) {
        let mut intensity = self.strength(params, "I");
        let power = self.power(params);
        let profile = match self.light_image(params) {
            Some(image) => {
                let file = &self.images[image.0 as usize];
                if file.width != file.height {
                    let (w, h) = (file.width, file.height);
                    let message = format!(
                        "a goniometric image is square (equal-area octahedral), this one has {w} x {h} pixels"
                    );
                    self.env.log.error(params.value_span("filename"), message);
                }
                if let Some(power) = power {
                    let k = 4.0 * PI * mean_luminance(file);
                    intensity *= if k > 0.0 { (power / k) as f32 } else { 0.0 };
                }
                // The image's pole is y: its axes are the luminaire's with y and z exchanged.
                let swap = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
                let to_world = self.state.ctm.matrix3 * swap;
                Profile::Goniometric { image, to_local: DAffine3::from_mat3(to_world.inverse()) }
            }
            None => {
                intensity *= power.map_or(1.0, |p| (p / (4.0 * PI)) as f32);
                Profile::Uniform
            }
        };
        let from = params.point3(&self.env.log, "from", DVec3::ZERO);
        self.add_point(from, intensity, profile, at);
    }

    fn projection(&mut self, params: &Params, at: Span) {
        let env = self.env.clone();
        let log = &env.log;
        let mut intensity = self.strength(params, "I");
        let inside = |v: f64| v as f32 > 0.0 && (v as f32) < 180.0;
        let fov = params.float_in(log, "fov", 90.0, "between 0 and 180 degrees", inside);
        let power = self.power(params);
        if !params.has("filename") {
            log.error(params.span, "light source \"projection\" has no \"string filename\"");
            return;
        }
        let Some(image) = self.light_image(params) else { return };
        let file = &self.images[image.0 as usize];
        let half_window = half_window(fov, file.width, file.height);
        if let Some(power) = power {
            let k = projected_power(file, half_window.x.into(), half_window.y.into());
            intensity *= if k > 0.0 { (power / k) as f32 } else { 0.0 };
        }
        let from = params.point3(log, "from", DVec3::ZERO);
        let to_local = DAffine3::from_mat3(self.state.ctm.matrix3.inverse());
        self.add_point(from, intensity, Profile::Projection { image, to_local, half_window }, at);
    }
}

/// ∫ luminance dω over the window of a projector.
fn projected_power(image: &TextureImage, half_x: f64, half_y: f64) -> f64 {
    let (w, h) = (image.width as usize, image.height as usize);
    let cell = 4.0 * half_x * half_y / (w * h) as f64;
    let mut sum = 0.0;
    for (i, texel) in image.texels.iter().enumerate() {
        let x = (2.0 * ((i % w) as f64 + 0.5) / w as f64 - 1.0) * half_x;
        let y = (2.0 * ((i / w) as f64 + 0.5) / h as f64 - 1.0) * half_y;
        // dω = cos³θ dA on the plane z = 1.
        sum += f64::from(texel.luminance()) * (1.0 + x * x + y * y).powf(-1.5) * cell;
    }
    sum
}

/// Illuminance that the upper half of an equal-area octahedral map gives to a horizontal plane.
fn upper_illuminance(image: &TextureImage) -> f64 {
    let n = image.width as usize;
    let mut sum = 0.0;
    for (i, texel) in image.texels.iter().enumerate() {
        // Clarberg's map: the upper hemisphere is the diamond |u| + |v| < 1; there z = 1 − r², r = |u| + |v|.
        let u = 2.0 * ((i % n) as f64 + 0.5) / n as f64 - 1.0;
        let v = 2.0 * ((i / n) as f64 + 0.5) / n as f64 - 1.0;
        let r = u.abs() + v.abs();
        sum += f64::from(texel.luminance()) * (1.0 - r * r).max(0.0);
    }
    sum * 4.0 * PI / image.texels.len().max(1) as f64
}
