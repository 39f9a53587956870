//! Pipelines and descriptor sets of the passes in a frame list.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::context::Context;
use super::error::{During as _, GpuError};
use super::layout::{ExchangePass, HeatPass, HeaterStep, NetworkStage, NetworkStep, SLICE, SunRay};
use super::pass::{Access, Kernel, Pass, Target, Work};
use super::pipeline::Pipeline;
use super::resource::Resource;
use super::store::Resources;

/// Key of a descriptor set: its kernel, its number (the joint for a draw, `Work::Dispatch::set` otherwise) and its
/// slot.
type SetKey = (Kernel, u32, usize);

/// Pipelines and descriptor sets, made from the accesses of the passes.
pub(super) struct Bindings {
    context: Arc<Context>,
    pipelines: BTreeMap<Kernel, Pipeline>,
    sets: BTreeMap<SetKey, vk::DescriptorSet>,
    pools: Vec<vk::DescriptorPool>,
    /// Number of joints, counting the body.
    joints: u32,
    slots: usize,
}

impl Bindings {
    /// An empty collection for lists with `joints` joints and `slots` frames in flight.
    pub fn new(context: &Arc<Context>, joints: u32, slots: usize) -> Self {
        let (context, pools) = (Arc::clone(context), Vec::new());
        Self { context, pipelines: BTreeMap::new(), sets: BTreeMap::new(), pools, joints, slots }
    }

    /// An empty collection for lists with one joint and one slot.
    pub fn plain(context: &Arc<Context>) -> Self {
        Self::new(context, 1, 1)
    }

    /// Makes the pipelines and descriptor sets that the passes need and that do not exist yet.
    pub fn add<'p>(
        &mut self,
        resources: &Resources,
        passes: impl IntoIterator<Item = &'p Pass>,
    ) -> Result<(), GpuError> {
        let mut wanted: BTreeMap<SetKey, &Pass> = BTreeMap::new();
        for pass in passes {
            let Some((kernel, set)) = key_of(pass) else { continue };
            let sets = if kernel.draws() { 0..self.joints } else { set..set + 1 };
            for set in sets.filter(|set| !self.sets.contains_key(&(kernel, *set, 0))) {
                wanted.extend((0..self.slots).map(|slot| ((kernel, set, slot), pass)));
            }
        }
        if wanted.is_empty() {
            return Ok(());
        }
        let count = |kind| wanted.values().flat_map(|pass| binding_types(pass)).filter(|(_, of)| *of == kind).count();
        let sizes = [vk::DescriptorType::UNIFORM_BUFFER, vk::DescriptorType::STORAGE_BUFFER]
            .map(|kind| vk::DescriptorPoolSize { ty: kind, descriptor_count: (count(kind) as u32).max(1) });
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(wanted.len() as u32).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let pool = unsafe { self.context.device.create_descriptor_pool(&create, None) };
        let pool = pool.during("creating a descriptor pool")?;
        self.pools.push(pool);
        for ((kernel, number, slot), pass) in wanted {
            let types = binding_types(pass);
            if !self.pipelines.contains_key(&kernel) {
                self.pipelines.insert(kernel, pipeline(&self.context, kernel, &types)?);
                if let Some(sky) = kernel.sky() {
                    self.pipelines.insert(sky, pipeline(&self.context, sky, &types)?);
                }
            }
            let layouts = [self.pipelines[&kernel].set_layout];
            let allocate = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
            // SAFETY: the pool was made for this number of sets.
            let set = unsafe { self.context.device.allocate_descriptor_sets(&allocate) };
            let set = set.during("allocating a descriptor set")?[0];
            let joint = kernel.draws().then_some(number);
            for access in &pass.accesses {
                self.point(resources, set, access, slot, joint);
            }
            self.sets.insert((kernel, number, slot), set);
        }
        Ok(())
    }

    /// Points a binding to a buffer. An access that is limited to a range gets only that range, so two ranges of one
    /// buffer never overlap. A resource with a slice for each joint gets the slice of the drawn joint, or else of the
    /// access.
    fn point(
        &self,
        resources: &Resources,
        set: vk::DescriptorSet,
        access: &Access,
        slot: usize,
        drawn_joint: Option<u32>,
    ) {
        let Access { resource, groups, slice, binding: Some(binding), .. } = *access else { return };
        let (row, region) = (resource.row(), resources.region(resource, slot));
        let (offset, range) = match groups {
            None if self.joints > 1 && row.per_joint => {
                (u64::from(drawn_joint.unwrap_or(slice)) * SLICE as u64, SLICE as u64)
            }
            Some((first, end)) => (u64::from(first) * row.element as u64, u64::from(end - first) * row.element as u64),
            None => (0, region.bytes),
        };
        let infos = [vk::DescriptorBufferInfo { buffer: region.buffer.raw, offset: region.offset + offset, range }];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(binding)
            .descriptor_type(row.role.descriptor())
            .buffer_info(&infos)];
        // SAFETY: the set and the buffer are alive, and no recorded command uses the set yet.
        unsafe { self.context.device.update_descriptor_sets(&write, &[]) };
    }

    /// Pipeline and descriptor set of a pass. A draw has one set for each `joint`. A copy or fill has none.
    pub fn of(&self, pass: &Pass, joint: u32, slot: usize) -> Option<(&Pipeline, vk::DescriptorSet)> {
        let (kernel, set) = key_of(pass)?;
        let set = if kernel.draws() { joint } else { set };
        Some((&self.pipelines[&kernel], self.sets[&(kernel, set, slot)]))
    }
}

impl Bindings {
    /// Pipeline of the sky behind the craft, where the image has one. It uses the descriptor set of the craft.
    pub fn background(&self, pass: &Pass) -> Option<&Pipeline> {
        self.pipelines.get(&pass.kernel()?.sky()?)
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        for pool in &self.pools {
            // SAFETY: the owner waits for the device before it drops its bindings.
            unsafe { self.context.device.destroy_descriptor_pool(*pool, None) };
        }
    }
}

fn key_of(pass: &Pass) -> Option<(Kernel, u32)> {
    match pass.work {
        Work::Dispatch { kernel, set, .. } => Some((kernel, set)),
        Work::Draw(kernel) => Some((kernel, 0)),
        Work::Copy { .. } | Work::Fill(..) => None,
    }
}

/// Number and type of each binding of a pass, in order of number.
fn binding_types(pass: &Pass) -> Vec<(u32, vk::DescriptorType)> {
    let descriptor = |resource: Resource| resource.row().role.descriptor();
    let bound = |access: &Access| access.binding.map(|number| (number, descriptor(access.resource)));
    let mut types: Vec<_> = pass.accesses.iter().filter_map(bound).collect();
    types.sort_unstable();
    types.dedup();
    types
}

/// Makes the pipeline of a kernel.
fn pipeline(context: &Arc<Context>, kernel: Kernel, types: &[(u32, vk::DescriptorType)]) -> Result<Pipeline, GpuError> {
    let constants = match kernel {
        Kernel::OnePass(_) => size_of::<NetworkStep>(),
        Kernel::Stage(_) => size_of::<NetworkStage>(),
        Kernel::Exchange(_) => size_of::<ExchangePass>(),
        Kernel::Heat(_) => size_of::<HeatPass>(),
        Kernel::Heaters => size_of::<HeaterStep>(),
        Kernel::Cull | Kernel::CullSamples { .. } | Kernel::Traced { .. } => size_of::<u32>(),
        Kernel::Between => size_of::<f32>(),
        Kernel::SunRay { .. } => size_of::<SunRay>() + size_of::<[[f32; 4]; 3]>(),
        _ => 0,
    };
    if let Some(target) = kernel.target() {
        return Pipeline::radiance(context, &kernel.shaders(), types, target);
    }
    match kernel {
        Kernel::Background { shows, each } => {
            let target = Target { mean: each, surfaces: shows.traced };
            Pipeline::background(context, &kernel.shaders(), types, target)
        }
        Kernel::SunDepth => Pipeline::solar_depth(context, types),
        _ => Pipeline::compute(context, &kernel.shaders()[0], types, constants as u32),
    }
}
