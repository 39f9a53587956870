//! Buffers, descriptor pools and sets that both paths of a network make alike.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;

use crate::gpu::context::Context;
use crate::gpu::error::{Context as _, GpuError};
use crate::gpu::memory::Buffer;

/// A descriptor pool.
pub(super) struct Pool {
    context: Arc<Context>,
    pub(super) raw: vk::DescriptorPool,
}

impl Pool {
    /// For so many sets of so many storage buffers.
    pub(super) fn new(context: &Arc<Context>, sets: u32, bindings: u32) -> Result<Self, GpuError> {
        let ty = vk::DescriptorType::STORAGE_BUFFER;
        let sizes = [vk::DescriptorPoolSize { ty, descriptor_count: sets * bindings }];
        let create = vk::DescriptorPoolCreateInfo::default().max_sets(sets).pool_sizes(&sizes);
        // SAFETY: the device is alive.
        let raw =
            unsafe { context.device.create_descriptor_pool(&create, None) }.during("creating a descriptor pool")?;
        Ok(Self { context: Arc::clone(context), raw })
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        // SAFETY: every run was waited for.
        unsafe { self.context.device.destroy_descriptor_pool(self.raw, None) };
    }
}

/// A storage buffer that the host has filled and may write again.
pub(super) fn buffer<T: Pod>(context: &Arc<Context>, name: &str, values: &[T]) -> Result<Buffer, GpuError> {
    let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let mut buffer = Buffer::new(context, name, size_of_val(values) as u64, usage, MemoryLocation::CpuToGpu)?;
    buffer.write(values);
    Ok(buffer)
}

/// A storage buffer of so many words of four bytes.
pub(super) fn room(
    context: &Arc<Context>,
    name: &str,
    words: usize,
    location: MemoryLocation,
) -> Result<Buffer, GpuError> {
    let usage =
        vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
    Buffer::new(context, name, 4 * words as u64, usage, location)
}

/// Points bindings of a new set to whole storage buffers.
pub(super) fn write_set<'a>(
    context: &Context,
    set: vk::DescriptorSet,
    buffers: impl IntoIterator<Item = (u32, &'a Buffer)>,
) {
    write_pieces(context, set, buffers.into_iter().map(|(binding, buffer)| (binding, (buffer.raw, 0, vk::WHOLE_SIZE))));
}

/// Points bindings of a new set to pieces of storage buffers: offset and length in bytes.
pub(super) fn write_pieces(
    context: &Context,
    set: vk::DescriptorSet,
    pieces: impl IntoIterator<Item = (u32, (vk::Buffer, u64, u64))>,
) {
    for (binding, (buffer, offset, range)) in pieces {
        let infos = [vk::DescriptorBufferInfo { buffer, offset, range }];
        let write = [vk::WriteDescriptorSet::default()
            .dst_set(set)
            .dst_binding(binding)
            .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
            .buffer_info(&infos)];
        // SAFETY: set and buffer are alive, and nothing uses the set yet.
        unsafe { context.device.update_descriptor_sets(&write, &[]) };
    }
}
