//! Sensors: points that receive, without a surface of the scene behind them.

use crate::bsdf::Bsdf;
use crate::gather::{GatherPlan, gather};
use crate::sampler::Sampler;
use crate::transport::{Tally, Walker};
use crate::world::Surface;
use crate::world::luminaire::NO_LUMINAIRE;
use hemilux_accel::{Hit, NO_INSTANCE};
use hemilux_scene::Rgb;
use hemilux_scene::geom::{Frame, Vec2, Vec3};

/// A free-standing receiver at `p` (m) with unit normal `n`: what a gather needs to know of a surface.
pub fn sensor_surface(p: Vec3, n: Vec3) -> Surface {
    Surface {
        p,
        // The point is given, not computed: it has no error of its own.
        p_error: Vec3::ZERO,
        ng: n,
        frame: Frame::from_normal(n),
        uv: Vec2::ZERO,
        wo: n,
        t: 0.0,
        hit: Hit { t: 0.0, u: 0.0, v: 0.0, prim: 0, instance: NO_INSTANCE },
        group: 0,
        shape: 0,
        luminaire: NO_LUMINAIRE,
    }
}

/// One estimate of the irradiance (W·m⁻²) at `p` on the side of unit normal `n`.
pub fn irradiance(
    walker: &Walker,
    p: Vec3,
    n: Vec3,
    plan: &GatherPlan,
    sampler: &mut Sampler,
    tally: &mut Tally,
) -> Rgb {
    // A white Lambertian receiver radiates E / π.
    let white = Bsdf::diffuse(Rgb::WHITE);
    gather(walker, &sensor_surface(p, n), &white, plan, sampler, tally) * std::f32::consts::PI
}
