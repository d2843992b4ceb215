//! What lies at a hit: position with its rounding error, normals, parameters.
//!
//! Rounding errors are carried along (γ-bounds as in Higham 2002; Pharr, Jakob and Humphreys, PBR, ch. 6.8), so that
//! rays leave a surface by its own error and not by a fixed distance.

use super::World;
use super::luminaire::NO_LUMINAIRE;
use super::texture::{self, TexturePoint};
use hemilux_accel::{self as accel, Hit, NO_INSTANCE};
use hemilux_scene::geom::{Frame, Vec2, Vec3};
use hemilux_scene::{FloatParam, Geometry, Material, Wrap};

/// A point on a surface, met by a ray.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// World position (m).
    pub p: Vec3,
    /// Bound on the rounding error of `p`, per coordinate (m).
    pub p_error: Vec3,
    /// Geometric normal, unit; the side a one-sided luminaire emits to.
    pub ng: Vec3,
    /// Shading frame; its normal lies on the side of `ng`.
    pub frame: Frame,
    /// Surface parameters.
    pub uv: Vec2,
    /// Towards where the ray came from, unit.
    pub wo: Vec3,
    /// Distance along the ray (m).
    pub t: f32,
    /// The primitive and where on it (barycentrics or quadric parameters).
    pub hit: Hit,
    /// Group of the shape (0: the world's own).
    pub group: u32,
    /// Shape within its group.
    pub shape: u32,
    /// Luminaire index, or [`NO_LUMINAIRE`].
    pub luminaire: u32,
}

/// n roundings bound a relative error by this.
const fn gamma(n: u32) -> f32 {
    let e = n as f32 * (f32::EPSILON * 0.5);
    e / (1.0 - e)
}

struct Local {
    p: Vec3,
    error: Vec3,
    ng: Vec3,
    ns: Vec3,
    dpdu: Vec3,
    dpdv: Vec3,
    uv: Vec2,
}

impl Surface {
    /// Where textures are looked up.
    #[inline]
    pub fn texture_point(&self) -> TexturePoint {
        TexturePoint { p: self.p, uv: self.uv }
    }

    /// Whether `w` points to the side of the geometric normal.
    #[inline]
    pub fn is_front(&self, w: Vec3) -> bool {
        self.ng.dot(w) > 0.0
    }

    /// The geometric normal on the side that the ray came from.
    #[inline]
    pub fn facing(&self) -> Vec3 {
        if self.is_front(self.wo) { self.ng } else { -self.ng }
    }

    /// Origin for a ray that leaves towards `w`.
    #[inline]
    pub fn leave(&self, w: Vec3) -> Vec3 {
        accel::offset_origin(self.p, self.p_error, self.ng, w)
    }
}

impl World {
    pub(crate) fn surface(&self, hit: &Hit, dir: Vec3) -> Surface {
        let placement =
            if hit.instance == NO_INSTANCE { None } else { Some(&self.placements[hit.instance as usize]) };
        let group_index = placement.map_or(0, |p| p.group);
        let group = &self.groups[group_index as usize];
        let shape_index = group.prim_shape[hit.prim as usize];
        let shape = &group.shapes[shape_index as usize];
        let within = hit.prim - group.first_prim[shape_index as usize];
        let mut local = match shape.geometry {
            Geometry::Mesh(id) => self.triangle_point(id.0 as usize, within, hit, shape),
            Geometry::Quadric(q, to_group) => quadric_point(q, &to_group, hit, shape),
        };
        if let Some(placement) = placement {
            let m = &placement.to_world;
            (local.p, local.error) = accel::transform_error(m, local.p.as_dvec3(), local.error.as_dvec3());
            // The inverse transpose keeps the outer side outside, under mirroring too.
            let normal = |n: Vec3| (placement.normal_to_world * n.as_dvec3()).normalize_or_zero().as_vec3();
            local.ng = normal(local.ng);
            local.ns = normal(local.ns);
            local.dpdu = m.transform_vector3(local.dpdu.as_dvec3()).as_vec3();
            local.dpdv = m.transform_vector3(local.dpdv.as_dvec3()).as_vec3();
        }
        let material = &self.scene.materials[shape.material.0 as usize];
        let frame = self.shading_frame(material, &local);
        let luminaire = self.luminaires.index(hit.instance, group_index, shape_index, within);
        Surface {
            p: local.p,
            p_error: local.error,
            ng: local.ng,
            frame,
            uv: local.uv,
            wo: -dir,
            t: hit.t,
            hit: *hit,
            group: group_index,
            shape: shape_index,
            luminaire,
        }
    }

    fn triangle_point(&self, mesh: usize, triangle: u32, hit: &Hit, shape: &hemilux_scene::Shape) -> Local {
        let mesh = &self.scene.meshes[mesh];
        let [i, j, k] = mesh.indices[triangle as usize].map(|i| i as usize);
        let (a, b, c) = (mesh.positions[i], mesh.positions[j], mesh.positions[k]);
        let (u, v) = (hit.u, hit.v);
        let w = 1.0 - u - v;
        let corners = [a, b, c];
        let (p, error) = accel::triangle_point(&corners, u, v);
        let mut ng = accel::triangle_normal(&corners);
        let (uva, uvb, uvc) = if mesh.uvs.is_empty() {
            (Vec2::ZERO, Vec2::new(1.0, 0.0), Vec2::ONE)
        } else {
            (mesh.uvs[i], mesh.uvs[j], mesh.uvs[k])
        };
        let uv = w * uva + u * uvb + v * uvc;
        let (d1, d2) = (uvb - uva, uvc - uva);
        let determinant = d1.perp_dot(d2);
        let (dpdu, dpdv) = if determinant.abs() > 1e-12 {
            let (e1, e2) = (b - a, c - a);
            ((e1 * d2.y - e2 * d1.y) / determinant, (e2 * d1.x - e1 * d2.x) / determinant)
        } else {
            let f = Frame::from_normal(ng);
            (f.s, f.t)
        };
        let flip = shape.reverse_orientation;
        let ns;
        if mesh.normals.is_empty() {
            if flip ^ shape.flips_handedness {
                ng = -ng;
            }
            ns = ng;
        } else {
            // Given normals decide the side, as in pbrt.
            let mut n = w * mesh.normals[i] + u * mesh.normals[j] + v * mesh.normals[k];
            if flip {
                n = -n;
            }
            let n = n.normalize_or_zero();
            if n.dot(ng) < 0.0 {
                ng = -ng;
            }
            ns = if n == Vec3::ZERO { ng } else { n };
        }
        Local { p, error, ng, ns, dpdu, dpdv, uv }
    }

    /// The frame that scattering happens in: interpolated normal, tilted by bumps or a normal map.
    fn shading_frame(&self, material: &Material, local: &Local) -> Frame {
        let mut n = local.ns;
        if let Some(bump) = material.bump {
            n = self.bumped(bump, local, n);
        } else if let Some(id) = material.normal_map {
            let image = &self.scene.images[id.0 as usize];
            let v = texture::lookup(image, local.uv, Wrap::Repeat, false);
            let f = Frame::from_normal_tangent(n, local.dpdu);
            let m = Vec3::new(2.0 * v[0] - 1.0, 2.0 * v[1] - 1.0, 2.0 * v[2] - 1.0);
            n = f.to_world(m).try_normalize().unwrap_or(n);
        }
        if n.dot(local.ng) < 0.0 {
            n = -n;
        }
        Frame::from_normal_tangent(n, local.dpdu)
    }

    /// Blinn's bump mapping: the normal of p + d·n, by forward differences in (u, v).
    fn bumped(&self, bump: FloatParam, local: &Local, n: Vec3) -> Vec3 {
        const STEP: f32 = 5e-4;
        let at = |du: f32, dv: f32| {
            let p = local.p + local.dpdu * du + local.dpdv * dv;
            texture::float(&self.scene, bump, &TexturePoint { p, uv: local.uv + Vec2::new(du, dv) })
        };
        let d = at(0.0, 0.0);
        let dpdu = local.dpdu + n * ((at(STEP, 0.0) - d) / STEP);
        let dpdv = local.dpdv + n * ((at(0.0, STEP) - d) / STEP);
        let tilted = dpdu.cross(dpdv).try_normalize().unwrap_or(n);
        if tilted.dot(n) < 0.0 { -tilted } else { tilted }
    }
}

fn quadric_point(
    q: hemilux_scene::Quadric,
    to_group: &hemilux_scene::geom::DAffine3,
    hit: &Hit,
    shape: &hemilux_scene::Shape,
) -> Local {
    let local = super::convert(q).eval(hit.u as f64, hit.v as f64);
    let p = to_group.transform_point3(local.position);
    // Rebuilt on the surface in f64: what is left is the rounding to f32 and of (u, v), both relative.
    let extent = (p - to_group.translation).abs();
    let error = (p.abs() * gamma(2) as f64 + extent * gamma(8) as f64).as_vec3();
    let flip = shape.reverse_orientation ^ shape.flips_handedness;
    let n = (to_group.matrix3.inverse().transpose() * local.normal).normalize_or_zero();
    let mirrored = to_group.matrix3.determinant() < 0.0;
    // `flips_handedness` follows the placement: the outward side stays outward unless reversed.
    let n = if flip ^ mirrored { -n } else { n };
    let n = n.as_vec3();
    Local {
        p: p.as_vec3(),
        error,
        ng: n,
        ns: n,
        dpdu: to_group.transform_vector3(local.dpdu).as_vec3(),
        dpdv: to_group.transform_vector3(local.dpdv).as_vec3(),
        uv: Vec2::new(hit.u, hit.v),
    }
}

const _: () = assert!(NO_LUMINAIRE == u32::MAX);
