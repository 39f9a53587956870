//! Choice of the triangles to cull again: those whose view has moved more than their last culling tolerates.
//!
//! In a mesh of a million triangles few cover a pixel centre, and lavapipe sets up triangles on one thread. A culling
//! pass thus removes the others, and a test shows that no pixel changes. While camera or joints move slowly, the pass
//! also keeps triangles that the next images may need.

use glam::{DVec2, DVec3, Vec3};

use super::runs::TriangleRun;
use crate::gpu::layout::View;

/// Steps of the present motion that a culling tolerates.
const STEPS_AHEAD: f64 = 3.0;
/// Most motion that a culling tolerates [px]. With more, too many triangles would be kept.
const MOST_MARGIN: f64 = 0.25;
/// Motion in a step above which a culling tolerates none [px].
const FAST: f64 = MOST_MARGIN / 2.0;
/// Rounding error of a motion [px].
const ROUNDING: f64 = 1e-3;

/// Runs of triangles, each with the view of its last culling.
pub(crate) struct Culling {
    runs: Vec<CulledRun>,
}

struct CulledRun {
    of: TriangleRun,
    /// Lower and upper corner of the nodes in the frame of their joint [m].
    bounds: [Vec3; 2],
    /// The view of the last culling, with its margin.
    culled: Option<View>,
    /// The view of the last image.
    last: Option<View>,
}

impl Culling {
    /// Makes the state of runs that were never culled. `positions` belong to the nodes [m].
    pub(crate) fn new(runs: &[TriangleRun], triangles: &[[u32; 3]], positions: &[Vec3]) -> Self {
        let run = |of: &TriangleRun| {
            let nodes = triangles[of.triangles.0 as usize..of.triangles.1 as usize].as_flattened().iter();
            let around = |[low, high]: [Vec3; 2], node: &u32| {
                let at = positions[*node as usize];
                [low.min(at), high.max(at)]
            };
            let bounds = nodes.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], around);
            CulledRun { of: *of, bounds, culled: None, last: None }
        };
        Self { runs: runs.iter().map(run).collect() }
    }

    /// The runs to cull before an image from `views`, one for each joint. It sets the tolerated motion in their views.
    pub(crate) fn due(&mut self, views: &mut [View]) -> Vec<TriangleRun> {
        let mut due = Vec::new();
        for run in &mut self.runs {
            let Some(view) = views.get_mut(run.of.joint as usize) else { continue };
            let now = *view;
            let motion = |from: &View| motion(from, &now, run.bounds);
            let holds =
                |culled: &View| *culled == now || motion(culled).is_some_and(|moved| moved <= f64::from(culled.margin));
            if !run.culled.as_ref().is_some_and(holds) {
                let slow = run.last.as_ref().and_then(motion).filter(|moved| *moved <= FAST);
                view.margin = slow.map_or(0.0, |moved| (STEPS_AHEAD * moved).min(MOST_MARGIN)) as f32;
                run.culled = Some(*view);
                due.push(run.of);
            }
            run.last = Some(now);
        }
        due
    }

    /// The views of the last culling and of the last image of each run.
    pub(crate) fn save(&self) -> Vec<[Option<View>; 2]> {
        self.runs.iter().map(|run| [run.culled, run.last]).collect()
    }

    /// Takes what `save` gave.
    pub(crate) fn restore(&mut self, saved: &[[Option<View>; 2]]) {
        self.runs.iter_mut().zip(saved).for_each(|(run, views)| [run.culled, run.last] = *views);
    }

    /// The views of the last cullings, one for each of the joints, and their runs. `None` where nothing was culled.
    pub(crate) fn last_culled(&self, joints: u32) -> Option<(Vec<View>, Vec<TriangleRun>)> {
        let culled: Vec<(View, TriangleRun)> = self.runs.iter().filter_map(|run| Some((run.culled?, run.of))).collect();
        let mut views = vec![culled.first()?.0; joints as usize];
        for (view, run) in &culled {
            *views.get_mut(run.joint as usize)? = *view;
        }
        Some((views, culled.into_iter().map(|(_, run)| run).collect()))
    }

    /// Forgets the last culling of all runs.
    pub(crate) fn forget(&mut self) {
        self.runs.iter_mut().for_each(|run| run.culled = None);
    }
}

/// Upper bound of a box's motion in the image between two views [px]. It is `None` if the box reaches behind the near
/// plane of either view, or if the cameras differ.
fn motion(from: &View, to: &View, [low, high]: [Vec3; 2]) -> Option<f64> {
    let camera = |view: &View| (view.clip_scale, view.clip_offset, view.size, view.near);
    if camera(from) != camera(to) {
        return None;
    }
    // Both are affine in the point, so their quotient is also largest at a corner.
    let (mut moved, mut slope, mut nearest) = (DVec3::ZERO, DVec2::ZERO, f64::INFINITY);
    for corner in 0..8u32 {
        let at = |axis: usize| f64::from(if corner >> axis & 1 == 0 { low[axis] } else { high[axis] });
        let corner = DVec3::new(at(0), at(1), at(2));
        let [before, after] = [from, to].map(|view| {
            let rows = [view.camera_from_body_x, view.camera_from_body_y, view.camera_from_body_z];
            let [x, y, z] =
                rows.map(|[x, y, z, w]| DVec3::new(x.into(), y.into(), z.into()).dot(corner) + f64::from(w));
            DVec3::new(x, y, z)
        });
        nearest = nearest.min(before.z).min(after.z);
        moved = moved.max((after - before).abs());
        slope = slope.max((before.truncate() / before.z).abs());
    }
    if nearest <= f64::from(to.near) {
        return None;
    }
    let focal = 0.5 * DVec2::from(to.clip_scale.map(f64::from)) * DVec2::from(to.size.map(f64::from));
    Some((focal.abs() * (moved.truncate() + slope * moved.z) / nearest).max_element() + ROUNDING)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view with 100 px a radian, from a place on -z.
    fn view(x: f32, z: f32) -> View {
        View {
            camera_from_body_x: [1.0, 0.0, 0.0, x],
            camera_from_body_y: [0.0, 1.0, 0.0, 0.0],
            camera_from_body_z: [0.0, 0.0, 1.0, z],
            clip_scale: [2.0, 2.0],
            clip_offset: [0.0, 0.0],
            size: [100.0, 100.0],
            near: 0.1,
            margin: 0.0,
        }
    }

    fn culling() -> Culling {
        let runs = [TriangleRun { joint: 0, triangles: (0, 1) }];
        Culling::new(&runs, &[[0, 1, 2]], &[Vec3::ZERO, Vec3::X, Vec3::Z])
    }

    #[test]
    fn a_motion_is_that_of_the_fastest_corner_or_more() {
        let bounds = [Vec3::ZERO, Vec3::new(1.0, 0.0, 1.0)];
        // A move of 0.01 m at a distance of 10 m with 100 px a radian is 0.1 px.
        let across = motion(&view(0.0, 10.0), &view(0.01, 10.0), bounds).expect("before the camera");
        assert!((across - 0.1 - ROUNDING).abs() < 1e-6, "{across}");
        // The corner at (1, 0, 0) m moves from 100 / 10 px to 100 / 10.1 px.
        let along = motion(&view(0.0, 10.0), &view(0.0, 10.1), bounds).expect("before the camera");
        assert!((0.099..0.105).contains(&along), "{along}");
        assert_eq!(motion(&view(0.0, 10.0), &view(0.0, 0.05), bounds), None, "a corner reaches behind the near plane");
        let wider = View { clip_scale: [1.0, 1.0], ..view(0.0, 10.0) };
        assert_eq!(motion(&view(0.0, 10.0), &wider, bounds), None, "another lens");
    }

    #[test]
    fn slow_motion_is_culled_ahead_of() {
        let mut culling = culling();
        // At 0.02 px a step, the second culling lasts for three steps minus the rounding error.
        let due: Vec<bool> =
            (0..12).map(|step| !culling.due(&mut [view(0.002 * step as f32, 10.0)]).is_empty()).collect();
        let culled: Vec<usize> = due.iter().enumerate().filter(|(_, due)| **due).map(|(step, _)| step).collect();
        assert_eq!(culled[..2], [0, 1]);
        assert!(culled.len() <= 6 && culled[2] >= 4, "{culled:?}");
    }

    #[test]
    fn fast_motion_is_culled_for_itself() {
        let mut culling = culling();
        for step in 0..4 {
            let mut views = [view(0.02 * step as f32, 10.0)];
            assert_eq!(culling.due(&mut views).len(), 1);
            assert_eq!(views[0].margin, 0.0);
        }
        assert!(culling.due(&mut [view(0.06, 10.0)]).is_empty(), "nothing has moved");
        culling.forget();
        assert_eq!(culling.due(&mut [view(0.06, 10.0)]).len(), 1);
    }
}
