//! The camera in Radiance's words, for the `VIEW=` line of HDR headers: lighting tools read angles from it.

use hemilux_scene::geom::DVec3;
use hemilux_scene::{Camera, Projection, ViewKind};

/// A view, and whether it is one of the mirrored world.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The value of `VIEW=`.
    pub text: String,
    /// Radiance's world is right-handed. A camera that shows a left-handed world (pbrt's own) is described in the world
    /// with x negated.
    pub mirrored: bool,
}

/// The view of the pixels `region` (x0, x1, y0, y1) of a picture of `size`; `None` for projections that Radiance has not.
pub fn view(camera: &Camera, size: [u32; 2], region: [u32; 4]) -> Option<View> {
    let (w, h) = (size[0] as f64, size[1] as f64);
    let aspect = w / h;
    let window = match camera.screen_window {
        Some(s) => s.map(f64::from),
        None if aspect > 1.0 => [-aspect, aspect, -1.0, 1.0],
        None => [-1.0, 1.0, -1.0 / aspect, 1.0 / aspect],
    };
    let across = |px: u32| window[0] + px as f64 / w * (window[1] - window[0]);
    let up = |py: u32| window[3] - py as f64 / h * (window[3] - window[2]);
    let (x0, x1, y0, y1) = (across(region[0]), across(region[1]), up(region[3]), up(region[2]));
    // Width and height of the view, and how far its middle is off the axis in units of these.
    let (width, height) = (x1 - x0, y1 - y0);
    let (mut shift, mut lift) = (0.5 * (x0 + x1) / width, 0.5 * (y0 + y1) / height);
    let fore = if let Projection::View(v) = camera.projection { v.fore } else { 0.0 };
    let (kind, vh, vv) = match camera.projection {
        Projection::Perspective { fov } => {
            let scale = (0.5 * fov as f64).to_radians().tan();
            let angle = |extent: f64| 2.0 * (0.5 * extent * scale).atan().to_degrees();
            ("-vtv", angle(width), angle(height))
        }
        Projection::Orthographic => ("-vtl", width, height),
        Projection::Spherical { .. } => return None,
        Projection::View(v) => {
            // The part of the picture's plane that the region covers, and where its middle is.
            let across = |x: u32| x as f64 / w - 0.5 + v.shift;
            let up = |y: u32| 0.5 - y as f64 / h + v.lift;
            let (x0, x1, y0, y1) = (across(region[0]), across(region[1]), up(region[3]), up(region[2]));
            shift = 0.5 * (x0 + x1) / (x1 - x0);
            lift = 0.5 * (y0 + y1) / (y1 - y0);
            let vh = part_of(v.kind, v.horizontal, x1 - x0, v.kind == ViewKind::Cylindrical);
            (option(v.kind), vh, part_of(v.kind, v.vertical, y1 - y0, false))
        }
    };
    let m = &camera.to_world;
    let mirrored = m.matrix3.determinant() > 0.0;
    let world = |v: DVec3| if mirrored { DVec3::new(-v.x, v.y, v.z) } else { v };
    let vp = world(m.transform_point3(DVec3::ZERO));
    let vd = world(m.transform_vector3(DVec3::Z).normalize());
    let vu = world(m.transform_vector3(DVec3::Y).normalize());
    let triple = |v: DVec3| v.to_array().map(number).join(" ");
    let text = format!(
        "{kind} -vp {} -vd {} -vu {} -vh {} -vv {} -vo {} -va 0 -vs {} -vl {}",
        triple(vp),
        triple(vd),
        triple(vu),
        number(vh),
        number(vv),
        number(fore),
        number(shift),
        number(lift)
    );
    Some(View { text, mirrored })
}

/// The option that says which projection.
fn option(kind: ViewKind) -> &'static str {
    match kind {
        ViewKind::Perspective => "-vtv",
        ViewKind::Parallel => "-vtl",
        ViewKind::Hemispherical => "-vth",
        ViewKind::Angular => "-vta",
        ViewKind::Cylindrical => "-vtc",
        ViewKind::Planisphere => "-vts",
    }
}

/// The size of a view that shows the part `share` of the plane of one of size `whole`.
fn part_of(kind: ViewKind, whole: f64, share: f64, by_angle: bool) -> f64 {
    let half = (0.5 * whole).to_radians();
    let half = match kind {
        ViewKind::Parallel | ViewKind::Angular => return whole * share,
        _ if by_angle => return whole * share,
        ViewKind::Perspective | ViewKind::Cylindrical => (half.tan() * share).atan(),
        ViewKind::Hemispherical => (half.sin() * share).min(1.0).asin(),
        ViewKind::Planisphere => 2.0 * ((0.5 * half).tan() * share).atan(),
    };
    2.0 * half.to_degrees()
}

/// Seven digits suffice for single precision; no minus before zero.
fn number(v: f64) -> String {
    let rounded: f64 = format!("{v:.6e}").parse().unwrap_or(v);
    format!("{}", if rounded.abs() < 1e-9 { 0.0 } else { rounded })
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemilux_scene::Span;
    use hemilux_scene::geom::{DAffine3, DMat4};

    fn camera(to_world: DAffine3, fov: f32) -> Camera {
        Camera {
            projection: Projection::Perspective { fov },
            to_world,
            screen_window: None,
            lens_radius: 0.0,
            focal_distance: 1.0,
            span: Span::default(),
        }
    }

    #[test]
    fn a_plain_camera_is_left_handed_and_described_in_the_mirrored_world() {
        let at = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0));
        let v = view(&camera(at, 90.0), [200, 100], [0, 200, 0, 100]).unwrap();
        assert!(v.mirrored);
        // fov is across the shorter side: 2 atan(2) across the longer.
        let wide = number(2.0 * 2f64.atan().to_degrees());
        let expected =
            format!("-vtv -vp -1 2 3 -vd 0 0 1 -vu 0 1 0 -vh {wide} -vv 90 -vo 0 -va 0 -vs 0 -vl 0");
        assert_eq!(v.text, expected);
        let right_handed = DAffine3::from_mat4(DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0))) * at;
        let v = view(&camera(right_handed, 90.0), [200, 100], [0, 200, 0, 100]).unwrap();
        assert!(!v.mirrored && v.text.contains("-vp -1 2 3 -vd 0 0 1"));
    }

    #[test]
    fn a_cropped_view_is_shifted() {
        let v = view(&camera(DAffine3::IDENTITY, 90.0), [100, 100], [50, 100, 0, 25]).unwrap();
        // The right half spans 0..1 of -1..1: its middle is half its width off the axis; the top quarter 0.5..1.
        assert!(v.text.ends_with("-vs 0.5 -vl 1.5"), "{}", v.text);
        assert!(v.text.contains(&format!("-vh {}", number(2.0 * 0.5f64.atan().to_degrees()))));
    }
}
