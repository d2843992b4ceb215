//! What `gensky` and `gendaylit` write, as scene text: a sun, and the pattern that the sky's glow has.

use super::Reader;
use super::generate::{Arguments, Made};
use super::sun::{self, CieRequest, Daylight, Level, PerezRequest, Site};
use super::transform::Wrong;
use crate::geom::DVec3;
use std::fmt::Write;

/// Month, day and hour, or angles.
struct When {
    /// Altitude and azimuth, if given.
    angles: Option<(f64, f64)>,
    day: f64,
    hour: f64,
    solar: bool,
    site: Site,
    zoned: bool,
}

/// Standard meridians, degrees west, of the zones that gensky knows.
const ZONES: &[(&str, f64)] = &[
    ("YST", 135.0),
    ("YDT", 120.0),
    ("PST", 120.0),
    ("PDT", 105.0),
    ("MST", 105.0),
    ("MDT", 90.0),
    ("CST", 90.0),
    ("CDT", 75.0),
    ("EST", 75.0),
    ("EDT", 60.0),
    ("AST", 60.0),
    ("ADT", 45.0),
    ("NST", 52.5),
    ("NDT", 37.5),
    ("GMT", 0.0),
    ("BST", -15.0),
    ("CET", -15.0),
    ("CEST", -30.0),
    ("EET", -30.0),
    ("EEST", -45.0),
    ("GST", -60.0),
    ("GDT", -75.0),
    ("IST", -82.5),
    ("IDT", -97.5),
    ("JST", -135.0),
    ("NZST", -180.0),
    ("NZDT", -195.0),
];

impl When {
    fn read(a: &mut Arguments) -> Result<When, Wrong> {
        let mut when =
            When { angles: None, day: 0.0, hour: 12.0, solar: false, site: Site::default(), zoned: false };
        if a.peek().is_some_and(|p| p.text == "-ang") {
            a.at += 1;
            when.angles = Some((a.number("an altitude")?.to_radians(), a.number("an azimuth")?.to_radians()));
            return Ok(when);
        }
        let month = a.count("the month", 1, 12)? as u32;
        let day = a.count("the day", 1, 31)? as u32;
        when.day = sun::day_of_year(month, day);
        let text = a.next("the hour")?.text.as_str();
        let bare = text.strip_prefix('+');
        when.solar = bare.is_some();
        let bare = bare.unwrap_or(text);
        let digits = bare.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == ':')).unwrap_or(bare.len());
        let (time, zone) = bare.split_at(digits);
        let hour = match time.split_once(':') {
            Some((h, m)) => h.parse::<f64>().ok().zip(m.parse::<f64>().ok()).map(|(h, m)| h + m / 60.0),
            None => time.parse::<f64>().ok(),
        };
        match hour.filter(|h| (0.0..=24.0).contains(h)) {
            Some(h) => when.hour = h,
            None => return a.fail(a.at - 1, format!("{}: \"{text}\" is not a time", a.program)),
        }
        if !zone.is_empty() {
            let upper = zone.to_ascii_uppercase();
            match ZONES.iter().find(|z| z.0 == upper) {
                Some(z) if !when.solar => (when.site.meridian, when.zoned) = (z.1, true),
                _ => return a.fail(a.at - 1, format!("{}: unknown time zone \"{zone}\"", a.program)),
            }
        }
        Ok(when)
    }

    /// Options -a -o -m -y; whether it was one of them.
    fn option(&mut self, reader: &Reader, option: &str, a: &mut Arguments) -> Result<bool, Wrong> {
        match option {
            "-a" => self.site.latitude = a.number("a latitude")?,
            "-o" => self.site.longitude = a.number("a longitude")?,
            "-m" => {
                let meridian = a.number("a meridian")?;
                if !self.zoned {
                    self.site.meridian = meridian;
                }
            }
            "-y" => {
                a.number("a year")?;
                let message = format!("{}: option -y is ignored: the sun is that of a mean year", a.program);
                reader.env.log.warning(a.all[a.at - 1].span, message);
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Altitude and azimuth, the altitude reduced to 87° for skies that depend on it.
    fn angles(&self, reader: &Reader, a: &Arguments, clear: bool) -> (f64, f64) {
        let (altitude, azimuth) =
            self.angles.unwrap_or_else(|| sun::position(&self.site, self.day, self.hour, self.solar));
        let most = 87f64.to_radians();
        if clear && altitude > most {
            let message =
                format!("{}: the sun is too close to the zenith: at an altitude of 87 degrees", a.program);
            reader.env.log.warning(a.all[0].span, message);
            return (most, azimuth);
        }
        (altitude, azimuth)
    }
}

fn solar_disk(out: &mut String, radiance: f64, d: DVec3, degrees: f64) {
    let _ = writeln!(out, "void light solar 0 0 3 {radiance} {radiance} {radiance}");
    let _ = writeln!(out, "solar source sun 0 0 4 {} {} {} {degrees}", d.x, d.y, d.z);
}

/// A CIE sky, and its sun.
pub fn gensky(reader: &mut Reader, a: &mut Arguments) -> Made {
    let mut when = When::read(a)?;
    let (mut kind, mut with_sun) = (1u8, true);
    let (mut zenith, mut solar, mut turbidity, mut reflectance) = (Level::Model, Level::Model, 2.45, 0.2);
    while let Some(option) = a.option()? {
        match option {
            "+s" | "-s" => (kind, with_sun) = (1, option == "+s"),
            "+i" | "-i" => (kind, with_sun) = (4, option == "+i"),
            "-c" | "+c" => kind = 2,
            "-u" | "+u" => kind = 3,
            "-b" => zenith = Level::Radiance(not_negative(a, "a zenith radiance")?),
            "-B" => zenith = Level::Irradiance(not_negative(a, "an irradiance")?),
            "-r" => solar = Level::Radiance(not_negative(a, "a solar radiance")?),
            "-R" => solar = Level::Irradiance(not_negative(a, "an irradiance")?),
            "-t" => turbidity = a.positive("a turbidity")?,
            "-g" => reflectance = not_negative(a, "a reflectance")?,
            _ if when.option(reader, option, a)? => {}
            _ => return a.unknown(),
        }
    }
    let (altitude, azimuth) = when.angles(reader, a, matches!(kind, 1 | 4));
    let request = CieRequest { kind, altitude, zenith, solar, turbidity, ground: reflectance };
    let answer = sun::cie(&request);
    let d = sun::direction(altitude, azimuth);
    let mut out = String::new();
    if with_sun && answer.sun > 0.0 {
        solar_disk(&mut out, answer.sun, d, 0.5);
    }
    let (z, g) = (answer.zenith, answer.ground);
    if matches!(kind, 2 | 3) {
        let _ = writeln!(out, "void brightfunc skyfunc 2 skybr skybright.cal 0 3 {kind} {z} {g}");
    } else {
        let f = answer.normalisation;
        let _ = writeln!(
            out,
            "void brightfunc skyfunc 2 skybr skybright.cal 0 7 {kind} {z} {g} {f} {} {} {}",
            d.x, d.y, d.z
        );
    }
    checked(a, out)
}

fn not_negative(a: &mut Arguments, what: &str) -> Result<f64, Wrong> {
    let v = a.number(what)?;
    if v >= 0.0 {
        return Ok(v);
    }
    a.fail(a.at - 1, format!("{what} of {} must not be negative, not {v}", a.program))
}

/// What was computed must be finite.
fn checked(a: &Arguments, out: String) -> Made {
    if out.split_whitespace().any(|w| matches!(w, "NaN" | "inf" | "-inf")) {
        return a.fail(0, format!("{}: the sky is not finite", a.program));
    }
    Ok(out)
}

/// A Perez sky, and its sun.
pub fn gendaylit(reader: &mut Reader, a: &mut Arguments) -> Made {
    let mut when = When::read(a)?;
    let mut given = None;
    let (mut output, mut reflectance, mut with_sun) = (0u8, 0.2, true);
    while let Some(option) = a.option()? {
        let two =
            |a: &mut Arguments| Ok::<_, Wrong>((not_negative(a, "a value")?, not_negative(a, "a value")?));
        match option {
            "-P" => given = Some(two(a).map(|v| Daylight::Parameters(v.0, v.1))?),
            "-W" => given = Some(two(a).map(|v| Daylight::Irradiance(v.0, v.1))?),
            "-G" => given = Some(two(a).map(|v| Daylight::Horizontal(v.0, v.1))?),
            "-L" => given = Some(two(a).map(|v| Daylight::Illuminance(v.0, v.1))?),
            "-E" => given = Some(Daylight::Global(not_negative(a, "an irradiance")?)),
            "-O" => output = a.count("the output", 0, 2)? as u8,
            "-g" => reflectance = not_negative(a, "a reflectance")?,
            "+s" | "-s" => with_sun = option == "+s",
            "-w" => {}
            _ if when.option(reader, option, a)? => {}
            _ => return a.unknown(),
        }
    }
    let Some(given) = given else {
        return a.fail(0, "gendaylit lacks the sky: -W, -G, -L, -P or -E");
    };
    let (altitude, azimuth) = when.angles(reader, a, true);
    let answer = sun::daylight(&PerezRequest {
        altitude,
        day: when.day,
        given,
        output,
        ground: reflectance,
        with_sun,
    });
    let d = sun::direction(altitude, azimuth);
    let mut out = String::new();
    if with_sun {
        solar_disk(&mut out, answer.sun, d, sun::SUN_DISK);
    }
    let _ = write!(
        out,
        "void brightfunc skyfunc 2 skybright perezlum.cal 0 10 {} {}",
        answer.diffuse, answer.ground
    );
    for v in answer.c.iter().chain(&d.to_array()) {
        let _ = write!(out, " {v}");
    }
    out.push('\n');
    checked(a, out)
}
