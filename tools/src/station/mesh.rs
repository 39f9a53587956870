//! Meshes built from a few primitives: blocks, struts, turned bodies, sheets.
//!
//! Blocks, struts and turned bodies are closed: watertight, outward normals, counter-clockwise from outside. A sheet is
//! a single layer of triangles. Flat faces have their own vertices; round ones share normals around the axis.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::material::Material;

/// Grid of positions [m]. It is a power of two, so positions are exact in f32. Shared corners stay equal, even on
/// machines whose sine differs in the last bit.
const GRID: f64 = 1.0 / 8192.0;

/// The triangles of one material in a mesh: a glTF primitive.
#[derive(Debug, Clone)]
pub struct Surface {
    /// Its material.
    pub material: Material,
    /// Vertex positions [m].
    pub positions: Vec<DVec3>,
    /// Unit normals, one a vertex.
    pub normals: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen against the normal.
    pub triangles: Vec<[u32; 3]>,
}

/// A glTF mesh with one surface for each material, in order of first use.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Its surfaces.
    pub surfaces: Vec<Surface>,
}

/// The axis of a turned body and how finely it is cut.
#[derive(Debug, Clone, Copy)]
pub struct Lathe {
    /// Point of the axis where `along` is 0 [m].
    pub origin: DVec3,
    /// Unit direction of growing `along`.
    pub axis: DVec3,
    /// Number of flat strips around the axis.
    pub segments: u32,
    /// Whether the strips keep flat normals (a window frame) instead of round ones (a cylinder).
    pub faceted: bool,
}

/// One band of a turned body: a material, and the end point of the band in the profile.
#[derive(Debug, Clone, Copy)]
pub struct Band(pub Material, pub f64, pub f64);

impl Lathe {
    /// A round body around `axis`.
    pub fn round(origin: DVec3, axis: DVec3, segments: u32) -> Self {
        Self { origin, axis, segments, faceted: false }
    }

    /// Unit vector away from the axis at strip boundary `step` (fractions lie within a strip).
    fn radial(&self, step: f64) -> DVec3 {
        let (u, v) = self.axis.any_orthonormal_pair();
        let (sine, cosine) = (TAU * step / f64::from(self.segments)).sin_cos();
        u * cosine + v * sine
    }
}

impl Mesh {
    /// The surface of a material. The first use creates it.
    fn surface(&mut self, material: Material) -> &mut Surface {
        let found = self.surfaces.iter().position(|s| s.material == material);
        let index = found.unwrap_or_else(|| {
            self.surfaces.push(Surface { material, positions: vec![], normals: vec![], triangles: vec![] });
            self.surfaces.len() - 1
        });
        &mut self.surfaces[index]
    }

    /// Adds a convex polygon, counter-clockwise, with a normal for each corner. Repeated corners are left out.
    fn polygon(&mut self, material: Material, corners: &[(DVec3, DVec3)]) {
        let surface = self.surface(material);
        let first = surface.positions.len() as u32;
        for &(position, normal) in corners {
            let position = (position / GRID).round() * GRID;
            let repeated = |other: &DVec3| *other == position;
            let own = &surface.positions[first as usize..];
            if !own.first().is_some_and(repeated) && !own.last().is_some_and(repeated) {
                surface.positions.push(position);
                surface.normals.push(normal);
            }
        }
        for corner in first + 2..surface.positions.len() as u32 {
            surface.triangles.push([first, corner - 1, corner]);
        }
    }

    /// A box from its centre and three half edges at right angles, right-handed [m].
    pub fn block(&mut self, material: Material, centre: DVec3, half: [DVec3; 3]) {
        let corner = |signs: [f64; 3]| centre + half[0] * signs[0] + half[1] * signs[1] + half[2] * signs[2];
        for axis in 0..3 {
            for side in [1.0, -1.0] {
                let normal = half[axis].normalize() * side;
                let face = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(u, v)| {
                    let mut signs = [0.0; 3];
                    signs[axis] = side;
                    // The mirrored face goes around the other way.
                    signs[(axis + 1) % 3] = u * side;
                    signs[(axis + 2) % 3] = v;
                    (corner(signs), normal)
                });
                self.polygon(material, &face);
            }
        }
    }

    /// A box with edges along the axes [m].
    pub fn cuboid(&mut self, material: Material, centre: DVec3, size: DVec3) {
        let half = size / 2.0;
        self.block(material, centre, [DVec3::X * half.x, DVec3::Y * half.y, DVec3::Z * half.z]);
    }

    /// A square bar between two points [m].
    pub fn strut(&mut self, material: Material, from: DVec3, to: DVec3, width: f64) {
        let axis = (to - from).normalize();
        let (u, v) = axis.any_orthonormal_pair();
        self.block(material, (from + to) / 2.0, [(to - from) / 2.0, u * width / 2.0, v * width / 2.0]);
    }

    /// A turned body: its profile starts on the axis at `start` [m], runs through the bands and must end on the axis.
    pub fn turn(&mut self, lathe: &Lathe, start: f64, bands: &[Band]) {
        let (mut along, mut radius) = (start, 0.0);
        for &Band(material, next_along, next_radius) in bands {
            let (rise, run) = (next_radius - radius, next_along - along);
            let slope = run.hypot(rise);
            let at = |a: f64, r: f64, step: u32, normal_step: f64| {
                let radial = lathe.radial(f64::from(step % lathe.segments));
                let normal = (lathe.radial(normal_step) * run - lathe.axis * rise) / slope;
                (lathe.origin + lathe.axis * a + radial * r, normal)
            };
            for strip in 0..lathe.segments {
                let middle = f64::from(strip) + 0.5;
                let side = |step: u32, r: f64| {
                    if lathe.faceted || r == 0.0 { middle } else { f64::from(step) }
                };
                self.polygon(
                    material,
                    &[
                        at(along, radius, strip, side(strip, radius)),
                        at(along, radius, strip + 1, side(strip + 1, radius)),
                        at(next_along, next_radius, strip + 1, side(strip + 1, next_radius)),
                        at(next_along, next_radius, strip, side(strip, next_radius)),
                    ],
                );
            }
            (along, radius) = (next_along, next_radius);
        }
    }

    /// A closed cylinder of one material from `origin` along the unit vector `axis` [m].
    pub fn cylinder(&mut self, material: Material, origin: DVec3, axis: DVec3, radius: f64, length: f64) {
        let bands = [Band(material, 0.0, radius), Band(material, length, radius), Band(material, length, 0.0)];
        self.turn(&Lathe::round(origin, axis, 12), 0.0, &bands);
    }

    /// A single layer of `count` equal rectangles in a row along `length`, with `gap` [m] between them; the normal
    /// points along `length` x `width`.
    pub fn sheet(&mut self, material: Material, corner: DVec3, length: DVec3, width: DVec3, count: u32, gap: f64) {
        let normal = length.cross(width).normalize();
        let pitch = (length.length() + gap) / f64::from(count);
        let direction = length.normalize();
        for panel in 0..count {
            let near = corner + direction * (pitch * f64::from(panel));
            let far = near + direction * (pitch - gap);
            self.polygon(material, &[near, far, far + width, near + width].map(|point| (point, normal)));
        }
    }
}
