//! The lit area vector of a node, and the sunlight that it takes.

use glam::{DAffine3, DVec3};

use super::lit_surface::LitNode;
use crate::environment::StepLoad;
use crate::environment::load::solar_flux;

/// Sunlit area of a node.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct LitArea {
    /// Lit area vector over the node's area, in the frame of its joint.
    pub vector: DVec3,
    /// Share of the light that falls on the front. The rest falls on the back.
    pub front: f64,
}

impl LitArea {
    /// No light.
    pub(super) const DARK: Self = Self { vector: DVec3::ZERO, front: 1.0 };

    /// The light on a node without a triangle, which sees the Sun as its normal does.
    pub(super) fn by_normal(node: &LitNode, sun: DVec3) -> Self {
        let front = node.normal.dot(sun) >= 0.0;
        let vector = match (front, node.both_sides) {
            (true, _) => node.normal,
            (false, true) => -node.normal,
            (false, false) => DVec3::ZERO,
        };
        Self { vector, front: f64::from(u8::from(front)) }
    }

    /// The vector of the light that falls on the front, or on the back.
    pub(crate) fn on_face(&self, back: bool) -> DVec3 {
        if back { (1.0 - self.front) * self.vector } else { self.front * self.vector }
    }

    /// Sunlight on the front and on the back [W/m2], averaged over the step, on a node of a joint with this pose.
    pub(crate) fn flux(&self, load: &StepLoad, pose: Option<&DAffine3>) -> [f64; 2] {
        let vector = pose.map_or(self.vector, |pose| pose.matrix3 * self.vector);
        let flux = solar_flux(load, vector);
        [self.front * flux, (1.0 - self.front) * flux]
    }
}
