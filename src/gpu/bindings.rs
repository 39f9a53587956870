//! The pipelines of a scene and their descriptor sets: each binding points to what the frame list says it touches.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::compile::compile_own;
use super::context::Context;
use super::error::{Context as _, GpuError};
use super::frame::Frame;
use super::layout::{DrawCommand, SLICE, SunRay};
use super::pass::{Access, Pass, Resource, Work};
use super::pipeline::{Pipeline, module};
use super::resources::{Resources, SLOTS};
use super::variant::{Curve, ThermalVariant};

/// What selects a pipeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum PipelineKey {
    Thermal(ThermalVariant),
    Cull,
    Radiance,
    SunDepth,
    Visibility,
    /// Whether it is the first.
    SunRay(bool),
}

impl PipelineKey {
    /// Whether its pass draws the triangles of all joints, one after the other.
    fn draws(self) -> bool {
        matches!(self, Self::Radiance | Self::SunDepth)
    }
}

/// What selects a descriptor set: the pipeline, the first group of its range or the joint that is drawn, the slot.
type SetKey = (PipelineKey, u32, usize);

/// All pipelines and descriptor sets that the frames of a scene bind.
pub(super) struct Bindings {
    context: Arc<Context>,
    pipelines: BTreeMap<PipelineKey, Pipeline>,
    sets: BTreeMap<SetKey, vk::DescriptorSet>,
    pool: vk::DescriptorPool,
}

impl Bindings {
    /// Makes what the passes of `frames` need; the shaders of shaped transitions are compiled here.
    pub fn new(
        context: &Arc<Context>,
        resources: &Resources,
        frames: &[&Frame],
        joints: u32,
    ) -> Result<Self, GpuError> {
        let mut passes: BTreeMap<(PipelineKey, u32), &Pass> = BTreeMap::new();
        for pass in frames.iter().flat_map(|frame| frame.passes()) {
            if let Some((key, first)) = key_of(pass) {
                let drawn = if key.draws() { 0..joints } else { first..first + 1 };
                passes.extend(drawn.map(|first| ((key, first), pass)));
            }
        }
        let sets = (passes.len() * SLOTS) as u32;
        let count = |kind| passes.values().flat_map(|pass| binding_types(pass)).filter(|(_, of)| *of == kind).count();
        let sizes = [vk::DescriptorType::UNIFORM_BUFFER, vk::DescriptorType::STORAGE_BUFFER]
            .map(|kind| vk::DescriptorPoolSize { ty: kind, descriptor_count: ((count(kind) * SLOTS) as u32).max(1) });
        let mut bindings = Self {
            context: Arc::clone(context),
            pipelines: BTreeMap::new(),
            sets: BTreeMap::new(),
            pool: vk::DescriptorPool::null(),
        };
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(sets.max(1)).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        bindings.pool =
            unsafe { context.device.create_descriptor_pool(&create, None) }.during("creating a descriptor pool")?;
        for ((key, first_group), pass) in passes {
            let types = binding_types(pass);
            if let std::collections::btree_map::Entry::Vacant(vacant) = bindings.pipelines.entry(key) {
                vacant.insert(match key {
                    PipelineKey::Thermal(variant) => {
                        let name = variant.name();
                        let words = match variant.curve {
                            Curve::Power => module(&name),
                            Curve::Shaped { .. } => compile_own(&name, "thermal_step.comp", &variant.defines())?,
                        };
                        Pipeline::compute(context, &name, &words, &types)?
                    }
                    PipelineKey::Cull => {
                        let constants = size_of::<u32>() as u32;
                        Pipeline::compute_with_constants(context, "cull.comp", &module("cull.comp"), &types, constants)?
                    }
                    PipelineKey::Radiance => Pipeline::radiance(context, &types)?,
                    PipelineKey::SunDepth => Pipeline::solar_depth(context, &types)?,
                    PipelineKey::SunRay(first) => {
                        let name = if first { "solar_rays.first" } else { "solar_rays.next" };
                        let constants = (size_of::<SunRay>() + size_of::<[[f32; 4]; 3]>()) as u32;
                        Pipeline::compute_with_constants(context, name, &module(name), &types, constants)?
                    }
                    PipelineKey::Visibility => {
                        Pipeline::compute(context, "solar_visibility.comp", &module("solar_visibility.comp"), &types)?
                    }
                });
            }
            let layout = bindings.pipelines[&key].set_layout;
            for slot in 0..SLOTS {
                let set = allocate_set(context, bindings.pool, layout)?;
                let joint = key.draws().then_some(first_group);
                write_set(context, resources, set, pass, slot, joint.filter(|_| joints > 1), joints > 1);
                bindings.sets.insert((key, first_group, slot), set);
            }
        }
        Ok(bindings)
    }

    /// Pipeline and descriptor set of a pass; of one that draws, for the triangles of a joint. `None` for copies.
    pub fn of(&self, pass: &Pass, joint: u32, slot: usize) -> Option<(&Pipeline, vk::DescriptorSet)> {
        let (key, first_group) = key_of(pass)?;
        let first = if key.draws() { joint } else { first_group };
        Some((&self.pipelines[&key], self.sets[&(key, first, slot)]))
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        // SAFETY: the renderer waits for the device before it drops its bindings.
        unsafe { self.context.device.destroy_descriptor_pool(self.pool, None) };
    }
}

fn key_of(pass: &Pass) -> Option<(PipelineKey, u32)> {
    match pass.work {
        Work::Thermal { variant, groups } => Some((PipelineKey::Thermal(variant), groups.0)),
        Work::Cull { triangles } => Some((PipelineKey::Cull, triangles.0)),
        Work::Radiance => Some((PipelineKey::Radiance, 0)),
        Work::SunDepth => Some((PipelineKey::SunDepth, 0)),
        Work::SunRay { ray, groups, .. } => Some((PipelineKey::SunRay(ray == 0), groups.0)),
        Work::Visibility { groups } => Some((PipelineKey::Visibility, groups.0)),
        Work::Copy { .. } | Work::Clear(_) | Work::Network(_) => None,
    }
}

/// Number and type of each binding of a pass.
fn binding_types(pass: &Pass) -> Vec<(u32, vk::DescriptorType)> {
    let mut types: Vec<_> = pass
        .accesses
        .iter()
        .filter_map(|access| access.binding.map(|number| (number, descriptor_type(access.resource))))
        .collect();
    types.sort_unstable();
    types.dedup();
    types
}

fn descriptor_type(resource: Resource) -> vk::DescriptorType {
    if resource.is_uniform() { vk::DescriptorType::UNIFORM_BUFFER } else { vk::DescriptorType::STORAGE_BUFFER }
}

/// One descriptor set of the given layout.
pub(super) fn allocate_set(
    context: &Context,
    pool: vk::DescriptorPool,
    layout: vk::DescriptorSetLayout,
) -> Result<vk::DescriptorSet, GpuError> {
    let layouts = [layout];
    let allocate = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
    // SAFETY: the pool was made for as many sets as are asked for.
    let sets = unsafe { context.device.allocate_descriptor_sets(&allocate) }.during("allocating a descriptor set")?;
    Ok(sets[0])
}

/// Points every binding to its buffer, or to the part of it that the range works on: two ranges of one buffer then
/// never overlap, for the device as for the validation layer. Of what is `sliced` it is the slice of the joint that is
/// drawn, or of the pass.
fn write_set(
    context: &Context,
    resources: &Resources,
    set: vk::DescriptorSet,
    pass: &Pass,
    slot: usize,
    drawn_joint: Option<u32>,
    sliced: bool,
) {
    for access in &pass.accesses {
        let Access { resource, groups, slice, binding: Some(binding), .. } = *access else { continue };
        let buffer = resources.buffer(resource, slot);
        let info = match groups {
            None if sliced && resource.per_joint() => vk::DescriptorBufferInfo {
                buffer: buffer.raw,
                offset: u64::from(drawn_joint.unwrap_or(slice)) * SLICE as u64,
                range: SLICE as u64,
            },
            // Group tables have four bytes a group, node arrays sixteen; a triangle has three indices, a draw five numbers.
            Some((first, end)) => {
                let bytes_a_group = match resource {
                    Resource::GroupMaterial => 4,
                    Resource::Triangles | Resource::VisibleTriangles => 12,
                    Resource::Draws => size_of::<DrawCommand>() as u64,
                    _ => 16,
                };
                vk::DescriptorBufferInfo {
                    buffer: buffer.raw,
                    offset: u64::from(first) * bytes_a_group,
                    range: u64::from(end - first) * bytes_a_group,
                }
            }
            None => vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE },
        };
        let infos = [info];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(binding)
            .descriptor_type(descriptor_type(resource))
            .buffer_info(&infos)];
        // SAFETY: set and buffer are alive, and no command that uses the set has been recorded yet.
        unsafe { context.device.update_descriptor_sets(&write, &[]) };
    }
}
