//! Shadows of a scene in f64: the nodes, the occluders and the last result.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::{DepthMap, Occluders, Redraw};
use crate::environment::StepLoad;

/// Method that finds the visibility of the Sun.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShadowMethod {
    /// A shadow map from the Sun.
    Depth,
    /// Rays to the Sun's disc.
    Exact,
}

/// Triangles that may hang on joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Jointed {
    /// Positions in the file's pose [m].
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Joint of each position. Empty where nothing moves.
    pub(crate) joints: Vec<u32>,
}

impl Jointed {
    /// The positions as placed by the joints [m].
    pub(crate) fn placed(&self, poses: &[DAffine3]) -> Vec<DVec3> {
        let joints = self.joints.par_iter();
        self.positions.par_iter().zip(joints).map(|(at, joint)| pose(poses, *joint).transform_point3(*at)).collect()
    }

    /// The tree of the triangles as placed by the joints.
    pub fn occluders(&self, poses: &[DAffine3]) -> Occluders {
        if self.joints.is_empty() {
            Occluders::new(&self.positions, &self.triangles)
        } else {
            Occluders::new(&self.placed(poses), &self.triangles)
        }
    }
}

fn pose(poses: &[DAffine3], joint: u32) -> DAffine3 {
    poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY)
}

/// The shadow casters for a set of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowCasters {
    /// Positions [m] and unit normals of the nodes.
    nodes: Vec<[DVec3; 2]>,
    /// Joint of each node. Empty where nothing moves.
    node_joints: Vec<u32>,
    method: ShadowMethod,
    casters: Jointed,
    /// The tree, for rays and for few nodes, where nothing moves.
    tree: Option<Occluders>,
    /// For which light and poses shadows were found last. A saved state keeps them.
    pub(crate) redraw: Redraw,
}

/// Greatest number of nodes that are traced instead of drawing a map. Each reads 16 texels.
const FEW: usize = 4096;

impl ShadowCasters {
    /// Shadows on nodes (positions [m] and unit normals in the file's pose). `node_joints` holds the joint of each node, or nothing where no part
    /// moves.
    pub(crate) fn new(
        nodes: Vec<[DVec3; 2]>,
        node_joints: Vec<u32>,
        casters: Jointed,
        redraw: Redraw,
        method: ShadowMethod,
    ) -> Self {
        let mut shadows = Self { nodes, node_joints, method, casters, tree: None, redraw };
        if shadows.needs_tree() && shadows.casters.joints.is_empty() {
            shadows.tree = Some(shadows.casters.occluders(&[]));
        }
        shadows
    }

    fn needs_tree(&self) -> bool {
        self.method == ShadowMethod::Exact || self.nodes.len() <= FEW
    }

    /// Share of the Sun that each node sees. `None` where the last result still holds for the load.
    pub fn visibility(&mut self, load: &StepLoad) -> Option<Vec<f64>> {
        let view = self.redraw.view(load)?;
        let moved;
        let nodes = if self.node_joints.is_empty() {
            &self.nodes
        } else {
            let placed = |([place, normal], joint): (&[DVec3; 2], &u32)| {
                let pose = pose(&load.joints, *joint);
                [pose.transform_point3(*place), pose.matrix3 * *normal]
            };
            moved = self.nodes.par_iter().zip(&self.node_joints).map(placed).collect::<Vec<_>>();
            &moved
        };
        let of_now;
        let tree = match &self.tree {
            None if self.needs_tree() => {
                of_now = self.casters.occluders(&load.joints);
                Some(&of_now)
            }
            tree => tree.as_ref(),
        };
        let nodes = nodes.par_iter();
        let map = match tree {
            Some(occluders) if self.method == ShadowMethod::Exact => {
                let visibility = |[place, normal]: &[DVec3; 2]| occluders.solar_visibility(*place, *normal, view.sun);
                return Some(nodes.map(visibility).collect());
            }
            Some(occluders) => DepthMap::traced(view, occluders),
            None if self.casters.joints.is_empty() => {
                DepthMap::new(view, &self.casters.positions, &self.casters.triangles)
            }
            None => DepthMap::new(view, &self.casters.placed(&load.joints), &self.casters.triangles),
        };
        Some(nodes.map(|[place, normal]| map.solar_visibility(*place, *normal)).collect())
    }
}
