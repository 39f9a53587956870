//! Whole storage buffers bound to one shader, for the small compute commands.

use ash::vk;

use super::bindings::allocate_set;
use super::context::Context;
use super::error::{Context as _, GpuError};
use super::memory::Buffer;

/// Number and type of the bindings of storage buffers, as a pipeline's layout wants them.
pub(super) fn binding_types(buffers: &[(u32, Buffer)]) -> Vec<(u32, vk::DescriptorType)> {
    buffers.iter().map(|(binding, _)| (*binding, vk::DescriptorType::STORAGE_BUFFER)).collect()
}

/// A descriptor set of storage buffers, and the pool that it comes from.
pub(super) struct BufferSet<'a> {
    context: &'a Context,
    pool: vk::DescriptorPool,
    pub(super) raw: vk::DescriptorSet,
}

impl<'a> BufferSet<'a> {
    /// Points every binding to its whole buffer. The buffers must outlive the set's last use.
    pub(super) fn new(
        context: &'a Context,
        layout: vk::DescriptorSetLayout,
        buffers: &[(u32, Buffer)],
    ) -> Result<Self, GpuError> {
        let ty = vk::DescriptorType::STORAGE_BUFFER;
        let sizes = [vk::DescriptorPoolSize { ty, descriptor_count: buffers.len() as u32 }];
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let pool =
            unsafe { context.device.create_descriptor_pool(&create, None) }.during("creating a descriptor pool")?;
        let mut set = Self { context, pool, raw: vk::DescriptorSet::null() };
        set.raw = allocate_set(context, pool, layout)?;
        for (binding, buffer) in buffers {
            let infos = [vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE }];
            let write = [vk::WriteDescriptorSet::default()
                .dst_set(set.raw)
                .dst_binding(*binding)
                .descriptor_type(ty)
                .buffer_info(&infos)];
            // SAFETY: set and buffer are alive, and nothing uses the set yet.
            unsafe { context.device.update_descriptor_sets(&write, &[]) };
        }
        Ok(set)
    }
}

impl Drop for BufferSet<'_> {
    fn drop(&mut self) {
        // SAFETY: what used the set was waited for.
        unsafe { self.context.device.destroy_descriptor_pool(self.pool, None) };
    }
}
