//! Sky and sun: radiance from infinity by direction, and sampling in proportion to it.
//!
//! Image environments use the equal-area octahedral map of Clarberg 2008 ("Fast equal-area mapping of the
//! (hemi)sphere using SIMD") in the orientation of pbrt-v4, or latitude and longitude. They are sampled by a piecewise
//! constant table over texels weighted by the solid angle of each.

use super::hierarchy::Receiver;
use super::texture;
use hemilux_scene::geom::{DVec3, Frame, Vec2, Vec3};
use hemilux_scene::{Environment, EnvironmentLayout, Rgb, Scene, Wrap};
use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A prepared environment.
#[derive(Clone, Debug)]
pub struct Sky {
    kind: Kind,
    /// ∫ L dω, W·m⁻².
    pub integral: Rgb,
    /// ∫ L w dω by luminance, W·m⁻².
    vector: Vec3,
}

#[derive(Clone, Debug)]
enum Kind {
    Constant(Rgb),
    Sun { frame: Frame, radiance: Rgb, /* 1 - cos of the half-angle */ height: f64 },
    Image { index: usize, layout: EnvironmentLayout, table: Table },
}

impl Sky {
    /// Prepare environment number `index` of the scene.
    pub fn new(scene: &Scene, index: usize) -> Sky {
        match &scene.environments[index] {
            Environment::Constant { radiance } => {
                let integral = *radiance * (4.0 * PI);
                Sky { kind: Kind::Constant(*radiance), integral, vector: Vec3::ZERO }
            }
            Environment::Sun { direction, cos_half_angle, radiance } => {
                let height = 1.0 - cos_half_angle;
                let solid_angle = 2.0 * std::f64::consts::PI * height;
                let frame = Frame::from_normal(*direction);
                let integral = *radiance * solid_angle as f32;
                let vector = frame.n * integral.luminance();
                Sky { kind: Kind::Sun { frame, radiance: *radiance, height }, integral, vector }
            }
            Environment::Image { image, scale, layout, to_world, .. } => {
                let image = &scene.images[image.0 as usize];
                let (w, h) = (image.width as usize, image.height as usize);
                let total = 4.0 * std::f64::consts::PI;
                let row_weight = |y: usize| match layout {
                    EnvironmentLayout::EqualAreaOctahedral => total / (w * h) as f64,
                    EnvironmentLayout::LatLong => {
                        let cos = |y: usize| (y as f64 / h as f64 * std::f64::consts::PI).cos();
                        2.0 * std::f64::consts::PI * (cos(y) - cos(y + 1)) / w as f64
                    }
                };
                let mut integral = [0f64; 3];
                let mut vector = DVec3::ZERO;
                let mut weights = Vec::with_capacity(w * h);
                for y in 0..h {
                    for x in 0..w {
                        let v = image.texels[y * w + x] * *scale;
                        (0..3).for_each(|c| integral[c] += v[c] as f64 * row_weight(y));
                        let weight = v.luminance().max(0.0) as f64 * row_weight(y);
                        let uv = Vec2::new((x as f32 + 0.5) / w as f32, (y as f32 + 0.5) / h as f32);
                        vector += uv_to_direction(*layout, uv).as_dvec3() * weight;
                        weights.push(weight);
                    }
                }
                let vector = (to_world.matrix3 * vector).as_vec3();
                let table = Table::new(w, h, &floored(&weights));
                Sky {
                    kind: Kind::Image { index, layout: *layout, table },
                    integral: Rgb(integral.map(|v| v as f32)),
                    vector,
                }
            }
        }
    }

    /// Radiance that arrives at `from` from unit direction `dir`. The place matters only behind a portal.
    pub fn radiance(&self, scene: &Scene, from: Vec3, dir: Vec3) -> Rgb {
        match &self.kind {
            Kind::Constant(l) => *l,
            Kind::Sun { frame, radiance, height } => {
                // 1 − cos by the chord, which keeps its digits for small angles.
                let inside = 0.5 * (dir - frame.n).length_squared() as f64 <= *height;
                if inside { *radiance } else { Rgb::BLACK }
            }
            Kind::Image { index, layout, .. } => {
                let Environment::Image { image, scale, to_world, portal, .. } = &scene.environments[*index]
                else {
                    return Rgb::BLACK;
                };
                if let Some(corners) = portal
                    && !through_portal(corners, from, dir)
                {
                    return Rgb::BLACK;
                }
                let local = to_world.matrix3.inverse().mul_vec3(dir.as_dvec3()).normalize().as_vec3();
                let uv = direction_to_uv(*layout, local);
                let st = Vec2::new(uv.x, 1.0 - uv.y);
                texture::lookup(&scene.images[image.0 as usize], st, Wrap::Clamp, true) * *scale
            }
        }
    }

    /// A direction in proportion to radiance, and its density per solid angle.
    pub fn sample(&self, scene: &Scene, u: [f32; 2]) -> (Vec3, f32) {
        match &self.kind {
            Kind::Constant(_) => {
                let z = 1.0 - 2.0 * u[0];
                let r = (1.0 - z * z).max(0.0).sqrt();
                let (s, c) = (2.0 * PI * u[1]).sin_cos();
                (Vec3::new(r * c, r * s, z), 0.25 / PI)
            }
            Kind::Sun { frame, height, .. } => {
                let x = u[0] as f64 * height;
                let sin = (x * (2.0 - x)).max(0.0).sqrt() as f32;
                let (s, c) = (2.0 * PI * u[1]).sin_cos();
                let dir = frame.to_world(Vec3::new(sin * c, sin * s, (1.0 - x) as f32)).normalize();
                (dir, (0.5 / std::f64::consts::PI / height) as f32)
            }
            Kind::Image { index, layout, table } => {
                let Environment::Image { to_world, .. } = &scene.environments[*index] else {
                    return (Vec3::Z, 0.0);
                };
                let (uv, density) = table.sample(u);
                let local = uv_to_direction(*layout, uv);
                let dir = to_world.matrix3.mul_vec3(local.as_dvec3()).normalize().as_vec3();
                (dir, density / steradians_per_square(*layout, uv))
            }
        }
    }

    /// [`Sky::sample`] for a known receiver: a constant sky by cosine where only one side counts.
    pub(super) fn sample_for(&self, scene: &Scene, at: &Receiver, u: [f32; 2]) -> (Vec3, f32) {
        match self.kind {
            Kind::Constant(_) if at.is_one_sided() => {
                let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u[0], u[1]));
                let z = (1.0 - x * x - y * y).max(0.0).sqrt();
                (Frame::from_normal(at.n).to_world(Vec3::new(x, y, z)).normalize(), z / PI)
            }
            _ => self.sample(scene, u),
        }
    }

    /// Density of [`Sky::sample_for`] per solid angle.
    pub(super) fn pdf_for(&self, scene: &Scene, at: &Receiver, dir: Vec3) -> f32 {
        match self.kind {
            Kind::Constant(_) if at.is_one_sided() => at.n.dot(dir).max(0.0) / PI,
            _ => self.pdf_solid_angle(scene, dir),
        }
    }

    /// Estimated irradiance at `at` without occlusion, by luminance (W·m⁻²): exact for a constant sky and a sun, between
    /// them otherwise; zero only where nothing can arrive.
    pub(super) fn irradiance(&self, at: &Receiver) -> f32 {
        let whole = self.integral.luminance().max(0.0);
        if at.n == Vec3::ZERO {
            return 0.5 * whole;
        }
        match self.kind {
            Kind::Sun { ref frame, height, .. } => {
                let cos = at.n.dot(frame.n);
                let cos = if at.both_sides { cos.abs() } else { cos };
                // The disk may rise where its centre does not.
                let sin = (height * (2.0 - height)).max(0.0).sqrt() as f32;
                whole * (cos.max(0.0) + if cos > -sin - 1e-6 { sin + 1e-6 } else { 0.0 })
            }
            _ => {
                // ∫ L max(0, cos) = (∫ L cos + ∫ L |cos|) / 2, the latter by its value for an even sky.
                let net = at.n.dot(self.vector);
                let net = if at.both_sides { net.abs() } else { net };
                (0.5 * (net + net.abs().max(0.5 * whole))).max(0.05 * whole)
            }
        }
    }

    /// Density of [`Sky::sample`] per solid angle.
    pub fn pdf_solid_angle(&self, scene: &Scene, dir: Vec3) -> f32 {
        match &self.kind {
            Kind::Constant(_) => 0.25 / PI,
            Kind::Sun { frame, height, .. } => {
                let inside = 0.5 * (dir - frame.n).length_squared() as f64 <= *height;
                if inside { (0.5 / std::f64::consts::PI / height) as f32 } else { 0.0 }
            }
            Kind::Image { index, layout, table } => {
                let Environment::Image { to_world, .. } = &scene.environments[*index] else { return 0.0 };
                let local = to_world.matrix3.inverse().mul_vec3(dir.as_dvec3()).normalize().as_vec3();
                let uv = direction_to_uv(*layout, local);
                table.density(uv) / steradians_per_square(*layout, uv)
            }
        }
    }
}

/// Whether the ray from `from` along `dir` passes through the window (a parallelogram given by its corners in turn).
fn through_portal(corners: &[Vec3; 4], from: Vec3, dir: Vec3) -> bool {
    let [a, b, _, d] = corners.map(|c| c.as_dvec3());
    let (from, dir) = (from.as_dvec3(), dir.as_dvec3());
    let (e1, e2) = (b - a, d - a);
    let n = e1.cross(e2);
    let facing = n.dot(dir);
    let t = n.dot(a - from) / facing;
    if facing == 0.0 || t.is_nan() || t <= 0.0 {
        return false;
    }
    let p = from + dir * t - a;
    let (u, v) = (p.cross(e2).dot(n), e1.cross(p).dot(n));
    let all = n.length_squared();
    (0.0..=all).contains(&u) && (0.0..=all).contains(&v)
}

/// Look-ups are nearest-texel, but rounding may fall on either side of an edge: a floor keeps the density positive.
fn floored(weights: &[f64]) -> Vec<f64> {
    let mean = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    weights.iter().map(|w| w.max(1e-3 * mean)).collect()
}

fn steradians_per_square(layout: EnvironmentLayout, uv: Vec2) -> f32 {
    match layout {
        EnvironmentLayout::EqualAreaOctahedral => 4.0 * PI,
        EnvironmentLayout::LatLong => (2.0 * PI * PI * (uv.y * PI).sin()).max(1e-20),
    }
}

/// Unit direction to image coordinates, (0, 0) at the first texel of the first row.
pub fn direction_to_uv(layout: EnvironmentLayout, d: Vec3) -> Vec2 {
    match layout {
        EnvironmentLayout::EqualAreaOctahedral => {
            let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
            let r = (1.0 - z).max(0.0).sqrt();
            let (a, b) = (x.max(y), x.min(y));
            let mut phi = if a == 0.0 { 0.0 } else { (b / a).atan() / FRAC_PI_2 };
            if x < y {
                phi = 1.0 - phi;
            }
            let (mut v, mut u) = (phi * r, r - phi * r);
            if d.z < 0.0 {
                (u, v) = (1.0 - v, 1.0 - u);
            }
            Vec2::new(0.5 * (u.copysign(d.x) + 1.0), 0.5 * (v.copysign(d.y) + 1.0))
        }
        EnvironmentLayout::LatLong => {
            let phi = d.y.atan2(d.x);
            let u = phi / (2.0 * PI);
            Vec2::new(if u < 0.0 { u + 1.0 } else { u }, d.z.clamp(-1.0, 1.0).acos() / PI)
        }
    }
}

/// Image coordinates to unit direction; inverse of [`direction_to_uv`].
pub fn uv_to_direction(layout: EnvironmentLayout, uv: Vec2) -> Vec3 {
    match layout {
        EnvironmentLayout::EqualAreaOctahedral => {
            let (u, v) = (2.0 * uv.x - 1.0, 2.0 * uv.y - 1.0);
            let (up, vp) = (u.abs(), v.abs());
            let signed = 1.0 - (up + vp);
            let d = signed.abs();
            let r = 1.0 - d;
            let phi = (if r == 0.0 { 1.0 } else { (vp - up) / r + 1.0 }) * FRAC_PI_4;
            let z = (1.0 - r * r).copysign(signed);
            let s = r * (2.0 - r * r).max(0.0).sqrt();
            Vec3::new((s * phi.cos()).copysign(u), (s * phi.sin()).copysign(v), z)
        }
        EnvironmentLayout::LatLong => {
            let (sp, cp) = (2.0 * PI * uv.x).sin_cos();
            let (st, ct) = (PI * uv.y).sin_cos();
            Vec3::new(st * cp, st * sp, ct)
        }
    }
}

/// Piecewise constant density over a grid on the unit square, sampled by rows, then columns.
#[derive(Clone, Debug)]
struct Table {
    width: usize,
    height: usize,
    /// Per row, `width + 1` cumulative sums, normalised.
    rows: Vec<f32>,
    /// Cumulative sums over rows, normalised.
    marginal: Vec<f32>,
    /// Density per unit of the square.
    density: Vec<f32>,
}

impl Table {
    fn new(width: usize, height: usize, weights: &[f64]) -> Table {
        let total: f64 = weights.iter().sum();
        let mut rows = Vec::with_capacity((width + 1) * height);
        let mut marginal = vec![0f32];
        let mut sum = 0.0;
        for row in weights.chunks_exact(width) {
            let row_sum: f64 = row.iter().sum();
            let mut acc = 0.0;
            rows.push(0.0);
            for (x, w) in row.iter().enumerate() {
                acc += w;
                let even = (x + 1) as f64 / width as f64;
                rows.push((if row_sum > 0.0 { acc / row_sum } else { even }) as f32);
            }
            sum += row_sum;
            marginal
                .push((if total > 0.0 { sum / total } else { marginal.len() as f64 / height as f64 }) as f32);
        }
        let cells = (width * height) as f64;
        let density =
            weights.iter().map(|w| if total > 0.0 { (w / total * cells) as f32 } else { 1.0 }).collect();
        Table { width, height, rows, marginal, density }
    }

    fn sample(&self, u: [f32; 2]) -> (Vec2, f32) {
        let (y, fy) = invert(&self.marginal, u[1]);
        let row = &self.rows[y * (self.width + 1)..(y + 1) * (self.width + 1)];
        let (x, fx) = invert(row, u[0]);
        let uv = Vec2::new((x as f32 + fx) / self.width as f32, (y as f32 + fy) / self.height as f32);
        (uv, self.density[y * self.width + x])
    }

    fn density(&self, uv: Vec2) -> f32 {
        let x = ((uv.x * self.width as f32) as usize).min(self.width - 1);
        let y = ((uv.y * self.height as f32) as usize).min(self.height - 1);
        self.density[y * self.width + x]
    }
}

/// Interval of the cumulative table that holds `u`, and where within it.
fn invert(cumulative: &[f32], u: f32) -> (usize, f32) {
    let i = cumulative.partition_point(|&c| c <= u).clamp(1, cumulative.len() - 1) - 1;
    let width = cumulative[i + 1] - cumulative[i];
    let f = if width > 0.0 { ((u - cumulative[i]) / width).clamp(0.0, 1.0 - f32::EPSILON) } else { 0.5 };
    (i, f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::Key;

    #[test]
    fn layouts_invert_and_the_octahedral_one_keeps_area() {
        let key = Key::new(3);
        let mut mean = Vec3::ZERO;
        let n = 4096;
        for i in 0..n {
            let u = hemiquad::points::sobol(i, key);
            let uv = Vec2::new(u.u, u.v);
            for layout in [EnvironmentLayout::EqualAreaOctahedral, EnvironmentLayout::LatLong] {
                let d = uv_to_direction(layout, uv);
                assert!((d.length() - 1.0).abs() < 1e-5);
                let back = direction_to_uv(layout, d);
                let again = uv_to_direction(layout, back);
                assert!((again - d).length() < 2e-3, "{layout:?} {uv} {d} {back}");
            }
            mean += uv_to_direction(EnvironmentLayout::EqualAreaOctahedral, uv);
        }
        // The first moment of a uniform sphere is zero.
        assert!((mean / n as f32).length() < 0.02);
    }

    #[test]
    fn a_portal_lets_through_what_crosses_it() {
        let corners = [[0.0, 0.0, 1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0], [0.0, 1.0, 1.0]].map(Vec3::from);
        let through = |from: [f32; 3], to: [f32; 3]| {
            let from = Vec3::from(from);
            through_portal(&corners, from, (Vec3::from(to) - from).normalize())
        };
        assert!(through([0.5, 0.5, 0.0], [1.9, 0.9, 1.0]) && through([0.5, 0.5, 3.0], [0.1, 0.1, 1.0]));
        assert!(!through([0.5, 0.5, 0.0], [2.1, 0.5, 1.0]) && !through([0.5, 0.5, 0.0], [0.5, -0.1, 1.0]));
        // Looking away from it, or along its plane.
        assert!(!through([0.5, 0.5, 2.0], [0.5, 0.5, 3.0]) && !through([0.5, 0.5, 1.0], [1.0, 0.5, 1.0]));
    }

    #[test]
    fn table_samples_what_its_density_says() {
        let weights: Vec<f64> = (0..12).map(|i| (i * i % 7) as f64).collect();
        let table = Table::new(4, 3, &weights);
        let mut counts = [0f64; 12];
        let n = 1 << 14;
        for i in 0..n {
            let u = hemiquad::points::sobol(i, Key::new(9));
            let (uv, density) = table.sample([u.u, u.v]);
            assert_eq!(density, table.density(uv));
            counts[(uv.y * 3.0) as usize * 4 + (uv.x * 4.0) as usize] += 1.0 / n as f64;
        }
        let total: f64 = weights.iter().sum();
        for (c, w) in counts.iter().zip(&weights) {
            assert!((c - w / total).abs() < 2e-3, "{counts:?}");
        }
    }
}
