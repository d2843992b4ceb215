//! Random numbers with an address and the scenes that tests and benches share.

use glam::{Vec3, vec3};
use hemilux_accel::{Accel, GroupBuilder, SceneBuilder};

/// A stream of random numbers (PCG output hash of a counter).
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D)
    }

    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let word = ((self.0 >> ((self.0 >> 59) + 5)) ^ self.0).wrapping_mul(12_605_985_483_714_917_081);
        ((word >> 43) ^ word) as u32
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }

    pub fn below(&mut self, n: usize) -> usize {
        ((u64::from(self.bits()) * n as u64) >> 32) as usize
    }

    /// Uniform in a cube of half side `size`.
    pub fn point(&mut self, size: f32) -> Vec3 {
        vec3(self.unit() - 0.5, self.unit() - 0.5, self.unit() - 0.5) * (2.0 * size)
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let p = self.point(1.0);
            if (1e-3..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }

    /// Cosine-distributed around `n`.
    pub fn cosine(&mut self, n: Vec3) -> Vec3 {
        let d = n + self.direction() * 0.9999;
        d.normalize()
    }
}

#[derive(Clone, Default)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub indices: Vec<[u32; 3]>,
}

impl Mesh {
    pub fn triangle(&self, i: usize) -> [Vec3; 3] {
        self.indices[i].map(|k| self.positions[k as usize])
    }

    pub fn append(&mut self, other: &Mesh) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.indices.extend(other.indices.iter().map(|t| t.map(|k| k + base)));
    }

    pub fn map(mut self, f: impl Fn(Vec3) -> Vec3) -> Mesh {
        self.positions.iter_mut().for_each(|p| *p = f(*p));
        self
    }

    pub fn accel(&self) -> Accel {
        let mut group = GroupBuilder::new();
        group.add_mesh(&self.positions, &self.indices);
        SceneBuilder::new(group.build()).build()
    }
}

/// A unit sphere of 20 · 4^levels triangles with shared vertices.
pub fn icosphere(levels: u32) -> Mesh {
    let g = (1.0 + 5f32.sqrt()) / 2.0;
    let corners = [
        [-1.0, g, 0.0],
        [1.0, g, 0.0],
        [-1.0, -g, 0.0],
        [1.0, -g, 0.0],
        [0.0, -1.0, g],
        [0.0, 1.0, g],
        [0.0, -1.0, -g],
        [0.0, 1.0, -g],
        [g, 0.0, -1.0],
        [g, 0.0, 1.0],
        [-g, 0.0, -1.0],
        [-g, 0.0, 1.0],
    ];
    let faces = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    let mut mesh =
        Mesh { positions: corners.map(|c| Vec3::from(c).normalize()).to_vec(), indices: faces.to_vec() };
    for _ in 0..levels {
        let mut middles = std::collections::HashMap::new();
        let mut next = Vec::with_capacity(mesh.indices.len() * 4);
        for &[a, b, c] in &mesh.indices.clone() {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let p = (mesh.positions[i as usize] + mesh.positions[j as usize]).normalize();
                    mesh.positions.push(p);
                    (mesh.positions.len() - 1) as u32
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        mesh.indices = next;
    }
    mesh
}

/// An axis-aligned box with `n`² quads per face and shared corners along the edges (equal bits).
pub fn cuboid(min: Vec3, max: Vec3, n: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |k: u32, axis: usize| {
        if k == n { max[axis] } else { min[axis] + (max[axis] - min[axis]) * (k as f32 / n as f32) }
    };
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [min[axis], max[axis]] {
            let base = mesh.positions.len() as u32;
            for j in 0..=n {
                for i in 0..=n {
                    let mut p = Vec3::ZERO;
                    (p[axis], p[a], p[b]) = (side, at(i, a), at(j, b));
                    mesh.positions.push(p);
                }
            }
            for j in 0..n {
                for i in 0..n {
                    let v = base + j * (n + 1) + i;
                    mesh.indices.extend([[v, v + 1, v + n + 2], [v, v + n + 2, v + n + 1]]);
                }
            }
        }
    }
    mesh
}

/// A furnished room of about a thousand triangles, 4 × 5 × 2.6, seen from its middle.
pub fn room() -> Mesh {
    let mut mesh = cuboid(vec3(-2.0, -2.5, 0.0), vec3(2.0, 2.5, 2.6), 2);
    let table = |m: &mut Mesh, x: f32, y: f32| {
        m.append(&cuboid(vec3(x, y, 0.72), vec3(x + 1.2, y + 0.7, 0.76), 1));
        for (dx, dy) in [(0.0, 0.0), (1.15, 0.0), (0.0, 0.65), (1.15, 0.65)] {
            m.append(&cuboid(vec3(x + dx, y + dy, 0.0), vec3(x + dx + 0.05, y + dy + 0.05, 0.72), 1));
        }
    };
    for (x, y) in [(-1.8, -2.0), (0.2, 0.5), (-1.5, 1.4), (0.6, -2.2)] {
        table(&mut mesh, x, y);
    }
    for k in 0..12 {
        let (x, z) = (-1.9 + 0.3 * k as f32, 1.2 + 0.06 * k as f32);
        mesh.append(&cuboid(vec3(x, 2.2, z), vec3(x + 0.22, 2.45, z + 0.3), 1));
    }
    for (x, y, z) in [(-1.2, -1.7, 0.86), (0.8, 0.8, 0.86), (0.0, -0.5, 2.3)] {
        mesh.append(&icosphere(1).map(|p| p * 0.1 + vec3(x, y, z)));
    }
    mesh.append(&icosphere(2).map(|p| p * 0.3 + vec3(-0.9, 0.2, 0.3)));
    mesh
}

/// A sphere with bumps of all sizes, seen from inside: 20 · 4^levels triangles.
pub fn bumpy_sphere(levels: u32) -> Mesh {
    icosphere(levels).map(|p| {
        let mut r = 1.0;
        let mut f = 3.0;
        for k in 0..6 {
            let q = p * f + Vec3::splat(k as f32);
            r += 0.25 / f * (q.x.sin() * (q.y * 1.3).cos() + (q.z * 1.7 + q.x).sin());
            f *= 2.0;
        }
        p * r
    })
}
