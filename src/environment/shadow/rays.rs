//! Rays against the triangles of a craft: whether one is hidden, and where it ends.
//!
//! The boxes are from `obvhs`, an eight-way compressed tree in f32; a triangle is met in f64. One function serves shadows, radiation between surfaces,
//! mirrors and view factors. The device has a tree of its own (`tree.rs`), which needs no stack.

use glam::{DVec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::{Ray, RayHit};

use super::boxes::boxes_around;
use super::tree::Tree;

/// Distance between a ray's start and its surface, as a share of the size of the craft.
const START: f64 = 1e-5;
/// Growth of a triangle's box as a share of its coordinates, several units in the last place of f32. A flat box would lose rays to rounding.
const GROWTH: f32 = 1e-6;

/// Distance by which a walk through the boxes begins before the start of its ray, in lengths of its direction.
const BEFORE: f64 = 2e-4;

/// Triangles that a ray can meet, and the boxes that find them.
#[derive(Debug, Clone)]
pub struct Occluders {
    /// Corner and edges of each triangle [m].
    pub(crate) triangles: Vec<[DVec3; 3]>,
    boxes: CwBvh,
    /// Lower and upper corner of the box around all triangles [m].
    pub(crate) bounds: [DVec3; 2],
    /// Distance between a ray's start and its surface [m].
    pub(crate) start: f64,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Number of the triangle.
    pub(crate) triangle: usize,
    /// Distance from the start of the ray [m].
    pub(crate) distance: f64,
    /// Weight of its second corner.
    pub(crate) u: f64,
    /// Weight of its third corner.
    pub(crate) v: f64,
    /// Whether the ray meets the face around which the corners turn to the left.
    pub(crate) outside: bool,
}

impl Occluders {
    /// The occluders of triangles with positions [m].
    pub(crate) fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let triangles = edges_of(positions, triangles);
        let boxes: Vec<Aabb> = triangles.iter().map(grown).collect();
        let around_each: Vec<[DVec3; 2]> = triangles.iter().map(around).collect();
        let (bounds, start) = (around_all(&around_each), start_over(&around_each));
        Self { triangles, boxes: boxes_around(&boxes), bounds, start }
    }

    /// The tree of these triangles for the device.
    pub(crate) fn tree(&self) -> Tree {
        Tree::new(self.boxes_of_triangles())
    }

    /// The box around each triangle: lower and upper corner [m].
    pub(crate) fn boxes_of_triangles(&self) -> Vec<[DVec3; 2]> {
        self.triangles.iter().map(around).collect()
    }

    /// Whether a triangle lies in a direction from a point [m].
    pub(crate) fn is_hidden(&self, from: DVec3, direction: DVec3) -> bool {
        !self.boxes.ray_traverse_miss(ray(from, direction), |_, place| {
            let triangle = self.boxes.primitive_indices[place] as usize;
            meets(&self.triangles[triangle], from, direction).map_or(f32::INFINITY, |_| 0.0)
        })
    }

    /// The first triangle in a direction from a point [m]. Of two at the same distance it is the one with the smaller number.
    pub(crate) fn first(&self, from: DVec3, direction: DVec3) -> Option<Hit> {
        self.first_within(from, direction, f64::INFINITY)
    }

    /// The first triangle at most so far away.
    pub(crate) fn first_within(&self, from: DVec3, direction: DVec3, most: f64) -> Option<Hit> {
        self.first_among([from, direction], most, |_| true)
    }

    /// The first triangle at most so far away among those that count.
    pub(crate) fn first_among(
        &self,
        [from, direction]: [DVec3; 2],
        most: f64,
        counts: impl Fn(usize) -> bool,
    ) -> Option<Hit> {
        let mut first: Option<Hit> = None;
        let way = Ray { tmax: ((most + BEFORE) as f32).next_up(), ..ray(from, direction) };
        self.boxes.ray_traverse(way, &mut RayHit::none(), |_, place| {
            let number = self.boxes.primitive_indices[place] as usize;
            let triangle = &self.triangles[number];
            let Some((distance, u, v)) = meets(triangle, from, direction) else { return f32::INFINITY };
            let is_later = |hit: Hit| (hit.distance, hit.triangle) < (distance, number);
            if distance > most || first.is_some_and(is_later) || !counts(number) {
                return f32::INFINITY;
            }
            let outside = triangle[1].cross(triangle[2]).dot(direction) < 0.0;
            first = Some(Hit { triangle: number, distance, u, v, outside });
            // Triangles at the same distance are met as well.
            ((distance + BEFORE) as f32).next_up()
        });
        first
    }
}

/// Corner and edges of each triangle [m].
pub(super) fn edges_of(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<[DVec3; 3]> {
    let edges = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        [a, b - a, c - a]
    };
    triangles.iter().map(edges).collect()
}

fn around_all(boxes: &[[DVec3; 2]]) -> [DVec3; 2] {
    boxes.iter().fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], [l, h]| [low.min(*l), high.max(*h)])
}

/// Distance between the start of a ray and its surface, for triangles in these boxes [m].
pub(super) fn start_over(boxes: &[[DVec3; 2]]) -> f64 {
    let [low, high] = around_all(boxes);
    if boxes.is_empty() { 0.0 } else { START * (high - low).length() }
}

/// Lower and upper corner of the box around a triangle [m].
pub(super) fn around([corner, first, second]: &[DVec3; 3]) -> [DVec3; 2] {
    let (b, c) = (corner + first, corner + second);
    [corner.min(b).min(c), corner.max(b).max(c)]
}

/// The box around a triangle, grown against rounding to f32.
fn grown(triangle: &[DVec3; 3]) -> Aabb {
    let [low, high] = around(triangle).map(DVec3::as_vec3a);
    let growth = Vec3A::splat(GROWTH * low.abs().max(high.abs()).max_element());
    Aabb::new(low - growth, high + growth)
}

/// The ray in f32. `obvhs` overlooks all boxes that end within 1e-4 of the start, so the walk begins before it. It overlooks all boxes where a component of the direction
/// is -0, which becomes 0 here.
fn ray(from: DVec3, direction: DVec3) -> Ray {
    Ray::new_inf((from - BEFORE * direction).as_vec3a(), direction.as_vec3a() + Vec3A::ZERO)
}

/// Distance at which a ray meets a triangle (Moeller and Trumbore 1997), from either side, and the weights of its second and third corner.
fn meets([corner, first, second]: &[DVec3; 3], from: DVec3, direction: DVec3) -> Option<(f64, f64, f64)> {
    let p = direction.cross(*second);
    let determinant = first.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let to = from - *corner;
    let u = to.dot(p) / determinant;
    let q = to.cross(*first);
    let v = direction.dot(q) / determinant;
    let distance = second.dot(q) / determinant;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some((distance, u, v))
}

#[cfg(test)]
mod tests;
