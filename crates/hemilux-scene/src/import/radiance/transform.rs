//! `xform`'s transformations: similarities, perhaps mirrored, composed in the order in which they are written.

use super::Argument;
use crate::geom::{DAffine3, DVec3};
use crate::import::transform::rotate;

/// Copies that one `xform -a` may make.
pub const MAX_COPIES: u64 = 1_000_000;
/// Repetitions of one `-i`.
const MAX_REPEATS: u64 = 10_000;

/// Rotation, uniform scale > 0, translation, perhaps a mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Similarity {
    /// All of it.
    pub map: DAffine3,
    /// The uniform scale.
    pub scale: f64,
}

impl Similarity {
    /// Changes nothing.
    pub const IDENTITY: Similarity = Similarity { map: DAffine3::IDENTITY, scale: 1.0 };

    /// `self` first, then `after`.
    pub fn then(&self, after: &Similarity) -> Similarity {
        Similarity { map: after.map * self.map, scale: after.scale * self.scale }
    }

    /// Where a point goes.
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.map.transform_point3(p)
    }

    /// Where a direction goes, scaled.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.map.transform_vector3(v)
    }

    /// Whether handedness changes.
    pub fn mirrors(&self) -> bool {
        self.map.matrix3.determinant() < 0.0
    }

    /// Whether every coefficient is finite and nothing collapses.
    pub fn is_sound(&self) -> bool {
        self.map.is_finite() && self.scale.is_finite() && self.scale > 1e-30 && self.scale < 1e30
    }
}

/// What is wrong with an argument: its index and a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrong(pub usize, pub String);

/// One elementary transformation, `-i n`, or `-a n`.
enum Step {
    Map(Similarity),
    Repeat(u64),
    Array(u64),
}

fn number(args: &[Argument], i: usize, option: &str) -> Result<f64, Wrong> {
    let Some(a) = args.get(i) else {
        return Err(Wrong(i.saturating_sub(1), format!("option {option} of xform lacks a number")));
    };
    match a.text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(Wrong(i, format!("option {option} of xform: \"{}\" is not a finite number", a.text))),
    }
}

fn count(args: &[Argument], i: usize, option: &str, most: u64) -> Result<u64, Wrong> {
    let Some(a) = args.get(i) else {
        return Err(Wrong(i.saturating_sub(1), format!("option {option} of xform lacks a count")));
    };
    match a.text.parse::<u64>() {
        Ok(n) if n <= most => Ok(n),
        Ok(n) => Err(Wrong(i, format!("option {option} of xform: {n} is more than {most}"))),
        Err(_) => Err(Wrong(i, format!("option {option} of xform: \"{}\" is not a count", a.text))),
    }
}

/// The transformation that begins at argument `i` and the index of what follows; `None` if there is none.
fn step(args: &[Argument], i: usize) -> Result<Option<(Step, usize)>, Wrong> {
    let option = args[i].text.as_str();
    let map = |map: DAffine3| Step::Map(Similarity { map, scale: 1.0 });
    let turn = |axis: DVec3| {
        let degrees = number(args, i + 1, option)?;
        Ok(Some((map(rotate(degrees, axis).unwrap_or(DAffine3::IDENTITY)), i + 2)))
    };
    let mirror = |v: DVec3| Ok(Some((map(DAffine3::from_scale(v)), i + 1)));
    match option {
        "-t" => {
            let at = |k| number(args, i + k, option);
            let v = DVec3::new(at(1)?, at(2)?, at(3)?);
            Ok(Some((map(DAffine3::from_translation(v)), i + 4)))
        }
        "-rx" => turn(DVec3::X),
        "-ry" => turn(DVec3::Y),
        "-rz" => turn(DVec3::Z),
        "-s" => {
            let s = number(args, i + 1, option)?;
            if s == 0.0 {
                return Err(Wrong(i + 1, "option -s of xform: the scale must not be 0".into()));
            }
            // A negative scale is a scale and an inversion at the origin.
            let scale = Similarity { map: DAffine3::from_scale(DVec3::splat(s)), scale: s.abs() };
            Ok(Some((Step::Map(scale), i + 2)))
        }
        "-mx" => mirror(DVec3::new(-1.0, 1.0, 1.0)),
        "-my" => mirror(DVec3::new(1.0, -1.0, 1.0)),
        "-mz" => mirror(DVec3::new(1.0, 1.0, -1.0)),
        "-i" => Ok(Some((Step::Repeat(count(args, i + 1, option, MAX_REPEATS)?), i + 2))),
        "-a" => Ok(Some((Step::Array(count(args, i + 1, option, MAX_COPIES)?), i + 2))),
        _ => Ok(None),
    }
}

fn power(m: &Similarity, n: u64) -> Similarity {
    let (mut result, mut square, mut n) = (Similarity::IDENTITY, *m, n);
    while n > 0 {
        if n & 1 == 1 {
            result = result.then(&square);
        }
        square = square.then(&square);
        n >>= 1;
    }
    result
}

/// All transformations at the start of `args` and the number of arguments they take: one per copy that `-a` makes.
pub fn parse(args: &[Argument]) -> Result<(Vec<Similarity>, usize), Wrong> {
    // Groups between -i and -a: how often (or over how many copies) the product of each applies.
    let mut groups: Vec<(Option<u64>, u64, Similarity)> = vec![(None, 1, Similarity::IDENTITY)];
    let mut i = 0;
    let mut copies = 1u64;
    while i < args.len() {
        let Some((step, next)) = step(args, i)? else { break };
        match step {
            Step::Map(m) => {
                if let Some(last) = groups.last_mut() {
                    last.2 = last.2.then(&m);
                }
            }
            Step::Repeat(n) => groups.push((None, n, Similarity::IDENTITY)),
            Step::Array(n) => {
                copies = copies.saturating_mul(n);
                if copies > MAX_COPIES {
                    return Err(Wrong(i, format!("xform -a makes more than {MAX_COPIES} copies")));
                }
                groups.push((Some(n), 1, Similarity::IDENTITY));
            }
        }
        i = next;
    }
    let mut all = vec![Similarity::IDENTITY];
    for (array, repeats, m) in groups {
        match array {
            None => {
                let m = power(&m, repeats);
                all.iter_mut().for_each(|a| *a = a.then(&m));
            }
            Some(n) => {
                let mut steps = Vec::with_capacity(n as usize);
                let mut at = Similarity::IDENTITY;
                for _ in 0..n {
                    steps.push(at);
                    at = at.then(&m);
                }
                all = all.iter().flat_map(|a| steps.iter().map(move |s| a.then(s))).collect();
            }
        }
    }
    if let Some(bad) = all.iter().position(|m| !m.is_sound()) {
        return Err(Wrong(0, format!("copy {} of xform is not finite", bad + 1)));
    }
    Ok((all, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Span;

    fn args(text: &str) -> Vec<Argument> {
        let span = Span::default();
        text.split_whitespace().map(|t| Argument { text: t.into(), span }).collect()
    }

    fn one(text: &str) -> Similarity {
        let (all, used) = parse(&args(text)).unwrap();
        assert_eq!((all.len(), used), (1, args(text).len()), "{text}");
        all[0]
    }

    fn near(a: DVec3, b: [f64; 3]) {
        assert!((a - DVec3::from(b)).length() < 1e-12, "{a} {b:?}");
    }

    #[test]
    fn transformations_apply_in_the_order_written() {
        near(one("-t 1 0 0 -rz 90").point(DVec3::ZERO), [0., 1., 0.]);
        near(one("-rz 90 -t 1 0 0").point(DVec3::ZERO), [1., 0., 0.]);
        near(one("-rx 90").point(DVec3::Y), [0., 0., 1.]);
        near(one("-ry 90").point(DVec3::Z), [1., 0., 0.]);
        near(one("-s 2 -t 1 1 1").point(DVec3::ONE), [3., 3., 3.]);
        let m = one("-mx -s 3");
        near(m.point(DVec3::ONE), [-3., 3., 3.]);
        assert!(m.mirrors() && m.scale == 3.0 && !one("-mx -my").mirrors());
    }

    #[test]
    fn iterations_repeat_what_follows_them() {
        near(one("-i 3 -t 1 0 0").point(DVec3::ZERO), [3., 0., 0.]);
        near(one("-i 3 -t 1 0 0 -i 1 -rz 90").point(DVec3::ZERO), [0., 3., 0.]);
        near(one("-i 0 -t 1 0 0 -i 1 -t 0 1 0").point(DVec3::ZERO), [0., 1., 0.]);
    }

    #[test]
    fn arrays_nest() {
        let (all, used) = parse(&args("-t 0 0 5 -a 3 -t 1 0 0 -a 2 -t 0 1 0 -i 1 -s 2 file")).unwrap();
        assert_eq!((all.len(), used), (6, 20));
        near(all[0].point(DVec3::ZERO), [0., 0., 10.]);
        near(all[5].point(DVec3::ZERO), [4., 2., 10.]);
        assert!(parse(&args("-a 2000 -t 1 0 0 -a 2000 -t 0 1 0")).is_err());
        assert!(parse(&args("-i 10000 -s 1e9")).is_err());
    }

    #[test]
    fn what_is_wrong_is_named() {
        let wrong = |t: &str| parse(&args(t)).unwrap_err();
        assert_eq!(wrong("-t 1 2").1, "option -t of xform lacks a number");
        assert_eq!(wrong("-rx nan"), Wrong(1, "option -rx of xform: \"nan\" is not a finite number".into()));
        assert_eq!(wrong("-s 0").1, "option -s of xform: the scale must not be 0");
        assert_eq!(wrong("-a x").1, "option -a of xform: \"x\" is not a count");
    }
}
