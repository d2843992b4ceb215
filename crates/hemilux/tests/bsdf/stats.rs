//! Random numbers and significance.

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1u32 << 24) as f32
    }

    pub fn square(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }
}

fn ln_gamma(x: f64) -> f64 {
    // Stirling's series after shifting to x >= 10.
    let (mut x, mut shift) = (x, 0.0);
    while x < 10.0 {
        shift += x.ln();
        x += 1.0;
    }
    let x2 = x * x;
    (x - 0.5) * x.ln() - x
        + 0.5 * std::f64::consts::TAU.ln()
        + (1.0 / 12.0 - (1.0 / 360.0 - 1.0 / (1260.0 * x2)) / x2) / x
        - shift
}

/// Probability that χ² with `dof` degrees of freedom exceeds `x`: the upper incomplete gamma function.
pub fn chi_square_tail(x: f64, dof: usize) -> f64 {
    let (a, x) = (dof as f64 / 2.0, x / 2.0);
    let front = (a * x.max(1e-300).ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return (1.0 - front * sum).max(0.0);
    }
    // Lentz's continued fraction.
    let mut b = x + 1.0 - a;
    let (mut c, mut d) = (1e300, 1.0 / b);
    let mut h = d;
    for i in 1..10_000 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    front * h
}

/// Two-sided p-value of a standard normal deviate: z² is χ² of one degree.
pub fn normal_p(z: f64) -> f64 {
    chi_square_tail(z * z, 1)
}

/// Significance of one of `n` tests so that all of them together raise a false alarm with probability `family`.
pub fn sidak(family: f64, n: usize) -> f64 {
    1.0 - (1.0 - family).powf(1.0 / n as f64)
}

/// Mean and standard error.
pub fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

#[test]
fn tables_of_chi_square_and_normal() {
    for (x, dof, p) in
        [(3.841_458_8, 1, 0.05), (18.307_038, 10, 0.05), (135.806_72, 100, 0.01), (1.145_476, 5, 0.95)]
    {
        assert!((chi_square_tail(x, dof) - p).abs() < 1e-6, "{x} {dof}");
    }
    assert!((normal_p(1.959_964) - 0.05).abs() < 1e-6);
}
