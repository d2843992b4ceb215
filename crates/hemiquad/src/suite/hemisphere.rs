//! Suite H: integrals over the hemisphere, and the report's pixel.

use super::{Class, Instance, Lamp, Problem, disks, lamps};
use crate::map::{Concentric, Dir, Map, Uv};
use crate::points::Key;
use crate::shape::turn;
use std::f64::consts::PI;

const DEG: f64 = PI / 180.0;

/// A direction at polar angle `g` and a random azimuth.
fn at_polar(g: f64, key: Key) -> Dir<f64> {
    let (s, c) = (2.0 * PI * key.uniform64(9)).sin_cos();
    Dir::from_unit(g.sin() * c, g.sin() * s, g.cos())
}

/// A random direction at least `s` above the horizon.
fn above(s: f64, key: Key) -> Dir<f64> {
    let low = s.sin();
    let z = low + (1.0 - low) * key.uniform64(8);
    at_polar(z.acos(), key)
}

fn one_lamp(s: f64, key: Key) -> Instance {
    lamps(vec![Lamp { axis: above(s, key), s, flux: 1.0 }], 0.0)
}

fn many_lamps(n: u64, key: Key) -> Instance {
    let s = 0.5 * DEG;
    let mut all: Vec<Lamp> = Vec::new();
    let mut i = 0;
    while (all.len() as u64) < n {
        let axis = above(s, key.with(i));
        i += 1;
        // Disjoint.
        if all.iter().all(|l| l.axis.dot(axis) < (2.2 * s).cos()) {
            all.push(Lamp { axis, s, flux: 4.0 / n as f64 });
        }
    }
    lamps(all, 0.5 / PI)
}

fn pixel(area: f64, key: Key) -> Instance {
    let r = (area / PI).sqrt();
    let p = key.uniform2_f64(7);
    let inside = |x: f64| r + (1.0 - 2.0 * r) * x;
    disks(vec![(Uv::new(inside(p.u), inside(p.v)), r, 1.0)], 0.5)
}

fn cross(a: Dir<f64>, b: Dir<f64>) -> (f64, f64, f64) {
    (a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)
}

/// Lambert's formula: the projected solid angle of a spherical polygon wholly above the horizon, in either orientation.
pub fn lambert(polygon: &[Dir<f64>]) -> f64 {
    let n = polygon.len();
    let sum: f64 = (0..n)
        .map(|i| {
            let (a, b) = (polygon[i], polygon[(i + 1) % n]);
            let c = cross(a, b);
            let l = (c.0 * c.0 + c.1 * c.1 + c.2 * c.2).sqrt();
            if l > 0.0 { l.atan2(a.dot(b)) * c.2 / l } else { 0.0 }
        })
        .sum();
    0.5 * sum.abs()
}

/// The projected integral over a spherical triangle, by three half-spaces.
fn triangle(corners: [Dir<f64>; 3]) -> Instance {
    let exact = lambert(&corners);
    let centre = Dir::normalize(
        corners.iter().map(|c| c.x).sum(),
        corners.iter().map(|c| c.y).sum(),
        corners.iter().map(|c| c.z).sum(),
    )
    .unwrap_or(Dir::from_unit(0.0, 0.0, 1.0));
    let planes: [(f64, f64, f64); 3] = std::array::from_fn(|i| {
        let c = cross(corners[i], corners[(i + 1) % 3]);
        let sign = (c.0 * centre.x + c.1 * centre.y + c.2 * centre.z).signum();
        (sign * c.0, sign * c.1, sign * c.2)
    });
    Instance::directions(exact, move |d| {
        if planes.iter().all(|p| p.0 * d.x + p.1 * d.y + p.2 * d.z >= 0.0) { d.z } else { 0.0 }
    })
}

fn legendre(l: u32, x: f64) -> f64 {
    let (mut p, mut q) = (1.0, 0.0);
    for j in 0..l {
        let j = j as f64;
        (p, q) = (((2.0 * j + 1.0) * x * p - j * q) / (j + 1.0), p);
    }
    p
}

/// 1 + Σ cₗ Pₗ(d · aₗ). Over the hemisphere Pₗ(d · a) gives Pₗ(a_z) · 2π ∫₀¹ Pₗ (Funk and Hecke).
fn harmonics(key: Key) -> Instance {
    let term = |l: u32| {
        let axis: Dir<f64> = crate::map::Sphere.dir(key.with(l as u64).uniform2_f64(0));
        (l, axis, key.with(l as u64).uniform64(1) - 0.5)
    };
    let terms: Vec<_> = (1..=8).map(term).collect();
    // ∫₀¹ Pₗ = (P_{l-1}(0) - P_{l+1}(0)) / (2l + 1).
    let half = |l: u32| (legendre(l - 1, 0.0) - legendre(l + 1, 0.0)) / (2 * l + 1) as f64;
    let exact =
        2.0 * PI * (1.0 + terms.iter().map(|(l, a, c)| c * legendre(*l, a.z) * half(*l)).sum::<f64>());
    Instance::directions(exact, move |d| {
        1.0 + terms.iter().map(|(l, a, c)| c * legendre(*l, d.dot(*a))).sum::<f64>()
    })
}

fn von_mises_fisher(kappa: f64, key: Key) -> Instance {
    let axis = at_polar(60.0 * DEG, key);
    // κ/(2π(1 - e^{-2κ})) exp(κ(cos - 1)); its mass below the horizon, 30° away, is less than e^{-κ/8}.
    let norm = kappa / (2.0 * PI * (1.0 - (-2.0 * kappa).exp()));
    Instance::directions(1.0, move |d| {
        let (x, y, z) = (d.x - axis.x, d.y - axis.y, d.z - axis.z);
        norm * (-0.5 * kappa * (x * x + y * y + z * z)).exp()
    })
}

fn glints(key: Key) -> Instance {
    let s: f64 = 1e-3;
    let glint = |i: u64| {
        let k = key.with(i);
        // Power-law values, x^-0.6 for uniform x: a few carry much of the sum.
        Lamp { axis: above(s, k), s, flux: 1e-3 * k.uniform64(3).max(1e-6).powf(-0.6) }
    };
    lamps((0..1000).map(glint).collect(), 0.0)
}

/// A glossy lobe α²/(π(α² cos² + sin²)²) cos about an axis, seen through a cap whose centre is a little off that axis.
fn glossy(key: Key) -> Instance {
    let (alpha, s, off) = (0.1f64, 0.1f64, 0.08f64);
    let axis = at_polar(40.0 * DEG, key);
    let centre = turn(axis, at_polar(off, key.with(1)));
    let lobe = move |c: f64| {
        let (c, s2) = (c.max(0.0), 1.0 - c * c);
        let q = alpha * alpha * c * c + s2;
        alpha * alpha / (PI * q * q) * c
    };
    // The circle at angle t about the lobe's axis lies inside the cap for azimuths up to ψ: cos s = cos t cos off + sin t sin off cos ψ.
    let n = 20_000;
    let exact: f64 = (0..n)
        .map(|i| {
            let t = (i as f64 + 0.5) / n as f64 * (s + off);
            let x = (s.cos() - t.cos() * off.cos()) / (t.sin() * off.sin());
            2.0 * x.clamp(-1.0, 1.0).acos() * lobe(t.cos()) * t.sin() * (s + off) / n as f64
        })
        .sum();
    let least = s.cos();
    Instance::directions(exact, move |d| if d.dot(centre) >= least { lobe(d.dot(axis)) } else { 0.0 })
}

fn ring(a: f64, b: f64) -> Instance {
    let (high, low) = (a.cos(), b.cos());
    Instance::directions(PI * (b.sin().powi(2) - a.sin().powi(2)), move |d| {
        if d.z <= high && d.z >= low { d.z } else { 0.0 }
    })
}

pub(super) fn problems() -> Vec<Problem> {
    use Class::*;
    macro_rules! p {
        ($name:expr, $class:expr, $make:expr) => {
            Problem { name: $name, class: $class, make: $make }
        };
    }
    vec![
        p!("H1 constant", Smooth, |_| Instance::directions(2.0 * PI, |_| 1.0)),
        p!("H2 cos", Smooth, |_| Instance::directions(PI, |d| d.z)),
        p!("H2 cos^20", Smooth, |_| Instance::directions(2.0 * PI / 21.0, |d| d.z.powi(20))),
        p!("H3 cap 10°", Edge, |k| one_lamp(10.0 * DEG, k)),
        p!("H3 cap 1°", Compact, |k| one_lamp(DEG, k)),
        p!("H3 sun 0.2665°", Compact, |k| one_lamp(0.2665 * DEG, k)),
        p!("H3 cap 0.05°", Compact, |k| one_lamp(0.05 * DEG, k)),
        p!("H3 cap 0.005°", Compact, |k| one_lamp(0.005 * DEG, k)),
        p!("H4 triangle", Edge, |k| triangle(
            [0, 1, 2].map(|i| at_polar((20.0 + 55.0 * k.with(i).uniform64(1)) * DEG, k.with(i)))
        )),
        p!("H5 pixel 1e-2", Edge, |k| pixel(1e-2, k)),
        p!("H5 pixel 1e-3", Compact, |k| pixel(1e-3, k)),
        p!("H5 pixel 1e-4", Compact, |k| pixel(1e-4, k)),
        p!("H5 pixel 1e-6", Compact, |k| pixel(1e-6, k)),
        p!("H6 1 cap", Compact, |k| many_lamps(1, k)),
        p!("H6 8 caps", Compact, |k| many_lamps(8, k)),
        p!("H6 64 caps", Compact, |k| many_lamps(64, k)),
        p!("H7 ring 1°", Edge, |k| {
            let a = (20.0 + 50.0 * k.uniform64(0)) * DEG;
            ring(a, a + DEG)
        }),
        p!("H7 ring 0.01°", Ragged, |k| {
            let a = (20.0 + 50.0 * k.uniform64(0)) * DEG;
            ring(a, a + 0.01 * DEG)
        }),
        p!("H8 sliver", Ragged, |k| {
            let (a, b) = (at_polar(30.0 * DEG, k), at_polar(60.0 * DEG, k.with(1)));
            let n = cross(a, b);
            let l = (n.0 * n.0 + n.1 * n.1 + n.2 * n.2).sqrt().max(1e-9);
            // The third corner stands off the middle of the long side by a thousandth of its length.
            let e = 1e-3 * l.atan2(a.dot(b)) / l;
            let c = Dir::normalize(
                0.5 * (a.x + b.x) + e * n.0,
                0.5 * (a.y + b.y) + e * n.1,
                0.5 * (a.z + b.z) + e * n.2,
            );
            triangle([a, b, c.unwrap_or(a)])
        }),
        p!("H9 harmonics", Smooth, harmonics),
        p!("H10 checkerboard", Ragged, |k| {
            let s = k.uniform2_f64(0);
            // An even number of squares per side, shifted at random around the torus.
            Instance::plain(0.5, move |p| {
                ((((p.u + s.u) * 10.0) as u32 + ((p.v + s.v) * 10.0) as u32) % 2) as f64
            })
        }),
        p!("H11 vMF 1e3", Rough, |k| von_mises_fisher(1e3, k)),
        p!("H11 vMF 1e5", Rough, |k| von_mises_fisher(1e5, k)),
        p!("H12 glints", Ragged, glints),
        p!("H13 half-space", Edge, |k| {
            let g = 0.5 * PI * k.uniform64(0);
            let pole = at_polar(g, k);
            Instance::directions(
                0.5 * PI * (1.0 + g.cos()),
                move |d| if d.dot(pole) >= 0.0 { d.z } else { 0.0 },
            )
        }),
        p!("H14 diagonal", Compact, |k| {
            let shift = 0.1 * k.uniform64(0);
            let at = |u: f64| Concentric.dir(Uv::new(u + shift, u + shift));
            let lamp = |u| Lamp { axis: at(u), s: DEG, flux: 1.0 };
            lamps(vec![lamp(0.2), lamp(0.7)], 0.05)
        }),
        p!("H14 cut", Compact, |k| {
            let g = (20.0 + 50.0 * k.uniform64(0)) * DEG;
            lamps(vec![Lamp { axis: Dir::from_unit(g.sin(), 0.0, g.cos()), s: DEG, flux: 1.0 }], 0.05)
        }),
        p!("H15 glossy cap", Rough, glossy),
    ]
}
