//! When light is found anew: after the Sun or a part has moved far enough against the craft.

use glam::{DAffine3, DQuat, DVec3};

use crate::environment::StepLoad;

/// A turn below this is rounding [rad]. With an angle of 0, light is found anew at every greater turn.
const STILL: f64 = 1e-9;

/// Direction of the Sun (body frame), and poses of the joints.
pub(crate) type LightAndPoses = (DVec3, Vec<DAffine3>);

/// The boxes of the parts, and the state for which light was last found.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Redraw {
    /// Joint, lower corner and upper corner [m] of each box, in the file's pose.
    pub(crate) bounds: Vec<(u32, [DVec3; 2])>,
    /// Turn of the Sun or of a joint against the craft after which light is found anew [rad].
    pub(crate) angle: f64,
    /// Direction of the Sun (body frame) and poses of the joints for which light was last found.
    pub(crate) found_for: Option<LightAndPoses>,
}

impl Redraw {
    /// Direction of the Sun (unit vector, body frame) if light must be found anew for a load. `None` where the last light still holds, or where it is dark. A
    /// step has one direction, the mean of its sunlight. A joint counts as moved when it has turned by more than the angle, or when the middle of its boxes
    /// has moved by more than the angle times the size of the craft.
    pub(crate) fn due(&mut self, load: &StepLoad) -> Option<DVec3> {
        if self.holds(load) {
            return None;
        }
        let sun = sun_of(load)?;
        self.found_for = Some((sun, load.joints.clone()));
        Some(sun)
    }

    /// Whether the last light still holds for a load.
    pub(crate) fn holds(&self, load: &StepLoad) -> bool {
        let Some(sun) = sun_of(load) else { return true };
        self.found_for.as_ref().is_some_and(|(last, poses)| {
            // From sine and cosine, because the arc cosine does not resolve angles below 1e-8.
            let turned = last.cross(sun).length().atan2(last.dot(sun));
            turned <= self.angle.max(STILL) && !self.has_moved(poses, &load.joints)
        })
    }

    /// Corners of the boxes as placed by the joints.
    fn corners<'a>(&'a self, poses: &'a [DAffine3]) -> impl Iterator<Item = DVec3> + 'a {
        self.bounds.iter().flat_map(|(joint, bounds)| {
            let pose = poses.get(*joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
            corners_of(*bounds).map(move |corner| pose.transform_point3(corner))
        })
    }

    /// Diagonal of the box around the craft as placed by the joints [m]. Without poses every part stays where the file has it.
    fn size(&self, poses: &[DAffine3]) -> f64 {
        let [low, high] = self
            .corners(poses)
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], corner| [low.min(corner), high.max(corner)]);
        (high - low).length()
    }

    fn has_moved(&self, before: &[DAffine3], now: &[DAffine3]) -> bool {
        let size = self.size(now);
        self.bounds.iter().any(|(joint, [low, high])| {
            let (Some(before), Some(now)) = (before.get(*joint as usize), now.get(*joint as usize)) else {
                return before.len() != now.len();
            };
            let turn = turn_between(before, now);
            let middle = 0.5 * (*low + *high);
            let moved = before.transform_point3(middle).distance(now.transform_point3(middle));
            turn > self.angle.max(STILL) || moved > self.angle.max(STILL) * size
        })
    }
}

/// Corners of a box.
fn corners_of([low, high]: [DVec3; 2]) -> impl Iterator<Item = DVec3> {
    (0..8u32).map(move |corner| {
        let at = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(at(0), at(1), at(2))
    })
}

/// Mean direction of a load's sunlight. `None` where it is dark.
pub(super) fn sun_of(load: &StepLoad) -> Option<DVec3> {
    load.sun.iter().map(|sample| sample.direction * sample.flux).sum::<DVec3>().try_normalize()
}

/// Angle by which one pose is turned against another [rad], in [0, pi], exact for small ones.
pub(crate) fn turn_between(before: &DAffine3, now: &DAffine3) -> f64 {
    let turn = DQuat::from_mat3(&(before.matrix3.transpose() * now.matrix3)).normalize();
    2.0 * turn.xyz().length().atan2(turn.w.abs())
}
