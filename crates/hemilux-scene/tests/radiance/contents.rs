//! What Radiance scenes become.

use crate::Scratch;
use hemilux_scene::geom::{DAffine3, DVec3};
use hemilux_scene::*;
use std::path::Path;

fn loaded(text: &str) -> Loaded {
    load_radiance_str(text, None, Path::new("."), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn scene(text: &str) -> Scene {
    loaded(text).scene
}

fn said(loaded: &Loaded) -> Vec<String> {
    loaded.diagnostics.iter().map(|d| loaded.sources.one_line(d)).collect()
}

fn with_view(view: &str) -> Scene {
    let text = "void light l 0 0 3 1 1 1\nl sphere s 0 0 4 1 2 3 1\n";
    load_radiance_str(text, Some(view), Path::new("."), &LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}\n{view}"))
        .scene
}

/// The material of the only shape of a material called `m`.
fn material(definitions: &str) -> MaterialKind {
    let s = scene(&format!(
        "{definitions}\nm sphere s 0 0 4 0 0 0 1\nvoid light l 0 0 3 1 1 1\nl sphere t 0 0 4 9 0 0 1"
    ));
    s.materials[s.shapes[0].material.0 as usize].kind.clone()
}

fn close(a: Rgb, b: [f32; 3]) -> bool {
    (0..3).all(|c| (a[c] - b[c]).abs() < 1e-6)
}

fn mesh(s: &Scene, shape: usize) -> &Mesh {
    let Geometry::Mesh(id) = s.shapes[shape].geometry else {
        panic!("no mesh: {:?}", s.shapes[shape].geometry)
    };
    &s.meshes[id.0 as usize]
}

fn quadric(s: &Scene, shape: usize) -> (Quadric, DAffine3) {
    let Geometry::Quadric(q, m) = s.shapes[shape].geometry else { panic!("no quadric") };
    (q, m)
}

/// Sum of the triangles' area vectors.
fn area(m: &Mesh) -> DVec3 {
    let at = |i: u32| m.positions[i as usize].as_dvec3();
    m.indices.iter().map(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])) * 0.5).sum()
}

const GREY: &str = "void plastic g 0 0 5 .5 .5 .5 0 0\n";

#[test]
fn plastic_metal_and_trans_divide_the_light_as_the_manual_says() {
    let MaterialKind::Diffuse { reflectance: RgbParam::Constant(r) } =
        material("void plastic m 0 0 5 .5 .4 .3 0 .1")
    else {
        panic!()
    };
    assert!(close(r, [0.5, 0.4, 0.3]));
    let MaterialKind::Polished { diffuse, specular, specular_transmission, alpha, fresnel, .. } =
        material("void plastic m 0 0 5 .5 .4 .3 .1 .2")
    else {
        panic!()
    };
    assert!(
        close(diffuse, [0.45, 0.36, 0.27]) && close(specular, [0.1; 3]) && specular_transmission.is_black()
    );
    assert!(alpha == 0.2 && !fresnel);
    let MaterialKind::Polished { diffuse, specular, fresnel, .. } =
        material("void metal m 0 0 5 .5 .4 .3 .8 0")
    else {
        panic!()
    };
    assert!(close(diffuse, [0.1, 0.08, 0.06]) && close(specular, [0.4, 0.32, 0.24]) && fresnel);
    let MaterialKind::Polished { diffuse, specular, diffuse_transmission, specular_transmission, .. } =
        material("void trans m 0 0 7 .8 .6 .4 .1 .05 .5 .25")
    else {
        panic!()
    };
    assert!(close(diffuse, [0.36, 0.27, 0.18]) && close(specular, [0.1; 3]));
    assert!(close(diffuse_transmission, [0.27, 0.2025, 0.135]));
    assert!(close(specular_transmission, [0.09, 0.0675, 0.045]));
    // Too little gloss for grazing angles to matter.
    let MaterialKind::Polished { fresnel, .. } = material("void plastic m 0 0 5 .5 .4 .3 .01 0") else {
        panic!()
    };
    assert!(!fresnel);
}

#[test]
fn glass_dielectric_interface_and_mirror() {
    let MaterialKind::TintedPane { eta, transmissivity } = material("void glass m 0 0 3 .9 .8 .7") else {
        panic!()
    };
    assert!(eta == 1.52 && close(transmissivity, [0.9, 0.8, 0.7]));
    let MaterialKind::TintedPane { eta, .. } = material("void glass m 0 0 4 .9 .8 .7 1.6") else { panic!() };
    assert_eq!(eta, 1.6);
    let clear = material("void dielectric m 0 0 5 1 1 1 1.5 0");
    assert!(matches!(clear, MaterialKind::Dielectric { eta: 1.5, .. }));
    let tinted = material("void dielectric m 0 0 5 .5 1 1 1.5 0");
    let MaterialKind::TintedDielectric { eta, inside, outside } = tinted else { panic!() };
    assert!(eta == 1.5 && close(inside, [0.5, 1.0, 1.0]) && close(outside, [1.0; 3]));
    let MaterialKind::TintedDielectric { eta, inside, outside } =
        material("void interface m 0 0 8 1 1 1 1.5 .9 .8 .7 1.2")
    else {
        panic!()
    };
    assert!((eta - 1.25).abs() < 1e-6 && close(inside, [1.0; 3]) && close(outside, [0.9, 0.8, 0.7]));
    let MaterialKind::Polished { diffuse, specular, alpha, fresnel, .. } =
        material("void mirror m 0 0 3 .9 .8 .7")
    else {
        panic!()
    };
    assert!(diffuse.is_black() && close(specular, [0.9, 0.8, 0.7]) && alpha == 0.0 && !fresnel);
}

#[test]
fn absorption_scales_with_the_object() {
    let dir = Scratch::new("rad-scale");
    dir.write("d.rad", "void dielectric m 0 0 5 .25 1 1 1.5 0\nm sphere s 0 0 4 0 0 0 1");
    let path = dir.write("s.rad", "!xform -s 2 d.rad");
    let s = load(&[path], &LoadOptions::default()).unwrap().scene;
    let MaterialKind::TintedDielectric { inside, .. } = s.materials[s.shapes[0].material.0 as usize].kind
    else {
        panic!()
    };
    // Twice as thick, the same loss through it.
    assert!(close(inside, [0.5, 1.0, 1.0]));
}

#[test]
fn modifiers_bind_to_the_latest_earlier_definition() {
    let s = scene(
        "void light l 0 0 3 1 1 1\nl sphere a 0 0 4 0 0 0 1\nvoid light l 0 0 3 2 2 2\nl sphere b 0 0 4 3 0 0 1\n\
         inherit alias k l\nvoid light l 0 0 3 3 3 3\nk sphere c 0 0 4 6 0 0 1\nvoid alias j l\nj sphere d 0 0 4 9 0 0 1",
    );
    let radiances: Vec<f32> = s.shapes.iter().map(|s| s.emission.as_ref().unwrap().radiance[0]).collect();
    assert_eq!(radiances, [1.0, 2.0, 2.0, 3.0]);
    assert!(s.shapes.iter().all(|s| !s.emission.as_ref().unwrap().two_sided));
    assert_eq!(s.photometry, Photometry::RADIANCE);
    assert!((s.photometry.luminous(Rgb::WHITE) - 179.0).abs() < 1e-9);
}

#[test]
fn mixtures_and_illums() {
    let both = format!("{GREY}void metal h 0 0 5 1 1 1 1 0\n");
    let MaterialKind::Mix { amount, .. } = material(&format!("{both}void mixfunc m 4 g h A1/4 . 0 1 1"))
    else {
        panic!()
    };
    // The first part counts a quarter.
    assert_eq!(amount, FloatParam::Constant(0.75));
    let s = scene(&format!("{both}void mixfunc m 4 g void .25 . 0 0\nm sphere s 0 0 4 0 0 0 1"));
    assert_eq!(s.shapes[0].alpha, Some(FloatParam::Constant(0.25)));
    let l = loaded(&format!(
        "{GREY}void illum i 1 g 0 3 9 9 9\ni sphere s 0 0 4 0 0 0 1\nvoid illum j 0 0 3 9 9 9\nj sphere t 0 0 4 3 0 0 1\n\
         void glow k 0 0 4 1 1 1 5\nk sphere u 0 0 4 6 0 0 1\nvoid mirror n 1 g 0 3 1 1 1\nn sphere v 0 0 4 9 0 0 1"
    ));
    assert_eq!(l.scene.shapes.len(), 3, "an illum without alternative is not there");
    assert!(l.scene.shapes[0].emission.is_none());
    let text = said(&l).join("\n");
    assert!(
        text.contains("hints to a direct calculation are not needed here: 2 illum, 1 mirror, 1 glow radius")
    );
    assert!(text.contains("<text>:4:6: warning: illum \"j\" has no alternative material"), "{text}");
}

#[test]
fn spotlights_have_a_hard_cone() {
    let s = scene("void spotlight l 0 0 7 1 2 3 60 0 0 -2\nl ring r 0 0 8 0 0 0 0 0 -1 0 1");
    let e = s.shapes[0].emission.as_ref().unwrap();
    let Profile::Spot { axis, cos_start, cos_end } = e.profile else { panic!() };
    assert!((axis.z + 1.0).abs() < 1e-6 && cos_start == cos_end && (cos_end - 0.75f32.sqrt()).abs() < 1e-6);
}

#[test]
fn surfaces_face_where_the_manual_says() {
    let s = scene(&format!(
        "{GREY}g sphere a 0 0 4 1 2 3 .5\ng bubble b 0 0 4 1 2 3 .5\ng cylinder c 0 0 7 0 0 1 0 0 4 .5\n\
         g tube d 0 0 7 0 0 1 0 0 4 .5\ng ring e 0 0 8 1 2 3 0 0 -2 .5 .2\ng cone f 0 0 8 0 0 0 0 0 2 1 .5\n\
         g cup h 0 0 8 0 0 0 0 0 2 1 .5\ng cone i 0 0 8 0 0 0 1 0 0 .5 .5"
    ));
    let reversed: Vec<bool> = s.shapes[..5].iter().map(|s| s.reverse_orientation).collect();
    assert_eq!(reversed, [false, true, false, true, false]);
    let (q, m) = quadric(&s, 0);
    assert_eq!(q, Quadric::Sphere { radius: 0.5, z_min: -0.5, z_max: 0.5, phi_max: std::f64::consts::TAU });
    assert_eq!(m.translation, DVec3::new(1.0, 2.0, 3.0));
    let (q, m) = quadric(&s, 2);
    assert!(matches!(q, Quadric::Cylinder { radius: 0.5, z_min: 0.0, z_max: 3.0, .. }));
    assert!((m.transform_point3(DVec3::Z * 3.0) - DVec3::new(0.0, 0.0, 4.0)).length() < 1e-12);
    let (q, m) = quadric(&s, 4);
    assert!(matches!(q, Quadric::Disk { radius: 0.5, inner_radius: 0.2, .. }));
    assert!((m.transform_vector3(DVec3::Z) + DVec3::Z).length() < 1e-12);
    assert!(matches!(quadric(&s, 5).0, Quadric::Cylinder { .. }), "a cone of equal radii");
    // Cone and cup share a mesh: areas cancel, each vertex keeps its normal.
    let m = mesh(&s, 6);
    let slant = (4.0f64 + 0.25).sqrt() * std::f64::consts::PI * 1.5;
    let at = |i: u32| m.positions[i as usize].as_dvec3();
    let mut sum = 0.0;
    for t in &m.indices {
        let n = (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])) * 0.5;
        let given = m.normals[t[0] as usize].as_dvec3();
        assert!(n.normalize().dot(given) > 0.999);
        sum += n.length();
        let outward = n.dot(DVec3::new(at(t[0]).x, at(t[0]).y, 0.0)) > 0.0;
        assert_eq!(outward, t[0] < 256, "the cone comes first and faces outward");
    }
    assert!((sum / (2.0 * slant) - 1.0).abs() < 3e-4, "{sum} {slant}");
}

#[test]
fn polygons_keep_their_area() {
    // A concave L, and a square with a hole by a seam.
    let s = scene(&format!(
        "{GREY}g polygon l 0 0 18 0 0 1 3 0 1 3 1 1 1 1 1 1 3 1 0 3 1\n\
         g polygon h 0 0 30 0 0 0 4 0 0 4 4 0 0 4 0 0 0 0 1 1 0 1 2 0 2 2 0 2 1 0 1 1 0"
    ));
    assert_eq!(s.shapes.len(), 1, "polygons of one material are one mesh");
    let m = mesh(&s, 0);
    assert!((area(m) - DVec3::Z * 20.0).length() < 1e-5, "{}", area(m));
    let bent = loaded(&format!(
        "{GREY}g polygon p 0 0 12 0 0 0 1 0 0 1 1 .2 0 1 0\ng polygon d 0 0 9 0 0 0 1 0 0 2 0 0"
    ));
    let text = said(&bent).join("\n");
    assert!(text.contains("<text>:2:3: warning: polygon \"p\" is not planar"), "{text}");
    assert!(text.contains("<text>:3:3: warning: 1 polygons without area were left out"), "{text}");
}

#[test]
fn xform_moves_mirrors_inverts_and_repeats() {
    let dir = Scratch::new("rad-xform");
    dir.write(
        "p.rad",
        format!("{GREY}g polygon p 0 0 12 0 0 0 1 0 0 1 1 0 0 1 0\ng sphere s 0 0 4 0 0 2 .5"),
    );
    dir.write("inner.rad", "!xform -t 1 0 0 p.rad");
    dir.write("lines.txt", "-t 0 0 1\n\n-t 0 0 2 -s 2\n");
    let load_text = |text: &str| load(&[dir.write("top.rad", text)], &LoadOptions::default()).unwrap().scene;
    let s = load_text("!xform -rz 90 -s 2 -t 0 0 1 inner.rad");
    assert!((area(&s.meshes[0]) - DVec3::Z * 4.0).length() < 1e-5);
    let (q, m) = quadric(&s, 0);
    assert!(matches!(q, Quadric::Sphere { radius: 1.0, .. }));
    assert!((m.translation - DVec3::new(0.0, 2.0, 5.0)).length() < 1e-12, "{}", m.translation);
    // A mirror keeps outside outside; -I turns it in.
    let s = load_text("!xform -mz p.rad");
    assert!((area(&s.meshes[0]) + DVec3::Z).length() < 1e-6 && !s.shapes[0].reverse_orientation);
    assert!((area(&load_text("!xform -mx p.rad").meshes[0]) - DVec3::Z).length() < 1e-6);
    let s = load_text("!xform -I p.rad");
    assert!((area(&s.meshes[0]) + DVec3::Z).length() < 1e-6 && s.shapes[0].reverse_orientation);
    // Arrays; the file's lines; a pipe; a modifier instead of the file's own.
    let s = load_text("!xform -a 3 -t 5 0 0 -a 2 -t 0 0 7 p.rad");
    assert_eq!((s.shapes.len(), s.meshes[0].indices.len()), (7, 12));
    let s = load_text("!xform -f lines.txt p.rad");
    assert!((area(&s.meshes[0]) - DVec3::Z * 5.0).length() < 1e-5);
    let s = load_text(&format!("{GREY}!genbox g b 1 2 3 | xform -t 1 0 0 | xform -s 2 -n name"));
    assert_eq!(s.meshes[0].indices.len(), 12);
    let most = s.meshes[0].positions.iter().map(|p| p.max_element()).fold(0.0, f32::max);
    assert_eq!(most, 6.0);
    let s = load_text("void light new 0 0 3 7 7 7\n!xform -m new p.rad");
    assert!(s.shapes.iter().all(|s| s.emission.as_ref().is_some_and(|e| e.radiance[0] == 7.0)));
}

#[test]
fn generators_make_closed_shapes_that_face_the_right_way() {
    let volume = |command: &str| {
        let s = scene(&format!("{GREY}{command}"));
        let mut sum = 0.0;
        for shape in &s.shapes {
            if let Geometry::Mesh(id) = shape.geometry {
                let m = &s.meshes[id.0 as usize];
                let at = |i: u32| m.positions[i as usize].as_dvec3();
                sum += m.indices.iter().map(|t| at(t[0]).dot(at(t[1]).cross(at(t[2]))) / 6.0).sum::<f64>();
            }
        }
        sum
    };
    assert!((volume("!genbox g b 1 2 3") - 6.0).abs() < 1e-5);
    assert!((volume("!genbox g b 1 2 3 -i") + 6.0).abs() < 1e-5);
    // Twelve edges of 0.1 cut off: 6 − 0.005 · 4 (0.8 + 1.8 + 2.8) − corners of 0.001 (1 − 1/6).
    let bevelled = 6.0 - 0.005 * 4.0 * (0.8 + 1.8 + 2.8) - 8.0 * 0.001 * (5.0 / 6.0);
    assert!(
        (volume("!genbox g b 1 2 3 -b .1") - bevelled).abs() < 1e-4,
        "{}",
        volume("!genbox g b 1 2 3 -b .1")
    );
    // A prism upwards faces inward, as Radiance's does; downwards outward.
    assert!((volume("!genprism g p 4 0 0 1 0 1 1 0 1 -l 0 0 2") + 2.0).abs() < 1e-5);
    assert!((volume("!genprism g p 4 0 0 1 0 1 1 0 1 -l 0 0 -2") - 2.0).abs() < 1e-5);
    assert!((volume("!genprism g p 3 0 0 1 0 0 1 -l .3 .2 -2") - 1.0).abs() < 1e-5);
    // A cone of revolution with its bottom: π/3.
    let cone = volume("!genrev g c t '1-t' 1") + volume("!genrev g d 0 t 1");
    assert!((cone / (std::f64::consts::PI / 3.0) - 1.0).abs() < 1e-3, "{cone}");
    // A rounded box: 6 faces, 12 cylinders, 8 spheres.
    let s = scene(&format!("{GREY}!genbox g b 1 2 3 -r .1"));
    assert_eq!(s.shapes.len(), 21);
    // A surface over the unit square: its projection is the square, upward.
    let s = scene(&format!("{GREY}!gensurf g s s t 'a*sin(PI*s)*t' 8 5 -e 'a=.3'"));
    assert!((area(mesh(&s, 0)).z - 1.0).abs() < 1e-5);
    assert_eq!(scene(&format!("{GREY}!gensurf g s s t 0 2 3")).meshes[0].indices.len(), 12);
    let s = scene(&format!("{GREY}!genworm g w t 0 0 '.1+.1*t' 4"));
    assert_eq!(s.shapes.len(), 6, "five spheres, and the cones in one mesh");
    let data = Scratch::new("rad-data");
    data.write("d.txt", "0 0 0  0 1 0  1 0 0  1 1 1");
    let path = data.write("s.rad", format!("{GREY}!gensurf g s d.txt d.txt d.txt 1 1"));
    assert!((area(mesh(&load(&[path], &LoadOptions::default()).unwrap().scene, 0)).z - 1.0).abs() < 1e-6);
}

const SKY: &str = "skyfunc glow sky_glow 0 0 4 .9 .9 1.15 0\nsky_glow source sky 0 0 4 0 0 1 180\n\
                   skyfunc glow ground_glow 0 0 4 1.4 .9 .6 0\nground_glow source ground 0 0 4 0 0 -1 180\n";

/// Horizontal irradiance of all environments, first band, from above or below.
fn irradiance(s: &Scene, up: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let mut sum = 0.0;
    for e in &s.environments {
        match e {
            Environment::Sun { direction, cos_half_angle, radiance } => {
                sum += (direction.z as f64 * up).max(0.0) * TAU * (1.0 - cos_half_angle) * radiance[0] as f64;
            }
            Environment::Image { image, scale, .. } => {
                let i = &s.images[image.0 as usize];
                for y in 0..i.height {
                    let edge = |y: u32| (y as f64 / i.height as f64 * PI).cos();
                    let z = 0.5 * (edge(y) + edge(y + 1)) * up;
                    let ring: f64 =
                        (0..i.width).map(|x| i.texels[(y * i.width + x) as usize][0] as f64).sum();
                    let omega = (edge(y) - edge(y + 1)) * TAU / i.width as f64;
                    sum += z.max(0.0) * omega * ring * scale[0] as f64;
                }
            }
            Environment::Constant { radiance } => sum += PI * radiance[0] as f64,
        }
    }
    sum
}

/// Against rtrace 6.0a on the same skies (irradiance on the ground and from the ground; 65,536 rays).
#[test]
fn skies_light_as_much_as_radiance_s() {
    for (command, above, below) in [
        ("!gensky -ang 40 30 +s", 2.950e2, 8.409e1),
        ("!gensky -ang 40 30 -c", 6.114e1, 1.910e1),
        ("!gensky -ang 60 -30 -i", 5.912e1, 3.418e1),
        ("!gensky 3 21 10 +i -a 48 -o -11 -m -15 | xform -rz 35", 8.577e1, 2.601e1),
        ("!gendaylit -ang 40 30 -W 600 100", 2.906e2, 7.651e1),
        ("!gendaylit 12 21 11 -a 48 -o -11 -m -15 -W 200 100 | xform -rz 20", 8.854e1, 1.845e1),
    ] {
        let s = scene(&format!("{command}\n{SKY}"));
        let (a, b) = (irradiance(&s, 1.0), irradiance(&s, -1.0));
        println!("{command}: {a:.3} of {above}, {b:.3} of {below}");
        // 3 parts in 1000 are rtrace's own noise and its sun's.
        assert!((a / above - 1.0).abs() < 4e-3, "{command}: {a}, not {above}");
        assert!((b / below - 1.0).abs() < 4e-3, "{command}: {b}, not {below}");
    }
    // What the commands would have written, written out.
    let by_hand = format!("void brightfunc skyfunc 2 skybr lib/skybright.cal 0 3 2 22.86 3.557\n{SKY}");
    assert!((irradiance(&scene(&by_hand), 1.0) / 50.3 - 1.0).abs() < 0.1);
    // The overcast sky by its irradiance, of which its colour takes a tenth.
    let s = scene(&format!("!gensky 6 21 12 -c -B 55.866\n{SKY}"));
    assert!((irradiance(&s, 1.0) / (0.9 * 55.866) - 1.0).abs() < 0.02);
}

#[test]
fn plain_sources_are_disks_hemispheres_and_everything() {
    let s = scene(
        "void light sun 0 0 3 5 5 5\nsun source s 0 0 4 0 3 4 0.5\nvoid glow g 0 0 4 1 1 1 0\n\
         g source h 0 0 4 0 0 1 180\ng source a 0 0 4 0 0 1 360\nvoid glow dark 0 0 4 0 0 0 0\ndark source d 0 0 4 0 0 1 9",
    );
    let [
        Environment::Sun { direction, cos_half_angle, .. },
        Environment::Sun { cos_half_angle: half, .. },
        Environment::Constant { .. },
    ] = &s.environments[..]
    else {
        panic!("{:?}", s.environments)
    };
    assert!((direction.z - 0.8).abs() < 1e-6);
    // 1 − cos 0.25° to many digits.
    assert!(((1.0 - cos_half_angle) / 9.519_258e-6 - 1.0).abs() < 1e-5);
    assert!(half.abs() < 1e-12);
}

#[test]
fn views_become_cameras() {
    let s = with_view(
        "# a comment\nrvu -vtv -vp 1 2 3 -vd 0 2 0 -vu 0 0 1 -vh 60 -vv 40 -vo .5 -va 9 -vs .1 -vl -.2\n",
    );
    let c = &s.camera;
    assert_eq!(c.to_world.translation, DVec3::new(1.0, 2.0, 3.0));
    for (local, world) in [(DVec3::X, DVec3::X), (DVec3::Y, DVec3::Z), (DVec3::Z, DVec3::Y)] {
        assert!((c.to_world.transform_vector3(local) - world).length() < 1e-12);
    }
    let view = View {
        kind: ViewKind::Perspective,
        horizontal: 60.0,
        vertical: 40.0,
        shift: 0.1,
        lift: -0.2,
        fore: 0.5,
    };
    assert_eq!(c.projection, Projection::View(view));
    // Square pixels: 512 · tan 20° / tan 30°.
    assert_eq!((s.film.width, s.film.height), (512, 323));
    assert_eq!(s.filter, Filter::Box { radius: geom::Vec2::splat(0.5) });
    for (option, kind) in [
        ("l", ViewKind::Parallel),
        ("h", ViewKind::Hemispherical),
        ("a", ViewKind::Angular),
        ("c", ViewKind::Cylindrical),
        ("s", ViewKind::Planisphere),
    ] {
        let s = with_view(&format!("VIEW= -vt{option} -vh 90 -vv 90\nVIEW= -vp 0 0 1"));
        let Projection::View(v) = s.camera.projection else { panic!() };
        assert_eq!((v.kind, v.horizontal, s.camera.to_world.translation.z), (kind, 90.0, 1.0));
    }
    // A picture's header, options that are no view's; a view beside the scene, of any name.
    with_view("rpict -vf x.vf -vp 0 0 0 -ab 3\n".replace("-vf x.vf ", "").as_str());
    let dir = Scratch::new("rad-view");
    let scene = dir.write("s.rad", "void light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 0 0 1\n");
    let view = dir.write("north", "rvu -vp 0 -9 0 -vd 0 1 0\n");
    let s = load(&[view, scene], &LoadOptions::default()).unwrap().scene;
    assert_eq!(s.camera.to_world.translation.y, -9.0);
}

#[test]
fn without_a_view_everything_is_seen() {
    let l = loaded(&format!(
        "{GREY}g sphere a 0 0 4 10 0 0 1\ng polygon p 0 0 9 -5 0 0 0 7 0 0 0 3\nvoid light l 0 0 3 1 1 1\nl sphere b 0 0 4 0 0 9 1"
    ));
    assert!(said(&l).iter().any(|t| t.contains("note: no view given")));
    let c = &l.scene.camera;
    let Projection::View(v) = c.projection else { panic!() };
    let to_camera = c.to_world.inverse();
    let limit = (0.5 * v.horizontal).to_radians().tan();
    for p in [[11.0, 0.0, 0.0], [-5.0, 0.0, 0.0], [0.0, 7.0, 0.0], [0.0, 0.0, 10.0]] {
        let q = to_camera.transform_point3(DVec3::from(p));
        assert!(q.z > 0.0 && (q.x / q.z).abs() < limit && (q.y / q.z).abs() < limit, "{q}");
    }
}

#[test]
fn octrees_name_their_scene_files() {
    let dir = Scratch::new("rad-oct");
    dir.write("a.rad", GREY);
    dir.write("b.rad", "g sphere s 0 0 4 0 0 0 1\nvoid light l 0 0 3 1 1 1\nl sphere t 0 0 4 5 0 0 1");
    let mut bytes = b"#?RADIANCE\noconv a.rad b.rad\nFORMAT=Radiance_octree\n\n\x01\x1f".to_vec();
    for text in ["-1", "-1", "-1", "2", "a.rad", "b.rad", "!genbox g b 1 1 1", ""] {
        bytes.extend(text.bytes());
        bytes.push(0);
    }
    bytes.extend([0, 0, 0, 2, 1, 0, 0]);
    let path = dir.write("s.oct", bytes);
    let s = load(&[path], &LoadOptions::default()).unwrap_or_else(|e| panic!("{e}")).scene;
    assert_eq!(s.shapes.len(), 3);
    assert_eq!(s.files.len(), 3);
}

#[test]
fn the_text_form_is_forgiving() {
    // Quotes, comments, tabs, one primitive over many lines or many in one.
    let s = scene(
        "# c\nvoid\tlight \"a b\"\n0\n0\n3 1e0 .5 +2 # end\n\"a b\" sphere s 0 0 4 0 0 0 1 'a b' sphere t 0 0 4 3 0 0 1",
    );
    assert_eq!(s.shapes.len(), 2);
    assert_eq!(s.shapes[0].emission.as_ref().unwrap().radiance, Rgb::new(1.0, 0.5, 2.0));
}
