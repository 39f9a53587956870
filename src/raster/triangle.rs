//! A triangle in camera axes: the rays that may meet it, and its values where they do.

use glam::{DVec2, DVec3};

use super::surface::{Pixel, RasterSurface};
use super::view::RasterView;

pub(super) struct Projected {
    /// Weights of the vertices on the ray d are `planes[i] . d`.
    planes: [DVec3; 3],
    temperatures: [f64; 3],
    pub(crate) rays: RayBounds,
    /// Normals of the visible face at the vertices, camera axes. 0 where nothing needs them.
    normals: [DVec3; 3],
    /// 0 for the front, 1 for the back.
    face: usize,
    node: u32,
    emissivity: f64,
    part: u32,
    material: u32,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct RayBounds {
    pub(crate) low: DVec2,
    pub(crate) high: DVec2,
}

impl RayBounds {
    pub(crate) const NONE: Self = Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY };

    pub(crate) fn with(self, ray: DVec2) -> Self {
        Self { low: self.low.min(ray), high: self.high.max(ray) }
    }

    pub(crate) fn meets(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct ShownFace {
    /// Normal of length 1, camera axes.
    pub(crate) normal: DVec3,
    /// 0 for the front, 1 for the back.
    pub(crate) face: usize,
    /// The first corner of its triangle.
    pub(crate) node: u32,
}

/// Draws the samples of a triangle, with its emissivity in place of the radiance.
pub(super) fn draw(
    triangle: &Projected,
    near: f64,
    rays: &[DVec2],
    samples: &mut [Pixel],
    shown: &mut [Option<ShownFace>],
) {
    for ((ray, sample), shown) in rays.iter().zip(samples).zip(shown) {
        let weights = triangle.planes.map(|plane| plane.dot(ray.extend(1.0)));
        let depth = 1.0 / weights.iter().sum::<f64>();
        if weights.iter().all(|&w| w >= 0.0) && depth >= near && depth < sample.depth {
            let weighted: f64 = weights.iter().zip(triangle.temperatures).map(|(w, t)| w * t).sum();
            let normal: DVec3 = weights.iter().zip(triangle.normals).map(|(weight, normal)| *weight * normal).sum();
            *shown = Some(ShownFace { normal: normal.normalize_or_zero(), face: triangle.face, node: triangle.node });
            *sample = Pixel {
                reflected: 0.0,
                radiance: triangle.emissivity,
                coverage: 1.0,
                temperature: weighted * depth,
                depth,
                part: triangle.part + 1,
                material: triangle.material + 1,
            };
        }
    }
}

/// Prepares a triangle. `None` where it can not cover a pixel: behind the near plane, or seen edge-on.
pub(super) fn project(surface: &RasterSurface, view: &RasterView, triangle: [u32; 3]) -> Option<Projected> {
    let indices = triangle.map(|vertex| vertex as usize);
    let [a, b, c] = indices.map(|vertex| view.camera_from_body.transform_point3(surface.positions[vertex]));
    let rays = bounds(view.near, [a, b, c]);
    // a . (b x c) as a product with edges, which does not cancel for a small triangle far away.
    let volume = a.dot((b - a).cross(c - a));
    if volume == 0.0 {
        return None;
    }
    let planes = [b.cross(c - b), c.cross(a - c), a.cross(b - a)].map(|plane| plane / volume);
    let material = surface.vertex_material[indices[0]];
    // The camera is at the origin, so the outward normal points to it where a . normal < 0.
    let face = usize::from(volume > 0.0);
    let side = if face == 0 { 1.0 } else { -1.0 };
    let normals = indices.map(|vertex| {
        let normal = surface.around.as_ref().and_then(|around| around.normals.get(vertex));
        normal.map_or(DVec3::ZERO, |normal| side * (view.camera_from_body.matrix3 * *normal))
    });
    Some(Projected {
        normals,
        face,
        node: triangle[0],
        planes,
        temperatures: indices.map(|vertex| surface.temperatures[vertex]),
        rays,
        emissivity: surface.emissivities[material as usize][face],
        part: surface.vertex_part[indices[0]],
        material,
    })
}

/// Rays that may meet a triangle, from its corners clipped at the near plane.
pub(super) fn bounds(near: f64, corners: [DVec3; 3]) -> RayBounds {
    let mut bounds = RayBounds::NONE;
    for i in 0..3 {
        let (from, to) = (corners[i], corners[(i + 1) % 3]);
        if from.z >= near {
            bounds = bounds.with(from.truncate() / from.z);
        }
        if (from.z >= near) != (to.z >= near) {
            let clipped = from.lerp(to, (near - from.z) / (to.z - from.z));
            bounds = bounds.with(clipped.truncate() / clipped.z);
        }
    }
    // A little more on each side against rounding. The weights decide which rays meet the triangle.
    let rounding = 1e-9 * (DVec2::ONE + bounds.low.abs().max(bounds.high.abs()));
    RayBounds { low: bounds.low - rounding, high: bounds.high + rounding }
}
