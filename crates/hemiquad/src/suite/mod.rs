//! A public benchmark of integrands with exact values: hemispherical suite H, A. Genz's families ("A package for testing
//! multiple integration subroutines", 1987), and hard cases on which quadrature libraries have been seen to fail.
//!
//! A [`Problem`] is a family; a key makes one [`Instance`] of it, at a random place. The hemisphere is reached through
//! [`Concentric`]; "projected" integrands carry the cosine.

mod genz;
mod hemisphere;

use crate::integrand::{Integrand, Probe, Size};
use crate::map::{Concentric, Dir, Map, Uv};
use crate::method::Region;
use crate::points::Key;
use crate::shape::Shape;
use std::f64::consts::PI;

pub use genz::genz_spot_values;
pub use hemisphere::lambert;

/// What makes a problem hard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// Analytic, no narrow peaks.
    Smooth,
    /// Continuous with kinks, or with a moderate peak.
    Rough,
    /// A jump along a curve of moderate length.
    Edge,
    /// Small bright features, which may be known or enlarged.
    Compact,
    /// Many small features, or boundaries as long as the domain is large.
    Ragged,
}

impl Class {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Class::Smooth => "smooth",
            Class::Rough => "rough",
            Class::Edge => "edge",
            Class::Compact => "compact",
            Class::Ragged => "ragged",
        }
    }
}

/// A family of integrals.
#[derive(Clone, Copy)]
pub struct Problem {
    /// Short name, such as "H3 1°".
    pub name: &'static str,
    /// What makes it hard.
    pub class: Class,
    make: fn(Key) -> Instance,
}

impl std::fmt::Debug for Problem {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name)
    }
}

impl Problem {
    /// One integral of the family.
    pub fn instance(&self, key: Key) -> Instance {
        (self.make)(key)
    }
}

type Function = Box<dyn Fn(&Probe) -> f64 + Send + Sync>;

/// An integral over the unit square with its exact value.
pub struct Instance {
    /// The value.
    pub exact: f64,
    /// Where its luminaires are, with their contributions (for methods that are told).
    pub features: Vec<Region>,
    /// The integrand; luminaires obey [`Probe::size`].
    pub function: Function,
}

impl Instance {
    fn plain(exact: f64, f: impl Fn(Uv<f64>) -> f64 + Send + Sync + 'static) -> Self {
        Instance { exact, features: Vec::new(), function: Box::new(move |p| f(p.uv)) }
    }

    /// Over directions, without the cosine.
    fn directions(exact: f64, f: impl Fn(Dir<f64>) -> f64 + Send + Sync + 'static) -> Self {
        Instance::plain(exact, move |uv| 2.0 * PI * f(Concentric.dir(uv)))
    }
}

impl Integrand<f64> for &Instance {
    fn eval(&mut self, at: &[Probe], out: &mut [f64]) {
        for (o, p) in out.iter_mut().zip(at) {
            *o = (self.function)(p);
        }
    }
}

/// Disks of value `flux`/area on a background: the report's pixel (section 4), and its relatives.
pub fn disks(disks: Vec<(Uv<f64>, f64, f64)>, background: f64) -> Instance {
    let area: f64 = disks.iter().map(|d| PI * d.1 * d.1).sum();
    let exact = background * (1.0 - area) + disks.iter().map(|d| d.2).sum::<f64>();
    let region =
        |d: &(Uv<f64>, f64, f64)| Region { shape: Shape::Disk { centre: d.0, radius: d.1 }, weight: d.2 };
    let features = disks.iter().map(region).collect();
    let function = move |p: &Probe| {
        let mut sum = 0.0;
        for (c, r, flux) in &disks {
            let r = match p.size {
                Size::True => *r,
                Size::Times(k) => r * k.sqrt(),
                Size::AtLeast(least) => r.max(least),
            };
            let (x, y) = (p.uv.u - c.u, p.uv.v - c.v);
            if x * x + y * y <= r * r {
                sum += flux / (PI * r * r);
            }
        }
        if sum > 0.0 { sum } else { background }
    };
    Instance { exact, features, function: Box::new(function) }
}

/// A luminaire on the hemisphere: a cap of half-angle `s` radians about `axis` whose projected flux would be `flux` at the zenith.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    /// Where.
    pub axis: Dir<f64>,
    /// Half-angle in radians.
    pub s: f64,
    /// Its projected integral over cos of its polar angle.
    pub flux: f64,
}

/// Luminaires on the hemisphere over a uniform background radiance, projected. The lamps add to the background.
pub fn lamps(lamps: Vec<Lamp>, background: f64) -> Instance {
    let exact = PI * background + lamps.iter().map(|l| l.flux * l.axis.z).sum::<f64>();
    let region = |l: &Lamp| Region { shape: Shape::cap(l.axis, l.s), weight: l.flux * l.axis.z };
    let features = lamps.iter().map(region).collect();
    let places: Vec<Uv<f64>> =
        lamps.iter().map(|l| Concentric.uv(l.axis).unwrap_or(Uv::new(0.5, 0.5))).collect();
    // |d - a| ≤ 2 sin(s/2), squared.
    let chord2 = |s: f64| 4.0 * (0.5 * s.min(PI)).sin() * (0.5 * s.min(PI)).sin();
    let chords: Vec<f64> = lamps.iter().map(|l| chord2(l.s)).collect();
    let function = move |p: &Probe| {
        let d = Concentric.dir(p.uv);
        let mut value = 2.0 * PI * background * d.z;
        for ((l, c), chord) in lamps.iter().zip(&places).zip(&chords) {
            let (s, chord) = match p.size {
                Size::Times(k) => (l.s * k.sqrt(), chord2(l.s * k.sqrt())),
                _ => (l.s, *chord),
            };
            let (x, y, z) = (d.x - l.axis.x, d.y - l.axis.y, d.z - l.axis.z);
            let lit = x * x + y * y + z * z <= chord;
            match p.size {
                // As a disk on the square, until even the narrowest image of the cap is wider.
                Size::AtLeast(r) if r * Concentric::LARGEST_STRETCH > s => {
                    let lit = lit || (p.uv.u - c.u).hypot(p.uv.v - c.v) <= r;
                    value += f64::from(u8::from(lit)) * l.flux * l.axis.z / (PI * r * r).max(0.5 * chord);
                }
                _ if lit => {
                    let sin = s.min(0.5 * PI).sin();
                    value += 2.0 * d.z * l.flux / (sin * sin);
                }
                _ => {}
            }
        }
        value
    };
    Instance { exact, features, function: Box::new(function) }
}

/// All problems.
pub fn problems() -> Vec<Problem> {
    let mut all = hemisphere::problems();
    all.extend(genz::problems());
    all
}

/// The problems of a class.
pub fn of_class(class: Class) -> Vec<Problem> {
    problems().into_iter().filter(|p| p.class == class).collect()
}
