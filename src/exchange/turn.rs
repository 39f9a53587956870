//! How far joints have turned, and the poses between two poses.

use glam::{DAffine3, DQuat, DVec3};

use crate::environment::shadow::turn_between;

/// A turn below this is rounding [rad].
const STILL: f64 = 1e-9;

/// Largest turn of a joint between poses [rad]. A way counts as a turn about the origin, over a metre at least.
pub(crate) fn turned(before: &[DAffine3], now: &[DAffine3]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let turn = |(a, b): (&DAffine3, &DAffine3)| {
        turn_between(a, b).max(a.translation.distance(b.translation) / (1.0 + a.translation.length()))
    };
    before.iter().zip(now).map(turn).fold(0.0, f64::max)
}

/// The poses that lie at a share of the way from poses to others, each joint on its screw. A share above 1 goes beyond them.
pub(crate) fn between(from: &[DAffine3], to: &[DAffine3], share: f64) -> Vec<DAffine3> {
    from.iter().zip(to).map(|(from, to)| screw(&(*to * from.inverse()), share) * *from).collect()
}

/// The share of the way between poses that comes next to poses, and the turn by which they still miss it [rad].
pub(crate) fn on_the_way(from: &[DAffine3], to: &[DAffine3], poses: &[DAffine3]) -> (f64, f64) {
    if from.len() != to.len() || from.len() != poses.len() {
        return (0.0, f64::INFINITY);
    }
    let moved = |to: &[DAffine3]| -> Vec<[DVec3; 2]> {
        let one = |(a, b): (&DAffine3, &DAffine3)| {
            let turn = shortest(DQuat::from_mat3(&(a.matrix3.transpose() * b.matrix3)).normalize());
            [turn.to_scaled_axis(), (b.translation - a.translation) / (1.0 + a.translation.length())]
        };
        from.iter().zip(to).map(one).collect()
    };
    let (whole, part) = (moved(to), moved(poses));
    let product = |a: &[[DVec3; 2]], b: &[[DVec3; 2]]| -> f64 {
        a.iter().zip(b).map(|([p, q], [r, s])| p.dot(*r) + q.dot(*s)).sum()
    };
    let share = (product(&whole, &part) / product(&whole, &whole).max(STILL * STILL)).clamp(0.0, 1.0);
    (share, turned(&between(from, to, share), poses))
}

/// A share of a rigid motion, on its screw.
fn screw(motion: &DAffine3, share: f64) -> DAffine3 {
    let turn = shortest(DQuat::from_mat3(&motion.matrix3).normalize());
    let (axis, angle) = turn.to_axis_angle();
    if angle < STILL {
        return DAffine3::from_translation(share * motion.translation);
    }
    let along = axis * axis.dot(motion.translation);
    let across = motion.translation - along;
    // The point of the screw's axis that solves centre - turn * centre = across.
    let centre = 0.5 * (across + axis.cross(across) / (0.5 * angle).tan());
    let part = DQuat::from_axis_angle(axis, share * angle);
    DAffine3::from_rotation_translation(part, centre - part * centre + share * along)
}

/// The same turn as a quaternion of at most half a turn.
fn shortest(turn: DQuat) -> DQuat {
    if turn.w < 0.0 { -turn } else { turn }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint about an axis away from the origin, and one that also slides.
    fn poses(angle: f64) -> [DAffine3; 2] {
        let axis = DVec3::new(0.3, -0.8, 0.5).normalize();
        let about = DAffine3::from_translation(DVec3::new(4.0, -2.0, 1.0))
            * DAffine3::from_axis_angle(axis, angle)
            * DAffine3::from_translation(DVec3::new(-4.0, 2.0, -1.0));
        [about, DAffine3::from_translation(3.0 * angle * axis) * about]
    }

    #[test]
    fn poses_on_a_screw_are_found_at_their_share() {
        let (from, to) = (poses(0.2), poses(0.9));
        for share in [0.0, 0.25, 0.6, 1.0, 1.7] {
            let angle = 0.2 + 0.7 * share;
            assert!(turned(&between(&from, &to, share), &poses(angle)) < 1e-12, "{share}");
            let (found, off) = on_the_way(&from, &to, &poses(angle));
            if share <= 1.0 {
                assert!((found - share).abs() < 0.01 && off < 0.01, "{share}: {found}, {off}");
            } else {
                assert!(found == 1.0 && off > 0.4, "{share}: {found}, {off}");
            }
        }
        assert!(turned(&between(&from, &to, 0.3), &poses(0.2 + 0.7 * 0.31)) > 1e-3);
        assert!(turned(&[], &[DAffine3::IDENTITY]).is_infinite());
    }
}
