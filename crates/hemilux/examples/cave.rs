//! Writes a scene of about a million triangles: the inside of a bumpy sphere with a lamp and a mirror ball.
//!
//!     cargo run --release -p hemilux --example cave -- DIRECTORY [triangles]
//!
//! The mesh goes to DIRECTORY/cave.ply (binary), the scene to DIRECTORY/cave.pbrt.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let directory = Path::new(args.first().ok_or("usage: cave DIRECTORY [triangles]")?);
    let wanted: usize = args.get(1).map_or(Ok(1_000_000), |s| s.parse())?;
    // A grid of rows × 2 rows, two triangles a cell.
    let rows = ((wanted as f64 / 4.0).sqrt().round() as usize).max(4);
    let columns = 2 * rows;
    let mut vertices = Vec::with_capacity((rows + 1) * (columns + 1) * 12);
    for j in 0..=rows {
        for i in 0..=columns {
            let (theta, phi) =
                (PI * j as f64 / rows as f64, 2.0 * PI * (i % columns) as f64 / columns as f64);
            let (d, bump) =
                ([theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()], bumps(theta, phi));
            for c in d {
                vertices.extend_from_slice(&((c * (3.0 + bump)) as f32).to_le_bytes());
            }
        }
    }
    let mut faces = Vec::with_capacity(rows * columns * 26);
    let at = |i: usize, j: usize| (j * (columns + 1) + i) as i32;
    let mut count = 0;
    for j in 0..rows {
        for i in 0..columns {
            for t in [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
            {
                faces.push(3u8);
                t.iter().for_each(|v| faces.extend_from_slice(&v.to_le_bytes()));
                count += 1;
            }
        }
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {count}\nproperty list uchar int vertex_indices\nend_header\n",
        (rows + 1) * (columns + 1)
    );
    fs::create_dir_all(directory)?;
    fs::write(directory.join("cave.ply"), [header.into_bytes(), vertices, faces].concat())?;
    fs::write(
        directory.join("cave.pbrt"),
        "LookAt -2 -1 0.3  1 0.5 0  0 0 1\nCamera \"perspective\" \"float fov\" 70\n\
         Film \"rgb\" \"integer xresolution\" 320 \"integer yresolution\" 240\nWorldBegin\n\
         Material \"diffuse\" \"rgb reflectance\" [ 0.6 0.55 0.5 ]\n\
         Shape \"plymesh\" \"string filename\" \"cave.ply\"\n\
         AttributeBegin\n  Translate 0.8 0.3 -0.4\n  Material \"conductor\" \"rgb reflectance\" [ 0.9 0.9 0.9 ]\n  \
         Shape \"sphere\" \"float radius\" 0.5\nAttributeEnd\n\
         AttributeBegin\n  AreaLightSource \"diffuse\" \"rgb L\" [ 60 50 40 ]\n  Translate -0.5 0.8 1.2\n  \
         Shape \"sphere\" \"float radius\" 0.1\nAttributeEnd\n",
    )?;
    println!("{count} triangles in {}", directory.display());
    Ok(())
}

/// A few octaves of smooth bumps (m).
fn bumps(theta: f64, phi: f64) -> f64 {
    (0..5)
        .map(|k| 0.25 / (1 << k) as f64 * ((5 << k) as f64 * theta).sin() * ((4 << k) as f64 * phi).cos())
        .sum()
}
