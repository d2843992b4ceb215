//! Writes the scenes of docs/gallery.md that are too regular or too large to be typed: a faceted reflector, a faceted
//! skylight, a fountain with rippled water, dew on grass and on a pane.
//!
//!     cargo run --release -p hemilux --example phenomena -- scenes
//!
//! Same output on every machine up to rounding of the last printed digit. Metres, z up, right-handed (hence the Scale).

use std::f64::consts::TAU;
use std::fmt::Write;
use std::{fs, path::Path};

type V = [f64; 3];

/// Uniform numbers in [0, 1) (a linear congruential generator: nothing depends on their quality).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 31) as f64
    }

    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A scene being written.
struct Scene(String);

impl Scene {
    fn new(comment: &str, eye: V, at: V, fov: f64) -> Scene {
        let mut text = String::new();
        comment.lines().for_each(|l| text += &format!("# {l}\n"));
        text +=
            "# Made by crates/hemilux/examples/phenomena.rs. Metres, z up, right-handed (hence the Scale).\n";
        text += "Scale -1 1 1\n";
        let _ = writeln!(text, "LookAt {}  {}  0 0 1", numbers(&eye), numbers(&at));
        let _ = writeln!(text, "Camera \"perspective\" \"float fov\" [ {fov} ]");
        text += "Film \"rgb\" \"integer xresolution\" [ 320 ] \"integer yresolution\" [ 240 ]\n";
        text += "Integrator \"volpath\" \"integer maxdepth\" [ 64 ]\nWorldBegin\n";
        Scene(text)
    }

    fn line(&mut self, text: &str) -> &mut Scene {
        self.0 += text;
        self.0.push('\n');
        self
    }

    fn mesh(&mut self, points: &[V], faces: &[[usize; 3]]) -> &mut Scene {
        self.0 += "Shape \"trianglemesh\" \"point3 P\" [";
        points.iter().for_each(|p| self.0 += &format!(" {}", numbers(p)));
        self.0 += " ]\n  \"integer indices\" [";
        faces.iter().for_each(|f| self.0 += &format!(" {} {} {}", f[0], f[1], f[2]));
        self.line(" ]")
    }

    /// A parallelogram with corner `p` and normal a × b.
    fn quad(&mut self, p: V, a: V, b: V) -> &mut Scene {
        let at = |s: f64, t: f64| [0, 1, 2].map(|i| p[i] + s * a[i] + t * b[i]);
        self.mesh(&[at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)], &[[0, 1, 2], [0, 2, 3]])
    }

    fn placed(&mut self, at: V, text: &str) -> &mut Scene {
        let at = numbers(&at);
        self.line(&format!("AttributeBegin Translate {at} {text} AttributeEnd"))
    }
}

fn numbers(v: &[f64]) -> String {
    // Five digits after the point, without trailing zeros.
    let one = |x: &f64| {
        let text = format!("{x:.5}");
        let text = text.trim_end_matches('0').trim_end_matches('.').to_string();
        if text == "-0" { "0".to_string() } else { text }
    };
    v.iter().map(one).collect::<Vec<_>>().join(" ")
}

/// A box room with its inside facing in, without ceiling if `open`.
fn room(s: &mut Scene, low: V, high: V, open: bool) {
    let size = [0, 1, 2].map(|i| high[i] - low[i]);
    let (x, y, z) = ([size[0], 0.0, 0.0], [0.0, size[1], 0.0], [0.0, 0.0, size[2]]);
    s.quad(low, x, y);
    s.quad(low, y, z);
    s.quad(low, z, x);
    s.quad([high[0], low[1], low[2]], z, y);
    s.quad([low[0], high[1], low[2]], x, z);
    if !open {
        s.quad([low[0], low[1], high[2]], y, x);
    }
}

const GLASS: &str = "Material \"dielectric\" \"float eta\" [ 1.5 ]";
const WATER: &str = "Material \"dielectric\" \"float eta\" [ 1.333 ]";

fn matt(r: f64, g: f64, b: f64) -> String {
    format!("Material \"diffuse\" \"rgb reflectance\" [ {r} {g} {b} ]")
}

/// Filament, envelope, dented facets, wall.
fn reflector() -> Scene {
    let mut s = Scene::new(
        "A bulb with a clear envelope in a reflector of 480 dented flat facets: their images of the filament make the\n\
         pattern on the wall.",
        [-0.42, -0.62, 0.4],
        [0.0, 0.45, 0.25],
        44.0,
    );
    s.line(&matt(0.72, 0.7, 0.66));
    room(&mut s, [-1.0, -1.0, 0.0], [1.0, 0.75, 1.4], false);
    // z is the axis here; turned to +y and lifted below.
    s.line("AttributeBegin Translate 0.2 0.08 0.22 Rotate 14 0 0 1 Rotate -90 1 0 0");
    s.line("AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [ 26000 20500 14000 ] Material \"diffuse\" \"rgb reflectance\" [ 0 0 0 ]");
    s.line("Translate -0.003 0 0.027 Rotate 90 0 1 0 Shape \"cylinder\" \"float radius\" [ 0.0005 ] \"float zmin\" [ 0 ] \"float zmax\" [ 0.006 ] AttributeEnd");
    s.placed(
        [0.0, 0.0, 0.025],
        "Material \"thindielectric\" \"float eta\" [ 1.5 ] Shape \"sphere\" \"float radius\" [ 0.011 ]",
    );
    s.line("Material \"conductor\" \"rgb reflectance\" [ 0.88 0.88 0.86 ] \"float roughness\" [ 0 ]");
    // A paraboloid of focal length 22 mm, its facets pushed about by up to 0.8 mm.
    let (rings, sectors, focus) = (10, 24, 0.022);
    let mut random = Random(7);
    let mut points = Vec::new();
    for j in 0..=rings {
        let r = 0.008 + 0.047 * j as f64 / rings as f64;
        for i in 0..sectors {
            let phi = (i as f64 + 0.5 * (j % 2) as f64) / sectors as f64 * TAU;
            let dent = if j == rings { 0.0 } else { random.within(-8e-4, 8e-4) };
            points.push([r * phi.cos(), r * phi.sin(), r * r / (4.0 * focus) + dent]);
        }
    }
    let mut faces = Vec::new();
    for j in 0..rings {
        for i in 0..sectors {
            let (a, b) = (j * sectors + i, j * sectors + (i + 1) % sectors);
            let (c, d) = (a + sectors, b + sectors);
            // Rings are shifted against each other by half a sector.
            faces.extend(if j % 2 == 0 { [[a, b, c], [b, d, c]] } else { [[a, b, d], [a, d, c]] });
        }
    }
    s.mesh(&points, &faces);
    // A matt shell behind it keeps light inside the lamp.
    s.line(&matt(0.12, 0.12, 0.13));
    s.line(
        "Shape \"cylinder\" \"float radius\" [ 0.0562 ] \"float zmin\" [ -0.02 ] \"float zmax\" [ 0.036 ]",
    );
    s.line("Shape \"disk\" \"float radius\" [ 0.0562 ] \"float height\" [ -0.02 ]");
    s.line("AttributeEnd");
    // A stand, and something for the pattern to bend over.
    s.line(&matt(0.2, 0.2, 0.22));
    s.placed(
        [0.2, 0.07, 0.0],
        "Shape \"cylinder\" \"float radius\" [ 0.008 ] \"float zmin\" [ 0 ] \"float zmax\" [ 0.17 ]",
    );
    s.line(&matt(0.55, 0.25, 0.18));
    s.placed([-0.5, 0.52, 0.12], "Shape \"sphere\" \"float radius\" [ 0.12 ]");
    s
}

/// A roof of glass pyramids under the sun.
fn skylight() -> Scene {
    let mut s = Scene::new(
        "A stair hall under a skylight of faceted glass: every facet throws a patch of sun of its own on walls and floor.",
        [-1.55, -1.75, 1.5],
        [0.35, 0.6, 0.75],
        66.0,
    );
    s.line("LightSource \"infinite\" \"rgb L\" [ 1.6 2.1 2.9 ]");
    s.line("LightSource \"distant\" \"rgb L\" [ 460 420 360 ] \"point3 from\" [ -0.45 -0.35 1 ] \"point3 to\" [ 0 0 0 ]");
    s.line(&matt(0.75, 0.72, 0.67));
    room(&mut s, [-1.8, -2.0, 0.0], [1.8, 1.6, 2.6], true);
    // The roof: a frame around the opening, thick enough to be opaque from above and below.
    let (w, top) = (0.75, 2.6);
    for z in [top, top + 0.12] {
        s.quad([-1.8, -2.0, z], [0.0, 2.0 - w, 0.0], [3.6, 0.0, 0.0]);
        s.quad([-1.8, w, z], [0.0, 1.6 - w, 0.0], [3.6, 0.0, 0.0]);
        s.quad([-1.8, -w, z], [0.0, 2.0 * w, 0.0], [1.8 - w, 0.0, 0.0]);
        s.quad([w, -w, z], [0.0, 2.0 * w, 0.0], [1.8 - w, 0.0, 0.0]);
    }
    for (p, a) in [
        ([-w, -w], [2.0 * w, 0.0]),
        ([w, -w], [0.0, 2.0 * w]),
        ([w, w], [-2.0 * w, 0.0]),
        ([-w, w], [0.0, -2.0 * w]),
    ] {
        s.quad([p[0], p[1], top], [a[0], a[1], 0.0], [0.0, 0.0, 0.12]);
    }
    // One closed body of glass: flat above, pyramids below, walls at the edge (a little inside of the frame).
    s.line(GLASS);
    let (n, w) = (12, 0.748);
    let mut random = Random(3);
    let step = 2.0 * w / n as f64;
    let mut points = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            points.push([-w + step * i as f64, -w + step * j as f64, top + 0.06]);
        }
    }
    let mut faces = Vec::new();
    for j in 0..n {
        for i in 0..n {
            let (x, y) = (-w + step * (i as f64 + 0.5), -w + step * (j as f64 + 0.5));
            let tip = points.len();
            let mut off = || random.within(-0.2, 0.2) * step;
            let (dx, dy) = (off(), off());
            points.push([x + dx, y + dy, top + 0.06 - 0.35 * step + 0.3 * off()]);
            let a = j * (n + 1) + i;
            let corners = [a, a + 1, a + n + 2, a + n + 1];
            for k in 0..4 {
                faces.push([corners[(k + 1) % 4], corners[k], tip]);
            }
        }
    }
    let base = points.len();
    let high = top + 0.09;
    points.extend([[-w, -w, high], [w, -w, high], [w, w, high], [-w, w, high]]);
    faces.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
    // Each side is a fan from the upper edge to the row of points below.
    for k in 0..4 {
        let at = |m: usize| match k {
            0 => m,
            1 => m * (n + 1) + n,
            2 => n * (n + 1) + n - m,
            _ => (n - m) * (n + 1),
        };
        let (u, v) = (base + k, base + (k + 1) % 4);
        for m in 0..n {
            faces.push([u, at(m), at(m + 1)]);
        }
        faces.push([u, at(n), v]);
    }
    s.mesh(&points, &faces);
    s.line(&matt(0.35, 0.42, 0.5));
    s.placed([0.75, 0.55, 0.28], "Shape \"sphere\" \"float radius\" [ 0.28 ]");
    s.line(&matt(0.5, 0.34, 0.22));
    for k in 0..4 {
        let (y, h) = (0.55 + 0.26 * k as f64, 0.17 * (k + 1) as f64);
        s.quad([-1.8, y, h], [1.5, 0.0, 0.0], [0.0, 0.26, 0.0]);
        s.quad([-1.8, y, h - 0.17], [1.5, 0.0, 0.0], [0.0, 0.0, 0.17]);
        s.quad([-0.3, y, 0.0], [0.0, 0.26, 0.0], [0.0, 0.0, h]);
    }
    s
}

/// Ripples: height (m) and slopes.
fn ripple(x: f64, y: f64) -> V {
    let mut sum = [0.0; 3];
    let mut ring = |cx: f64, cy: f64, length: f64, height: f64, decay: f64| {
        let (dx, dy) = (x - cx, y - cy);
        let r = (dx * dx + dy * dy + 0.01).sqrt();
        let (k, a) = (TAU / length, height * (-r / decay).exp());
        let (s, c) = (k * r).sin_cos();
        let slope = a * (k * c - s / decay) / r;
        sum[0] += a * s;
        sum[1] += slope * dx;
        sum[2] += slope * dy;
    };
    ring(0.0, 0.0, 0.23, 0.008, 0.7);
    ring(-0.5, 0.3, 0.31, 0.004, 1.0);
    ring(0.7, -0.6, 0.17, 0.0025, 0.6);
    ring(1.4, 1.2, 0.41, 0.004, 2.0);
    sum
}

/// The water as a mesh file with normals, and the hall around it.
fn fountain(directory: &Path) -> std::io::Result<Scene> {
    let (n, half) = (40usize, 1.21);
    let mut body = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            let at = |k: usize| -half + 2.0 * half * k as f64 / n as f64;
            let (x, y) = (at(i), at(j));
            let [z, sx, sy] = ripple(x, y);
            let length = (1.0 + sx * sx + sy * sy).sqrt();
            for v in [x, y, z, -sx / length, -sy / length, 1.0 / length] {
                body.extend_from_slice(&(v as f32).to_le_bytes());
            }
        }
    }
    for j in 0..n {
        for i in 0..n {
            let a = j * (n + 1) + i;
            body.push(4u8);
            for v in [a, a + 1, a + n + 2, a + n + 1] {
                body.extend_from_slice(&(v as u16).to_le_bytes());
            }
        }
    }
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment rippled water, made by examples/phenomena.rs\n\
         element vertex {}\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n\
         property float nz\nelement face {}\nproperty list uchar ushort vertex_indices\nend_header\n",
        (n + 1) * (n + 1),
        n * n
    );
    fs::create_dir_all(directory.join("meshes"))?;
    fs::write(directory.join("meshes/water.ply"), [header.into_bytes(), body].concat())?;

    let mut s = Scene::new(
        "The fountain of an atrium: the sun comes in by a skylight, rippled water throws it on wall and ceiling and\n\
         gathers it on the floor of the basin.",
        [-2.1, -2.3, 1.45],
        [0.15, 0.55, 0.55],
        62.0,
    );
    s.line("LightSource \"infinite\" \"rgb L\" [ 1.6 2.1 2.9 ]");
    s.line("LightSource \"distant\" \"rgb L\" [ 460 420 360 ] \"point3 from\" [ -0.3 -0.6 1 ] \"point3 to\" [ 0 0 0 ]");
    s.line(&matt(0.74, 0.7, 0.62));
    let (low, high) = ([-2.5, -2.6, 0.12], [2.5, 2.0, 3.0]);
    let size = [high[0] - low[0], high[1] - low[1], high[2] - low[2]];
    let z = [0.0, 0.0, size[2]];
    s.quad(low, [0.0, size[1], 0.0], z);
    s.quad(low, z, [size[0], 0.0, 0.0]);
    s.quad([high[0], low[1], low[2]], z, [0.0, size[1], 0.0]);
    s.quad([low[0], high[1], low[2]], [size[0], 0.0, 0.0], z);
    // Ceiling with an opening through which the sun reaches the water.
    let (x0, x1, y0, y1) = (-1.7, 0.3, -2.5, -0.9);
    for top in [3.0, 3.2] {
        s.quad([low[0], low[1], top], [0.0, y0 - low[1], 0.0], [size[0], 0.0, 0.0]);
        s.quad([low[0], y1, top], [0.0, high[1] - y1, 0.0], [size[0], 0.0, 0.0]);
        s.quad([low[0], y0, top], [0.0, y1 - y0, 0.0], [x0 - low[0], 0.0, 0.0]);
        s.quad([x1, y0, top], [0.0, y1 - y0, 0.0], [high[0] - x1, 0.0, 0.0]);
    }
    for (p, a) in [
        ([x0, y0], [x1 - x0, 0.0]),
        ([x1, y0], [0.0, y1 - y0]),
        ([x1, y1], [x0 - x1, 0.0]),
        ([x0, y1], [0.0, y0 - y1]),
    ] {
        s.quad([p[0], p[1], 3.0], [a[0], a[1], 0.0], [0.0, 0.0, 0.2]);
    }
    // Floor around the basin, the basin's rim, and its inside of tiles.
    let rim = 1.2;
    s.line("Texture \"flags\" \"spectrum\" \"checkerboard\" \"float uscale\" [ 5 ] \"float vscale\" [ 5 ] \"rgb tex1\" [ 0.5 0.42 0.33 ] \"rgb tex2\" [ 0.44 0.37 0.29 ]");
    s.line("Material \"diffuse\" \"texture reflectance\" \"flags\"");
    s.quad([low[0], low[1], 0.12], [size[0], 0.0, 0.0], [0.0, -rim - low[1], 0.0]);
    s.quad([low[0], rim, 0.12], [size[0], 0.0, 0.0], [0.0, high[1] - rim, 0.0]);
    s.quad([low[0], -rim, 0.12], [-rim - low[0], 0.0, 0.0], [0.0, 2.0 * rim, 0.0]);
    s.quad([rim, -rim, 0.12], [high[0] - rim, 0.0, 0.0], [0.0, 2.0 * rim, 0.0]);
    s.line("Texture \"tiles\" \"spectrum\" \"checkerboard\" \"float uscale\" [ 12 ] \"float vscale\" [ 12 ] \"rgb tex1\" [ 0.42 0.6 0.62 ] \"rgb tex2\" [ 0.36 0.54 0.58 ]");
    s.line("Material \"diffuse\" \"texture reflectance\" \"tiles\"");
    s.quad([-rim, -rim, -0.4], [2.0 * rim, 0.0, 0.0], [0.0, 2.0 * rim, 0.0]);
    let wall = [0.0, 0.0, 0.52];
    s.quad([-rim, -rim, -0.4], [0.0, 2.0 * rim, 0.0], wall);
    s.quad([rim, -rim, -0.4], wall, [0.0, 2.0 * rim, 0.0]);
    s.quad([-rim, rim, -0.4], [2.0 * rim, 0.0, 0.0], wall);
    s.quad([-rim, -rim, -0.4], wall, [2.0 * rim, 0.0, 0.0]);
    s.line(&matt(0.58, 0.56, 0.52));
    s.placed(
        [0.0, 0.0, -0.4],
        "Shape \"cylinder\" \"float radius\" [ 0.09 ] \"float zmin\" [ 0 ] \"float zmax\" [ 0.75 ]",
    );
    s.placed([0.0, 0.0, 0.42], "Shape \"sphere\" \"float radius\" [ 0.16 ]");
    s.line(WATER);
    s.line("Shape \"plymesh\" \"string filename\" [ \"meshes/water.ply\" ]");
    Ok(s)
}

/// Blades of grass with drops along them, a low sun.
fn grass() -> Scene {
    let mut s = Scene::new(
        "Dew on grass in the first sun: every drop is a lens that burns a small bright spot on its blade.",
        [-0.03, -0.075, 0.04],
        [-0.001, 0.0, 0.026],
        25.0,
    );
    s.line("LightSource \"infinite\" \"rgb L\" [ 1.2 1.7 2.4 ]");
    s.line("LightSource \"distant\" \"rgb L\" [ 420 350 250 ] \"point3 from\" [ -0.8 0.55 0.5 ] \"point3 to\" [ 0 0 0 ]");
    s.line(&matt(0.16, 0.12, 0.08));
    s.quad([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    s.line(&matt(0.12, 0.2, 0.07));
    s.quad([-1.0, 0.35, 0.0], [2.0, 0.0, 0.0], [0.0, 0.05, 0.1]);
    let mut random = Random(11);
    let mut drops = Vec::new();
    s.line("Material \"diffusetransmission\" \"rgb reflectance\" [ 0.12 0.26 0.06 ] \"rgb transmittance\" [ 0.1 0.24 0.03 ]");
    for _ in 0..46 {
        let (x, y) = (random.within(-0.055, 0.055), random.within(-0.02, 0.07));
        let (turn, lean) = (random.within(0.0, TAU), random.within(0.15, 0.9));
        let (length, width) = (random.within(0.03, 0.055), random.within(0.002, 0.0036));
        let steps = 7;
        let (mut points, mut faces): (Vec<V>, Vec<[usize; 3]>) = (Vec::new(), Vec::new());
        let along = [turn.cos(), turn.sin()];
        let across = [-turn.sin(), turn.cos()];
        let (mut out, mut up) = (0.0, 0.0);
        for k in 0..=steps {
            let t = k as f64 / steps as f64;
            let w = width * (1.0 - t * t) * 0.5;
            let centre = [x + along[0] * out, y + along[1] * out, up];
            for side in [-1.0, 1.0] {
                // Bent up at the edges.
                points.push([
                    centre[0] + side * w * across[0],
                    centre[1] + side * w * across[1],
                    centre[2] + 0.25 * w,
                ]);
            }
            let angle = lean * t * 1.6;
            if k > 1 && k < steps && random.next() < 0.5 {
                let r = random.within(0.3, 0.55) * width;
                // On the upper side: along the normal of the bent blade.
                let normal = [-along[0] * angle.cos(), -along[1] * angle.cos(), angle.sin()];
                let lift = 1.02 * r + 0.25 * w;
                drops.push(([0, 1, 2].map(|i| centre[i] + lift * normal[i]), r));
            }
            out += length / steps as f64 * angle.sin();
            up += length / steps as f64 * angle.cos();
        }
        for k in 0..steps {
            let a = 2 * k;
            faces.extend([[a, a + 1, a + 3], [a, a + 3, a + 2]]);
        }
        s.mesh(&points, &faces);
    }
    s.line(WATER);
    for (p, r) in drops {
        s.placed(p, &format!("Shape \"sphere\" \"float radius\" [ {} ]", numbers(&[r])));
    }
    s
}

/// Drops of condensation on a pane, the sun behind them, a sheet of paper before them.
fn pane() -> Scene {
    let mut s = Scene::new(
        "Drops on a window pane with the sun behind: each is a plano-convex lens that gathers the sun on the sheet of\n\
         paper on the sill.",
        [-0.14, -0.33, 0.24],
        [0.01, -0.045, 0.045],
        38.0,
    );
    s.line("LightSource \"infinite\" \"rgb L\" [ 0.9 1.2 1.6 ]");
    s.line("LightSource \"distant\" \"rgb L\" [ 420 380 320 ] \"point3 from\" [ 0.25 0.75 0.62 ] \"point3 to\" [ 0 0 0 ]");
    // The wall with the window, the sill.
    s.line(&matt(0.7, 0.68, 0.64));
    let (w, low, high) = (0.12, 0.02, 0.2);
    for y in [0.0, 0.02] {
        s.quad([-0.6, y, -0.3], [1.2, 0.0, 0.0], [0.0, 0.0, 0.3 + low]);
        s.quad([-0.6, y, high], [1.2, 0.0, 0.0], [0.0, 0.0, 0.4]);
        s.quad([-0.6, y, low], [0.6 - w, 0.0, 0.0], [0.0, 0.0, high - low]);
        s.quad([w, y, low], [0.6 - w, 0.0, 0.0], [0.0, 0.0, high - low]);
    }
    s.quad([-w, 0.0, low], [2.0 * w, 0.0, 0.0], [0.0, 0.02, 0.0]);
    s.quad([-w, 0.0, high], [2.0 * w, 0.0, 0.0], [0.0, 0.02, 0.0]);
    s.quad([-w, 0.0, low], [0.0, 0.02, 0.0], [0.0, 0.0, high - low]);
    s.quad([w, 0.0, low], [0.0, 0.02, 0.0], [0.0, 0.0, high - low]);
    s.line(&matt(0.42, 0.28, 0.18));
    s.quad([-0.6, -0.6, -0.001], [1.2, 0.0, 0.0], [0.0, 0.6, 0.0]);
    s.line(&matt(0.8, 0.8, 0.78));
    s.quad([-0.13, -0.19, 0.0], [0.26, 0.0, 0.0], [0.0, 0.18, 0.0]);
    s.line("Material \"thindielectric\" \"float eta\" [ 1.5 ]");
    s.quad([-w, 0.012, low], [2.0 * w, 0.0, 0.0], [0.0, 0.0, high - low]);
    // A drop of unit radius: the cap beyond z = 0.4 and its flat back, both facing out. z turns to -y (indoors).
    s.line("ObjectBegin \"drop\"");
    s.line(WATER);
    s.line("Shape \"sphere\" \"float radius\" [ 1 ] \"float zmin\" [ 0.4 ] \"float zmax\" [ 1 ]");
    let rim = (1.0f64 - 0.16).sqrt();
    s.line(&format!(
        "ReverseOrientation Shape \"disk\" \"float radius\" [ {} ] \"float height\" [ 0.4 ]",
        numbers(&[rim])
    ));
    s.line("ObjectEnd");
    let mut random = Random(5);
    let mut placed: Vec<(f64, f64, f64)> = Vec::new();
    for _ in 0..4000 {
        let r = 0.0012 + 0.0062 * random.next().powi(3);
        let (x, z) = (random.within(-w + r, w - r), random.within(low + r, high - r));
        let apart = |q: &(f64, f64, f64)| (q.0 - x).hypot(q.1 - z) > q.2 + r;
        if placed.len() < 150 && placed.iter().all(apart) {
            placed.push((x, z, r));
        }
    }
    for (x, z, r) in placed {
        // The flat back lies 0.1 mm before the pane.
        let at = numbers(&[x, 0.0119 + 0.4 * r, z]);
        s.line(&format!(
            "AttributeBegin Translate {at} Rotate 90 1 0 0 Scale {r:.5} {r:.5} {r:.5} ObjectInstance \"drop\" AttributeEnd"
        ));
    }
    s
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let directory = std::env::args().nth(1).ok_or("usage: phenomena DIRECTORY")?;
    let directory = Path::new(&directory);
    fs::create_dir_all(directory)?;
    let scenes = [
        ("reflector", reflector()),
        ("skylight", skylight()),
        ("fountain", fountain(directory)?),
        ("dew-grass", grass()),
        ("dew-pane", pane()),
    ];
    for (name, scene) in scenes {
        fs::write(directory.join(format!("{name}.pbrt")), scene.0)?;
    }
    Ok(())
}
