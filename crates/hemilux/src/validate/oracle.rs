//! Closed forms in double precision: Lambert's formula for clipped polygons, plane mirrors, Fresnel panes, quadrature.

use std::f64::consts::PI;

/// A point or direction.
pub type V3 = [f64; 3];

/// a · b.
pub fn dot(a: V3, b: V3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// a × b.
pub fn cross(a: V3, b: V3) -> V3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// a + s b.
pub fn add(a: V3, b: V3, s: f64) -> V3 {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

/// a / |a|.
pub fn unit(a: V3) -> V3 {
    let l = dot(a, a).sqrt();
    a.map(|x| x / l)
}

/// A number in [0, 1) by hashing (splitmix64).
pub fn random(key: u64) -> f64 {
    let mut x = key.wrapping_add(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// The parallelogram at `p` with edges `e1` and `e2`.
pub fn corners(p: V3, e1: V3, e2: V3) -> Vec<V3> {
    vec![p, add(p, e1, 1.0), add(add(p, e1, 1.0), e2, 1.0), add(p, e2, 1.0)]
}

/// The part of a convex polygon where n · (x − o) ≥ 0.
pub fn clip(polygon: &[V3], o: V3, n: V3) -> Vec<V3> {
    let height = |x: V3| dot(add(x, o, -1.0), n);
    let mut kept = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (ha, hb) = (height(a), height(b));
        if ha >= 0.0 {
            kept.push(a);
        }
        if (ha < 0.0) != (hb < 0.0) {
            kept.push(add(a, add(b, a, -1.0), ha / (ha - hb)));
        }
    }
    kept
}

/// The part of a convex polygon that the eye sees through (or behind) another convex one.
pub fn seen_through(polygon: &[V3], eye: V3, window: &[V3]) -> Vec<V3> {
    let middle = window.iter().fold([0.0; 3], |sum, &w| add(sum, w, 1.0 / window.len() as f64));
    let mut part = polygon.to_vec();
    for (i, &a) in window.iter().enumerate() {
        let b = window[(i + 1) % window.len()];
        let n = cross(add(a, eye, -1.0), add(b, eye, -1.0));
        let side = dot(n, add(middle, eye, -1.0)).signum();
        part = clip(&part, eye, n.map(|x| x * side));
    }
    part
}

/// Irradiance from a convex polygon of radiance 1 whatever side of it is seen (Lambert 1760), cut at the receiver's horizon.
pub fn lambert(polygon: &[V3], p: V3, n: V3) -> f64 {
    let n = unit(n);
    let above = clip(polygon, p, n);
    let mut sum = 0.0;
    for (i, &a) in above.iter().enumerate() {
        let (a, b) = (add(a, p, -1.0), add(above[(i + 1) % above.len()], p, -1.0));
        let normal = cross(a, b);
        let length = dot(normal, normal).sqrt();
        if length > 1e-14 * dot(a, a) {
            sum += length.atan2(dot(a, b)) * dot(normal, n) / length;
        }
    }
    0.5 * sum.abs()
}

/// A point mirrored at the plane of a polygon.
pub fn reflect(x: V3, mirror: &[V3]) -> V3 {
    let n = unit(cross(add(mirror[1], mirror[0], -1.0), add(mirror[2], mirror[0], -1.0)));
    add(x, n, -2.0 * dot(add(x, mirror[0], -1.0), n))
}

/// Irradiance from the image of a polygon of radiance 1 in a flat convex mirror that reflects everything: of the part of it that lies on
/// the receiver's side of the mirror.
pub fn lambert_in_mirror(polygon: &[V3], mirror: &[V3], p: V3, n: V3) -> f64 {
    let normal = cross(add(mirror[1], mirror[0], -1.0), add(mirror[2], mirror[0], -1.0));
    let side = dot(normal, add(p, mirror[0], -1.0)).signum();
    let before = clip(polygon, mirror[0], normal.map(|x| x * side));
    let image: Vec<V3> = before.iter().map(|&x| reflect(x, mirror)).collect();
    lambert(&seen_through(&image, p, mirror), p, n)
}

/// Fresnel's reflectances (s, p) of an interface into relative index `eta` at `cos`, and the cosine inside.
pub fn fresnel(cos: f64, eta: f64) -> ([f64; 2], f64) {
    let inner = (1.0 - (1.0 - cos * cos) / (eta * eta)).sqrt();
    let s = (cos - eta * inner) / (cos + eta * inner);
    let p = (eta * cos - inner) / (eta * cos + inner);
    ([s * s, p * p], inner)
}

/// Transmittance of a pane with all inner reflections, the mean of both polarisations; `t` of one passage at normal incidence.
pub fn pane(cos: f64, eta: f64, t: f64) -> f64 {
    let (r, inner) = fresnel(cos, eta);
    let t = t.powf(1.0 / inner);
    r.iter().map(|r| 0.5 * (1.0 - r).powi(2) * t / (1.0 - (r * t).powi(2))).sum()
}

/// Irradiance at `p` facing `n` by a parallelogram of radiance `l(unit direction towards it, cosine at it)`: Gauss–Legendre of
/// 2 points in 300 × 300 cells.
pub fn through(corner: V3, e1: V3, e2: V3, p: V3, n: V3, l: impl Fn(V3, f64) -> f64) -> f64 {
    const CELLS: usize = 300;
    let (n, normal) = (unit(n), cross(e1, e2));
    let offset = 0.5 / 3f64.sqrt();
    let places: Vec<f64> =
        (0..CELLS).flat_map(|i| [-offset, offset].map(|o| (i as f64 + 0.5 + o) / CELLS as f64)).collect();
    let mut sum = 0.0;
    for &a in &places {
        for &b in &places {
            let to = add(add(add(corner, e1, a), e2, b), p, -1.0);
            let r2 = dot(to, to);
            let d = unit(to);
            // `normal` is not unit: its length is the area.
            let solid = dot(normal, d).abs() / r2;
            let cos = dot(unit(normal), d).abs();
            sum += l(d, cos) * dot(n, d).max(0.0) * solid;
        }
    }
    sum / (places.len() * places.len()) as f64
}

/// Irradiance of a sphere of radiance 1, half-angle `s` seen at polar angle `g` (radians), above or across the horizon.
pub fn ball(g: f64, s: f64) -> f64 {
    if g + s <= 0.5 * PI {
        return PI * s.sin().powi(2) * g.cos();
    }
    let (sg, cg, x) = (g.sin(), g.cos(), (1.0 / s.sin().powi(2) - 1.0).sqrt());
    let y = -x * cg / sg;
    let q = sg * (1.0 - y * y).sqrt();
    (cg * y.acos() - x * q) * s.sin().powi(2) + (q / x).atan()
}
