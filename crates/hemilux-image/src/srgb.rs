//! The sRGB transfer function (IEC 61966-2-1) and the primaries of Rec. 709 with D65.

/// Luminance weights of linear Rec. 709 primaries with white D65.
pub const LUMINANCE: [f32; 3] = [0.212_639, 0.715_169, 0.072_192];

/// CIE 1931 (x, y) of the Rec. 709 primaries red, green, blue, and of D65.
pub const REC709_XY: [[f64; 2]; 4] = [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], [0.3127, 0.3290]];

/// Code value (0..1) to linear light (0..1). Odd outside: negative values give negative light.
#[must_use]
pub fn decode(v: f32) -> f32 {
    let a = v.abs();
    let linear = if a <= 0.04045 { a / 12.92 } else { ((a + 0.055) / 1.055).powf(2.4) };
    linear.copysign(v)
}

/// Linear light (0..1) to code value (0..1). The inverse of [`decode`].
#[must_use]
pub fn encode(v: f32) -> f32 {
    let a = v.abs();
    let code = if a <= 0.003_130_8 { a * 12.92 } else { 1.055 * a.powf(1.0 / 2.4) - 0.055 };
    code.copysign(v)
}

/// Linear light to the nearest of the 256 code values; below 0, and NaN, give 0, above 1 gives 255.
#[must_use]
pub fn encode_u8(v: f32) -> u8 {
    (encode(v.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8
}

/// The matrix from linear RGB to XYZ (Y of white = 1) for primaries given as (x, y) of red, green, blue and white.
/// None when they do not span a colour space.
#[must_use]
pub fn rgb_to_xyz(xy: [[f64; 2]; 4]) -> Option<[[f64; 3]; 3]> {
    let column = |p: [f64; 2]| [p[0] / p[1], 1.0, (1.0 - p[0] - p[1]) / p[1]];
    let [r, g, b, w] = xy.map(column);
    let m = [[r[0], g[0], b[0]], [r[1], g[1], b[1]], [r[2], g[2], b[2]]];
    let s = mul(&invert(&m)?, w);
    let scaled = m.map(|row| [row[0] * s[0], row[1] * s[1], row[2] * s[2]]);
    scaled.iter().flatten().all(|v| v.is_finite()).then_some(scaled)
}

/// Matrix times vector.
#[must_use]
pub fn mul(m: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// The inverse by cofactors; none for a singular or non-finite matrix.
#[must_use]
pub fn invert(m: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let c = |i: usize, j: usize| {
        let (a, b) = ((i + 1) % 3, (i + 2) % 3);
        let (p, q) = ((j + 1) % 3, (j + 2) % 3);
        m[a][p] * m[b][q] - m[a][q] * m[b][p]
    };
    let det = m[0][0] * c(0, 0) + m[0][1] * c(0, 1) + m[0][2] * c(0, 2);
    if !det.is_finite() || det.abs() < 1e-30 {
        return None;
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| c(j, i) / det)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transfer_matches_the_standard_and_inverts() {
        // 8-bit code 118 is 18.1 % grey; 188 is half the light within half a code.
        assert!((decode(118.0 / 255.0) - 0.1812).abs() < 1e-4);
        assert_eq!(encode_u8(0.5), 188);
        assert_eq!([encode_u8(f32::NAN), encode_u8(-1.0), encode_u8(f32::INFINITY)], [0, 0, 255]);
        for code in 0..=255_u8 {
            assert_eq!(encode_u8(decode(f32::from(code) / 255.0)), code);
        }
        // The two branches meet.
        assert!((encode(0.003_130_8) - encode(0.003_130_9)).abs() < 1e-5);
    }

    #[test]
    fn primaries_give_the_published_matrix() {
        let m = rgb_to_xyz(REC709_XY).unwrap();
        for (got, want) in m[1].iter().zip(LUMINANCE) {
            assert!((*got as f32 - want).abs() < 1e-4);
        }
        assert!((m[0][0] - 0.412_39).abs() < 1e-5 && (m[2][2] - 0.950_53).abs() < 1e-4);
        let id = invert(&m).unwrap().map(|row| {
            let t = |j: usize| (0..3).map(|k| row[k] * m[k][j]).sum::<f64>();
            [t(0), t(1), t(2)]
        });
        for (i, row) in id.iter().enumerate() {
            for (j, v) in row.iter().enumerate() {
                assert!((v - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
        assert!(rgb_to_xyz([[0.3, 0.3]; 4]).is_none());
    }
}
