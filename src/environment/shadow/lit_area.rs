//! Sunlight on areas: the lit area vector of every node.
//!
//! A *corner* is the third of a triangle that belongs to one of its nodes. It has an area A_c and the unit normal n_c of the triangle. A node with corners c and
//! the area A absorbs the sunlight alpha S max(0, G . s) from the direction s, where
//!
//! ```text
//! G = (1 / A) sum_c A_c v_c n_c    over the corners that face the Sun,
//! ```
//!
//! v_c is the lit share of the corner, and n_c points to the side of the Sun. G is the *lit area vector*. It replaces the node's normal and a visibility at the
//! vertex. The sum of A G over all nodes is the lit area vector of the craft. Between two findings the cosine still follows the Sun.
//!
//! v_c comes from samples inside the corner, never on its border. Each sends one ray to a point of the Sun's disc, so that a penumbra costs no further ray.
//! Where the samples of a node disagree, the node lies on the border of a shadow and gets more of them.

use std::sync::Arc;

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::points::{Disc, fractions, point_near_corner, shifts};
use super::{Occluders, Redraw};
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;

/// Cosine of the angle between the normals of a node and of its triangle below which the node is not flat.
const FLAT: f64 = 1.0 - 1e-7;

/// Samples of a node, at least.
const LEAST_SAMPLES: u32 = 4;
/// Samples of a node on the border of a shadow. A sample is then less than a kelvin on a surface that radiates at 340 K: T / (4 x 96).
const BORDER_SAMPLES: u32 = 96;

/// Sunlit area of a node.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct LitArea {
    /// Lit area vector over the node's area, in the frame of its joint.
    pub vector: DVec3,
    /// Share of the light that falls on the front. The rest falls on the back.
    pub front: f64,
}

impl LitArea {
    /// The light on a node without a triangle, which sees the Sun as its normal does.
    fn by_normal(node: &LitNode, sun: DVec3) -> Self {
        let front = node.normal.dot(sun) >= 0.0;
        let vector = match (front, node.both_sides) {
            (true, _) => node.normal,
            (false, true) => -node.normal,
            (false, false) => DVec3::ZERO,
        };
        Self { vector, front: f64::from(u8::from(front)) }
    }

    /// Sunlight on the front and on the back [W/m2], averaged over the step, on a node of a joint with this pose.
    pub(crate) fn flux(&self, load: &StepLoad, pose: Option<&DAffine3>) -> [f64; 2] {
        let vector = pose.map_or(self.vector, |pose| pose.matrix3 * self.vector);
        let flux = solar_flux(load, vector);
        [self.front * flux, (1.0 - self.front) * flux]
    }
}

/// Lit areas of nodes.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Lit {
    /// One for each node. Empty where normals tell the light.
    pub areas: Vec<LitArea>,
    /// Whether rays tell that parts of the craft hide the Sun.
    pub by_rays: bool,
}

impl Lit {
    /// Lit areas of `count` nodes. The known ones belong to `slots`, in that order; the others are dark.
    pub(crate) fn of_slots(&self, slots: impl Iterator<Item = usize>, count: usize) -> Self {
        let mut all = Self::default();
        all.take(slots, self, count);
        all
    }

    /// Takes the known areas of some of `count` nodes.
    pub(crate) fn take(&mut self, slots: impl Iterator<Item = usize>, known: &Self, count: usize) {
        if known.areas.is_empty() {
            return;
        }
        self.areas.resize(count, LitArea::default());
        slots.zip(&known.areas).for_each(|(slot, area)| self.areas[slot] = *area);
        self.by_rays = known.by_rays;
    }
}

/// A node that the Sun may light.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LitNode {
    /// Its number among all nodes.
    pub(crate) number: u32,
    /// Its number in the model, from which its samples follow: the same in whatever order a device has the nodes.
    pub(crate) vertex: u32,
    /// Unit normal in the frame of its joint.
    pub(crate) normal: DVec3,
    /// Whether the side against the normal absorbs light too.
    pub(crate) both_sides: bool,
    /// Joint; 0 is the body.
    pub(crate) joint: u32,
}

/// The surface of a craft as the Sun lights it, in the file's pose.
#[derive(Debug, Clone)]
pub(crate) struct LitSurface {
    /// Positions of all nodes [m].
    pub(crate) positions: Vec<DVec3>,
    /// Nodes of the triangles.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Triangles that cast shadows, by joint. Empty where the craft casts none on itself.
    pub(crate) casters: Vec<(u32, Occluders)>,
    /// Largest distance between two samples [m].
    pub(crate) spacing: f64,
    /// Samples on an area, over the usual number.
    pub(crate) times: u32,
}

/// The part of a triangle that belongs to a node.
struct Corner {
    /// Unit normal on the side of the node's normal.
    normal: DVec3,
    /// Area [m2].
    area: f64,
}

impl LitSurface {
    /// The triangle and the place in it of a corner: number of the triangle times three, plus the place.
    fn corner(&self, corner: u32, node_normal: DVec3) -> Corner {
        let [a, b, c] = self.placed(corner);
        let twice = (b - a).cross(c - a);
        let length = twice.length();
        let normal = if length > 0.0 { twice / length } else { DVec3::ZERO };
        Corner { normal: if normal.dot(node_normal) < 0.0 { -normal } else { normal }, area: length / 6.0 }
    }

    fn placed(&self, corner: u32) -> [DVec3; 3] {
        self.triangles[corner as usize / 3].map(|node| self.positions[node as usize])
    }

    /// Distance between the start of a ray and its surface [m].
    fn start(&self) -> f64 {
        self.casters.iter().map(|(_, occluders)| occluders.start).fold(0.0, f64::max)
    }

    /// Samples of a node whose corners that face the Sun have an area [m2].
    fn samples(&self, area: f64) -> u32 {
        self.times * ((area / (self.spacing * self.spacing)).ceil() as u32).max(LEAST_SAMPLES)
    }
}

/// Finds the lit areas of a set of nodes.
#[derive(Debug, Clone)]
pub struct LitAreas {
    pub(super) surface: Arc<LitSurface>,
    nodes: Vec<LitNode>,
    /// First corner of each node, and the one after the last.
    first: Vec<u32>,
    corners: Vec<u32>,
    /// For which light and poses they were found last. A saved state keeps them.
    pub(crate) redraw: Redraw,
}

impl LitAreas {
    /// The lit areas of some nodes of a surface.
    pub(crate) fn new(surface: Arc<LitSurface>, nodes: Vec<LitNode>, redraw: Redraw) -> Self {
        let mut place = vec![u32::MAX; surface.positions.len()];
        for (index, node) in nodes.iter().enumerate() {
            place[node.number as usize] = index as u32;
        }
        let owners = || surface.triangles.as_flattened().iter().map(|node| place[*node as usize]).enumerate();
        let mut first = vec![0u32; nodes.len() + 1];
        for (_, owner) in owners().filter(|(_, owner)| *owner != u32::MAX) {
            first[owner as usize + 1] += 1;
        }
        for index in 0..nodes.len() {
            first[index + 1] += first[index];
        }
        let mut next = first.clone();
        let mut corners = vec![0; first[nodes.len()] as usize];
        for (corner, owner) in owners().filter(|(_, owner)| *owner != u32::MAX) {
            corners[next[owner as usize] as usize] = corner as u32;
            next[owner as usize] += 1;
        }
        Self { surface, nodes, first, corners, redraw }
    }

    /// The same with `times` as many samples on an area.
    pub fn with_samples(&self, times: u32) -> Self {
        let surface = LitSurface { times: times * self.surface.times, ..(*self.surface).clone() };
        Self { surface: Arc::new(surface), ..self.clone() }
    }

    /// Numbers of the nodes, in their order.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = usize> {
        self.nodes.iter().map(|node| node.number as usize)
    }

    /// Whether rays tell that parts of the craft hide the Sun.
    pub(crate) fn by_rays(&self) -> bool {
        !self.surface.casters.is_empty()
    }

    /// Whether the normal of every node is the normal of its triangles, so that light needs no lit areas unless something hides the Sun.
    pub(crate) fn are_flat(&self) -> bool {
        let flat = |(index, node): (usize, &LitNode)| {
            self.corners_of(index).iter().all(|corner| {
                let corner = self.surface.corner(*corner, node.normal);
                corner.area == 0.0 || corner.normal.dot(node.normal) > FLAT
            })
        };
        self.nodes.par_iter().enumerate().map(|(index, node)| flat((index, node))).all(|flat| flat)
    }

    fn corners_of(&self, index: usize) -> &[u32] {
        &self.corners[self.first[index] as usize..self.first[index + 1] as usize]
    }

    /// Lit area of each node. `None` where the last result still holds for the load, or where it is dark.
    pub fn find(&mut self, load: &StepLoad) -> Option<Vec<LitArea>> {
        let sun = self.redraw.due(load)?;
        Some(self.under(sun, &load.joints))
    }

    /// Lit area of each node under a Sun (unit vector, body frame), with joints in these poses.
    pub fn under(&self, sun: DVec3, poses: &[DAffine3]) -> Vec<LitArea> {
        let views = self.views(sun, poses);
        let areas = self.nodes.par_iter().enumerate().with_min_len(64);
        areas.map(|(index, node)| self.lit_area(index, node, &views[node.joint as usize])).collect()
    }

    /// The Sun and the shadow casters as the nodes of each joint see them.
    fn views(&self, sun: DVec3, poses: &[DAffine3]) -> Vec<JointView<'_>> {
        let joints = self.nodes.iter().map(|node| node.joint + 1).max().unwrap_or(1);
        (0..joints).map(|joint| JointView::new(&self.surface, sun, poses, joint)).collect()
    }

    fn lit_area(&self, index: usize, node: &LitNode, view: &JointView<'_>) -> LitArea {
        let (corners, area) = self.facing(index, node, view);
        if area == 0.0 { LitArea::by_normal(node, view.disc.centre) } else { sum(&corners, area) }
    }

    /// The corners of a node that the Sun may light, with their samples, and the area of all its corners [m2].
    fn facing(&self, index: usize, node: &LitNode, view: &JointView<'_>) -> (Vec<FacingCorner>, f64) {
        let sun = view.disc.centre;
        let mut area = 0.0;
        let mut corners: Vec<FacingCorner> = Vec::with_capacity(self.corners_of(index).len());
        for &number in self.corners_of(index) {
            let corner = self.surface.corner(number, node.normal);
            area += corner.area;
            let cosine = corner.normal.dot(sun);
            if cosine > 0.0 || (cosine < 0.0 && node.both_sides) {
                let side = corner.normal * cosine.signum();
                corners.push(FacingCorner { number, area: corner.area, side, cosine, samples: 0, lit: 0 });
            }
        }
        if !view.casters.is_empty() {
            self.cast(&mut corners, shifts(node.vertex), view);
        }
        (corners, area)
    }

    /// As [`Self::under`], and the light of each corner: three for each triangle of the surface, from the same samples. Corners that turn away, or belong to
    /// none of the nodes, are dark.
    pub(crate) fn corners_under(&self, sun: DVec3, poses: &[DAffine3]) -> (Vec<LitArea>, Vec<CornerLight>) {
        let views = self.views(sun, poses);
        let light = |(index, node): (usize, &LitNode)| {
            let (corners, area) = self.facing(index, node, &views[node.joint as usize]);
            let lights: Vec<_> = corners.iter().map(|corner| (corner.number, corner.light(&corners))).collect();
            (if area == 0.0 { LitArea::by_normal(node, sun) } else { sum(&corners, area) }, lights)
        };
        let nodes = self.nodes.par_iter().enumerate().with_min_len(64);
        let (areas, of_nodes): (Vec<LitArea>, Vec<Vec<(u32, CornerLight)>>) = nodes.map(light).unzip();
        let mut lights = vec![CornerLight::default(); 3 * self.surface.triangles.len()];
        of_nodes.into_iter().flatten().for_each(|(number, light)| lights[number as usize] = light);
        (areas, lights)
    }

    /// Casts the rays of a node to the Sun: some for all nodes, and more on the border of a shadow.
    fn cast(&self, corners: &mut [FacingCorner], shifts: [u32; 4], view: &JointView<'_>) {
        let surface = &*self.surface;
        let facing: f64 = corners.iter().map(|corner| corner.area).sum();
        let mut sample = 0;
        let mut lit_of = |corner: &FacingCorner, samples: u32| {
            let first = sample;
            sample += samples;
            (first..sample).filter(|sample| self.is_lit(corner, fractions(shifts, *sample), view)).count() as u32
        };
        let samples = surface.samples(facing);
        // Corners get samples as their areas say, from a start of the node's own.
        let start = f64::from(shifts[0]) / 2f64.powi(32);
        let (mut before, mut up_to) = (0u32, 0.0);
        for corner in corners.iter_mut() {
            up_to += corner.area;
            let end = (f64::from(samples) * (up_to / facing).min(1.0) + start).floor() as u32;
            corner.samples = end - before;
            before = end;
            corner.lit = lit_of(corner, corner.samples);
        }
        let lit: u32 = corners.iter().map(|corner| corner.lit).sum();
        let border = BORDER_SAMPLES * surface.times;
        if lit == 0 || lit == before || before >= border {
            return;
        }
        for corner in corners {
            let more = (f64::from(border - before) * corner.area / facing).ceil() as u32;
            corner.lit += lit_of(corner, more);
            corner.samples += more;
        }
    }

    /// Whether the ray of a sample leaves the craft.
    fn is_lit(&self, corner: &FacingCorner, [s, t, u, v]: [f64; 4], view: &JointView<'_>) -> bool {
        let [a, b, c] = self.surface.placed(corner.number);
        let [second, third] = point_near_corner([s, t], corner.number as usize % 3);
        let from = a + second * (b - a) + third * (c - a) + view.start * corner.side;
        !view.is_hidden(from, view.disc.point([u, v]))
    }
}

/// A corner that the Sun may light.
struct FacingCorner {
    number: u32,
    /// Area [m2].
    area: f64,
    /// Unit normal on the side of the Sun.
    side: DVec3,
    /// Cosine between the Sun and the corner's normal, which is on the side of the node's.
    cosine: f64,
    samples: u32,
    /// Samples that see the Sun.
    lit: u32,
}

/// The light of a corner of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub(crate) struct CornerLight {
    /// Share of the corner that is lit.
    pub(crate) share: f32,
}

impl CornerLight {
    /// A corner that nothing hides from the Sun.
    pub(crate) const UNHIDDEN: Self = Self { share: 1.0 };

    /// Standard deviation of the light at a point of the corner, over the light of a lit point. The noise of the samples is smaller.
    pub(crate) fn spread(self) -> f64 {
        let share = f64::from(self.share);
        (share * (1.0 - share)).max(0.0).sqrt()
    }
}

impl FacingCorner {
    /// The light of this corner, one of all that face the Sun. Without a sample it is lit as the others are.
    fn light(&self, all: &[Self]) -> CornerLight {
        let share = share(self.lit, self.samples).unwrap_or_else(|| whole_share(all));
        CornerLight { share: share as f32 }
    }
}

/// Share of samples that are lit. `None` without samples.
fn share(lit: u32, samples: u32) -> Option<f64> {
    (samples > 0).then(|| f64::from(lit) / f64::from(samples))
}

/// Lit share of all samples of a node. 1 where nothing can hide the Sun.
fn whole_share(corners: &[FacingCorner]) -> f64 {
    let [lit, samples] = corners.iter().fold([0, 0], |[lit, all], corner| [lit + corner.lit, all + corner.samples]);
    share(lit, samples).unwrap_or(1.0)
}

/// The lit area of the corners of a node with an area [m2]. A corner without a sample is lit as the others are.
fn sum(corners: &[FacingCorner], area: f64) -> LitArea {
    let whole = whole_share(corners);
    let (mut vector, mut on_front, mut all) = (DVec3::ZERO, 0.0, 0.0);
    for corner in corners {
        let lit = corner.area * share(corner.lit, corner.samples).unwrap_or(whole);
        vector += lit * corner.side;
        all += lit * corner.cosine.abs();
        on_front += lit * corner.cosine.max(0.0);
    }
    LitArea { vector: vector / area, front: if all > 0.0 { on_front / all } else { 1.0 } }
}

/// The Sun and the shadow casters as the nodes of a joint see them.
struct JointView<'a> {
    disc: Disc,
    start: f64,
    casters: Vec<Caster<'a>>,
}

/// Triangles of one joint, seen from another.
struct Caster<'a> {
    occluders: &'a Occluders,
    /// Takes the frame of the nodes into the frame of the triangles. `None` where both are the same.
    frame: Option<DAffine3>,
    /// Box around the triangles in the frame of the nodes [m].
    bounds: [DVec3; 2],
}

impl<'a> JointView<'a> {
    fn new(surface: &'a LitSurface, sun: DVec3, poses: &[DAffine3], joint: u32) -> Self {
        let pose = |joint: u32| poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let from_body = pose(joint).inverse();
        let caster = |(other, occluders): &'a (u32, Occluders)| {
            let to_nodes = from_body * pose(*other);
            let frame = (*other != joint).then(|| to_nodes.inverse());
            let [low, high] = occluders.bounds;
            let corners = (0..8u32).map(|corner| {
                let axis = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                let at = DVec3::new(axis(0), axis(1), axis(2));
                if frame.is_some() { to_nodes.transform_point3(at) } else { at }
            });
            let bounds = corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[l, h], at| [l.min(at), h.max(at)]);
            Caster { occluders, frame, bounds }
        };
        Self {
            disc: Disc::new((from_body.matrix3 * sun).normalize()),
            start: surface.start(),
            casters: surface.casters.iter().map(caster).collect(),
        }
    }

    /// Whether a triangle lies in a direction from a point [m], both in the frame of the nodes.
    fn is_hidden(&self, from: DVec3, direction: DVec3) -> bool {
        let inverse = direction.recip();
        self.casters.iter().any(|Caster { occluders, frame, bounds: [low, high] }| {
            let Some(frame) = frame else { return occluders.is_hidden(from, direction) };
            let (a, b) = ((*low - from) * inverse, (*high - from) * inverse);
            let (enters, leaves) = (a.min(b).max_element(), a.max(b).min_element());
            if leaves < enters || leaves < 0.0 {
                return false;
            }
            occluders.is_hidden(frame.transform_point3(from), frame.matrix3 * direction)
        })
    }
}
