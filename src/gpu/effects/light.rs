//! Sunlight on the craft: the share of the Sun that every node sees past other parts, by a shadow map or by rays.

pub(crate) mod state;

use glam::DAffine3;

use super::image::runs::CORNERS;
use super::thermal::variant::StepRange;
use super::thermal::{over_nodes, workgroups};
use crate::environment::shadow::SUN_RAYS;
use crate::gpu::layout::{self, SunRay};
use crate::gpu::pass::{
    COMPUTE, COMPUTE_READ, COMPUTE_WRITE, COMPUTED, COPIED, COPY_WRITE, DEPTH, DEPTH_WRITE, Drawing, Frame, Pass,
    barrier, to_copy, to_draw,
};
use crate::gpu::resource::Pieces::Always;
use crate::gpu::resource::Role::{Depth, Indices, Storage};
use crate::gpu::resource::{GROUP, Per, Resource, lent, made, resources};
use crate::gpu::scene_data::{SceneData, ShadowData, only};
use crate::gpu::shaders::Shader;

resources! {
    /// Transform of the shadow map, written by the host.
    SUN_VIEW = Resource::uniform::<layout::SunView>("SunView", |data| only(by_map(data).is_some(), 1)).each_joint();
    /// Node indices of the triangles that cast shadows.
    OCCLUDERS = Resource::new("Occluders", CORNERS, Indices, Per::Scene, |data| {
        by_map(data).map_or(0, |shadows| shadows.occluders.len())
    })
    .filled(|data| lent(by_map(data).map_or(&[], |shadows| shadows.occluders)));
    /// Shadow map.
    SUN_DEPTH_IMAGE = Resource::image("SunDepthImage", 4, Depth, Per::Scene, sun_texels, |data| {
        [by_map(data).map_or(0, |shadows| shadows.redraw.resolution); 2]
    });
    /// Copy of the shadow map that shaders read.
    SUN_DEPTH = Resource::new("SunDepth", 4, Storage, Per::Scene, sun_texels);
    /// Boxes of the tree for shadow rays. A tree that is rebuilt for moved parts has as many.
    SHADOW_TREE = Resource::new("ShadowTree", size_of::<layout::ShadowBox>(), Storage, Per::Scene, |data| {
            tree(data).map_or(0, |tree| tree.tree.nodes.len())
        })
        .filled(|data| made(&tree(data).map(|tree| layout::shadow_tree(tree).0).unwrap_or_default()));
    /// Triangles of the tree for shadow rays.
    SHADOW_TRIANGLES =
        Resource::new("ShadowTriangles", size_of::<layout::ShadowTriangle>(), Storage, Per::Scene, |data| {
            tree(data).map_or(0, |tree| tree.triangles.len())
        })
        .filled(|data| made(&tree(data).map(|tree| layout::shadow_tree(tree).1).unwrap_or_default()));
    /// Share of the Sun that every node sees.
    VISIBILITY =
        Resource::new("Visibility", GROUP, Storage, Per::Node, |data| only(data.shadows.is_some(), data.groups()))
            .in_pieces(Always);
}

/// The tree for shadow rays, where shadows use rays.
fn tree<'a>(data: &'a SceneData<'_>) -> Option<&'a crate::environment::shadow::Occluders> {
    data.shadows.as_ref()?.tree
}

/// The shadows, where they use a shadow map.
fn by_map<'a, 'b>(data: &'a SceneData<'b>) -> Option<&'a ShadowData<'b>> {
    data.shadows.as_ref().filter(|shadows| shadows.tree.is_none())
}

fn sun_texels(data: &SceneData<'_>) -> usize {
    by_map(data).map_or(0, |shadows| (shadows.redraw.resolution as usize).pow(2))
}

/// How shadows are found.
#[derive(Debug, Clone, PartialEq)]
pub enum Casting {
    /// By a shadow map.
    Map,
    /// By rays to points of the Sun's disc.
    Rays {
        /// A ray to each point.
        rays: Vec<SunRay>,
        /// Poses of the joints, without the body's own.
        poses: Vec<DAffine3>,
    },
}

/// Most groups of one dispatch of shadow rays: 65,535 workgroups of 64 nodes, rounded down to whole ranges.
const TRACED_AT_ONCE: u32 = 65_535 / 4 * 64;
/// Groups of four nodes of a workgroup of shadow rays.
const GROUPS_OF_RAYS: u32 = 16;

/// Finds the share of the Sun that each node sees, in the ranges with shadows. It precedes a step in which the Sun has
/// moved in the body frame. Nothing if no range has shadows.
pub(crate) fn passes(frame: &mut Frame, ranges: &[StepRange], casting: &Casting) {
    let shadowed: Vec<StepRange> = ranges.iter().copied().filter(|range| range.variant.shadow).collect();
    if shadowed.is_empty() {
        return;
    }
    match casting {
        Casting::Map => by_depth(frame, &shadowed),
        Casting::Rays { rays, poses } => by_rays(frame, &shadowed, rays, poses),
    }
    frame.wait([barrier(&VISIBILITY, COMPUTE_WRITE, COMPUTE_READ)]);
}

/// Draws the depth as the Sun sees it, copies it to a buffer, and looks up every node.
fn by_depth(frame: &mut Frame, ranges: &[StepRange]) {
    // The last copy must finish before the image is drawn again.
    frame.wait([to_draw(&SUN_DEPTH_IMAGE, COPIED, DEPTH)]);
    frame.pass(Pass::draw(
        "solar_depth",
        Drawing {
            shaders: vec![Shader::plain("solar_depth.vert")],
            behind: Vec::new(),
            colours: Vec::new(),
            depth: &SUN_DEPTH_IMAGE,
            samples: 1,
            indices: &OCCLUDERS,
            commands: None,
        },
    ));
    frame.wait([to_copy(&SUN_DEPTH_IMAGE, DEPTH_WRITE), barrier(&SUN_DEPTH, COMPUTED, COPY_WRITE)]);
    frame.pass(Pass::copy("read solar_depth", &SUN_DEPTH_IMAGE, &SUN_DEPTH));
    frame.wait([barrier(&SUN_DEPTH, COPY_WRITE, COMPUTE_READ), barrier(&VISIBILITY, COMPUTE_WRITE, COMPUTE_WRITE)]);
    frame.passes_of(ranges.iter().map(|StepRange { groups, joint, .. }| {
        let pass = Pass::dispatch("solar_visibility", Shader::plain("solar_visibility.comp"), workgroups(*groups));
        over_nodes(pass, *groups).of_joint(*joint)
    }));
}

/// One dispatch for each point of the Sun's disc adds its share to each node.
fn by_rays(frame: &mut Frame, ranges: &[StepRange], rays: &[SunRay], poses: &[DAffine3]) {
    for number in 0..SUN_RAYS {
        frame.wait([barrier(&VISIBILITY, COMPUTE_WRITE, if number == 0 { COMPUTE_WRITE } else { COMPUTE })]);
        let ray = rays.get(number).copied().unwrap_or_default();
        for StepRange { groups: (first, end), joint, .. } in ranges {
            let pose = layout::rows(&poses.get(*joint as usize).copied().unwrap_or(DAffine3::IDENTITY));
            frame.passes_of((*first..*end).step_by(TRACED_AT_ONCE as usize).map(|at| {
                let piece = (at, (*end).min(at.saturating_add(TRACED_AT_ONCE)));
                let shader = Shader::with("solar_rays.comp", &[(number == 0, "first")]);
                let pass = Pass::dispatch("solar_rays", shader, (piece.1 - piece.0).div_ceil(GROUPS_OF_RAYS));
                over_nodes(pass, piece).told(&ray).told(&pose)
            }));
        }
    }
}
