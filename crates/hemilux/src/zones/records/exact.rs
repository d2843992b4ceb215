//! What the surfaces of a specular chain say of its image, before any record does.
//!
//! The image of a luminaire in flat mirrors lies where the mirrors' planes put it, and it is seen through their outlines as
//! they put them (the image method of H. Rushmeier and K. Torrance 1990). The outline of the last patch is exact behind any
//! chain. What lies behind refraction or behind a curved mirror is left to the records.

use crate::world::outline::{Outline, mirrored};
use hemilux_scene::geom::Vec3;

/// What is known exactly of a chain as seen at its end.
#[derive(Clone, Copy, Debug, Default)]
pub struct Exact {
    /// The middle of the image (m).
    pub image: Option<Vec3>,
    /// Outlines of the patch met last, and of the one before it, or of what shines.
    pub outlines: [Option<Outline>; 2],
}

impl Exact {
    /// A source with its centre (m) and its outline, where they are known.
    pub fn of((centre, outline): (Option<Vec3>, Option<Outline>)) -> Exact {
        Exact { image: centre, outlines: [outline, None] }
    }

    /// Go through an interface at `p` with unit normal `n`, whose patch has `outline` if it is flat.
    pub fn pass(&mut self, outline: Option<Outline>, p: Vec3, n: Vec3, transmitted: bool) {
        let before = self.outlines[0];
        self.outlines[0] = outline;
        let flat_mirror = outline.is_some() && !transmitted;
        self.outlines[1] = before.filter(|_| flat_mirror).map(|b| b.mirrored(p, n));
        self.image = self.image.filter(|_| flat_mirror).map(|image| mirrored(image, p, n));
    }
}
