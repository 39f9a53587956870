//! A scene as plain numbers, what it needs on the device, and how that is filled.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::Vec3;

use super::context::Context;
use super::error::GpuError;
use super::frame::{StepRange, TRIANGLES_A_DRAW, TriangleRun};
use super::layout::{self, FUSED_STEPS};
use super::memory::Buffer;
use super::once::Once;
use super::resource::{Count, Pieces, Resource};
use super::shapes::Shapes;
use super::store::Resources;
use super::variant::{StepKind, ThermalVariant};
use crate::environment::albedo;
use crate::environment::shadow::{Jointed, Occluders, Redraw};
use crate::gpu::nodes::{GROUP, RANGE_GROUPS};

/// Nodes of one workgroup of the thermal step, which ranges are multiples of.
pub const NODES_PER_WORKGROUP: usize = GROUP * RANGE_GROUPS;

/// A scene as plain numbers for the device. Nodes come in groups of four that share material and part.
pub struct SceneData<'a> {
    /// Which pipeline moves which groups.
    pub ranges: Vec<StepRange>,
    /// Index into `materials`, one a group.
    pub group_material: &'a [u32],
    /// Part index, one a group.
    pub group_part: &'a [u32],
    /// Unit normals, one a node; zero for padding.
    pub normals: &'a [Vec3],
    /// Positions in the body frame [m], one a node.
    pub positions: &'a [Vec3],
    /// Node indices.
    pub triangles: &'a [[u32; 3]],
    /// Values of the materials.
    pub materials: &'a [layout::Material],
    /// Response functions that are no powers.
    pub shapes: &'a Shapes,
    /// ln(L e^x / T) with its guard values.
    pub band_table: &'a [f32],
    /// Width and height of the image; `None` where nothing is drawn.
    pub image: Option<[u32; 2]>,
    /// What casts shadows; `None` where the craft does not shadow itself.
    pub shadows: Option<ShadowData<'a>>,
    /// What moves; `None` where nothing does.
    pub joints: Option<JointData<'a>>,
}

/// Which triangles move together.
#[derive(Clone)]
pub struct JointData<'a> {
    /// The body and its joints.
    pub count: u32,
    /// Runs of the triangles; each begins at a multiple of 64.
    pub triangles: &'a [TriangleRun],
    /// Runs of the triangles that cast shadows.
    pub occluders: &'a [TriangleRun],
    /// What casts shadows, in the file's pose; only where rays find them.
    pub casters: Option<Jointed>,
}

/// What casts shadows, and how often they are found.
#[derive(Clone)]
pub struct ShadowData<'a> {
    /// Node indices of the triangles.
    pub occluders: &'a [[u32; 3]],
    /// The Sun's view and when it is drawn anew.
    pub redraw: Redraw,
    /// The tree of the triangles, where rays find the shadows.
    pub tree: Option<&'a Occluders>,
}

/// A buffer or image, and what it takes.
#[derive(Debug, Clone)]
pub struct Planned {
    /// What it is.
    pub resource: Resource,
    /// Bytes, of all slots together.
    pub bytes: u64,
}

impl SceneData<'_> {
    /// Whether many steps may pass in one dispatch: transitions that nothing but the load of a step commands.
    pub fn fuses(&self) -> bool {
        let kinds = || self.ranges.iter().map(|range| range.variant.kind);
        self.joints.is_none() && kinds().any(StepKind::has_state) && kinds().all(|kind| kind != StepKind::Absorb)
    }

    /// The triangles of the body and of each joint.
    pub fn runs(&self) -> Vec<TriangleRun> {
        let whole = TriangleRun { joint: 0, triangles: (0, self.triangles.len() as u32) };
        self.joints.as_ref().map_or_else(|| vec![whole], |joints| joints.triangles.to_vec())
    }

    /// Draws of all triangles, for where none is culled.
    fn whole_draws(&self) -> Vec<layout::DrawCommand> {
        let mut draws = Vec::new();
        for run in self.runs().into_iter().flat_map(TriangleRun::pieces) {
            let (first, end) = run.draws();
            draws.resize(first as usize, layout::DrawCommand::zeroed());
            let left = run.triangles.1 - run.triangles.0;
            draws.extend((0..end - first).map(|number| {
                let before = TRIANGLES_A_DRAW * number;
                layout::DrawCommand {
                    index_count: 3 * TRIANGLES_A_DRAW.min(left - before),
                    instance_count: 1,
                    first_index: 3 * (run.triangles.0 + before),
                    vertex_offset: 0,
                    first_instance: 0,
                }
            }));
        }
        draws
    }

    /// Everything that the scene needs on the device, with sizes, in the order of the table.
    pub fn plan(&self) -> Vec<Planned> {
        let planned = |resource: &Resource| {
            let row = resource.row();
            let joints = self.joints.as_ref().filter(|_| row.per_joint).map(|joints| joints.count as usize);
            let one = joints.map_or(row.element, |joints| joints * layout::SLICE);
            let bytes = (row.copies() * self.count(row.count) * one) as u64;
            (bytes > 0).then_some(Planned { resource: *resource, bytes })
        };
        Resource::ALL.iter().filter_map(planned).collect()
    }

    /// How many there are of what `count` counts; none of what no scene has.
    fn count(&self, count: Count) -> usize {
        let groups = self.normals.len() / GROUP;
        let only = |present: bool, number: usize| if present { number } else { 0 };
        let of_ranges = |has: fn(&ThermalVariant) -> bool| self.ranges.iter().any(|range| has(&range.variant));
        let tree = self.shadows.as_ref().and_then(|shadows| shadows.tree);
        let seen = self.shadows.as_ref().filter(|_| tree.is_none());
        let directions = only(of_ranges(|variant| variant.albedo), (albedo::RESOLUTION + 1).pow(2));
        let steps = only(self.fuses(), FUSED_STEPS);
        let drawn = self.image.is_some();
        match count {
            Count::Once => 1,
            Count::FusedSteps => steps,
            Count::Albedo => directions,
            Count::FusedAlbedo => steps * directions,
            Count::Materials => self.materials.len(),
            Count::Shapes => self.shapes.values.len(),
            Count::Groups => groups,
            Count::LoadedGroups => only(of_ranges(|variant| variant.sun || variant.planet_ir), groups),
            Count::MovingGroups => only(of_ranges(|variant| variant.kind.has_state()), groups),
            Count::PlacedGroups => only(drawn || self.shadows.is_some(), groups),
            Count::DrawnGroups => only(drawn, groups),
            Count::ShadowedGroups => only(self.shadows.is_some(), groups),
            Count::Triangles => only(drawn, self.triangles.len()),
            Count::Draws => only(drawn, self.runs().iter().map(|run| run.draws().1 as usize).max().unwrap_or(0)),
            Count::Band => self.band_table.len(),
            Count::SunView => only(seen.is_some(), 1),
            Count::Occluders => seen.map_or(0, |shadows| shadows.occluders.len()),
            Count::SunTexels => seen.map_or(0, |shadows| (shadows.redraw.resolution as usize).pow(2)),
            // As parts move the tree is built anew, with as many boxes.
            Count::Boxes => tree.map_or(0, |tree| tree.tree.nodes.len()),
            Count::Traced => tree.map_or(0, |tree| tree.triangles.len()),
            Count::Pixels => self.image.map_or(0, |[width, height]| width as usize * height as usize),
            _ => 0,
        }
    }
}

/// What a scene has to spare while its thermal network is stepped: the culled triangles, which are found again where an image
/// follows, and the temperatures, which come back from the network.
const SPARE: [Resource; 2] = [Resource::VisibleTriangles, Resource::Temperature];

/// Bytes of each buffer that the scene of a plan has to spare while its network is stepped.
pub fn spare_bytes(plan: &[Planned]) -> Vec<u64> {
    let of = |resource| plan.iter().find(|planned| planned.resource == resource).map(|planned| planned.bytes);
    SPARE.into_iter().filter_map(of).collect()
}

/// Bytes of a plan that follow the number of nodes, triangles included; what only the host reads is not counted.
pub fn device_bytes(plan: &[Planned]) -> u64 {
    plan.iter().filter(|planned| planned.resource.row().grows_with_nodes()).map(|planned| planned.bytes).sum()
}

/// Refuses a plan that the device cannot hold, before any of it is made; `beside` are the bytes of what is not in it.
///
/// # Errors
/// More bytes than the device has, or an image larger than it draws.
pub fn check_plan(context: &Context, plan: &[Planned], beside: u64, image: Option<[u32; 2]>) -> Result<(), GpuError> {
    let info = &context.info;
    let needed = plan.iter().map(|planned| planned.bytes).sum::<u64>() + beside;
    let available = context.free_memory();
    if needed > available {
        let of_images = plan.iter().filter(|planned| planned.resource.row().count == Count::Pixels);
        let images = of_images.map(|planned| planned.bytes).sum();
        return Err(GpuError::OutOfMemory { needed, images, device: info.name.clone(), available });
    }
    match image {
        Some([width, height]) if width.max(height) > info.max_framebuffer_side => {
            Err(GpuError::ImageTooLarge { width, height, device: info.name.clone(), limit: info.max_framebuffer_side })
        }
        _ => Ok(()),
    }
}

impl Resources {
    /// Makes and fills everything that a scene needs.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn of_scene(context: &Arc<Context>, once: &mut Once, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let plan = data.plan();
        check_plan(context, &plan, 0, data.image)?;
        let mut resources = Self::new(context);
        for Planned { resource, bytes } in plan {
            let row = resource.row();
            if row.role.is_image() {
                let size = match &data.shadows {
                    Some(shadows) if row.count == Count::SunTexels => [shadows.redraw.resolution; 2],
                    _ => data.image.expect("images are planned where something is drawn"),
                };
                resources.make_image(resource, size)?;
                continue;
            }
            let in_pieces = match row.pieces {
                Pieces::Never => false,
                Pieces::WithoutImage => data.image.is_none(),
                Pieces::Always => true,
            };
            for slot in 0..row.copies() {
                resources.make_in(resource, slot, bytes / row.copies() as u64, in_pieces)?;
            }
        }
        resources.fill(once, data)?;
        Ok(resources)
    }

    fn fill(&mut self, once: &mut Once, data: &SceneData<'_>) -> Result<(), GpuError> {
        let component = |values: &[Vec3], axis: usize| values.iter().map(|value| value[axis]).collect::<Vec<f32>>();
        self.upload(once, Resource::Materials, data.materials)?;
        self.upload(once, Resource::Shapes, &data.shapes.values)?;
        self.upload(once, Resource::GroupMaterial, data.group_material)?;
        self.upload(once, Resource::GroupPart, data.group_part)?;
        self.upload(once, Resource::Triangles, data.triangles)?;
        self.upload(once, Resource::Draws, &data.whole_draws())?;
        if let Some(shadows) = &data.shadows {
            self.upload(once, Resource::Occluders, shadows.occluders)?;
            if let Some(tree) = shadows.tree {
                self.upload_tree(once, tree)?;
            }
        }
        self.upload(once, Resource::BandTable, data.band_table)?;
        for (axis, resource) in [Resource::NormalX, Resource::NormalY, Resource::NormalZ].into_iter().enumerate() {
            self.upload(once, resource, &component(data.normals, axis))?;
        }
        for (axis, resource) in [Resource::PositionX, Resource::PositionY, Resource::PositionZ].into_iter().enumerate()
        {
            self.upload(once, resource, &component(data.positions, axis))?;
        }
        self.free_staging();
        Ok(())
    }

    /// Replaces the tree that rays are tried against.
    pub(super) fn upload_tree(&mut self, once: &mut Once, tree: &Occluders) -> Result<(), GpuError> {
        let (boxes, triangles) = layout::shadow_tree(tree);
        self.upload(once, Resource::ShadowTree, &boxes)?;
        self.upload(once, Resource::ShadowTriangles, &triangles)
    }

    /// The buffers that the scene has to spare while its network is stepped.
    pub(super) fn spare(&self) -> Vec<Arc<Buffer>> {
        SPARE.into_iter().filter_map(|resource| self.get(resource).map(|region| Arc::clone(&region.buffer))).collect()
    }
}
