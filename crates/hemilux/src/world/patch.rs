//! Smooth patches: the pieces of specular surfaces that images are seen through, for telling specular chains apart.
//!
//! A patch of a mesh without normals is a set of triangles that lie in one plane and hang together by shared edges (by
//! position, whether or not they share vertices). A mesh with normals, or a quadric, is one patch.

use super::Group;
use super::outline::Outline;
use hemilux_scene::geom::Vec3;
use hemilux_scene::{Geometry, Mesh, Scene, Shape};

/// Triangles of a mesh that one patch may be told from; larger meshes are told apart by plane alone.
const MOST: usize = 1 << 22;
/// Normals of one plane differ by less than this.
const SAME: f32 = 1e-3;

/// The patches of each shape of a group that needs them.
#[derive(Clone, Debug, Default)]
pub(super) struct Patches(Vec<OfShape>);

/// Patch of each triangle: empty where the whole shape is one.
#[derive(Clone, Debug, Default)]
struct OfShape {
    patch: Vec<u32>,
    /// In order of the patches.
    outlines: Vec<(u32, Outline)>,
}

impl Patches {
    /// Find the patches of the shapes that `wanted` says.
    pub fn new(scene: &Scene, group: &Group, wanted: impl Fn(&Shape) -> bool) -> Patches {
        let of_shape = |shape: &Shape| match shape.geometry {
            Geometry::Mesh(id) if wanted(shape) => {
                let mesh = &scene.meshes[id.0 as usize];
                let flat = mesh.normals.is_empty() && mesh.indices.len() <= MOST;
                if flat { OfShape::new(mesh) } else { OfShape::default() }
            }
            _ => OfShape::default(),
        };
        Patches(group.shapes.iter().map(of_shape).collect())
    }

    /// The patch of triangle `within` of `shape`; 0 where the whole shape is one.
    #[inline]
    pub fn of(&self, shape: u32, within: u32) -> u32 {
        self.0[shape as usize].patch.get(within as usize).copied().unwrap_or(0)
    }

    /// The outline of patch `patch` of `shape`, in the group's space, if it is flat.
    pub fn outline(&self, shape: u32, patch: u32) -> Option<&Outline> {
        let all = &self.0[shape as usize].outlines;
        all.binary_search_by_key(&patch, |o| o.0).ok().map(|at| &all[at].1)
    }

    /// The outlines of all flat patches, in the group's space.
    pub fn outlines(&self) -> impl Iterator<Item = &Outline> {
        self.0.iter().flat_map(|shape| &shape.outlines).map(|(_, outline)| outline)
    }
}

impl OfShape {
    fn new(mesh: &Mesh) -> OfShape {
        let patch = connected(mesh);
        let mut order: Vec<u32> = (0..patch.len() as u32).collect();
        order.sort_by_key(|t| patch[*t as usize]);
        let corners = |t: &u32| mesh.indices[*t as usize].map(|i| mesh.positions[i as usize]);
        let outlines = order
            .chunk_by(|a, b| patch[*a as usize] == patch[*b as usize])
            .filter_map(|members| {
                let triangles: Vec<[Vec3; 3]> = members.iter().map(corners).collect();
                Some((patch[members[0] as usize], Outline::around(&triangles)?))
            })
            .collect();
        OfShape { patch, outlines }
    }
}

/// Number the coplanar, connected sets of triangles: each by its first one.
fn connected(mesh: &Mesh) -> Vec<u32> {
    let corner = |i: u32| mesh.positions[i as usize];
    let bits = |p: Vec3| [p.x, p.y, p.z].map(|v| (v + 0.0).to_bits());
    let normal = |t: usize| {
        let [a, b, c] = mesh.indices[t].map(corner);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut edges: Vec<([u32; 3], [u32; 3], u32)> = Vec::with_capacity(3 * mesh.indices.len());
    for (t, [a, b, c]) in mesh.indices.iter().enumerate() {
        for (i, j) in [(a, b), (b, c), (c, a)] {
            let (p, q) = (bits(corner(*i)), bits(corner(*j)));
            edges.push((p.min(q), p.max(q), t as u32));
        }
    }
    edges.sort_unstable();
    let mut parent: Vec<u32> = (0..mesh.indices.len() as u32).collect();
    for along in edges.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        for pair in along.windows(2) {
            let (s, t) = (pair[0].2, pair[1].2);
            // Either winding: what a ray sees of the plane is the same.
            if normal(s as usize).dot(normal(t as usize)).abs() > 1.0 - SAME * SAME {
                let (s, t) = (root(&mut parent, s), root(&mut parent, t));
                parent[s.max(t) as usize] = s.min(t);
            }
        }
    }
    (0..parent.len() as u32).map(|t| root(&mut parent, t)).collect()
}

fn root(parent: &mut [u32], mut t: u32) -> u32 {
    while parent[t as usize] != t {
        parent[t as usize] = parent[parent[t as usize] as usize];
        t = parent[t as usize];
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coplanar_neighbours_are_one_patch_and_islands_are_not() {
        let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
        let mesh = Mesh {
            positions: vec![
                v(0.0, 0.0, 0.0),
                v(1.0, 0.0, 0.0),
                v(0.0, 1.0, 0.0),
                v(1.0, 1.0, 0.0),
                // The same corners once more, and a tilted flap on them; an island in the same plane.
                v(1.0, 0.0, 0.0),
                v(1.0, 1.0, 0.0),
                v(2.0, 0.0, 1.0),
                v(5.0, 0.0, 0.0),
                v(6.0, 0.0, 0.0),
                v(5.0, 1.0, 0.0),
            ],
            indices: vec![[0, 1, 2], [2, 1, 3], [4, 6, 5], [7, 8, 9]],
            normals: Vec::new(),
            uvs: Vec::new(),
        };
        assert_eq!(connected(&mesh), [0, 0, 2, 3]);
    }
}
