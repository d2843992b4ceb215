//! Materials, with pbrt-v4's defaults.

use super::builder::{Builder, NamedMaterial};
use super::colour::Meaning;
use super::params::{Params, Type, Values};
use super::spectra;
use super::texture_file::Encoding;
use crate::{
    ConductorFresnel, FloatParam, Material, MaterialId, MaterialKind, Rgb, RgbParam, Roughness, Span,
};

/// The material types that are read, and those of pbrt that are not.
const KINDS: [&str; 10] = [
    "diffuse",
    "coateddiffuse",
    "coatedconductor",
    "conductor",
    "dielectric",
    "thindielectric",
    "diffusetransmission",
    "mix",
    "interface",
    "none",
];
const UNSUPPORTED: [&str; 3] = ["hair", "measured", "subsurface"];

/// The three parameters of a roughness.
type RoughnessNames = [&'static str; 3];
const PLAIN: RoughnessNames = ["roughness", "uroughness", "vroughness"];

impl Builder {
    pub fn material(&mut self, kind: &str, mut params: Params, at: Span) {
        if !self.require_world("Material", at) {
            return;
        }
        params.inherit(&self.state.attributes.material);
        let made = self.make(kind, &params, String::new(), at);
        self.state.material = self.add_material(made);
    }

    fn add_material(&mut self, material: Material) -> MaterialId {
        self.materials.push(material);
        MaterialId(self.materials.len() as u32 - 1)
    }

    pub fn make_named_material(&mut self, name: &str, mut params: Params, at: Span) {
        if !self.require_world("MakeNamedMaterial", at) {
            return;
        }
        let span = params.span;
        if let Some(m) = self.named_materials.get(name).filter(|m| m.defined) {
            let place = self.env.files.borrow().sources.locate(m.span);
            self.env.log.error(span, format!("material \"{name}\" is already defined at {place}"));
            return;
        }
        params.inherit(&self.state.attributes.material);
        let kind = params.text(&self.env.log, "type").map(str::to_owned);
        let kind = match kind {
            Some(k) => k,
            None => {
                if !params.has("type") {
                    self.env.log.error(span, format!("material \"{name}\" has no \"string type\""));
                }
                params.ignore_all();
                "diffuse".into()
            }
        };
        let type_span = params.value_span("type");
        let params = Params::new(format!("material \"{kind}\""), type_span, params.items);
        params.ignore(&["type"]);
        let made = self.make(&kind, &params, name.to_owned(), span);
        // A slot made by an earlier use keeps its place, unless the material refers to others, which must precede it.
        let forward = self.named_materials.get(name).map(|m| m.id);
        let id = match forward {
            Some(slot) if !matches!(made.kind, MaterialKind::Mix { .. }) => {
                self.materials[slot.0 as usize] = made;
                slot
            }
            _ => self.add_material(made),
        };
        if let Some(slot) = forward.filter(|s| *s != id) {
            self.replaced.insert(slot, id);
        }
        self.named_materials.insert(name.to_owned(), NamedMaterial { id, defined: true, span });
    }

    pub fn named_material(&mut self, name: &str, at: Span, span: Span) {
        if !self.require_world("NamedMaterial", at) {
            return;
        }
        if let Some(m) = self.named_materials.get(name) {
            self.state.material = m.id;
            return;
        }
        // Perhaps it is defined further down: make a slot for it.
        let id = self.add_material(Material {
            kind: grey(),
            bump: None,
            normal_map: None,
            name: name.to_owned(),
            span,
        });
        self.named_materials.insert(name.to_owned(), NamedMaterial { id, defined: false, span });
        self.state.material = id;
    }

    fn make(&mut self, kind: &str, params: &Params, name: String, at: Span) -> Material {
        let env = self.env.clone();
        let log = &env.log;
        let made = match kind {
            "diffuse" => MaterialKind::Diffuse { reflectance: self.albedo(params, "reflectance", 0.5) },
            "conductor" => MaterialKind::Conductor {
                fresnel: self.fresnel(params, "eta", "k", "reflectance"),
                roughness: self.roughness(params, PLAIN),
            },
            "dielectric" => MaterialKind::Dielectric {
                eta: self.eta(params, "eta"),
                roughness: self.roughness(params, PLAIN),
            },
            "thindielectric" => MaterialKind::ThinDielectric { eta: self.eta(params, "eta") },
            "coateddiffuse" => {
                self.coat_interior(params);
                MaterialKind::CoatedDiffuse {
                    reflectance: self.albedo(params, "reflectance", 0.5),
                    eta: self.eta(params, "eta"),
                    roughness: self.roughness(params, PLAIN),
                }
            }
            "coatedconductor" => {
                self.coat_interior(params);
                MaterialKind::CoatedConductor {
                    eta: self.eta(params, "interface.eta"),
                    coat_roughness: self.roughness(
                        params,
                        ["interface.roughness", "interface.uroughness", "interface.vroughness"],
                    ),
                    fresnel: self.fresnel(params, "conductor.eta", "conductor.k", "reflectance"),
                    base_roughness: self.roughness(
                        params,
                        ["conductor.roughness", "conductor.uroughness", "conductor.vroughness"],
                    ),
                }
            }
            "diffusetransmission" => MaterialKind::DiffuseTransmission {
                reflectance: self.albedo(params, "reflectance", 0.25),
                transmittance: self.albedo(params, "transmittance", 0.25),
                scale: params.not_negative(log, "scale", 1.0) as f32,
            },
            "mix" => self.mix(params),
            "interface" | "none" | "" => MaterialKind::Interface,
            _ => {
                let message = match UNSUPPORTED.contains(&kind) {
                    true => format!("material \"{kind}\" is not supported"),
                    false => format!("unknown material \"{kind}\""),
                };
                log.unknown_among(params.span, message, kind, KINDS);
                return Material { kind: grey(), bump: None, normal_map: None, name, span: at };
            }
        };
        let bump = params.float_param(&env, &self.float_textures, "displacement");
        let bump = bump.filter(|b| matches!(b, FloatParam::Texture(_)));
        let normal_map = params
            .text(log, "normalmap")
            .map(str::to_owned)
            .and_then(|file| self.image(&file, params.value_span("normalmap"), Encoding::Linear));
        params.finish(log);
        Material { kind: made, bump, normal_map, name, span: at }
    }

    fn albedo(&self, params: &Params, name: &'static str, default: f32) -> RgbParam {
        params
            .rgb_param(&self.env, &self.spectrum_textures, name, Meaning::Albedo)
            .unwrap_or(RgbParam::Constant(Rgb::splat(default)))
    }

    /// An index of refraction, a float or a spectrum (then its luminance), 1.5 by default.
    fn eta(&self, params: &Params, name: &'static str) -> f32 {
        let log = &self.env.log;
        let types = [Type::Float, Type::Spectrum, Type::Rgb];
        let Some(p) = params.find(log, name, &types) else { return 1.5 };
        let value = match (p.ty, &p.values) {
            (Type::Float, Values::Numbers(_)) => params.float(log, name, 1.5),
            _ => {
                params.spectrum(&self.env, name, Meaning::Unbounded).map_or(1.5, |c| f64::from(c.luminance()))
            }
        };
        if value > 0.0 {
            return value as f32;
        }
        log.error(
            p.value_span,
            format!("parameter \"{name}\" of {} must be positive, not {value}", params.owner),
        );
        1.5
    }

    fn fresnel(
        &self,
        params: &Params,
        eta: &'static str,
        k: &'static str,
        r: &'static str,
    ) -> ConductorFresnel {
        let get = |name, meaning| params.rgb_param(&self.env, &self.spectrum_textures, name, meaning);
        let (default_eta, default_k) = spectra::copper();
        let given = (get(eta, Meaning::Unbounded), get(k, Meaning::Unbounded));
        if let Some(reflectance) = get(r, Meaning::Albedo) {
            if params.has(eta) || params.has(k) {
                let message = format!("{} has both \"{r}\" and \"{eta}\" or \"{k}\"", params.owner);
                self.env.log.error(params.span_of(r), message);
            }
            return ConductorFresnel::Reflectance(reflectance);
        }
        ConductorFresnel::EtaK(
            given.0.unwrap_or(RgbParam::Constant(default_eta)),
            given.1.unwrap_or(RgbParam::Constant(default_k)),
        )
    }

    fn roughness(&self, params: &Params, names: RoughnessNames) -> Roughness {
        let log = &self.env.log;
        let get = |name: &'static str| {
            let v = params.float_param(&self.env, &self.float_textures, name)?;
            match v {
                FloatParam::Constant(c) if c < 0.0 => {
                    let message =
                        format!("parameter \"{name}\" of {} must be zero or positive, not {c}", params.owner);
                    log.error(params.value_span(name), message);
                    None
                }
                v => Some(v),
            }
        };
        let both = get(names[0]).unwrap_or(FloatParam::Constant(0.0));
        Roughness {
            u: get(names[1]).unwrap_or(both),
            v: get(names[2]).unwrap_or(both),
            remap: params.boolean(log, "remaproughness", true),
        }
    }

    /// The medium within a coat: read, not simulated.
    fn coat_interior(&self, params: &Params) {
        params.ignore(&["thickness", "maxdepth", "nsamples", "g"]);
        if params.has("albedo") {
            let albedo = params.rgb_param(&self.env, &self.spectrum_textures, "albedo", Meaning::Albedo);
            if albedo.is_some_and(|a| a != RgbParam::Constant(Rgb::BLACK)) {
                self.env.log.warning(params.span_of("albedo"), "\"albedo\" is ignored: coats are clear");
            }
        }
    }

    fn mix(&mut self, params: &Params) -> MaterialKind {
        let env = self.env.clone();
        let log = &env.log;
        let amount =
            params.float_param(&env, &self.float_textures, "amount").unwrap_or(FloatParam::Constant(0.5));
        if let FloatParam::Constant(a) = amount
            && !(0.0..=1.0).contains(&a)
        {
            log.error(
                params.value_span("amount"),
                format!("parameter \"amount\" of {} must be in [0, 1], not {a}", params.owner),
            );
        }
        let names = params.texts(log, "materials").unwrap_or_default();
        if names.len() != 2 {
            log.unknown(
                params.span_of("materials"),
                format!("material \"mix\" takes 2 names in \"materials\", not {}", names.len()),
            );
            return grey();
        }
        let mut ids = [MaterialId(0); 2];
        for (id, name) in ids.iter_mut().zip(names) {
            match self.named_materials.get(name).filter(|m| m.defined) {
                Some(m) => *id = m.id,
                None => {
                    let known = self.named_materials.keys().map(String::as_str);
                    let message = format!("material \"{name}\" is not defined");
                    log.unknown_among(params.value_span("materials"), message, name, known);
                    return grey();
                }
            }
        }
        MaterialKind::Mix { a: ids[0], b: ids[1], amount }
    }
}

/// What stands for a material that is not understood.
pub fn grey() -> MaterialKind {
    MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::splat(0.5)) }
}
