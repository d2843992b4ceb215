//! Any text is a Radiance scene or an error, whether lenient or not; the promises of a loaded scene hold.
#![no_main]

use hemilux_scene::{Environment, Geometry, LoadOptions, MaterialKind, Quadric, load_radiance_str};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    for lenient in [false, true] {
        let options = LoadOptions { lenient, memory_limit: Some(1 << 26), ..LoadOptions::default() };
        match load_radiance_str(&text, None, Path::new("seeds/rad"), &options) {
            Ok(loaded) => {
                let scene = &loaded.scene;
                for mesh in &scene.meshes {
                    let n = mesh.positions.len() as u32;
                    assert!(mesh.indices.iter().flatten().all(|&i| i < n));
                    assert!(mesh.positions.iter().chain(&mesh.normals).all(|p| p.is_finite()));
                    assert!(mesh.normals.is_empty() || mesh.normals.len() == mesh.positions.len());
                }
                for shape in &scene.shapes {
                    assert!((shape.material.0 as usize) < scene.materials.len());
                    match shape.geometry {
                        Geometry::Mesh(id) => assert!((id.0 as usize) < scene.meshes.len()),
                        Geometry::Quadric(q, m) => {
                            assert!(m.is_finite() && m.inverse().is_finite());
                            let (Quadric::Sphere { radius, .. }
                            | Quadric::Disk { radius, .. }
                            | Quadric::Cylinder { radius, .. }) = q;
                            assert!(radius > 0.0 && radius.is_finite());
                        }
                    }
                    assert!(shape.emission.iter().all(|e| e.radiance.is_finite()));
                }
                for (i, material) in scene.materials.iter().enumerate() {
                    if let MaterialKind::Mix { a, b, .. } = material.kind {
                        assert!((a.0 as usize) < i && (b.0 as usize) < i);
                    }
                }
                for environment in &scene.environments {
                    if let Environment::Image { image, .. } = environment {
                        let image = &scene.images[image.0 as usize];
                        assert!(image.texels.iter().all(|t| t.is_finite()));
                    }
                }
                assert!(scene.camera.to_world.is_finite());
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                assert!(error.diagnostics.iter().all(|d| !error.sources.one_line(d).contains('\n')));
            }
        }
    }
});
