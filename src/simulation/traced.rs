//! Reflections of the craft itself: its triangles in a tree that follows the joints.

use glam::{DAffine3, DVec3};

use super::prepare::Prepared;
use crate::environment::shadow::{Jointed, Occluders, Tree};
use crate::gpu::layout::{self, ShadowBox, ShadowTriangle};
use crate::gpu::renderer;
use crate::model::nodes::GROUP;
use crate::raster::traced;

/// The triangles of a craft whose surfaces reflect each other.
pub(crate) struct TracedCraft {
    surface: Jointed,
    occluders: Occluders,
    /// Their tree on the device.
    tree: Tree,
    /// Poses of the joints that the tree was made for.
    poses: Vec<DAffine3>,
    /// Nodes of the corners of each triangle, and its material.
    corners: Vec<[u32; 4]>,
    /// The same in the order of the tree.
    pub(crate) corners_in_tree: Vec<[u32; 4]>,
    boxes: Vec<ShadowBox>,
    triangles: Vec<ShadowTriangle>,
    version: u64,
}

/// The triangles that reflections may meet. Triangles without area only fill up runs.
pub(crate) fn reflected(prepared: &Prepared) -> impl Iterator<Item = [u32; 3]> {
    prepared.triangles.iter().copied().filter(|[a, b, c]| a != b && b != c && c != a)
}

impl TracedCraft {
    /// The craft at the start of a scene.
    pub(crate) fn new(prepared: &Prepared) -> Self {
        let nodes = &prepared.nodes;
        let joints = match prepared.joints() {
            0 | 1 => Vec::new(),
            _ => prepared.joints_of(0..nodes.positions.len()),
        };
        let positions: Vec<DVec3> = nodes.positions.iter().map(|position| position.as_dvec3()).collect();
        let surface = Jointed { positions, triangles: reflected(prepared).collect(), joints };
        let poses = prepared.loads.joints_at(0.0).1;
        let occluders = surface.occluders(&poses);
        let with_material = |[a, b, c]: &[u32; 3]| [*a, *b, *c, nodes.group_material[*a as usize / GROUP]];
        let corners: Vec<_> = surface.triangles.iter().map(with_material).collect();
        let tree = occluders.tree();
        let corners_in_tree = tree.order.iter().map(|number| corners[*number as usize]).collect();
        let (boxes, triangles) = layout::shadow_tree(&tree, &occluders);
        Self { surface, occluders, tree, poses, corners, corners_in_tree, boxes, triangles, version: 0 }
    }

    pub(crate) fn boxes(&self) -> usize {
        self.boxes.len()
    }

    /// Fits the tree to the poses of the joints.
    pub(crate) fn follow(&mut self, joints: &[DAffine3]) {
        if self.surface.joints.is_empty() || self.poses == joints {
            return;
        }
        self.poses = joints.to_vec();
        self.occluders = self.surface.occluders(joints);
        self.tree.refit(&self.occluders.boxes_of_triangles());
        (self.boxes, self.triangles) = layout::shadow_tree(&self.tree, &self.occluders);
        self.version += 1;
    }

    /// The values of an image at a time [s], for the device.
    pub(crate) fn told(&self, time: f64) -> renderer::TracedTree<'_> {
        let settings = layout::Tracing {
            boxes: self.boxes.len() as u32,
            word: word(time),
            start: self.occluders.start as f32,
            width: 0,
            texels: 0,
            surface_width: 0,
        };
        renderer::TracedTree { settings, boxes: &self.boxes, triangles: &self.triangles, version: self.version }
    }

    /// The same for the rasteriser in f64.
    pub(crate) fn seen(&self, time: f64) -> traced::TracedTriangles<'_> {
        traced::TracedTriangles { occluders: &self.occluders, corners: &self.corners, word: word(time) }
    }
}

/// Word of a time [s]: its microseconds.
fn word(time: f64) -> u32 {
    (time * 1e6).round() as i64 as u32
}
