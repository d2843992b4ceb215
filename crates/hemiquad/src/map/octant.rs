//! The appendix of the report as printed, octant by octant, in its own coordinates; kept to test the short form against.
//!
//! Restored by two errata: the line `yy = x - y` of octant 6 and the branch of the origin. The original carries this notice:
//!
//! > Copyright 1994 Kenneth Chiu. This code may be freely distributed and used for any purpose, commercial or
//! > non-commercial, as long as attribution is maintained.

use super::{Concentric, Dir, Map, Uv};
use crate::real::Real;

/// The report's appendix, letter by letter (Kenneth Chiu 1994): the same map as [`Concentric`], slower and, in single
/// precision, wrong within 2.4e-4 rad of the pole, where `acos(1 - x²)` rounds to nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Octant;

impl<T: Real> Map<T> for Octant {
    #[inline]
    fn dir(&self, at: Uv<T>) -> Dir<T> {
        let quarter = |k: f64| T::of(k) * T::PI / T::of(4.0);
        let x = T::of(2.0) * at.u - T::ONE;
        let y = T::of(2.0) * at.v - T::ONE;
        let (xx, yy, offset);
        if y > -x {
            // Above y = -x
            if y < x {
                // Below y = x
                xx = x;
                if y > T::ZERO {
                    // Octant 1
                    offset = T::ZERO;
                    yy = y;
                } else {
                    // Octant 8
                    offset = quarter(7.0);
                    yy = x + y;
                }
            } else {
                // Above and including y = x
                xx = y;
                if x > T::ZERO {
                    // Octant 2
                    offset = quarter(1.0);
                    yy = y - x;
                } else {
                    // Octant 3
                    offset = quarter(2.0);
                    yy = -x;
                }
            }
        } else {
            // Below and including y = -x
            if y > x {
                // Above y = x
                xx = -x;
                if y > T::ZERO {
                    // Octant 4
                    offset = quarter(3.0);
                    yy = -x - y;
                } else {
                    // Octant 5
                    offset = quarter(4.0);
                    yy = -y;
                }
            } else {
                // Below and including y = x
                xx = -y;
                if x > T::ZERO {
                    // Octant 7
                    offset = quarter(6.0);
                    yy = x;
                } else if y != T::ZERO {
                    // Octant 6
                    offset = quarter(5.0);
                    yy = x - y;
                } else {
                    // Origin
                    return Dir { x: T::ZERO, y: T::ZERO, z: T::ONE };
                }
            }
        }
        let theta = (T::ONE - xx * xx).acos();
        let phi = offset + (T::PI / T::of(4.0)) * (yy / xx);
        let (st, ct) = theta.sin_cos();
        let (sp, cp) = phi.sin_cos();
        // The appendix has y up; here z is the normal.
        Dir { x: st * cp, y: st * sp, z: ct }
    }

    #[inline]
    fn uv(&self, d: Dir<T>) -> Option<Uv<T>> {
        Concentric.uv(d)
    }

    #[inline]
    fn pdf_solid_angle(&self, d: Dir<T>) -> T {
        Concentric.pdf_solid_angle(d)
    }
}
