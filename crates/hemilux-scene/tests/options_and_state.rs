//! Camera, film, filter, sampler, integrator; the graphics state, several files, includes, substitutions, lenience.

mod common;

use common::{Scratch, loaded, said, world};
use hemilux_scene::geom::{DVec3, Vec2};
use hemilux_scene::*;
use std::io::Write;
use std::path::Path;

fn options(text: &str) -> Scene {
    loaded(&format!("{text}\nWorldBegin")).scene
}

#[test]
fn defaults_are_those_of_the_format() {
    let s = options("");
    assert_eq!(s.camera.projection, Projection::Perspective { fov: 90.0 });
    assert_eq!((s.film.width, s.film.height, s.film.scale), (1280, 720, 1.0));
    assert_eq!(s.film.crop, [0.0, 1.0, 0.0, 1.0]);
    assert_eq!(s.filter, Filter::Gaussian { radius: Vec2::splat(1.5), sigma: 0.5 });
    assert_eq!((s.samples_per_pixel, s.max_depth), (None, Some(5)));
    let s = options(
        "Camera \"perspective\" Film \"rgb\" Sampler \"zsobol\" Integrator \"path\" PixelFilter \"box\"",
    );
    assert_eq!(s.camera.projection, Projection::Perspective { fov: 90.0 });
    assert_eq!((s.camera.lens_radius, s.camera.focal_distance, s.camera.screen_window), (0.0, 1e6, None));
    assert_eq!((s.film.width, s.film.height), (1280, 720));
    assert_eq!((s.samples_per_pixel, s.max_depth), (Some(16), Some(5)));
    assert_eq!(s.filter, Filter::Box { radius: Vec2::splat(0.5) });
}

#[test]
fn filters() {
    let f = |t: &str| options(&format!("PixelFilter {t}")).filter;
    assert_eq!(f("\"triangle\""), Filter::Triangle { radius: Vec2::splat(2.0) });
    assert_eq!(
        f("\"gaussian\" \"float sigma\" 1"),
        Filter::Gaussian { radius: Vec2::splat(1.5), sigma: 1.0 }
    );
    let third = 1.0 / 3.0;
    assert_eq!(f("\"mitchell\""), Filter::Mitchell { radius: Vec2::splat(2.0), b: third, c: third });
    assert_eq!(f("\"sinc\" \"float xradius\" 3"), Filter::Sinc { radius: Vec2::new(3.0, 4.0), tau: 3.0 });
}

#[test]
fn film_crop_and_exposure() {
    let film = |t: &str| options(&format!("Film \"rgb\" {t}")).film;
    assert_eq!(film("\"float cropwindow\" [ 0.25 0.5 0.75 0 ]").crop, [0.25, 0.5, 0.0, 0.75]);
    let size = "\"integer xresolution\" 100 \"integer yresolution\" 50";
    assert_eq!(film(&format!("{size} \"integer pixelbounds\" [ 10 60 0 500 ]")).crop, [0.1, 0.6, 0.0, 1.0]);
    assert_eq!(film("\"float iso\" 400").scale, 4.0);
    let s = options("Camera \"perspective\" \"float shutterclose\" 0.5 Film \"rgb\" \"float iso\" 200");
    assert_eq!(s.film.scale, 1.0);
    let l = loaded("Film \"rgb\" \"string sensor\" \"canon_eos_5d\" WorldBegin");
    assert!(said(&l)[0].contains("warning: sensor \"canon_eos_5d\" is ignored"));
    assert_eq!(film("\"string filename\" \"x.exr\"").filename.as_deref(), Some("x.exr"));
}

#[test]
fn cameras() {
    let c = |t: &str| options(&format!("Camera {t}")).camera;
    let o = c("\"orthographic\" \"float screenwindow\" [ -2 2 -1 1 ]");
    assert_eq!((o.projection, o.screen_window), (Projection::Orthographic, Some([-2.0, 2.0, -1.0, 1.0])));
    assert_eq!(c("\"perspective\" \"float frameaspectratio\" 2").screen_window, Some([-2.0, 2.0, -1.0, 1.0]));
    assert_eq!(
        c("\"perspective\" \"float frameaspectratio\" 0.5").screen_window,
        Some([-1.0, 1.0, -2.0, 2.0])
    );
    assert_eq!(c("\"spherical\"").projection, Projection::Spherical { equirectangular: false });
    let e = c("\"spherical\" \"string mapping\" \"equirectangular\"");
    assert_eq!(e.projection, Projection::Spherical { equirectangular: true });
    let lens = c("\"perspective\" \"float lensradius\" 0.1 \"float focaldistance\" 3");
    assert_eq!((lens.lens_radius, lens.focal_distance), (0.1, 3.0));
}

#[test]
fn the_camera_is_placed_by_the_inverse() {
    let s = loaded("Translate 0 0 5 Rotate 90 0 1 0 Camera \"perspective\" WorldBegin").scene;
    // World to camera: p → R p + (0,0,5); the eye is where that is 0.
    let m = s.camera.to_world;
    assert!((m.translation - DVec3::new(5.0, 0.0, 0.0)).length() < 1e-12, "{m:?}");
    assert!((m.transform_vector3(DVec3::Z) - DVec3::NEG_X).length() < 1e-12);
    // And WorldBegin resets the transform.
    let s = loaded("Translate 9 9 9 WorldBegin Shape \"sphere\"").scene;
    assert!(matches!(s.shapes[0].geometry, Geometry::Quadric(_, m) if m.translation == DVec3::ZERO));
}

#[test]
fn samplers_and_integrators() {
    assert_eq!(options("Sampler \"halton\" \"integer pixelsamples\" 7").samples_per_pixel, Some(7));
    assert_eq!(options("Sampler \"stratified\" \"integer xsamples\" 3").samples_per_pixel, Some(12));
    assert_eq!(options("Integrator \"bdpt\" \"integer maxdepth\" 9").max_depth, Some(9));
    assert_eq!(options("Integrator \"ao\"").max_depth, None);
}

fn place(scene: &Scene, i: usize) -> DVec3 {
    match scene.shapes[i].geometry {
        Geometry::Quadric(_, m) => m.transform_point3(DVec3::X),
        Geometry::Mesh(_) => panic!("a mesh"),
    }
}

#[test]
fn transforms_compose_as_in_pbrt() {
    let s = world(
        "AttributeBegin Translate 1 0 0 Scale 2 2 2 Shape \"sphere\" AttributeEnd
         Shape \"sphere\"
         TransformBegin Rotate 90 0 0 1 Translate 1 0 0 Shape \"sphere\" CoordinateSystem \"there\" TransformEnd
         CoordSysTransform \"there\" Shape \"sphere\" Identity Shape \"sphere\"
         Transform [ 1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1 ] ConcatTransform [ 3 0 0 0 0 3 0 0 0 0 3 0 0 0 0 1 ]
         Shape \"sphere\"
         Identity ActiveTransform EndTime Translate 7 7 7 ActiveTransform All Shape \"sphere\"",
    );
    let wanted =
        [[3., 0., 0.], [1., 0., 0.], [0., 2., 0.], [0., 2., 0.], [1., 0., 0.], [7., 5., 6.], [1., 0., 0.]];
    for (i, w) in wanted.into_iter().enumerate() {
        assert!((place(&s, i) - DVec3::from(w)).length() < 1e-12, "{i} {}", place(&s, i));
    }
}

#[test]
fn blocks_restore_what_they_should() {
    let s = world(
        "Material \"diffuse\"
         AttributeBegin
           AreaLightSource \"diffuse\" \"rgb L\" [ 1 2 3 ] ReverseOrientation Material \"interface\"
           Shape \"sphere\"
           TransformBegin Shape \"sphere\" TransformEnd
         AttributeEnd
         Shape \"sphere\"",
    );
    let lit: Vec<bool> = s.shapes.iter().map(|s| s.emission.is_some()).collect();
    assert_eq!(lit, [true, true, false]);
    let reversed: Vec<bool> = s.shapes.iter().map(|s| s.reverse_orientation).collect();
    assert_eq!(reversed, [true, true, false]);
    assert_eq!(s.shapes[0].material, s.shapes[1].material);
    assert_ne!(s.shapes[1].material, s.shapes[2].material);
}

#[test]
fn attributes_are_defaults_for_later_directives() {
    let s = world(
        "Attribute \"material\" \"rgb reflectance\" [ .1 .2 .3 ] \"float roughness\" 0.5
         AttributeBegin Attribute \"shape\" \"float radius\" 3 Shape \"sphere\" Shape \"sphere\" \"float radius\" 4 AttributeEnd
         Material \"diffuse\" Shape \"sphere\"",
    );
    let radius = |i: usize| match s.shapes[i].geometry {
        Geometry::Quadric(Quadric::Sphere { radius, .. }, _) => radius,
        _ => 0.0,
    };
    assert_eq!([radius(0), radius(1), radius(2)], [3.0, 4.0, 1.0]);
    let Some(Material { kind: MaterialKind::Diffuse { reflectance }, .. }) = s.materials.last() else {
        panic!()
    };
    assert_eq!(*reflectance, RgbParam::Constant(Rgb::new(0.1, 0.2, 0.3)));
}

#[test]
fn objects_and_instances() {
    let s = world(
        "ObjectBegin \"a\" Translate 0 0 1 Shape \"sphere\" Shape \"disk\" ObjectEnd
         Shape \"sphere\" Translate 5 0 0 ObjectInstance \"a\" Scale -1 1 1 ObjectInstance \"a\"",
    );
    assert_eq!((s.shapes.len(), s.objects.len(), s.instances.len()), (1, 1, 2));
    assert_eq!(s.objects[0].shapes.len(), 2);
    assert_eq!(s.instances[0].to_world.translation, DVec3::new(5.0, 0.0, 0.0));
    assert!(matches!(s.objects[0].shapes[0].geometry, Geometry::Quadric(_, m) if m.translation == DVec3::Z));
}

#[test]
fn luminaires_in_objects_are_copied_into_the_world() {
    let l = loaded(
        "WorldBegin ObjectBegin \"lamp\" AreaLightSource \"diffuse\" Shape \"sphere\"
         Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] ObjectEnd
         Translate 0 0 5 ObjectInstance \"lamp\" Scale -2 2 2 ObjectInstance \"lamp\"",
    );
    let s = &l.scene;
    assert_eq!((s.shapes.len(), s.objects[0].shapes.len()), (4, 0));
    assert!(said(&l).iter().any(|m| m.contains("each instance has its own copy")));
    let Geometry::Mesh(id) = s.shapes[3].geometry else { panic!() };
    let m = &s.meshes[id.0 as usize];
    let [a, b, c] = m.indices[0].map(|i| m.positions[i as usize]);
    let n = (b - a).cross(c - a);
    // Mirrored, yet facing +z as its object does; twice as large.
    assert!(n.z > 0.0 && (n.length() - 4.0).abs() < 1e-6 && a.z == 5.0);
}

#[test]
fn includes_imports_and_gzip() {
    let dir = Scratch::new("include");
    dir.write("parts/ball.pbrt", "Translate 1 0 0\nShape \"sphere\"\nMaterial \"interface\"\n");
    let mut gz = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gz.write_all(b"WorldBegin\nImport \"parts/ball.pbrt\"\nShape \"sphere\"\nInclude \"parts/ball.pbrt\"\nShape \"sphere\"\n").unwrap();
    let root = dir.write("root.pbrt.gz", gz.finish().unwrap());
    let l = load(std::slice::from_ref(&root), &LoadOptions::default()).unwrap();
    let xs: Vec<f64> = (0..4).map(|i| place(&l.scene, i).x).collect();
    assert_eq!(xs, [2.0, 1.0, 2.0, 2.0], "Import leaves the state alone, Include does not");
    assert_ne!(l.scene.shapes[1].material, l.scene.shapes[3].material);
    assert_eq!(l.scene.files, [root.clone(), dir.0.join("parts/ball.pbrt")]);
    // The hash follows the contents, and only them.
    let again = load(std::slice::from_ref(&root), &LoadOptions::default()).unwrap();
    assert_eq!(l.scene.content_hash, again.scene.content_hash);
    dir.write("parts/ball.pbrt", "Translate 2 0 0\nShape \"sphere\"\n");
    assert_ne!(l.scene.content_hash, load(&[root], &LoadOptions::default()).unwrap().scene.content_hash);
}

#[test]
fn several_files_make_one_scene() {
    let dir = Scratch::new("several");
    let a = dir.write(
        "a.pbrt",
        "Film \"rgb\" \"integer xresolution\" 5\nWorldBegin Material \"interface\" Shape \"sphere\"",
    );
    let b = dir.write("b.pbrt", "Translate 3 0 0\nShape \"disk\"");
    let c = dir.write("c.pbrt", "Camera \"orthographic\"");
    let d = dir.write("d.pbrt", "Scale 2 2 2 WorldBegin Shape \"cylinder\"");
    for order in [[&a, &b, &c, &d], [&c, &a, &b, &d]] {
        let paths: Vec<_> = order.into_iter().cloned().collect();
        let s = load(&paths, &LoadOptions::default()).unwrap().scene;
        assert_eq!(s.camera.projection, Projection::Orthographic);
        assert_eq!((s.film.width, s.shapes.len()), (5, 3));
        // The fragment goes on where the world before it ended; a world of its own starts afresh.
        assert_eq!(s.shapes[0].material, s.shapes[1].material);
        assert_ne!(s.shapes[1].material, s.shapes[2].material);
        assert_eq!(place(&s, 1), DVec3::new(4.0, 0.0, 0.0));
        assert_eq!(place(&s, 2), DVec3::X);
    }
    let only_fragments = load(&[b, c], &LoadOptions::default()).unwrap_err();
    assert!(only_fragments.to_string().contains("no WorldBegin"));
}

#[test]
fn substitution() {
    let run = |text: &str, defines: &[(&str, &str)]| {
        let defines = defines.iter().map(|d| (d.0.to_owned(), d.1.to_owned())).collect();
        load_pbrt_str(text, Path::new("."), &LoadOptions { defines, ..LoadOptions::default() })
    };
    let text = "WorldBegin Translate $shift Material \"${kind}\" \"bool remaproughness\" $flag
        Shape \"sphere\" \"float radius\" [ ${r} ]";
    let defines = [("shift", "1 2 3"), ("kind", "conductor"), ("flag", "false"), ("r", "0.5"), ("typo", "1")];
    let l = run(text, &defines).unwrap();
    assert_eq!(place(&l.scene, 0), DVec3::new(2.0, 2.0, 3.0));
    assert!(
        matches!(l.scene.materials[1].kind, MaterialKind::Conductor { roughness, .. } if !roughness.remap)
    );
    assert!(said(&l).iter().any(|m| m.ends_with("-D typo: the scene has no $typo")));
    let e = run("WorldBegin Translate $shfit", &defines).unwrap_err();
    assert!(e.to_string().contains("did you mean \"shift\"?"), "{e}");
    let e = run("WorldBegin Scale $x 1 1", &[("x", "abc")]).unwrap_err();
    assert!(e.to_string().contains("$x stands for \"abc\", which is not a number"), "{e}");
    // In strings an unknown $ stays.
    assert!(run("WorldBegin CoordinateSystem \"$5\"", &defines).is_ok());
}

#[test]
fn lenient_skips_what_it_does_not_understand() {
    let text = "WorldBegin Shpae \"x\" \"float y\" 1 Material \"velvet\" \"float fuzz\" 1 Shape \"sphere\" \"float fuzz\" 2
        Shape \"nurbs\" \"integer nu\" 3 NamedMaterial \"ghost\" Shape \"disk\" LightSource \"laser\"
        Material \"diffuse\" \"texture reflectance\" \"ghost\" Shape \"cylinder\" \"string radius\" \"2\"";
    let strict = load_pbrt_str(text, Path::new("."), &LoadOptions::default()).unwrap_err();
    assert_eq!(strict.diagnostics.iter().filter(|d| d.severity == Severity::Error).count(), 8);
    let options = LoadOptions { lenient: true, ..LoadOptions::default() };
    let l = load_pbrt_str(text, Path::new("."), &options).unwrap();
    assert_eq!(l.scene.shapes.len(), 3);
    for shape in &l.scene.shapes {
        let kind = &l.scene.materials[shape.material.0 as usize].kind;
        let grey = RgbParam::Constant(Rgb::splat(0.5));
        assert!(matches!(kind, MaterialKind::Diffuse { reflectance } if *reflectance == grey));
    }
    // What is broken rather than unknown stays an error.
    assert!(load_pbrt_str("WorldBegin Scale 0 0 0", Path::new("."), &options).is_err());
}

#[test]
fn did_you_mean() {
    for (text, hint) in [
        ("WorldBegin Shpae \"sphere\"", "Shape"),
        ("WorldBegin Material \"dielectrik\"", "dielectric"),
        ("WorldBegin Shape \"trianglemseh\"", "trianglemesh"),
        ("WorldBegin LightSource \"infinte\"", "infinite"),
        ("WorldBegin Texture \"a\" \"spectrum\" \"chekerboard\"", "checkerboard"),
        ("WorldBegin Shape \"sphere\" \"float raduis\" 1", "radius"),
        ("WorldBegin Shape \"sphere\" \"flot radius\" 1", "float"),
        ("WorldBegin MakeNamedMaterial \"gold\" \"string type\" \"diffuse\" NamedMaterial \"glod\"", "gold"),
        ("WorldBegin Material \"conductor\" \"spectrum eta\" \"metal-Au-ea\"", "metal-Au-eta"),
        ("Camera \"perspectiv\" WorldBegin", "perspective"),
        ("Integrator \"pth\" WorldBegin", "path"),
    ] {
        let e = load_pbrt_str(text, Path::new("."), &LoadOptions::default()).unwrap_err();
        assert!(e.to_string().ends_with(&format!("help: did you mean \"{hint}\"?")), "{e}");
    }
}

#[test]
fn media_are_accepted_and_said_to_be_ignored() {
    let l = loaded(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [ 1 1 1 ] MediumInterface \"\" \"fog\"
         Camera \"perspective\" WorldBegin MediumInterface \"fog\" \"\" Material \"interface\" Shape \"sphere\"",
    );
    let warnings = said(&l).into_iter().filter(|m| m.contains("\"fog\" is ignored")).count();
    assert_eq!(warnings, 1);
    assert!(matches!(l.scene.materials[1].kind, MaterialKind::Interface));
}
