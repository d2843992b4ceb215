//! Textures and their mappings.

use super::builder::Builder;
use super::colour::Meaning;
use super::params::Params;
use super::texture_file::{self, Encoding};
use crate::geom::{DVec3, Vec2};
use crate::{
    FloatParam, ImageId, Rgb, RgbParam, Span, Texture, TextureId, TextureImage, TextureMapping, Wrap,
};

const CLASSES: [&str; 5] = ["constant", "imagemap", "scale", "mix", "checkerboard"];
const UNSUPPORTED: [&str; 8] =
    ["bilerp", "directionmix", "dots", "fbm", "marble", "ptex", "windy", "wrinkled"];

impl Builder {
    pub fn texture(
        &mut self,
        name: &str,
        name_span: Span,
        kind: &str,
        kind_span: Span,
        class: &str,
        mut params: Params,
        at: Span,
    ) {
        if !self.require_world("Texture", at) {
            return;
        }
        let env = self.env.clone();
        let float = match kind {
            "float" => true,
            "spectrum" => false,
            _ => {
                let message = format!("a texture is \"float\" or \"spectrum\", not \"{kind}\"");
                env.log.unknown_among(kind_span, message, kind, ["float", "spectrum"]);
                return;
            }
        };
        let names = if float { &self.float_textures } else { &self.spectrum_textures };
        if names.contains_key(name) {
            env.log.error(name_span, format!("{kind} texture \"{name}\" is already defined"));
            return;
        }
        params.inherit(&self.state.attributes.texture);
        let texture = self.make_texture(class, &params, float);
        let id = TextureId(self.textures.len() as u32);
        self.textures.push(texture);
        let names = if float { &mut self.float_textures } else { &mut self.spectrum_textures };
        names.insert(name.into(), id);
    }

    fn make_texture(&mut self, class: &str, params: &Params, float: bool) -> Texture {
        let env = self.env.clone();
        let log = &env.log;
        let texture = match class {
            "constant" => match self.value(params, "value", 1.0, float) {
                RgbParam::Constant(c) => Texture::Constant(c),
                t => Texture::Scale(t, RgbParam::Constant(Rgb::WHITE)),
            },
            "scale" => {
                let scale = self.amount(params, "scale", 1.0);
                Texture::Scale(self.value(params, "tex", 1.0, float), as_rgb(scale))
            }
            "mix" => Texture::Mix {
                a: self.value(params, "tex1", 0.0, float),
                b: self.value(params, "tex2", 1.0, float),
                amount: self.amount(params, "amount", 0.5),
            },
            "checkerboard" => self.checkerboard(params, float),
            "imagemap" => self.image_map(params),
            _ => {
                let message = match UNSUPPORTED.contains(&class) {
                    true => format!("texture \"{class}\" is not supported"),
                    false => format!("unknown texture \"{class}\""),
                };
                log.unknown_among(params.span, message, class, CLASSES);
                return Texture::Constant(Rgb::splat(0.5));
            }
        };
        params.finish(log);
        texture
    }

    /// A value of the texture's own kind.
    fn value(&self, params: &Params, name: &'static str, default: f32, float: bool) -> RgbParam {
        if float {
            return as_rgb(self.amount(params, name, default));
        }
        params
            .rgb_param(&self.env, &self.spectrum_textures, name, Meaning::Unbounded)
            .unwrap_or(RgbParam::Constant(Rgb::splat(default)))
    }

    fn amount(&self, params: &Params, name: &'static str, default: f32) -> FloatParam {
        params.float_param(&self.env, &self.float_textures, name).unwrap_or(FloatParam::Constant(default))
    }

    fn checkerboard(&self, params: &Params, float: bool) -> Texture {
        let log = &self.env.log;
        let dimension = params.integer_opt(log, "dimension").unwrap_or(2);
        if dimension != 2 && dimension != 3 {
            let message = format!("a checkerboard has 2 or 3 dimensions, not {dimension}");
            log.error(params.value_span("dimension"), message);
        }
        Texture::Checkerboard {
            mapping: (dimension != 3).then(|| self.mapping(params)),
            to_texture: self.state.ctm.inverse(),
            even: self.value(params, "tex1", 1.0, float),
            odd: self.value(params, "tex2", 0.0, float),
        }
    }

    fn mapping(&self, params: &Params) -> TextureMapping {
        let log = &self.env.log;
        let to_texture = self.state.ctm.inverse();
        let delta = || params.pair(log, "udelta", "vdelta", 0.0).as_vec2();
        match params.text(log, "mapping").unwrap_or("uv") {
            "planar" => TextureMapping::Planar {
                to_texture,
                v1: params.vector3(log, "v1", DVec3::X).as_vec3(),
                v2: params.vector3(log, "v2", DVec3::Y).as_vec3(),
                delta: delta(),
            },
            "spherical" => TextureMapping::Spherical { to_texture },
            "cylindrical" => TextureMapping::Cylindrical { to_texture },
            other => {
                if other != "uv" {
                    let known = ["uv", "planar", "spherical", "cylindrical"];
                    let span = params.value_span("mapping");
                    log.unknown_among(span, format!("unknown mapping \"{other}\""), other, known);
                }
                TextureMapping::Uv {
                    scale: params.pair(log, "uscale", "vscale", 1.0).as_vec2(),
                    delta: delta(),
                }
            }
        }
    }

    fn image_map(&mut self, params: &Params) -> Texture {
        let env = self.env.clone();
        let log = &env.log;
        let mapping = self.mapping(params);
        let wrap = [
            ("repeat", Wrap::Repeat),
            ("black", Wrap::Black),
            ("clamp", Wrap::Clamp),
            ("octahedralsphere", Wrap::Clamp),
        ];
        let wrap = params.choice(log, "wrap", Wrap::Repeat, &wrap);
        let filters = [
            ("bilinear", false),
            ("trilinear", false),
            ("ewa", false),
            ("EWA", false),
            ("point", true),
            ("nearest", true),
        ];
        let nearest = params.choice(log, "filter", false, &filters);
        params.ignore(&["maxanisotropy"]);
        let scale = params.float(log, "scale", 1.0) as f32;
        let invert = params.boolean(log, "invert", false);
        let encoding = self.encoding(params);
        let Some(file) = params.text(log, "filename") else {
            if !params.has("filename") {
                log.error(params.span, "texture \"imagemap\" has no \"string filename\"");
            }
            return Texture::Constant(Rgb::splat(0.5));
        };
        match self.image(file, params.value_span("filename"), encoding) {
            Some(image) => Texture::Image { image, mapping, wrap, nearest, scale, invert },
            None => Texture::Constant(Rgb::splat(0.5)),
        }
    }

    fn encoding(&self, params: &Params) -> Encoding {
        let log = &self.env.log;
        let Some(text) = params.text(log, "encoding") else { return Encoding::Srgb };
        let gamma = |t: &str| {
            t.strip_prefix("gamma ")?.trim().parse::<f32>().ok().filter(|g| *g > 0.0 && g.is_finite())
        };
        match text {
            "sRGB" | "srgb" => Encoding::Srgb,
            "linear" => Encoding::Linear,
            _ => gamma(text).map_or_else(
                || {
                    let span = params.value_span("encoding");
                    let message = format!("unknown encoding \"{text}\"");
                    log.unknown_help(
                        span,
                        message,
                        Some("one of \"sRGB\", \"linear\", \"gamma 2.2\"".into()),
                    );
                    Encoding::Srgb
                },
                Encoding::Gamma,
            ),
        }
    }

    /// An image file; equal files with equal encoding are read once.
    pub fn image(&mut self, name: &str, span: Span, encoding: Encoding) -> Option<ImageId> {
        let env = self.env.clone();
        let path = env.resolve(name, span.file);
        let key = (path.canonicalize().unwrap_or(path.clone()), format!("{encoding:?}"));
        if let Some(&id) = self.image_ids.get(&key) {
            return Some(id);
        }
        let loaded = env.read(&path).and_then(|bytes| texture_file::decode(&bytes, &path, encoding));
        match loaded {
            Ok(image) => {
                let id = self.add_image(image);
                self.image_ids.insert(key, id);
                Some(id)
            }
            Err(e) => {
                env.log.error(span, format!("{}: {e}", path.display()));
                None
            }
        }
    }

    pub fn add_image(&mut self, image: TextureImage) -> ImageId {
        self.images.push(image);
        ImageId(self.images.len() as u32 - 1)
    }
}

/// A float as a value of equal bands.
fn as_rgb(v: FloatParam) -> RgbParam {
    match v {
        FloatParam::Constant(c) => RgbParam::Constant(Rgb::splat(c)),
        FloatParam::Texture(t) => RgbParam::Texture(t),
    }
}

/// Mean of the luminance of an image.
pub fn mean_luminance(image: &TextureImage) -> f64 {
    let sum: f64 = image.texels.iter().map(|t| f64::from(t.luminance())).sum();
    sum / image.texels.len().max(1) as f64
}

/// Half the window of a projector of `fov` degrees across the shorter side of an image.
pub fn half_window(fov: f64, width: u32, height: u32) -> Vec2 {
    let t = (fov / 2.0).to_radians().tan() as f32;
    let aspect = width as f32 / height as f32;
    if aspect > 1.0 { Vec2::new(t * aspect, t) } else { Vec2::new(t, t / aspect) }
}
