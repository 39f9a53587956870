//! Records the frames of a large network, and makes the pipelines and descriptor sets that they bind.

use ash::vk;

use super::constants::Constants;
use super::{Piece, SOLVER, SetKey, WORKGROUP, Wide};
use crate::gpu::bindings::allocate_set;
use crate::gpu::error::GpuError;
use crate::gpu::frame::Frame;
use crate::gpu::layout::NetworkPass;
use crate::gpu::memory::Buffer;
use crate::gpu::network::frame::present;
use crate::gpu::network::host::write_pieces;
use crate::gpu::network::uses::{Target, uses};
use crate::gpu::pass::{NetworkWork, Resource, Step, Work};
use crate::gpu::pipeline::Pipeline;
use crate::gpu::wide_variant::WideKind;

fn key_of(work: NetworkWork) -> SetKey {
    (work.variant, work.nodes, work.odd)
}

impl Wide {
    fn make_set(&mut self, work: NetworkWork) -> Result<(), GpuError> {
        if self.sets.contains_key(&key_of(work)) {
            return Ok(());
        }
        let uses = uses(work.variant);
        if !self.pipelines.contains_key(&work.variant) {
            let types: Vec<_> = uses.iter().map(|one| (one.binding, vk::DescriptorType::STORAGE_BUFFER)).collect();
            let constants = size_of::<NetworkPass>() as u32;
            let pipeline = Pipeline::compute(&self.context, &work.variant.shader(), &types, constants)?;
            self.pipelines.insert(work.variant, pipeline);
        }
        let set = allocate_set(&self.context, self.pool.raw, self.pipelines[&work.variant].set_layout)?;
        let list = &self.lists[&work.nodes];
        let whole = |buffer: &'_ Buffer| (buffer.raw, 0, vk::WHOLE_SIZE);
        let of = |resource: Resource| {
            let piece = &self.buffers[&resource];
            (piece.buffer.raw, piece.offset, piece.bytes)
        };
        let target = |binding: u32, target| match target {
            Target::Table => whole(&self.tables[binding as usize]),
            Target::Present => of(present(work.odd)),
            Target::Next => of(present(!work.odd)),
            Target::Of(resource) => of(resource),
            Target::List => whole(&list.list),
        };
        write_pieces(&self.context, set, uses.iter().map(|one| (one.binding, target(one.binding, one.target))));
        self.sets.insert(key_of(work), set);
        Ok(())
    }

    /// Records and runs some frames one after the other.
    pub(super) fn submit(&mut self, frames: &[Frame], mut constants: Constants) -> Result<(), GpuError> {
        constants.radiative = self.plan.radiative;
        self.wrote_spare |= !self.spare.is_empty() && self.buffers.contains_key(&SOLVER[0]);
        let steps = || frames.iter().flat_map(|frame| &frame.steps);
        for step in steps() {
            if let Step::Pass(pass) = step
                && let Work::Network(work) = pass.work
            {
                self.make_set(work)?;
            }
        }
        let mut dispatches = 0;
        let Self { once, pipelines, sets, buffers, lists, sensors, space_temperature, .. } = self;
        once.run(|device, commands| {
            for step in steps() {
                match step {
                    Step::Barriers(barriers) => {
                        let barriers: Vec<_> = barriers
                            .iter()
                            .filter_map(|barrier| {
                                let barrier = vk::BufferMemoryBarrier2::default()
                                    .src_stage_mask(barrier.before.stage)
                                    .src_access_mask(barrier.before.access)
                                    .dst_stage_mask(barrier.after.stage)
                                    .dst_access_mask(barrier.after.access)
                                    .buffer(buffers.get(&barrier.resource)?.buffer.raw)
                                    .size(vk::WHOLE_SIZE);
                                Some(barrier)
                            })
                            .collect();
                        let dependency = vk::DependencyInfo::default().buffer_memory_barriers(&barriers);
                        // SAFETY: the buffers belong to this network.
                        unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
                    }
                    Step::Pass(pass) => match pass.work {
                        Work::Network(work) => {
                            let pipeline = &pipelines[&work.variant];
                            let count = lists[&work.nodes].count;
                            let workgroups = count.div_ceil(WORKGROUP);
                            // One workgroup decides, from what all others left.
                            let decides = work.variant.kind == WideKind::Scalars;
                            let (count, workgroups) = if decides { (workgroups, 1) } else { (count, workgroups) };
                            let said = constants.of(work, count, *sensors, *space_temperature);
                            let set = sets[&key_of(work)];
                            dispatches += 1;
                            // SAFETY: pipeline, set and buffers live until `run` has waited; invocations beyond the
                            // last return at once.
                            unsafe {
                                let point = pipeline.bind_point;
                                device.cmd_bind_pipeline(commands, point, pipeline.raw);
                                device.cmd_bind_descriptor_sets(commands, point, pipeline.layout, 0, &[set], &[]);
                                let stages = vk::ShaderStageFlags::COMPUTE;
                                let bytes = bytemuck::bytes_of(&said);
                                device.cmd_push_constants(commands, pipeline.layout, stages, 0, bytes);
                                device.cmd_dispatch(commands, workgroups as u32, 1, 1);
                            }
                        }
                        Work::Copy { from, to } => {
                            let (from, to) = (&buffers[&from].buffer, &buffers[&to].buffer);
                            let size = from.bytes.min(to.bytes);
                            let copy = [vk::BufferCopy { src_offset: 0, dst_offset: 0, size }];
                            // SAFETY: the copy stays within both buffers.
                            unsafe { device.cmd_copy_buffer(commands, from.raw, to.raw, &copy) };
                        }
                        Work::Clear(resource) => {
                            let Piece { buffer, offset, bytes } = &buffers[&resource];
                            // SAFETY: the buffer may be a transfer destination and is long enough.
                            unsafe { device.cmd_fill_buffer(commands, buffer.raw, *offset, *bytes, 0) };
                        }
                        _ => {}
                    },
                }
            }
        })?;
        self.counts.dispatches += dispatches;
        Ok(())
    }
}
