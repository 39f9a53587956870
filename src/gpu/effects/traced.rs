//! Reflections of the craft itself: rays from the surface of each texel against the triangles of the craft.

use super::image::resources::drawn_largest;
use super::image::sampling::RowOf;
use super::image::variant::RadianceVariant;
use crate::gpu::layout;
use crate::gpu::pass::{COMPUTE, COMPUTE_WRITE, Frame, Pass, barrier};
use crate::gpu::pipeline::SURFACE_FORMAT;
use crate::gpu::resource::Role::{Colour, FromHost, Storage};
use crate::gpu::resource::{Per, Resource, lent, resources};
use crate::gpu::scene_data::{SceneData, only};
use crate::gpu::shaders::Shader;

resources! {
    /// `Tracing` of the image, written by the host.
    TRACING =
        Resource::uniform::<layout::Tracing>("Tracing", |data| only(data.draws() && data.shown.variant.traced, 1));
    /// Boxes of the tree for reflections of the craft, written by the host where parts have moved.
    TRACE_BOXES = Resource::new("TraceBoxes", size_of::<layout::ShadowBox>(), FromHost, Per::Node, |data| {
            data.if_drawn(data.shown.traced_boxes)
        })
        .each_slot();
    /// Triangles of this tree, written by the host where parts have moved.
    TRACE_TRIANGLES =
        Resource::new("TraceTriangles", size_of::<layout::ShadowTriangle>(), FromHost, Per::Node, triangles)
            .each_slot();
    /// Nodes of the corners of these triangles, and the word in `TRACE_NODES` of the first of them.
    TRACE_CORNERS =
        Resource::new("TraceCorners", 16, Storage, Per::Node, triangles).filled(|data| lent(data.shown.traced));
    /// Material of each node times 4; plus 1 where its front sees nothing but the craft; plus 2 where its back does.
    TRACE_NODES = Resource::new("TraceNodes", 4, Storage, Per::Node, |data| data.if_drawn(data.shown.traced_nodes.len()))
            .filled(|data| lent(data.shown.traced_nodes));
    /// Paths of light that go on in the next dispatch, three vectors for each.
    PATHS = Resource::new("Paths", 48, Storage, Per::Pixel, |data| {
        only(data.shown.variant.dispatches > 1, data.texels().min(LIT_AT_ONCE as usize))
    });
    /// Normal times depth and node of every texel, if surfaces reflect the craft itself.
    SURFACE_IMAGE =
        Resource::image("SurfaceImage", 16, Colour(SURFACE_FORMAT), Per::Pixel, SURFACE_TEXELS, drawn_largest);
    /// Copy of `SURFACE_IMAGE` that shaders read.
    SURFACE = Resource::new("Surface", 16, Storage, Per::Pixel, SURFACE_TEXELS);
}

const SURFACE_TEXELS: fn(&SceneData<'_>) -> usize = |data| data.texels();

fn triangles(data: &SceneData<'_>) -> usize {
    data.if_drawn(data.shown.traced.len())
}

/// Most texels of a dispatch of rays. The watchdog of a desktop ends a dispatch after two seconds. With up to 8 rays a texel, a device needs to follow a
/// million rays a second to stay within.
const LIT_AT_ONCE: u32 = 1 << 18;
/// Texels of a workgroup of these rays.
const TEXELS_OF_RAYS: u32 = 64;

/// Adds what surfaces reflect of the craft itself to the radiance of `texels` texels in the buffer `lit`, which is
/// the mean over `several` samples or the radiance of single ones at a place in their texel. Surfaces have the temperatures in the buffer `shown`.
pub(crate) fn passes(
    frame: &mut Frame,
    (shows, shutter): (RadianceVariant, Option<RowOf>),
    place: [f32; 2],
    (lit, several): (&'static Resource, bool),
    texels: u32,
    shown: &'static Resource,
) {
    for first in (0..texels).step_by(LIT_AT_ONCE as usize) {
        let range = (first, texels.min(first.saturating_add(LIT_AT_ONCE)));
        for number in 0..shows.dispatches {
            if number > 0 {
                frame.wait([barrier(&PATHS, COMPUTE_WRITE, COMPUTE), barrier(lit, COMPUTE_WRITE, COMPUTE)]);
            } else if shows.dispatches > 1 {
                // The paths of earlier texels, or of the last image, may still be read.
                frame.wait([barrier(&PATHS, COMPUTE, COMPUTE_WRITE)]);
            }
            let words = [
                (shows.rough, "rough"),
                (shows.smooth, "smooth"),
                (shows.sun, "sun"),
                (shows.apart, "apart"),
                (shows.tables, "tables"),
                (shows.map, "map"),
                (several, "several"),
                (number + 1 < shows.dispatches, "held"),
                (number > 0, "resumed"),
            ];
            let mut shader = Shader::with("traced.comp", &words);
            // A path that goes on has left the row behind.
            shader.words.extend(shutter.filter(|_| number == 0).map(RowOf::words).unwrap_or_default());
            let workgroups = (range.1 - range.0).div_ceil(TEXELS_OF_RAYS);
            let pass = Pass::dispatch("traced", shader, workgroups);
            let pass = pass.over(Per::Texel, range).instead("Temperature", shown);
            frame.pass(pass.told(&[first, number]).told(&place));
        }
    }
}
