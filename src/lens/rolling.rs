//! Where a point is in camera axes at the time of the row that it appears in (rolling shutter): the twin of `glsl/shutter.glsl`.

use glam::{DAffine3, DVec2, DVec3};

use super::{Distortion, Field, Lens};

/// Iterations of the row of a point. Each one multiplies the error by the share of the image that a point moves in the time of
/// all rows.
pub(crate) const ROW_ITERATIONS: u32 = 6;

/// A camera whose rows see poses of their own.
#[derive(Debug, Clone, Copy)]
pub struct Rolling {
    /// Poses at the first, the middle and the last row, which take a point into camera axes.
    pub poses: [DAffine3; 3],
    /// The lens.
    pub lens: Lens,
    /// The rays whose row is computed. `None` without distortion: then all rays have one.
    pub field: Option<Field>,
    /// Rows of the image, at least 2.
    pub rows: u32,
}

impl Rolling {
    /// Share of the image above the row of a ray: 0 at the first row and 1 at the last.
    pub(crate) fn share_above(&self, ray: DVec2) -> f64 {
        let bent = self.lens.distortion.bend(ray).0;
        (self.lens.focal[1] * bent.y + self.lens.centre[1] - 0.5) / f64::from(self.rows - 1)
    }

    /// A point in camera axes.
    pub fn rolled(&self, position: DVec3) -> DVec3 {
        let positions = self.poses.map(|pose| pose.transform_point3(position));
        let mut share = 0.5;
        for _ in 0..ROW_ITERATIONS {
            let camera = pose_between(positions, share);
            let ray = camera.truncate() / camera.z.max(1e-6);
            let ray = match (&self.field, self.lens.distortion) {
                (Some(field), Distortion::BrownConrady(_) | Distortion::Fisheye(_)) => ray.clamp(field.low, field.high),
                _ => ray,
            };
            share = self.share_above(ray).clamp(-1.0, 2.0);
        }
        pose_between(positions, share)
    }
}

/// The pose between the first, the middle and the last row is quadratic in time.
fn pose_between([first, middle, last]: [DVec3; 3], share: f64) -> DVec3 {
    first * ((1.0 - share) * (1.0 - 2.0 * share))
        + middle * (4.0 * share * (1.0 - share))
        + last * (share * (2.0 * share - 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn pose(share: f64) -> DAffine3 {
        let turn = DQuat::from_rotation_y(0.02 * share) * DQuat::from_rotation_x(-0.03 * share);
        DAffine3::from_rotation_translation(turn, DVec3::new(0.1 * share, -0.05 * share, 8.0 + 0.2 * share))
    }

    /// The row is the one on which the point is seen at that row's time.
    #[test]
    fn a_point_appears_on_the_row_of_its_time() {
        let bent = Distortion::BrownConrady([-0.2, 0.04, 1e-3, -2e-3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        for distortion in [Distortion::None, bent, Distortion::Fisheye([-0.01, 0.0, 0.002, 0.0])] {
            let lens = Lens { distortion, ..Lens::pinhole([110.0, 112.0], [48.3, 35.2]) };
            let field = lens.field([96, 72]).ok().filter(|_| distortion != Distortion::None);
            let rolling = Rolling { poses: [0.0, 0.5, 1.0].map(pose), lens, field, rows: 72 };
            for number in 0..200 {
                let part = |factor: f64| 2.0 * (f64::from(number) * factor).fract() - 1.0;
                let position = DVec3::new(2.5 * part(0.618), 1.8 * part(0.414), part(0.732));
                let computed = rolling.rolled(position);
                // By bisection of the row's time, with the pose of that time itself.
                let (mut low, mut high) = (-1.0, 2.0);
                for _ in 0..60 {
                    let share = 0.5 * (low + high);
                    let camera = pose(share).transform_point3(position);
                    if rolling.share_above(camera.truncate() / camera.z) > share { low = share } else { high = share }
                }
                let expected = pose(low).transform_point3(position);
                assert!(
                    computed.distance(expected) < 2e-5,
                    "{distortion:?}, {position}: {computed} against {expected}"
                );
                let global = pose(0.0).transform_point3(position);
                assert!(computed.distance(global) > 1e-4 || low.abs() < 0.01, "the shutter must show");
            }
        }
    }
}
