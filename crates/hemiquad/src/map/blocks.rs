//! Many points at once. The loops run over blocks of eight and hold no branches, so that they vectorise; whole arrays are mapped
//! with the widest instructions that the machine turns out to have (`pulp`). No fused operations: the bits are those of the scalar
//! maps on every machine.

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
fn all<M: Map<f32>>(map: &M, at: &[Uv8], out: &mut [Dir8]) {
    for (o, p) in out.iter_mut().zip(at) {
        *o = eight(map, p);
    }
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

/// [`Concentric`] for whole arrays of blocks (as many as the shorter slice holds).
pub fn concentric_all(at: &[Uv8], out: &mut [Dir8]) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || all(&Concentric, at, out),
    );
}

/// [`Cosine`] for whole arrays of blocks (as many as the shorter slice holds).
pub fn cosine_all(at: &[Uv8], out: &mut [Dir8]) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || all(&Cosine, at, out),
    );
}
