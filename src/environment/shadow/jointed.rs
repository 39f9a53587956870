//! Triangles that may hang on joints.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::Occluders;

/// Triangles that may hang on joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Jointed {
    /// Positions in the file's pose [m].
    pub(crate) positions: Vec<DVec3>,
    pub(crate) triangles: Vec<[u32; 3]>,
    /// Joint of each position. Empty where nothing moves.
    pub(crate) joints: Vec<u32>,
}

impl Jointed {
    /// The positions as placed by the joints [m].
    pub(crate) fn placed(&self, poses: &[DAffine3]) -> Vec<DVec3> {
        let pose = |joint: u32| poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        let joints = self.joints.par_iter();
        self.positions.par_iter().zip(joints).map(|(at, joint)| pose(*joint).transform_point3(*at)).collect()
    }

    /// The triangles as placed by the joints.
    pub(crate) fn occluders(&self, poses: &[DAffine3]) -> Occluders {
        if self.joints.is_empty() {
            Occluders::new(&self.positions, &self.triangles)
        } else {
            Occluders::new(&self.placed(poses), &self.triangles)
        }
    }
}
