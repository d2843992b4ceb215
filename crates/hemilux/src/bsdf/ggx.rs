//! Microfacets with the GGX distribution and Smith's height-correlated masking and shadowing (E. Heitz, "Understanding the
//! Masking-Shadowing Function in Microfacet-Based BRDFs", 2014). Visible normals are sampled by [`hemiquad::map::GgxVisible`].
//!
//! Every quantity is written so that it stays finite when a cosine goes to zero. Directions are in the local frame with
//! `wo.z` > 0; signs of z only matter where stated.

use hemilux_scene::geom::Vec3;
use hemiquad::map::{Dir, GgxVisible, Map, Uv};

/// Below this in both tangents a surface counts as smooth: its lobe would be narrower than 0.1 degrees.
pub const SMOOTH_ALPHA: f32 = 1e-3;

/// Directions with |cos θ| below this count as grazing: they carry nothing, and no quotient overflows.
pub(super) const GRAZING: f32 = 1e-6;

/// Roughness along the two tangents, each in [[`SMOOTH_ALPHA`], 8]; or 0 in both for a smooth surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ggx {
    pub x: f32,
    pub y: f32,
}

impl Ggx {
    /// From user values: not-a-number and negative count as 0.
    #[inline]
    pub fn new(alpha: [f32; 2]) -> Self {
        let [x, y] = alpha.map(|a| a.max(0.0));
        if x < SMOOTH_ALPHA && y < SMOOTH_ALPHA {
            Ggx { x: 0.0, y: 0.0 }
        } else {
            Ggx { x: x.clamp(SMOOTH_ALPHA, 8.0), y: y.clamp(SMOOTH_ALPHA, 8.0) }
        }
    }

    #[inline]
    pub fn is_smooth(self) -> bool {
        self.x == 0.0
    }

    /// The roughness of an isotropic surface with as large an ellipse of slopes.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.x * self.y).sqrt()
    }

    /// D(h), per steradian.
    #[inline]
    pub fn distribution(self, h: Vec3) -> f32 {
        let (x, y) = (h.x / self.x, h.y / self.y);
        let l = x * x + y * y + h.z * h.z;
        std::f32::consts::FRAC_1_PI / (self.x * self.y * l * l)
    }

    /// √(cos² + αx² x² + αy² y²), which is cos (1 + 2 Λ).
    #[inline]
    fn stretch(self, w: Vec3) -> f32 {
        let (x, y) = (w.x * self.x, w.y * self.y);
        (w.z * w.z + x * x + y * y).sqrt()
    }

    /// G2 / (4 |cos_o cos_i|), also for refraction.
    #[inline]
    pub fn visibility(self, wo: Vec3, wi: Vec3) -> f32 {
        0.5 / (wi.z.abs() * self.stretch(wo) + wo.z.abs() * self.stretch(wi))
    }

    /// G2 / G1(wo): what is left of a visible normal's light after shadowing, in [0, 1].
    #[inline]
    pub fn shadowing(self, wo: Vec3, wi: Vec3) -> f32 {
        let (co, ci) = (wo.z.abs(), wi.z.abs());
        let so = self.stretch(wo);
        (ci * (co + so) / (ci * so + co * self.stretch(wi))).min(1.0)
    }

    /// G1(wo) / |cos_o| · D(h): the density of visible normals without its factor wo·h.
    #[inline]
    pub fn visible_density(self, wo: Vec3, h: Vec3) -> f32 {
        2.0 / (wo.z.abs() + self.stretch(wo)) * self.distribution(h)
    }

    /// A visible normal for `wo.z` > 0.
    #[inline]
    pub fn sample_visible(self, wo: Vec3, u: [f32; 2]) -> Option<Vec3> {
        let map = GgxVisible::new(Dir::from_unit(wo.x, wo.y, wo.z), self.x, self.y)?;
        let h = map.dir(Uv::new(u[0], u[1]));
        let h = Vec3::new(h.x, h.y, h.z);
        // Rounding may turn a facet that is seen edge-on away.
        (wo.dot(h) > 0.0).then_some(h)
    }
}
