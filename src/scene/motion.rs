//! How the pose of a camera changes with time.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, DVec3};

use crate::environment::pose_path::PosePath;

/// How the pose of a camera changes with time.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// The pose does not change.
    Still,
    /// The scene states no pose: the camera stands where it sees the whole craft, once the model is known. Then it is still.
    Framed,
    /// The pose follows a path.
    Path(Arc<CameraPath>),
    /// Each image has its own pose: position [m] and rotation of camera axes into the camera's frame.
    Listed(Arc<[(DVec3, DQuat)]>),
}

/// A path from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraPath {
    pub(crate) file: PathBuf,
    pub(crate) poses: PosePath,
}

impl CameraPath {
    /// Position [m] and rotation at the first time that has a pose; the frame's origin where none has.
    pub(super) fn first(&self) -> (DVec3, DQuat) {
        let pose = self.poses.start().and_then(|time| self.poses.pose(time).ok());
        pose.unwrap_or((DVec3::ZERO, DQuat::IDENTITY))
    }
}
