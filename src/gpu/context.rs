//! The Vulkan device, queue and memory allocator, which live longer than a scene.

use std::ffi::{CStr, c_char};
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex, PoisonError};

use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::drivers;
use super::error::{During as _, GpuError};
use super::host_heap;
use super::instance::{VulkanInstance, lock_loader};
use super::kept_pipelines::KeptPipelines;
use super::pipeline_cache::{PipelineCache, user_folder};
use super::validation::{self, Messages};
use crate::host;

/// Memory that is taken from the device at once [bytes]. A processor fills all of it with zeros.
const BLOCK: u64 = 16 << 20;

/// Properties of a device, as `isotherm info` prints them.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DeviceInfo {
    /// Name from the driver.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `cpu` or `other`.
    pub(crate) kind: &'static str,
    /// Driver and its version.
    pub driver: String,
    /// Highest Vulkan version that the device supports.
    pub(crate) api_version: String,
    /// Largest storage buffer binding [bytes].
    pub max_storage_buffer_range: u64,
    /// Most workgroups of one dispatch in x.
    pub(crate) max_workgroups: u32,
    /// Largest width or height of a framebuffer [px].
    pub(crate) max_framebuffer_side: u32,
    /// Size of the largest device-local heap [bytes].
    pub(crate) memory: u64,
    /// Numbers of samples of a texel that images of floats and depths may have, as a sum of powers of two. 1 if
    /// the device cannot shade every sample.
    pub sample_counts: u32,
    /// Bits of sub-pixel precision of the rasteriser.
    pub sub_pixel_bits: u32,
    /// Length of a timestamp unit [ns]; 0 if the queue has no timestamps.
    pub(crate) timestamp_period: f32,
    /// Bits of a timestamp that count. Beyond them the clock begins again.
    pub(crate) timestamp_bits: u32,
    /// Whether one indirect draw takes several commands (multiDrawIndirect).
    pub draws_many: bool,
    /// Features that isotherm needs and the device does not have.
    pub lacks: Vec<String>,
}

/// An open Vulkan device with one queue for compute, graphics and copies.
pub struct Context {
    /// Properties of the device.
    pub info: DeviceInfo,
    pub(super) device: ash::Device,
    /// The queue. Vulkan lets one thread at a time submit to it.
    queue: Mutex<vk::Queue>,
    pub(super) queue_family: u32,
    /// Names of objects and labels of passes. Only a context that validates or that a tool watches has them.
    pub(super) labels: Option<ext::debug_utils::Device>,
    pub(super) allocator: ManuallyDrop<Mutex<Allocator>>,
    pub(super) pipelines: PipelineCache,
    /// The pipelines of all scenes so far.
    pub(super) made: KeptPipelines,
    physical: vk::PhysicalDevice,
    pub(super) messages: Option<Arc<Messages>>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ManuallyDrop<VulkanInstance>,
}

/// Lists the devices of this computer, best first.
pub fn devices() -> Result<Vec<DeviceInfo>, GpuError> {
    let _loader = lock_loader();
    Ok(rank_devices(&VulkanInstance::new(false)?.raw)?.into_iter().map(|(_, info, _)| info).collect())
}

impl Context {
    /// Opens the device whose name contains `wanted` (ignoring case), or the best device. With `validate`, the validation
    /// layer checks every call, and its messages are kept. glibc keeps freed memory in the whole process from then on.
    pub(super) fn unproven(wanted: Option<&str>, validate: bool) -> Result<Self, GpuError> {
        let _loader = lock_loader();
        let instance = VulkanInstance::new(validate)?;
        let found = rank_devices(&instance.raw)?;
        let present = || found.iter().map(|(_, info, _)| format!("'{}'", info.name)).collect::<Vec<_>>().join(", ");
        let (physical, info, queue_family) = match wanted {
            None => found.first().ok_or_else(no_device)?,
            Some(wanted) => found
                .iter()
                .find(|(_, info, _)| info.name.to_lowercase().contains(&wanted.to_lowercase()))
                .ok_or_else(|| GpuError::UnknownDevice { wanted: wanted.to_owned(), present: present() })?,
        };
        if !info.lacks.is_empty() {
            return Err(GpuError::Unsuitable { device: info.name.clone(), lacks: info.lacks.join(", ") });
        }

        host_heap::keep_freed_memory();
        let mut vulkan_13 =
            vk::PhysicalDeviceVulkan13Features::default().synchronization2(true).dynamic_rendering(true);
        let priorities = [1.0];
        let queues =
            [vk::DeviceQueueCreateInfo::default().queue_family_index(*queue_family).queue_priorities(&priorities)];
        let features = vk::PhysicalDeviceFeatures::default()
            .multi_draw_indirect(info.draws_many)
            .sample_rate_shading(info.sample_counts > 1);
        let (physical, queue_family) = (*physical, *queue_family);
        let extensions = portability_of(&instance.raw, physical);
        let create = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&features)
            .enabled_extension_names(&extensions)
            .push_next(&mut vulkan_13);
        // SAFETY: the physical device belongs to this instance, and the structures above live through the call.
        let device = unsafe { instance.raw.create_device(physical, &create, None) }.during("creating the device")?;
        // SAFETY: the queue was asked for above.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: gpu_allocator::AllocatorDebugSettings::default(),
            buffer_device_address: false,
            allocation_sizes: gpu_allocator::AllocationSizes::new(BLOCK, BLOCK),
        })
        .map_err(|source| GpuError::Allocation { name: "allocator".to_owned(), source })?;

        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
        let pipelines = PipelineCache::open(&device, &properties, user_folder());
        let (messages, messenger) = if validate {
            let (messages, messenger) = validation::install(&instance.entry, &instance.raw)?;
            (Some(messages), Some(messenger))
        } else {
            (None, None)
        };
        let mut context = Self {
            info: info.clone(),
            device,
            queue: Mutex::new(queue),
            queue_family,
            labels: None,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            pipelines,
            made: KeptPipelines::default(),
            physical,
            messages,
            messenger,
            instance: ManuallyDrop::new(instance),
        };
        if context.instance.debug_utils && (validate || context.instance.is_watched(physical)) {
            context.give_names();
        }
        Ok(context)
    }

    /// Gives objects names and passes labels from now on. The caller holds the loader's lock.
    fn give_names(&mut self) {
        self.labels = Some(ext::debug_utils::Device::new(&self.instance.raw, &self.device));
    }

    /// Memory that this process may still allocate [bytes]. It is the free budget of the largest device-local heap
    /// (VK_EXT_memory_budget), or the size of that heap without the extension. On a CPU device, the memory that the
    /// process may still take limits it.
    pub(crate) fn free_memory(&self) -> u64 {
        let instance = &self.instance.raw;
        // SAFETY: the physical device belongs to the instance.
        let extensions = unsafe { instance.enumerate_device_extension_properties(self.physical) }.unwrap_or_default();
        let tells =
            extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(ext::memory_budget::NAME));
        let mut budget = vk::PhysicalDeviceMemoryBudgetPropertiesEXT::default();
        let mut properties = vk::PhysicalDeviceMemoryProperties2::default();
        if tells {
            properties = properties.push_next(&mut budget);
        }
        // SAFETY: the device belongs to the instance, and the chain has a budget only if the device supports it.
        unsafe { instance.get_physical_device_memory_properties2(self.physical, &mut properties) };
        let heaps = properties.memory_properties;
        let local = heaps.memory_heaps_as_slice().iter().enumerate();
        let local = local.filter(|(_, heap)| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));
        let largest = local.max_by_key(|(_, heap)| heap.size).map(|(index, heap)| (index, heap.size));
        let free = match largest {
            Some((index, _)) if tells => budget.heap_budget[index].saturating_sub(budget.heap_usage[index]),
            largest => largest.map_or(0, |(_, size)| size),
        };
        match host::memory_left() {
            Some(host) if self.info.kind == "cpu" => free.min(host),
            _ => free,
        }
    }

    /// Submits work to the queue, with a fence that is not signalled. Threads that share the device take turns.
    ///
    /// # Safety
    /// The command buffers are complete and not in use, and stay as they are until the fence is signalled. So does the fence.
    pub(super) unsafe fn submit(&self, work: &[vk::SubmitInfo2<'_>], fence: vk::Fence) -> Result<(), vk::Result> {
        let queue = self.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the lock keeps other threads from the queue, and the caller answers for the rest.
        unsafe { self.device.queue_submit2(*queue, work, fence) }
    }

    /// Whether the validation layer checks every call.
    pub(crate) fn is_validated(&self) -> bool {
        self.messages.is_some()
    }

    /// Messages of the validation layer so far, empty without validation.
    pub fn validation_messages(&self) -> Vec<String> {
        self.messages.as_ref().map(|messages| messages.all()).unwrap_or_default()
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        // SAFETY: every buffer and image, and all that uses pipelines, holds an Arc of this context, so all are gone. The queue is
        // idle before the device is destroyed, and the order is the reverse of creation.
        unsafe {
            let _ = self.device.device_wait_idle();
            self.made.close(&self.device);
            ManuallyDrop::drop(&mut self.allocator);
            self.pipelines.close(&self.device);
            let _loader = lock_loader();
            self.device.destroy_device(None);
            if let Some((functions, messenger)) = &self.messenger {
                functions.destroy_debug_utils_messenger(*messenger, None);
            }
            ManuallyDrop::drop(&mut self.instance);
        }
    }
}

/// The extension that a driver on top of another interface has, such as MoltenVK. Vulkan asks that such a device enables it.
fn portability_of(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Vec<*const c_char> {
    // SAFETY: the physical device belongs to the instance.
    let extensions = unsafe { instance.enumerate_device_extension_properties(physical) }.unwrap_or_default();
    let has_it = extensions.iter().any(|one| one.extension_name_as_c_str() == Ok(khr::portability_subset::NAME));
    if has_it { vec![khr::portability_subset::NAME.as_ptr()] } else { Vec::new() }
}

fn no_device() -> GpuError {
    GpuError::NoDevice { found: drivers::description() }
}

type Ranked = (vk::PhysicalDevice, DeviceInfo, u32);

fn rank_devices(instance: &ash::Instance) -> Result<Vec<Ranked>, GpuError> {
    // SAFETY: the instance is alive.
    let physical = unsafe { instance.enumerate_physical_devices() }.map_err(|result| match result {
        vk::Result::ERROR_INITIALIZATION_FAILED => no_device(),
        result => GpuError::Call { call: "listing devices", result },
    })?;
    let mut found: Vec<(u32, Ranked)> = physical.into_iter().map(|device| describe(instance, device)).collect();
    found.sort_by_key(|(rank, _)| *rank);
    if found.is_empty() { Err(no_device()) } else { Ok(found.into_iter().map(|(_, device)| device).collect()) }
}

fn describe(instance: &ash::Instance, physical: vk::PhysicalDevice) -> (u32, Ranked) {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: the physical device belongs to the instance. A device below Vulkan 1.2 ignores the structures of 1.2.
    unsafe { instance.get_physical_device_properties2(physical, &mut properties) };
    let core = properties.properties;
    let mut vulkan_13 = vk::PhysicalDeviceVulkan13Features::default();
    let has_13 = core.api_version >= vk::API_VERSION_1_3;
    let (mut draws_many, mut shades_samples) = (false, false);
    if has_13 {
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan_13);
        // SAFETY: the device belongs to the instance and supports Vulkan 1.3.
        unsafe { instance.get_physical_device_features2(physical, &mut features) };
        draws_many = features.features.multi_draw_indirect == vk::TRUE;
        shades_samples = features.features.sample_rate_shading == vk::TRUE;
    }
    // SAFETY: the physical device belongs to the instance.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let family = families.iter().position(|family| family.queue_flags.contains(wanted));
    let timestamp_bits = family.map_or(0, |family| families[family].timestamp_valid_bits);
    // SAFETY: the physical device belongs to the instance.
    let memory = unsafe { instance.get_physical_device_memory_properties(physical) };
    let largest_heap =
        memory.memory_heaps_as_slice().iter().filter(|heap| heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL));

    let mut lacks = Vec::new();
    if !has_13 {
        lacks.push("no Vulkan 1.3".to_owned());
    } else {
        if vulkan_13.synchronization2 == vk::FALSE {
            lacks.push("no synchronization2".to_owned());
        }
        if vulkan_13.dynamic_rendering == vk::FALSE {
            lacks.push("no dynamic rendering".to_owned());
        }
    }
    if family.is_none() {
        lacks.push("no queue that draws and computes".to_owned());
    }
    let (rank, kind) = match core.device_type {
        vk::PhysicalDeviceType::DISCRETE_GPU => (0, "discrete"),
        vk::PhysicalDeviceType::INTEGRATED_GPU => (1, "integrated"),
        vk::PhysicalDeviceType::VIRTUAL_GPU => (2, "virtual"),
        vk::PhysicalDeviceType::CPU => (3, "cpu"),
        _ => (4, "other"),
    };
    let text = |raw: Result<&CStr, _>| raw.map(|text: &CStr| text.to_string_lossy().into_owned()).unwrap_or_default();
    let info = DeviceInfo {
        name: text(core.device_name_as_c_str()),
        kind,
        driver: format!("{} {}", text(driver.driver_name_as_c_str()), text(driver.driver_info_as_c_str())),
        api_version: format!(
            "{}.{}.{}",
            vk::api_version_major(core.api_version),
            vk::api_version_minor(core.api_version),
            vk::api_version_patch(core.api_version)
        ),
        max_storage_buffer_range: u64::from(core.limits.max_storage_buffer_range),
        max_workgroups: core.limits.max_compute_work_group_count[0],
        max_framebuffer_side: core.limits.max_framebuffer_width.min(core.limits.max_framebuffer_height),
        memory: largest_heap.map(|heap| heap.size).max().unwrap_or(0),
        sample_counts: match core.limits.framebuffer_color_sample_counts & core.limits.framebuffer_depth_sample_counts {
            counts if shades_samples => counts.as_raw(),
            _ => 1,
        },
        sub_pixel_bits: core.limits.sub_pixel_precision_bits,
        timestamp_period: if timestamp_bits > 0 { core.limits.timestamp_period } else { 0.0 },
        timestamp_bits,
        draws_many,
        lacks,
    };
    let unusable = u32::from(!info.lacks.is_empty()) * 10;
    (rank + unusable, (physical, info, u32::try_from(family.unwrap_or(0)).unwrap_or(0)))
}

#[cfg(test)]
mod tests;
