//! Every scene that the project ships loads without error or warning.

use hemilux_scene::import::{LoadOptions, load};
use std::path::Path;

#[test]
fn shipped_scenes_load() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    let mut loaded = 0;
    let entries = std::fs::read_dir(&directory).unwrap();
    for path in entries.map(|e| e.unwrap().path()).filter(|p| p.extension().is_some_and(|e| e == "pbrt")) {
        match load(std::slice::from_ref(&path), &LoadOptions::default()) {
            Ok(scene) => assert!(scene.scene.shapes.len() + scene.scene.instances.len() > 0, "{path:?}"),
            Err(e) => panic!("{}: {e}", path.display()),
        }
        loaded += 1;
    }
    assert!(loaded >= 10, "{loaded} scenes in {}", directory.display());
    // Negative control: a scene that is not there does not load.
    assert!(load(&[directory.join("none.pbrt")], &LoadOptions::default()).is_err());
}
