//! When to update shadows, and with which view of the Sun.

use glam::DAffine3;

use super::Casting;
use crate::environment::StepLoad;
use crate::environment::shadow::{Jointed, Occluders, Redraw, SUN_RAYS, SunProjection, disc_directions};
use crate::gpu::effects::image::runs::TriangleRun;
use crate::gpu::layout;
use crate::gpu::scene_data::SceneData;

/// Shadow casters and the Sun of the last update; empty if the craft does not shadow itself.
pub(crate) struct Shadows {
    /// When to update.
    pub(crate) redraw: Option<Redraw>,
    /// Triangles of the shadow map.
    pub(crate) occluders: Vec<TriangleRun>,
    /// Transforms of the next frame's shadow map, one for each joint.
    pub(crate) views: Vec<layout::SunView>,
    /// Number of boxes in the tree, and offset of a ray's start [m]; for shadow rays only.
    tree: Option<(u32, f64)>,
    /// Shadow casters of a craft with moving parts, for shadow rays only.
    casters: Option<Jointed>,
    /// Poses of the joints at the last update by rays.
    poses: Vec<DAffine3>,
    rays: Vec<layout::SunRay>,
    joints: u32,
}

impl Shadows {
    /// Shadows of a scene.
    pub(crate) fn new(data: &SceneData<'_>) -> Self {
        let shadows = data.shadows.as_ref();
        let count = shadows.map_or(0, |shadows| shadows.occluders.len() as u32);
        let whole = || vec![TriangleRun { joint: 0, triangles: (0, count) }];
        Self {
            redraw: shadows.map(|shadows| shadows.redraw.clone()),
            occluders: data.joints.as_ref().map_or_else(whole, |joints| joints.occluders.to_vec()),
            views: Vec::new(),
            tree: shadows.and_then(|shadows| shadows.tree).map(size_of_tree),
            casters: data.joints.as_ref().and_then(|joints| joints.casters.clone()),
            poses: Vec::new(),
            rays: Vec::new(),
            joints: data.joints.as_ref().map_or(1, |joints| joints.count),
        }
    }

    /// Whether the craft shadows itself.
    pub(crate) fn are_cast(&self) -> bool {
        self.redraw.is_some()
    }

    /// Whether the shadows of the first load hold for another load too.
    pub(crate) fn hold(&self, first: &StepLoad) -> impl Fn(&StepLoad) -> bool {
        let mut redraw = self.redraw.clone();
        if let Some(redraw) = &mut redraw {
            redraw.view(first);
        }
        move |load| redraw.as_ref().is_none_or(|redraw| redraw.holds(load))
    }

    /// How shadows are found, with the Sun of the last update.
    pub(crate) fn casting(&self) -> Casting {
        match self.tree {
            Some(_) => Casting::Rays { rays: self.rays.clone(), poses: self.poses.clone() },
            None => Casting::Map,
        }
    }

    /// View of the Sun, if the load needs an update.
    pub(crate) fn due(&mut self, load: &StepLoad) -> Option<SunProjection> {
        self.redraw.as_mut()?.view(load)
    }

    /// New tree for shadow rays, if parts have moved.
    pub(crate) fn moved_tree(&mut self, load: &StepLoad) -> Option<Occluders> {
        self.tree?;
        let casters = self.casters.as_ref().filter(|_| self.poses != load.joints)?;
        let tree = casters.occluders(&load.joints);
        self.tree = Some(size_of_tree(&tree));
        self.poses.clone_from(&load.joints);
        Some(tree)
    }

    /// Sets the Sun of the next update.
    pub(crate) fn turn(&mut self, view: &SunProjection, load: &StepLoad) {
        let Some((boxes, start)) = self.tree else {
            let pose = |joint: u32| load.joints.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
            self.views = (0..self.joints).map(|joint| layout::SunView::new(&view.in_joint(&pose(joint)))).collect();
            return;
        };
        let with = |v: glam::DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
        let ray = |direction| layout::SunRay {
            sun: with(view.sun, start),
            direction: with(direction, 1.0 / SUN_RAYS as f64),
            boxes,
            unused: [0; 3],
        };
        self.rays = disc_directions(view.sun).map(ray).to_vec();
    }
}

/// Number of boxes in a tree, and offset of a ray's start [m].
fn size_of_tree(tree: &Occluders) -> (u32, f64) {
    (tree.tree.nodes.len() as u32, tree.start)
}
