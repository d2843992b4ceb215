//! The largest disk of the square in which nothing was looked at.

use crate::map::Uv;

/// Reusable memory for [`Gap::radius`].
#[derive(Clone, Debug, Default)]
pub struct Gap {
    first: Vec<u32>,
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;
/// Points looked at per bucket. Leaving points out can only make the bound larger.
const PER_BUCKET: u32 = 4;

impl Gap {
    /// An upper bound of the radius of the largest disk, with its centre in the unit square, that holds none of the `n`
    /// points: the points are sorted into about as many buckets, and the distance from every bucket's centre to the nearest
    /// point, plus half a bucket's diagonal, bounds the distance from anywhere inside that bucket.
    pub fn radius(&mut self, n: usize, point: impl Fn(usize) -> Uv<f64>) -> f64 {
        if n == 0 {
            return std::f64::consts::SQRT_2;
        }
        let side = ((n as f64).sqrt() as usize).clamp(1, 1024);
        let h = 1.0 / side as f64;
        self.first.clear();
        self.first.resize(side * side, NONE);
        self.next.clear();
        self.next.resize(n, NONE);
        let bucket = |x: f64| ((x * side as f64) as usize).min(side - 1);
        for i in 0..n {
            let p = point(i);
            let b = bucket(p.v) * side + bucket(p.u);
            self.next[i] = self.first[b];
            self.first[b] = i as u32;
        }
        let nearest = |b: usize, x: f64, y: f64| {
            let (mut i, mut best, mut left) = (self.first[b], f64::INFINITY, PER_BUCKET);
            while i != NONE && left > 0 {
                let p = point(i as usize);
                best = best.min((p.u - x).powi(2) + (p.v - y).powi(2));
                i = self.next[i as usize];
                left -= 1;
            }
            best
        };
        let mut worst: f64 = 0.0;
        for by in 0..side {
            'bucket: for bx in 0..side {
                let (cx, cy) = ((bx as f64 + 0.5) * h, (by as f64 + 0.5) * h);
                let mut best = f64::INFINITY;
                for ring in 0..side {
                    // Everything nearer than this lies within the rings already seen.
                    let reached = (ring as f64 - 0.5) * h;
                    if ring > 0 && best <= reached * reached {
                        break;
                    }
                    let (x0, x1) = (bx.saturating_sub(ring), (bx + ring).min(side - 1));
                    let (y0, y1) = (by.saturating_sub(ring), (by + ring).min(side - 1));
                    for y in y0..=y1 {
                        if y + ring == by || y == by + ring {
                            for x in x0..=x1 {
                                best = best.min(nearest(y * side + x, cx, cy));
                                // No larger gap than the largest so far.
                                if best <= worst {
                                    continue 'bucket;
                                }
                            }
                        } else {
                            // The inner rows of a ring have two buckets only.
                            if bx >= ring {
                                best = best.min(nearest(y * side + bx - ring, cx, cy));
                            }
                            if bx + ring < side {
                                best = best.min(nearest(y * side + bx + ring, cx, cy));
                            }
                            if best <= worst {
                                continue 'bucket;
                            }
                        }
                    }
                }
                worst = worst.max(best);
            }
        }
        worst.sqrt() + h * std::f64::consts::FRAC_1_SQRT_2
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::{Key, jittered_f64};

    #[test]
    fn the_bound_holds_and_is_not_idle() {
        for (k, n) in [(0u64, 8u32), (1, 16), (2, 5)] {
            let points: Vec<_> = (0..n * n).map(|i| jittered_f64(i, n, n, Key::new(k))).collect();
            let bound = Gap::default().radius(points.len(), |i| points[i]);
            let mut truth: f64 = 0.0;
            for i in 0..200 * 200 {
                let (x, y) = ((i % 200) as f64 / 199.0, (i / 200) as f64 / 199.0);
                let d = points.iter().map(|p| (p.u - x).hypot(p.v - y)).fold(9.0, f64::min);
                truth = truth.max(d);
            }
            assert!(bound >= truth && bound < truth * 2.0, "{bound} {truth}");
        }
        assert!(Gap::default().radius(0, |_| Uv::default()) > 1.4);
    }
}
