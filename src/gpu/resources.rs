//! The buffers and images of a scene: planned with their sizes, checked against the device, then made and filled.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use gpu_allocator::MemoryLocation;

use super::context::Context;
use super::error::GpuError;
use super::frame::{StepRange, TRIANGLES_A_DRAW, TriangleRun};
use super::layout;
use super::load::FUSED_TICKS;
use super::memory::{Buffer, Image};
use super::once::Once;
use super::pass::Resource;
use super::pipeline::{DEPTH_FORMAT, IDENTITY_FORMAT, RADIANCE_FORMAT};
use super::shapes::Shapes;
use super::variant::StepKind;
use crate::environment::shadow::{Jointed, Occluders, Redraw};
use crate::environment::{MAX_SUN_SAMPLES, albedo};
use crate::gpu::nodes::{GROUP, RANGE_GROUPS};

/// Frames in flight: the device works on one while the host reads the other.
pub const SLOTS: usize = 2;

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

/// A buffer or image that a scene needs.
#[derive(Debug, Clone)]
pub struct Planned {
    /// What it is.
    pub resource: Resource,
    /// Bytes, of all slots together.
    pub bytes: u64,
    usage: vk::BufferUsageFlags,
    location: MemoryLocation,
}

impl SceneData<'_> {
    /// Whether many ticks may pass in one dispatch: transitions that nothing but the load of a tick commands.
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

    /// Everything that the scene needs on the device, with sizes.
    pub fn plan(&self) -> Vec<Planned> {
        use vk::BufferUsageFlags as U;
        let floats = |count: usize| 4 * count as u64;
        let nodes = self.normals.len();
        let triangles = if self.image.is_some() { self.triangles.len() } else { 0 };
        let draws =
            if self.image.is_some() { self.runs().iter().map(|run| run.draws().1).max().unwrap_or(0) } else { 0 };
        let drawn = if self.image.is_some() { nodes } else { 0 };
        let placed = if self.image.is_some() || self.shadows.is_some() { nodes } else { 0 };
        let occluders = self.shadows.as_ref().map_or(0, |shadows| shadows.occluders.len());
        let shadowed = if self.shadows.is_some() { nodes } else { 0 };
        let tree = self.shadows.as_ref().and_then(|shadows| shadows.tree);
        let drawn_occluders = if tree.is_none() { occluders } else { 0 };
        let texels = match &self.shadows {
            Some(shadows) if tree.is_none() => (shadows.redraw.resolution as usize).pow(2),
            _ => 0,
        };
        // As parts move the tree is built anew, with as many boxes.
        let boxes = tree.map_or(0, |tree| tree.tree.nodes.len() * size_of::<layout::ShadowBox>());
        let traced = tree.map_or(0, |tree| tree.triangles.len() * size_of::<layout::ShadowTriangle>());
        let moved = self.ranges.iter().any(|range| range.variant.kind.has_state());
        let loaded = self.ranges.iter().any(|range| range.variant.sun || range.variant.planet_ir);
        let albedo_values =
            if self.ranges.iter().any(|range| range.variant.albedo) { (albedo::RESOLUTION + 1).pow(2) } else { 0 };
        let fused = if self.fuses() { FUSED_TICKS as u64 } else { 0 };
        let state = if moved { nodes } else { 0 };
        let normals = if loaded { nodes } else { 0 };
        let pixels = self.image.map_or(0, |[width, height]| u64::from(width) * u64::from(height));

        let of_joints = |bytes: u64| match &self.joints {
            Some(joints) => u64::from(joints.count) * layout::SLICE as u64,
            None => bytes,
        };
        let device = |resource, bytes, usage| Planned { resource, bytes, usage, location: MemoryLocation::GpuOnly };
        let storage = |resource, bytes| device(resource, bytes, U::STORAGE_BUFFER | U::TRANSFER_DST | U::TRANSFER_SRC);
        let to_device = |resource: Resource, bytes| Planned {
            resource,
            bytes: SLOTS as u64 * if resource.per_joint() && bytes > 0 { of_joints(bytes) } else { bytes },
            usage: if resource.is_uniform() { U::UNIFORM_BUFFER } else { U::STORAGE_BUFFER },
            location: MemoryLocation::CpuToGpu,
        };
        let to_host = |resource, bytes| Planned {
            resource,
            bytes: bytes * SLOTS as u64,
            usage: U::TRANSFER_DST,
            location: MemoryLocation::GpuToCpu,
        };
        let image = |resource, bytes| device(resource, bytes, U::empty());
        let plan = vec![
            to_device(Resource::Tick, size_of::<layout::Tick>() as u64),
            to_device(Resource::SunSamples, floats(4 * MAX_SUN_SAMPLES)),
            to_device(Resource::AlbedoValues, floats(albedo_values)),
            to_device(Resource::FusedTicks, fused * size_of::<layout::Tick>() as u64),
            to_device(Resource::FusedSunSamples, fused * floats(4 * MAX_SUN_SAMPLES)),
            to_device(Resource::FusedAlbedoValues, fused * floats(albedo_values)),
            to_device(Resource::View, size_of::<layout::View>() as u64),
            storage(Resource::Materials, size_of_val(self.materials) as u64),
            storage(Resource::Shapes, size_of_val(self.shapes.values.as_slice()) as u64),
            storage(Resource::GroupMaterial, floats(nodes / 4)),
            storage(Resource::GroupPart, floats(drawn / 4)),
            storage(Resource::NormalX, floats(normals)),
            storage(Resource::NormalY, floats(normals)),
            storage(Resource::NormalZ, floats(normals)),
            storage(Resource::PositionX, floats(placed)),
            storage(Resource::PositionY, floats(placed)),
            storage(Resource::PositionZ, floats(placed)),
            storage(Resource::Triangles, floats(3 * triangles)),
            device(
                Resource::VisibleTriangles,
                floats(3 * triangles),
                U::INDEX_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            ),
            device(
                Resource::Draws,
                size_of::<layout::DrawCommand>() as u64 * u64::from(draws),
                U::INDIRECT_BUFFER | U::STORAGE_BUFFER | U::TRANSFER_DST,
            ),
            storage(Resource::BandTable, floats(self.band_table.len())),
            storage(Resource::Target, floats(state)),
            storage(Resource::Span, floats(state)),
            storage(Resource::Elapsed, floats(state)),
            storage(Resource::Temperature, floats(nodes)),
            to_device(Resource::SunView, if texels > 0 { size_of::<layout::SunView>() as u64 } else { 0 }),
            device(Resource::Occluders, floats(3 * drawn_occluders), U::INDEX_BUFFER | U::TRANSFER_DST),
            image(Resource::SunDepthImage, floats(texels)),
            storage(Resource::SunDepth, floats(texels)),
            storage(Resource::ShadowTree, boxes as u64),
            storage(Resource::ShadowTriangles, traced as u64),
            storage(Resource::Visibility, floats(shadowed)),
            image(Resource::RadianceImage, 16 * pixels),
            image(Resource::IdentityImage, 8 * pixels),
            image(Resource::DepthImage, 4 * pixels),
            to_host(Resource::RadianceReadback, 16 * pixels),
            to_host(Resource::IdentityReadback, 8 * pixels),
            to_host(Resource::TemperatureReadback, floats(nodes)),
        ];
        plan.into_iter().filter(|planned| planned.bytes > 0).collect()
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
    plan.iter().filter(|planned| planned.resource.grows_with_nodes()).map(|planned| planned.bytes).sum()
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
        let of_images = plan.iter().filter(|planned| planned.resource.grows_with_pixels());
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

/// The buffers and images of a scene, one or one a slot.
pub struct Resources {
    buffers: BTreeMap<(Resource, usize), Arc<Buffer>>,
    images: BTreeMap<Resource, Image>,
}

impl Resources {
    /// Makes and fills everything.
    ///
    /// # Errors
    /// A scene beyond the device, or a call that fails.
    pub fn new(context: &Arc<Context>, once: &mut Once, data: &SceneData<'_>) -> Result<Self, GpuError> {
        let plan = data.plan();
        check_plan(context, &plan, 0, data.image)?;
        let mut resources = Self { buffers: BTreeMap::new(), images: BTreeMap::new() };
        for planned in &plan {
            let name = format!("{:?}", planned.resource);
            if planned.resource.is_image() {
                let size = match &data.shadows {
                    Some(shadows) if planned.resource == Resource::SunDepthImage => [shadows.redraw.resolution; 2],
                    _ => data.image.expect("images are planned where something is drawn"),
                };
                let (format, usage) = match planned.resource {
                    Resource::RadianceImage => (RADIANCE_FORMAT, vk::ImageUsageFlags::COLOR_ATTACHMENT),
                    Resource::IdentityImage => (IDENTITY_FORMAT, vk::ImageUsageFlags::COLOR_ATTACHMENT),
                    _ => (DEPTH_FORMAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
                };
                let usage = usage | vk::ImageUsageFlags::TRANSFER_SRC;
                resources.images.insert(planned.resource, Image::new(context, &name, size, format, usage)?);
                continue;
            }
            let slots = if planned.resource.per_slot() { SLOTS } else { 1 };
            for slot in 0..slots {
                let bytes = planned.bytes / slots as u64;
                let make = if planned.resource.is_bound_in_pieces(data.image.is_some()) {
                    Buffer::bound_in_pieces
                } else {
                    Buffer::new
                };
                let buffer = make(context, &name, bytes, planned.usage, planned.location)?;
                resources.buffers.insert((planned.resource, slot), Arc::new(buffer));
            }
        }
        resources.fill(once, data)?;
        Ok(resources)
    }

    fn fill(&self, once: &mut Once, data: &SceneData<'_>) -> Result<(), GpuError> {
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
        Ok(())
    }

    /// Replaces the tree that rays are tried against.
    pub fn upload_tree(&self, once: &mut Once, tree: &Occluders) -> Result<(), GpuError> {
        let (boxes, triangles) = layout::shadow_tree(tree);
        self.upload(once, Resource::ShadowTree, &boxes)?;
        self.upload(once, Resource::ShadowTriangles, &triangles)
    }

    /// Fills a device buffer from the host, and waits for it; nothing where the scene has no such buffer.
    pub fn upload<T: Pod>(&self, once: &mut Once, resource: Resource, values: &[T]) -> Result<(), GpuError> {
        match self.buffers.get(&(resource, 0)) {
            Some(buffer) => once.upload(buffer, bytemuck::cast_slice(values)),
            None => Ok(()),
        }
    }

    /// Bytes of the buffers that follow the number of nodes; what only the host reads is not counted.
    pub(super) fn device_bytes(&self) -> u64 {
        self.buffers.iter().filter(|((resource, _), _)| resource.grows_with_nodes()).map(|(_, one)| one.bytes).sum()
    }

    /// The buffers that the scene has to spare while its network is stepped.
    pub(super) fn spare(&self) -> Vec<Arc<Buffer>> {
        SPARE.into_iter().filter_map(|resource| self.buffers.get(&(resource, 0)).map(Arc::clone)).collect()
    }

    /// The buffer of a resource, in the slot where it has one each.
    pub(super) fn buffer(&self, resource: Resource, slot: usize) -> &Buffer {
        &self.buffers[&(resource, if resource.per_slot() { slot } else { 0 })]
    }

    /// Writes a buffer that the host fills each tick; nothing where the scene has no such buffer.
    pub(super) fn write<T: Pod>(&mut self, resource: Resource, slot: usize, values: &[T]) {
        if let Some(buffer) = self.buffers.get_mut(&(resource, slot)).and_then(Arc::get_mut) {
            buffer.write(values);
        }
    }

    /// Writes the slices of a buffer that every joint has one of.
    pub(super) fn write_slices<T: Pod>(&mut self, resource: Resource, slot: usize, slices: &[T]) {
        if let [one] = slices {
            return self.write(resource, slot, &[*one]);
        }
        let mut bytes = vec![0u8; slices.len() * layout::SLICE];
        for (slice, value) in bytes.chunks_mut(layout::SLICE).zip(slices) {
            slice[..size_of::<T>()].copy_from_slice(bytemuck::bytes_of(value));
        }
        self.write(resource, slot, &bytes);
    }

    /// An image.
    pub(super) fn image(&self, resource: Resource) -> &Image {
        &self.images[&resource]
    }
}
