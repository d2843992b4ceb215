//! `hemilux rtrace`: enough of Radiance's rtrace for a script to run unchanged.
//!
//! Rays are read from standard input (`ox oy oz dx dy dz`, ASCII), three radiometric values a line are written. `-I`
//! takes points and normals and gives irradiance. Options that steer Radiance's sampling are taken and not needed; what
//! would change the meaning of the output and is not supported is refused.

use crate::failure::{Failure, Kind};
use crate::load;
use crate::render::{command_line, set_threads};
use crate::talk::{self, Talk};
use hemilux::sense::{Goal, Receiver, Sense, SenseOptions};
use hemilux::world::World;
use hemilux_scene::geom::{DVec3, Vec3};
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::time::Duration;

/// What rtrace's words mean here.
#[derive(Debug, Default, PartialEq)]
struct Meaning {
    irradiance: bool,
    header: bool,
    threads: Option<u16>,
    scenes: Vec<PathBuf>,
    /// Options that were taken and are not needed.
    unneeded: Vec<String>,
}

/// Options without effect here, and how many values follow each.
const UNNEEDED: [(&str, usize); 36] = [
    ("-ab", 1),
    ("-ad", 1),
    ("-as", 1),
    ("-aa", 1),
    ("-ar", 1),
    ("-aw", 1),
    ("-af", 1),
    ("-av", 3),
    ("-ae", 1),
    ("-aE", 1),
    ("-ai", 1),
    ("-aI", 1),
    ("-dc", 1),
    ("-dj", 1),
    ("-dp", 1),
    ("-dr", 1),
    ("-ds", 1),
    ("-dt", 1),
    ("-lr", 1),
    ("-lw", 1),
    ("-ss", 1),
    ("-st", 1),
    ("-ms", 1),
    ("-me", 3),
    ("-ma", 3),
    ("-mg", 1),
    ("-pj", 1),
    ("-pt", 1),
    ("-ps", 1),
    ("-pa", 1),
    ("-t", 1),
    ("-e", 1),
    ("-x", 1),
    ("-y", 1),
    ("-P", 1),
    ("-PP", 1),
];

fn understand(words: &[String]) -> Result<Meaning, Failure> {
    let mut m = Meaning { header: true, ..Meaning::default() };
    let mut at = 0;
    let value =
        |at: usize| words.get(at).cloned().ok_or_else(|| Failure::usage("rtrace: an option lacks its value"));
    while at < words.len() {
        let word = words[at].as_str();
        at += 1;
        if let Some((name, values)) = UNNEEDED.iter().find(|o| o.0 == word) {
            for _ in 0..*values {
                value(at)?;
                at += 1;
            }
            m.unneeded.push((*name).to_owned());
            continue;
        }
        match word {
            "-I" | "-I+" => m.irradiance = true,
            "-I-" => m.irradiance = false,
            "-h" | "-h-" => m.header = false,
            "-h+" => m.header = true,
            "-n" => {
                let n = value(at)?;
                at += 1;
                m.threads =
                    Some(n.parse().map_err(|_| Failure::usage(format!("rtrace: -n {n} is not a number")))?);
            }
            "-fa" | "-faa" | "-ov" | "-oV" => {}
            _ if matches!(word.trim_end_matches(['+', '-']), "-u" | "-w" | "-dv" | "-bv" | "-ld" | "-co") => {
                m.unneeded.push(word.to_owned());
            }
            _ if word.starts_with("-f") => {
                return Err(Failure::usage(format!(
                    "rtrace: {word}: only ASCII input and output (-faa) are supported"
                )));
            }
            _ if word.starts_with("-o") => {
                return Err(Failure::usage(format!("rtrace: {word}: only the value (-ov) is written")));
            }
            _ if word.starts_with('-') && word.len() > 1 => {
                return Err(Failure::usage(format!("rtrace: unknown option {word}")));
            }
            _ => m.scenes.push(PathBuf::from(word)),
        }
    }
    if m.scenes.is_empty() {
        return Err(Failure::usage("rtrace: no scene (.oct or .rad) given"));
    }
    Ok(m)
}

/// Read rays, write values.
pub fn run(words: &[String]) -> Result<(), Failure> {
    let meaning = understand(words)?;
    set_threads(meaning.threads)?;
    let talk = Talk::default();
    let scene = load::scene(&meaning.scenes, &[], false, &talk)?;
    if !meaning.unneeded.is_empty() {
        talk.warning(&format!(
            "not needed here: {}; every value is computed to 1 %",
            meaning.unneeded.join(" ")
        ));
    }
    let options = SenseOptions {
        receiver: if meaning.irradiance { Receiver::Irradiance } else { Receiver::Radiance },
        goal: Goal::RelativeError(0.01),
        limit: Duration::from_secs(30),
        seed: 0,
        weights: scene.photometry.weights,
    };
    let world = World::new(scene);
    let steering = crate::sense::steering(&world, options.seed);
    let sense = match &steering {
        Some(zones) => {
            talk::line(&format!(
                "note: mirrors or glass: gather rays are led by what {} light particles found (not by -ab, -ad, ...)",
                zones.particles
            ));
            Sense::corrected(&world, std::slice::from_ref(zones), options)
        }
        None => Sense::new(&world, &[], options),
    };
    if meaning.header {
        talk::data(&format!(
            "#?RADIANCE\n{}\nSOFTWARE= hemilux {}\nNCOMP=3\nFORMAT=ascii\n\n",
            command_line(),
            env!("CARGO_PKG_VERSION")
        ))?;
    }
    let (mut index, mut missed) = (0, 0u64);
    for (number, line) in io::stdin().lock().lines().enumerate() {
        let line = line.map_err(|e| Failure::input(format!("standard input: {e}")))?;
        let Some((p, d)) =
            ray(&line).map_err(|e| Failure::input(format!("line {} of the rays: {e}", number + 1)))?
        else {
            continue;
        };
        // A direction of no length flushes, in rtrace's habit.
        let Some(d) = d.try_normalize() else { continue };
        let r = sense.read(index, p, d.as_vec3());
        index += 1;
        missed += !r.met as u64;
        let [x, y, z] = r.value.0;
        let text = format!("{x:.6e}\t{y:.6e}\t{z:.6e}\t\n");
        let mut out = io::stdout().lock();
        out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(|e| Failure::stdout(&e))?;
    }
    match missed {
        0 => Ok(()),
        n => Err(Failure::new(
            Kind::Short,
            format!("{n} of {index} rays did not reach 1 % in 30 s; their values are printed"),
        )),
    }
}

/// Origin and direction of a line; `None` where it is blank.
fn ray(line: &str) -> Result<Option<(Vec3, DVec3)>, String> {
    let words: Vec<&str> = line.split_whitespace().collect();
    if words.is_empty() {
        return Ok(None);
    }
    if words.len() != 6 {
        return Err(format!("expected 6 numbers, found {}", words.len()));
    }
    let mut v = [0f64; 6];
    for (v, word) in v.iter_mut().zip(&words) {
        *v = word
            .parse()
            .ok()
            .filter(|x: &f64| x.is_finite())
            .ok_or_else(|| format!("{word:?} is not a number"))?;
    }
    Ok(Some((DVec3::new(v[0], v[1], v[2]).as_vec3(), DVec3::new(v[3], v[4], v[5]))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(text: &str) -> Vec<String> {
        text.split(' ').map(str::to_owned).collect()
    }

    #[test]
    fn a_usual_command_line_is_understood() {
        let m = understand(&words("-I -h -ab 5 -ad 4096 -av 0 0 0 -u+ -n 2 -faa room.oct")).ok();
        let m = m.expect("understood");
        assert!(m.irradiance && !m.header && m.threads == Some(2));
        assert_eq!(m.scenes, [PathBuf::from("room.oct")]);
        assert_eq!(m.unneeded, ["-ab", "-ad", "-av", "-u+"]);
    }

    #[test]
    fn what_would_change_the_output_is_refused() {
        for text in ["-I -fff a.oct", "-I -opv a.oct", "-I -ab", "-I", "-zz a.oct", "-n x a.oct"] {
            assert!(understand(&words(text)).is_err(), "{text}");
        }
    }
}
