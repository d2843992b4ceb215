//! What the surfaces of a specular chain say of its image, before any record does; and which way the chain goes at each.
//!
//! The image of a luminaire in flat mirrors lies where the mirrors' planes put it, and it is seen through their outlines as
//! they put them (the image method of H. Rushmeier and K. Torrance 1990). The outline of the last patch is exact behind any
//! chain. What lies behind refraction or behind a curved mirror is left to the records.

use crate::world::outline::{Outline, mirrored};
use hemilux_scene::geom::Vec3;

/// What is known exactly of a chain as seen at its end.
#[derive(Clone, Copy, Debug)]
pub struct Exact {
    /// The middle of the image (m).
    pub image: Option<Vec3>,
    /// Outlines of the patch met last, and of the one before it, or of what shines.
    pub outlines: [Option<Outline>; 2],
    /// Radius of a ball around the patch met before the last one, or around what shines, if that is flat (m).
    pub before: Option<f32>,
    /// How much of the ball around the image shows it.
    pub fill: f32,
    /// Whether the chain goes through each interface or is reflected.
    pub turns: Turns,
}

/// Which way a chain goes at each of its interfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turns {
    /// From the highest bit set on, one bit for each interface from the source on: 1 if it is passed. 0: too many to say.
    pub(super) bits: u32,
}

impl Turns {
    /// No interface.
    pub const NONE: Turns = Turns { bits: 1 };

    /// One more at the far end from the source.
    pub fn then(self, transmitted: bool) -> Turns {
        let room = self.bits >> 31 == 0 && self.bits != 0;
        Turns { bits: if room { self.bits << 1 | transmitted as u32 } else { 0 } }
    }

    /// Whether the interface farthest from the source is passed, and the others; `None` if none is left.
    pub fn split_last(self) -> Option<(bool, Turns)> {
        (self.bits > 1).then_some((self.bits & 1 != 0, Turns { bits: self.bits >> 1 }))
    }

    /// Number of interfaces; `None` if there are too many to say.
    pub fn count(self) -> Option<u32> {
        self.bits.checked_ilog2()
    }
}

impl Default for Exact {
    fn default() -> Exact {
        Exact { image: None, outlines: [None; 2], before: None, fill: 1.0, turns: Turns::NONE }
    }
}

impl Exact {
    /// A source with its centre (m) and its outline, where they are known.
    pub fn of(centre: Option<Vec3>, outline: Option<Outline>, fill: f32) -> Exact {
        Exact { image: centre, outlines: [outline, None], before: None, fill, turns: Turns::NONE }
    }

    /// Go through an interface at `p` with unit normal `n`, whose patch has `outline` if it is flat.
    pub fn pass(&mut self, outline: Option<Outline>, p: Vec3, n: Vec3, transmitted: bool) {
        self.turns = self.turns.then(transmitted);
        let before = self.outlines[0];
        self.outlines[0] = outline;
        self.before = before.map(|b| b.ball().1);
        let flat_mirror = outline.is_some() && !transmitted;
        self.outlines[1] = before.filter(|_| flat_mirror).map(|b| b.mirrored(p, n));
        self.image = self.image.filter(|_| flat_mirror).map(|image| mirrored(image, p, n));
    }
}
