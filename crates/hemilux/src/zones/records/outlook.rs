//! Which images must be visible from a place, of all there are: asked for every leaf and every signature, so eight at a time.
//!
//! Invariant: an image that is not known well enough is never said to be visible.

use super::model::Signature;
use hemilux_scene::geom::Vec3;

/// Signatures tested at once.
const LANES: usize = 8;

/// What eight signatures say, by component and signature.
#[derive(Clone, Copy, Debug)]
struct Eight {
    image: [[f32; LANES]; 3],
    image_radius: [f32; LANES],
    /// The tighter one of the last two patches.
    window: [[f32; LANES]; 3],
    window_radius: [f32; LANES],
}

/// Where the images of all signatures and what limits them lie.
#[derive(Clone, Debug, Default)]
pub struct Outlook {
    blocks: Vec<Eight>,
}

impl Outlook {
    /// Of `signatures`, in order.
    pub fn new(signatures: &[Signature]) -> Outlook {
        let block = |signatures: &[Signature]| {
            // What lies infinitely wide is never visible.
            let mut all = Eight {
                image: [[0.0; LANES]; 3],
                image_radius: [f32::INFINITY; LANES],
                window: [[0.0; LANES]; 3],
                window_radius: [f32::INFINITY; LANES],
            };
            for (lane, signature) in signatures.iter().enumerate() {
                let [image, last, before] = &signature.places;
                let window = if last.radius <= before.radius { last } else { before };
                for k in 0..3 {
                    all.image[k][lane] = image.centre[k];
                    all.window[k][lane] = window.centre[k];
                }
                all.image_radius[lane] = image.radius;
                all.window_radius[lane] = window.radius;
            }
            all
        };
        Outlook { blocks: signatures.chunks(LANES).map(block).collect() }
    }

    /// The signatures, by number, whose images are seen from somewhere within `radius` of `x` on a surface that faces unit `n`.
    pub fn visible_from(&self, x: Vec3, radius: f32, n: Vec3) -> impl Iterator<Item = usize> + '_ {
        self.blocks.iter().enumerate().flat_map(move |(b, block)| {
            let seen = block.visible_from(x, radius, n);
            (0..LANES).filter(move |lane| seen[*lane]).map(move |lane| b * LANES + lane)
        })
    }
}

impl Eight {
    #[inline]
    fn visible_from(&self, x: Vec3, radius: f32, n: Vec3) -> [bool; LANES] {
        let mut seen = [false; LANES];
        for (lane, seen) in seen.iter_mut().enumerate() {
            let from = |at: &[[f32; LANES]; 3]| [at[0][lane] - x.x, at[1][lane] - x.y, at[2][lane] - x.z];
            let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let (image, window) = (from(&self.image), from(&self.window));
            let (far, near) = (dot(image, image).sqrt(), dot(window, window).sqrt());
            let (image_size, window_size) =
                (self.image_radius[lane] + radius, self.window_radius[lane] + radius);
            // Beyond the window, and neither so wide that it could be anywhere.
            let clear = (near > 1.5 * window_size) & (far > 1.5 * image_size) & (far > near);
            let faces = dot(window, n.to_array()) > 0.0;
            let (to_far, to_near) = (1.0 / far, 1.0 / near);
            let apart = [0, 1, 2].map(|k: usize| image[k] * to_far - window[k] * to_near);
            let reach = window_size * to_near + image_size * to_far;
            *seen = clear & faces & (dot(apart, apart) < reach * reach);
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::super::Turns;
    use super::super::model::Place;
    use super::*;

    /// Its image behind a window at (`x`, 0, 1).
    fn signature(x: f32, radius: f32) -> Signature {
        let image = Place { centre: Vec3::new(2.0 * x, 0.0, 2.0), radius: 0.01 };
        let window = Place { centre: Vec3::new(x, 0.0, 1.0), radius };
        let unknown = Place { centre: Vec3::ZERO, radius: f32::INFINITY };
        Signature {
            places: [image, window, unknown],
            windows: [None; 2],
            roomy: 1.0,
            fill: 1.0,
            strength: 1.0,
            kind: 0,
            centred: 0,
            scattered: 0,
            turns: Turns::NONE,
        }
    }

    #[test]
    fn images_are_visible_through_their_windows_and_nowhere_else() {
        // All on rays from the origin, but for one of which no window is known; more than a block of them.
        let mut all: Vec<Signature> = (0..19).map(|i| signature(0.1 * (i as f32 - 9.0), 0.02)).collect();
        all[4] = signature(-0.5, f32::INFINITY);
        let outlook = Outlook::new(&all);
        let seen = |x: Vec3, n: Vec3| outlook.visible_from(x, 0.01, n).collect::<Vec<_>>();
        let known: Vec<usize> = (0..19).filter(|i| *i != 4).collect();
        assert_eq!(seen(Vec3::ZERO, Vec3::Z), known);
        // From elsewhere every window lies beside its image; behind the surface there is nothing to see.
        assert!(seen(Vec3::new(0.0, 0.3, 0.0), Vec3::Z).is_empty());
        assert!(seen(Vec3::ZERO, -Vec3::Z).is_empty());
        // Beyond the windows nothing is seen through them.
        assert!(seen(Vec3::new(0.0, 0.0, 1.5), Vec3::Z).is_empty());
    }
}
