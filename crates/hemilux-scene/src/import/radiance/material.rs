//! Modifiers: what they define, and what a surface that names one looks like.
//!
//! Reflection models of the Radiance reference manual ("Materials"): with colour C, specularity s and roughness,
//!
//! - `plastic`: diffuse (1 − s) C, specular s without colour; `metal`: diffuse (1 − s) C, specular s C;
//! - `trans` with transmissivity t, of which the share u is specular: specular s, diffuse (1 − s)(1 − t) C,
//!   diffuse transmission (1 − s) t (1 − u) C, specular transmission (1 − s) t u C;
//! - smooth surfaces of specularity 0.018 or more brighten towards grazing angles (Radiance's approximation of Fresnel's
//!   formula for an index of 1.5);
//! - `glass`: both interfaces of a pane and its inner reflections, transmissivity tₙ ^ (1 / cos θ inside);
//! - `dielectric`: Fresnel's formula and transmission per unit length; `interface`: the same between two media.

use super::expr::Scope;
use super::transform::Similarity;
use super::types::Type;
use super::words::Words;
use super::{Context, Primitive, Reader};
use crate::geom::DVec3;
use crate::{Emission, Material, MaterialId, MaterialKind, Profile, Rgb, RgbParam, Span};

/// Specularity from which smooth surfaces brighten towards grazing angles.
const FRESNEL_FROM: f64 = 0.017_999;

/// Mixtures and aliases inside one another.
const MAX_CHAIN: usize = 64;

/// A modifier that a file defined.
#[derive(Clone, Debug)]
pub struct Definition {
    pub name: String,
    pub span: Span,
    kind: Kind,
    /// Its own modifier; `None`: void.
    pub modifier: Option<usize>,
    /// Where it was defined.
    frame: Similarity,
    strings: Vec<String>,
    reals: Vec<f64>,
    /// Definitions that its strings name: the parts of a mixture, the alternative of an illum.
    parts: Vec<Option<usize>>,
    /// The weight of a mixture's first part.
    amount: f32,
    look: Option<Look>,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Reported already.
    Broken,
    /// Adds nothing to its own modifier.
    Pass,
    Type(&'static Type),
}

/// What a surface looks like.
#[derive(Clone, Debug)]
pub struct Look {
    /// How it scatters; `None`: it is not there at all.
    pub material: Option<MaterialId>,
    /// Opacity: the rest of a mixture is void.
    pub opacity: f32,
    /// What it emits.
    pub emission: Option<Emission>,
    /// Definition of the sky that modulates the emission.
    pub sky: Option<usize>,
}

impl Definition {
    /// Stands for what could not be understood and has been reported.
    pub fn broken(name: &str, span: Span) -> Definition {
        Definition::of(name, span, Kind::Broken, None)
    }

    /// Stands for its modifier.
    pub fn pass(name: &str, span: Span, modifier: Option<usize>) -> Definition {
        Definition::of(name, span, Kind::Pass, modifier)
    }

    fn of(name: &str, span: Span, kind: Kind, modifier: Option<usize>) -> Definition {
        Definition {
            name: name.to_owned(),
            span,
            kind,
            modifier,
            frame: Similarity::IDENTITY,
            strings: Vec::new(),
            reals: Vec::new(),
            parts: Vec::new(),
            amount: 0.0,
            look: None,
        }
    }

    /// The function and file of a pattern, its numbers, and where it stands.
    pub fn function(&self) -> (&[String], &[f64], &Similarity) {
        (&self.strings, &self.reals, &self.frame)
    }

    /// Whether both mean the same: a file that is placed often defines its materials as often.
    pub fn means(&self, other: &Definition) -> bool {
        let placed = match (self.kind, other.kind) {
            (Kind::Type(a), Kind::Type(b)) if a.name == b.name => match a.name {
                "spotlight" | "brightfunc" => self.frame == other.frame,
                "dielectric" | "interface" => self.frame.scale == other.frame.scale,
                _ => true,
            },
            (Kind::Pass, Kind::Pass) | (Kind::Broken, Kind::Broken) => true,
            _ => false,
        };
        placed
            && (self.modifier, self.amount) == (other.modifier, other.amount)
            && self.reals == other.reals
            && self.strings == other.strings
            && self.parts == other.parts
    }

    fn type_name(&self) -> &'static str {
        match self.kind {
            Kind::Type(t) => t.name,
            _ => "",
        }
    }
}

fn rgb(v: &[f64]) -> Rgb {
    Rgb::new(v[0] as f32, v[1] as f32, v[2] as f32)
}

/// What each number of a material must be: R reflectance, T transmissivity, s share in [0, 1], n index, e radiance, d roughness,
/// x anything.
fn meaning(name: &str) -> &'static str {
    match name {
        "plastic" | "metal" => "RRRsd",
        "plastic2" | "metal2" => "RRRsdd",
        "trans" => "RRRsdss",
        "trans2" => "RRRsddss",
        "glass" => "TTTn",
        "dielectric" => "TTTnx",
        "interface" => "TTTnTTTn",
        "mirror" => "RRR",
        "light" | "illum" => "eee",
        "glow" => "eeex",
        "spotlight" => "eeexxxx",
        _ => "",
    }
}

impl Reader {
    /// Define a material, pattern or mixture.
    pub(super) fn material(
        &mut self,
        words: &mut Words,
        modifier: Option<usize>,
        p: &Primitive,
        context: &Context,
    ) {
        let mut d = Definition::of(words.text(p.id), p.head, Kind::Type(p.kind), modifier);
        d.frame = context.map;
        d.reals = p.reals.clone();
        d.strings = p.strings.iter().map(|&w| words.text(w).to_owned()).collect();
        let sound = self.check_numbers(words, p)
            && self.check_parts(words, p, &mut d)
            && self.check_modifier(modifier, &d);
        if !sound {
            d = Definition::broken(&d.name, d.span);
        }
        self.define(d);
    }

    fn check_numbers(&self, words: &mut Words, p: &Primitive) -> bool {
        let owner = format!("{} \"{}\"", p.kind.name, words.text(p.id));
        let mut bright = None;
        for ((meaning, &v), &word) in meaning(p.kind.name).chars().zip(&p.reals).zip(&p.numbers) {
            let wrong = match meaning {
                'R' | 'e' if v < 0.0 => "must not be negative",
                'R' if v > 1.0 => {
                    bright = Some((word, v));
                    continue;
                }
                'T' if !(0.0..=1.0).contains(&v) => "must be between 0 and 1",
                's' if !(0.0..=1.0).contains(&v) => "must be between 0 and 1",
                'n' if v <= 0.0 => "must be positive",
                'd' if v < 0.0 => "must not be negative",
                _ => continue,
            };
            let what = match meaning {
                'R' => "reflectance",
                'e' => "radiance",
                'T' => "transmissivity",
                's' => "share",
                'n' => "index of refraction",
                _ => "roughness",
            };
            let span = words.span(word);
            self.env.log.error(span, format!("{what} of {owner} {wrong}, not {v}"));
            return false;
        }
        if let Some((word, v)) = bright {
            let span = words.span(word);
            self.env.log.warning(span, format!("reflectance of {owner} is more than 1, not {v}: it is cut"));
        }
        if p.kind.name == "spotlight" {
            let angle = p.reals[3];
            if !(angle > 0.0 && angle <= 360.0) {
                let span = words.span(p.numbers[3]);
                self.env
                    .log
                    .error(span, format!("cone angle of {owner} must be in (0, 360] degrees, not {angle}"));
                return false;
            }
            if DVec3::new(p.reals[4], p.reals[5], p.reals[6]).try_normalize().is_none() {
                let span = words.span(p.numbers[4]);
                self.env.log.error(span, format!("{owner} has no direction"));
                return false;
            }
        }
        true
    }

    /// Find what the strings name.
    fn check_parts(&mut self, words: &mut Words, p: &Primitive, d: &mut Definition) -> bool {
        match p.kind.name {
            "mixfunc" => {
                for &word in &p.strings[..2] {
                    let span = words.span(word);
                    let name = words.text(word).to_owned();
                    match self.modifier(&name, span) {
                        Some(part) => d.parts.push(part),
                        None => return false,
                    }
                }
                let word = p.strings[2];
                let text = words.text(word).to_owned();
                let mut scope = Scope::default();
                for (i, v) in p.reals.iter().enumerate() {
                    scope.set(&format!("A{}", i + 1), *v);
                }
                match scope.evaluate(&text) {
                    Ok(v) => d.amount = v.clamp(0.0, 1.0) as f32,
                    Err(_) => {
                        let span = words.span(word);
                        let message = format!("mixture by \"{text}\" is not supported: only by a constant");
                        self.env.log.unknown(span, message);
                        return false;
                    }
                }
                true
            }
            "illum" | "mirror" => {
                if let Some(&word) = p.strings.first() {
                    let span = words.span(word);
                    let name = words.text(word).to_owned();
                    match self.modifier(&name, span) {
                        Some(part) => d.parts.push(part),
                        None => return false,
                    }
                }
                true
            }
            "brightfunc" => {
                let function = (d.strings[0].as_str(), file_name(&d.strings[1]));
                let least = match function {
                    ("skybr", "skybright.cal") => match d.reals.first().map(|v| v.round()) {
                        Some(2.0 | 3.0) => 3,
                        Some(1.0 | 4.0) => 7,
                        _ => usize::MAX,
                    },
                    ("skybright", "perezlum.cal") => 10,
                    _ => {
                        let message = format!(
                            "pattern \"brightfunc\" of \"{}\" is not supported: only the skies of gensky and gendaylit",
                            d.strings[0]
                        );
                        self.env.log.unknown(p.head, message);
                        // It lets what it modifies through.
                        d.kind = Kind::Pass;
                        return true;
                    }
                };
                if d.reals.len() < least {
                    let span = words.span(p.count);
                    let message = format!("the sky \"{}\" has too few numbers, or no known kind", d.name);
                    self.env.log.error(span, message);
                    return false;
                }
                true
            }
            _ => true,
        }
    }

    /// A material is modified by patterns only.
    fn check_modifier(&self, modifier: Option<usize>, d: &Definition) -> bool {
        let Some(i) = modifier else { return true };
        let m = &self.definitions[i];
        match m.kind {
            Kind::Broken => false,
            Kind::Pass => true,
            Kind::Type(t) if t.name == "brightfunc" => true,
            Kind::Type(t) => {
                let message =
                    format!("{} \"{}\" cannot modify {} \"{}\"", t.name, m.name, d.type_name(), d.name);
                self.env.log.error(d.span, message);
                false
            }
        }
    }

    /// What a surface of this modifier looks like; `None` if it has been reported.
    pub(super) fn look(&mut self, modifier: Option<usize>) -> Option<Look> {
        self.look_within(modifier, 0)
    }

    fn look_within(&mut self, modifier: Option<usize>, depth: usize) -> Option<Look> {
        let nothing = Look { material: None, opacity: 1.0, emission: None, sky: None };
        let Some(i) = modifier else { return Some(nothing) };
        if let Some(look) = &self.definitions[i].look {
            return Some(look.clone());
        }
        if depth > MAX_CHAIN {
            let d = &self.definitions[i];
            let message = format!("\"{}\" is modified by more than {MAX_CHAIN} others", d.name);
            self.env.log.error(d.span, message);
            return None;
        }
        let d = &self.definitions[i];
        let look = match d.kind {
            Kind::Broken => return None,
            Kind::Pass => self.look_within(d.modifier, depth + 1)?,
            Kind::Type(t) => match t.name {
                "brightfunc" => {
                    // Directly on a surface: it modulates what lies below, if that is a luminaire.
                    let below = d.modifier;
                    let mut look = self.look_within(below, depth + 1)?;
                    look.sky = look.sky.or(Some(i));
                    look
                }
                "mixfunc" => self.mixture(i, depth)?,
                "illum" => self.illum(i, depth)?,
                _ => self.simple(i),
            },
        };
        self.definitions[i].look = Some(look.clone());
        Some(look)
    }

    /// The nearest sky among the modifiers of a definition.
    fn sky_of(&self, mut modifier: Option<usize>) -> Option<usize> {
        while let Some(i) = modifier {
            let d = &self.definitions[i];
            if d.type_name() == "brightfunc" {
                return Some(i);
            }
            modifier = d.modifier;
        }
        None
    }

    fn add(&mut self, kind: MaterialKind, i: usize) -> Option<MaterialId> {
        let d = &self.definitions[i];
        let material = Material { kind, bump: None, normal_map: None, name: d.name.clone(), span: d.span };
        Some(self.build.add_material(material))
    }

    fn illum(&mut self, i: usize, depth: usize) -> Option<Look> {
        self.hints.illums += 1;
        let d = &self.definitions[i];
        let alternative = d.parts.first().copied().flatten();
        if alternative.is_none() && d.reals.iter().any(|v| *v > 0.0) {
            let message = format!(
                "illum \"{}\" has no alternative material: nothing is there, and what it emits is left out",
                d.name
            );
            self.env.log.warning(d.span, message);
        }
        self.look_within(alternative, depth + 1)
    }

    fn mixture(&mut self, i: usize, depth: usize) -> Option<Look> {
        let (parts, t) = (self.definitions[i].parts.clone(), self.definitions[i].amount);
        // The first part counts t, the second the rest.
        let first = self.look_within(parts[0], depth + 1)?;
        let second = self.look_within(parts[1], depth + 1)?;
        match t {
            1.0 => return Some(first),
            0.0 => return Some(second),
            _ => {}
        }
        let (a, b) = (first.opacity * t, second.opacity * (1.0 - t));
        let present = |look: &Look, share: f32| if look.material.is_some() { share } else { 0.0 };
        let (a, b) = (present(&first, a), present(&second, b));
        let opacity = a + b;
        let emission = match (&first.emission, &second.emission) {
            (None, None) => None,
            (Some(e), None) | (None, Some(e)) if e.profile == Profile::Uniform => {
                let share = if first.emission.is_some() { a } else { b };
                // Emission counts where the surface is met, which is with probability `opacity`.
                Some(Emission { radiance: e.radiance * (share / opacity), ..e.clone() })
            }
            _ => {
                let d = &self.definitions[i];
                self.env.log.unknown(d.span, "a mixture of luminaires is not supported");
                return None;
            }
        };
        let sky = first.sky.or(second.sky);
        let material = match (first.material, second.material) {
            (Some(x), Some(y)) if a > 0.0 && b > 0.0 => {
                // (1 − amount) a + amount b; mixtures refer to earlier materials.
                let amount = crate::FloatParam::Constant(b / opacity);
                self.add(MaterialKind::Mix { a: x, b: y, amount }, i)
            }
            (x, y) => x.or(y),
        };
        Some(Look { material, opacity, emission, sky })
    }

    fn simple(&mut self, i: usize) -> Look {
        let d = &self.definitions[i];
        let v = d.reals.clone();
        let (frame, name) = (d.frame, d.type_name());
        let sky = self.sky_of(d.modifier);
        let c = if v.len() >= 3 { rgb(&v) } else { Rgb::BLACK };
        let kind = match name {
            "plastic" | "metal" => reflective(c, v[3], v[4], name == "metal", 0.0, 0.0),
            "plastic2" | "metal2" => {
                self.isotropic(i);
                reflective(c, v[3], (v[4] * v[5]).sqrt(), name == "metal2", 0.0, 0.0)
            }
            "trans" => reflective(c, v[3], v[4], false, v[5], v[6]),
            "trans2" => {
                self.isotropic(i);
                reflective(c, v[3], (v[4] * v[5]).sqrt(), false, v[6], v[7])
            }
            "glass" => {
                let eta = v.get(3).map_or(1.52, |n| *n as f32);
                MaterialKind::TintedPane { eta, transmissivity: c }
            }
            "dielectric" => tinted(v[3], c, Rgb::WHITE, frame.scale),
            "interface" => tinted(v[3] / v[7], c, rgb(&v[4..]), frame.scale),
            "mirror" => {
                self.hints.mirrors += 1;
                MaterialKind::Polished {
                    diffuse: Rgb::BLACK,
                    specular: c.map(|x| x.min(1.0)),
                    diffuse_transmission: Rgb::BLACK,
                    specular_transmission: Rgb::BLACK,
                    alpha: 0.0,
                    fresnel: false,
                }
            }
            // Luminaires reflect nothing.
            _ => MaterialKind::Diffuse { reflectance: RgbParam::Constant(Rgb::BLACK) },
        };
        let emission = match name {
            "light" | "glow" | "spotlight" => {
                let profile = if name == "spotlight" { spot(&v[3..], &frame) } else { Profile::Uniform };
                if name == "glow" && v[3] > 0.0 {
                    self.hints.glow_radii += 1;
                }
                if name == "glow" && v[3] < 0.0 {
                    let d = &self.definitions[i];
                    let message =
                        format!("glow \"{}\" of negative radius lights the scene all the same", d.name);
                    self.env.log.warning(d.span, message);
                }
                Some(Emission { radiance: c, image: None, two_sided: false, profile })
            }
            _ => None,
        };
        let material = self.add(kind, i);
        Look { material, opacity: 1.0, emission, sky }
    }

    fn isotropic(&self, i: usize) {
        let d = &self.definitions[i];
        if d.reals[4] != d.reals[5] {
            let message = format!(
                "anisotropic roughness of {} \"{}\": its geometric mean is taken",
                d.type_name(),
                d.name
            );
            self.env.log.warning(d.span, message);
        }
    }
}

/// The last part of a path.
fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

/// Hard cone of full angle `v[0]` degrees around `v[1..4]`.
fn spot(v: &[f64], frame: &Similarity) -> Profile {
    let axis = frame.vector(DVec3::new(v[1], v[2], v[3])).normalize_or_zero().as_vec3();
    // Radiance measures cones by solid angle, up to the whole sphere.
    let cos = (0.5 * v[0].min(360.0)).to_radians().cos() as f32;
    Profile::Spot { axis, cos_start: cos, cos_end: cos }
}

fn reflective(c: Rgb, spec: f64, rough: f64, metal: bool, trans: f64, tspec: f64) -> MaterialKind {
    let (s, t, u) = (spec as f32, trans as f32, tspec as f32);
    let c = c.map(|x| x.min(1.0));
    if s == 0.0 && t == 0.0 {
        return MaterialKind::Diffuse { reflectance: RgbParam::Constant(c) };
    }
    MaterialKind::Polished {
        diffuse: c * ((1.0 - s) * (1.0 - t)),
        specular: if metal { c * s } else { Rgb::splat(s) },
        diffuse_transmission: c * ((1.0 - s) * t * (1.0 - u)),
        specular_transmission: c * ((1.0 - s) * t * u),
        alpha: rough.min(1.0) as f32,
        fresnel: rough == 0.0 && spec >= FRESNEL_FROM,
    }
}

/// An interface of relative index `eta`; transmission per unit length before scaling.
fn tinted(eta: f64, inside: Rgb, outside: Rgb, scale: f64) -> MaterialKind {
    if inside == Rgb::WHITE && outside == Rgb::WHITE {
        let zero = crate::FloatParam::Constant(0.0);
        let roughness = crate::Roughness { u: zero, v: zero, remap: false };
        return MaterialKind::Dielectric { eta: eta as f32, roughness };
    }
    let per_metre = |c: Rgb| c.map(|x| (x as f64).powf(1.0 / scale) as f32);
    MaterialKind::TintedDielectric { eta: eta as f32, inside: per_metre(inside), outside: per_metre(outside) }
}
