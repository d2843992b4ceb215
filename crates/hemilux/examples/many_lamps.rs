//! Noise of direct light by number and kind of luminaires, at fixed samples.
//!
//!     cargo run --release -p hemilux --example many_lamps
//!
//! For each scene: relative variance of one gather (4 gather rays, 4 shadow rays), averaged over 64 receivers on the floor.

use hemilux::gather::{GatherPlan, Strategy};
use hemilux::sampler::Sampler;
use hemilux::sensor::irradiance;
use hemilux::transport::{Tally, Walker};
use hemilux::world::World;
use hemilux_scene::geom::Vec3;
use hemilux_scene::import::{LoadOptions, load_pbrt_str};
use std::fmt::Write;
use std::path::Path;

const HEAD: &str = "Camera \"perspective\"\nWorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [0 0 0]\n";
const LIGHT: &str = "AreaLightSource \"diffuse\" \"rgb L\" [90 90 90]\n";

fn grid(n: u32, spacing: f64, shape: &str) -> String {
    let mut text = format!("{HEAD}{LIGHT}");
    for i in 0..n * n {
        let (x, y) = ((i % n) as f64 - 0.5 * (n - 1) as f64, (i / n) as f64 - 0.5 * (n - 1) as f64);
        let _ = writeln!(
            text,
            "AttributeBegin Translate {} {} 2.5 {shape} AttributeEnd",
            x * spacing,
            y * spacing
        );
    }
    text
}

/// A tessellated sphere, emitting outwards.
fn globe(n: usize) -> String {
    let (mut points, mut triangles) = (String::new(), String::new());
    for j in 0..=n {
        for i in 0..2 * n {
            let (theta, phi) =
                (j as f64 / n as f64 * std::f64::consts::PI, i as f64 / n as f64 * std::f64::consts::PI);
            let _ = write!(
                points,
                "{} {} {} ",
                0.5 * theta.sin() * phi.cos(),
                0.5 * theta.sin() * phi.sin(),
                1.2 + 0.5 * theta.cos()
            );
            if j < n {
                let (a, b) = (j * 2 * n + i, j * 2 * n + (i + 1) % (2 * n));
                let (c, d) = (a + 2 * n, b + 2 * n);
                let _ = write!(triangles, "{a} {c} {d} {a} {d} {b} ");
            }
        }
    }
    format!("{HEAD}{LIGHT}Shape \"trianglemesh\" \"point3 P\" [{points}] \"integer indices\" [{triangles}]\n")
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sphere = "Shape \"sphere\" \"float radius\" 0.03";
    let panel = "ReverseOrientation Shape \"bilinearmesh\" \"point3 P\" [-0.3 -0.3 0  0.3 -0.3 0  -0.3 0.3 0  0.3 0.3 0]";
    let low = format!(
        "{HEAD}{LIGHT}ReverseOrientation Shape \"bilinearmesh\" \"point3 P\" [-2 -2 0.5  2 -2 0.5  -2 2 0.5  2 2 0.5]\n"
    );
    let outdoors = format!(
        "{HEAD}LightSource \"infinite\" \"rgb L\" [1 1 1]\nLightSource \"distant\" \"rgb L\" [20 20 20] \"point3 from\" [1 1 1]\n{}",
        grid(3, 2.0, sphere).replace(HEAD, "")
    );
    let scenes = [
        ("1 sphere", grid(1, 1.0, sphere)),
        ("4 spheres", grid(2, 2.0, sphere)),
        ("9 spheres", grid(3, 2.0, sphere)),
        ("1024 spheres", grid(32, 1.0, sphere)),
        ("1 panel", grid(1, 1.0, panel)),
        ("100 panels", grid(10, 1.5, panel)),
        ("a large panel close by", low),
        ("a globe of 512 triangles", globe(16)),
        ("sky, sun and 9 spheres", outdoors),
    ];
    let plan = GatherPlan { rays: 4, shadow_rays: 4, strategy: Strategy::Jittered };
    for (name, text) in &scenes {
        let world = World::new(load_pbrt_str(text, Path::new("."), &LoadOptions::default())?.scene);
        let walker = Walker::path(&world);
        let mut total = 0.0;
        for r in 0..64u32 {
            let p = Vec3::new((r % 8) as f32 - 3.5, (r / 8) as f32 - 3.5, 0.0) * 0.5;
            let (mut sum, mut squares) = (0.0, 0.0);
            let n = 500;
            for i in 0..n {
                let mut sampler = Sampler::new(1, (r * 1000 + i) as u64, 0);
                let e = irradiance(&walker, p, Vec3::Z, &plan, &mut sampler, &mut Tally::default())[1] as f64;
                sum += e;
                squares += e * e;
            }
            let mean = sum / n as f64;
            total += (squares / n as f64 - mean * mean).max(0.0) / (mean * mean).max(1e-30) / 64.0;
        }
        println!("{name:26} {total:.3e}");
    }
    Ok(())
}
