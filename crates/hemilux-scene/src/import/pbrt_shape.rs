//! Shapes: meshes go to the space of their group, quadrics keep theirs.
//!
//! Orientation follows pbrt. A mesh with normals faces where they point; one without faces the side from which its
//! vertices, in the shape's own space, are counter-clockwise, whether or not the transform mirrors; `ReverseOrientation`
//! turns either round. The order of indices is changed to say so, hence a mesh's flags are always false.

use super::area;
use super::builder::Builder;
use super::params::{Params, Type};
use super::ply;
use super::transform::{mirrors, normal_matrix};
use crate::geom::{DVec2, DVec3, Vec3};
use crate::{FloatParam, Geometry, Mesh, MeshId, Quadric, Shape, Span};
use std::f64::consts::TAU;

const KINDS: [&str; 6] = ["trianglemesh", "plymesh", "bilinearmesh", "sphere", "disk", "cylinder"];
const UNSUPPORTED: [&str; 2] = ["curve", "loopsubdiv"];

/// Cells along each side of a bilinear patch that is not planar.
pub const PATCH_CELLS: usize = 8;

/// A mesh in its own space.
#[derive(Default)]
struct RawMesh {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    uvs: Vec<DVec2>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    pub fn shape(&mut self, kind: &str, mut params: Params, at: Span) {
        if !self.require_world("Shape", at) {
            return;
        }
        params.inherit(&self.state.attributes.shape);
        let env = self.env.clone();
        let log = &env.log;
        let alpha = self.alpha(&params);
        let before = log.errors();
        let geometry = match kind {
            "trianglemesh" => self.triangle_mesh(&params).and_then(|m| self.place_mesh(m, &params)),
            "plymesh" => self.ply_mesh(&params).and_then(|m| self.place_mesh(m, &params)),
            "bilinearmesh" => self.bilinear_mesh(&params).and_then(|m| self.place_mesh(m, &params)),
            "sphere" => self.sphere(&params).map(|q| self.place_quadric(q)),
            "disk" => self.disk(&params).map(|q| self.place_quadric(q)),
            "cylinder" => self.cylinder(&params).map(|q| self.place_quadric(q)),
            _ => {
                let message = match UNSUPPORTED.contains(&kind) {
                    true => format!("shape \"{kind}\" is not supported"),
                    false => format!("unknown shape \"{kind}\""),
                };
                log.unknown_among(params.span, message, kind, KINDS);
                return;
            }
        };
        // After an error in the values, the rest of the list has not been asked for.
        if geometry.is_some() || log.errors() == before {
            params.finish(log);
        }
        let Some(geometry) = geometry else { return };
        let is_mesh = matches!(geometry, Geometry::Mesh(_));
        let emission =
            self.state.area_light.clone().map(|light| self.emission(&light, self.area_of(&geometry)));
        if is_mesh && let Some(light) = self.state.area_light.as_ref().filter(|l| l.power.is_some()) {
            log.note(
                light.span,
                "\"power\" is that of the whole mesh (pbrt gives it to each of its triangles)",
            );
        }
        self.add_shape(Shape {
            geometry,
            material: self.state.material,
            emission,
            alpha,
            reverse_orientation: !is_mesh && self.state.reverse,
            flips_handedness: !is_mesh && mirrors(&self.state.ctm),
            name: String::new(),
            span: at,
        });
    }

    fn alpha(&self, params: &Params) -> Option<FloatParam> {
        let alpha = params.float_param(&self.env, &self.float_textures, "alpha")?;
        if let FloatParam::Constant(a) = alpha
            && !(0.0..=1.0).contains(&a)
        {
            let message = format!("parameter \"alpha\" of {} must be in [0, 1], not {a}", params.owner);
            self.env.log.error(params.value_span("alpha"), message);
        }
        (alpha != FloatParam::Constant(1.0)).then_some(alpha)
    }

    fn area_of(&self, geometry: &Geometry) -> f64 {
        match geometry {
            Geometry::Mesh(id) => {
                let mesh = &self.meshes[id.0 as usize];
                area::of_mesh(&mesh.positions, &mesh.indices)
            }
            Geometry::Quadric(q, m) => area::of_quadric(q, m),
        }
    }

    // Quadrics.

    fn place_quadric(&self, q: Quadric) -> Geometry {
        Geometry::Quadric(q, self.state.ctm)
    }

    fn phi_max(&self, params: &Params) -> f64 {
        let inside = |v: f64| v > 0.0 && v <= 360.0;
        let degrees = params.float_in(&self.env.log, "phimax", 360.0, "between 0 and 360 degrees", inside);
        degrees / 360.0 * TAU
    }

    fn radius(&self, params: &Params) -> Option<f64> {
        let before = self.env.log.errors();
        let r = params.positive(&self.env.log, "radius", 1.0);
        (self.env.log.errors() == before).then_some(r)
    }

    fn heights(&self, params: &Params, z_min: f64, z_max: f64) -> Option<(f64, f64)> {
        if z_min < z_max {
            return Some((z_min, z_max));
        }
        let message = format!("{} is empty: \"zmin\" {z_min} is not below \"zmax\" {z_max}", params.owner);
        self.env.log.error(params.span_of("zmax"), message);
        None
    }

    fn sphere(&self, params: &Params) -> Option<Quadric> {
        let log = &self.env.log;
        let radius = self.radius(params);
        let r = radius.unwrap_or(1.0);
        // Either order, within the sphere, as pbrt reads them.
        let (a, b) = (params.float(log, "zmin", -r), params.float(log, "zmax", r));
        let phi_max = self.phi_max(params);
        let (z_min, z_max) = self.heights(params, a.min(b).clamp(-r, r), a.max(b).clamp(-r, r))?;
        Some(Quadric::Sphere { radius: radius?, z_min, z_max, phi_max })
    }

    fn disk(&self, params: &Params) -> Option<Quadric> {
        let log = &self.env.log;
        let radius = self.radius(params);
        let r = radius.unwrap_or(1.0);
        let height = params.float(log, "height", 0.0);
        let inside = |v: f64| radius.is_none() || (0.0..r).contains(&v);
        let inner_radius = params.float_in(log, "innerradius", 0.0, "in [0, radius)", inside);
        let phi_max = self.phi_max(params);
        Some(Quadric::Disk { height, radius: radius?, inner_radius, phi_max })
    }

    fn cylinder(&self, params: &Params) -> Option<Quadric> {
        let log = &self.env.log;
        let radius = self.radius(params);
        let (a, b) = (params.float(log, "zmin", -1.0), params.float(log, "zmax", 1.0));
        let phi_max = self.phi_max(params);
        let (z_min, z_max) = self.heights(params, a.min(b), a.max(b))?;
        Some(Quadric::Cylinder { radius: radius?, z_min, z_max, phi_max })
    }

    // Meshes.

    fn vertices(&self, params: &Params) -> Option<RawMesh> {
        let log = &self.env.log;
        let vectors = |name, types: &[Type]| params.tuples::<3>(log, name, types);
        let positions = vectors("P", &[Type::Point3]);
        let normals = vectors("N", &[Type::Normal3]).unwrap_or_default();
        let uvs = params.tuples::<2>(log, "uv", &[Type::Point2, Type::Vector2]).unwrap_or_default();
        params.ignore(&["S", "faceIndices"]);
        let Some(positions) = positions else {
            if !params.has("P") {
                log.error(params.span, format!("{} has no \"point3 P\"", params.owner));
            }
            return None;
        };
        for (name, n) in [("N", normals.len()), ("uv", uvs.len())] {
            if n != 0 && n != positions.len() {
                let message =
                    format!("{} has {} vertices but {n} in \"{name}\"", params.owner, positions.len());
                log.error(params.span_of(name), message);
                return None;
            }
        }
        Some(RawMesh {
            positions: positions.into_iter().map(DVec3::from).collect(),
            normals: normals.into_iter().map(DVec3::from).collect(),
            uvs: uvs.into_iter().map(DVec2::from).collect(),
            triangles: Vec::new(),
        })
    }

    /// `indices` in groups of `N`, in range; or all vertices in order if there are just `N`.
    fn index_groups<const N: usize>(&self, params: &Params, vertices: usize) -> Option<Vec<[u32; N]>> {
        let log = &self.env.log;
        let span = params.span_of("indices");
        let Some(values) = params.integers(log, "indices") else {
            if params.has("indices") {
                return None;
            }
            if vertices != N {
                log.error(params.span, format!("{} has no \"integer indices\"", params.owner));
                return None;
            }
            return Some(vec![std::array::from_fn(|i| i as u32)]);
        };
        let (groups, rest) = values.as_chunks::<N>();
        if !rest.is_empty() || groups.is_empty() {
            let message = format!(
                "\"indices\" of {} takes multiples of {N} values, not {}",
                params.owner,
                values.len()
            );
            log.error(span, message);
            return None;
        }
        if let Some(bad) = values.iter().find(|v| !(0.0..vertices as f64).contains(*v)) {
            log.error(
                span,
                format!("index {bad} of {} is out of range: there are {vertices} vertices", params.owner),
            );
            return None;
        }
        Some(groups.iter().map(|g| g.map(|v| v as u32)).collect())
    }

    fn triangle_mesh(&mut self, params: &Params) -> Option<RawMesh> {
        let mut mesh = self.vertices(params)?;
        mesh.triangles = self.index_groups::<3>(params, mesh.positions.len())?;
        Some(mesh)
    }

    fn bilinear_mesh(&mut self, params: &Params) -> Option<RawMesh> {
        let log = &self.env.log;
        if params.has("emissionfilename") {
            log.warning(params.span_of("emissionfilename"), "\"emissionfilename\" is ignored");
        }
        params.ignore(&["emissionfilename"]);
        let mut mesh = self.vertices(params)?;
        let patches = self.index_groups::<4>(params, mesh.positions.len())?;
        let mut curved = 0;
        // A grid takes about 8 KiB while it is made; the text of a patch takes a hundred bytes.
        if patches.len() as u64 > self.env.memory >> 13 {
            log.error(params.span, format!("{} has too many patches for the memory limit", params.owner));
            return None;
        }
        for patch in patches {
            if planar(&mesh.positions, patch) {
                // pbrt's order of corners: (0,0), (1,0), (0,1), (1,1).
                let [a, b, c, d] = patch;
                mesh.triangles.extend([[a, b, d], [a, d, c]]);
            } else {
                curved += 1;
                tessellate(&mut mesh, patch);
            }
        }
        if curved > 0 {
            let n = PATCH_CELLS;
            let message = format!("{curved} curved bilinear patches became grids of {n} x {n} cells");
            self.env.log.note(params.span, message);
        }
        Some(mesh)
    }

    fn ply_mesh(&mut self, params: &Params) -> Option<RawMesh> {
        let env = self.env.clone();
        let log = &env.log;
        if params.has("displacement") {
            log.warning(params.span_of("displacement"), "\"displacement\" of a mesh is ignored");
        }
        params.ignore(&["displacement", "edgelength", "displacement.uvscale", "displacement.scale"]);
        let Some(name) = params.text(log, "filename") else {
            if !params.has("filename") {
                log.error(params.span, "shape \"plymesh\" has no \"string filename\"");
            }
            return None;
        };
        let span = params.value_span("filename");
        let path = env.resolve(name, span.file);
        let bytes = match env.read(&path) {
            Ok(bytes) => bytes,
            Err(e) => {
                log.error(span, format!("{}: {e}", path.display()));
                return None;
            }
        };
        match ply::read(&bytes) {
            Ok(mesh) => {
                self.degenerate += mesh.dropped;
                Some(RawMesh {
                    positions: mesh.positions,
                    normals: mesh.normals,
                    uvs: mesh.uvs,
                    triangles: mesh.triangles,
                })
            }
            Err(e) => {
                // The place is in the mesh; quote its header if it has one.
                let end = bytes.windows(10).take(4096).position(|w| w == b"end_header").unwrap_or(0);
                let text = String::from_utf8_lossy(&bytes[..end]).into_owned();
                let file = env.files.borrow_mut().add_source(path, text, Some(span));
                let column = u32::from(e.line > 0);
                log.error(Span { file, line: e.line, column, length: 1 }, e.message);
                None
            }
        }
    }

    /// Transform a mesh to the space of its group, orient its triangles, drop degenerate ones.
    fn place_mesh(&mut self, raw: RawMesh, params: &Params) -> Option<Geometry> {
        let ctm = self.state.ctm;
        let positions: Vec<Vec3> = raw.positions.iter().map(|p| ctm.transform_point3(*p).as_vec3()).collect();
        if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
            let message = format!("vertex {i} of {} is not finite in single precision", params.owner);
            self.env.log.error(params.span, message);
            return None;
        }
        let m = normal_matrix(&ctm) * if self.state.reverse { -1.0 } else { 1.0 };
        let normals: Vec<Vec3> = raw.normals.iter().map(|n| (m * *n).normalize_or_zero().as_vec3()).collect();
        let flip = self.state.reverse != mirrors(&ctm);
        let mut indices = Vec::with_capacity(raw.triangles.len());
        let corner = |i: u32| ctm.transform_point3(raw.positions[i as usize]);
        for [a, b, c] in raw.triangles {
            let n = (corner(b) - corner(a)).cross(corner(c) - corner(a));
            let flat = a == b || b == c || c == a || n == DVec3::ZERO;
            let same = |i: u32, j: u32| positions[i as usize] == positions[j as usize];
            if flat || same(a, b) || same(b, c) || same(c, a) {
                self.degenerate += 1;
                self.degenerate_span = params.span;
                continue;
            }
            let turn = match normals.get(a as usize) {
                Some(na) => {
                    let sum = *na + normals[b as usize] + normals[c as usize];
                    let dot = n.dot(sum.as_dvec3());
                    if dot == 0.0 { flip } else { dot < 0.0 }
                }
                None => flip,
            };
            indices.push(if turn { [a, c, b] } else { [a, b, c] });
        }
        if indices.is_empty() {
            self.env.log.warning(params.span, format!("{} has no triangle of positive area", params.owner));
            return None;
        }
        let uvs = raw.uvs.iter().map(|u| u.as_vec2()).collect();
        self.meshes.push(Mesh { positions, normals, uvs, indices });
        Some(Geometry::Mesh(MeshId(self.meshes.len() as u32 - 1)))
    }
}

/// Whether a patch is a parallelogram up to rounding, so that two triangles have its points and its (u, v).
fn planar(p: &[DVec3], [a, b, c, d]: [u32; 4]) -> bool {
    let [a, b, c, d] = [a, b, c, d].map(|i| p[i as usize]);
    let size = (d - a).length().max((c - b).length());
    // Any planar quadrilateral has the right points; its (u, v) would differ inside, which only textures show.
    let n = (b - a).cross(c - a).normalize_or_zero();
    n.dot(d - a).abs() <= 1e-6 * size
}

/// Replace a patch by a grid.
fn tessellate(mesh: &mut RawMesh, patch: [u32; 4]) {
    let n = PATCH_CELLS;
    let corner3 = |list: &[DVec3]| patch.map(|i| list[i as usize]);
    let p = corner3(&mesh.positions);
    let normals = (!mesh.normals.is_empty()).then(|| corner3(&mesh.normals));
    let uvs = (!mesh.uvs.is_empty()).then(|| patch.map(|i| mesh.uvs[i as usize]));
    let first = mesh.positions.len() as u32;
    for j in 0..=n {
        for i in 0..=n {
            let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
            let w = [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v];
            mesh.positions.push(p[0] * w[0] + p[1] * w[1] + p[2] * w[2] + p[3] * w[3]);
            if let Some(q) = normals {
                mesh.normals.push(q[0] * w[0] + q[1] * w[1] + q[2] * w[2] + q[3] * w[3]);
            }
            if let Some(q) = uvs {
                mesh.uvs.push(q[0] * w[0] + q[1] * w[1] + q[2] * w[2] + q[3] * w[3]);
            }
        }
    }
    let at = |i: usize, j: usize| first + (j * (n + 1) + i) as u32;
    for j in 0..n {
        for i in 0..n {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1));
            mesh.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }
}
