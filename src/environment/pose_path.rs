//! The way of a camera: its position and rotation at any time of a path.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};

use super::position_history::PositionHistory;
use super::rotation_history::RotationHistory;
use super::state::SLACK;
use super::trajectory::Trajectory;

/// Sine of the angle below which the line of sight counts as parallel to the direction that is up in the image.
const PARALLEL: f64 = 1e-6;

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PathPositions {
    /// Samples in the camera's frame, from the craft [m].
    Samples(PositionHistory),
    /// A trajectory of its own round the planet. The craft's position is subtracted in f64.
    Chaser {
        /// Of the camera.
        trajectory: Arc<Trajectory>,
        /// Of the craft that it looks at.
        craft: Arc<Trajectory>,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum PathRotations {
    /// Rotations of the camera's carrier into the camera's frame.
    History(Arc<RotationHistory>),
    /// Towards a point of the camera's frame [m], with a direction that is up in the image.
    LookAt(DVec3, DVec3),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PosePath {
    pub(crate) places: PathPositions,
    pub(crate) turns: PathRotations,
    /// Rotates camera axes into the axes of the camera's carrier.
    pub(crate) mount: DQuat,
}

/// Why there is no pose at a time.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoPose {
    /// A time before the beginning, after the end or in a gap.
    #[error("has no {what} at {time} s: it covers {covered}")]
    Uncovered {
        /// Positions or rotations.
        what: &'static str,
        /// Time [s].
        time: f64,
        /// The covered interval, in words.
        covered: String,
    },
    /// A line of sight that is parallel to `up`, or no line of sight.
    #[error("gives no direction at {time} s: the camera is at the point that it looks at, or looks along camera.up")]
    Direction {
        /// Time [s].
        time: f64,
    },
}

impl PosePath {
    /// Position [m] in the camera's frame and rotation of camera axes into it, at a time [s].
    ///
    /// # Errors
    /// A time that is not covered, with the ranges that are, or a view without a direction.
    pub(crate) fn pose(&self, time: f64) -> Result<(DVec3, DQuat), NoPose> {
        let position = self.position(time)?;
        let carrier = match &self.turns {
            PathRotations::History(history) => history.rotation(time).ok_or_else(|| {
                let covered = ranges(&history.coverage());
                NoPose::Uncovered { what: "rotation", time, covered }
            })?,
            PathRotations::LookAt(target, up) => {
                let forward = (*target - position).try_normalize();
                let forward = forward.filter(|forward| forward.cross(*up).length() > PARALLEL);
                look(forward.ok_or(NoPose::Direction { time })?, *up)
            }
        };
        Ok((position, carrier * self.mount))
    }

    /// The first time of the path [s]. `None` for a trajectory by elements.
    pub(crate) fn start(&self) -> Option<f64> {
        let coverage = match &self.places {
            PathPositions::Samples(history) => Some(history.coverage()),
            PathPositions::Chaser { trajectory, .. } => trajectory.coverage(),
        };
        coverage.and_then(|covered| covered.first().map(|(start, _)| *start))
    }

    fn position(&self, time: f64) -> Result<DVec3, NoPose> {
        let missing = |what: &'static str, covered: String| NoPose::Uncovered { what, time, covered };
        match &self.places {
            PathPositions::Samples(history) => {
                history.position(time).ok_or_else(|| missing("position", ranges(&history.coverage())))
            }
            PathPositions::Chaser { trajectory, craft } => {
                let state = |trajectory: &Trajectory, what| {
                    let covered = || ranges(&trajectory.coverage().unwrap_or_default());
                    trajectory.state(time).map(|state| state.position).ok_or_else(|| missing(what, covered()))
                };
                Ok(state(trajectory, "position")? - state(craft, "position of the craft")?)
            }
        }
    }
}

fn ranges(coverage: &[(f64, f64)]) -> String {
    let mut joined: Vec<(f64, f64)> = Vec::new();
    for (start, end) in coverage {
        match joined.last_mut() {
            Some(last) if *start <= last.1 + SLACK => last.1 = last.1.max(*end),
            _ => joined.push((*start, *end)),
        }
    }
    let more = if joined.len() > 4 { format!(", and {} more", joined.len() - 4) } else { String::new() };
    let said: Vec<String> = joined.iter().take(4).map(|(start, end)| format!("{start} to {end} s")).collect();
    if said.is_empty() { "nothing".to_owned() } else { format!("{}{more}", said.join(", ")) }
}

/// Rotation from OpenCV camera axes (+X right, +Y down, +Z forward). `up` must not be parallel to `forward`.
pub(crate) fn look(forward: DVec3, up: DVec3) -> DQuat {
    let right = forward.cross(up).normalize();
    DQuat::from_mat3(&DMat3::from_cols(right, forward.cross(right), forward)).normalize()
}

#[cfg(test)]
mod tests {
    use approx::assert_abs_diff_eq;

    use super::*;
    use crate::environment::rotation_history::{HistoryFrame, RotationInterpolation, RotationSample, RotationSegment};

    #[test]
    fn axes_of_a_look_at_are_right_down_and_forward() {
        let rotation = look(DVec3::X, DVec3::new(0.3, 0.0, 1.0));
        // A camera that looks along +X with +Z up has +Y at its left.
        for (camera, frame) in [(DVec3::X, DVec3::NEG_Y), (DVec3::Y, DVec3::NEG_Z), (DVec3::Z, DVec3::X)] {
            assert_abs_diff_eq!((rotation * camera - frame).length(), 0.0, epsilon = 1e-15);
        }
        let upside_down = look(DVec3::X, DVec3::NEG_Z);
        assert!((upside_down * DVec3::X - DVec3::NEG_Y).length() > 1.0);
    }

    fn path(turns: PathRotations, mount: DQuat) -> PosePath {
        let samples = [(0.0, DVec3::X * 10.0), (1.0, DVec3::X * 8.0), (2.0, DVec3::X * 6.0)];
        PosePath { places: PathPositions::Samples(PositionHistory::new(&samples)), turns, mount }
    }

    #[test]
    fn a_moving_camera_looks_at_its_point() {
        let path = path(PathRotations::LookAt(DVec3::ZERO, DVec3::Z), DQuat::IDENTITY);
        let (position, rotation) = path.pose(1.5).expect("covered");
        assert_abs_diff_eq!((position - DVec3::X * 7.0).length(), 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!((rotation * DVec3::Z - DVec3::NEG_X).length(), 0.0, epsilon = 1e-12);
        let message = path.pose(2.5).unwrap_err().to_string();
        assert_eq!(message, "has no position at 2.5 s: it covers 0 to 2 s");
        let along = PosePath { turns: PathRotations::LookAt(DVec3::ZERO, DVec3::X), ..path };
        assert_eq!(along.pose(1.0), Err(NoPose::Direction { time: 1.0 }));
    }

    #[test]
    fn the_mount_comes_before_the_carrier() {
        let turn = |time: f64| RotationSample {
            time,
            frame_from_body: DQuat::from_rotation_z(0.4 * time),
            derivative: None,
            spin: None,
        };
        let segment = RotationSegment {
            samples: vec![turn(0.0), turn(2.0)],
            interpolation: RotationInterpolation::Arc,
            usable: (f64::NEG_INFINITY, f64::INFINITY),
        };
        let history = Arc::new(RotationHistory::new(String::new(), HistoryFrame::Inertial, vec![segment]));
        let mount = DQuat::from_rotation_x(0.7);
        let (_, rotation) = path(PathRotations::History(history), mount).pose(0.5).expect("covered");
        let expected = DQuat::from_rotation_z(0.2) * mount;
        assert!(
            rotation.angle_between(expected) < 1e-7
                && rotation.angle_between(mount * DQuat::from_rotation_z(0.2)) > 0.05
        );
    }
}
