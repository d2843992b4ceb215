//! The facts of a scene, as JSON; the text form is made from them, so that both say the same.

use hemilux::world::World;
use hemilux_scene::geom::{DAffine3, DVec3};
use hemilux_scene::{
    Environment, Filter, Geometry, Material, MaterialId, MaterialKind, Projection, Quadric, Scene, Shape,
    Texture,
};
use serde_json::{Map, Value, json};

/// All of it.
pub fn facts(scene: Scene) -> Value {
    let bounds = bounds(&scene);
    let own = |of: &dyn Fn(&Shape) -> bool| scene.shapes.iter().filter(|s| of(s)).count();
    let all_shapes = || scene.shapes.iter().chain(scene.objects.iter().flat_map(|o| &o.shapes));
    let triangles: usize = all_shapes().map(|s| mesh_size(&scene, s)).sum();
    let quadrics = all_shapes().filter(|s| matches!(s.geometry, Geometry::Quadric(..))).count();
    let mut materials = Map::new();
    for m in used_materials(&scene, all_shapes()) {
        count(&mut materials, material(&m.kind));
    }
    let mut textures = Map::new();
    for t in &scene.textures {
        count(&mut textures, texture(t));
    }
    let mut environments = Map::new();
    for e in &scene.environments {
        count(&mut environments, environment(e));
    }
    let emitters = own(&|s| s.emission.is_some());
    let mut facts = json!({
        "film": {
            "width": scene.film.width, "height": scene.film.height, "crop": scene.film.crop,
            "filter": filter(&scene.filter), "file": scene.film.filename, "scale": scene.film.scale,
        },
        "camera": camera(&scene),
        "samples_per_pixel": scene.samples_per_pixel,
        "max_depth": scene.max_depth,
        "shapes": scene.shapes.len(),
        "triangles": triangles,
        "quadrics": quadrics,
        "objects": scene.objects.len(),
        "instances": scene.instances.len(),
        "materials": materials,
        "textures": textures,
        "images": scene.images.len(),
        "emitting_shapes": emitters,
        "environments": environments,
        "bounds": bounds.map(|(lo, hi)| json!([lo.to_array(), hi.to_array()])),
        "scene_hash": format!("{:016x}", scene.content_hash),
        "files": scene.files.iter().map(|f| f.display().to_string()).collect::<Vec<_>>(),
    });
    let world = World::new(scene);
    facts["primitives"] = world.primitives().into();
    facts["luminaires"] = world.luminaires.len().into();
    facts["power_W"] = world.luminaires.power().into();
    facts
}

fn count(map: &mut Map<String, Value>, key: &str) {
    let n = map.get(key).and_then(Value::as_u64).unwrap_or(0);
    map.insert(key.to_owned(), (n + 1).into());
}

/// The materials that some shape has, or a mix of such; the importer's arena may hold more.
fn used_materials<'a>(scene: &'a Scene, shapes: impl Iterator<Item = &'a Shape>) -> Vec<&'a Material> {
    let mut used = vec![false; scene.materials.len()];
    let mut mark = |id: MaterialId| used.get_mut(id.0 as usize).into_iter().for_each(|u| *u = true);
    shapes.for_each(|s| mark(s.material));
    // A mix refers to earlier materials only.
    for (i, m) in scene.materials.iter().enumerate().rev() {
        if let (MaterialKind::Mix { a, b, .. }, true) = (&m.kind, used[i]) {
            for id in [a, b] {
                used.get_mut(id.0 as usize).into_iter().for_each(|u| *u = true);
            }
        }
    }
    scene.materials.iter().zip(used).filter(|m| m.1).map(|m| m.0).collect()
}

fn mesh_size(scene: &Scene, shape: &Shape) -> usize {
    match shape.geometry {
        Geometry::Mesh(id) => scene.meshes.get(id.0 as usize).map_or(0, |m| m.indices.len()),
        Geometry::Quadric(..) => 0,
    }
}

fn material(kind: &MaterialKind) -> &'static str {
    match kind {
        MaterialKind::Diffuse { .. } => "diffuse",
        MaterialKind::Conductor { .. } => "conductor",
        MaterialKind::Dielectric { .. } => "dielectric",
        MaterialKind::ThinDielectric { .. } => "thindielectric",
        MaterialKind::CoatedDiffuse { .. } => "coateddiffuse",
        MaterialKind::CoatedConductor { .. } => "coatedconductor",
        MaterialKind::DiffuseTransmission { .. } => "diffusetransmission",
        MaterialKind::Mix { .. } => "mix",
        MaterialKind::Polished { .. } => "polished",
        MaterialKind::TintedPane { .. } => "tintedpane",
        MaterialKind::TintedDielectric { .. } => "tinteddielectric",
        MaterialKind::Interface => "interface",
    }
}

fn texture(texture: &Texture) -> &'static str {
    match texture {
        Texture::Constant(_) => "constant",
        Texture::Image { .. } => "image",
        Texture::Scale(..) => "scale",
        Texture::Mix { .. } => "mix",
        Texture::Checkerboard { .. } => "checkerboard",
    }
}

fn environment(environment: &Environment) -> &'static str {
    match environment {
        Environment::Constant { .. } => "constant",
        Environment::Image { .. } => "image",
        Environment::Sun { .. } => "sun",
    }
}

fn filter(filter: &Filter) -> String {
    let (name, r) = match filter {
        Filter::Box { radius } => ("box", radius),
        Filter::Triangle { radius } => ("triangle", radius),
        Filter::Gaussian { radius, .. } => ("gaussian", radius),
        Filter::Mitchell { radius, .. } => ("mitchell", radius),
        Filter::Sinc { radius, .. } => ("sinc", radius),
    };
    format!("{name} {} x {}", r.x, r.y)
}

fn camera(scene: &Scene) -> Value {
    let c = &scene.camera;
    let projection = match c.projection {
        Projection::Perspective { fov } => format!("perspective, {fov} degrees across the shorter side"),
        Projection::Orthographic => "orthographic".into(),
        Projection::View(v) => format!("{:?}, {} x {}", v.kind, v.horizontal, v.vertical).to_lowercase(),
        Projection::Spherical { equirectangular: true } => "spherical, equirectangular".into(),
        Projection::Spherical { equirectangular: false } => "spherical, equal-area".into(),
    };
    json!({
        "projection": projection,
        "position": c.to_world.translation.to_array(),
        "direction": c.to_world.transform_vector3(DVec3::Z).normalize_or_zero().to_array(),
        "lens_radius": c.lens_radius,
    })
}

/// Smallest box around everything, metres; that of a quadric is the box of its own box.
fn bounds(scene: &Scene) -> Option<(DVec3, DVec3)> {
    let mut range: Option<(DVec3, DVec3)> = None;
    let mut include = |p: DVec3| {
        let (lo, hi) = range.unwrap_or((p, p));
        range = Some((lo.min(p), hi.max(p)));
    };
    scene.shapes.iter().for_each(|s| points(scene, s, &DAffine3::IDENTITY, &mut include));
    for instance in &scene.instances {
        let Some(object) = scene.objects.get(instance.object as usize) else { continue };
        object.shapes.iter().for_each(|s| points(scene, s, &instance.to_world, &mut include));
    }
    range
}

fn points(scene: &Scene, shape: &Shape, to_world: &DAffine3, include: &mut impl FnMut(DVec3)) {
    match shape.geometry {
        Geometry::Mesh(id) => {
            let Some(mesh) = scene.meshes.get(id.0 as usize) else { return };
            let corners = mesh.indices.iter().flatten().filter_map(|i| mesh.positions.get(*i as usize));
            corners.for_each(|p| include(to_world.transform_point3(p.as_dvec3())));
        }
        Geometry::Quadric(q, placed) => {
            let (r, z0, z1) = match q {
                Quadric::Sphere { radius, z_min, z_max, .. } => (radius, z_min, z_max),
                Quadric::Disk { height, radius, .. } => (radius, height, height),
                Quadric::Cylinder { radius, z_min, z_max, .. } => (radius, z_min, z_max),
            };
            for i in 0..8 {
                let side = |bit: u32, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
                let corner = DVec3::new(side(0, -r, r), side(1, -r, r), side(2, z0, z1));
                include(to_world.transform_point3(placed.transform_point3(corner)));
            }
        }
    }
}

/// The facts as lines.
pub fn describe(facts: &Value) -> String {
    let mut out = String::new();
    let mut line = |key: &str, value: String| {
        if !value.is_empty() {
            out += &format!("{key:<12} {value}\n");
        }
    };
    let number = |key: &str| facts[key].as_u64().unwrap_or(0);
    let kinds = |key: &str| {
        let map = facts[key].as_object();
        let list = map.into_iter().flatten().map(|(k, v)| format!("{v} {k}"));
        list.collect::<Vec<_>>().join(", ")
    };
    let film = &facts["film"];
    let file = film["file"].as_str().map_or(String::new(), |f| format!(", to {f}"));
    let filter = film["filter"].as_str().unwrap_or("");
    line("film", format!("{} x {} pixels, filter {filter}{file}", film["width"], film["height"]));
    let crop = floats(&film["crop"]);
    if crop != [0.0, 1.0, 0.0, 1.0] {
        line("crop", format!("{crop:?}"));
    }
    let camera = &facts["camera"];
    let triple = |v: &Value| floats(v).iter().map(|x| format!("{}", short(*x))).collect::<Vec<_>>().join(" ");
    let (at, towards) = (triple(&camera["position"]), triple(&camera["direction"]));
    line("camera", format!("{}, at {at}, towards {towards}", camera["projection"].as_str().unwrap_or("")));
    line(
        "shapes",
        format!(
            "{} ({} triangles, {} quadrics; {} objects placed {} times; {} primitives in all)",
            number("shapes"),
            number("triangles"),
            number("quadrics"),
            number("objects"),
            number("instances"),
            number("primitives")
        ),
    );
    line("materials", kinds("materials"));
    line("textures", kinds("textures"));
    line(
        "luminaires",
        format!(
            "{}, {:.6} W in all (luminance){}",
            number("luminaires"),
            facts["power_W"].as_f64().unwrap_or(0.0),
            match kinds("environments").as_str() {
                "" => String::new(),
                list => format!("; environment: {list}"),
            }
        ),
    );
    if let (lo, Some(hi)) = (&facts["bounds"][0], facts["bounds"].get(1)) {
        line("bounds", format!("{} to {} m", triple(lo), triple(hi)));
    }
    if let Some(n) = facts["samples_per_pixel"].as_u64() {
        line("asks for", format!("{n} samples per pixel"));
    }
    if let Some(n) = facts["max_depth"].as_u64() {
        line("max depth", format!("{n} (used with --max-depth file)"));
    }
    line("scene hash", facts["scene_hash"].as_str().unwrap_or("").to_owned());
    for file in facts["files"].as_array().into_iter().flatten() {
        line("file", file.as_str().unwrap_or("").to_owned());
    }
    out
}

fn floats(v: &Value) -> Vec<f64> {
    v.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

/// Five significant digits.
fn short(v: f64) -> f64 {
    let rounded: f64 = format!("{v:.4e}").parse().unwrap_or(v);
    if rounded == 0.0 { 0.0 } else { rounded }
}
