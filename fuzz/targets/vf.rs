//! Any text is a view with a finite, invertible camera, or an error.
#![no_main]

use hemilux_scene::{LoadOptions, Projection, load_radiance_str};
use libfuzzer_sys::fuzz_target;
use std::path::Path;

const SCENE: &str = "void light l 0 0 3 1 1 1 l sphere s 0 0 4 0 0 0 1";

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    for lenient in [false, true] {
        let options = LoadOptions { lenient, memory_limit: Some(1 << 26), ..LoadOptions::default() };
        match load_radiance_str(SCENE, Some(&text), Path::new("."), &options) {
            Ok(loaded) => {
                let m = loaded.scene.camera.to_world;
                assert!(m.is_finite() && m.inverse().is_finite());
                let Projection::View(v) = loaded.scene.camera.projection else { panic!("no view") };
                assert!(v.horizontal > 0.0 && v.vertical > 0.0 && v.fore >= 0.0);
                assert!(loaded.scene.film.width > 0 && loaded.scene.film.height > 0);
            }
            Err(e) => assert!(e.diagnostics.iter().all(|d| !e.sources.one_line(d).contains('\n'))),
        }
    }
});
