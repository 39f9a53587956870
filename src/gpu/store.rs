//! Allocation, filling and reading of buffers and images by resource.

use std::collections::BTreeMap;
use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::context::Context;
use super::error::GpuError;
use super::layout;
use super::memory::{Buffer, Image};
use super::resource::{Resource, Role};

/// A part of a buffer, or a whole buffer.
#[derive(Clone)]
pub(super) struct Region {
    pub(crate) buffer: Arc<Buffer>,
    pub(crate) offset: u64,
    pub(crate) bytes: u64,
    /// Whether another owner shares the buffer.
    pub(crate) lodged: bool,
}

impl Region {
    /// A part of a buffer that has another owner.
    pub(crate) fn lodged(buffer: &Arc<Buffer>, offset: u64, bytes: u64) -> Self {
        Self { buffer: Arc::clone(buffer), offset, bytes, lodged: true }
    }
}

/// Buffers and images of a scene, of a network or of a small command, with one copy or one for each slot.
pub(crate) struct Resources {
    pub(super) context: Arc<Context>,
    buffers: BTreeMap<(&'static Resource, usize), Region>,
    images: BTreeMap<&'static Resource, Image>,
}

impl Resources {
    /// An empty store.
    pub(super) fn new(context: &Arc<Context>) -> Self {
        Self { context: Arc::clone(context), buffers: BTreeMap::new(), images: BTreeMap::new() }
    }

    /// Makes a buffer of `bytes` bytes.
    pub(super) fn make(&mut self, resource: &'static Resource, bytes: u64) -> Result<(), GpuError> {
        self.make_in(resource, 0, bytes, false)
    }

    /// Makes a buffer of `count` elements.
    pub(super) fn make_of(&mut self, resource: &'static Resource, count: usize) -> Result<(), GpuError> {
        self.make(resource, (resource.element * count) as u64)
    }

    /// Makes a buffer with the given values.
    pub(super) fn make_with<T: Pod>(&mut self, resource: &'static Resource, values: &[T]) -> Result<(), GpuError> {
        self.make(resource, size_of_val(values) as u64)?;
        self.write(resource, 0, values)
    }

    /// Makes the buffer of a slot. A buffer bound `in_pieces` may be longer than the largest binding.
    pub(super) fn make_in(
        &mut self,
        resource: &'static Resource,
        slot: usize,
        bytes: u64,
        in_pieces: bool,
    ) -> Result<(), GpuError> {
        let limit = self.context.info.max_storage_buffer_range;
        // A buffer that only copies touch is never bound.
        let is_bound = resource.role.usage().contains(vk::BufferUsageFlags::STORAGE_BUFFER);
        if is_bound && bytes > limit && !in_pieces {
            let device = self.context.info.name.clone();
            return Err(GpuError::BufferTooLong { buffer: resource.name.to_owned(), bytes, device, limit });
        }
        let buffer = Buffer::new(&self.context, resource.name, bytes, resource.role.usage(), resource.role.location())?;
        let bytes = buffer.bytes;
        self.buffers.insert((resource, slot), Region { buffer: Arc::new(buffer), offset: 0, bytes, lodged: false });
        Ok(())
    }

    /// Places a resource in a part of a shared buffer.
    pub(super) fn lodge(&mut self, resource: &'static Resource, region: Region) {
        self.buffers.insert((resource, 0), region);
    }

    /// Makes an image with `each` samples of a texel. An image with several cannot be copied.
    pub(super) fn make_image(
        &mut self,
        resource: &'static Resource,
        size: [u32; 2],
        each: u32,
    ) -> Result<(), GpuError> {
        let (format, usage) = match resource.role {
            Role::Colour(format) => (format, vk::ImageUsageFlags::COLOR_ATTACHMENT),
            _ => (super::pipeline::DEPTH_FORMAT, vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT),
        };
        let usage = if each == 1 { usage | vk::ImageUsageFlags::TRANSFER_SRC } else { usage };
        let image = Image::new(&self.context, resource.name, size, format, usage, each)?;
        self.images.insert(resource, image);
        Ok(())
    }

    /// The buffer of a resource, if it has one. With a copy for each slot, it is the first.
    pub(super) fn get(&self, resource: &'static Resource) -> Option<&Region> {
        self.buffers.get(&(resource, 0))
    }

    /// The buffer of a resource in a slot.
    pub(super) fn region(&self, resource: &'static Resource, slot: usize) -> &Region {
        &self.buffers[&(resource, if resource.per_slot { slot } else { 0 })]
    }

    pub(super) fn image(&self, resource: &'static Resource) -> &Image {
        &self.images[&resource]
    }

    /// Allocated memory of the resources that `counts` accepts [bytes], without shared buffers.
    pub(super) fn bytes(&self, counts: impl Fn(&Resource) -> bool) -> u64 {
        let own = self.buffers.iter().filter(|(_, region)| !region.lodged);
        own.filter(|((resource, _), _)| counts(resource)).map(|(_, region)| region.buffer.bytes).sum()
    }

    /// Writes from the start of a host-visible buffer. It does nothing if the resource has no buffer.
    pub(super) fn write<T: Pod>(
        &mut self,
        resource: &'static Resource,
        slot: usize,
        values: &[T],
    ) -> Result<(), GpuError> {
        let Some(region) = self.buffers.get_mut(&(resource, slot)) else { return Ok(()) };
        let shared = || GpuError::SharedBuffer { buffer: resource.name.to_owned() };
        Arc::get_mut(&mut region.buffer).ok_or_else(shared)?.write(values);
        Ok(())
    }

    /// Writes the slice of each joint, which holds one value.
    pub(super) fn write_slices<T: Pod>(
        &mut self,
        resource: &'static Resource,
        slot: usize,
        slices: &[T],
    ) -> Result<(), GpuError> {
        let runs: Vec<&[T]> = slices.iter().map(std::slice::from_ref).collect();
        self.write_runs(resource, slot, 1, &runs)
    }

    /// Writes the slice of each joint with its values. A slice has room for `most` of them.
    pub(super) fn write_runs<T: Pod>(
        &mut self,
        resource: &'static Resource,
        slot: usize,
        most: usize,
        runs: &[impl AsRef<[T]>],
    ) -> Result<(), GpuError> {
        if let [one] = runs {
            return self.write(resource, slot, one.as_ref());
        }
        let slice = layout::slice_of(most * size_of::<T>());
        let mut bytes = vec![0u8; runs.len() * slice];
        for (slice, run) in bytes.chunks_mut(slice).zip(runs) {
            let values: &[u8] = bytemuck::cast_slice(run.as_ref());
            slice[..values.len()].copy_from_slice(values);
        }
        self.write(resource, slot, &bytes)
    }

    /// Reads the first values of a buffer.
    pub(super) fn read<T: Pod>(&self, resource: &'static Resource, slot: usize, count: usize) -> &[T] {
        self.region(resource, slot).buffer.read(count)
    }

    /// Frees a buffer.
    pub(super) fn free(&mut self, resource: &'static Resource) {
        self.buffers.remove(&(resource, 0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::effects::network::POWERS;
    use crate::gpu::effects::thermal::MATERIALS;

    #[test]
    fn what_something_else_holds_is_not_written() {
        let context = Context::open(None, false).expect("a Vulkan device");
        let mut resources = Resources::new(&context);
        resources.make_with(&POWERS, &[1.0f32; 4]).expect("a small buffer");
        let held = Arc::clone(&resources.region(&POWERS, 0).buffer);
        let refused = resources.write(&POWERS, 0, &[2.0f32; 4]).expect_err("a refusal").to_string();
        assert!(refused.contains("'OnePassPowers'"), "{refused}");
        drop(held);
        resources.write(&POWERS, 0, &[2.0f32; 4]).expect("nobody else holds it");
        assert_eq!(resources.read::<f32>(&POWERS, 0, 4), [2.0; 4]);
        resources.write(&MATERIALS, 0, &[2.0f32]).expect("there is no such buffer");
    }
}
