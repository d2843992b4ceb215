//! The benchmark scenes load, and say what their files say. Skips, aloud, where they are not installed: they are looked
//! for in `$HEMILUX_SHARED` and beside the workspace, in `../shared`.

use hemilux_scene::geom::DVec3;
use hemilux_scene::*;
use std::path::{Path, PathBuf};

fn scenes() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    let root = std::env::var_os("HEMILUX_SHARED").map_or(beside, PathBuf::from).join("scenes");
    if root.is_dir() {
        return Some(root);
    }
    eprintln!("skipped: no benchmark scenes at {}", root.display());
    None
}

fn load_one(path: PathBuf) -> Loaded {
    let loaded = load(std::slice::from_ref(&path), &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let complaints: Vec<String> = loaded
        .diagnostics
        .iter()
        .filter(|d| d.severity != Severity::Note)
        .map(|d| loaded.sources.one_line(d))
        .collect();
    assert!(complaints.is_empty(), "{}: {complaints:?}", path.display());
    loaded
}

/// Shapes, triangles, quadrics, luminaires.
fn census(scene: &Scene) -> [usize; 4] {
    let triangles = scene.meshes.iter().map(|m| m.indices.len()).sum();
    let quadrics = scene.shapes.iter().filter(|s| matches!(s.geometry, Geometry::Quadric(..))).count();
    let luminaires = scene.shapes.iter().filter(|s| s.emission.is_some()).count();
    [scene.shapes.len(), triangles, quadrics, luminaires]
}

/// Sum of the triangles' area vectors of the first luminous mesh.
fn luminaire_normal(scene: &Scene) -> DVec3 {
    let shape = scene.shapes.iter().find(|s| s.emission.is_some() && matches!(s.geometry, Geometry::Mesh(_)));
    let Some(Geometry::Mesh(id)) = shape.map(|s| s.geometry) else { panic!("no luminous mesh") };
    let mesh = &scene.meshes[id.0 as usize];
    let at = |i: u32| mesh.positions[i as usize].as_dvec3();
    mesh.indices.iter().map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0]))).sum::<DVec3>().normalize()
}

#[test]
fn all_benchmark_scenes_load() {
    let Some(root) = scenes() else { return };
    for (name, file, wanted) in [
        ("box", "box/box.pbrt", [8, 36, 0, 1]),
        ("bulb", "bulb/bulb.pbrt", [13, 3402, 2, 1]),
        ("office", "office/office.pbrt", [31, 218, 0, 2]),
        ("skylight", "skylight/skylight.pbrt", [28, 12224, 0, 2]),
        ("varnish", "varnish/varnish.pbrt", [18, 84, 6, 4]),
        ("cornell-box", "public/cornell-box/scene.pbrt", [8, 36, 0, 1]),
        ("veach-mis", "public/veach-mis/scene.pbrt", [9, 52, 3, 3]),
        ("veach-bidir", "public/veach-bidir/scene.pbrt", [14, 11544, 0, 2]),
    ] {
        let loaded = load_one(root.join(file));
        assert_eq!(census(&loaded.scene), wanted, "{name}");
    }
}

#[test]
fn the_box_is_seen_from_the_front_and_lit_from_above() {
    let Some(root) = scenes() else { return };
    let scene = load_one(root.join("box/box.pbrt")).scene;
    // Scale -1 1 1, LookAt 0 -5.4 1 0 0 1 0 0 1: x runs right in the picture, z up, the view along +y.
    let m = scene.camera.to_world;
    assert!((m.translation - DVec3::new(0.0, -5.4, 1.0)).length() < 1e-9, "{m:?}");
    for (local, world) in [(DVec3::X, DVec3::X), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::Y)] {
        assert!(
            (m.transform_vector3(local) - world).length() < 1e-9,
            "{local} {:?}",
            m.transform_vector3(local)
        );
    }
    assert_eq!((scene.film.width, scene.film.height), (320, 240));
    assert_eq!(scene.max_depth, Some(64));
    assert!(luminaire_normal(&scene).z < -0.999);
    let light = scene.shapes.iter().find_map(|s| s.emission.as_ref()).unwrap();
    assert_eq!(light.radiance, Rgb::new(17.0, 14.0, 10.0));
}

#[test]
fn the_cornell_box_faces_inwards() {
    let Some(root) = scenes() else { return };
    let scene = load_one(root.join("public/cornell-box/scene.pbrt")).scene;
    let m = scene.camera.to_world;
    assert!((m.translation - DVec3::new(0.0, 1.0, 6.8)).length() < 1e-6, "{m:?}");
    assert!((m.transform_vector3(DVec3::Z) - DVec3::NEG_Z).length() < 1e-6);
    assert!(luminaire_normal(&scene).y < -0.999);
    assert!(
        scene.meshes.iter().all(|m| m.normals.len() == m.positions.len() && m.uvs.len() == m.positions.len())
    );
}

/// The same scenes as Radiance has them: as many triangles and quadrics, luminaires that face the same way, the same view.
#[test]
fn radiance_twins_agree_with_the_pbrt_scenes() {
    let Some(root) = scenes() else { return };
    for name in ["box", "bulb", "office", "skylight", "varnish"] {
        let file = |extension: &str| root.join(name).join(format!("{name}.{extension}"));
        let rad =
            load(&[file("rad"), file("vf")], &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
        let pbrt = load_one(file("pbrt")).scene;
        let [_, triangles, quadrics, _] = census(&rad);
        let [_, expected, spheres, _] = census(&pbrt);
        assert_eq!([triangles, quadrics], [expected, spheres], "{name}");
        let (a, b) = (rad.camera.to_world, pbrt.camera.to_world);
        assert!((a.translation - b.translation).length() < 1e-6, "{name}: {a:?} {b:?}");
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            assert!((a.transform_vector3(axis) - b.transform_vector3(axis)).length() < 1e-6, "{name}");
        }
        let (Projection::View(v), Projection::Perspective { fov }) =
            (rad.camera.projection, pbrt.camera.projection)
        else {
            panic!("{name}")
        };
        assert!((v.vertical - fov as f64).abs() < 1e-4, "{name}");
        let meshes = |s: &Scene| {
            s.shapes.iter().any(|s| s.emission.is_some() && matches!(s.geometry, Geometry::Mesh(_)))
        };
        if meshes(&rad) {
            assert!(luminaire_normal(&rad).dot(luminaire_normal(&pbrt)) > 0.999, "{name}");
        }
    }
}
