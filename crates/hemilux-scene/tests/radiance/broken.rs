//! Broken Radiance inputs and the one line that each must earn: no panic, no hang, nothing ever executed.

use crate::Scratch;
use hemilux_scene::{LoadError, LoadOptions, Severity, load, load_radiance_str};
use std::path::{Path, PathBuf};

fn options() -> LoadOptions {
    LoadOptions { memory_limit: Some(1 << 30), ..LoadOptions::default() }
}

/// The error lines of a failed load.
fn lines(error: &LoadError) -> Vec<String> {
    let errors = error.diagnostics.iter().filter(|d| d.severity == Severity::Error);
    errors.map(|d| error.sources.one_line(d)).collect()
}

fn text_errors(text: &str, view: Option<&str>) -> Vec<String> {
    match load_radiance_str(text, view, Path::new("."), &options()) {
        Ok(_) => vec!["it loaded".into()],
        Err(e) => lines(&e),
    }
}

/// Broken scene texts. What follows `<text>` is line, column and message.
const TEXTS: &[(&str, &str)] = &[
    ("", "<text>: error: empty file"),
    (" \n\t", "<text>: error: empty file"),
    ("void", "<text>:1:5: error: expected the type of a primitive, found the end of the file"),
    ("void plastic", "<text>:1:13: error: expected the identifier of a primitive, found the end of the file"),
    (
        "void plastic p",
        "<text>:1:15: error: expected the count of strings of plastic \"p\", found the end of the file",
    ),
    (
        "void plastic p 0",
        "<text>:1:17: error: expected the count of integers of plastic \"p\", found the end of the file",
    ),
    (
        "void plastic p 0 0",
        "<text>:1:19: error: expected the count of numbers of plastic \"p\", found the end of the file",
    ),
    (
        "void plastic p 0 0 5 .5 .5",
        "<text>:1:27: error: plastic \"p\" has 5 numbers, found the end of the file after 2",
    ),
    ("void plastic p x", "<text>:1:16: error: expected the count of strings of plastic \"p\", found \"x\""),
    (
        "void plastic p 0 0 -5",
        "<text>:1:20: error: expected the count of numbers of plastic \"p\", found \"-5\"",
    ),
    (
        "void plastic p 0 0 5.5",
        "<text>:1:20: error: expected the count of numbers of plastic \"p\", found \"5.5\"",
    ),
    (
        "void plastic p 99999999999999999999",
        "<text>:1:16: error: expected the count of strings of plastic \"p\", found \"99999999999999999999\"",
    ),
    ("void plastic p 0 1 3 0", "<text>:1:20: error: plastic \"p\" takes no integers"),
    (
        "void plastic p 0 0 4000000000 1 2 3",
        "<text>:1:36: error: plastic \"p\" has 4000000000 numbers, found the end of the file after 3",
    ),
    (
        "void plastic p 1000000000 a b",
        "<text>:1:30: error: plastic \"p\" has 1000000000 strings, found the end of the file after 2",
    ),
    ("void plastic p 0 0 5 .5 .5 nan 0 0", "<text>:1:28: error: \"nan\" is not a finite number"),
    ("void plastic p 0 0 5 .5 .5 inf 0 0", "<text>:1:28: error: \"inf\" is not a finite number"),
    ("void plastic p 0 0 5 .5 .5 1e999 0 0", "<text>:1:28: error: \"1e999\" is not a finite number"),
    (
        "void plastic p 0 0 5 .5 .5 abc 0 0",
        "<text>:1:28: error: expected a number of plastic \"p\", found \"abc\"",
    ),
    ("void plastic p 0 0 4 .5 .5 .5 0", "<text>:1:20: error: plastic \"p\" takes 5 numbers, not 4"),
    ("void glass p 0 0 5 .5 .5 .5 1 1", "<text>:1:18: error: glass \"p\" takes 3 or 4 numbers, not 5"),
    ("void light l 0 0 4 1 1 1 0", "<text>:1:18: error: light \"l\" takes 3 numbers, not 4"),
    (
        "void plastic p 0 0 5 -.5 .5 .5 0 0",
        "<text>:1:22: error: reflectance of plastic \"p\" must not be negative, not -0.5",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 1.5 0",
        "<text>:1:31: error: share of plastic \"p\" must be between 0 and 1, not 1.5",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 .5 -1",
        "<text>:1:34: error: roughness of plastic \"p\" must not be negative, not -1",
    ),
    (
        "void glass p 0 0 3 .5 .5 1.5",
        "<text>:1:26: error: transmissivity of glass \"p\" must be between 0 and 1, not 1.5",
    ),
    (
        "void glass p 0 0 4 .5 .5 .5 0",
        "<text>:1:29: error: index of refraction of glass \"p\" must be positive, not 0",
    ),
    (
        "void dielectric p 0 0 5 1 1 1 -1 0",
        "<text>:1:31: error: index of refraction of dielectric \"p\" must be positive, not -1",
    ),
    ("void light l 0 0 3 -1 1 1", "<text>:1:20: error: radiance of light \"l\" must not be negative, not -1"),
    (
        "void spotlight l 0 0 7 1 1 1 0 0 0 1",
        "<text>:1:30: error: cone angle of spotlight \"l\" must be in (0, 360] degrees, not 0",
    ),
    ("void spotlight l 0 0 7 1 1 1 30 0 0 0", "<text>:1:33: error: spotlight \"l\" has no direction"),
    (
        "void plastc p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 4 0 0 0 1",
        "<text>:1:6: error: unknown type \"plastc\"",
    ),
    (
        "plstic plastic p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 4 0 0 0 1",
        "<text>:1:1: error: modifier \"plstic\" is not defined",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\nq sphere s 0 0 4 0 0 0 1\nq sphere s 0 0 4 0 0 0 1",
        "<text>:2:1: error: modifier \"q\" is not defined",
    ),
    (
        "p sphere s 0 0 4 0 0 0 1\nvoid plastic p 0 0 5 .5 .5 .5 0 0\n",
        "<text>:1:1: error: modifier \"p\" is not defined",
    ),
    ("void instance i 1 a.oct 0 0", "<text>:1:6: error: surface \"instance\" is not supported"),
    ("void mesh i 1 a.rtm 0 0", "<text>:1:6: error: surface \"mesh\" is not supported"),
    ("void antimatter a 1 p 0 0", "<text>:1:6: error: material \"antimatter\" is not supported"),
    (
        "void colorpict c 5 r g b x.hdr . 0 0\nc plastic p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 4 0 0 0 1",
        "<text>:1:6: error: pattern or texture \"colorpict\" is not supported",
    ),
    ("void BSDF b 6 0 a.xml 0 0 1 . 0 0", "<text>:1:6: error: material \"BSDF\" is not supported"),
    ("void mist m 0 0 0", "<text>:1:6: error: material \"mist\" is not supported"),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np plastic q 0 0 5 .5 .5 .5 0 0",
        "<text>:2:3: error: plastic \"p\" cannot modify plastic \"q\"",
    ),
    ("void alias a b", "<text>:1:14: error: modifier \"b\" is not defined"),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\nvoid mixfunc m 4 p q .5 . 0 0",
        "<text>:2:20: error: modifier \"q\" is not defined",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\nvoid mixfunc m 4 p void u . 0 0",
        "<text>:2:25: error: mixture by \"u\" is not supported: only by a constant",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\nvoid mixfunc m 3 p void u 0 0",
        "<text>:2:6: error: mixfunc \"m\" takes 4 strings, not 3",
    ),
    (
        "void brightfunc b 2 f f.cal 0 0",
        "<text>:1:6: error: pattern \"brightfunc\" of \"f\" is not supported: only the skies of gensky and gendaylit",
    ),
    (
        "void brightfunc skyfunc 2 skybr skybright.cal 0 3 1 2 3",
        "<text>:1:49: error: the sky \"skyfunc\" has too few numbers, or no known kind",
    ),
    ("void illum i 1 x 0 3 1 1 1", "<text>:1:16: error: modifier \"x\" is not defined"),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 4 0 0 0 0",
        "<text>:2:24: error: radius of sphere \"s\" must be positive, not 0",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np bubble s 0 0 4 0 0 0 -1",
        "<text>:2:24: error: radius of bubble \"s\" must be positive, not -1",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 3 0 0 0",
        "<text>:2:16: error: sphere \"s\" takes 4 numbers, not 3",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np cylinder c 0 0 7 0 0 0 0 0 1 0",
        "<text>:2:32: error: radius of cylinder \"c\" must be positive, not 0",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np tube c 0 0 7 0 0 0 0 0 0 1",
        "<text>:2:22: error: both ends of tube \"c\" are the same point",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np cone c 0 0 8 0 0 0 0 0 1 0 0",
        "<text>:2:30: error: both radii of cone \"c\" are 0",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np cup c 0 0 8 0 0 0 0 0 1 -1 1",
        "<text>:2:27: error: radius of cup \"c\" must not be negative, not -1",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np ring r 0 0 8 0 0 0 0 0 0 1 2",
        "<text>:2:22: error: ring \"r\" has no normal",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np ring r 0 0 8 0 0 0 0 0 1 2 2",
        "<text>:2:30: error: both radii of ring \"r\" are 2",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np polygon q 0 0 6 0 0 0 1 0 0",
        "<text>:2:17: error: polygon \"q\" takes at least 9 numbers, not 6",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np polygon q 0 0 10 0 0 0 1 0 0 1 1 0 1",
        "<text>:2:17: error: polygon \"q\" takes three numbers per vertex: 10 is no multiple of 3",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np polygon q 0 0 9 0 0 0 1 0 0 1e300 1 0",
        "<text>:2:3: error: polygon \"q\" is not finite in single precision",
    ),
    (
        "void plastic p 0 0 5 .5 .5 .5 0 0\np sphere s 0 0 4 0 0 0 1e39",
        "<text>:2:3: error: sphere \"s\" is not finite in single precision",
    ),
    (
        "void light l 0 0 3 1 1 1\nl source s 0 0 4 0 0 0 1",
        "<text>:2:18: error: source \"s\" has no direction",
    ),
    (
        "void light l 0 0 3 1 1 1\nl source s 0 0 4 0 0 1 0",
        "<text>:2:24: error: angle of source \"s\" must be in (0, 360] degrees, not 0",
    ),
    (
        "void light l 0 0 3 1 1 1\nl source s 0 0 4 0 0 1 361",
        "<text>:2:24: error: angle of source \"s\" must be in (0, 360] degrees, not 361",
    ),
    (
        "void light l 0 0 3 1e39 1 1\nl sphere s 0 0 4 0 0 0 1",
        "<text>:2:3: error: the emission is not finite in single precision",
    ),
    ("!touch x", "<text>:1:2: error: command \"touch\" is refused: nothing is ever executed"),
    ("!/bin/rm -rf /", "<text>:1:2: error: command \"/bin/rm\" is refused: nothing is ever executed"),
    ("!xfrom -t 1 0 0 a.rad", "<text>:1:2: error: command \"xfrom\" is refused: nothing is ever executed"),
    ("!genbox m n 1 1 1 > x.rad", "<text>:1:19: error: \">\" in a command is not supported"),
    ("!genbox m n 1 1 1; touch x", "<text>:1:18: error: \";\" in a command is not supported"),
    ("!genbox m n $(touch x) 1 1", "<text>:1:13: error: \"$\" in a command is not supported"),
    ("!genbox m n `touch x` 1 1", "<text>:1:13: error: \"`\" in a command is not supported"),
    (
        "!genbox m n 1 1 1 | touch x",
        "<text>:1:21: error: command \"touch\" is refused: nothing is ever executed",
    ),
    ("!", "<text>:1:1: error: an empty command"),
    ("!genbox m n 'x 1 1", "<text>:1:13: error: a quoted word of the command has no end"),
    ("!cat ghost.rad", "<text>:1:6: error: ./ghost.rad: no such file"),
    (
        "!xform -t 1 2 ghost.rad",
        "<text>:1:15: error: option -t of xform: \"ghost.rad\" is not a finite number",
    ),
    ("!xform", "<text>:1:2: error: xform has no file"),
    ("!xform -q ghost.rad", "<text>:1:8: error: unknown option \"-q\" of xform"),
    ("!xform -rz nan ghost.rad", "<text>:1:12: error: option -rz of xform: \"nan\" is not a finite number"),
    ("!xform -s 0 ghost.rad", "<text>:1:11: error: option -s of xform: the scale must not be 0"),
    ("!xform -a 1e9 ghost.rad", "<text>:1:11: error: option -a of xform: \"1e9\" is not a count"),
    (
        "!xform -a 2000 -t 1 0 0 -a 2000 -t 0 1 0 ghost.rad",
        "<text>:1:25: error: xform -a makes more than 1000000 copies",
    ),
    ("!xform -n", "<text>:1:8: error: option -n of xform lacks a name"),
    ("!genbox m n 1 1 1 | gensky 6 21 12", "<text>:1:21: error: gensky takes nothing from a pipe"),
    ("!genbox m n 1 1", "<text>:1:15: error: genbox lacks a size"),
    ("!genbox m n 1 1 -1", "<text>:1:17: error: a size of genbox must be positive, not -1"),
    ("!genbox m n 1 1 x", "<text>:1:17: error: a size of genbox: \"x\" is not a finite number"),
    ("!genbox m n 1 1 1 -q", "<text>:1:19: error: unknown option \"-q\" of genbox"),
    ("!genbox m n 1 1 1 -r .5", "<text>:1:22: error: genbox: the rounding is larger than the box"),
    ("!genbox m n 1 1 1", "!genbox:1:1: error: modifier \"m\" is not defined"),
    ("!genprism m n 2 0 0 1 1", "<text>:1:15: error: genprism takes between 3 and 100000 vertices, not 2"),
    ("!genprism m n 3 0 0 1 0 1 1 -l 0 0 0", "<text>:1:36: error: genprism: the prism has no height"),
    ("!genprism m n 3 0 0 1 0", "<text>:1:23: error: genprism lacks a coordinate"),
    ("!gensurf m n s t u 1 1", "<text>:1:18: error: gensurf: \"u\" is not defined"),
    (
        "!gensurf m n s t s*t 0 1",
        "<text>:1:22: error: the first count of gensurf must be between 1 and 65536, not 0",
    ),
    ("!gensurf m n s t 's*(t' 1 1", "<text>:1:18: error: gensurf: a parenthesis that is not closed"),
    ("!gensurf m n s t 1/s 1 1", "<text>:1:18: error: gensurf: a value that is not finite"),
    ("!gensurf m n s t s 60000 60000", "<text>:1:2: error: gensurf makes more than the memory limit"),
    ("!genrev m n t -1 4", "<text>:1:15: error: genrev: a negative radius"),
    ("!genrev m n t 1", "<text>:1:15: error: genrev lacks the number of segments"),
    ("!genworm m n t 0 0 0 4", "<text>:1:20: error: genworm: the radius must be positive"),
    ("!gensky 13 1 12", "<text>:1:9: error: the month of gensky must be between 1 and 12, not 13"),
    ("!gensky 6 21 noon", "<text>:1:14: error: gensky: \"noon\" is not a time"),
    ("!gensky 6 21 12XYZ", "<text>:1:14: error: gensky: unknown time zone \"XYZ\""),
    ("!gensky -ang 40", "<text>:1:14: error: gensky lacks an azimuth"),
    ("!gensky -ang 40 30 -q", "<text>:1:20: error: unknown option \"-q\" of gensky"),
    ("!gendaylit -ang 40 30", "<text>:1:2: error: gendaylit lacks the sky: -W, -G, -L, -P or -E"),
    ("!gendaylit -ang 40 30 -W 100", "<text>:1:26: error: gendaylit lacks a value"),
    (
        "!gendaylit -ang 40 30 -W -100 100",
        "<text>:1:26: error: a value of gendaylit must not be negative, not -100",
    ),
];

#[test]
fn broken_texts_earn_their_line() {
    for (text, expected) in TEXTS {
        assert_eq!(text_errors(text, None), [*expected], "for: {text:.200}");
    }
}

const GOOD: &str = "void light l 0 0 3 1 1 1\nl sphere s 0 0 4 0 0 0 1\n";

/// Broken views.
const VIEWS: &[(&str, &str)] = &[
    ("", "<view>: error: empty file"),
    ("hello", "<view>: error: no view: no line begins with rvu or VIEW="),
    ("rvu -vtv -vp 0 0", "<view>:1:10: error: view option -vp takes 3 numbers, not 2"),
    ("rvu -vh", "<view>:1:5: error: view option -vh takes 1 number, not 0"),
    ("rvu -vp 0 nan 0", "<view>:1:11: error: view option -vp: \"nan\" is not a finite number"),
    ("rvu -vp 0 0 -vd 0 1 0", "<view>:1:13: error: view option -vp: \"-vd\" is not a finite number"),
    ("\nVIEW= -vtx -vp 0 0 0", "<view>:2:7: error: unknown view option \"-vtx\""),
    ("rvu -vd 0 0 0", "<view>:1:5: error: view option -vd: the direction is zero"),
    (
        "rvu -vd 0 0 1 -vu 0 0 2",
        "<view>:1:5: error: view options -vd and -vu: up must not be in line with the direction",
    ),
    ("rvu -vtv -vh 180", "<view>:1:5: error: view option -vh: a size of 180 is out of range"),
    ("rvu -vth -vv 181", "<view>:1:5: error: view option -vv: a size of 181 is out of range"),
    ("rvu -vta -vh 0", "<view>:1:5: error: view option -vh: a size of 0 is out of range"),
    ("rvu -vo -1", "<view>:1:5: error: view options -vp and -vo: out of range"),
    ("rvu -vf other.vf", "<view>:1:5: error: option -vf within a view is not supported"),
];

#[test]
fn broken_views_earn_their_line() {
    for (text, expected) in VIEWS {
        assert_eq!(text_errors(GOOD, Some(text)), [*expected], "for: {text}");
    }
}

/// An octree of a header, a format number, four strings and file names.
fn octree(names: &[&str]) -> Vec<u8> {
    let mut bytes = b"#?RADIANCE\noconv x.rad\nFORMAT=Radiance_octree\n\n\x01\x1f".to_vec();
    for text in ["-1", "-1", "-1", "2"].iter().chain(names).chain(&[""]) {
        bytes.extend(text.bytes());
        bytes.push(0);
    }
    bytes
}

#[test]
fn broken_files_earn_their_line() {
    let dir = Scratch::new("rad-broken");
    dir.write("self.rad", "!xform -t 1 0 0 self.rad");
    dir.write("a.rad", format!("{GOOD}!xform b.rad"));
    dir.write("b.rad", "\n!cat a.rad");
    dir.write("bad.rad", format!("{GOOD}!xform -rz 3 part.rad"));
    dir.write("part.rad", "void plastic p 0 0 5\n1 1 x 0 0");
    dir.write("data.rad", "void plastic m 0 0 5 1 1 1 0 0\n!gensurf m n d.txt d.txt d.txt 2 2");
    dir.write("d.txt", "1 2 3");
    dir.write("frozen.oct", octree(&[]));
    dir.write("cut.oct", &octree(&["x.rad"])[..60]);
    dir.write("strange.oct", "#?RADIANCE\nFORMAT=other\n\n");
    dir.write("good.oct", octree(&["good.rad"]));
    dir.write("ghost.oct", octree(&["ghost.rad"]));
    dir.write("good.rad", GOOD);
    dir.write("scene.pbrt", "WorldBegin Shape \"sphere\"");
    dir.write("notes.txt", "this is no scene");
    for i in 0..60 {
        dir.write(&format!("deep{i}.rad"), format!("!xform deep{}.rad", i + 1));
    }
    dir.write("power.rad", format!("!xform -a 1000 -t 1 0 0 {0} {0}", "power1.rad"));
    dir.write("power1.rad", "!xform -a 1000 -t 0 1 0 power2.rad");
    dir.write("power2.rad", "!xform -a 1000 -t 0 0 1 good.rad");
    let root = dir.0.display().to_string();
    let cases: &[(&[&str], &str)] = &[
        (&["self.rad"], "@/self.rad:1:1: error: @/self.rad includes itself"),
        (&["a.rad"], "@/b.rad:2:1: error: @/a.rad includes itself"),
        (&["bad.rad"], "@/part.rad:2:5: error: expected a number of plastic \"p\", found \"x\""),
        (&["data.rad"], "@/data.rad:2:14: error: d.txt: expected 9 numbers, found 3"),
        (&["deep0.rad"], "@/deep48.rad:1:1: error: files and commands nested deeper than 48"),
        (&["power.rad"], "@/power2.rad:1:1: error: the commands make more than the memory limit"),
        (
            &["frozen.oct"],
            "@/frozen.oct: error: a frozen octree is not supported: give the scene files it was made of",
        ),
        (&["cut.oct"], "@/cut.oct: error: truncated octree"),
        (&["strange.oct"], "@/strange.oct: error: not an octree: no FORMAT=Radiance_octree"),
        (&["ghost.oct"], "@/ghost.oct: error: @/ghost.rad: no such file"),
        (&["good.rad", "scene.pbrt"], "@/good.rad: error: pbrt and Radiance files do not make one scene"),
        (
            &["notes.txt"],
            "@/notes.txt: error: unknown kind of file: scenes are .pbrt, .rad, .oct, with views in .vf",
        ),
        (&["ghost.rad"], "@/ghost.rad: error: no such file"),
    ];
    for (names, expected) in cases {
        let paths: Vec<PathBuf> = names.iter().map(|n| dir.0.join(n)).collect();
        // So little memory that copies of copies are soon too many.
        let few = LoadOptions { memory_limit: Some(1 << 26), ..options() };
        let got = match load(&paths, &few) {
            Ok(_) => vec!["it loaded".to_owned()],
            Err(e) => lines(&e),
        };
        assert_eq!(got, [expected.replace('@', &root)], "{names:?}");
    }
    assert!(load(&[dir.0.join("good.oct")], &options()).is_ok());
}

/// No command runs: not by name, not by path, not in a substitution, not behind a pipe; lenient or not.
#[test]
fn nothing_is_executed() {
    let dir = Scratch::new("rad-run");
    let target = dir.0.join("touched");
    let t = target.display();
    let attempts = [
        format!("!touch {t}"),
        format!("!/usr/bin/touch {t}"),
        format!("!genbox m n 1 1 1; touch {t}"),
        format!("!genbox m `touch {t}` 1 1 1"),
        format!("!genbox m $(touch {t}) 1 1 1"),
        format!("!genbox m n 1 1 1 | touch {t}"),
        format!("!genbox m n 1 1 1 > {t}"),
        format!("!xform -e -n '; touch {t}' touch {t}"),
        format!("!gensurf m n 'system(\"touch {t}\")' t s 1 1"),
    ];
    for (i, text) in attempts.iter().enumerate() {
        for lenient in [false, true] {
            let file = dir.write(&format!("{i}.rad"), format!("{GOOD}{text}\n"));
            let _ = load(&[file], &LoadOptions { lenient, ..options() });
            assert!(!target.exists(), "{text}");
        }
    }
    let text = format!("{GOOD}!touch {t}\n");
    let loaded = load_radiance_str(&text, None, &dir.0, &LoadOptions { lenient: true, ..options() }).unwrap();
    let warned =
        loaded.diagnostics.iter().any(|d| d.severity == Severity::Warning && d.message.contains("touch"));
    assert!(warned && !target.exists());
}

/// What lenient loading leaves out: unknown types, patterns, what they modify stays.
#[test]
fn lenient_leaves_out_what_is_unknown() {
    let text = "void colorpict c 7 red green blue x.hdr . u v 0 0\nc plastic p 0 0 5 .5 .5 .5 0 0\n\
                p sphere s 0 0 4 0 0 0 1\nvoid frobnicate f 1 a 0 2 1 2\nf sphere t 0 0 4 3 0 0 1\n\
                void light l 0 0 3 1 1 1\nl sphere u 0 0 4 0 0 5 1\nvoid mesh m 1 a.rtm 0 0\n";
    assert_eq!(
        text_errors(text, None),
        [
            "<text>:1:6: error: pattern or texture \"colorpict\" is not supported",
            "<text>:4:6: error: unknown type \"frobnicate\"",
            "<text>:8:6: error: surface \"mesh\" is not supported",
        ]
    );
    let options = LoadOptions { lenient: true, ..options() };
    let scene = load_radiance_str(text, None, Path::new("."), &options).unwrap().scene;
    assert_eq!(scene.shapes.len(), 2);
}

/// Every prefix of a scene that uses everything ends in a scene or in messages; in little time.
#[test]
fn truncations_end() {
    let text = "void plastic p 0 0 5 .5 .4 .3 .1 .2\np polygon q 0 0 12 0 0 0 1 0 0 1 1 0 0 1 0\n\
                !genbox p b 1 1 1 | xform -t 1 2 3 -a 3 -rz 20\ninherit alias x p\n\
                x cone c 0 0 8 0 0 0 0 0 1 1 .5\n!genrev p r 'sin(t)+1' 't^2' 4\n!gensky -ang 40 30 +s\n\
                skyfunc glow g 0 0 4 1 1 1 0\ng source s 0 0 4 0 0 1 180\n# end";
    assert!(load_radiance_str(text, None, Path::new("."), &options()).is_ok());
    for end in (0..text.len()).filter(|i| text.is_char_boundary(*i)) {
        if let Err(e) = load_radiance_str(&text[..end], None, Path::new("."), &options()) {
            assert!(!lines(&e).is_empty());
        }
    }
}
