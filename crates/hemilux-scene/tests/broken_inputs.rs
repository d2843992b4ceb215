//! Broken inputs and the one line that each must earn: no panic, no hang, no second message in its wake.

use hemilux_scene::{LoadError, LoadOptions, Severity, load, load_pbrt_str};
use std::fs;
use std::path::{Path, PathBuf};

/// The error lines of a failed load.
fn lines(error: &LoadError) -> Vec<String> {
    let errors = error.diagnostics.iter().filter(|d| d.severity == Severity::Error);
    errors.map(|d| error.sources.one_line(d)).collect()
}

fn text_errors(text: &str) -> Vec<String> {
    let options = LoadOptions { memory_limit: Some(1 << 30), ..LoadOptions::default() };
    match load_pbrt_str(text, Path::new("."), &options) {
        Ok(_) => vec!["it loaded".into()],
        Err(e) => lines(&e),
    }
}

fn check_text(text: &str, expected: &str) {
    assert_eq!(text_errors(text), [expected], "for: {text:.200}");
}

/// Broken scene texts. What follows `<text>` is line, column and message.
const TEXTS: &[(&str, &str)] = &[
    // Structure.
    ("", "<text>: error: empty file"),
    ("  \n\t", "<text>: error: empty file"),
    ("Camera \"perspective\"", "<text>: error: no WorldBegin"),
    ("Shape \"sphere\"", "<text>: error: no WorldBegin"),
    ("Shape \"sphere\"\nWorldBegin", "<text>:1:1: error: Shape must come after WorldBegin"),
    ("WorldBegin Film \"rgb\"", "<text>:1:12: error: Film must come before WorldBegin"),
    ("WorldBegin WorldBegin", "<text>:1:12: error: a second WorldBegin"),
    ("WorldBegin AttributeBegin", "<text>:1:12: error: AttributeBegin without AttributeEnd"),
    ("WorldBegin\nAttributeEnd", "<text>:2:1: error: AttributeEnd without AttributeBegin"),
    (
        "WorldBegin TransformBegin\nAttributeEnd TransformEnd",
        "<text>:2:1: error: AttributeEnd inside the TransformBegin of <text>:1:12",
    ),
    ("WorldBegin ObjectBegin \"a\"", "<text>:1:12: error: ObjectBegin without ObjectEnd"),
    (
        "WorldBegin ObjectBegin \"a\" ObjectInstance \"a\" ObjectEnd",
        "<text>:1:28: error: ObjectInstance inside an object",
    ),
    (
        "WorldBegin ObjectBegin \"a\" ObjectEnd ObjectBegin \"a\" ObjectEnd",
        "<text>:1:50: error: object \"a\" is already defined at <text>:1:24",
    ),
    ("WorldBegin ObjectInstance \"ghost\"", "<text>:1:27: error: object \"ghost\" is not defined"),
    // Tokens.
    ("WorldBegin Shpae \"sphere\"", "<text>:1:12: error: unknown directive \"Shpae\""),
    ("WorldBegin 17", "<text>:1:12: error: unknown directive \"17\""),
    ("WorldBegin \"sphere\"", "<text>:1:12: error: expected a directive, found the string \"sphere\""),
    ("WorldBegin ] Shape \"sphere\"", "<text>:1:12: error: expected a directive, found \"]\""),
    ("WorldBegin Shape \"sphere\n", "<text>:1:18: error: the string has no end on its line"),
    ("WorldBegin Shape \"sph\\qere\"", "<text>:1:18: error: unknown escape \"\\q\""),
    (
        "WorldBegin Shape sphere",
        "<text>:1:18: error: expected the type of the shape in quotes, found \"sphere\"",
    ),
    (
        "WorldBegin Shape",
        "<text>:1:17: error: expected the type of the shape in quotes, found the end of the file",
    ),
    // Truncated files.
    (
        "WorldBegin Shape \"sphere\" \"float radius\" [ 1",
        "<text>:1:45: error: expected a number or \"]\", found the end of the file",
    ),
    (
        "WorldBegin Shape \"sphere\" \"float radius\"",
        "<text>:1:41: error: expected a number, found the end of the file",
    ),
    ("WorldBegin Shape \"sphere\" \"float rad", "<text>:1:27: error: the string has no end on its line"),
    (
        "WorldBegin Translate 1 2",
        "<text>:1:25: error: Translate takes 3 numbers, found the end of the file after 2",
    ),
    (
        "WorldBegin Shape \"sphere\" \"float radius\" [ 1\nShape \"disk\"",
        "<text>:2:1: error: expected a number or \"]\", found \"Shape\"",
    ),
    // Numbers.
    ("WorldBegin Translate nan 0 0", "<text>:1:22: error: \"nan\" is not a finite number"),
    ("WorldBegin Translate 1e999 0 0", "<text>:1:22: error: \"1e999\" is not a finite number"),
    ("WorldBegin Translate 1e39 0 0", "<text>:1:22: error: \"1e39\" is too large for single precision"),
    ("WorldBegin Shape \"sp\\nere\"", "<text>:1:18: error: unknown shape \"sp\\nere\""),
    (
        "WorldBegin Shape \"sphere\" \"float radius\" 1e-60",
        "<text>:1:42: error: parameter \"radius\" of shape \"sphere\" must be positive, not 0.000000000000000000000000000000000000000000000000000000000001",
    ),
    (
        "WorldBegin Shape \"sphere\" \"float radius\" -inf",
        "<text>:1:42: error: \"-inf\" is not a finite number",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 nan 0 0 1 0 ]",
        "<text>:1:54: error: \"nan\" is not a finite number",
    ),
    ("WorldBegin Scale 1 0 1", "<text>:1:12: error: singular transform"),
    ("WorldBegin Scale 1e-200 1e-200 1e-200", "<text>:1:12: error: singular transform"),
    ("WorldBegin Transform [ 1 0 0 0 1 0 0 0 0 0 1 0 0 0 0 1 ]", "<text>:1:12: error: singular transform"),
    (
        "WorldBegin Transform [ 1 0 0 1 0 1 0 0 0 0 1 0 0 0 0 1 ]",
        "<text>:1:12: error: the last row of a transform must be 0 0 0 1",
    ),
    ("WorldBegin Rotate 30 0 0 0", "<text>:1:12: error: Rotate around a zero axis"),
    (
        "LookAt 0 0 0 0 0 1 0 0 1 WorldBegin",
        "<text>:1:1: error: LookAt: the eye, the point looked at and up must not be in line",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"integer indices\" [ 0 1 2.5 ]",
        "<text>:1:57: error: \"2.5\" is not an integer",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"integer indices\" [ 0 1 4e9 ]",
        "<text>:1:57: error: \"4000000000\" does not fit into 32 bits",
    ),
    // Parameters.
    (
        "WorldBegin Material \"conductor\" \"float uroughnes\" 0.1",
        "<text>:1:40: error: unknown parameter \"uroughnes\" for material \"conductor\"",
    ),
    (
        "WorldBegin Shape \"sphere\" \"string radius\" \"1\"",
        "<text>:1:35: error: parameter \"radius\" of shape \"sphere\" must be float, not string",
    ),
    (
        "WorldBegin Shape \"sphere\" \"float radius\" [ 1 2 ]",
        "<text>:1:34: error: parameter \"radius\" of shape \"sphere\" takes 1 value, not 2",
    ),
    (
        "WorldBegin Shape \"sphere\" \"flaot radius\" 1",
        "<text>:1:27: error: unknown parameter type \"flaot\"",
    ),
    (
        "WorldBegin Shape \"sphere\" \"radius\" 1",
        "<text>:1:27: error: a parameter is a type and a name in quotes, found the string \"radius\"",
    ),
    (
        "WorldBegin Shape \"sphere\" \"float radius\" 1 \"float radius\" 2",
        "<text>:1:51: error: parameter \"radius\" is given twice",
    ),
    (
        "WorldBegin Material \"conductor\" \"bool remaproughness\" maybe",
        "<text>:1:55: error: expected true or false, found \"maybe\"",
    ),
    (
        "WorldBegin Material \"diffuse\" \"rgb reflectance\" [ 1 1 ]",
        "<text>:1:36: error: parameter \"reflectance\" of material \"diffuse\" takes 3 values, not 2",
    ),
    (
        "WorldBegin LightSource \"point\" \"rgb I\" [ 1 1 -1 ]",
        "<text>:1:42: error: parameter \"I\" of light source \"point\" has a negative component",
    ),
    (
        "WorldBegin LightSource \"point\" \"blackbody I\" 0",
        "<text>:1:46: error: temperature must be between 100 and 10,000,000 K, not 0",
    ),
    // Names.
    ("WorldBegin Material \"difuse\"", "<text>:1:21: error: unknown material \"difuse\""),
    ("WorldBegin Material \"hair\"", "<text>:1:21: error: material \"hair\" is not supported"),
    ("WorldBegin Shape \"spheer\"", "<text>:1:18: error: unknown shape \"spheer\""),
    ("WorldBegin Shape \"loopsubdiv\"", "<text>:1:18: error: shape \"loopsubdiv\" is not supported"),
    ("WorldBegin LightSource \"sopt\"", "<text>:1:24: error: unknown light source \"sopt\""),
    ("WorldBegin AreaLightSource \"difuse\"", "<text>:1:28: error: unknown area light source \"difuse\""),
    ("WorldBegin Texture \"t\" \"float\" \"fbm\"", "<text>:1:32: error: texture \"fbm\" is not supported"),
    ("Camera \"realistic\" WorldBegin", "<text>:1:8: error: camera \"realistic\" is not supported"),
    ("ColorSpace \"rgb\" WorldBegin", "<text>:1:12: error: unknown colour space \"rgb\""),
    ("WorldBegin NamedMaterial \"ghost\"", "<text>:1:26: error: material \"ghost\" is not defined"),
    (
        "WorldBegin Material \"diffuse\" \"texture reflectance\" \"ghost\"",
        "<text>:1:53: error: spectrum texture \"ghost\" is not defined",
    ),
    (
        "WorldBegin CoordSysTransform \"ghost\"",
        "<text>:1:30: error: coordinate system \"ghost\" is not defined",
    ),
    ("WorldBegin MediumInterface \"fog\" \"\"", "<text>:1:28: error: medium \"fog\" is not defined"),
    (
        "WorldBegin Material \"conductor\" \"spectrum eta\" \"metal-Cx-eta\"",
        "<text>:1:48: error: spectrum \"metal-Cx-eta\" is neither a known name nor a file",
    ),
    (
        "WorldBegin MakeNamedMaterial \"m\" \"string type\" \"diffuse\"\nMakeNamedMaterial \"m\" \"string type\" \"diffuse\"",
        "<text>:2:19: error: material \"m\" is already defined at <text>:1:30",
    ),
    ("WorldBegin Translate $x 0 0", "<text>:1:22: error: $x is not defined"),
    // Geometry.
    (
        "WorldBegin Shape \"sphere\" \"float radius\" 0",
        "<text>:1:42: error: parameter \"radius\" of shape \"sphere\" must be positive, not 0",
    ),
    (
        "WorldBegin Shape \"cylinder\" \"float radius\" -2",
        "<text>:1:44: error: parameter \"radius\" of shape \"cylinder\" must be positive, not -2",
    ),
    (
        "WorldBegin Shape \"disk\" \"float innerradius\" 1",
        "<text>:1:45: error: parameter \"innerradius\" of shape \"disk\" must be in [0, radius), not 1",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 3 ]",
        "<text>:1:75: error: index 3 of shape \"trianglemesh\" is out of range: there are 3 vertices",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 -1 ]",
        "<text>:1:75: error: index -1 of shape \"trianglemesh\" is out of range: there are 3 vertices",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 0 ] \"integer indices\" [ 0 1 ]",
        "<text>:1:75: error: \"indices\" of shape \"trianglemesh\" takes multiples of 3 values, not 2",
    ),
    (
        "WorldBegin Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1 0 0 0 1 ]",
        "<text>:1:41: error: parameter \"P\" of shape \"trianglemesh\" takes multiples of 3 values, not 8",
    ),
    ("WorldBegin Shape \"trianglemesh\"", "<text>:1:18: error: shape \"trianglemesh\" has no \"point3 P\""),
    (
        "WorldBegin Scale 1e30 1 1 Shape \"trianglemesh\" \"point3 P\" [ 0 0 0 1e30 0 0 0 1 0 ]",
        "<text>:1:33: error: vertex 1 of shape \"trianglemesh\" is not finite in single precision",
    ),
    (
        "WorldBegin Shape \"plymesh\" \"string filename\" \"no-such-dir/ghost.ply\"",
        "<text>:1:46: error: ./no-such-dir/ghost.ply: no such file",
    ),
    // Camera, film.
    (
        "Camera \"perspective\" \"float fov\" 180 WorldBegin",
        "<text>:1:34: error: parameter \"fov\" of camera \"perspective\" must be between 0 and 180 degrees, not 180",
    ),
    (
        "Film \"rgb\" \"integer xresolution\" 0 WorldBegin",
        "<text>:1:34: error: parameter \"xresolution\" of film \"rgb\" must be positive, not 0",
    ),
    (
        "Film \"rgb\" \"integer xresolution\" 100000 \"integer yresolution\" 100000 WorldBegin",
        "<text>:1:1: error: a film of 100000 x 100000 pixels is too large: at most 2^31 pixels",
    ),
    (
        "Film \"rgb\" \"integer xresolution\" 30000 \"integer yresolution\" 30000 WorldBegin",
        "<text>:1:1: error: a film of 30000 x 30000 pixels is too large: it takes 82397 MiB, the limit is 1024 MiB",
    ),
    // Files.
    (
        "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"ghost.png\"",
        "<text>:1:64: error: ./ghost.png: no such file",
    ),
    ("WorldBegin Include \"ghost.pbrt\"", "<text>:1:20: error: ./ghost.pbrt: no such file"),
    ("Import \"ghost.pbrt\" WorldBegin", "<text>:1:8: error: Import must come after WorldBegin"),
];

#[test]
fn broken_texts() {
    assert!(TEXTS.len() >= 40);
    let mut wrong = Vec::new();
    for (text, expected) in TEXTS {
        let found = text_errors(text);
        if found != [*expected] {
            wrong.push(format!("{text}\n  expected {expected}\n  found    {found:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn deep_nesting_ends_cleanly() {
    let deep = "WorldBegin\n".to_owned() + &"AttributeBegin\n".repeat(200_000);
    check_text(&deep, "<text>:10002:1: error: blocks nested deeper than 10000");
    let closed = deep.clone() + &"AttributeEnd\n".repeat(200_000);
    check_text(&closed, "<text>:10002:1: error: blocks nested deeper than 10000");
    let brackets = "WorldBegin Shape \"sphere\" \"float radius\" ".to_owned() + &"[".repeat(200_000);
    check_text(&brackets, "<text>:1:43: error: expected a number or \"]\", found \"[\"");
    // Just within the limit it loads.
    let fine =
        "WorldBegin\n".to_owned() + &"AttributeBegin\n".repeat(10_000) + &"AttributeEnd\n".repeat(10_000);
    assert!(load_pbrt_str(&fine, Path::new("."), &LoadOptions::default()).is_ok());
}

#[test]
fn many_errors_are_bounded() {
    let text = "WorldBegin\n".to_owned() + &"Shpae \"sphere\"\n".repeat(1000);
    let e = load_pbrt_str(&text, Path::new("."), &LoadOptions::default()).unwrap_err();
    assert_eq!(lines(&e).len(), 20);
    assert_eq!(lines(&e)[19], "<text>:21:1: error: unknown directive \"Shpae\"");
}

/// A directory of its own per test, removed at the end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let dir = std::env::temp_dir().join(format!("hemilux-{name}-{}", std::process::id()));
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).unwrap();
        Scratch(dir)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.join(name);
        fs::write(&path, bytes).unwrap();
        path
    }

    /// Load files; the error lines with the directory's name taken out.
    fn errors(&self, names: &[&str]) -> Vec<String> {
        let paths: Vec<PathBuf> = names.iter().map(|n| self.0.join(n)).collect();
        let e = match load(&paths, &LoadOptions::default()) {
            Ok(_) => panic!("{names:?} loaded"),
            Err(e) => e,
        };
        let dir = format!("{}/", self.0.display());
        lines(&e).iter().map(|l| l.replace(&dir, "")).collect()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

#[test]
fn broken_files() {
    let dir = Scratch::new("broken");
    dir.write("empty.pbrt", "");
    dir.write("scene.obj", "v 0 0 0");
    fs::create_dir(dir.0.join("folder.pbrt")).unwrap();
    dir.write("bad.pbrt.gz", [0x1f, 0x8b, 8, 0, 1, 2, 3]);
    dir.write("self.pbrt", "WorldBegin\nInclude \"self.pbrt\"");
    dir.write("a.pbrt", "WorldBegin\n  Include \"b.pbrt\"");
    dir.write("b.pbrt", "Include \"c.pbrt\"");
    dir.write("c.pbrt", "\nImport \"a.pbrt\"");
    dir.write("leaf.pbrt", "\n\nShape \"spheer\"");
    dir.write("includes.pbrt", "WorldBegin Include \"leaf.pbrt\"");
    dir.write("open.pbrt", "AttributeBegin");
    dir.write("imports.pbrt", "WorldBegin Import \"open.pbrt\" AttributeEnd");
    for (files, expected) in [
        (&["empty.pbrt"][..], "empty.pbrt: error: empty file"),
        (&["ghost.pbrt"], "ghost.pbrt: error: no such file"),
        (
            &["scene.obj"],
            "scene.obj: error: unknown kind of file: scenes are .pbrt, .rad, .oct, with views in .vf",
        ),
        (&["folder.pbrt"], "folder.pbrt: error: is a directory, not a scene file"),
        (&["bad.pbrt.gz"], "bad.pbrt.gz: error: truncated gzip data"),
        (&["self.pbrt"], "self.pbrt:2:9: error: cyclic include: self.pbrt -> self.pbrt"),
        (&["a.pbrt"], "c.pbrt:2:8: error: cyclic include: a.pbrt -> b.pbrt -> c.pbrt -> a.pbrt"),
        (&["includes.pbrt"], "leaf.pbrt:3:7: error: unknown shape \"spheer\""),
    ] {
        assert_eq!(dir.errors(files), [expected]);
    }
    let imports = dir.errors(&["imports.pbrt"]);
    assert_eq!(imports[0], "open.pbrt:1:1: error: AttributeBegin without AttributeEnd");
    assert!(load(&[], &LoadOptions::default()).is_err());
}

#[test]
fn includes_end() {
    // 2^40 inclusions by doubling: a limit on the number of files stops it.
    let dir = Scratch::new("doubling");
    for i in 0..40 {
        dir.write(&format!("d{i}.pbrt"), format!("Include \"d{0}.pbrt\" Include \"d{0}.pbrt\"", i + 1));
    }
    dir.write("d40.pbrt", "Translate 0 0 0");
    dir.write("root.pbrt", "WorldBegin Include \"d0.pbrt\"");
    let errors = dir.errors(&["root.pbrt"]);
    assert_eq!(errors, ["d35.pbrt:1:9: error: d36.pbrt: more than 100000 files"]);
    // 70 files deep.
    for i in 0..70 {
        dir.write(&format!("e{i}.pbrt"), format!("Include \"e{}.pbrt\"", i + 1));
    }
    dir.write("deep.pbrt", "WorldBegin Include \"e0.pbrt\"");
    assert_eq!(dir.errors(&["deep.pbrt"]), ["e62.pbrt:1:9: error: includes nested deeper than 64"]);
}

#[test]
fn the_chain_of_includes_is_shown() {
    let dir = Scratch::new("chain");
    dir.write("leaf.pbrt", "Material \"conductor\"\n  \"float uroughnes\" [ 0.1 ]\n");
    dir.write("middle.pbrt", "# nothing\nInclude \"leaf.pbrt\"\n");
    dir.write("root.pbrt", "WorldBegin\nInclude \"middle.pbrt\"\n");
    let e = load(&[dir.0.join("root.pbrt")], &LoadOptions::default()).unwrap_err();
    let shown = e.to_string().replace(&format!("{}/", dir.0.display()), "");
    let expected = "leaf.pbrt:2:10: error: unknown parameter \"uroughnes\" for material \"conductor\"
   |
 2 |   \"float uroughnes\" [ 0.1 ]
   |          ^^^^^^^^^
  included from middle.pbrt:2:9
  included from root.pbrt:2:9
  help: did you mean \"uroughness\"?";
    assert_eq!(shown, expected);
}

#[test]
fn broken_meshes() {
    let dir = Scratch::new("meshes");
    let vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 1\nproperty list uchar int vertex_indices\n";
    let ascii = |header: &str, body: &str| format!("ply\nformat ascii 1.0\n{header}end_header\n{body}");
    let both = format!("{vertices}{faces}");
    let huge = both.replace("vertex 3", "vertex 4000000000");
    for (bytes, expected) in [
        (String::new(), "m.ply: error: empty file"),
        ("solid".into(), "m.ply: error: not a PLY file"),
        ("ply\nformat ascii 1.0\nelement vertex 3".into(), "m.ply: error: truncated header: no end_header"),
        ("ply\nformat ascii 2.0\nend_header\n".into(), "m.ply:2:1: error: unknown version \"2.0\""),
        ("ply\nelement vertex 1\nend_header\n".into(), "m.ply:3:1: error: no format line"),
        (ascii("element vertex many\n", ""), "m.ply:3:1: error: \"many\" is not a number of vertex elements"),
        (ascii("property float x\n", ""), "m.ply:3:1: error: property before any element"),
        (ascii(&both.replace("float y", "flaot y"), ""), "m.ply:5:1: error: unknown property type \"flaot\""),
        (ascii("hello there\n", ""), "m.ply:3:1: error: unknown header line \"hello there\""),
        (
            ascii(&both, "0 0 0 1 0 0"),
            "m.ply:3:1: error: the header announces 3 vertex elements, the file is too short",
        ),
        (
            ascii(&huge, "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
            "m.ply:3:1: error: the header announces 4000000000 vertex elements, the file is too short",
        ),
        (
            ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
            "m.ply:13:1: error: face 0 names vertex 3, there are 3",
        ),
        (
            ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
            "m.ply:13:1: error: face 0 names vertex -1, there are 3",
        ),
        (ascii(&both, "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n"), "m.ply:11:1: error: vertex 1 is not finite"),
        (ascii(&both, "0 0 0\n1 x 0\n0 1 0\n3 0 1 2\n"), "m.ply:11:1: error: \"x\" is not a number"),
        (
            ascii(&both, "0 0 0\n1 0 0\n0 1 0\n99 0 1 2\n"),
            "m.ply:13:1: error: a list of 99 values, the file is too short",
        ),
        (ascii(&both, "0 0 0\n1 0 0\n0 1 0\n3 0 1"), "m.ply: error: truncated file"),
        (ascii(vertices, "0 0 0\n1 0 0\n0 1 0\n"), "m.ply: error: no faces"),
        (
            ascii(&format!("{faces}{vertices}"), "3 0 1 2\n0 0 0\n1 0 0\n0 1 0\n"),
            "m.ply:3:1: error: faces before vertices",
        ),
        (
            ascii(&both.replace("float z", "float w"), "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
            "m.ply:3:1: error: vertices without x, y and z",
        ),
        (
            ascii(&both.replace("uchar", "float"), ""),
            "m.ply:8:1: error: the count of a list must be an integer",
        ),
    ] {
        dir.write("m.ply", &bytes);
        dir.write("scene.pbrt", "WorldBegin Shape \"plymesh\" \"string filename\" \"m.ply\"");
        assert_eq!(dir.errors(&["scene.pbrt"]), [expected], "{bytes}");
    }
    fs::remove_file(dir.0.join("m.ply")).unwrap();
    fs::create_dir(dir.0.join("m.ply")).unwrap();
    assert_eq!(dir.errors(&["scene.pbrt"]), ["scene.pbrt:1:46: error: m.ply: is a directory"]);
}

#[test]
fn broken_images() {
    let dir = Scratch::new("images");
    dir.write("t.png", "not an image");
    dir.write(
        "scene.pbrt",
        "WorldBegin Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"t.png\"",
    );
    let errors = dir.errors(&["scene.pbrt"]);
    assert!(
        errors.len() == 1 && errors[0].starts_with("scene.pbrt:1:64: error: t.png: not a valid PNG"),
        "{errors:?}"
    );
    dir.write("wide.pfm", b"PF\n2 1\n-1.0\n\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0\0");
    dir.write("sky.pbrt", "WorldBegin LightSource \"infinite\" \"string filename\" \"wide.pfm\"");
    assert_eq!(
        dir.errors(&["sky.pbrt"]),
        [
            "sky.pbrt:1:53: error: an environment map is square (equal-area octahedral), this one has 2 x 1 pixels"
        ]
    );
}
