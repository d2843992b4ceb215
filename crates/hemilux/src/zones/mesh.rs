//! The zonal solution as a coloured mesh (PLY), to look at in any mesh viewer.

use super::Zones;
use crate::world::World;
use std::io::{self, Write};

/// Write every cell as a face with its irradiance (W·m⁻², luminance of the brighter side) and a display colour, the
/// irradiance of that side scaled so that the 95th percentile by area is white, with an sRGB curve.
pub fn write_ply(world: &World, zones: &Zones, out: &mut dyn Write) -> io::Result<()> {
    let brighter = |zone: u32| {
        let (a, b) = (zones.irradiance(zone, 0), zones.irradiance(zone, 1));
        if a.luminance() >= b.luminance() { a } else { b }
    };
    let white = white_point(zones, brighter);
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let (mut vertex_count, mut face_count) = (0u32, 0u64);
    zones.map().for_each_cell(world, |corners, zone| {
        let e = brighter(zone);
        let colour = e.map(|v| srgb(v / white)).0.map(|v| (v * 255.0 + 0.5) as u8);
        for p in corners {
            for v in [p.x, p.y, p.z, e.luminance()] {
                vertices.extend_from_slice(&v.to_le_bytes());
            }
            vertices.extend_from_slice(&colour);
        }
        faces.push(corners.len() as u8);
        for i in 0..corners.len() as u32 {
            faces.extend_from_slice(&(vertex_count + i).to_le_bytes());
        }
        vertex_count += corners.len() as u32;
        face_count += 1;
    });
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment zonal solution; irradiance in W/m2, white at {white}\n\
         element vertex {vertex_count}\nproperty float x\nproperty float y\nproperty float z\n\
         property float irradiance\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n\
         element face {face_count}\nproperty list uchar uint vertex_indices\nend_header\n"
    )?;
    out.write_all(&vertices)?;
    out.write_all(&faces)
}

fn white_point(zones: &Zones, brighter: impl Fn(u32) -> hemilux_scene::Rgb) -> f32 {
    let areas = zones.map().areas();
    let mut lit: Vec<(f32, f32)> =
        (0..areas.len()).map(|z| (brighter(z as u32).luminance(), areas[z])).collect();
    lit.sort_by(|a, b| a.0.total_cmp(&b.0));
    let all: f64 = lit.iter().map(|x| x.1 as f64).sum();
    let mut sum = 0.0;
    for (e, a) in lit {
        sum += a as f64;
        if sum >= 0.95 * all && e > 0.0 {
            return e;
        }
    }
    1.0
}

fn srgb(v: f32) -> f32 {
    let v = v.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 }
}
