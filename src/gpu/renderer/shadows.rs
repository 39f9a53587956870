//! When shadows are found anew, and what finds them.

use glam::DAffine3;

use crate::environment::StepLoad;
use crate::environment::shadow::{Jointed, Method, Occluders, Redraw, SUN_RAYS, SunView, disc_directions};
use crate::gpu::frame::{Frame, StepRange, TriangleRun};
use crate::gpu::layout;
use crate::gpu::resources::SceneData;

/// What casts shadows, and for which Sun they were last found; empty where the craft does not shadow itself.
pub(super) struct Shadows {
    /// When the Sun's view is drawn anew.
    redraw: Option<Redraw>,
    /// Triangles that are drawn as the Sun sees them.
    pub occluders: Vec<TriangleRun>,
    /// The Sun's view of the frame that is submitted next, one a joint, where it draws it.
    pub views: Vec<layout::SunView>,
    /// Boxes of the tree and where its rays start [m], where rays find the shadows.
    tree: Option<(u32, f64)>,
    /// What rays are tried against, where parts move.
    casters: Option<Jointed>,
    /// Poses of the joints for which rays last found the shadows.
    poses: Vec<DAffine3>,
    rays: Vec<layout::SunRay>,
    joints: u32,
}

impl Shadows {
    /// Of a scene.
    pub fn new(data: &SceneData<'_>) -> Self {
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
    pub fn are_cast(&self) -> bool {
        self.redraw.is_some()
    }

    /// Whether the shadows that a load finds are those of another, too.
    pub fn hold(&self, first: &StepLoad) -> impl Fn(&StepLoad) -> bool {
        let mut redraw = self.redraw.clone();
        if let Some(redraw) = &mut redraw {
            redraw.view(first);
        }
        move |load| redraw.as_ref().is_none_or(|redraw| redraw.holds(load))
    }

    /// The passes that find shadows.
    pub fn frame(&self, ranges: &[StepRange]) -> Frame {
        Frame::shadows(ranges, if self.tree.is_some() { Method::Exact } else { Method::Depth })
    }

    /// The Sun's view of a load that asks for shadows to be found anew.
    pub fn due(&mut self, load: &StepLoad) -> Option<SunView> {
        self.redraw.as_mut()?.view(load)
    }

    /// The tree that rays are tried against under a load, where parts have moved.
    pub fn moved_tree(&mut self, load: &StepLoad) -> Option<Occluders> {
        self.tree?;
        let casters = self.casters.as_ref().filter(|_| self.poses != load.joints)?;
        let tree = casters.occluders(&load.joints);
        self.tree = Some(size_of_tree(&tree));
        self.poses.clone_from(&load.joints);
        Some(tree)
    }

    /// Turns to the Sun.
    pub fn turn(&mut self, view: &SunView, load: &StepLoad) {
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

    /// What a dispatch of a ray over the nodes of a joint says.
    pub fn ray(&self, ray: u32, joint: u32) -> Vec<u8> {
        let pose = self.poses.get(joint as usize).copied().unwrap_or(DAffine3::IDENTITY);
        [bytemuck::bytes_of(&self.rays[ray as usize]), bytemuck::bytes_of(&layout::rows(&pose))].concat()
    }
}

/// Boxes of a tree, and where its rays start [m].
fn size_of_tree(tree: &Occluders) -> (u32, f64) {
    (tree.tree.nodes.len() as u32, tree.start)
}
