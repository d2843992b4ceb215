//! Materials, textures, shapes and luminaires, against the defaults and conventions of the format and closed forms.

mod common;

use common::{Scratch, loaded, said, world};
use hemilux_scene::geom::{DAffine3, DVec3, Vec2, Vec3};
use hemilux_scene::*;
use std::f64::consts::{PI, TAU};

fn constant(v: f32) -> RgbParam {
    RgbParam::Constant(Rgb::splat(v))
}

fn smooth() -> Roughness {
    Roughness { u: FloatParam::Constant(0.0), v: FloatParam::Constant(0.0), remap: true }
}

/// The kind of the one material that `text` makes.
fn material(text: &str) -> MaterialKind {
    world(&format!("Material {text}")).materials.pop().unwrap().kind
}

fn copper() -> ConductorFresnel {
    ConductorFresnel::EtaK(
        RgbParam::Constant(Rgb::new(0.200, 0.924, 1.102)),
        RgbParam::Constant(Rgb::new(3.91, 2.45, 2.14)),
    )
}

#[test]
fn material_defaults() {
    let default = &world("Shape \"sphere\"").materials[0].kind;
    assert!(matches!(default, MaterialKind::Diffuse { reflectance } if *reflectance == constant(0.5)));
    assert!(
        matches!(material("\"diffuse\""), MaterialKind::Diffuse { reflectance } if reflectance == constant(0.5))
    );
    let MaterialKind::Conductor { fresnel, roughness } = material("\"conductor\"") else { panic!() };
    assert_eq!((fresnel, roughness), (copper(), smooth()));
    let MaterialKind::Dielectric { eta, roughness } = material("\"dielectric\"") else { panic!() };
    assert_eq!((eta, roughness), (1.5, smooth()));
    assert!(matches!(material("\"thindielectric\""), MaterialKind::ThinDielectric { eta: 1.5 }));
    let MaterialKind::CoatedDiffuse { reflectance, eta, roughness } = material("\"coateddiffuse\"") else {
        panic!()
    };
    assert_eq!((reflectance, eta, roughness), (constant(0.5), 1.5, smooth()));
    let MaterialKind::CoatedConductor { eta, coat_roughness, fresnel, base_roughness } =
        material("\"coatedconductor\"")
    else {
        panic!()
    };
    assert_eq!((eta, coat_roughness, fresnel, base_roughness), (1.5, smooth(), copper(), smooth()));
    let MaterialKind::DiffuseTransmission { reflectance, transmittance, scale } =
        material("\"diffusetransmission\"")
    else {
        panic!()
    };
    assert_eq!((reflectance, transmittance, scale), (constant(0.25), constant(0.25), 1.0));
    assert!(matches!(material("\"interface\""), MaterialKind::Interface));
}

#[test]
fn material_parameters() {
    let MaterialKind::Conductor { fresnel, roughness } = material(
        "\"conductor\" \"rgb reflectance\" [ .9 .8 .7 ] \"float roughness\" 0.2 \"float vroughness\" 0.1 \"bool remaproughness\" \"false\"",
    ) else {
        panic!()
    };
    assert_eq!(fresnel, ConductorFresnel::Reflectance(RgbParam::Constant(Rgb::new(0.9, 0.8, 0.7))));
    let wanted = Roughness { u: FloatParam::Constant(0.2), v: FloatParam::Constant(0.1), remap: false };
    assert_eq!(roughness, wanted);
    assert!(
        matches!(material("\"dielectric\" \"spectrum eta\" \"glass-BK7\""), MaterialKind::Dielectric { eta, .. } if (eta - 1.5168).abs() < 1e-5)
    );
    assert!(
        matches!(material("\"dielectric\" \"spectrum eta\" [ 400 1.33 700 1.33 ]"), MaterialKind::Dielectric { eta, .. } if (eta - 1.33).abs() < 1e-4)
    );
    let MaterialKind::CoatedConductor { eta, coat_roughness, base_roughness, .. } = material(
        "\"coatedconductor\" \"float interface.eta\" 1.4 \"float interface.roughness\" 0.1 \"float conductor.uroughness\" 0.3 \"float thickness\" 0.01",
    ) else {
        panic!()
    };
    assert_eq!(
        (eta, coat_roughness.u, coat_roughness.v),
        (1.4, FloatParam::Constant(0.1), FloatParam::Constant(0.1))
    );
    assert_eq!((base_roughness.u, base_roughness.v), (FloatParam::Constant(0.3), FloatParam::Constant(0.0)));
    // Albedos are clamped, with a warning.
    let l = loaded("WorldBegin Material \"diffuse\" \"rgb reflectance\" [ 2 .5 0 ]");
    assert!(said(&l)[0].contains("warning: parameter \"reflectance\" of material \"diffuse\" exceeds 1"));
    assert!(
        matches!(l.scene.materials[1].kind, MaterialKind::Diffuse { reflectance } if reflectance == RgbParam::Constant(Rgb::new(1.0, 0.5, 0.0)))
    );
}

#[test]
fn a_spectrum_may_be_a_file() {
    let dir = Scratch::new("spd");
    dir.write("flat.spd", "# grey\n400 0.25\n700 0.25\n");
    let path = dir.write("s.pbrt", "WorldBegin Material \"diffuse\" \"spectrum reflectance\" \"flat.spd\"");
    let s = load(&[path], &LoadOptions::default()).unwrap().scene;
    let MaterialKind::Diffuse { reflectance: RgbParam::Constant(c) } = s.materials[1].kind else { panic!() };
    assert!((c - Rgb::splat(0.25)).map(f32::abs).max() < 1e-5, "{c:?}");
}

#[test]
fn named_materials_may_follow_their_use_and_mixes_their_parts() {
    let s = world(
        "NamedMaterial \"late\" Shape \"sphere\"
         NamedMaterial \"blend\" Shape \"disk\"
         MakeNamedMaterial \"late\" \"string type\" \"thindielectric\"
         MakeNamedMaterial \"blend\" \"string type\" \"mix\" \"string materials\" [ \"late\" \"late\" ] \"float amount\" 0.25",
    );
    let kind = |i: usize| &s.materials[s.shapes[i].material.0 as usize].kind;
    assert!(matches!(kind(0), MaterialKind::ThinDielectric { .. }));
    let MaterialKind::Mix { a, b, amount } = kind(1) else { panic!("{:?}", kind(1)) };
    assert_eq!((*a, *b, *amount), (s.shapes[0].material, s.shapes[0].material, FloatParam::Constant(0.25)));
    for (i, m) in s.materials.iter().enumerate() {
        if let MaterialKind::Mix { a, b, .. } = m.kind {
            assert!((a.0 as usize) < i && (b.0 as usize) < i, "a mix comes after its parts");
        }
    }
}

// Textures.

#[test]
fn textures() {
    let s = world(
        "Texture \"c\" \"spectrum\" \"constant\" \"rgb value\" [ .1 .2 .3 ]
         Texture \"f\" \"float\" \"constant\" \"float value\" 2
         Texture \"s\" \"spectrum\" \"scale\" \"texture tex\" \"c\" \"texture scale\" \"f\"
         Texture \"m\" \"spectrum\" \"mix\" \"texture tex1\" \"s\" \"rgb tex2\" [ 1 1 1 ] \"float amount\" 0.25
         Texture \"k\" \"float\" \"checkerboard\" \"float uscale\" 8 \"float vdelta\" 0.5 \"texture tex1\" \"f\"
         Translate 1 0 0
         Texture \"p\" \"float\" \"checkerboard\" \"string mapping\" \"planar\" \"vector3 v1\" [ 0 0 2 ] \"float udelta\" 3
         Texture \"d\" \"float\" \"checkerboard\" \"integer dimension\" 3
         Texture \"o\" \"float\" \"checkerboard\" \"string mapping\" \"spherical\"
         Material \"diffuse\" \"texture reflectance\" \"m\" \"texture displacement\" \"k\"",
    );
    let id = |i: u32| RgbParam::Texture(TextureId(i));
    assert!(matches!(s.textures[0], Texture::Constant(c) if c == Rgb::new(0.1, 0.2, 0.3)));
    assert!(matches!(s.textures[2], Texture::Scale(a, b) if a == id(0) && b == id(1)));
    assert!(
        matches!(s.textures[3], Texture::Mix { a, b, amount: FloatParam::Constant(0.25) } if a == id(2) && b == constant(1.0))
    );
    let Texture::Checkerboard { mapping, even, odd, .. } = &s.textures[4] else { panic!() };
    assert_eq!(*mapping, Some(TextureMapping::Uv { scale: Vec2::new(8.0, 1.0), delta: Vec2::new(0.0, 0.5) }));
    assert_eq!((*even, *odd), (id(1), constant(0.0)));
    let Texture::Checkerboard { mapping: Some(TextureMapping::Planar { to_texture, v1, v2, delta }), .. } =
        s.textures[5]
    else {
        panic!()
    };
    assert_eq!(to_texture.transform_point3(DVec3::X), DVec3::ZERO);
    assert_eq!((v1, v2, delta), (Vec3::Z * 2.0, Vec3::Y, Vec2::new(3.0, 0.0)));
    assert!(matches!(&s.textures[6], Texture::Checkerboard { mapping: None, .. }));
    assert!(matches!(
        &s.textures[7],
        Texture::Checkerboard { mapping: Some(TextureMapping::Spherical { .. }), .. }
    ));
    let m = s.materials.last().unwrap();
    assert_eq!(m.bump, Some(FloatParam::Texture(TextureId(4))));
    assert!(matches!(m.kind, MaterialKind::Diffuse { reflectance } if reflectance == id(3)));
}

/// A PFM of the given size with one value everywhere.
fn pfm(width: usize, height: usize, v: f32) -> Vec<u8> {
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    (0..3 * width * height).for_each(|_| bytes.extend(v.to_le_bytes()));
    bytes
}

#[test]
fn image_maps() {
    let dir = Scratch::new("imagemap");
    dir.write("i.pfm", pfm(2, 3, 0.25));
    let image = "\"imagemap\" \"string filename\" \"i.pfm\"";
    let text = format!(
        "WorldBegin Texture \"a\" \"spectrum\" {image} \"string wrap\" \"clamp\" \"float scale\" 2 \"bool invert\" true
         Texture \"b\" \"float\" {image} \"string filter\" \"point\" \"string encoding\" \"gamma 2.2\"
         Texture \"c\" \"float\" {image}
         Material \"diffuse\" \"string normalmap\" \"i.pfm\""
    );
    let path = dir.write("s.pbrt", text);
    let s = load(&[path], &LoadOptions::default()).unwrap().scene;
    let Texture::Image { image, wrap, nearest, scale, invert, .. } = s.textures[0] else { panic!() };
    assert_eq!((wrap, nearest, scale, invert), (Wrap::Clamp, false, 2.0, true));
    assert!(matches!(
        s.textures[1],
        Texture::Image { nearest: true, wrap: Wrap::Repeat, scale: 1.0, invert: false, .. }
    ));
    assert!(matches!(s.textures[2], Texture::Image { image: i, .. } if i == image), "read once");
    assert_eq!(s.images.len(), 3, "one per encoding");
    assert!(s.materials[1].normal_map.is_some());
    let i = &s.images[0];
    assert_eq!((i.width, i.height, i.texels.len(), i.texels[0]), (2, 3, 6, Rgb::splat(0.25)));
}

// Shapes.

#[test]
fn quadrics() {
    let g = |t: &str| match world(&format!("Translate 1 2 3 Shape {t}")).shapes[0].geometry {
        Geometry::Quadric(q, m) if m == DAffine3::from_translation(DVec3::new(1., 2., 3.)) => q,
        ref other => panic!("{other:?}"),
    };
    let full = TAU;
    assert_eq!(g("\"sphere\""), Quadric::Sphere { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: full });
    assert_eq!(
        g("\"sphere\" \"float radius\" 1e-4 \"float zmax\" 5e-5 \"float phimax\" 90"),
        Quadric::Sphere { radius: 1e-4, z_min: -1e-4, z_max: 5e-5, phi_max: full / 4.0 }
    );
    assert_eq!(g("\"disk\""), Quadric::Disk { height: 0.0, radius: 1.0, inner_radius: 0.0, phi_max: full });
    assert_eq!(g("\"cylinder\""), Quadric::Cylinder { radius: 1.0, z_min: -1.0, z_max: 1.0, phi_max: full });
}

const TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ]";

/// Area vector (twice) of the first triangle.
fn facing(s: &Scene) -> Vec3 {
    let m = &s.meshes[0];
    let [a, b, c] = m.indices[0].map(|i| m.positions[i as usize]);
    (b - a).cross(c - a)
}

#[test]
fn orientation_follows_the_format() {
    let up = |text: &str| facing(&world(text)).z;
    assert_eq!(up(TRIANGLE), 1.0);
    assert_eq!(up(&format!("ReverseOrientation {TRIANGLE}")), -1.0);
    // Mirroring keeps the side, reversing turns it.
    assert_eq!(up(&format!("Scale -1 1 1 {TRIANGLE}")), 1.0);
    assert_eq!(up(&format!("Scale -1 1 1 ReverseOrientation {TRIANGLE}")), -1.0);
    assert_eq!(up(&format!("Scale 1 1 -1 {TRIANGLE}")), -1.0, "the side +z is now -z");
    // Normals decide.
    let down = format!("{TRIANGLE} \"normal N\" [ 0 0 -1 0 0 -1 0 0 -1 ]");
    assert_eq!(up(&down), -1.0);
    assert_eq!(up(&format!("Scale -1 1 1 {down}")), -1.0);
    let s = world(&format!("ReverseOrientation Scale 1 1 5 {down}"));
    assert_eq!((facing(&s).z, s.meshes[0].normals[0]), (1.0, Vec3::Z));
    assert!(s.shapes.iter().all(|s| !s.reverse_orientation && !s.flips_handedness), "said by the indices");
    let s = world("Scale -1 1 1 Shape \"sphere\" ReverseOrientation Identity Shape \"sphere\"");
    assert!(s.shapes[0].flips_handedness && !s.shapes[0].reverse_orientation);
    assert!(!s.shapes[1].flips_handedness && s.shapes[1].reverse_orientation);
}

#[test]
fn normals_go_by_the_inverse_transpose() {
    let n = "\"normal N\" [ 1 1 1 1 1 1 1 1 1 ]";
    let s = world(&format!("Scale 1 1 2 {TRIANGLE} {n}"));
    let expected = Vec3::new(1.0, 1.0, 0.5).normalize();
    assert!((s.meshes[0].normals[2] - expected).length() < 1e-6);
}

#[test]
fn meshes() {
    let l = loaded(
        "WorldBegin Translate 0 0 1
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 1 1 0 0 1 0 2 0 0 ] \"integer indices\" [ 0 1 2 0 2 3 0 1 4 1 1 2 ]
           \"point2 uv\" [ 0 0 1 0 1 1 0 1 2 0 ]",
    );
    let m = &l.scene.meshes[0];
    assert_eq!(m.indices, [[0, 1, 2], [0, 2, 3]], "degenerate ones are left out");
    assert!(said(&l).iter().any(|m| m.contains("note: 2 triangles without area were left out")));
    assert_eq!((m.positions[4], m.uvs[2]), (Vec3::new(2.0, 0.0, 1.0), Vec2::ONE));
}

#[test]
fn bilinear_patches() {
    let flat = world("Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ]");
    assert_eq!(flat.meshes[0].indices, [[0, 1, 3], [0, 3, 2]]);
    assert_eq!(facing(&flat).z, 1.0);
    let l = loaded(
        "WorldBegin Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 1 ] \"point2 uv\" [ 0 0 1 0 0 1 1 1 ]",
    );
    let m = &l.scene.meshes[0];
    assert_eq!(m.indices.len(), 128);
    assert!(said(&l).iter().any(|m| m.contains("1 curved bilinear patches became grids of 8 x 8 cells")));
    // Every vertex is on z = xy, and (u, v) = (x, y).
    for (p, uv) in m.positions.iter().zip(&m.uvs) {
        assert!((p.z - p.x * p.y).abs() < 1e-6 && (*uv - p.truncate()).length() < 1e-6);
    }
}

#[test]
fn alpha_is_kept() {
    let s = world(
        "Shape \"sphere\" \"float alpha\" 0 Shape \"sphere\" Texture \"t\" \"float\" \"constant\" Shape \"disk\" \"texture alpha\" \"t\"",
    );
    let alphas: Vec<_> = s.shapes.iter().map(|s| s.alpha).collect();
    assert_eq!(alphas, [Some(FloatParam::Constant(0.0)), None, Some(FloatParam::Texture(TextureId(0)))]);
}

// Luminaires.

fn emission(text: &str) -> Emission {
    world(text).shapes.last().and_then(|s| s.emission.clone()).unwrap()
}

fn near(a: f32, b: f64) -> bool {
    (f64::from(a) / b - 1.0).abs() < 1e-5
}

#[test]
fn area_lights() {
    let e = emission("AreaLightSource \"diffuse\" \"rgb L\" [ 17 12 4 ] \"float scale\" 2 Shape \"sphere\"");
    assert_eq!((e.radiance, e.two_sided, e.profile), (Rgb::new(34.0, 24.0, 8.0), false, Profile::Uniform));
    assert_eq!(emission("AreaLightSource \"diffuse\" Shape \"sphere\"").radiance, Rgb::WHITE);
    // A black body has luminance 1, whatever its temperature.
    let b = emission("AreaLightSource \"diffuse\" \"blackbody L\" 3000 \"float scale\" 5 Shape \"sphere\"");
    assert!((b.radiance.luminance() - 5.0).abs() < 0.01 && b.radiance[0] > b.radiance[2]);
    // Power: Φ = π A L, twice that on two sides; a sphere of radius 2 has 16π m².
    let p = emission("AreaLightSource \"diffuse\" \"float power\" 100 Shape \"sphere\" \"float radius\" 2");
    assert!(near(p.radiance[1], 100.0 / (PI * 16.0 * PI)));
    let p = emission(&format!(
        "AreaLightSource \"diffuse\" \"float power\" 100 \"bool twosided\" true Scale 2 2 2 {TRIANGLE}"
    ));
    assert!(near(p.radiance[1], 100.0 / (PI * 2.0 * 2.0)) && p.two_sided);
}

#[test]
fn infinite_lights() {
    let e = |t: &str| world(&format!("LightSource \"infinite\" {t}")).environments.pop().unwrap();
    assert!(
        matches!(e("\"rgb L\" [ 1 2 3 ] \"float scale\" 2"), Environment::Constant { radiance } if radiance == Rgb::new(2.0, 4.0, 6.0))
    );
    assert!(matches!(e(""), Environment::Constant { radiance } if radiance == Rgb::WHITE));
    // E = π L.
    assert!(
        matches!(e("\"float illuminance\" 100"), Environment::Constant { radiance } if near(radiance[0], 100.0 / PI))
    );
    let portal = "\"point3 portal\" [ 0 0 0 1 0 0 1 1 0 0 1 0 ]";
    let Environment::Image { portal: Some(p), scale, .. } = e(&format!("\"rgb L\" [ 3 3 3 ] {portal}"))
    else {
        panic!()
    };
    assert_eq!((p[2], scale), (Vec3::new(1.0, 1.0, 0.0), Rgb::splat(3.0)));
}

#[test]
fn environment_maps() {
    let dir = Scratch::new("env");
    dir.write("sky.pfm", pfm(64, 64, 2.0));
    let path = dir.write(
        "s.pbrt",
        "WorldBegin Rotate 90 1 0 0 LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"float scale\" 3
         LightSource \"infinite\" \"string filename\" \"sky.pfm\" \"float illuminance\" 50",
    );
    let s = load(&[path], &LoadOptions::default()).unwrap().scene;
    let Environment::Image { image, scale, layout, to_world, portal: None } = &s.environments[0] else {
        panic!()
    };
    assert_eq!((image.0, *scale, *layout), (0, Rgb::splat(3.0), EnvironmentLayout::EqualAreaOctahedral));
    assert!((to_world.transform_vector3(DVec3::Z) - DVec3::NEG_Y).length() < 1e-12);
    // A uniform map of 2 gives 2π lx; the sum over texels is a midpoint rule.
    let Environment::Image { scale, .. } = &s.environments[1] else { panic!() };
    assert!((f64::from(scale[0]) * 2.0 * PI / 50.0 - 1.0).abs() < 2e-3, "{scale:?}");
}

#[test]
fn distant_lights_become_suns_of_the_same_irradiance() {
    let s = world(
        "Rotate 90 1 0 0 LightSource \"distant\" \"rgb L\" [ 3 2 1 ] \"point3 from\" [ 0 0 5 ] \"point3 to\" [ 0 0 0 ]",
    );
    let Environment::Sun { direction, cos_half_angle, radiance } = s.environments[0] else { panic!() };
    assert!((direction - Vec3::NEG_Y).length() < 1e-6, "{direction}");
    // Irradiance at normal incidence: π sin²α L.
    let sin2 = 1.0 - cos_half_angle * cos_half_angle;
    assert!(near(radiance[0], 3.0 / (PI * sin2)), "{radiance:?}");
    assert!((cos_half_angle.acos().to_degrees() - 0.2665).abs() < 1e-6);
    let s = world("LightSource \"distant\" \"float illuminance\" 1000");
    assert!(matches!(s.environments[0], Environment::Sun { direction, .. } if direction == Vec3::NEG_Z));
}

/// The sphere and emission of the last shape, and its intensity L π r² per steradian.
fn sphere_light(text: &str) -> (DVec3, f64, Emission, f64) {
    let s = world(text);
    let shape = s.shapes.last().unwrap();
    let Geometry::Quadric(Quadric::Sphere { radius, .. }, m) = shape.geometry else { panic!() };
    let e = shape.emission.clone().unwrap();
    assert!(
        matches!(s.materials[shape.material.0 as usize].kind, MaterialKind::Diffuse { reflectance } if reflectance == constant(0.0))
    );
    let intensity = f64::from(e.radiance[1]) * PI * radius * radius;
    (m.translation, radius, e, intensity)
}

#[test]
fn point_lights_become_spheres_of_the_same_intensity() {
    // A floor of 6 x 8 m: diagonal 10, radius 10 mm.
    let floor = "AttributeBegin Scale 6 8 1 Shape \"bilinearmesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 1 1 0 ] AttributeEnd";
    let (p, r, e, i) = sphere_light(&format!(
        "{floor} LightSource \"point\" \"rgb I\" [ 5 5 5 ] \"point3 from\" [ 1 2 3 ] \"float scale\" 2"
    ));
    assert_eq!((p, e.profile), (DVec3::new(1., 2., 3.), Profile::Uniform));
    assert!((r - 0.01).abs() < 1e-9 && (i / 10.0 - 1.0).abs() < 1e-5);
    // Close to the floor it shrinks to half the distance.
    let (_, r, _, i) = sphere_light(&format!("{floor} LightSource \"point\" \"point3 from\" [ 1 2 0.004 ]"));
    assert!((r - 0.002).abs() < 1e-9 && (i - 1.0).abs() < 1e-5, "{r}");
    // Beyond the edge of the floor the edge counts.
    let (_, r, _, _) =
        sphere_light(&format!("{floor} LightSource \"point\" \"point3 from\" [ -0.003 2 0.004 ]"));
    assert!((r - 0.0025).abs() < 1e-8, "{r}");
    // 4π sr share the power.
    let (_, _, _, i) = sphere_light("LightSource \"point\" \"float power\" 100");
    assert!((i * 4.0 * PI / 100.0 - 1.0).abs() < 1e-5);
    let l = loaded("WorldBegin LightSource \"point\" \"point3 from\" [ 1 2 3 ]");
    let note = "the point luminaire at (1.000000, 2.000000, 3.000000) became a sphere of radius 1.000e-3 m";
    assert!(said(&l).iter().any(|m| m.contains(note)), "{:?}", said(&l));
}

#[test]
fn the_radius_of_those_spheres_can_be_set() {
    let options =
        LoadOptions { defines: vec![("light-radius".into(), "0.05".into())], ..LoadOptions::default() };
    let l = load_pbrt_str("WorldBegin LightSource \"point\"", std::path::Path::new("."), &options).unwrap();
    assert!(matches!(l.scene.shapes[0].geometry, Geometry::Quadric(Quadric::Sphere { radius: 0.05, .. }, _)));
    let options =
        LoadOptions { defines: vec![("light-radius".into(), "-1".into())], ..LoadOptions::default() };
    assert!(load_pbrt_str("WorldBegin LightSource \"point\"", std::path::Path::new("."), &options).is_err());
}

#[test]
fn spot_lights() {
    let (_, _, e, i) = sphere_light(
        "LightSource \"spot\" \"point3 to\" [ 0 -2 0 ] \"float coneangle\" 60 \"float conedeltaangle\" 15 \"float power\" 10",
    );
    let Profile::Spot { axis, cos_start, cos_end } = e.profile else { panic!() };
    assert!((axis - Vec3::NEG_Y).length() < 1e-6);
    assert!(near(cos_start, 0.5f64.sqrt()) && near(cos_end, 0.5));
    // Integrate the smoothstep over the sphere: that times the intensity is the power.
    let n = 100_000;
    let mut sum = 0.0;
    for k in 0..n {
        let c = -1.0 + 2.0 * (k as f64 + 0.5) / n as f64;
        let t = ((c - f64::from(cos_end)) / f64::from(cos_start - cos_end)).clamp(0.0, 1.0);
        sum += t * t * (3.0 - 2.0 * t) * 2.0 / n as f64;
    }
    assert!((i * TAU * sum / 10.0 - 1.0).abs() < 1e-4);
    let (_, _, e, _) = sphere_light("LightSource \"spot\"");
    assert!(
        matches!(e.profile, Profile::Spot { axis, cos_start, cos_end } if axis == Vec3::Z && near(cos_start, 25f64.to_radians().cos()) && near(cos_end, 30f64.to_radians().cos()))
    );
}

#[test]
fn goniometric_and_projection_lights() {
    let dir = Scratch::new("gonio");
    dir.write("g.pfm", pfm(8, 8, 0.5));
    dir.write("p.pfm", pfm(16, 8, 0.5));
    let path = dir.write(
        "s.pbrt",
        "WorldBegin Rotate 90 0 1 0
         LightSource \"goniometric\" \"string filename\" \"g.pfm\" \"float power\" 10
         LightSource \"projection\" \"string filename\" \"p.pfm\" \"float power\" 10 \"float fov\" 90",
    );
    let s = load(&[path], &LoadOptions::default()).unwrap().scene;
    let of = |i: usize| {
        let Geometry::Quadric(Quadric::Sphere { radius, .. }, _) = s.shapes[i].geometry else { panic!() };
        let e = s.shapes[i].emission.clone().unwrap();
        (f64::from(e.radiance[0]) * PI * radius * radius, e.profile)
    };
    let (intensity, profile) = of(0);
    assert!((intensity * 0.5 * 4.0 * PI / 10.0 - 1.0).abs() < 1e-5);
    // World x is the light's z, which is the image's y.
    let Profile::Goniometric { to_local, .. } = profile else { panic!() };
    assert!((to_local.transform_vector3(DVec3::X) - DVec3::Y).length() < 1e-12);
    let (intensity, profile) = of(1);
    let Profile::Projection { half_window, to_local, .. } = profile else { panic!() };
    assert!((half_window - Vec2::new(2.0, 1.0)).length() < 1e-6);
    assert!((to_local.transform_vector3(DVec3::X) - DVec3::Z).length() < 1e-12);
    // Solid angle of a rectangle of half sides a, b at distance 1: 4 atan(ab / √(1 + a² + b²)).
    let omega = 4.0 * (2.0 / 6.0f64.sqrt()).atan();
    assert!((intensity * 0.5 * omega / 10.0 - 1.0).abs() < 0.01);
}

#[test]
fn colour_spaces() {
    let s = world(
        "ColorSpace \"rec2020\" Material \"diffuse\" \"rgb reflectance\" [ 0.6 0.6 0.6 ] ColorSpace \"srgb\" Material \"diffuse\" \"rgb reflectance\" [ .6 .1 .1 ]",
    );
    let c = |i: usize| match s.materials[i].kind {
        MaterialKind::Diffuse { reflectance: RgbParam::Constant(c) } => c,
        _ => panic!(),
    };
    assert!((c(1) - Rgb::splat(0.6)).map(f32::abs).max() < 1e-4);
    assert_eq!(c(2), Rgb::new(0.6, 0.1, 0.1));
}
