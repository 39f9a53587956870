//! Surfaces of known view factors: grids of rectangles, discs, spheres and cylinders, each a part of its own.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use isotherm::internals::{Bulk, Material, Optics, PatchSurface, Response, Sides};

/// A surface that grows part by part.
#[derive(Default)]
pub struct Shapes {
    pub surface: PatchSurface,
    pub materials: Vec<Material>,
}

/// A material of one face.
pub fn grey(absorptivity: f64, emissivity: f64) -> Material {
    Material {
        name: "grey".into(),
        front: Optics { absorptivity, emissivity },
        sides: Sides::Outside,
        gloss: Default::default(),
        in_band: Default::default(),
        bulk: Bulk::default(),
        response: Response::Instant,
        transition: None,
        ranges: [None; 2],
        source: "test".into(),
    }
}

impl Shapes {
    /// Adds a part: points with normals on a grid of `columns` by `rows` cells, from numbers in [0, 1].
    pub fn part(
        &mut self,
        [columns, rows]: [usize; 2],
        material: Material,
        point: impl Fn(f64, f64) -> [DVec3; 2],
    ) -> &mut Self {
        let surface = &mut self.surface;
        let first = surface.positions.len() as u32;
        let part = self.materials.len() as u32;
        for row in 0..=rows {
            for column in 0..=columns {
                let [position, normal] = point(column as f64 / columns as f64, row as f64 / rows as f64);
                surface.positions.push(position);
                surface.normals.push(normal);
                surface.parts.push(part);
                surface.materials.push(part);
                surface.joints.push(0);
                surface.areas.push(0.0);
            }
        }
        let across = columns as u32 + 1;
        for cell in 0..(columns * rows) as u32 {
            let a = first + cell / columns as u32 * across + cell % columns as u32;
            for mut triangle in [[a, a + 1, a + across + 1], [a, a + across + 1, a + across]] {
                let [p, q, r] = triangle.map(|node| surface.positions[node as usize]);
                let turn = (q - p).cross(r - p);
                if turn.length() < 1e-12 {
                    continue;
                }
                let normal: DVec3 = triangle.iter().map(|node| surface.normals[*node as usize]).sum();
                if turn.dot(normal) < 0.0 {
                    triangle.swap(1, 2);
                }
                triangle.iter().for_each(|node| surface.areas[*node as usize] += turn.length() / 6.0);
                surface.triangles.push(triangle);
            }
        }
        self.materials.push(material);
        self
    }

    /// A parallelogram with its normal along `right` x `up`.
    pub fn plate(&mut self, corner: DVec3, right: DVec3, up: DVec3, cells: usize, material: Material) -> &mut Self {
        let normal = right.cross(up).normalize();
        self.part([cells, cells], material, |u, v| [corner + u * right + v * up, normal])
    }

    /// A disc about the z axis at a height. Its normal points up or down.
    pub fn disc(&mut self, height: f64, radius: f64, up: bool, material: Material) -> &mut Self {
        let normal = if up { DVec3::Z } else { -DVec3::Z };
        self.part([128, 6], material, |u, v| {
            [DVec3::new(radius * v * (TAU * u).cos(), radius * v * (TAU * u).sin(), height), normal]
        })
    }

    /// A sphere about the origin whose normals point out or in.
    pub fn sphere(&mut self, radius: f64, out: bool, material: Material) -> &mut Self {
        let sign = if out { 1.0 } else { -1.0 };
        self.part([96, 48], material, |u, v| {
            let (sine, cosine) = (PI * v).sin_cos();
            let normal = DVec3::new(sine * (TAU * u).cos(), sine * (TAU * u).sin(), cosine);
            [radius * normal, sign * normal]
        })
    }

    /// A cylinder about the z axis from 0 to a height whose normals point out or in.
    pub fn cylinder(&mut self, radius: f64, height: f64, out: bool, material: Material) -> &mut Self {
        let sign = if out { 1.0 } else { -1.0 };
        self.part([192, 8], material, |u, v| {
            let normal = DVec3::new((TAU * u).cos(), (TAU * u).sin(), 0.0);
            [radius * normal + height * v * DVec3::Z, sign * normal]
        })
    }

    /// The inside of a box from the origin, one part for each wall.
    pub fn room(&mut self, size: DVec3, cells: usize, material: impl Fn(usize) -> Material) -> &mut Self {
        let [x, y, z] = [DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z];
        for (wall, (corner, right, up)) in
            [(DVec3::ZERO, x, y), (z, y, x), (DVec3::ZERO, y, z), (x, z, y), (DVec3::ZERO, z, x), (y, x, z)]
                .into_iter()
                .enumerate()
        {
            self.plate(corner, right, up, cells, material(wall));
        }
        self
    }
}
