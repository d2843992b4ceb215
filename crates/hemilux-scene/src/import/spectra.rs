//! Spectra reduced to three bands: black bodies, lists of wavelength and value, `.spd` files, and the named spectra that
//! scenes use.
//!
//! Wavelengths are in nm. Colour matching: the analytic fit to the CIE 1931 observer by Wyman, Sloan and Shirley (2013).
//! Emission is normalised to luminance 1, as pbrt's lights divide by the luminance of their spectrum; material constants
//! are weighted by D65 and scaled so that a constant spectrum keeps its value.

use super::Env;
use super::colour::{self, Meaning};
use crate::{Rgb, Span};

const FIRST: f64 = 360.0;
const LAST: f64 = 830.0;
const STEP: f64 = 5.0;

/// One lobe of the fit: a Gaussian with another width on each side.
fn lobe(lambda: f64, peak: f64, left: f64, right: f64) -> f64 {
    let t = (lambda - peak) / if lambda < peak { left } else { right };
    (-0.5 * t * t).exp()
}

/// CIE 1931 colour matching functions at a wavelength (Wyman et al. 2013, table 1).
fn matching(lambda: f64) -> [f64; 3] {
    [
        1.056 * lobe(lambda, 599.8, 37.9, 31.0) + 0.362 * lobe(lambda, 442.0, 16.0, 26.7)
            - 0.065 * lobe(lambda, 501.1, 20.4, 26.2),
        0.821 * lobe(lambda, 568.8, 46.9, 40.5) + 0.286 * lobe(lambda, 530.9, 16.3, 31.1),
        1.217 * lobe(lambda, 437.0, 11.8, 36.0) + 0.681 * lobe(lambda, 459.0, 26.0, 13.8),
    ]
}

fn integrate(f: impl Fn(f64) -> f64) -> [f64; 3] {
    let n = ((LAST - FIRST) / STEP) as usize;
    let mut xyz = [0.0; 3];
    for i in 0..=n {
        let lambda = FIRST + STEP * i as f64;
        let v = f(lambda);
        for (sum, m) in xyz.iter_mut().zip(matching(lambda)) {
            *sum += v * m * STEP;
        }
    }
    xyz
}

/// Relative spectral power of D65, every 10 nm from 380 nm (CIE 15).
const D65: [f64; 41] = [
    49.98, 54.65, 82.75, 91.49, 93.43, 86.68, 104.87, 117.01, 117.81, 114.86, 115.92, 108.81, 109.35, 107.80,
    104.79, 107.69, 104.41, 104.05, 100.0, 96.33, 95.79, 88.69, 90.01, 89.60, 87.70, 83.29, 83.70, 80.03,
    80.21, 82.28, 78.28, 69.72, 71.61, 74.35, 61.60, 69.89, 75.09, 63.59, 46.42, 66.81, 63.38,
];

fn d65(lambda: f64) -> f64 {
    let t = ((lambda - 380.0) / 10.0).clamp(0.0, 40.0);
    let i = (t as usize).min(39);
    D65[i] + (t - i as f64) * (D65[i + 1] - D65[i])
}

/// The three bands of a spectrum.
fn reduce(f: impl Fn(f64) -> f64, meaning: Meaning) -> Rgb {
    if meaning == Meaning::Illuminant {
        let xyz = integrate(f);
        if xyz[1] <= 0.0 {
            return Rgb::BLACK;
        }
        return colour::into_gamut(colour::xyz_to_srgb(xyz.map(|v| v / xyz[1])));
    }
    let white = colour::xyz_to_srgb(integrate(d65));
    let c = colour::xyz_to_srgb(integrate(|l| f(l) * d65(l)));
    let c = Rgb([0, 1, 2].map(|i| (c[i] / white[i]).max(0.0) as f32));
    if meaning == Meaning::Albedo { c.map(|v| v.min(1.0)) } else { c }
}

/// Emission of a black body (Planck), luminance 1; `kelvin` in [100, 1e7].
pub fn blackbody(kelvin: f64) -> Rgb {
    // hc/k in m·K; relative to 560 nm so that nothing under- or overflows.
    let c2 = 1.438_776_877e-2;
    let exponent = |l: f64| c2 / (l * 1e-9 * kelvin);
    let reference = exponent(560.0);
    reduce(
        |l| {
            let x = exponent(l);
            // exp(ref)/(exp(x) − 1), in a form that stays finite.
            (560.0 / l).powi(5) * (reference - x).min(700.0).exp() / -(-x).exp_m1()
        },
        Meaning::Illuminant,
    )
}

/// A list of wavelength (nm, ascending) and value; constant beyond its ends, linear between.
pub fn from_pairs(values: &[f64], meaning: Meaning) -> Result<Rgb, String> {
    let (pairs, rest) = values.as_chunks::<2>();
    if pairs.is_empty() || !rest.is_empty() {
        return Err(format!("a spectrum takes pairs of wavelength and value, not {} values", values.len()));
    }
    if pairs.windows(2).any(|w| w[0][0] >= w[1][0]) {
        return Err("the wavelengths of a spectrum must ascend".into());
    }
    if pairs.iter().any(|p| p[1] < 0.0) {
        return Err("a spectrum must not be negative".into());
    }
    let at = |l: f64| {
        let i = pairs.partition_point(|p| p[0] <= l);
        if i == 0 {
            return pairs[0][1];
        }
        let Some(b) = pairs.get(i) else { return pairs[i - 1][1] };
        let a = pairs[i - 1];
        a[1] + (l - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
    };
    Ok(reduce(at, meaning))
}

/// Complex indices of metals in the three bands (measured data weighted by the observer; oxides by their dispersion
/// formulae at 610, 550 and 465 nm).
const METALS: [(&str, [f32; 3], [f32; 3]); 7] = [
    ("Ag", [0.155, 0.117, 0.138], [4.83, 3.12, 2.15]),
    ("Al", [1.657, 0.880, 0.521], [9.22, 6.27, 4.84]),
    ("Au", [0.143, 0.375, 1.442], [3.98, 2.39, 1.60]),
    ("Cu", [0.200, 0.924, 1.102], [3.91, 2.45, 2.14]),
    ("CuZn", [0.444, 0.527, 1.094], [3.70, 2.77, 1.83]),
    ("MgO", [1.736, 1.740, 1.748], [0.0, 0.0, 0.0]),
    ("TiO2", [2.590, 2.648, 2.786], [0.0, 0.0, 0.0]),
];

/// Indices of refraction at 587.6 nm of the glasses, from their makers' data sheets.
const GLASSES: [(&str, f32); 10] = [
    ("glass-BK7", 1.5168),
    ("glass-BAF10", 1.67),
    ("glass-FK51A", 1.4866),
    ("glass-LASF9", 1.8503),
    ("glass-F5", 1.6034),
    ("glass-SF5", 1.6727),
    ("glass-F10", 1.6228),
    ("glass-SF10", 1.7283),
    ("glass-F11", 1.6206),
    ("glass-SF11", 1.7847),
];

/// Chromaticities of the standard illuminants (CIE 15).
const ILLUMINANTS: [(&str, [f64; 2]); 16] = [
    ("stdillum-A", [0.44757, 0.40745]),
    ("stdillum-D50", [0.34567, 0.35850]),
    ("stdillum-D65", [0.3127, 0.3290]),
    ("stdillum-F1", [0.31310, 0.33727]),
    ("stdillum-F2", [0.37208, 0.37529]),
    ("stdillum-F3", [0.40910, 0.39430]),
    ("stdillum-F4", [0.44018, 0.40329]),
    ("stdillum-F5", [0.31379, 0.34531]),
    ("stdillum-F6", [0.37790, 0.38835]),
    ("stdillum-F7", [0.31292, 0.32933]),
    ("stdillum-F8", [0.34588, 0.35875]),
    ("stdillum-F9", [0.37417, 0.37281]),
    ("stdillum-F10", [0.34609, 0.35986]),
    ("stdillum-F11", [0.38052, 0.37713]),
    ("stdillum-F12", [0.43695, 0.40441]),
    ("illum-acesD60", [0.32168, 0.33767]),
];

/// η and k of copper: what a conductor is made of when the file does not say.
pub fn copper() -> (Rgb, Rgb) {
    let (_, eta, k) = METALS[3];
    (Rgb(eta), Rgb(k))
}

/// A named spectrum.
pub fn named(name: &str) -> Option<Rgb> {
    if let Some(g) = GLASSES.iter().find(|g| g.0 == name) {
        return Some(Rgb::splat(g.1));
    }
    if let Some(i) = ILLUMINANTS.iter().find(|i| i.0 == name) {
        return Some(colour::from_chromaticity(i.1));
    }
    let metal = name.strip_prefix("metal-")?;
    METALS.iter().find_map(|(m, eta, k)| match metal.strip_prefix(m)? {
        "-eta" => Some(Rgb(*eta)),
        "-k" => Some(Rgb(*k)),
        _ => None,
    })
}

/// Every name that [`named`] knows.
fn names() -> Vec<String> {
    let metals = METALS.iter().flat_map(|m| [format!("metal-{}-eta", m.0), format!("metal-{}-k", m.0)]);
    let others = GLASSES.iter().map(|g| g.0).chain(ILLUMINANTS.iter().map(|i| i.0)).map(str::to_owned);
    metals.chain(others).collect()
}

/// A named spectrum, or a file of wavelengths and values.
pub fn named_or_file(env: &Env, name: &str, span: Span, meaning: Meaning) -> Option<Rgb> {
    if let Some(c) = named(name) {
        return Some(c);
    }
    let path = env.resolve(name, span.file);
    if !path.is_file() {
        let list = names();
        env.log.unknown_among(
            span,
            format!("spectrum \"{name}\" is neither a known name nor a file"),
            name,
            list.iter().map(String::as_str),
        );
        return None;
    }
    let parsed = env.read(&path).and_then(|bytes| parse_spd(&bytes)).and_then(|v| from_pairs(&v, meaning));
    match parsed {
        Ok(c) => Some(c),
        Err(e) => {
            env.log.error(span, format!("{}: {e}", path.display()));
            None
        }
    }
}

/// The numbers of an `.spd` file: white space between them, `#` comments.
fn parse_spd(bytes: &[u8]) -> Result<Vec<f64>, String> {
    let text = String::from_utf8_lossy(bytes);
    text.lines()
        .flat_map(|l| l.split('#').next().unwrap_or("").split_whitespace())
        .map(|w| {
            w.parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| format!("\"{w}\" is not a finite number"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Rgb, b: [f32; 3], eps: f32) {
        for i in 0..3 {
            assert!((a[i] - b[i]).abs() < eps, "{a:?} {b:?}");
        }
    }

    #[test]
    fn the_fit_has_the_observers_integral() {
        // ∫ȳ = 106.857 nm (CIE 1931, 1 nm tables); the fit is good to a per cent.
        let xyz = integrate(|_| 1.0);
        assert!(xyz.iter().all(|v| (v / 106.86 - 1.0).abs() < 0.01), "{xyz:?}");
    }

    #[test]
    fn black_bodies_have_luminance_one_and_known_chromaticity() {
        for t in [100.0, 1000.0, 2856.0, 6500.0, 1e7] {
            let c = blackbody(t);
            assert!((c.luminance() - 1.0).abs() < 1e-3 && c.is_finite(), "{t} {c:?}");
        }
        // Illuminant A is a black body at 2856 K.
        close(blackbody(2856.0), colour::from_chromaticity([0.44757, 0.40745]).0, 0.03);
        // Negative control: 2 856 K is not D65.
        assert!((blackbody(2856.0) - named("stdillum-D65").unwrap()).map(f32::abs).max() > 0.3);
    }

    #[test]
    fn constant_spectra_keep_their_value() {
        close(from_pairs(&[400.0, 0.3, 700.0, 0.3], Meaning::Albedo).unwrap(), [0.3; 3], 1e-5);
        close(from_pairs(&[500.0, 2.5], Meaning::Unbounded).unwrap(), [2.5; 3], 1e-5);
        close(
            from_pairs(&[400.0, 7.0, 700.0, 7.0], Meaning::Illuminant).unwrap(),
            [1.205, 0.948, 0.908],
            0.03,
        );
    }

    #[test]
    fn red_is_red() {
        let c = from_pairs(&[400.0, 0.0, 590.0, 0.0, 600.0, 1.0, 700.0, 1.0], Meaning::Albedo).unwrap();
        assert!(c[0] > 0.6 && c[1] < 0.2 && c[2] < 0.1, "{c:?}");
    }

    #[test]
    fn bad_lists_are_refused() {
        assert!(from_pairs(&[], Meaning::Albedo).is_err());
        assert!(from_pairs(&[400.0, 1.0, 500.0], Meaning::Albedo).is_err());
        assert!(from_pairs(&[500.0, 1.0, 400.0, 1.0], Meaning::Albedo).is_err());
        assert!(from_pairs(&[500.0, -1.0], Meaning::Albedo).is_err());
        assert!(parse_spd(b"400 nan").is_err());
        assert_eq!(parse_spd(b"# x\n400 1\n500 2 # y").unwrap(), [400.0, 1.0, 500.0, 2.0]);
    }

    #[test]
    fn metals_reflect_as_metals_do() {
        // Normal reflectance ((η−1)² + k²)/((η+1)² + k²), published: Ag ≥ 0.9 everywhere, Au and Cu reddish, Al ≈ 0.91.
        let r = |m: &str| {
            let (eta, k) =
                (named(&format!("metal-{m}-eta")).unwrap(), named(&format!("metal-{m}-k")).unwrap());
            [0, 1, 2].map(|i| {
                let (n, k) = (eta[i], k[i] * k[i]);
                ((n - 1.0).powi(2) + k) / ((n + 1.0).powi(2) + k)
            })
        };
        assert!(r("Ag").iter().all(|&v| v > 0.88));
        assert!(r("Al").iter().all(|&v| (v - 0.91).abs() < 0.02));
        for m in ["Au", "Cu", "CuZn"] {
            let [red, green, blue] = r(m);
            assert!(red > green && green > blue && red > 0.85, "{m}");
        }
        assert_eq!(named("metal-Cu-x"), None);
        assert_eq!(named("glass-BK7"), Some(Rgb::splat(1.5168)));
        assert!(names().iter().all(|n| named(n).is_some()));
    }
}
