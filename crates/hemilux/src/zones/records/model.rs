//! Where an image is seen: what the records of one signature have in common, anywhere and in one neighbourhood.
//!
//! A virtual luminaire is seen *at* its image and *through* the patches of its chain (the image method of H. Rushmeier and
//! K. Torrance 1990, with both found from records instead of geometry). Where a chain consists of flat mirrors, the image
//! and the mirrored patches lie at fixed places, whoever looks; then a [`Place`] is exact. Flat refraction and distant
//! luminaires come close. Where the chain is curved, no place explains the records, and the direction is regressed on the
//! position instead ([`Linear`]): the slope is the curvature of the wave front, learnt instead of computed.

use super::exact::Turns;
use super::{Exact, Record};
use crate::world::outline::{Outline, RIM, ROUNDING};
use crate::zones::wire::wire;
use hemilux_scene::geom::{DVec3, Frame, Vec3};
use std::collections::HashMap;

/// A ball that the ray to an image goes through.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    /// m.
    pub centre: Vec3,
    /// m; infinite where nothing is known.
    pub radius: f32,
}

wire!(Place { centre, radius });
wire!(Outline { corner, sides, triangle });
wire!(Window { centre, normal, axes, outline });
wire!(Signature { places, windows, roomy, fill, strength, kind, centred, scattered, turns });
wire!(Turns { bits });
wire!(Linear { p, frame, slope, sin2, long });

impl Place {
    const ANYWHERE: Place = Place { centre: Vec3::ZERO, radius: f32::INFINITY };

    /// Around the `point`s of the records; `known` is the radius of what they come from, if known.
    fn fit(records: &[Record], point: impl Fn(&Record) -> Vec3, known: Option<f32>) -> Place {
        let n = records.len() as f32;
        // In double precision: of 100,000 like terms a single-precision sum loses 1 %, more than a small image is wide.
        let centre = (records.iter().map(|r| point(r).as_dvec3()).sum::<DVec3>() / n as f64).as_vec3();
        let spread = records.iter().map(|r| (point(r) - centre).length_squared()).fold(0.0, f32::max).sqrt();
        // Few points do not show the extent of what they come from.
        let shown = spread * (1.0 + 2.0 / n);
        let radius = match known {
            // As large as the luminaire if that explains what is seen; the mean of few points is off its centre.
            Some(known) if shown <= 1.5 * known => known * (1.05 + 1.0 / n.sqrt()).min(1.6),
            Some(known) => shown.max(known),
            None if records.len() < 4 => return Place::ANYWHERE,
            None => shown * 1.05,
        };
        if centre.is_finite() { Place { centre, radius } } else { Place::ANYWHERE }
    }

    /// Around the image whose middle each of the records knows, but for what refraction at planes adds where they lie apart.
    fn around_middles(records: &[Record]) -> Place {
        let n = records.len() as f64;
        let centre = (records.iter().map(|r| r.image().as_dvec3()).sum::<DVec3>() / n).as_vec3();
        let spread = records.iter().map(|r| (r.image() - centre).length_squared()).fold(0.0, f32::max).sqrt();
        Place { centre, radius: MIDDLE * records[0].radius + spread }
    }

    /// Squared sine of the half-angle at which it is seen from `x`; 1 from inside and where nothing is known.
    #[inline]
    pub fn sin2(&self, x: Vec3) -> f32 {
        let s = self.radius * self.radius / (self.centre - x).length_squared();
        if s < 1.0 { s } else { 1.0 }
    }
}

/// The rectangle that a patch fills.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    /// m.
    centre: Vec3,
    /// Unit, across the rectangle.
    normal: Vec3,
    /// Unit axes and half-lengths (m).
    axes: [(Vec3, f32); 2],
    /// What it is exactly, where surfaces and not records have shown it.
    pub outline: Option<Outline>,
}

/// The part of an image that is seen through a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// What holds it.
    pub outline: Outline,
    /// Whether the window cuts some of the image off.
    pub clipped: bool,
    /// Area across the ray that shows the image (m²).
    pub shown: f32,
    /// Distance along the ray (m).
    pub distance: f32,
}

impl Part {
    /// The ball around it, as seen along unit `axis`: centre (m), squared radius (m²).
    pub fn ball(&self, axis: Vec3) -> (Vec3, f32) {
        let across = |d: Vec3| (d - axis * axis.dot(d)).length_squared();
        let [a, b] = self.outline.sides;
        (self.outline.middle(), 0.25 * across(a + b).max(across(a - b)))
    }
}

impl Window {
    /// The smallest rectangle, of a few turns, around `points` in the plane they spread over most.
    fn fit(points: &[Vec3]) -> Option<Window> {
        let mean = points.iter().sum::<Vec3>() / points.len() as f32;
        let longest = |f: &dyn Fn(Vec3) -> Vec3| {
            points
                .iter()
                .map(|p| f(*p - mean))
                .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
        };
        let a = longest(&|p| p)?.try_normalize()?;
        let b = longest(&|p| p - a * a.dot(p))?.try_normalize()?;
        let margin = 1.0 + 2.0 / points.len() as f32;
        let turned = |i: u32| {
            let (s, c) = (i as f32 * std::f32::consts::FRAC_PI_2 / TURNS as f32).sin_cos();
            let mut centre = mean;
            let axes = [a * c + b * s, b * c - a * s].map(|u| {
                let along = points.iter().map(|p| u.dot(*p - mean));
                let (low, high) = along.fold((f32::MAX, f32::MIN), |r, v| (r.0.min(v), r.1.max(v)));
                centre += u * (0.5 * (low + high));
                (u, margin * 0.5 * (high - low))
            });
            Window { centre, normal: axes[0].0.cross(axes[1].0), axes, outline: None }
        };
        (0..TURNS)
            .map(turned)
            .min_by(|x, y| (x.axes[0].1 * x.axes[1].1).total_cmp(&(y.axes[0].1 * y.axes[1].1)))
    }

    /// The rectangle around `outline`, along its longer side.
    fn of(outline: &Outline) -> Option<Window> {
        let [a, b] = outline.sides;
        let along = if a.length_squared() >= b.length_squared() { a } else { b };
        let normal = a.cross(b).try_normalize()?;
        let u = along.try_normalize()?;
        let axes = [u, normal.cross(u)];
        let far = if outline.triangle { Vec3::ZERO } else { a + b };
        let corners = [Vec3::ZERO, a, b, far];
        let mut centre = outline.corner;
        let axes = axes.map(|u| {
            let along = corners.map(|c| u.dot(c));
            let (low, high) = along.iter().fold((f32::MAX, f32::MIN), |r, v| (r.0.min(*v), r.1.max(*v)));
            centre += u * (0.5 * (low + high));
            (u, 0.5 * (high - low))
        });
        Some(Window { centre, normal, axes, outline: Some(*outline) })
    }

    /// Whether it is known exactly, and all within `radius` of `x` lies on the same side of its plane as the image: no ray leads there
    /// through it.
    fn is_before(&self, x: Vec3, radius: f32, image: &Place) -> bool {
        let side = |p: Vec3, radius: f32| {
            let off = self.normal.dot(p - self.centre);
            if off.abs() > radius { off.signum() } else { 0.0 }
        };
        self.outline.is_some() && side(x, radius) * side(image.centre, image.radius) > 0.0
    }

    /// `x`, or where its plane passes within `radius` of `x` and it is known exactly, a point beside that is clearly on the other side of the plane
    /// than `image`: from there it is judged what is seen through it, for behind it, or from the plane itself, nothing is.
    pub fn before(&self, x: Vec3, radius: f32, image: &Place) -> Vec3 {
        let off = |p: Vec3| self.normal.dot(p - self.centre);
        let side = -off(image.centre).signum();
        let least = CLEARLY * radius;
        match self.outline {
            Some(_) if off(x).abs() <= radius && side * off(x) < least => {
                x + self.normal * (side * least - off(x))
            }
            _ => x,
        }
    }

    /// How much larger than it seems it is taken to be.
    fn margin(&self) -> f32 {
        if self.outline.is_some() { 1.0 } else { ROOMY }
    }

    /// Its smaller half-length (m).
    pub fn narrow(&self) -> f32 {
        self.axes[0].1.min(self.axes[1].1)
    }

    /// Whether the ray from `x` along `d` goes through it, give or take `slack` (m).
    #[inline]
    pub fn passes(&self, x: Vec3, d: Vec3, slack: f32) -> bool {
        let t = (self.centre - x).dot(self.normal) / d.dot(self.normal);
        if !(t > 0.0 && t < f32::MAX) {
            return false;
        }
        let met = x + d * t - self.centre;
        self.axes.iter().all(|(u, half)| u.dot(met).abs() <= self.margin() * half + slack)
    }

    /// What is seen through it from `x` of a ball around unit `axis` with half-angle `angle` (radians, small), give or take
    /// `slack` (m); nothing if the two do not overlap. Both axes are treated alone: the ball counts as a square.
    #[inline]
    pub fn part(&self, x: Vec3, axis: Vec3, angle: f32, slack: f32) -> Option<Part> {
        let cos = axis.dot(self.normal);
        let distance = (self.centre - x).dot(self.normal) / cos;
        if !(distance > 0.0 && distance < f32::MAX) {
            return None;
        }
        let met = x + axis * distance - self.centre;
        let blur = angle * distance;
        let (mut corner, mut sides) = (self.centre, [Vec3::ZERO; 2]);
        let (mut clipped, mut covered) = (false, 1.0);
        for (i, (u, half)) in self.axes.iter().enumerate() {
            // The ball's shadow on the plane is longer where the plane is tilted.
            let tilt = u.dot(axis) / cos;
            let reach = (blur + slack) * (1.0 + tilt * tilt).sqrt();
            let (at, half) = (u.dot(met), self.margin() * half);
            let (low, high) = ((at - reach).max(-half), (at + reach).min(half));
            if low >= high {
                return None;
            }
            clipped |= high - low < 1.99 * reach;
            covered *= (high - low) / (2.0 * half);
            corner += *u * low;
            sides[i] = *u * (high - low);
        }
        let area = sides[0].length() * sides[1].length() * cos.abs();
        let triangle = self.outline.filter(|o| o.triangle);
        // The image is round, not square; a triangle fills half of its rectangle.
        let round = if covered > WHOLE { 1.0 } else { std::f32::consts::FRAC_PI_4 };
        let shown = area * round * if triangle.is_some() { 0.5 } else { 1.0 };
        let part = Outline { corner, sides, triangle: false };
        let outline = triangle.filter(|_| covered > TRIANGULAR).unwrap_or(part);
        Some(Part { outline, clipped, shown, distance })
    }
}

/// Of the radius of a spot: how far from a plane a point of it is that lies on one side.
const CLEARLY: f32 = 0.3;
/// An image that covers so much of a window covers all of it.
const WHOLE: f32 = 0.9;
/// A part that covers so much of the rectangle around a triangle is left to the triangle.
const TRIANGULAR: f32 = 0.5;
/// Images and windows that records show are taken to be this much larger than they seem: too wide costs less than too narrow.
const ROOMY: f32 = 1.1;
/// Images whose middle is known are taken to be this much larger than their luminaire, for prisms stretch them.
const MIDDLE: f32 = 1.1;
/// Where few records show a signature, the patch before the last counts as so much larger: its neighbours, unrecorded, show the same.
const SIBLINGS: f32 = 2.5;
/// Records whose images lie within so many radii of the luminaire show one and the same.
const EXPLAINED: f32 = 2.0;
/// Turns that are tried for a window.
const TURNS: u32 = 12;

/// What the records of one signature have in common wherever they lie.
#[derive(Clone, Copy, Debug)]
pub(super) struct Signature {
    /// The image; then the last patch of the chain, and the one before as seen through it.
    pub places: [Place; 3],
    /// The patches' rectangles, where surfaces say them or records are many.
    pub windows: [Option<Window>; 2],
    /// How much larger than it seems the image is taken to be.
    pub roomy: f32,
    /// How much of the ball around the image shows it.
    pub fill: f32,
    /// Radiance of the luminaire times what the chain leaves of it (luminance, W·sr⁻¹·m⁻²).
    pub strength: f32,
    /// 1 if the source is a bright zone, 0 if it is a luminaire.
    pub kind: u8,
    /// 1 if every record knows the middle of the image.
    pub centred: u8,
    /// 1 if no one image explains the records.
    pub scattered: u8,
    /// Which way the chain goes at each interface.
    pub turns: Turns,
}

/// A patch may move so much of its half-width against the image, and a way may differ by so much of its length, before
/// another is seen.
const ALIKE: f32 = 0.3;
const SHORT: f32 = 0.1;
/// Records from which on a signature shows the size of its patches.
const SHOWN: usize = 8;

/// Give the signatures of few records patches of the size that others of their class have.
pub(super) fn fit_classes(signatures: &mut [Signature], groups: &[&mut [Record]]) {
    let mut sizes: HashMap<u32, [Vec<f32>; 2]> = HashMap::new();
    for (signature, group) in signatures.iter().zip(groups) {
        if group.len() >= SHOWN {
            let class = sizes.entry(group[0].class).or_default();
            (0..2).for_each(|k| class[k].push(signature.places[k + 1].radius));
        }
    }
    for class in sizes.values_mut().flatten() {
        class.sort_by(f32::total_cmp);
    }
    for (signature, group) in signatures.iter_mut().zip(groups) {
        let Some(class) = sizes.get(&group[0].class).filter(|_| group.len() < SHOWN) else { continue };
        for k in 0..2 {
            if signature.windows[k].is_some_and(|w| w.outline.is_some()) {
                continue;
            }
            // The upper quartile; the centre of few points is uncertain by as much again over their root.
            let typical = class[k][class[k].len() * 3 / 4] * (1.0 + 1.0 / (group.len() as f32).sqrt());
            let n = group.len() as f32;
            let centre = group.iter().map(|r| r.p + r.dir * r.reach[k]).sum::<Vec3>() / n;
            let place = &mut signature.places[k + 1];
            if typical < place.radius || !place.radius.is_finite() {
                *place = Place { centre, radius: typical };
            }
        }
    }
}

impl Signature {
    /// Whether it is known where the image is and what limits it.
    pub fn is_known(&self) -> bool {
        let [image, last, before] = self.places.map(|p| p.radius.is_finite());
        image && last && (before || self.centred != 0)
    }

    /// Whether it is known that the image is not seen from anywhere within `radius` of `x`: some patch of the chain lies
    /// beside every ray to it.
    pub fn is_missed_from(&self, x: Vec3, radius: f32) -> bool {
        let to_image = self.places[0].centre - x;
        let distance = to_image.length();
        let angle = self.places[0].radius / distance;
        // Close by or all around, anything can be seen.
        if !(distance > 2.0 * radius && angle < 0.5) {
            return false;
        }
        let axis = to_image / distance;
        (0..2).any(|k| {
            let place = &self.places[k + 1];
            let along = (place.centre - x).dot(axis);
            // How far the ray to the image moves at the patch when `x` does.
            let slack = 1.5 * radius * (1.0 - along / distance).abs();
            match self.windows[k] {
                Some(window) if window.is_before(x, radius, &self.places[0]) => true,
                Some(window) => {
                    along > 1.5 * radius && window.part(x, axis, angle * self.roomy, slack).is_none()
                }
                None => {
                    let offset = axis * along - (place.centre - x);
                    along > 1.5 * (radius + place.radius)
                        && offset.length() > place.radius + angle * along + slack
                }
            }
        })
    }

    /// `x`, or a point within `radius` of it that is on the right side of what the image is seen through.
    pub fn seen_from(&self, x: Vec3, radius: f32) -> Vec3 {
        let image = &self.places[0];
        self.windows.iter().flatten().fold(x, |x, window| window.before(x, radius, image))
    }

    /// How far from `x` the image is seen through about the same part of its patches (m).
    pub fn grain(&self, x: Vec3) -> f32 {
        let image = self.places[0];
        let distance = (image.centre - x).length();
        let axis = (image.centre - x) / distance;
        let through = |k: usize| {
            let place = &self.places[k + 1];
            let along = (place.centre - x).dot(axis);
            let narrow = self.windows[k].map_or(place.radius, |w| w.narrow());
            let size = narrow + image.radius / distance * along.abs();
            (ALIKE * size / (1.0 - along / distance).abs()).min(SHORT * along.abs())
        };
        through(0).min(through(1)).min(SHORT * distance)
    }

    pub fn fit(records: &[Record], exact: &Exact) -> Signature {
        let n = records.len() as f32;
        let centred = records[0].aside.is_some();
        let outlines = exact.outlines.map(|o| o.map(|o| o.with_rim()));
        let exactly = outlines.map(|o| o.as_ref().and_then(Window::of));
        let window = |k: usize| {
            exactly[k].or_else(|| {
                let points: Vec<Vec3> = records.iter().map(|r| r.p + r.dir * r.reach[k]).collect();
                if records.len() >= SHOWN { Window::fit(&points) } else { None }
            })
        };
        let patch = |k: usize| match outlines[k] {
            Some(outline) => {
                let (centre, radius) = outline.ball();
                Place { centre, radius }
            }
            None => {
                let mut place = Place::fit(records, |r| r.p + r.dir * r.reach[k], None);
                if k == 1
                    && centred
                    && records.len() < SHOWN
                    && let Some(radius) = exact.before
                {
                    let sum = records.iter().map(|r| r.p + r.dir * r.reach[1]).sum::<Vec3>();
                    place = Place { centre: sum / n, radius: SIBLINGS * radius };
                }
                place
            }
        };
        let (image, roomy) = match exact.image {
            Some(centre) => {
                let rim = ROUNDING * centre.abs().max_element();
                (Place { centre, radius: (1.0 + RIM) * records[0].radius + rim }, 1.0)
            }
            None if centred => (Place::around_middles(records), ROOMY),
            None => (Place::fit(records, Record::image, Some(records[0].radius)), ROOMY),
        };
        Signature {
            windows: [window(0), window(1)],
            places: [image, patch(0), patch(1)],
            roomy,
            fill: exact.fill,
            strength: records.iter().map(|r| r.strength).sum::<f32>() / n,
            kind: records[0].of_zone as u8,
            centred: centred as u8,
            scattered: (image.radius > EXPLAINED * records[0].radius) as u8,
            turns: exact.turns,
        }
    }
}

/// Direction linear in position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Linear {
    /// Mean position (m).
    p: Vec3,
    /// Around the mean direction.
    frame: Frame,
    slope: [[f32; 2]; 2],
    /// Squared sine of the half-angle that holds what the slope leaves.
    pub sin2: f32,
    /// Where that is far longer than wide, its half-axes in the frame (radians).
    long: Option<[[f32; 2]; 2]>,
}

/// Records that a regression needs.
const ENOUGH: usize = 8;
/// A cone reaches this many root mean squares (per axis) of what a regression leaves: 2 would be the edge of an even disk.
const REACH: f32 = 2.8;

/// A rectangle reaches so many along each of its axes (an even bar: 1.7), ...
const LONG_REACH: f32 = 2.4;
/// ... and is used instead of a cone where one is so many times the other.
const LONG: f32 = 2.0;

impl Linear {
    /// The regression of `group`, if it is large enough and spread out.
    pub fn fit(group: &[Record]) -> Option<Linear> {
        if group.len() < ENOUGH {
            return None;
        }
        let count = group.len() as f32;
        let p = group.iter().map(|r| r.p).sum::<Vec3>() / count;
        let frame = Frame::from_normal(group.iter().map(|r| r.dir).sum::<Vec3>().try_normalize()?);
        let plane = |v: Vec3| [frame.s.dot(v), frame.t.dot(v)];
        let slope = regress(group, p, &plane)?;
        let mut spread = [0f32; 3];
        for r in group {
            let (x, d) = (plane(r.p - p), plane(r.dir));
            let off = [0, 1].map(|i: usize| d[i] - slope[i][0] * x[0] - slope[i][1] * x[1]);
            spread[0] += off[0] * off[0];
            spread[1] += off[1] * off[1];
            spread[2] += off[0] * off[1];
        }
        let [xx, yy, xy] = spread.map(|s| s / (count - 3.0));
        let variance = 0.5 * (xx + yy);
        // The residual itself is uncertain: wider where records are few.
        let unsure = 1.0 + 1.5 / (count - 3.0).sqrt();
        let angle = REACH * variance.sqrt() * unsure;
        let long = longish([xx, yy, xy], LONG_REACH * unsure);
        Some(Linear { p, frame, slope, sin2: (angle * angle).min(1.0), long })
    }

    /// The regressions of the images that `group` holds: one, or up to four where a fold shows the luminaire several times
    /// and halving the group by direction explains it far better. Each with the part of the group it stands for, as
    /// lengths in order; `group` is put in that order.
    pub fn fit_images(group: &mut [Record], depth: u32) -> Vec<(Option<Linear>, usize)> {
        let whole = Linear::fit(group);
        let seen = group[0].radius / group[0].length;
        let loose = whole.is_none_or(|l| l.sin2 > 9.0 * seen * seen);
        if depth == 0 || group.len() < 2 * ENOUGH || !loose {
            return vec![(whole, group.len())];
        }
        let count = halve(group);
        let (a, b) = group.split_at_mut(count);
        if a.len() < ENOUGH || b.len() < ENOUGH {
            return vec![(whole, group.len())];
        }
        let mut parts = Linear::fit_images(a, depth - 1);
        parts.extend(Linear::fit_images(b, depth - 1));
        let all: f32 = parts.iter().map(|p| p.0.map_or(1.0, |l| l.sin2)).sum();
        if all < 0.5 * whole.map_or(1.0, |l| l.sin2) { parts } else { vec![(whole, group.len())] }
    }

    /// What holds it as a rectangle 1 m from `x`, where it is long.
    pub fn rectangle(&self, x: Vec3) -> Option<Outline> {
        let [a, b] = self.long?.map(|[u, v]| self.frame.s * u + self.frame.t * v);
        let corner = x + self.dir(x) - a - b;
        Some(Outline { corner, sides: [a * 2.0, b * 2.0], triangle: false })
    }

    /// The direction at `x`, unit.
    #[inline]
    pub fn dir(&self, x: Vec3) -> Vec3 {
        let d = x - self.p;
        let (u, v) = (self.frame.s.dot(d), self.frame.t.dot(d));
        let a = self.slope[0][0] * u + self.slope[0][1] * v;
        let b = self.slope[1][0] * u + self.slope[1][1] * v;
        (self.frame.n + self.frame.s * a + self.frame.t * b).normalize()
    }
}

/// The half-axes of the rectangle that reaches so many root mean squares along the axes of a spread (variances, covariance), if one is far longer
/// than the other.
fn longish([xx, yy, xy]: [f32; 3], reach: f32) -> Option<[[f32; 2]; 2]> {
    let (mean, half) = (0.5 * (xx + yy), (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt());
    let (most, least) = (mean + half, (mean - half).max(1e-3 * mean));
    if least * LONG * LONG >= most || !most.is_finite() {
        return None;
    }
    let turn = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = turn.sin_cos();
    let (a, b) = (reach * most.sqrt(), reach * least.sqrt());
    Some([[a * cos, a * sin], [-b * sin, b * cos]])
}

/// Order records so that two clusters of direction follow one another (two-means); returns the length of the first.
fn halve(group: &mut [Record]) -> usize {
    let farthest = |from: Vec3| {
        let far = |a: &&Record, b: &&Record| {
            (a.dir - from).length_squared().total_cmp(&(b.dir - from).length_squared())
        };
        group.iter().max_by(far).map_or(from, |r| r.dir)
    };
    let first = farthest(group[0].dir);
    let mut centres = [first, farthest(first)];
    let nearer = |r: &Record, c: &[Vec3; 2]| {
        ((r.dir - c[1]).length_squared() < (r.dir - c[0]).length_squared()) as usize
    };
    for _ in 0..4 {
        let mut sums = [(Vec3::ZERO, 0.0f32); 2];
        for r in group.iter() {
            let sum = &mut sums[nearer(r, &centres)];
            *sum = (sum.0 + r.dir, sum.1 + 1.0);
        }
        centres = [0, 1].map(|i| if sums[i].1 > 0.0 { sums[i].0 / sums[i].1 } else { centres[i] });
    }
    group.sort_by_key(|r| nearer(r, &centres));
    group.partition_point(|r| nearer(r, &centres) == 0)
}

/// Least squares: the 2 × 2 matrix that carries tangential displacement to change of direction.
fn regress(group: &[Record], p: Vec3, plane: &impl Fn(Vec3) -> [f32; 2]) -> Option<[[f32; 2]; 2]> {
    let (mut xx, mut dx) = ([[0f64; 2]; 2], [[0f64; 2]; 2]);
    for r in group {
        let (x, d) = (plane(r.p - p), plane(r.dir));
        for i in 0..2 {
            for j in 0..2 {
                xx[i][j] += x[i] as f64 * x[j] as f64;
                dx[i][j] += d[i] as f64 * x[j] as f64;
            }
        }
    }
    let determinant = xx[0][0] * xx[1][1] - xx[0][1] * xx[1][0];
    if determinant <= 1e-6 * (xx[0][0] + xx[1][1]).powi(2) {
        return None;
    }
    let inverse = [
        [xx[1][1] / determinant, -xx[0][1] / determinant],
        [-xx[1][0] / determinant, xx[0][0] / determinant],
    ];
    Some(
        [0, 1].map(|i: usize| {
            [0, 1].map(|j: usize| (dx[i][0] * inverse[0][j] + dx[i][1] * inverse[1][j]) as f32)
        }),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use hemiquad::points::{Key, sobol};

    /// Arrivals from a bar a tenth as thick as it is long, whose image turns as the place does, and ones from a disk.
    fn arrivals(thick: f32) -> Vec<Record> {
        let one = |i: u32| {
            let (a, b) = (sobol(i, Key::new(1)), sobol(i, Key::new(2)));
            let p = Vec3::new(a.u - 0.5, a.v - 0.5, 0.0) * 0.1;
            let (along, across) = (0.1 * (b.u - 0.5), 0.1 * thick * (b.v - 0.5));
            // Aslant in the frame.
            let (u, v) = (0.8 * along - 0.6 * across, 0.6 * along + 0.8 * across);
            let dir = Vec3::new(0.3 + u + 2.0 * p.x, v - p.y, 1.0).normalize();
            let (reach, aside) = ([0.5; 2], None);
            let (signature, class, radius, flux, strength, of_zone) = (7, 7, 0.05, 1.0, 1.0, false);
            let length = 1.0;
            let n = Vec3::Z;
            Record { p, n, dir, reach, length, aside, signature, class, radius, flux, strength, of_zone }
        };
        (0..128).map(one).collect()
    }

    #[test]
    fn a_long_image_gets_a_rectangle_that_follows_its_place() {
        let bar = Linear::fit(&arrivals(0.1)).expect("a regression");
        let area = |l: &Linear| l.rectangle(Vec3::ZERO).map(|o| o.area());
        // The cone around it: 1 - cos of the half-angle is half its squared sine.
        let cone = std::f32::consts::PI * bar.sin2;
        assert!(area(&bar).is_some_and(|a| a < 0.35 * cone), "{:?} of {cone}", area(&bar));
        let holds = |l: &Linear, r: &Record, from: Vec3| {
            let Some(Outline { corner, sides, .. }) = l.rectangle(from) else { return false };
            let n = sides[0].cross(sides[1]);
            let met = r.dir * (n.dot(corner - from) / n.dot(r.dir)) + from - corner;
            sides.iter().all(|s| (0.0..=1.0).contains(&(met.dot(*s) / s.length_squared())))
        };
        let all = arrivals(0.1);
        let held = all.iter().filter(|r| holds(&bar, r, r.p)).count();
        assert!(held >= 126, "{held} of 128");
        // Negative control: one that stays where it is.
        let stays = all.iter().filter(|r| holds(&Linear { slope: [[0.0; 2]; 2], ..bar }, r, r.p)).count();
        assert!(stays < 64, "{stays} of 128");
        // A round one keeps its cone.
        assert!(Linear::fit(&arrivals(1.0)).is_some_and(|l| l.long.is_none()));
    }
}
