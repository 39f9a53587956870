//! Sunlight on areas: the lit area vector of every node.
//!
//! A *corner* is the part of a triangle that belongs to one of its nodes (`Division`). It has an area A_c and the unit normal n_c of the triangle. A node with corners c and
//! the area A absorbs the sunlight alpha S max(0, G . s) from the direction s, where
//!
//! ```text
//! G = (1 / A) sum_c A_c v_c n_c    over the corners that face the Sun,
//! ```
//!
//! v_c is the lit share of the corner, and n_c points to the side of the Sun. G is the *lit area vector*. It replaces the node's normal and a visibility at the
//! vertex. The sum of A G over all nodes is the lit area vector of the craft. Between two findings the cosine still follows the Sun.
//!
//! v_c is 1 where no triangle lies between the node and the Sun, and 0 where one lies over all of it (`sunward.rs`). Elsewhere v_c is the mean over lines across
//! the corner. The share of a line that sees a point of the Sun's disc is exact, and each line has a point of its own, so that a penumbra costs nothing more.

use std::sync::Arc;

use glam::{DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use super::kept_light::{KeptLight, KeptSet, on_grid};
use super::lit_corners::{CornerLight, FacingCorners, JointView};
use super::lit_surface::{Cells, Group, LitNode, LitSurface};
use super::outline::{Face, Region};
use super::redraw::sun_of;
use super::sunlit::LitArea;
use super::sunward::{Above, Hiding, Sunward, axes};
use super::{JointTrees, Redraw};
use crate::environment::StepLoad;
use crate::trace::span;

/// Nodes that are lit one by one where something hides a part of them.
const FEW: usize = 8;

/// Lit areas of nodes.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Lit {
    /// One for each node. Empty where normals tell the light.
    pub areas: Vec<LitArea>,
    /// Whether parts of the craft may hide the Sun from others.
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

/// The light of some nodes under one Sun.
#[derive(Debug)]
pub(crate) struct NodesInSun {
    /// Unit vector to the Sun, body frame.
    pub(crate) sun: DVec3,
    /// Poses of the joints.
    pub(crate) poses: Vec<DAffine3>,
    /// Lit area of each node, and the same if nothing hid the Sun.
    pub(crate) areas: Vec<[LitArea; 2]>,
}

/// Finds the lit areas of a set of nodes.
#[derive(Debug, Clone)]
pub struct LitAreas {
    pub(super) surface: Arc<LitSurface>,
    cells: Cells,
    /// Numbers of the nodes in `nodes`, in an order in which neighbours follow each other.
    order: Vec<u32>,
    groups: Vec<Group>,
    /// Whether the group of each node lies in a plane.
    in_plane: Vec<bool>,
    /// Boxes around the nodes [m], in their order.
    boxes: Vec<[Vec3; 2]>,
    /// For which light and poses they were found last. A saved state keeps them.
    pub(crate) redraw: Redraw,
    /// Light that was found before. `None` where none is kept.
    kept: Option<KeptSet>,
}

impl LitAreas {
    /// The lit areas of some nodes of a surface.
    pub(crate) fn new(surface: Arc<LitSurface>, nodes: Vec<LitNode>, redraw: Redraw) -> Self {
        let cells = Cells::new(&surface, nodes);
        let (order, groups) = cells.groups(&surface);
        let boxes = cells.boxes(&surface);
        let mut in_plane = vec![false; cells.nodes.len()];
        for group in groups.iter().filter(|group| group.is_flat) {
            order[group.nodes.clone()].iter().for_each(|node| in_plane[*node as usize] = true);
        }
        Self { surface, cells, order, groups, in_plane, boxes, redraw, kept: None }
    }

    /// The same with the light that was found for the same nodes of the surface.
    pub(crate) fn keeping(self, kept: &Arc<KeptLight>) -> Self {
        Self { kept: Some(KeptSet::new(kept, &self.cells.nodes)), ..self }
    }

    /// The same with `times` as many lines across an area.
    pub fn with_lines(&self, times: u32) -> Self {
        let surface = LitSurface { times: times * self.surface.times, ..(*self.surface).clone() };
        Self { surface: Arc::new(surface), kept: None, ..self.clone() }
    }

    /// Numbers of the nodes, in their order.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = usize> {
        self.cells.nodes.iter().map(|node| node.number as usize)
    }

    /// Whether parts of the craft may hide the Sun from others.
    pub(crate) fn by_rays(&self) -> bool {
        !self.surface.casters.is_empty()
    }

    /// Whether the normal of every node is the normal of its triangles, so that light needs no lit areas unless something hides the Sun.
    pub(crate) fn are_flat(&self) -> bool {
        (0..self.cells.nodes.len()).into_par_iter().all(|index| self.cells.is_flat(&self.surface, index))
    }

    /// Lit area of each node. `None` where the last result still holds for the load, or where it is dark.
    pub fn find(&mut self, load: &StepLoad) -> Option<Vec<LitArea>> {
        let sun = self.redraw.due(load)?;
        let Some(kept) = &self.kept else {
            let _finds = span("finding the light");
            return Some(self.under(sun, &load.joints));
        };
        Some(self.kept_under(kept, &on_grid(sun, &load.joints)))
    }

    /// The light of a load on the nodes at some places, whatever light was found last. `None` where the load is dark.
    pub(crate) fn beside(&self, load: &StepLoad, places: &[usize]) -> Option<NodesInSun> {
        let place = on_grid(sun_of(load)?, &load.joints);
        let lit = match &self.kept {
            Some(kept) => self.kept_under(kept, &place),
            None => self.under(place.0, &place.1),
        };
        let views = self.joint_views(place.0, &place.1);
        let _opens = span("light that nothing hides");
        let both = |corners: &mut FacingCorners, index: &usize| [lit[*index], self.open_node(&views, *index, corners)];
        let areas = places.par_iter().map_init(FacingCorners::default, both).collect();
        Some(NodesInSun { sun: place.0, poses: place.1, areas })
    }

    /// Kept light of a place of the grid, found where it is not kept.
    fn kept_under(&self, kept: &KeptSet, place: &(DVec3, Vec<DAffine3>)) -> Vec<LitArea> {
        let views = self.joint_views(place.0, &place.1);
        let open = |corners: &mut FacingCorners, index: usize| self.open_node(&views, index, corners);
        let find = || {
            let _finds = span("finding the light");
            self.under(place.0, &place.1)
        };
        kept.get_or_find(&self.cells.nodes, place, open, find)
    }

    /// Lit area of a node that nothing hides, under the Sun as each joint sees it.
    fn open_node(&self, views: &[JointView], index: usize, corners: &mut FacingCorners) -> LitArea {
        self.light_open_node(index, self.in_plane[index], &views[self.cells.nodes[index].joint as usize], corners)
    }

    /// The triangles that cast shadows.
    pub(crate) fn trees(&self) -> JointTrees {
        JointTrees::new(&self.surface.casters)
    }

    /// Lit area of each node under a Sun (unit vector, body frame), with joints in these poses.
    pub fn under(&self, sun: DVec3, poses: &[DAffine3]) -> Vec<LitArea> {
        let (views, sunward) = self.views(sun, poses);
        let areas = self.groups.par_iter().map_init(Work::default, |work, group| {
            let numbers = &self.order[group.nodes.clone()];
            let view = &views[self.cells.nodes[numbers[0] as usize].joint as usize];
            let mut areas = Vec::with_capacity(numbers.len());
            self.light_group(numbers, group.is_flat, &Sky { view, sunward: &sunward }, work, &mut areas);
            areas
        });
        let mut lit = vec![LitArea::default(); self.cells.nodes.len()];
        self.order
            .iter()
            .zip(areas.collect::<Vec<_>>().iter().flatten())
            .for_each(|(index, area)| lit[*index as usize] = *area);
        lit
    }

    /// As [`Self::under`], and the light of each corner: three for each triangle of the surface. Corners that turn away, or belong to none of the nodes, are dark.
    pub(crate) fn corners_under(&self, sun: DVec3, poses: &[DAffine3]) -> (Vec<LitArea>, Vec<CornerLight>) {
        let (views, sunward) = self.views(sun, poses);
        let light = |corners: &mut FacingCorners, (index, node): (usize, &LitNode)| {
            corners.find(&self.surface, node, self.cells.corners_of(index), false, &views[node.joint as usize]);
            if self.by_rays() && !corners.corners.is_empty() {
                corners.cast(&self.surface, node, &sunward, None);
            }
            corners.lights()
        };
        let nodes = self.cells.nodes.par_iter().enumerate();
        let of_nodes: Vec<Vec<(u32, CornerLight)>> = nodes.map_init(FacingCorners::default, light).collect();
        let mut lights = vec![CornerLight::default(); 3 * self.surface.triangles.len()];
        of_nodes.into_iter().flatten().for_each(|(number, light)| lights[number as usize] = light);
        (self.under(sun, poses), lights)
    }

    /// The Sun as each joint sees it.
    fn joint_views(&self, sun: DVec3, poses: &[DAffine3]) -> Vec<JointView> {
        let pose = |joint: u32| poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let joints = self.cells.nodes.iter().map(|node| node.joint + 1).max().unwrap_or(1);
        let view = |joint: u32| JointView {
            sun: (pose(joint).matrix3.transpose() * sun).normalize(),
            placed: axes(sun) * pose(joint),
        };
        (0..joints).map(view).collect()
    }

    /// The Sun as each joint sees it, and the triangles above every place.
    fn views(&self, sun: DVec3, poses: &[DAffine3]) -> (Vec<JointView>, Sunward) {
        let pose = |joint: u32| poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let placed = |joint: u32| axes(sun) * pose(joint);
        (self.joint_views(sun, poses), Sunward::new(&self.surface.casters, placed))
    }

    /// Adds the lit areas of the nodes of a group. In the best case one look at the triangles above tells all.
    fn light_group(&self, numbers: &[u32], is_flat: bool, sky: &Sky<'_>, work: &mut Work, areas: &mut Vec<LitArea>) {
        let first = &self.cells.nodes[numbers[0] as usize];
        let cosine = first.normal.dot(sky.view.sun);
        if is_flat && (cosine == 0.0 || (cosine < 0.0 && !first.both_sides)) {
            return areas.extend(numbers.iter().map(|_| LitArea::DARK));
        }
        let face = is_flat.then(|| Face {
            at: sky.view.placed.transform_point3(self.surface.positions[first.number as usize]),
            side: sky.view.placed.matrix3 * first.normal * cosine.signum(),
            back: cosine < 0.0,
        });
        self.light_below(numbers, face, sky, None, work, areas);
    }

    /// Adds the lit areas of neighbours in a plane, or of any, below some of the triangles. Fewer at a time follow where these hide only a part.
    fn light_below(
        &self,
        numbers: &[u32],
        face: Option<Face>,
        sky: &Sky<'_>,
        among: Option<&[Hiding]>,
        work: &mut Work,
        areas: &mut Vec<LitArea>,
    ) {
        let mut list = work.lists.pop().unwrap_or_default();
        match self.above(numbers, face.as_slice(), sky, among, &mut list) {
            Above::Nothing if let Some(face) = face => areas.extend(numbers.iter().map(|index| {
                let normal = self.cells.nodes[*index as usize].normal;
                if face.back { LitArea { vector: -normal, front: 0.0 } } else { LitArea { vector: normal, front: 1.0 } }
            })),
            Above::Cover => areas.extend(numbers.iter().map(|_| LitArea::DARK)),
            Above::Some if numbers.len() > FEW => {
                for part in numbers.chunks(FEW) {
                    self.light_below(part, face, sky, Some(&list), work, areas);
                }
            }
            Above::Nothing | Above::Some => {
                let light =
                    |index: &u32| self.light_node(*index as usize, face.is_some(), sky, &list, &mut work.corners);
                areas.extend(numbers.iter().map(light));
            }
        }
        work.lists.push(list);
    }

    /// Lit area of a node below some triangles.
    fn light_node(
        &self,
        index: usize,
        in_plane: bool,
        sky: &Sky<'_>,
        among: &[Hiding],
        corners: &mut FacingCorners,
    ) -> LitArea {
        let node = &self.cells.nodes[index];
        let open = self.light_open_node(index, in_plane, sky.view, corners);
        if corners.area == 0.0 || among.is_empty() || corners.corners.is_empty() {
            return open;
        }
        corners.cast(&self.surface, node, sky.sunward, Some((among, in_plane)));
        let (vector, front) = corners.sum();
        LitArea { vector, front }
    }

    /// Lit area of a node that nothing hides.
    fn light_open_node(&self, index: usize, in_plane: bool, view: &JointView, corners: &mut FacingCorners) -> LitArea {
        let node = &self.cells.nodes[index];
        corners.find(&self.surface, node, self.cells.corners_of(index), in_plane, view);
        if corners.area == 0.0 {
            return LitArea::by_normal(node, view.sun);
        }
        let (vector, front) = corners.sum();
        LitArea { vector, front }
    }

    /// Finds the triangles that may hide the Sun from nodes with these faces, or with any.
    fn above(
        &self,
        numbers: &[u32],
        faces: &[Face],
        sky: &Sky<'_>,
        among: Option<&[Hiding]>,
        list: &mut Vec<Hiding>,
    ) -> Above {
        if !self.by_rays() {
            return Above::Nothing;
        }
        let boxes = numbers.iter().map(|index| self.boxes[*index as usize]);
        let all = boxes.reduce(|[low, high], [l, h]| [low.min(l), high.max(h)]).unwrap_or_default();
        let points: [DVec3; 8] = std::array::from_fn(|k| {
            let axis = |axis: usize| f64::from(all[k >> axis & 1][axis]);
            sky.view.placed.transform_point3(DVec3::new(axis(0), axis(1), axis(2)))
        });
        let (region, start) = (Region::new(&points), self.surface.start());
        match among {
            // All of them have been found above the same face.
            Some(among) => sky.sunward.above_among(among, &region, &[], start, list),
            None => sky.sunward.above(&region, faces, start, list),
        }
    }
}

/// The Sun as nodes of a joint see it, and the triangles before it.
struct Sky<'a> {
    view: &'a JointView,
    sunward: &'a Sunward,
}

/// Memory of the work on a group.
#[derive(Default)]
struct Work {
    corners: FacingCorners,
    /// Lists of triangles that no group uses now.
    lists: Vec<Vec<Hiding>>,
}
