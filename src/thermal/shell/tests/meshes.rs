//! Meshes of the tests of shells: squares of good, obtuse and nearly flat triangles, and a sphere.

use std::f64::consts::PI;

use glam::DVec3;

use crate::thermal::shell::{Shell, ShellMaterial, ShellSurface};

/// A mesh of one part and one material.
pub(super) struct Mesh {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// The unit square in `n` x `m` cells, each cut along one diagonal. `place` moves the inner points of the grid.
    pub(super) fn square(n: usize, m: usize, place: impl Fn(usize, usize) -> [f64; 2]) -> Self {
        let mut positions = Vec::new();
        for j in 0..=m {
            for i in 0..=n {
                let [x, y] = place(i, j);
                positions.push(DVec3::new(x, y, 0.0));
            }
        }
        let at = |i: usize, j: usize| (j * (n + 1) + i) as u32;
        let mut triangles = Vec::new();
        for j in 0..m {
            for i in 0..n {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Self { positions, triangles }
    }

    /// Grid points moved by up to `jitter` cells. The border keeps its shape.
    pub(super) fn jittered(n: usize, jitter: f64) -> Self {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 * 2.0 - 1.0
        };
        let moves: Vec<[f64; 2]> = (0..(n + 1) * (n + 1)).map(|_| [random(), random()]).collect();
        Self::square(n, n, |i, j| {
            let [dx, dy] = moves[j * (n + 1) + i];
            let inner = |index: usize, by: f64| if index == 0 || index == n { 0.0 } else { by };
            [(i as f64 + jitter * inner(i, dx)) / n as f64, (j as f64 + jitter * inner(j, dy)) / n as f64]
        })
    }

    /// Rows of flat cells, where the diagonals make nearly every triangle obtuse.
    pub(super) fn sheared(n: usize) -> Self {
        Self::square(n, 3 * n, |i, j| {
            let [x, y] = [i as f64 / n as f64, j as f64 / (3 * n) as f64];
            // A shear that vanishes at the left and right border.
            let shear = 2.5 / n as f64 * ((j % 3) as f64 - 1.0) * (PI * x).sin();
            [x + shear * 0.35, y]
        })
    }

    /// A good mesh whose inner triangles are split at a point just above their longest edge, which gives angles of 179 deg.
    pub(super) fn caps(n: usize) -> Self {
        let mut mesh = Self::jittered(n, 0.0);
        let mut triangles = Vec::new();
        for [a, b, c] in std::mem::take(&mut mesh.triangles) {
            let [pa, pb, pc] = [a, b, c].map(|v| mesh.positions[v as usize]);
            // The longest edge of a half square is the diagonal a-c in both halves.
            let (from, to, apex) = if pa.distance(pc) > pa.distance(pb) { (a, c, b) } else { (a, b, c) };
            let middle = 0.5 * (mesh.positions[from as usize] + mesh.positions[to as usize]);
            let towards = mesh.positions[apex as usize] - middle;
            let half = 0.5 * mesh.positions[from as usize].distance(mesh.positions[to as usize]);
            let tip = middle + towards.normalize() * half * (0.5_f64.to_radians()).tan();
            let new = mesh.positions.len() as u32;
            mesh.positions.push(tip);
            for [u, v, w] in [[a, b, new], [b, c, new], [c, a, new]] {
                triangles.push([u, v, w]);
            }
        }
        mesh.triangles = triangles;
        mesh
    }

    /// A good mesh with points near each edge of the border, half the edge times each of the falling `heights` from its middle. The triangles between them have obtuse angles, and no
    /// flip mends the outermost.
    pub(super) fn border_caps(n: usize, heights: &[f64]) -> Self {
        heights.iter().fold(Self::jittered(n, 0.0), |mesh, height| mesh.capped(*height))
    }

    fn capped(self, height: f64) -> Self {
        let mut mesh = self;
        let on_border = |p: DVec3| [p.x == 0.0, p.y == 0.0, p.x == 1.0, p.y == 1.0];
        let mut triangles = Vec::new();
        for triangle in std::mem::take(&mut mesh.triangles) {
            let border = (0..3).find(|k| {
                let [p, q] = [0, 1].map(|i| on_border(mesh.positions[triangle[(k + i) % 3] as usize]));
                p.iter().zip(q).any(|(p, q)| *p && q)
            });
            let Some(k) = border else {
                triangles.push(triangle);
                continue;
            };
            let [a, b, c] = [0, 1, 2].map(|i| triangle[(k + i) % 3]);
            let [pa, pb, pc] = [a, b, c].map(|v| mesh.positions[v as usize]);
            let inwards = (pc - pa).reject_from(pb - pa).normalize();
            let new = mesh.positions.len() as u32;
            mesh.positions.push(0.5 * (pa + pb) + inwards * 0.5 * pa.distance(pb) * height);
            triangles.extend([[a, b, new], [b, c, new], [c, a, new]]);
        }
        mesh.triangles = triangles;
        mesh
    }

    /// A sphere of radius 1: an octahedron subdivided `levels` times.
    pub(super) fn sphere(levels: u32) -> Self {
        let mut positions = vec![DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
        let mut triangles: Vec<[u32; 3]> =
            vec![[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]];
        for _ in 0..levels {
            let mut middles = std::collections::HashMap::new();
            let mut next = Vec::new();
            for [a, b, c] in triangles {
                let mut middle = |u: u32, v: u32| {
                    *middles.entry([u.min(v), u.max(v)]).or_insert_with(|| {
                        positions.push((positions[u as usize] + positions[v as usize]).normalize());
                        positions.len() as u32 - 1
                    })
                };
                let [m, n, p] = [middle(a, b), middle(b, c), middle(c, a)];
                next.extend([[a, m, p], [m, b, n], [p, n, c], [m, n, p]]);
            }
            triangles = next;
        }
        Self { positions, triangles }
    }

    pub(super) fn shell(&self, material: ShellMaterial) -> Shell {
        self.merged_shell(material, f64::INFINITY)
    }

    pub(super) fn merged_shell(&self, material: ShellMaterial, merge_rate: f64) -> Shell {
        let owners = vec![0; self.positions.len()];
        let surface =
            ShellSurface { positions: &self.positions, triangles: &self.triangles, parts: &owners, materials: &owners };
        Shell::new(&surface, &[Some(material)], &[], None, merge_rate, 0.0).unwrap()
    }

    pub(super) fn obtuse_share(&self) -> f64 {
        let obtuse = |triangle: &[u32; 3]| {
            (0..3).any(|k| {
                let [a, b, c] = [0, 1, 2].map(|i| self.positions[triangle[(k + i) % 3] as usize]);
                (b - a).dot(c - a) < -1e-12
            })
        };
        self.triangles.iter().filter(|triangle| obtuse(triangle)).count() as f64 / self.triangles.len() as f64
    }
}
