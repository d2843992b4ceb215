//! What `check` finds in broken models, each with a sound twin that it must not object to.

use hemilux::check::findings;
use hemilux::world::World;
use hemilux_scene::{LoadError, LoadOptions, Loaded, load, load_pbrt_str, load_radiance_str};
use std::path::{Path, PathBuf};

fn said(loaded: Result<Loaded, LoadError>) -> Vec<String> {
    let loaded = loaded.unwrap_or_else(|e| panic!("{e}"));
    let found = findings(&World::new(loaded.scene));
    found.iter().map(|d| format!("{}: {}", d.span.line, d.message)).collect()
}

fn rad(text: &str) -> Vec<String> {
    said(load_radiance_str(text, None, Path::new("."), &LoadOptions::default()))
}

fn pbrt(text: &str) -> Vec<String> {
    said(load_pbrt_str(text, Path::new("."), &LoadOptions::default()))
}

/// A closed grey room of 2 m with a panel under its ceiling.
const ROOM: &str = "void plastic m 0 0 5 .5 .5 .5 0 0\n!genbox m room 2 2 2 -i\nvoid light l 0 0 3 1 1 1\n\
                    l polygon p 0 0 12 .5 .5 1.9 .5 1.5 1.9 1.5 1.5 1.9 1.5 .5 1.9\n";

fn room(more: &str) -> Vec<String> {
    rad(&format!("{ROOM}{more}"))
}

#[test]
fn glass_is_open_or_inside_out() {
    let glass = "void dielectric g 0 0 5 1 1 1 1.5 0\n";
    assert_eq!(room(&format!("{glass}!genbox g b .2 .2 .2 | xform -t 1 1 .5\n")), [""; 0]);
    assert_eq!(room(&format!("{glass}g sphere b 0 0 4 1 1 .5 .2\n")), [""; 0]);
    // A hollow in glass looks inwards rightly.
    assert_eq!(room(&format!("{glass}g sphere b 0 0 4 1 1 .5 .2\ng bubble h 0 0 4 1 1 .5 .1\n")), [""; 0]);
    assert_eq!(
        room(&format!("{glass}!genbox g b .2 .2 .2 -i | xform -t 1 1 .5\n")),
        ["1: glass \"g\" is inside out, near 1.1 1.1 0.6: its faces look inwards"]
    );
    assert_eq!(
        room(&format!("{glass}g bubble b 0 0 4 1 1 .5 .2\n")),
        ["6: glass \"g\" is inside out, near 1 1 0.5: its faces look inwards"]
    );
    assert_eq!(
        room(&format!("{glass}g polygon q 0 0 12 .5 .5 1 1 .5 1 1 1 1 .5 1 1\n")),
        ["6: glass \"g\" is open, near 0.75 0.75 1: 4 edges have no other side"]
    );
    // One face of a tetrahedron turned round.
    let face = |a: &str, b: &str, c: &str| format!("g polygon f 0 0 9 {a} {b} {c}\n");
    let (o, x, y, z) = ("1 1 1", "1.2 1 1", "1 1.2 1", "1 1 1.2");
    let sound = face(o, y, x) + &face(o, x, z) + &face(o, z, y);
    assert_eq!(room(&format!("{glass}{sound}{}", face(x, y, z))), [""; 0]);
    assert_eq!(
        room(&format!("{glass}{sound}{}", face(x, z, y))),
        ["6: glass \"g\", near 1.1 1.1 1.1: neighbouring faces look different ways at 3 edges"]
    );
}

#[test]
fn surfaces_lie_in_one_place() {
    let board = "m polygon a 0 0 12 .5 .5 1 1 .5 1 1 1 1 .5 1 1\n";
    assert_eq!(room(board), [""; 0]);
    let found = room(&format!("{board}{board}"));
    assert!(
        found.len() == 1 && found[0].contains("the same triangle lies there twice, near 0."),
        "{found:?}"
    );
    let ball = "m sphere s 0 0 4 1 1 1 .2\n";
    assert_eq!(
        room(&format!("{ball}{ball}")),
        ["6: a shape lies where that of line 5 lies already, near 1 1 1"]
    );
}

#[test]
fn reflectances_are_over_one() {
    assert_eq!(room("void plastic w 0 0 5 .9 .9 .9 .1 0\nw sphere s 0 0 4 1 1 1 .2\n"), [""; 0]);
    let found = room("void trans t 0 0 7 .8 .8 .8 .5 0 .5 .5\nt sphere s 0 0 4 1 1 1 .2\n");
    assert_eq!(found, [""; 0]);
    let text = |a: f32| {
        format!(
            "WorldBegin AreaLightSource \"diffuse\" \"rgb L\" [1 1 1] Shape \"sphere\" \"float radius\" 0.1\n\
             AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [0 0 0] AttributeEnd\n\
             Texture \"t\" \"spectrum\" \"scale\" \"rgb tex\" [.8 .8 .8] \"float scale\" [{a}]\n\
             Material \"diffuse\" \"texture reflectance\" \"t\"\nReverseOrientation Shape \"sphere\" \"float radius\" 2\n"
        )
    };
    assert!(pbrt(&text(1.2)).iter().all(|f| !f.contains("of what arrives")), "{:?}", pbrt(&text(1.2)));
    let found = pbrt(&text(1.5));
    assert!(found.iter().any(|f| f == "4: material returns 1.200 of what arrives"), "{found:?}");
}

#[test]
fn units_are_suspicious() {
    assert_eq!(room(""), [""; 0]);
    let large = rad(&ROOM.replace("2 2 2 -i", "4000 4000 3000 -i"));
    assert!(large.iter().any(|f| f.contains("m across")), "{large:?}");
    let small = rad(
        "void light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 0 0 .001\nvoid plastic m 0 0 5 .5 .5 .5 0 0\nm bubble b 0 0 4 0 0 0 .01\n",
    );
    assert!(small.iter().any(|f| f == "0: the scene is only 34.64 mm across"), "{small:?}");
    let bright = room("void light k 0 0 3 1e9 1e9 1e9\nk sphere s 0 0 4 1 1 1 .01\n");
    assert!(bright.iter().any(|f| f.starts_with("6: a luminaire of 1.8e11 cd/m2 is brighter")), "{bright:?}");
}

#[test]
fn luminaires_light_nothing() {
    // A second lamp outside the room, facing away from it.
    let found = room("void light k 0 0 3 1 1 1\nk polygon p 0 0 12 0 0 5 1 0 5 1 1 5 0 1 5\n");
    assert!(found.contains(&"6: a luminaire lights nothing".to_owned()), "{found:?}");
}

#[test]
fn energy_leaves_the_scene() {
    let open = "void plastic m 0 0 5 .5 .5 .5 0 0\nvoid light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 0 1 .1\nm ring f 0 0 8 0 0 0 0 0 1 0 1\n";
    let found = rad(open);
    assert!(found.iter().any(|f| f.ends_with("% of what the luminaires emit leaves the scene")), "{found:?}");
    // Under a sky it may.
    let sky = format!("{open}void glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\n");
    assert_eq!(rad(&sky), [""; 0]);
}

/// The scenes that come with the project are sound.
#[test]
fn our_own_scenes_are_sound() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for names in [
        &["dome.rad"][..],
        &["office-overcast.rad", "office-blinds.rad"],
        &["light-shelf.rad"],
        &["glass-window.rad"],
        &["downlight.rad"],
        &["figure-1.pbrt"],
        &["mirror-room.pbrt"],
        &["glass-ball.pbrt"],
    ] {
        let paths: Vec<PathBuf> = names.iter().map(|n| scenes.join(n)).collect();
        println!("{names:?}");
        assert_eq!(said(load(&paths, &LoadOptions::default())), [""; 0], "{names:?}");
    }
}
