//! A directory of its own for each test, with a small room in it.
#![allow(dead_code)] // each test binary uses its own part

use hemilux_image::Image;
use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

/// A room of 2 m with a red wall on the left, a green one on the right, and a lamp.
pub const ROOM: &str = r#"Scale -1 1 1
LookAt 0 -3.5 1  0 0 1  0 0 1
Camera "perspective" "float fov" [ 40 ]
Film "rgb" "integer xresolution" 40 "integer yresolution" 30 "string filename" "somewhere/room-film.tiff"
PixelFilter "box"
WorldBegin
Material "diffuse" "rgb reflectance" [ 0.7 0.7 0.7 ]
Shape "trianglemesh" "point3 P" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0  -1 -1 2  1 -1 2  1 1 2  -1 1 2 ]
  "integer indices" [ 0 1 2 0 2 3  4 6 5 4 7 6  3 2 6 3 6 7 ]
Material "diffuse" "rgb reflectance" [ 0.7 0.1 0.1 ]
Shape "trianglemesh" "point3 P" [ -1 -1 0  -1 1 0  -1 1 2  -1 -1 2 ] "integer indices" [ 0 1 2 0 2 3 ]
Shape "trianglemesh" "point3 P" [ -0.1 0.9 0.1  0.1 0.9 0.1  0.1 0.9 0.3  -0.1 0.9 0.3 ] "integer indices" [ 0 1 2 0 2 3 ]
Material "diffuse" "rgb reflectance" [ 0.1 0.7 0.1 ]
Shape "trianglemesh" "point3 P" [ 1 -1 0  1 -1 2  1 1 2  1 1 0 ] "integer indices" [ 0 1 2 0 2 3 ]
AttributeBegin
  Translate 0 0 1.6
  AreaLightSource "diffuse" "rgb L" [ 20 20 20 ]
  Shape "sphere" "float radius" 0.15
AttributeEnd
"#;

/// A directory that goes away with its owner.
pub struct Bench {
    pub dir: PathBuf,
}

/// How a command ended.
pub struct Run {
    pub code: i32,
    pub out: String,
    pub err: String,
}

static NUMBER: AtomicU32 = AtomicU32::new(0);

impl Bench {
    /// With `room.pbrt` in it.
    pub fn new() -> Bench {
        let name = format!("hemilux-cli-{}-{}", std::process::id(), NUMBER.fetch_add(1, Ordering::Relaxed));
        let dir = std::env::temp_dir().join(name);
        std::fs::create_dir(&dir).unwrap();
        let bench = Bench { dir };
        bench.write("room.pbrt", ROOM);
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    pub fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub fn files(&self) -> Vec<String> {
        let list = std::fs::read_dir(&self.dir).unwrap();
        list.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect()
    }

    /// A grey picture.
    pub fn flat(&self, name: &str, width: usize, height: usize, value: f32) {
        let image = Image::from_rgb(width, height, &vec![[value; 3]; width * height]);
        hemilux_image::write(self.path(name), &image).unwrap();
    }

    pub fn image(&self, name: &str) -> Image {
        hemilux_image::read(self.path(name)).unwrap()
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_hemilux"));
        command.args(args).current_dir(&self.dir);
        // Small scenes want small solutions, unless the test is about them.
        let solves = args.first() == Some(&"render") && args.iter().any(|a| a.ends_with(".pbrt"));
        let own = args.iter().any(|a| matches!(*a, "--zones" | "--particles" | "--zone-budget" | "-"));
        if solves && !own {
            command.args(["--zone-budget", "500", "--particles", "20k"]);
        }
        command
    }

    pub fn run(&self, args: &[&str]) -> Run {
        let out = self.command(args).output().unwrap();
        Run { code: out.status.code().unwrap_or(-1), out: text(&out.stdout), err: text(&out.stderr) }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.dir);
    }
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Red, green and blue of every pixel.
pub fn pixels(image: &Image) -> Vec<[f32; 3]> {
    let [r, g, b] = image.rgb().unwrap();
    (0..image.len()).map(|i| [r[i], g[i], b[i]]).collect()
}
