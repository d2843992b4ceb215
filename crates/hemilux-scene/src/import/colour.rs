//! RGB colour spaces of pbrt and the way from them (and from XYZ) to linear sRGB, the program's own.

use crate::Rgb;

/// What a spectral value stands for; decides how white maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// A reflectance in [0, 1]: the space's white is the perfect diffuser.
    Albedo,
    /// A material constant without bound (index of refraction, absorption).
    Unbounded,
    /// Emission: the space's white has its own colour, luminance 1.
    Illuminant,
}

/// The RGB spaces of `ColorSpace`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ColourSpace {
    /// Rec. 709 primaries, D65.
    #[default]
    Srgb,
    /// DCI-P3 primaries, D65.
    DciP3,
    /// Rec. 2020 primaries, D65.
    Rec2020,
    /// ACES2065-1 (AP0), D60-like.
    Aces2065,
}

/// Their names.
pub const NAMES: [(&str, ColourSpace); 4] = [
    ("srgb", ColourSpace::Srgb),
    ("dci-p3", ColourSpace::DciP3),
    ("rec2020", ColourSpace::Rec2020),
    ("aces2065-1", ColourSpace::Aces2065),
];

type Matrix = [[f64; 3]; 3];

const D65: [f64; 2] = [0.3127, 0.3290];

impl ColourSpace {
    /// Chromaticities of red, green, blue, white.
    fn primaries(self) -> [[f64; 2]; 4] {
        match self {
            ColourSpace::Srgb => [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65],
            ColourSpace::DciP3 => [[0.680, 0.320], [0.265, 0.690], [0.150, 0.060], D65],
            ColourSpace::Rec2020 => [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65],
            ColourSpace::Aces2065 => [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.0770], [0.32168, 0.33767]],
        }
    }
}

/// XYZ of a chromaticity at luminance 1.
fn xyz_of([x, y]: [f64; 2]) -> [f64; 3] {
    [x / y, 1.0, (1.0 - x - y) / y]
}

fn apply(m: &Matrix, v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    let column = |j: usize| apply(a, [b[0][j], b[1][j], b[2][j]]);
    let c = [column(0), column(1), column(2)];
    [0, 1, 2].map(|i| [c[0][i], c[1][i], c[2][i]])
}

/// The inverse by cofactors; the matrices here are well conditioned.
fn inverse(m: &Matrix) -> Matrix {
    let minor = |r0: usize, c0: usize, r1: usize, c1: usize| m[r0][c0] * m[r1][c1] - m[r0][c1] * m[r1][c0];
    let cofactors = [
        [minor(1, 1, 2, 2), -minor(1, 0, 2, 2), minor(1, 0, 2, 1)],
        [-minor(0, 1, 2, 2), minor(0, 0, 2, 2), -minor(0, 0, 2, 1)],
        [minor(0, 1, 1, 2), -minor(0, 0, 1, 2), minor(0, 0, 1, 1)],
    ];
    let det = (0..3).map(|j| m[0][j] * cofactors[0][j]).sum::<f64>();
    [0, 1, 2].map(|i| [0, 1, 2].map(|j| cofactors[j][i] / det))
}

/// RGB to XYZ such that (1, 1, 1) has the white's chromaticity and Y = 1.
fn to_xyz(space: ColourSpace) -> Matrix {
    let [r, g, b, w] = space.primaries();
    let (r, g, b) =
        ([r[0], r[1], 1.0 - r[0] - r[1]], [g[0], g[1], 1.0 - g[0] - g[1]], [b[0], b[1], 1.0 - b[0] - b[1]]);
    let columns = [0, 1, 2].map(|i| [r[i], g[i], b[i]]);
    let s = apply(&inverse(&columns), xyz_of(w));
    [0, 1, 2].map(|i| [columns[i][0] * s[0], columns[i][1] * s[1], columns[i][2] * s[2]])
}

/// Linear sRGB of an XYZ value; may lie outside the gamut.
pub fn xyz_to_srgb(xyz: [f64; 3]) -> [f64; 3] {
    apply(&inverse(&to_xyz(ColourSpace::Srgb)), xyz)
}

/// Linear sRGB at luminance 1 of a chromaticity, negative bands cut off (then rescaled to luminance 1).
pub fn from_chromaticity(xy: [f64; 2]) -> Rgb {
    into_gamut(xyz_to_srgb(xyz_of(xy)))
}

/// Cut negative bands, keep the luminance.
pub fn into_gamut(rgb: [f64; 3]) -> Rgb {
    let y = |c: [f64; 3]| 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
    let cut = rgb.map(|v| v.max(0.0));
    let k = if y(cut) > 0.0 { (y(rgb) / y(cut)).max(0.0) } else { 1.0 };
    Rgb(cut.map(|v| (v * k) as f32))
}

/// The Bradford matrix: XYZ to sharpened cone responses.
const BRADFORD: Matrix = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]];

/// Chromatic adaptation between whites.
fn adapt(from: [f64; 2], to: [f64; 2]) -> Matrix {
    let (a, b) = (apply(&BRADFORD, xyz_of(from)), apply(&BRADFORD, xyz_of(to)));
    let scaled = [0, 1, 2].map(|i| BRADFORD[i].map(|v| v * b[i] / a[i]));
    product(&inverse(&BRADFORD), &scaled)
}

/// An RGB value of `space` as linear sRGB. Albedos are adapted, so that white stays white, and clamped to [0, 1].
pub fn from_rgb(space: ColourSpace, rgb: [f64; 3], meaning: Meaning) -> Rgb {
    let out = if space == ColourSpace::Srgb {
        Rgb(rgb.map(|v| v as f32))
    } else {
        let mut m = to_xyz(space);
        if meaning != Meaning::Illuminant {
            m = product(&adapt(space.primaries()[3], D65), &m);
        }
        into_gamut(xyz_to_srgb(apply(&m, rgb)))
    };
    if meaning == Meaning::Albedo { out.map(|v| v.clamp(0.0, 1.0)) } else { out }
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
    fn srgb_is_the_identity_and_its_matrix_the_published_one() {
        close(from_rgb(ColourSpace::Srgb, [0.1, 2.0, 3.0], Meaning::Unbounded), [0.1, 2.0, 3.0], 0.0 + 1e-7);
        let m = to_xyz(ColourSpace::Srgb);
        let published = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]];
        for i in 0..3 {
            for j in 0..3 {
                assert!((m[i][j] - published[i][j]).abs() < 2e-4, "{i} {j} {}", m[i][j]);
            }
        }
    }

    #[test]
    fn white_stays_white_for_albedos_in_every_space() {
        for (_, space) in NAMES {
            close(from_rgb(space, [1.0; 3], Meaning::Albedo), [1.0; 3], 1e-4);
            close(from_rgb(space, [0.25; 3], Meaning::Albedo), [0.25; 3], 1e-4);
        }
    }

    #[test]
    fn emission_keeps_the_colour_of_the_white() {
        let c = from_rgb(ColourSpace::Aces2065, [1.0; 3], Meaning::Illuminant);
        assert!(c[0] > c[2] && (c.luminance() - 1.0).abs() < 1e-3, "{c:?}");
        close(from_rgb(ColourSpace::Rec2020, [1.0; 3], Meaning::Illuminant), [1.0; 3], 1e-4);
    }

    #[test]
    fn wide_primaries_are_cut_to_the_gamut() {
        let c = from_rgb(ColourSpace::Rec2020, [0.0, 1.0, 0.0], Meaning::Albedo);
        assert!(c[0] == 0.0 && c[1] > 0.8, "{c:?}");
    }
}
