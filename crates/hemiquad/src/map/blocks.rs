//! Many points at once. The loops run over blocks of eight and hold no branches, so that they vectorise.

use super::{Concentric, Cosine, Dir, Map, Uv};

/// How many points one block carries.
pub const WIDTH: usize = 8;

/// Eight points, coordinate by coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Uv8 {
    /// First coordinates.
    pub u: [f32; WIDTH],
    /// Second coordinates.
    pub v: [f32; WIDTH],
}

/// Eight directions, coordinate by coordinate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dir8 {
    /// Along the first tangent.
    pub x: [f32; WIDTH],
    /// Along the second tangent.
    pub y: [f32; WIDTH],
    /// Along the normal.
    pub z: [f32; WIDTH],
}

#[inline(always)]
fn eight<M: Map<f32>>(map: &M, at: &Uv8) -> Dir8 {
    let mut out = Dir8::default();
    for i in 0..WIDTH {
        let Dir { x, y, z } = map.dir(Uv::new(at.u[i], at.v[i]));
        out.x[i] = x;
        out.y[i] = y;
        out.z[i] = z;
    }
    out
}

/// [`Concentric`] for eight points: the same bits as one by one.
#[inline]
pub fn concentric8(at: &Uv8) -> Dir8 {
    eight(&Concentric, at)
}

/// [`Cosine`] for eight points: the same bits as one by one.
#[inline]
pub fn cosine8(at: &Uv8) -> Dir8 {
    eight(&Cosine, at)
}
