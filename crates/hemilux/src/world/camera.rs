//! Camera rays and pixel filters.
//!
//! A camera sample is importance-sampled from the pixel filter (Shirley 1990; Ernst, Stamminger and Greiner 2006), so
//! samples belong to one pixel alone and carry a signed weight of mean one.

use hemilux_scene::geom::{DVec3, Vec2, Vec3};
use hemilux_scene::{Camera, Filter, Projection, Scene, View, ViewKind};

/// A prepared camera.
#[derive(Clone, Debug)]
pub struct Lens {
    camera: Camera,
    window: [f64; 4],
    width: f64,
    height: f64,
    tan_half: f64,
    filter: FilterSampler,
}

/// A ray from the camera, and what it counts.
#[derive(Clone, Copy, Debug)]
pub struct CameraRay {
    /// World origin (m).
    pub origin: Vec3,
    /// Unit direction.
    pub dir: Vec3,
    /// Factor on the radiance: filter weight times the film's scale.
    pub weight: f32,
}

impl Lens {
    /// The scene's camera for a film of `width` × `height` pixels.
    pub fn new(scene: &Scene, width: u32, height: u32) -> Lens {
        let (w, h) = (width as f64, height as f64);
        let aspect = w / h;
        let window = match scene.camera.screen_window {
            Some(s) => s.map(|v| v as f64),
            None if aspect > 1.0 => [-aspect, aspect, -1.0, 1.0],
            None => [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect],
        };
        let tan_half = match scene.camera.projection {
            Projection::Perspective { fov } => (0.5 * fov as f64).to_radians().tan(),
            _ => 1.0,
        };
        let filter = FilterSampler::new(scene.filter);
        Lens { camera: scene.camera.clone(), window, width: w, height: h, tan_half, filter }
    }

    /// The ray of pixel (x, y), row 0 on top: `u_film` places it in the filter, `u_lens` on the lens.
    pub fn ray(&self, x: u32, y: u32, u_film: [f32; 2], u_lens: [f32; 2]) -> CameraRay {
        let (offset, weight) = self.filter.sample(u_film);
        let px = (x as f64 + 0.5 + offset.x as f64) / self.width;
        let py = (y as f64 + 0.5 + offset.y as f64) / self.height;
        let [x0, x1, y0, y1] = self.window;
        let screen = DVec3::new(x0 + px * (x1 - x0), y1 - py * (y1 - y0), 0.0);
        let mut weight = weight;
        let (origin, dir) = match self.camera.projection {
            Projection::View(v) => match view_ray(&v, px - 0.5 + v.shift, 0.5 - py + v.lift) {
                Some(ray) => ray,
                None => {
                    // Outside the image circle nothing is seen.
                    weight = 0.0;
                    (DVec3::ZERO, DVec3::Z)
                }
            },
            Projection::Perspective { .. } => {
                let d = DVec3::new(screen.x * self.tan_half, screen.y * self.tan_half, 1.0);
                self.through_lens(DVec3::ZERO, d, u_lens)
            }
            Projection::Orthographic => self.through_lens(screen, DVec3::Z, u_lens),
            Projection::Spherical { equirectangular } => {
                (DVec3::ZERO, spherical(equirectangular, Vec2::new(px as f32, py as f32)))
            }
        };
        let m = &self.camera.to_world;
        let origin = m.transform_point3(origin).as_vec3();
        let dir = m.transform_vector3(dir).normalize().as_vec3().normalize();
        CameraRay { origin, dir, weight }
    }

    /// Thin lens: the plane z = focal distance stays sharp.
    fn through_lens(&self, origin: DVec3, d: DVec3, u: [f32; 2]) -> (DVec3, DVec3) {
        let radius = self.camera.lens_radius as f64;
        if radius <= 0.0 {
            return (origin, d);
        }
        let (x, y) = hemiquad::map::square_to_disk(hemiquad::map::Uv::new(u[0] as f64, u[1] as f64));
        let focus = origin + d * (self.camera.focal_distance as f64 / d.z);
        let start = origin + DVec3::new(x * radius, y * radius, 0.0);
        (start, focus - start)
    }
}

/// Ray of an architectural view (x right, y up, z forward) through (`x`, `y`) of its plane, in units of the picture's width
/// and height from the axis; `None` outside the image circle. The direction is not normalised.
fn view_ray(v: &View, x: f64, y: f64) -> Option<(DVec3, DVec3)> {
    let half = |degrees: f64| (0.5 * degrees).to_radians();
    let (h, w) = (half(v.horizontal), half(v.vertical));
    let ray = |d: DVec3, fore: f64| Some((d * fore, d));
    match v.kind {
        ViewKind::Perspective => ray(DVec3::new(2.0 * x * h.tan(), 2.0 * y * w.tan(), 1.0), v.fore),
        ViewKind::Parallel => Some((DVec3::new(x * v.horizontal, y * v.vertical, v.fore), DVec3::Z)),
        ViewKind::Hemispherical => {
            let (x, y) = (2.0 * x * h.sin(), 2.0 * y * w.sin());
            let z2 = 1.0 - x * x - y * y;
            if z2 < 0.0 { None } else { ray(DVec3::new(x, y, z2.sqrt()), v.fore) }
        }
        ViewKind::Cylindrical => {
            let (sin, cos) = (2.0 * x * h).sin_cos();
            ray(DVec3::new(sin, 2.0 * y * w.tan(), cos), v.fore)
        }
        ViewKind::Angular => {
            // The angle from the axis is proportional to the distance from the middle.
            let (x, y) = (2.0 * x * h, 2.0 * y * w);
            let angle = x.hypot(y);
            if angle > std::f64::consts::PI {
                return None;
            }
            let sinc = if angle > 0.0 { angle.sin() / angle } else { 1.0 };
            ray(DVec3::new(x * sinc, y * sinc, angle.cos()), v.fore)
        }
        ViewKind::Planisphere => {
            // Stereographic: 2 tan(θ/2) from the middle.
            let (x, y) = (2.0 * x * (0.5 * h).tan(), 2.0 * y * (0.5 * w).tan());
            let d2 = x * x + y * y;
            ray(DVec3::new(2.0 * x, 2.0 * y, 1.0 - d2) / (1.0 + d2), v.fore)
        }
    }
}

/// Camera direction of a point of a picture of all directions (x right, y up, z forward).
fn spherical(equirectangular: bool, uv: Vec2) -> DVec3 {
    use hemilux_scene::EnvironmentLayout as L;
    if equirectangular {
        let theta = std::f32::consts::PI * uv.y;
        let phi = 2.0 * std::f32::consts::PI * uv.x;
        let d = Vec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos());
        // y and z change places, as in pbrt, so that the picture's top is up.
        return Vec3::new(d.x, d.z, d.y).as_dvec3();
    }
    let wrap = |v: f32| v.clamp(0.0, 1.0);
    let d = super::environment::uv_to_direction(L::EqualAreaOctahedral, Vec2::new(wrap(uv.x), wrap(uv.y)));
    Vec3::new(d.x, d.z, d.y).as_dvec3()
}

/// Sampling of a filter by a fine table (constant within cells), signed where the filter is.
#[derive(Clone, Debug)]
struct FilterSampler {
    radius: Vec2,
    /// `None`: a box, sampled directly.
    table: Option<Axis2>,
}

/// Both axes of a separable filter.
#[derive(Clone, Debug)]
struct Axis2 {
    x: Axis,
    y: Axis,
}

#[derive(Clone, Debug)]
struct Axis {
    cumulative: Vec<f32>,
    negative: Vec<bool>,
    /// ∫|f| / ∫f.
    gain: f32,
}

const CELLS: usize = 256;

impl Axis {
    fn new(f: impl Fn(f64) -> f64, radius: f64) -> Axis {
        let values: Vec<f64> =
            (0..CELLS).map(|i| f(radius * (2.0 * (i as f64 + 0.5) / CELLS as f64 - 1.0))).collect();
        let total: f64 = values.iter().map(|v| v.abs()).sum();
        let signed: f64 = values.iter().sum();
        let mut cumulative = vec![0f32];
        let mut sum = 0.0;
        for v in &values {
            sum += v.abs();
            cumulative.push((sum / total) as f32);
        }
        Axis {
            cumulative,
            negative: values.iter().map(|v| *v < 0.0).collect(),
            gain: (total / signed) as f32,
        }
    }

    /// Position in [−1, 1] and weight.
    fn sample(&self, u: f32) -> (f32, f32) {
        let i = self.cumulative.partition_point(|&c| c <= u).clamp(1, CELLS) - 1;
        let width = self.cumulative[i + 1] - self.cumulative[i];
        let f = if width > 0.0 { (u - self.cumulative[i]) / width } else { 0.5 };
        let weight = if self.negative[i] { -self.gain } else { self.gain };
        (2.0 * (i as f32 + f.clamp(0.0, 1.0)) / CELLS as f32 - 1.0, weight)
    }
}

impl FilterSampler {
    fn new(filter: Filter) -> FilterSampler {
        let table = |radius: Vec2, f: &dyn Fn(f64, f64) -> f64| {
            let axis = |r: f32| Axis::new(|x| f(x, r as f64), r as f64);
            Some(Axis2 { x: axis(radius.x), y: axis(radius.y) })
        };
        let (radius, table) = match filter {
            Filter::Box { radius } => (radius, None),
            Filter::Triangle { radius } => (radius, table(radius, &|x, r| (r - x.abs()).max(0.0))),
            Filter::Gaussian { radius, sigma } => {
                let s = 2.0 * (sigma as f64).powi(2);
                (radius, table(radius, &move |x, r| ((-x * x / s).exp() - (-r * r / s).exp()).max(0.0)))
            }
            Filter::Mitchell { radius, b, c } => {
                let (b, c) = (b as f64, c as f64);
                (radius, table(radius, &move |x, r| mitchell(2.0 * x / r, b, c)))
            }
            Filter::Sinc { radius, tau } => {
                let tau = tau as f64;
                (radius, table(radius, &move |x, r| if x.abs() > r { 0.0 } else { sinc(x) * sinc(x / tau) }))
            }
        };
        FilterSampler { radius, table }
    }

    fn sample(&self, u: [f32; 2]) -> (Vec2, f32) {
        match &self.table {
            None => (self.radius * Vec2::new(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0), 1.0),
            Some(t) => {
                let ((x, wx), (y, wy)) = (t.x.sample(u[0]), t.y.sample(u[1]));
                (self.radius * Vec2::new(x, y), wx * wy)
            }
        }
    }
}

fn sinc(x: f64) -> f64 {
    let x = std::f64::consts::PI * x;
    if x.abs() < 1e-5 { 1.0 } else { x.sin() / x }
}

/// Mitchell and Netravali 1988, support [−2, 2].
fn mitchell(x: f64, b: f64, c: f64) -> f64 {
    let x = x.abs();
    let poly = |a3: f64, a2: f64, a1: f64, a0: f64| (((a3 * x + a2) * x + a1) * x + a0) / 6.0;
    if x <= 1.0 {
        poly(12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b)
    } else if x <= 2.0 {
        poly(-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c)
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: DVec3, b: [f64; 3]) {
        assert!((a.normalize() - DVec3::from(b).normalize()).length() < 1e-12, "{a} {b:?}");
    }

    fn a_view(kind: ViewKind, horizontal: f64, vertical: f64) -> View {
        View { kind, horizontal, vertical, shift: 0.0, lift: 0.0, fore: 0.0 }
    }

    /// Edges and middles of the six projections in closed form, and circles in the ratio of their laws of radius.
    #[test]
    fn views_map_angles_as_their_names_say() {
        let at = |v: &View, x: f64, y: f64| view_ray(v, x, y).unwrap().1;
        let tan = |d: f64| d.to_radians().tan();
        let v = a_view(ViewKind::Perspective, 90.0, 60.0);
        near(at(&v, 0.0, 0.0), [0.0, 0.0, 1.0]);
        near(at(&v, 0.5, 0.0), [1.0, 0.0, 1.0]);
        near(at(&v, 0.0, -0.5), [0.0, -tan(30.0), 1.0]);
        near(at(&v, 0.25, 0.0), [0.5, 0.0, 1.0]);
        let polar = |degrees: f64| [degrees.to_radians().sin(), 0.0, degrees.to_radians().cos()];
        // Hemispherical: r = sin θ.
        let v = a_view(ViewKind::Hemispherical, 180.0, 180.0);
        near(at(&v, 0.5, 0.0), [1.0, 0.0, 0.0]);
        near(at(&v, 0.25, 0.0), polar(30.0));
        assert!(view_ray(&v, 0.4, 0.4).is_none());
        near(at(&a_view(ViewKind::Hemispherical, 60.0, 60.0), 0.5, 0.0), polar(30.0));
        // Angular: r = θ.
        let v = a_view(ViewKind::Angular, 360.0, 360.0);
        for degrees in [0.0, 45.0, 90.0, 135.0, 179.0] {
            near(at(&v, degrees / 360.0, 0.0), polar(degrees));
        }
        assert!(view_ray(&v, 0.4, 0.4).is_none());
        near(at(&a_view(ViewKind::Angular, 180.0, 180.0), 0.0, 0.25), [0.0, 0.5f64.sqrt(), 0.5f64.sqrt()]);
        // Planisphere: r = tan(θ/2).
        let v = a_view(ViewKind::Planisphere, 180.0, 180.0);
        near(at(&v, 0.5, 0.0), polar(90.0));
        near(at(&v, 0.5 * tan(30.0), 0.0), polar(60.0));
        near(at(&v, 0.5 * tan(60.0), 0.0), polar(120.0));
        // Cylinder: across by angle, up by tangent.
        let v = a_view(ViewKind::Cylindrical, 360.0, 90.0);
        near(at(&v, 0.25, 0.0), [1.0, 0.0, 0.0]);
        near(at(&v, -0.125, 0.0), [-1.0, 0.0, 1.0]);
        near(at(&v, 0.5, 0.5), [0.0, 1.0, -1.0]);
        // Parallel: by metres.
        let (p, d) =
            view_ray(&View { fore: 2.0, ..a_view(ViewKind::Parallel, 4.0, 3.0) }, 0.5, -0.5).unwrap();
        assert_eq!((p, d), (DVec3::new(2.0, -1.5, 2.0), DVec3::Z));
        let (p, d) =
            view_ray(&View { fore: 3.0, ..a_view(ViewKind::Perspective, 90.0, 90.0) }, 0.5, 0.0).unwrap();
        assert_eq!((p.z, d.z), (3.0, 1.0));
    }

    #[test]
    fn every_filter_has_mean_weight_one_and_no_offset_on_average() {
        let r = Vec2::new(2.0, 1.5);
        let filters = [
            Filter::Box { radius: r },
            Filter::Triangle { radius: r },
            Filter::Gaussian { radius: r, sigma: 0.5 },
            Filter::Mitchell { radius: r, b: 1.0 / 3.0, c: 1.0 / 3.0 },
            Filter::Sinc { radius: r, tau: 3.0 },
        ];
        for filter in filters {
            let s = FilterSampler::new(filter);
            let n = 1 << 14;
            let (mut weight, mut moment) = (0.0, Vec2::ZERO);
            for i in 0..n {
                let u = hemiquad::points::sobol(i, hemiquad::points::Key::new(1));
                let (p, w) = s.sample([u.u, u.v]);
                assert!(p.x.abs() <= r.x && p.y.abs() <= r.y);
                weight += w / n as f32;
                moment += p * w / n as f32;
            }
            assert!((weight - 1.0).abs() < 2e-3, "{filter:?}: {weight}");
            assert!(moment.length() < 2e-3, "{filter:?}: {moment}");
        }
    }
}
