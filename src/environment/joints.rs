//! Joints: rigid motions of parts against the body, and their positions over time.
//!
//! A joint moves its glTF node and everything below it. The *pose* of a joint, `body_from_joint`, is the rigid motion that takes geometry
//! from its place in the file to its present place. This pose is the pose of the parent joint times the joint's own rotation or
//! translation. Poses are listed with the body (which does not move) at 0 and joint `i` at `i + 1`.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use keys::Keys;

pub(crate) mod keys;
mod track;
mod walk;

pub(crate) use walk::Joints;

/// Sine of the angle between axis and Sun below which the Sun does not define a position.
const ALONG: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum JointKind {
    Rotation,
    Translation,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Drive {
    /// A constant position [rad or m].
    Fixed(f64),
    /// Linear between times [s] and positions [rad or m], constant beyond the ends. A repeated time is a jump.
    Schedule {
        /// Times [s], not falling.
        times: Vec<f64>,
        /// Positions [rad or m].
        positions: Vec<f64>,
    },
    /// The joint turns a direction as near to the Sun as it can.
    Sun {
        /// Unit direction in the file's pose, body frame, not along the joint's axis.
        facing: DVec3,
        /// Angle added to the Sun's [rad].
        offset: f64,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Guided {
    pub(crate) kind: JointKind,
    /// Unit axis in the file's pose, body frame.
    pub(crate) axis: DVec3,
    /// A point on the axis in the file's pose, body frame [m].
    pub(crate) origin: DVec3,
    pub(crate) drive: Drive,
    /// Least and greatest position [rad or m].
    pub(crate) limits: Option<[f64; 2]>,
    /// Greatest rate [rad/s or m/s]. Without a rate the joint is always at its target position.
    pub(crate) rate: Option<f64>,
}

/// A node that plays a glTF animation.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Played {
    /// Rotation (x, y, z, w), where it is animated.
    pub(crate) rotation: Option<Keys<4>>,
    /// Translation [m], where it is animated.
    pub(crate) translation: Option<Keys<3>>,
    /// Length of the animation [s].
    pub(crate) duration: f64,
    /// Whether it starts again after its end.
    pub(crate) repeats: bool,
    /// The node's own translation [m] and rotation in the file's pose.
    pub(crate) rest: (DVec3, DQuat),
    /// From the parent's frame to the body's in the file's pose: a similarity.
    pub(crate) body_from_parent: DAffine3,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum JointDrive {
    Guided(Guided),
    Played(Box<Played>),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Joint {
    /// Name of its glTF node.
    pub(crate) name: String,
    /// The parent joint, which stands before it in the list. `None` for the body.
    pub(crate) parent: Option<usize>,
    pub(crate) motion: JointDrive,
}

/// Why a joint can not be held at a position.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum JointError {
    /// No joint has this name.
    #[error("there is no joint '{name}'; there are: {known}")]
    Unknown {
        /// The name.
        name: String,
        /// The joints of the scene.
        known: String,
    },
    /// A joint of a craft without joints.
    #[error("there is no joint '{0}': the scene has no [[joint]]")]
    None(String),
    /// A joint that plays an animation.
    #[error("the joint '{name}' plays an animation, which prescribes its position")]
    Played {
        /// The joint.
        name: String,
    },
    /// The position is not finite or lies outside the limits.
    #[error("the joint '{name}' can not be at {position}: its positions go from {low} to {high} {unit}")]
    Limits {
        /// The joint.
        name: String,
        /// The position [rad or m].
        position: f64,
        /// Least position [rad or m].
        low: f64,
        /// Greatest position [rad or m].
        high: f64,
        /// `rad` or `m`.
        unit: &'static str,
    },
}

impl Drive {
    /// The target position at a time [s]. `sun` is the direction to the Sun in the frame of the parent, moved back to the file's pose.
    fn target(&self, axis: DVec3, time: f64, sun: DVec3) -> f64 {
        match self {
            Self::Fixed(position) => *position,
            Self::Schedule { times, positions } => {
                let after = times.partition_point(|at| *at <= time);
                match after {
                    0 => positions[0],
                    _ if after == times.len() => positions[after - 1],
                    _ => {
                        let share = (time - times[after - 1]) / (times[after] - times[after - 1]);
                        positions[after - 1] + share * (positions[after] - positions[after - 1])
                    }
                }
            }
            Self::Sun { facing, offset } => {
                let across = axis.cross(sun);
                if across.length() < ALONG {
                    return *offset;
                }
                // Both directions projected along the axis.
                axis.cross(*facing).dot(sun).atan2(facing.reject_from_normalized(axis).dot(sun)) + offset
            }
        }
    }
}

impl Guided {
    /// The position nearest to `target` within the limits. A joint that tracks the Sun points the same way after a whole turn, so the
    /// angle nearest to `near` is taken.
    fn within_limits(&self, target: f64, near: Option<f64>) -> f64 {
        let turns = matches!(self.drive, Drive::Sun { .. });
        match self.limits {
            None if turns => near.map_or(target, |near| target + ((near - target) / TAU).round() * TAU),
            None => target,
            Some([low, high]) if turns => {
                let near = near.unwrap_or(0.5 * (low + high));
                let first = target + ((low - target) / TAU).ceil() * TAU;
                if first <= high {
                    // Of two turns that are equally near, the lower one.
                    let most = ((high - first) / TAU).floor();
                    return first + ((near - first) / TAU - 0.5).ceil().clamp(0.0, most) * TAU;
                }
                let apart = |end: f64| ((end - target + PI).rem_euclid(TAU) - PI).abs();
                if apart(low) <= apart(high) { low } else { high }
            }
            Some([low, high]) => target.clamp(low, high),
        }
    }

    /// The position at a share of its range. A joint that follows the Sun without limits ends a third of a turn to both sides.
    fn within_range(&self, share: f64) -> f64 {
        let [low, high] = match (&self.drive, self.limits) {
            (Drive::Fixed(position), _) => [*position; 2],
            (Drive::Schedule { positions, .. }, _) => positions
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(*at), high.max(*at)]),
            (Drive::Sun { .. }, Some(limits)) => limits,
            (Drive::Sun { offset, .. }, None) => [offset - TAU / 3.0, offset + TAU / 3.0],
        };
        self.within_limits(low + share * (high - low), None)
    }

    /// The rigid motion at a position, in the file's pose.
    fn motion(&self, position: f64) -> DAffine3 {
        match self.kind {
            JointKind::Rotation => {
                let turn = DMat3::from_axis_angle(self.axis, position);
                DAffine3::from_mat3_translation(turn, self.origin - turn * self.origin)
            }
            JointKind::Translation => DAffine3::from_translation(self.axis * position),
        }
    }
}

impl Played {
    /// The rigid motion at a time [s], in the file's pose.
    fn motion(&self, time: f64) -> DAffine3 {
        let time = if self.repeats && self.duration > 0.0 { time.rem_euclid(self.duration) } else { time };
        let (translation, rotation) = self.rest;
        let turned = self.rotation.as_ref().map_or(rotation, |keys| keys.rotation(time));
        let placed = self.translation.as_ref().map_or(translation, |keys| keys.vector(time));
        let turn = turned * rotation.inverse();
        let in_parent = DAffine3::from_rotation_translation(turn, placed - turn * translation);
        let moved = self.body_from_parent * in_parent * self.body_from_parent.inverse();
        // The conjugate of a rotation by a similarity is a rotation.
        DAffine3::from_mat3_translation(
            DMat3::from_quat(DQuat::from_mat3(&moved.matrix3).normalize()),
            moved.translation,
        )
    }

    /// The position that is reported: the angle from the file's pose [rad], or the distance from it [m] where the joint does not rotate.
    fn position(&self, time: f64) -> f64 {
        let motion = self.motion(time);
        match self.rotation {
            Some(_) => DQuat::from_mat3(&motion.matrix3).to_axis_angle().1,
            None => motion.translation.length(),
        }
    }
}

impl Joint {
    /// Greatest rate [rad/s or m/s], where one is stated.
    fn rate(&self) -> Option<f64> {
        match &self.motion {
            JointDrive::Guided(guided) => guided.rate,
            JointDrive::Played(_) => None,
        }
    }

    /// Whether its position is an angle.
    pub(crate) fn turns(&self) -> bool {
        match &self.motion {
            JointDrive::Guided(guided) => guided.kind == JointKind::Rotation,
            JointDrive::Played(played) => played.rotation.is_some(),
        }
    }
}

#[cfg(test)]
mod tests;
