//! Any text is a scene or an error, whether lenient or not; the promises of a loaded scene hold.
#![no_main]

use hemilux_scene::{Geometry, LoadOptions, load_pbrt_str};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    for lenient in [false, true] {
        let options = LoadOptions {
            lenient,
            defines: vec![("key".into(), "1 2 3".into()), ("name".into(), "diffuse".into())],
            memory_limit: Some(1 << 28),
        };
        match load_pbrt_str(&text, Path::new("seeds/pbrt"), &options) {
            Ok(loaded) => {
                let scene = &loaded.scene;
                for mesh in &scene.meshes {
                    let n = mesh.positions.len() as u32;
                    assert!(mesh.indices.iter().flatten().all(|&i| i < n));
                    assert!(mesh.positions.iter().all(|p| p.is_finite()));
                    assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
                    assert!(mesh.uvs.is_empty() || mesh.uvs.len() == mesh.positions.len());
                }
                for shape in scene.shapes.iter().chain(scene.objects.iter().flat_map(|o| &o.shapes)) {
                    assert!((shape.material.0 as usize) < scene.materials.len());
                    match shape.geometry {
                        Geometry::Mesh(id) => assert!((id.0 as usize) < scene.meshes.len()),
                        Geometry::Quadric(_, m) => assert!(m.is_finite() && m.inverse().is_finite()),
                    }
                }
                assert!(scene.instances.iter().all(|i| (i.object as usize) < scene.objects.len()));
                assert!(scene.camera.to_world.is_finite());
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                assert!(error.diagnostics.iter().all(|d| !error.sources.one_line(d).contains('\n')));
            }
        }
    }
});
