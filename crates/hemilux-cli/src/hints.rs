//! `--hints FILE`: reading them with the scene that they are about, and saying what each one changed.

use crate::args::SceneArgs;
use crate::failure::{Failure, Kind};
use crate::load;
use crate::talk::Talk;
use clap::Args;
use hemilux::hints::{HintKind, Outcome};
use hemilux::world::World;
use hemilux_scene::Scene;
use hemilux_scene::hints::{CRITERIA, Hints, load_hints};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Where hints come from.
#[derive(Args, Clone, Debug)]
pub struct HintArgs {
    /// JSON file that says where light comes from: casters, luminaires, regions, cones, windows of the picture, a criterion
    /// (see docs/cli.md). Hints change the noise, never the mean
    #[arg(long, value_name = "FILE")]
    pub hints: Option<PathBuf>,
}

/// Read a scene and the hints about it; what both have to say is printed.
pub fn scene(args: &SceneArgs, hints: &HintArgs, talk: &Talk) -> Result<(Scene, Option<Hints>), Failure> {
    let loaded = load::loaded(&args.scenes, &args.defines, args.lenient, talk)?;
    let Some(path) = &hints.hints else { return Ok((loaded.scene, None)) };
    match load_hints(path, &loaded.scene, &loaded.sources) {
        Ok(read) => {
            talk.diagnostics(&read.diagnostics, &read.sources);
            Ok((loaded.scene, Some(read.hints)))
        }
        Err(error) => {
            talk.diagnostics(&error.diagnostics, &error.sources);
            Err(Failure::silent(Kind::Input))
        }
    }
}

/// The prepared scene, hints taken.
pub fn world(scene: Scene, hints: Option<&Hints>) -> World {
    let mut world = World::new(scene);
    if let Some(hints) = hints {
        world.hint(hints);
    }
    world
}

/// What a film depends on: nothing without hints.
pub fn fingerprint(hints: Option<&Hints>) -> Vec<u8> {
    hints.map_or_else(Vec::new, |h| h.hash.to_le_bytes().to_vec())
}

fn name(kind: &HintKind) -> (&'static str, Option<&str>) {
    match kind {
        HintKind::Caster(name) => ("caster", Some(name)),
        HintKind::Luminaire(name) => ("luminaire", Some(name)),
        HintKind::Region => ("region", None),
        HintKind::Cone => ("cone", None),
    }
}

/// The decimal number that a single-precision one was read from.
fn decimal(v: f32) -> f64 {
    (v as f64 * 1e6).round() / 1e6
}

/// What each hint changed, for `--report`.
pub fn report(world: &World, given: &Hints) -> Value {
    let one = |o: Outcome| {
        let (kind, name) = name(&o.kind);
        let mut v = json!({"hint": kind});
        let Some(map) = v.as_object_mut() else { return v };
        if let Some(name) = name {
            map.insert("name".into(), json!(name));
        }
        if matches!(o.kind, HintKind::Caster(_) | HintKind::Luminaire(_)) {
            map.insert(
                "particles".into(),
                json!({"share": decimal(o.particle_share), "sent": o.sent, "others": o.others}),
            );
        }
        match o.kind {
            HintKind::Luminaire(_) => {
                map.insert("shadow_ray_share".into(), json!(decimal(o.shadow_share)));
            }
            _ => {
                map.insert("gather_rays".into(), json!(o.rays));
                map.insert("luminance_brought".into(), json!(o.brought));
            }
        }
        if matches!(o.kind, HintKind::Caster(_)) {
            map.insert("met".into(), json!({"sent": o.met, "others": o.met_anyway}));
        }
        v
    };
    let mut list: Vec<Value> = world.hints.outcomes().into_iter().map(one).collect();
    list.extend(
        given
            .image
            .iter()
            .map(|w| json!({"hint": "image", "window": w.window.map(decimal), "samples": w.samples})),
    );
    if let Some(c) = given.criterion {
        let name = CRITERIA.iter().find(|n| n.1 == c).map_or("", |n| n.0);
        list.push(json!({"hint": "criterion", "criterion": name}));
    }
    Value::Array(list)
}

/// The same in words, a line per hint that was at work.
pub fn lines(world: &World) -> Vec<String> {
    let percent = |part: f64| format!("{:.3} %", 100.0 * part);
    let of = |n: u64, all: u64| percent(n as f64 / all.max(1) as f64);
    let line = |o: Outcome| {
        let (kind, name) = name(&o.kind);
        let mut text = format!("hint {kind}{}:", name.map_or(String::new(), |n| format!(" {n:?}")));
        let mut said = Vec::new();
        if o.sent > 0 {
            said.push(format!("{} of the particles", of(o.sent, o.sent + o.others)));
        }
        if o.sent > 0 && matches!(o.kind, HintKind::Caster(_)) {
            said.push(format!(
                "{} of them met it, {} of the others",
                of(o.met, o.sent),
                of(o.met_anyway, o.others)
            ));
        }
        if o.shadow_share > 0.0 {
            said.push(format!("{} of the shadow rays", percent(o.shadow_share as f64)));
        }
        if o.rays > 0 {
            said.push(format!("its gather rays brought {} of the light", percent(o.brought)));
        }
        if said.is_empty() {
            said.push("not at work".into());
        }
        text += &format!(" {}", said.join(", "));
        text
    };
    world.hints.outcomes().into_iter().map(line).collect()
}
