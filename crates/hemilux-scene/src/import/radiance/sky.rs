//! Skies: the patterns that `gensky` and `gendaylit` name, as images of the sky.
//!
//! CIE clear (CIE 22, 1973), overcast (Moon and Spencer 1942), uniform and intermediate (Nakamura et al. 1985) skies, and
//! the all-weather model of Perez, Seals and Michalsky 1993. Radiance's patterns fade from sky to ground over a few
//! degrees around the horizon, by weights (z + 1.01)^±10; so do these.

use super::transform::{self, Similarity};
use super::{Argument, Reader};
use crate::geom::{DAffine3, DMat4, DVec3};
use crate::{Environment, EnvironmentLayout, ImageId, Rgb, Span, TextureImage};
use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

/// Cells of a sky's image. A multiple of 2 down, so that the horizon is an edge between rows.
pub const WIDTH: usize = 1024;
/// Rows.
pub const HEIGHT: usize = 512;

/// A sky's relative radiance by direction (z up).
#[derive(Clone, Copy, Debug)]
pub enum Sky {
    /// 1 clear, 2 overcast, 3 uniform, 4 intermediate.
    Cie { kind: u8, zenith: f64, ground: f64, normalisation: f64, sun: DVec3 },
    /// Perez's five coefficients.
    Perez { diffuse: f64, ground: f64, c: [f64; 5], sun: DVec3 },
}

impl Sky {
    /// From the numbers of the pattern; which one is told by the function's name. `None` if they are of no sky.
    pub fn new(function: &str, v: &[f64]) -> Option<Sky> {
        let at = |i: usize| v.get(i).copied();
        let sun = |i: usize| Some(DVec3::new(at(i)?, at(i + 1)?, at(i + 2)?).normalize_or(DVec3::Z));
        if function == "skybright" {
            let c = [at(2)?, at(3)?, at(4)?, at(5)?, at(6)?];
            return Some(Sky::Perez { diffuse: at(0)?, ground: at(1)?, c, sun: sun(7)? });
        }
        let kind = at(0)?.round() as i64;
        let (normalisation, sun) = match kind {
            1 | 4 => (at(3)?, sun(4)?),
            2 | 3 => (1.0, DVec3::Z),
            _ => return None,
        };
        Some(Sky::Cie { kind: kind as u8, zenith: at(1)?, ground: at(2)?, normalisation, sun })
    }

    /// Radiance of the sky proper.
    fn above(&self, d: DVec3) -> f64 {
        let z = d.z;
        match *self {
            Sky::Cie { kind, zenith, normalisation, sun, .. } => {
                let cos = d.dot(sun).clamp(-1.0, 1.0);
                match kind {
                    2 => zenith * (1.0 + 2.0 * z) / 3.0,
                    3 => zenith,
                    1 => {
                        let gamma = cos.acos();
                        let indicatrix = 0.91 + 10.0 * (-3.0 * gamma).exp() + 0.45 * cos * cos;
                        let gradation = if z > 0.01 { 1.0 - (-0.32 / z).exp() } else { 1.0 };
                        zenith * indicatrix * gradation / normalisation
                    }
                    _ => {
                        let (gamma, eta, zs) =
                            (cos.acos(), z.clamp(-1.0, 1.0).acos(), sun.z.clamp(-1.0, 1.0).acos());
                        let a = (1.35 * (5.631 - 3.59 * eta).sin() + 3.12) * (4.396 - 2.6 * zs).sin() + 6.37
                            - eta;
                        let b = (-0.563 * gamma * ((2.629 - eta) * (1.562 - zs) + 0.812)).exp();
                        zenith * a / 2.326 * b / normalisation
                    }
                }
            }
            Sky::Perez { diffuse, c, sun, .. } => {
                let cos = d.dot(sun).clamp(-1.0, 1.0);
                diffuse * perez(&c, z.max(0.01), cos)
            }
        }
    }

    /// Radiance from direction `d` (unit), ground included; never negative.
    pub fn radiance(&self, d: DVec3) -> f64 {
        let (Sky::Cie { ground, .. } | Sky::Perez { ground, .. }) = *self;
        let up = (d.z + 1.01).max(1e-3).powi(10);
        // Below, the sky's share is too small to matter.
        let share = up * up / (up * up + 1.0);
        let sky = if share > 1e-9 { self.above(d) } else { 0.0 };
        let v = share * sky + (1.0 - share) * ground;
        if v.is_finite() { v.max(0.0) } else { 0.0 }
    }
}

/// Relative luminance of Perez's model at cosine `z` from the zenith and cosine `cos` from the sun.
pub fn perez(c: &[f64; 5], z: f64, cos: f64) -> f64 {
    let gamma = cos.clamp(-1.0, 1.0).acos();
    (1.0 + c[0] * (c[1] / z).exp()) * (1.0 + c[2] * (c[3] * gamma).exp() + c[4] * cos * cos)
}

/// Mean of `f` over every cell of a latitude-longitude image (by two Gauss points in azimuth and in height: exact for
/// cubics), times the part of the cell within the cone of cosine `cos_half` around `axis`.
fn rasterise(f: impl Fn(DVec3) -> f64, axis: DVec3, cos_half: f64) -> Vec<f32> {
    let gauss = 0.5 / 3f64.sqrt();
    let points = [0.5 - gauss, 0.5 + gauss];
    let azimuths: Vec<(f64, f64)> =
        (0..2 * WIDTH).map(|i| (((i / 2) as f64 + points[i % 2]) / WIDTH as f64 * TAU).sin_cos()).collect();
    // An angle no larger than this lies between a cell's middle and its corners.
    let reach = 1.5 * PI / HEIGHT as f64;
    let half = cos_half.clamp(-1.0, 1.0).acos();
    let mut cells = vec![0f32; WIDTH * HEIGHT];
    for y in 0..HEIGHT {
        let edge = |y: usize| if 2 * y == HEIGHT { 0.0 } else { (y as f64 / HEIGHT as f64 * PI).cos() };
        let (top, bottom) = (edge(y), edge(y + 1));
        let at = |u: f64| {
            let z = top + (bottom - top) * u;
            (z, (1.0 - z * z).max(0.0).sqrt())
        };
        let rings = points.map(at);
        for x in 0..WIDTH {
            let direction = |u: f64, v: f64| {
                let ((sin, cos), (z, r)) = (((x as f64 + u) / WIDTH as f64 * TAU).sin_cos(), at(v));
                DVec3::new(r * cos, r * sin, z)
            };
            let middle = axis.dot(direction(0.5, 0.5)).clamp(-1.0, 1.0).acos();
            let covered = if half >= PI || middle + reach < half {
                1.0
            } else if middle - reach > half {
                continue;
            } else {
                const N: usize = 16;
                let inside = (0..N * N).filter(|i| {
                    let d = direction(((i % N) as f64 + 0.5) / N as f64, ((i / N) as f64 + 0.5) / N as f64);
                    axis.dot(d) >= cos_half
                });
                inside.count() as f64 / (N * N) as f64
            };
            if covered == 0.0 {
                continue;
            }
            let mut sum = 0.0;
            for (z, r) in rings {
                for (sin, cos) in &azimuths[2 * x..2 * x + 2] {
                    sum += f(DVec3::new(r * cos, r * sin, z));
                }
            }
            cells[y * WIDTH + x] = (0.25 * sum * covered) as f32;
        }
    }
    cells
}

impl Reader {
    /// A source whose emission a sky modulates: an image, black outside the source's cone.
    pub(super) fn sky_source(&mut self, sky: usize, radiance: Rgb, direction: DVec3, angle: f64, span: Span) {
        if radiance.is_black() {
            return;
        }
        let (strings, numbers, frame) = self.definitions[sky].function();
        let (Some(model), arguments) = (Sky::new(&strings[0], numbers), &strings[2..]) else {
            self.env.log.error(span, "the sky has no known kind");
            return;
        };
        let arguments: Vec<Argument> =
            arguments.iter().map(|text| Argument { text: text.clone(), span }).collect();
        let placed = match transform::parse(&arguments) {
            Ok((all, used)) if all.len() == 1 && used == arguments.len() => all[0].then(frame),
            _ => {
                self.env.log.error(span, "the transformation of the sky is not understood");
                return;
            }
        };
        let to_sky = placed.map.matrix3.inverse();
        let turned = placed != Similarity::IDENTITY;
        let local = |d: DVec3| if turned { (to_sky * d).normalize_or(DVec3::Z) } else { d };
        let cos_half = (0.5 * angle).to_radians().cos();
        let cos_half = if angle == 180.0 { 0.0 } else { cos_half };
        let cells = rasterise(|d| model.radiance(local(d)), direction, cos_half);
        if cells.iter().any(|v| !v.is_finite()) {
            self.env.log.error(span, "the sky is not finite in single precision");
            return;
        }
        if cells.iter().all(|v| *v == 0.0) {
            return;
        }
        self.build.images.push(TextureImage {
            width: WIDTH as u32,
            height: HEIGHT as u32,
            texels: cells.into_iter().map(Rgb::splat).collect(),
            alpha: None,
            path: PathBuf::new(),
        });
        self.build.environments.push(Environment::Image {
            image: ImageId(self.build.images.len() as u32 - 1),
            scale: radiance,
            layout: EnvironmentLayout::LatLong,
            to_world: DAffine3::from_mat4(DMat4::IDENTITY),
            portal: None,
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn irradiance(cells: &[f32], normal: DVec3) -> f64 {
        let mut sum = 0.0;
        for y in 0..HEIGHT {
            let (t0, t1) = (y as f64 / HEIGHT as f64 * PI, (y + 1) as f64 / HEIGHT as f64 * PI);
            let (omega, z) = ((t0.cos() - t1.cos()) * TAU / WIDTH as f64, 0.5 * (t0.cos() + t1.cos()));
            for x in 0..WIDTH {
                let (s, c) = ((x as f64 + 0.5) / WIDTH as f64 * TAU).sin_cos();
                let r = (1.0 - z * z).sqrt();
                sum += cells[y * WIDTH + x] as f64 * omega * normal.dot(DVec3::new(r * c, r * s, z)).max(0.0);
            }
        }
        sum
    }

    #[test]
    fn cells_hold_means_and_cones_their_flux() {
        // A uniform cone of half angle 30° around the zenith: E = π sin² 30°; around x on a vertical plane the same.
        for axis in [DVec3::Z, DVec3::X, DVec3::new(1.0, 2.0, -0.7).normalize()] {
            let cells = rasterise(|_| 1.0, axis, 0.75f64.sqrt());
            let e = irradiance(&cells, axis);
            assert!((e / (0.25 * PI) - 1.0).abs() < 1e-3, "{axis}: {e}");
        }
        // The Moon–Spencer sky of zenith 1: E = 7π/9 before the fade at the horizon.
        let cells = rasterise(|d| (1.0 + 2.0 * d.z) / 3.0, DVec3::Z, 0.0);
        assert!((irradiance(&cells, DVec3::Z) / (7.0 * PI / 9.0) - 1.0).abs() < 1e-5);
        assert_eq!(cells[HEIGHT / 2 * WIDTH], 0.0, "nothing below the horizon");
        assert!(cells[(HEIGHT / 2 - 1) * WIDTH] > 0.3);
    }

    #[test]
    fn the_ground_shines_through_below() {
        let sky = Sky::new("skybr", &[3.0, 2.0, 0.5]).unwrap();
        assert!((sky.radiance(DVec3::Z) - 2.0).abs() < 1e-4);
        assert!((sky.radiance(DVec3::NEG_Z) - 0.5).abs() < 1e-12);
        // At the horizon: (1.01^10 · 2 + 1.01^-10 · 0.5) / (1.01^10 + 1.01^-10).
        let (a, b) = (1.01f64.powi(10), 1.01f64.powi(-10));
        assert!((sky.radiance(DVec3::X) - (a * 2.0 + b * 0.5) / (a + b)).abs() < 1e-9);
        assert!(
            Sky::new("skybr", &[1.0, 2.0, 0.5]).is_none() && Sky::new("skybr", &[7.0, 2.0, 0.5]).is_none()
        );
    }
}
