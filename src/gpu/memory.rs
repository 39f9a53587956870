//! Buffers and images that free their memory when dropped.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::context::Context;
use super::error::{During as _, GpuError};
use super::instance::lock_loader;

/// A buffer with its memory.
pub(crate) struct Buffer {
    context: Arc<Context>,
    allocation: Option<Allocation>,
    pub(super) raw: vk::Buffer,
    /// Size in bytes.
    pub(crate) bytes: u64,
}

impl Buffer {
    /// Creates a buffer of at least 16 bytes, so that an empty table still binds.
    pub(crate) fn new(
        context: &Arc<Context>,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self, GpuError> {
        let bytes = bytes.max(16);
        let create = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device is alive; the memory is bound below before any use.
        let raw = unsafe { context.device.create_buffer(&create, None) }.during("creating a buffer")?;
        let mut buffer = Self { context: Arc::clone(context), allocation: None, raw, bytes };
        // SAFETY: the buffer is alive.
        let requirements = unsafe { context.device.get_buffer_memory_requirements(raw) };
        let allocation = allocate(context, name, requirements, location, true)?;
        // SAFETY: the memory was allocated for these requirements, and is bound once.
        unsafe { context.device.bind_buffer_memory(raw, allocation.memory(), allocation.offset()) }
            .during("binding a buffer")?;
        buffer.allocation = Some(allocation);
        context.set_name(raw, name);
        Ok(buffer)
    }

    /// Writes values from the start of a host-visible buffer.
    ///
    /// # Panics
    /// The buffer is not host-visible, or is shorter than the values. This is a bug.
    pub(crate) fn write<T: Pod>(&mut self, values: &[T]) {
        let bytes = bytemuck::cast_slice(values);
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut).expect("a host-visible buffer");
        mapped[..bytes.len()].copy_from_slice(bytes);
    }

    /// Reads the first `count` values of a host-visible buffer. It panics under the conditions of `write`.
    pub(crate) fn read<T: Pod>(&self, count: usize) -> &[T] {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_slice).expect("a host-visible buffer");
        bytemuck::cast_slice(&mapped[..count * size_of::<T>()])
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: the owner waits for the device before it drops its buffers.
        unsafe { self.context.device.destroy_buffer(self.raw, None) };
        free(&self.context, self.allocation.take());
    }
}

/// A two-dimensional render target with its view and memory.
pub(crate) struct Image {
    context: Arc<Context>,
    allocation: Option<Allocation>,
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    /// Texel format.
    pub(crate) format: vk::Format,
    /// Width and height in texels.
    pub(crate) size: [u32; 2],
}

impl Image {
    /// Creates an image in device memory with `each` samples of a texel.
    pub(crate) fn new(
        context: &Arc<Context>,
        name: &str,
        [width, height]: [u32; 2],
        format: vk::Format,
        usage: vk::ImageUsageFlags,
        each: u32,
    ) -> Result<Self, GpuError> {
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::from_raw(each))
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage);
        // SAFETY: the device is alive; the memory is bound below before any use.
        let raw = unsafe { context.device.create_image(&create, None) }.during("creating an image")?;
        let mut image = Self {
            context: Arc::clone(context),
            allocation: None,
            raw,
            view: vk::ImageView::null(),
            format,
            size: [width, height],
        };
        // SAFETY: the image is alive.
        let requirements = unsafe { context.device.get_image_memory_requirements(raw) };
        let allocation = allocate(context, name, requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the memory was allocated for these requirements, and is bound once.
        unsafe { context.device.bind_image_memory(raw, allocation.memory(), allocation.offset()) }
            .during("binding an image")?;
        image.allocation = Some(allocation);
        let view = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(image.whole());
        // SAFETY: the image is bound to memory.
        image.view = unsafe { context.device.create_image_view(&view, None) }.during("creating an image view")?;
        context.set_name(raw, name);
        Ok(image)
    }

    /// The range of its only mip level and layer.
    pub(super) fn whole(&self) -> vk::ImageSubresourceRange {
        let aspect_mask = if self.format == vk::Format::D32_SFLOAT {
            vk::ImageAspectFlags::DEPTH
        } else {
            vk::ImageAspectFlags::COLOR
        };
        vk::ImageSubresourceRange {
            aspect_mask,
            base_mip_level: 0,
            level_count: 1,
            base_array_layer: 0,
            layer_count: 1,
        }
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: the owner waits for the device before it drops its images. A null view may be destroyed.
        unsafe {
            self.context.device.destroy_image_view(self.view, None);
            self.context.device.destroy_image(self.raw, None);
        }
        free(&self.context, self.allocation.take());
    }
}

fn allocate(
    context: &Context,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation, GpuError> {
    let description = AllocationCreateDesc {
        name,
        requirements,
        location,
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    let mut allocator = context.allocator.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    allocator.allocate(&description).map_err(|source| GpuError::Allocation { name: name.to_owned(), source })
}

fn free(context: &Context, allocation: Option<Allocation>) {
    if let Some(allocation) = allocation {
        let mut allocator = context.allocator.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        // This fails only for an allocation of another allocator, which is impossible here.
        let _ = allocator.free(allocation);
    }
}

impl Context {
    /// Names an object for the validation layer and tools that watch the device.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        if let (Some(labels), Ok(name)) = (&self.labels, std::ffi::CString::new(name)) {
            let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
            let _loader = lock_loader();
            // SAFETY: the handle belongs to this device. A failure to set the name is harmless.
            let _ = unsafe { labels.set_debug_utils_object_name(&info) };
        }
    }
}
