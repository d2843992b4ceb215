//! The words of the command line that are more than a number or a name.

use hemilux::gather::Strategy;
use hemilux::strategies;
use hemilux_scene::geom::Vec3;
use std::str::FromStr;
use std::time::Duration;

/// A span of time: `30s`, `2m`, `1h30m`, `500ms`; a plain number is seconds. Positive, at most a year.
pub fn duration(text: &str) -> Result<Duration, String> {
    const UNITS: [(&str, f64); 5] = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0), ("d", 86400.0)];
    let bad = || format!("{text:?} is no span of time such as 30s, 2m, 1h30m or 500ms");
    let (mut rest, mut seconds) = (text.trim(), 0.0);
    if let Ok(plain) = rest.parse::<f64>() {
        seconds = plain;
        rest = "";
    }
    while !rest.is_empty() {
        let digits = rest.find(|c: char| !c.is_ascii_digit() && c != '.').ok_or_else(bad)?;
        let value: f64 = rest[..digits].parse().map_err(|_| bad())?;
        rest = &rest[digits..];
        let end = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let unit = UNITS.iter().find(|u| u.0 == &rest[..end]).ok_or_else(bad)?;
        seconds += value * unit.1;
        rest = &rest[end..];
    }
    if !(seconds > 0.0 && seconds <= 366.0 * 86400.0) {
        return Err(format!("{text:?} is not between 0 and a year"));
    }
    Ok(Duration::from_secs_f64(seconds))
}

/// `WIDTHxHEIGHT`, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size(pub u32, pub u32);

impl FromStr for Size {
    type Err = String;
    fn from_str(text: &str) -> Result<Size, String> {
        let bad = || format!("{text:?} is no size such as 640x480");
        let (w, h) = text.split_once(['x', 'X']).ok_or_else(bad)?;
        let side =
            |s: &str| s.trim().parse::<u32>().ok().filter(|n| (1..=1 << 20).contains(n)).ok_or_else(bad);
        Ok(Size(side(w)?, side(h)?))
    }
}

/// `x0,x1,y0,y1` in [0, 1], the order of pbrt's crop window; y goes down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crop(pub [f32; 4]);

impl FromStr for Crop {
    type Err = String;
    fn from_str(text: &str) -> Result<Crop, String> {
        let bad =
            || format!("{text:?} is no window x0,x1,y0,y1 with 0 <= x0 < x1 <= 1 and 0 <= y0 < y1 <= 1");
        let v: Vec<f32> =
            text.split(',').map(|w| w.trim().parse().map_err(|_| bad())).collect::<Result<_, _>>()?;
        let v: [f32; 4] = v.try_into().map_err(|_| bad())?;
        let inside = v.iter().all(|x| (0.0..=1.0).contains(x));
        if !inside || v[0] >= v[1] || v[2] >= v[3] {
            return Err(bad());
        }
        Ok(Crop(v))
    }
}

/// `key=value`.
pub fn define(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err(format!("{text:?} is not key=value")),
    }
}

/// A limit on scattering events.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Depth {
    /// This many.
    Limit(u32),
    /// What the scene's integrator says.
    File,
}

impl FromStr for Depth {
    type Err = String;
    fn from_str(text: &str) -> Result<Depth, String> {
        match text {
            "file" => Ok(Depth::File),
            n => n.parse().map(Depth::Limit).map_err(|_| format!("{n:?} is neither a number nor \"file\"")),
        }
    }
}

/// How bright a picture for the screen is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// The 95th percentile of the luminance comes to 0.8.
    Auto,
    /// Powers of two.
    Stops(f32),
}

impl FromStr for Exposure {
    type Err = String;
    fn from_str(text: &str) -> Result<Exposure, String> {
        match text {
            "auto" => Ok(Exposure::Auto),
            n => match n.parse() {
                Ok(stops) if (-60.0..=60.0).contains(&stops) => Ok(Exposure::Stops(stops)),
                _ => Err(format!("{n:?} is neither \"auto\" nor a number of stops in -60..60")),
            },
        }
    }
}

/// A pixel, column and row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pixel(pub [u32; 2]);

impl FromStr for Pixel {
    type Err = String;
    fn from_str(text: &str) -> Result<Pixel, String> {
        let number = |t: &str| t.trim().parse::<u32>().ok();
        let pair = text.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
        pair.map(Pixel).ok_or_else(|| format!("{text:?} is no pixel such as 320,240"))
    }
}

/// A receiver: position and unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    pub position: Vec3,
    pub normal: Vec3,
}

impl FromStr for Point {
    type Err = String;
    fn from_str(text: &str) -> Result<Point, String> {
        let words: Vec<f32> = text
            .split([' ', '\t', ',', ';'])
            .filter(|w| !w.is_empty())
            .map(|w| w.parse().ok().filter(|v: &f32| v.is_finite()))
            .collect::<Option<_>>()
            .ok_or_else(|| format!("{text:?} is not six numbers: x y z nx ny nz"))?;
        let [x, y, z, nx, ny, nz]: [f32; 6] =
            words.try_into().map_err(|_| format!("{text:?} is not six numbers: x y z nx ny nz"))?;
        let normal = Vec3::new(nx, ny, nz).as_dvec3().try_normalize().ok_or("the normal has no length")?;
        Ok(Point { position: Vec3::new(x, y, z), normal: normal.as_vec3() })
    }
}

/// A strategy of the gather.
pub fn strategy(text: &str) -> Result<Strategy, String> {
    strategies::parse(text).ok_or_else(|| {
        let plain = Strategy::ALL.iter().map(|n| n.0);
        let names: Vec<&str> = plain.chain(strategies::NAMES.iter().map(|n| n.0)).collect();
        format!("{text:?} is none of {}, report1994:enlarged:K", names.join(", "))
    })
}

/// A positive finite number.
pub fn positive(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(v) if v > 0.0 && v.is_finite() => Ok(v),
        _ => Err(format!("{text:?} is not a positive number")),
    }
}

/// A count, also as `2e6`, `500k`, `4M`.
pub fn count(text: &str) -> Result<u64, String> {
    let bad = || format!("{text:?} is not a positive count such as 60000, 500k, 4M or 2e6");
    let (digits, factor) = match text.char_indices().next_back() {
        Some((i, 'k' | 'K')) => (&text[..i], 1e3),
        Some((i, 'M')) => (&text[..i], 1e6),
        Some((i, 'G')) => (&text[..i], 1e9),
        _ => (text, 1.0),
    };
    if factor == 1.0
        && let Ok(n) = digits.parse::<u64>()
    {
        return if n > 0 { Ok(n) } else { Err(bad()) };
    }
    let n = digits.parse::<f64>().map_err(|_| bad())? * factor;
    if (1.0..=1e15).contains(&n) { Ok(n.round() as u64) } else { Err(bad()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_of_time() {
        let s = |t: &str| duration(t).map(|d| d.as_secs_f64());
        assert_eq!(s("30s"), Ok(30.0));
        assert_eq!(s("2m"), Ok(120.0));
        assert_eq!(s("1h30m"), Ok(5400.0));
        assert_eq!(s("500ms"), Ok(0.5));
        assert_eq!(s("1.5m2s"), Ok(92.0));
        assert_eq!(s("2.5"), Ok(2.5));
        for bad in ["", "s", "0s", "-3s", "10x", "1h30", "nan", "inf", "1e99", "5 s", "é"] {
            assert!(duration(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn sizes_windows_and_the_rest() {
        assert_eq!("640x480".parse(), Ok(Size(640, 480)));
        for bad in ["640", "0x3", "x", "1x-1", "5000000x2"] {
            assert!(bad.parse::<Size>().is_err(), "{bad}");
        }
        assert_eq!("0,0.5,0.25,1".parse(), Ok(Crop([0.0, 0.5, 0.25, 1.0])));
        for bad in ["0,1,0", "0.5,0.5,0,1", "0,1,0,1.1", "nan,1,0,1", "0,1,0,1,2"] {
            assert!(bad.parse::<Crop>().is_err(), "{bad}");
        }
        assert_eq!(define("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(define("a").is_err() && define("=b").is_err());
        assert_eq!("16..32".parse(), Ok(Passes(16, 32)));
        for bad in ["16", "3..3", "4..3", "-1..3", "a..b", "1..99999999999"] {
            assert!(bad.parse::<Passes>().is_err(), "{bad}");
        }
        assert_eq!(("file".parse(), "3".parse()), (Ok(Depth::File), Ok(Depth::Limit(3))));
        assert!("-1".parse::<Depth>().is_err());
        assert_eq!(("auto".parse(), "-1.5".parse()), (Ok(Exposure::Auto), Ok(Exposure::Stops(-1.5))));
        assert!("nan".parse::<Exposure>().is_err());
        assert_eq!(["7", "500k", "4M", "2e6"].map(|t| count(t).unwrap()), [7, 500_000, 4_000_000, 2_000_000]);
        assert_eq!("3,4".parse(), Ok(Pixel([3, 4])));
        assert!("3".parse::<Pixel>().is_err() && "-1,2".parse::<Pixel>().is_err());
        assert_eq!("1 2 3 0 0 2".parse(), Ok(Point { position: Vec3::new(1.0, 2.0, 3.0), normal: Vec3::Z }));
        for bad in ["1 2 3", "1 2 3 0 0 0", "1 2 nan 0 0 1", "a b c d e f", ""] {
            assert!(bad.parse::<Point>().is_err(), "{bad}");
        }
        for name in ["sobol", "regions", "report1994:voronoi", "report1994:enlarged:20"] {
            assert_eq!(strategy(name).map(strategies::name), Ok(name.to_string()));
        }
        for bad in ["", "voronoi", "report1994:enlarged:", "report1994:enlarged:0", "report1994:enlarged:1.5"]
        {
            assert!(strategy(bad).is_err(), "{bad}");
        }
        assert!(count("0").is_err() && count("-1").is_err() && count("1e30").is_err() && count("").is_err());
    }
}

/// Passes `A..B`, A up to but not B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passes(pub u32, pub u32);

impl FromStr for Passes {
    type Err = String;
    fn from_str(text: &str) -> Result<Passes, String> {
        let bad = || format!("{text:?} is no range of passes such as 16..32");
        let (a, b) = text.split_once("..").ok_or_else(bad)?;
        let (a, b) = (a.trim().parse().map_err(|_| bad())?, b.trim().parse().map_err(|_| bad())?);
        if a < b { Ok(Passes(a, b)) } else { Err(bad()) }
    }
}

/// A relative error: `1%` or `0.01`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share(pub f64);

impl std::str::FromStr for Share {
    type Err = String;

    fn from_str(text: &str) -> Result<Share, String> {
        let (number, unit) = match text.strip_suffix('%') {
            Some(n) => (n, 0.01),
            None => (text, 1.0),
        };
        match number.trim().parse::<f64>() {
            Ok(v) if v > 0.0 && v * unit < 1.0 => Ok(Share(v * unit)),
            _ => Err(format!("{text:?} is not an error like 1% or 0.01")),
        }
    }
}

/// A rectangle of sensors: origin, two edges, and how many along each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    numbers: [f64; 9],
    count: [u32; 2],
}

impl Grid {
    /// The sensors, at the centres of the grid's cells, facing edge 1 × edge 2, row by row, as lines of input.
    pub fn lines(&self) -> impl Iterator<Item = String> + '_ {
        let [ox, oy, oz, ux, uy, uz, vx, vy, vz] = self.numbers;
        let n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
        let [across, along] = self.count;
        (0..across * along).map(move |i| {
            let a = ((i % across) as f64 + 0.5) / across as f64;
            let b = ((i / across) as f64 + 0.5) / along as f64;
            let p = [ox + a * ux + b * vx, oy + a * uy + b * vy, oz + a * uz + b * vz];
            format!("{} {} {} {} {} {}", p[0], p[1], p[2], n[0], n[1], n[2])
        })
    }
}

impl std::str::FromStr for Grid {
    type Err = String;

    fn from_str(text: &str) -> Result<Grid, String> {
        let form = || format!("{text:?} is not ox,oy,oz,ux,uy,uz,vx,vy,vz,columns,rows");
        let words: Vec<&str> = text.split(',').map(str::trim).collect();
        if words.len() != 11 {
            return Err(form());
        }
        let mut numbers = [0f64; 9];
        for (v, word) in numbers.iter_mut().zip(&words) {
            *v = word.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(form)?;
        }
        let count =
            |word: &str| word.parse::<u32>().ok().filter(|n| (1..=10_000).contains(n)).ok_or_else(form);
        Ok(Grid { numbers, count: [count(words[9])?, count(words[10])?] })
    }
}
