//! Any bytes are a mesh with indices in range, or an error.
#![no_main]

use hemilux_scene::import::ply;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    match ply::read(data) {
        Ok(mesh) => {
            let n = mesh.positions.len() as u32;
            assert!(mesh.triangles.iter().flatten().all(|&i| i < n));
            assert!(mesh.positions.iter().all(|p| p.is_finite()));
            assert!(mesh.normals.is_empty() || mesh.normals.len() == n as usize);
            assert!(mesh.uvs.is_empty() || mesh.uvs.len() == n as usize);
        }
        Err(e) => assert!(!e.message.is_empty() && !e.message.contains('\n')),
    }
});
