//! Evaluation of textures at surface points.

use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::{FloatParam, Rgb, RgbParam, Scene, Texture, TextureImage, TextureMapping, Wrap};
use std::f64::consts::PI;

/// Where a texture is looked up.
#[derive(Clone, Copy, Debug)]
pub struct TexturePoint {
    /// World position (m).
    pub p: Vec3,
    /// Surface parameters.
    pub uv: Vec2,
}

/// A spectral parameter at a point.
#[inline]
pub fn rgb(scene: &Scene, param: RgbParam, at: &TexturePoint) -> Rgb {
    match param {
        RgbParam::Constant(v) => v,
        RgbParam::Texture(id) => evaluate(scene, &scene.textures[id.0 as usize], at),
    }
}

/// A scalar parameter at a point: the first band of its texture.
#[inline]
pub fn float(scene: &Scene, param: FloatParam, at: &TexturePoint) -> f32 {
    match param {
        FloatParam::Constant(v) => v,
        FloatParam::Texture(id) => evaluate(scene, &scene.textures[id.0 as usize], at)[0],
    }
}

fn evaluate(scene: &Scene, texture: &Texture, at: &TexturePoint) -> Rgb {
    match texture {
        Texture::Constant(v) => *v,
        Texture::Image { image, mapping, wrap, nearest, scale, invert } => {
            let st = map(mapping, at);
            let v = lookup(&scene.images[image.0 as usize], st, *wrap, *nearest) * *scale;
            if *invert { (Rgb::WHITE - v).map(|x| x.max(0.0)) } else { v }
        }
        Texture::Scale(a, b) => rgb(scene, *a, at) * rgb(scene, *b, at),
        Texture::Mix { a, b, amount } => {
            let t = float(scene, *amount, at);
            rgb(scene, *a, at).lerp(rgb(scene, *b, at), t)
        }
        Texture::Checkerboard { mapping, to_texture, even, odd } => {
            let parity = match mapping {
                Some(m) => {
                    let st = map(m, at);
                    st.x.floor() as i64 + st.y.floor() as i64
                }
                None => {
                    let q = to_texture.transform_point3(at.p.as_dvec3());
                    q.x.floor() as i64 + q.y.floor() as i64 + q.z.floor() as i64
                }
            };
            rgb(scene, if parity % 2 == 0 { *even } else { *odd }, at)
        }
    }
}

fn map(mapping: &TextureMapping, at: &TexturePoint) -> Vec2 {
    let local = |m: &DAffine3| m.transform_point3(at.p.as_dvec3());
    let angle = |q: DVec3| {
        let phi = q.y.atan2(q.x);
        (if phi < 0.0 { phi + 2.0 * PI } else { phi }) / (2.0 * PI)
    };
    match mapping {
        TextureMapping::Uv { scale, delta } => at.uv * *scale + *delta,
        TextureMapping::Planar { to_texture, v1, v2, delta } => {
            let q = local(to_texture).as_vec3();
            Vec2::new(q.dot(*v1), q.dot(*v2)) + *delta
        }
        TextureMapping::Spherical { to_texture } => {
            let q = local(to_texture).normalize_or_zero();
            Vec2::new(angle(q) as f32, (q.z.clamp(-1.0, 1.0).acos() / PI) as f32)
        }
        TextureMapping::Cylindrical { to_texture } => {
            let q = local(to_texture);
            Vec2::new(angle(q) as f32, q.z as f32)
        }
    }
}

fn texel(image: &TextureImage, x: i64, y: i64, wrap: Wrap) -> Rgb {
    let (w, h) = (image.width as i64, image.height as i64);
    let (x, y) = match wrap {
        Wrap::Repeat => (x.rem_euclid(w), y.rem_euclid(h)),
        Wrap::Clamp => (x.clamp(0, w - 1), y.clamp(0, h - 1)),
        Wrap::Black if x < 0 || y < 0 || x >= w || y >= h => return Rgb::BLACK,
        Wrap::Black => (x, y),
    };
    image.texels[(y * w + x) as usize]
}

/// Image value at (s, t), t = 0 at the bottom row; bilinear between texel centres, or the nearest texel.
pub fn lookup(image: &TextureImage, st: Vec2, wrap: Wrap, nearest: bool) -> Rgb {
    if !st.is_finite() {
        return Rgb::BLACK;
    }
    let x = st.x * image.width as f32;
    let y = (1.0 - st.y) * image.height as f32;
    if nearest {
        return texel(image, x.floor() as i64, y.floor() as i64, wrap);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (xi, yi) = (x0 as i64, y0 as i64);
    let at = |dx, dy| texel(image, xi + dx, yi + dy, wrap);
    at(0, 0).lerp(at(1, 0), fx).lerp(at(0, 1).lerp(at(1, 1), fx), fy)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image() -> TextureImage {
        let texels = (0..4).map(|i| Rgb::splat(i as f32)).collect();
        TextureImage { width: 2, height: 2, texels, alpha: None, path: Default::default() }
    }

    #[test]
    fn t_runs_upward_and_wrap_modes_differ_outside() {
        let i = image();
        // Top-left texel is row 0: s = 0.25, t = 0.75.
        assert_eq!(lookup(&i, Vec2::new(0.25, 0.75), Wrap::Clamp, false)[0], 0.0);
        assert_eq!(lookup(&i, Vec2::new(0.25, 0.25), Wrap::Clamp, false)[0], 2.0);
        assert_eq!(lookup(&i, Vec2::new(0.5, 0.5), Wrap::Clamp, false)[0], 1.5);
        assert_eq!(lookup(&i, Vec2::new(1.25, 0.25), Wrap::Repeat, true)[0], 2.0);
        assert_eq!(lookup(&i, Vec2::new(1.25, 0.25), Wrap::Clamp, true)[0], 3.0);
        assert_eq!(lookup(&i, Vec2::new(1.25, 0.25), Wrap::Black, true)[0], 0.0);
    }
}
