//! Pipelines and descriptor sets of the passes in a frame list.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;

use super::context::Context;
use super::error::{During as _, GpuError};
use super::kept_pipelines::Pipeline;
use super::pass::{Access, Pass, PassReach, PassWork};
use super::shaders::Shader;
use super::store::Resources;

/// Pipelines of the passes with the same shaders, and their descriptor sets.
struct ShaderProgram {
    pipeline: Pipeline,
    /// Draws what stands behind, with the same descriptor sets.
    behind: Option<Pipeline>,
    /// A set for each slot, by the parts of buffers. A draw has one for each joint.
    sets: BTreeMap<PassReach, Vec<vk::DescriptorSet>>,
}

/// Pipelines and descriptor sets, made from the accesses of the passes.
pub(super) struct Bindings {
    context: Arc<Context>,
    programs: BTreeMap<Vec<Shader>, ShaderProgram>,
    pools: Vec<vk::DescriptorPool>,
    /// Number of joints, counting the body.
    joints: u32,
    slots: usize,
}

impl Bindings {
    /// An empty collection for lists with `joints` joints and `slots` frames in flight.
    pub(crate) fn new(context: &Arc<Context>, joints: u32, slots: usize) -> Self {
        let (context, pools) = (Arc::clone(context), Vec::new());
        Self { context, programs: BTreeMap::new(), pools, joints, slots }
    }

    /// An empty collection for lists with one joint and one slot.
    pub(crate) fn plain(context: &Arc<Context>) -> Self {
        Self::new(context, 1, 1)
    }

    /// Makes the pipelines and descriptor sets that the passes need and that do not exist yet.
    pub(crate) fn add<'p>(
        &mut self,
        resources: &Resources,
        passes: impl IntoIterator<Item = &'p Pass>,
    ) -> Result<(), GpuError> {
        let mut wanted: BTreeMap<(Vec<Shader>, PassReach), &Pass> = BTreeMap::new();
        for pass in passes {
            let program = self.program(pass);
            let joints = if matches!(pass.work, PassWork::Draw(_)) { 0..self.joints } else { 0..1 };
            for reach in joints.map(|joint| reach_of(pass, joint)) {
                if !program.is_some_and(|program| program.sets.contains_key(&*reach)) && !pass.shaders().is_empty() {
                    wanted.insert((program_of(pass).into_owned(), reach.into_owned()), pass);
                }
            }
        }
        if wanted.is_empty() {
            return Ok(());
        }
        let accesses: Vec<Vec<Access>> = wanted.values().map(|pass| pass.accesses()).collect::<Result<_, _>>()?;
        let types: Vec<Vec<(u32, vk::DescriptorType)>> = accesses.iter().map(|all| binding_types(all)).collect();
        let count = |kind| self.slots * types.iter().flatten().filter(|(_, of)| *of == kind).count();
        let sizes = [vk::DescriptorType::UNIFORM_BUFFER, vk::DescriptorType::STORAGE_BUFFER]
            .map(|kind| vk::DescriptorPoolSize { ty: kind, descriptor_count: (count(kind) as u32).max(1) });
        let sets = (self.slots * wanted.len()) as u32;
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(sets).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let pool = unsafe { self.context.device.create_descriptor_pool(&create, None) };
        let pool = pool.during("creating a descriptor pool")?;
        self.pools.push(pool);
        for (((shaders, reach), pass), (accesses, types)) in wanted.into_iter().zip(accesses.iter().zip(&types)) {
            if !self.programs.contains_key(&shaders) {
                let Some(program) = ShaderProgram::new(&self.context, pass, types)? else { continue };
                self.programs.insert(shaders.clone(), program);
            }
            let joint = matches!(pass.work, PassWork::Draw(_)).then_some(reach.joint);
            let mut sets = Vec::new();
            for slot in 0..self.slots {
                let layouts = [self.programs[&shaders].pipeline.set_layout];
                let allocate = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
                // SAFETY: the pool was made for this number of sets.
                let set = unsafe { self.context.device.allocate_descriptor_sets(&allocate) };
                let set = set.during("allocating a descriptor set")?[0];
                for access in accesses {
                    self.point(resources, set, access, slot, joint);
                }
                sets.push(set);
            }
            self.programs.get_mut(&shaders).map(|program| program.sets.insert(reach, sets));
        }
        Ok(())
    }

    /// Pipelines and descriptor sets of a pass.
    fn program(&self, pass: &Pass) -> Option<&ShaderProgram> {
        self.programs.get(&*program_of(pass))
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
        let Access { resource, range, slice, binding: Some(binding), .. } = *access else { return };
        let region = resources.region(resource, slot);
        let element = resource.element as u64;
        let (offset, range) = match range {
            None if self.joints > 1 && resource.per_joint => {
                let bytes = region.bytes / u64::from(self.joints);
                (u64::from(drawn_joint.unwrap_or(slice)) * bytes, bytes)
            }
            Some((first, end)) => (u64::from(first) * element, u64::from(end - first) * element),
            None => (0, region.bytes),
        };
        let infos = [vk::DescriptorBufferInfo { buffer: region.buffer.raw, offset: region.offset + offset, range }];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(binding)
            .descriptor_type(resource.role.descriptor())
            .buffer_info(&infos)];
        // SAFETY: the set and the buffer are alive, and no recorded command uses the set yet.
        unsafe { self.context.device.update_descriptor_sets(&write, &[]) };
    }

    /// Pipeline and descriptor set of a pass. A draw has one set for each `joint`. A copy or fill has none.
    pub(crate) fn of(&self, pass: &Pass, joint: u32, slot: usize) -> Option<(&Pipeline, vk::DescriptorSet)> {
        let program = self.program(pass)?;
        Some((&program.pipeline, program.sets[&*reach_of(pass, joint)][slot]))
    }

    /// Pipeline of what stands behind a draw. It uses the descriptor sets of the draw.
    pub(crate) fn behind(&self, pass: &Pass) -> Option<&Pipeline> {
        self.program(pass)?.behind.as_ref()
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

/// The shaders that select the pipelines of a pass. None for a copy or fill.
fn program_of(pass: &Pass) -> Cow<'_, [Shader]> {
    match &pass.work {
        PassWork::Dispatch { shader, .. } => Cow::Borrowed(std::slice::from_ref(shader)),
        PassWork::Draw(drawing) => Cow::Owned([drawing.shaders.as_slice(), &drawing.behind].concat()),
        PassWork::Copy { .. } | PassWork::Fill(..) => Cow::Borrowed(&[]),
    }
}

/// The parts of buffers that a pass touches for a joint.
fn reach_of(pass: &Pass, joint: u32) -> Cow<'_, PassReach> {
    match pass.work {
        PassWork::Draw(_) => Cow::Owned(PassReach { joint, ..pass.reach.clone() }),
        _ => Cow::Borrowed(&pass.reach),
    }
}

/// Number and type of each binding of a pass, in order of number.
fn binding_types(accesses: &[Access]) -> Vec<(u32, vk::DescriptorType)> {
    let bound = |access: &Access| access.binding.map(|number| (number, access.resource.role.descriptor()));
    let mut types: Vec<_> = accesses.iter().filter_map(bound).collect();
    types.sort_unstable();
    types.dedup();
    types
}

impl ShaderProgram {
    /// Makes the pipelines of a pass. A copy or fill has none.
    fn new(context: &Arc<Context>, pass: &Pass, types: &[(u32, vk::DescriptorType)]) -> Result<Option<Self>, GpuError> {
        let (pipeline, behind) = match &pass.work {
            PassWork::Draw(drawing) => {
                let behind = |shaders: &Vec<Shader>| Pipeline::behind(context, drawing, shaders, types);
                let behind = Some(&drawing.behind).filter(|shaders| !shaders.is_empty()).map(behind);
                (Pipeline::draw(context, &pass.name, drawing, types)?, behind.transpose()?)
            }
            PassWork::Dispatch { shader, constants, .. } => {
                (Pipeline::compute(context, shader, types, constants.len() as u32)?, None)
            }
            PassWork::Copy { .. } | PassWork::Fill(..) => return Ok(None),
        };
        Ok(Some(Self { pipeline, behind, sets: BTreeMap::new() }))
    }
}

/// Makes the pipelines of a pass, which the context keeps. A driver's compiler judges its shaders so, also where no device is. Returns whether the pass has any.
///
/// # Errors
/// A buffer of the pass is not known, or the driver refuses a shader.
pub fn compile_pass(context: &Arc<Context>, pass: &Pass) -> Result<bool, GpuError> {
    let types = binding_types(&pass.accesses()?);
    Ok(ShaderProgram::new(context, pass, &types)?.is_some())
}
