//! Camera, film, pixel filter, sampler, integrator.

use super::builder::Builder;
use super::params::Params;
use crate::geom::Vec2;
use crate::{Camera, Film, Filter, Projection, Span};

impl Builder {
    pub fn camera(&mut self, kind: &str, params: Params, at: Span) {
        if !self.require_options("Camera", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        if self.camera.is_some() {
            log.warning(at, "a second Camera: the last one counts");
        }
        let open = params.float(log, "shutteropen", 0.0);
        let close = params.float(log, "shutterclose", 1.0);
        if close <= open {
            log.error(params.span_of("shutterclose"), "the shutter closes before it opens");
        } else {
            self.exposure_time = close - open;
        }
        let projection = match kind {
            "perspective" => Projection::Perspective { fov: 90.0 },
            "orthographic" => Projection::Orthographic,
            "spherical" | "environment" => {
                let choices = [("equalarea", false), ("equirectangular", true)];
                let equirectangular = params.choice(log, "mapping", false, &choices);
                Projection::Spherical { equirectangular }
            }
            _ => {
                let message = match kind {
                    "realistic" => "camera \"realistic\" is not supported".to_owned(),
                    _ => format!("unknown camera \"{kind}\""),
                };
                log.unknown_among(params.span, message, kind, ["perspective", "orthographic", "spherical"]);
                return;
            }
        };
        let (mut lens_radius, mut focal_distance, mut screen_window) = (0.0, 1e6, None);
        let projection = if let Projection::Spherical { .. } = projection {
            params.ignore(&["lensradius", "focaldistance", "screenwindow", "frameaspectratio"]);
            projection
        } else {
            lens_radius = params.not_negative(log, "lensradius", 0.0);
            focal_distance = params.positive(log, "focaldistance", 1e6);
            screen_window = self.screen_window(&params);
            match projection {
                Projection::Perspective { .. } => {
                    let inside = |v: f64| v as f32 > 0.0 && (v as f32) < 180.0;
                    let fov = params.float_in(log, "fov", 90.0, "between 0 and 180 degrees", inside);
                    Projection::Perspective { fov: fov as f32 }
                }
                other => other,
            }
        };
        params.finish(log);
        let to_world = self.state.ctm.inverse();
        self.name_camera_frame(to_world);
        self.camera = Some(Camera {
            projection,
            to_world,
            screen_window,
            lens_radius: lens_radius as f32,
            focal_distance: focal_distance as f32,
            span: at,
        });
    }

    fn screen_window(&self, params: &Params) -> Option<[f32; 4]> {
        let log = &self.env.log;
        let aspect =
            params.has("frameaspectratio").then(|| params.positive(log, "frameaspectratio", 1.0) as f32);
        let window = params.floats_n::<4>(log, "screenwindow").map(|w| w.map(|v| v as f32));
        if let Some([x0, x1, y0, y1]) = window {
            if x0 == x1 || y0 == y1 {
                log.error(params.value_span("screenwindow"), "the screen window is empty");
            }
            return window;
        }
        aspect.map(|a| if a > 1.0 { [-a, a, -1.0, 1.0] } else { [-1.0, 1.0, -1.0 / a, 1.0 / a] })
    }

    pub fn film(&mut self, kind: &str, params: Params, at: Span) {
        if !self.require_options("Film", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        if self.film.is_some() {
            log.warning(at, "a second Film: the last one counts");
        }
        match kind {
            "rgb" => {}
            "gbuffer" => params.ignore(&["coordinatesystem"]),
            "spectral" => params.ignore(&["nbuckets", "lambdamin", "lambdamax"]),
            _ => {
                let known = ["rgb", "gbuffer", "spectral"];
                log.unknown_among(params.span, format!("unknown film \"{kind}\""), kind, known);
            }
        }
        let size = |name: &'static str, default: i32| {
            let v = params.integer_opt(log, name).unwrap_or(default);
            if v > 0 {
                return v as u32;
            }
            log.error(
                params.value_span(name),
                format!("parameter \"{name}\" of {} must be positive, not {v}", params.owner),
            );
            default as u32
        };
        let (width, height) = (size("xresolution", 1280), size("yresolution", 720));
        let film = Film {
            width,
            height,
            crop: self.crop(&params, width, height),
            scale: self.imaging_ratio(&params),
            filename: params.text(log, "filename").map(str::to_owned),
        };
        params.ignore(&["diagonal", "savefp16"]);
        if params.float_opt(log, "maxcomponentvalue").is_some_and(|v| v.is_finite() && v < 1e30) {
            log.warning(
                params.span_of("maxcomponentvalue"),
                "\"maxcomponentvalue\" is ignored: it would lose light",
            );
        }
        params.finish(log);
        self.film = Some((film, at));
    }

    fn crop(&self, params: &Params, width: u32, height: u32) -> [f32; 4] {
        let log = &self.env.log;
        let mut crop = [0.0, 1.0, 0.0, 1.0];
        let mut name = "cropwindow";
        if let Some(w) = params.floats_n::<4>(log, "cropwindow") {
            let [x0, x1, y0, y1] = w.map(|v| v.clamp(0.0, 1.0) as f32);
            crop = [x0.min(x1), x0.max(x1), y0.min(y1), y0.max(y1)];
        }
        if let Some(b) = params.integers_n::<4>(log, "pixelbounds") {
            name = "pixelbounds";
            let (w, h) = (width as f32, height as f32);
            let part = |v: i32, of: f32| (v as f32 / of).clamp(0.0, 1.0);
            crop = [part(b[0], w), part(b[1], w), part(b[2], h), part(b[3], h)];
        }
        let [x0, x1, y0, y1] = crop;
        if !(x0 < x1 && y0 < y1) {
            log.error(params.value_span(name), "the part of the picture to render is empty");
            return [0.0, 1.0, 0.0, 1.0];
        }
        crop
    }

    /// Exposure time × ISO / 100; 1 by default.
    fn imaging_ratio(&mut self, params: &Params) -> f32 {
        let log = &self.env.log;
        let iso = params.positive(log, "iso", 100.0);
        // The camera may come after the film: what the film does not say is multiplied in at the end.
        let exposure = params.float_opt(log, "exposuretime").unwrap_or(1.0);
        let white = params.not_negative(log, "whitebalance", 0.0);
        if white != 0.0 {
            log.warning(params.span_of("whitebalance"), "\"whitebalance\" is ignored");
        }
        if let Some(sensor) = params.text(log, "sensor").filter(|s| *s != "cie1931") {
            let message = format!("sensor \"{sensor}\" is ignored: cie1931 counts");
            log.warning(params.value_span("sensor"), message);
        }
        (exposure * iso / 100.0) as f32
    }

    pub fn filter(&mut self, kind: &str, params: Params, at: Span) {
        if !self.require_options("PixelFilter", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        let radius = |default: f64| {
            let r = |name| params.positive(log, name, default) as f32;
            Vec2::new(r("xradius"), r("yradius"))
        };
        let filter = match kind {
            "box" => Filter::Box { radius: radius(0.5) },
            "triangle" => Filter::Triangle { radius: radius(2.0) },
            "gaussian" => {
                Filter::Gaussian { radius: radius(1.5), sigma: params.positive(log, "sigma", 0.5) as f32 }
            }
            "mitchell" => Filter::Mitchell {
                radius: radius(2.0),
                b: params.float(log, "B", 1.0 / 3.0) as f32,
                c: params.float(log, "C", 1.0 / 3.0) as f32,
            },
            "sinc" => Filter::Sinc { radius: radius(4.0), tau: params.positive(log, "tau", 3.0) as f32 },
            _ => {
                let known = ["box", "triangle", "gaussian", "mitchell", "sinc"];
                log.unknown_among(params.span, format!("unknown filter \"{kind}\""), kind, known);
                return;
            }
        };
        params.finish(log);
        self.filter = Some(filter);
    }

    pub fn sampler(&mut self, kind: &str, params: Params, at: Span) {
        if !self.require_options("Sampler", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        let known = ["zsobol", "paddedsobol", "sobol", "halton", "independent", "stratified", "pmj02bn"];
        if !known.contains(&kind) {
            log.unknown_among(params.span, format!("unknown sampler \"{kind}\""), kind, known);
            params.ignore_all();
        }
        params.ignore(&["seed", "randomization"]);
        let count = |name: &'static str, default: i32| {
            let v = params.integer_opt(log, name).unwrap_or(default);
            if v > 0 {
                return v as u32;
            }
            log.error(
                params.value_span(name),
                format!("parameter \"{name}\" of {} must be positive, not {v}", params.owner),
            );
            1
        };
        self.samples_per_pixel = Some(if kind == "stratified" {
            params.ignore(&["jitter"]);
            count("xsamples", 4).saturating_mul(count("ysamples", 4))
        } else {
            count("pixelsamples", 16)
        });
        params.finish(log);
    }

    pub fn integrator(&mut self, kind: &str, params: Params, at: Span) {
        if !self.require_options("Integrator", at) {
            return;
        }
        let env = self.env.clone();
        let log = &env.log;
        let own: &[&'static str] = match kind {
            "path" | "volpath" => &["lightsampler", "regularize"],
            "simplepath" => &["samplebsdf", "samplelights"],
            "simplevolpath" | "lightpath" | "randomwalk" => &[],
            "bdpt" => &["visualizestrategies", "visualizeweights", "regularize"],
            "mlt" => &[
                "bootstrapsamples",
                "chains",
                "mutationsperpixel",
                "largestepprobability",
                "sigma",
                "regularize",
            ],
            "sppm" => &["photonsperiteration", "radius", "seed", "regularize"],
            "ao" => &["cossample", "maxdistance"],
            "function" => &["function", "maxsamples", "skipbad", "filename"],
            _ => {
                let known = ["path", "volpath", "simplepath", "simplevolpath", "lightpath", "randomwalk"]
                    .into_iter()
                    .chain(["bdpt", "mlt", "sppm", "ao", "function"]);
                log.unknown_among(params.span, format!("unknown integrator \"{kind}\""), kind, known);
                return;
            }
        };
        let depth = params.integer_opt(log, "maxdepth").unwrap_or(5);
        if depth < 0 {
            let message =
                format!("parameter \"maxdepth\" of {} must be zero or positive, not {depth}", params.owner);
            log.error(params.value_span("maxdepth"), message);
        }
        self.max_depth = (kind != "ao" && kind != "function").then_some(depth.max(0) as u32);
        params.ignore(own);
        params.finish(log);
    }
}
