//! How a candidate is seen from a point: in which shape, and how much of it.
//!
//! The shape is a cone around the image, or by regression, or the flat piece of a patch that lets the image through, whichever
//! is tightest; what other patches of the chain leave of it is judged at a few points of it.

use super::model::Signature;
use super::{Candidate, LOOSE, NONE, Records};
use crate::world::outline::Outline;
use hemilux_scene::geom::{Frame, Vec3};

/// No cone is wider than this (1 − cos): there an image is only guessed at.
const WIDEST: f32 = 0.15;
/// What is guessed of a place that shows an image somewhere.
const LOOSELY: f32 = 1e-3;
/// An image that is seen from elsewhere in the spot only counts this much.
const BESIDE: f32 = 0.05;

/// 1 − cos of a half-angle from its squared sine.
#[inline]
pub(super) fn height_of(sin2: f32) -> f32 {
    let sin2 = sin2.min(1.0);
    (0.5 * sin2 * (1.0 + 0.25 * sin2)).clamp(1e-12, WIDEST)
}

/// What directions towards a candidate are drawn from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shape {
    /// The cone around a ball.
    Ball { centre: Vec3, radius2: f32 },
    /// A flat piece.
    Flat(Outline),
}

impl Shape {
    /// Centre (m) and squared radius (m²) of a ball around it.
    pub fn ball(&self) -> (Vec3, f32) {
        match self {
            Shape::Ball { centre, radius2 } => (*centre, *radius2),
            Shape::Flat(outline) => {
                let (centre, radius) = outline.ball();
                (centre, radius * radius)
            }
        }
    }

    /// Points spread over it, as seen from `x` (m).
    fn points(&self, x: Vec3) -> [Vec3; 5] {
        const OUT: f32 = 0.7;
        match self {
            Shape::Ball { centre, radius2 } => {
                let Frame { s, t, .. } = Frame::from_normal((*centre - x).normalize_or(Vec3::Z));
                let r = OUT * radius2.sqrt();
                [*centre, *centre + s * r, *centre - s * r, *centre + t * r, *centre - t * r]
            }
            Shape::Flat(Outline { corner, sides, triangle }) => {
                let at = |u: f32, v: f32| *corner + sides[0] * u + sides[1] * v;
                match triangle {
                    true => [at(0.33, 0.33), at(0.15, 0.15), at(0.7, 0.15), at(0.15, 0.7), at(0.42, 0.42)],
                    false => [at(0.5, 0.5), at(0.15, 0.15), at(0.85, 0.15), at(0.15, 0.85), at(0.85, 0.85)],
                }
            }
        }
    }

    /// How large it is from `x`: solid angle over 2π, for a flat piece as if it were far away.
    pub fn extent(&self, x: Vec3) -> f32 {
        match self {
            Shape::Ball { centre, radius2 } => {
                height_of((radius2 / (*centre - x).length_squared().max(f32::MIN_POSITIVE)).min(1.0))
            }
            Shape::Flat(outline) => {
                let to = outline.middle() - x;
                let across =
                    outline.sides[0].cross(outline.sides[1]) * if outline.triangle { 0.5 } else { 1.0 };
                let distance2 = to.length_squared().max(f32::MIN_POSITIVE);
                (across.dot(to).abs() / (std::f32::consts::TAU * distance2 * distance2.sqrt())).min(1.0)
            }
        }
    }
}

/// How a candidate is seen: in which shape, and how much of that is expected to show the image, 0 to 1.
pub(super) struct View {
    pub shape: Shape,
    pub seen: f32,
}

impl Records {
    /// Whether a candidate may be seen from within `radius` of `x`: no patch is known to be beside every ray to its image.
    pub(super) fn sees(&self, c: &Candidate, x: Vec3, radius: f32) -> bool {
        if c.linear != NONE || c.gates == 0 {
            return true;
        }
        let signature = &self.signatures[c.signature as usize];
        let Signature { places, windows, roomy, .. } = signature;
        let x = signature.seen_from(x, radius);
        let to_image = places[0].centre - x;
        let distance = to_image.length();
        let axis = to_image / distance;
        let angle = (places[0].radius / distance).min(1.0);
        (1..3).filter(|k| (c.gates | 1 << c.best) >> k & 1 != 0).all(|k| {
            let to = places[k].centre - x;
            let along = to.dot(axis);
            // How far the ray to the image moves at the patch as `x` does.
            let slack = radius * (1.0 - along / distance).abs();
            match &windows[k - 1] {
                Some(window) => window.part(x, axis, angle * roomy, slack).is_some(),
                // Both balls must lie on one ray.
                None => (axis * along - to).length() <= places[k].radius + angle * along.abs() + slack,
            }
        })
    }

    /// The view of a candidate from within `radius` of `x`; none if a patch is known to be beside every ray to its image.
    pub(super) fn view(&self, c: &Candidate, x: Vec3, radius: f32) -> Option<View> {
        if c.linear != NONE {
            let linear = &self.linears[c.linear as usize];
            let shape = Shape::Ball { centre: x + linear.dir(x), radius2: linear.sin2 };
            return Some(View { shape, seen: 1.0 });
        }
        let signature = &self.signatures[c.signature as usize];
        let Signature { places, windows, roomy, .. } = signature;
        let x = signature.seen_from(x, radius);
        let best = c.best as usize;
        let whole = match best.checked_sub(1).and_then(|k| windows[k]).and_then(|w| w.outline) {
            Some(outline) => Shape::Flat(outline),
            None => Shape::Ball {
                centre: places[best].centre,
                radius2: places[best].radius * places[best].radius,
            },
        };
        let loosely = if c.is_loose() { LOOSELY } else { 1.0 };
        let mut tightest = View { shape: whole, seen: loosely };
        let mut extent = whole.extent(x);
        let image = Shape::Ball { centre: places[0].centre, radius2: places[0].radius * places[0].radius };
        let distance = (places[0].centre - x).length();
        let axis = (places[0].centre - x) / distance;
        let angle = (places[0].radius / distance).min(1.0);
        // What is known exactly is asked from close by, too, though only whether it shows anything.
        for k in (1..3).filter(|k| c.gates >> k & 1 == 0 && best != *k) {
            let Some(window) = windows[k - 1].filter(|w| w.outline.is_some()) else { continue };
            let along = (places[k].centre - x).dot(axis);
            window.part(x, axis, angle * roomy, radius * (1.0 - along / distance).abs())?;
        }
        if c.gates & !LOOSE == 0 {
            return Some(tightest);
        }
        // Which window the shape is cut from.
        let mut from = best;
        for k in (1..3).filter(|k| (c.gates | 1 << c.best) >> k & 1 != 0) {
            let to = places[k].centre - x;
            let along = to.dot(axis);
            // How far the ray to the image moves at the patch as `x` does.
            let slack = radius * (1.0 - along / distance).abs();
            match &windows[k - 1] {
                Some(window) => {
                    let wide = window.part(x, axis, angle * roomy, slack)?;
                    let shape = match (wide.clipped, window.outline.is_some()) {
                        (false, _) => image,
                        (true, true) => Shape::Flat(wide.outline),
                        // What only records show may be curved: a cone around it holds it from any side.
                        (true, false) => {
                            let (centre, radius2) = wide.ball(axis);
                            Shape::Ball { centre, radius2 }
                        }
                    };
                    let size = shape.extent(x);
                    if size <= extent {
                        (extent, from) = (size, k);
                        let part = window.part(x, axis, angle * roomy, 0.0);
                        let shown = part.map_or(BESIDE * wide.shown, |p| p.shown);
                        let seen = shown / (wide.distance * wide.distance * std::f32::consts::TAU * size);
                        tightest = View { shape, seen: seen.min(1.0) * loosely };
                    }
                }
                // Both balls must lie on one ray.
                None => {
                    let offset = axis * along - to;
                    if offset.length() > places[k].radius + angle * along.abs() + slack {
                        return None;
                    }
                }
            }
        }
        // What the other windows leave of it.
        for k in (1..3).filter(|k| *k != from && c.gates >> k & 1 != 0) {
            let Some(window) = &windows[k - 1] else { continue };
            let far = (tightest.shape.ball().0 - x).length();
            let slack = radius * (1.0 - (places[k].centre - x).dot(axis) / far).abs();
            let points = tightest.shape.points(x);
            let passing = |slack: f32| points.iter().filter(|p| window.passes(x, **p - x, slack)).count();
            match passing(0.0) {
                0 if passing(slack) == 0 => return None,
                0 => tightest.seen *= BESIDE,
                some => tightest.seen *= some as f32 / points.len() as f32,
            }
        }
        Some(tightest)
    }
}
