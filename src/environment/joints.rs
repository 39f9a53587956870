//! Joints: rigid motions of parts against the body, and where each stands at a time.
//!
//! A joint moves everything from its glTF node on downwards. Its pose is a rigid motion `body_from_joint` that takes
//! what hangs on it from the file's pose to where it is: that of the joint above it, times its own turn or shift in the
//! file's pose. Poses are listed with the body itself, which does not move, at 0, and joint `i` at `i + 1`.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DQuat, DVec3};

use keys::Keys;

pub mod keys;
mod walk;

pub use walk::Joints;

/// Sine of the angle from the axis below which the Sun does not say how to turn.
const ALONG: f64 = 1e-9;

/// What a joint lets its part do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Turn about an axis.
    Rotation,
    /// Shift along it.
    Translation,
}

/// What says where a joint stands.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive {
    /// It stays [rad or m].
    Fixed(f64),
    /// Straight between times [s] and positions [rad or m], and still beyond them; a repeated time is a jump.
    Schedule {
        /// Times [s], not falling.
        times: Vec<f64>,
        /// Positions [rad or m].
        positions: Vec<f64>,
    },
    /// It turns a direction as near to the Sun as it can.
    Sun {
        /// Unit direction in the file's pose, body frame; not along the joint's axis.
        facing: DVec3,
        /// Turned further by this [rad].
        offset: f64,
    },
}

/// A joint with one degree of freedom.
#[derive(Debug, Clone, PartialEq)]
pub struct Guided {
    /// What it lets its part do.
    pub kind: Kind,
    /// Unit axis in the file's pose, body frame.
    pub axis: DVec3,
    /// A point of the axis in the file's pose, body frame [m].
    pub origin: DVec3,
    /// What says where it stands.
    pub drive: Drive,
    /// Least and greatest position [rad or m].
    pub limits: Option<[f64; 2]>,
    /// Most that it moves in a second [rad/s or m/s]; without, it is always where it is asked to be.
    pub rate: Option<f64>,
}

/// A node that plays a glTF animation.
#[derive(Debug, Clone, PartialEq)]
pub struct Played {
    /// Its rotation (x, y, z, w), where that is animated.
    pub rotation: Option<Keys<4>>,
    /// Its translation [m], where that is animated.
    pub translation: Option<Keys<3>>,
    /// Length of the animation [s].
    pub duration: f64,
    /// Whether it begins again after its end.
    pub repeats: bool,
    /// The node's own translation [m] and rotation in the file's pose.
    pub rest: (DVec3, DQuat),
    /// From the parent's frame to the body's in the file's pose: a similarity.
    pub body_from_parent: DAffine3,
}

/// How a joint moves.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// By one number.
    Guided(Guided),
    /// As an animation says.
    Played(Box<Played>),
}

/// A joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Name of its glTF node.
    pub name: String,
    /// The joint that it hangs on, which comes before it; `None` for the body.
    pub parent: Option<usize>,
    /// How it moves.
    pub motion: Motion,
}

impl Drive {
    /// The position that is asked for at a time [s], where the Sun stands at `sun` in the frame of what carries the
    /// joint, moved back to the file's pose.
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
                // Both as seen along the axis.
                axis.cross(*facing).dot(sun).atan2(facing.reject_from_normalized(axis).dot(sun)) + offset
            }
        }
    }
}

impl Guided {
    /// The position nearest to `target` that the limits allow. A direction is the same after a whole turn: of those of
    /// a joint that tracks the Sun, the one nearest to `near` is taken.
    fn within_limits(&self, target: f64, near: Option<f64>) -> f64 {
        let turns = matches!(self.drive, Drive::Sun { .. });
        match self.limits {
            None if turns => near.map_or(target, |near| target + ((near - target) / TAU).round() * TAU),
            None => target,
            Some([low, high]) if turns => {
                let near = near.unwrap_or(0.5 * (low + high));
                let first = target + ((low - target) / TAU).ceil() * TAU;
                let mut best: Option<f64> = None;
                let mut turn = first;
                while turn <= high {
                    if best.is_none_or(|best| (turn - near).abs() < (best - near).abs()) {
                        best = Some(turn);
                    }
                    turn += TAU;
                }
                let apart = |end: f64| ((end - target + PI).rem_euclid(TAU) - PI).abs();
                best.unwrap_or(if apart(low) <= apart(high) { low } else { high })
            }
            Some([low, high]) => target.clamp(low, high),
        }
    }

    /// The motion of the part at a position, in the file's pose.
    fn motion(&self, position: f64) -> DAffine3 {
        match self.kind {
            Kind::Rotation => {
                let turn = DMat3::from_axis_angle(self.axis, position);
                DAffine3::from_mat3_translation(turn, self.origin - turn * self.origin)
            }
            Kind::Translation => DAffine3::from_translation(self.axis * position),
        }
    }
}

impl Played {
    /// The motion of the part at a time [s], in the file's pose.
    fn motion(&self, time: f64) -> DAffine3 {
        let time = if self.repeats && self.duration > 0.0 { time.rem_euclid(self.duration) } else { time };
        let (translation, rotation) = self.rest;
        let turned = self.rotation.as_ref().map_or(rotation, |keys| keys.rotation(time));
        let placed = self.translation.as_ref().map_or(translation, |keys| keys.vector(time));
        let turn = turned * rotation.inverse();
        let in_parent = DAffine3::from_rotation_translation(turn, placed - turn * translation);
        let moved = self.body_from_parent * in_parent * self.body_from_parent.inverse();
        // A similarity leaves a rotation but for rounding.
        DAffine3::from_mat3_translation(
            DMat3::from_quat(DQuat::from_mat3(&moved.matrix3).normalize()),
            moved.translation,
        )
    }

    /// What is told of it: the angle from the file's pose [rad], or how far it is from there [m] where it does not turn.
    fn position(&self, time: f64) -> f64 {
        let motion = self.motion(time);
        match self.rotation {
            Some(_) => DQuat::from_mat3(&motion.matrix3).to_axis_angle().1,
            None => motion.translation.length(),
        }
    }
}

impl Joint {
    /// Most that it moves in a second [rad/s or m/s], where that is stated.
    fn rate(&self) -> Option<f64> {
        match &self.motion {
            Motion::Guided(guided) => guided.rate,
            Motion::Played(_) => None,
        }
    }

    /// Whether its position is an angle.
    pub fn turns(&self) -> bool {
        match &self.motion {
            Motion::Guided(guided) => guided.kind == Kind::Rotation,
            Motion::Played(played) => played.rotation.is_some(),
        }
    }
}

#[cfg(test)]
mod tests;
