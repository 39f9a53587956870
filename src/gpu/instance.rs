//! The Vulkan instance, and the lock under which instances and devices are made, dropped and named.

use std::ffi::{CStr, CString, c_char, c_void};
use std::sync::{Mutex, MutexGuard, PoisonError};

use ash::{ext, khr, vk};

use super::drivers;
use super::error::{During as _, GpuError};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Guards the loader's lists of drivers and devices.
///
/// Vulkan-Loader searches these lists when an object is named and when the functions of a device are asked for
/// (`loader_get_icd_and_device`). Until its commit 5ee27b30c of February 2026 the search did not hold the lock under which
/// the lists change. Making and dropping an instance or a device changes the lists. Listing devices does too, because
/// the loader then drops drivers without a device. With version 1.4.309 of Debian 13 the search ended the process.
static LOADER: Mutex<()> = Mutex::new(());

/// Held from the making of an instance to the device that is made from it, while both are dropped, and while an object is
/// named. A thread must not take it twice.
pub(super) fn lock_loader() -> MutexGuard<'static, ()> {
    LOADER.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An instance with its loader. Everything made from it is destroyed before it is dropped, and its owner holds the loader's
/// lock then.
pub(super) struct VulkanInstance {
    pub(super) raw: ash::Instance,
    pub(super) entry: ash::Entry,
    /// Whether it has VK_EXT_debug_utils.
    pub(super) debug_utils: bool,
}

impl VulkanInstance {
    /// Makes an instance under the loader's lock. With `validate` it has the validation layer, with synchronisation validation.
    pub(super) fn new(validate: bool) -> Result<Self, GpuError> {
        // SAFETY: loading the Vulkan loader runs its initialisers, as in any Vulkan program.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| GpuError::NoLoader(error.to_string()))?;
        // SAFETY: the entry is loaded.
        let extensions =
            unsafe { entry.enumerate_instance_extension_properties(None) }.map_err(no_driver("listing extensions"))?;
        let debug_utils = has(&extensions, ext::debug_utils::NAME);
        let tells_settings = validate && layer_takes_settings(&entry)?;

        let name = CString::new("isotherm").expect("no zero byte in a literal");
        let application = vk::ApplicationInfo::default().application_name(&name).api_version(vk::API_VERSION_1_3);
        let mut layer_names: Vec<*const c_char> = Vec::new();
        let mut extension_names: Vec<*const c_char> = Vec::new();
        let enables = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enables);
        let settings = [c"validate_sync", c"syncval_shader_accesses_heuristic"].map(switched_on);
        let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
        if debug_utils {
            extension_names.push(ext::debug_utils::NAME.as_ptr());
        }
        let mut flags = vk::InstanceCreateFlags::empty();
        if has(&extensions, khr::portability_enumeration::NAME) {
            extension_names.push(khr::portability_enumeration::NAME.as_ptr());
            flags |= vk::InstanceCreateFlags::ENUMERATE_PORTABILITY_KHR;
        }
        if validate {
            layer_names.push(VALIDATION_LAYER.as_ptr());
            let way = if tells_settings { ext::layer_settings::NAME } else { ext::validation_features::NAME };
            extension_names.push(way.as_ptr());
        }
        let mut create = vk::InstanceCreateInfo::default()
            .flags(flags)
            .application_info(&application)
            .enabled_layer_names(&layer_names)
            .enabled_extension_names(&extension_names);
        if tells_settings {
            create = create.push_next(&mut settings);
        } else if validate {
            create = create.push_next(&mut features);
        }
        // SAFETY: the names point to literals, and the structures live through the call.
        let raw = unsafe { entry.create_instance(&create, None) }.map_err(no_driver("creating the instance"))?;
        Ok(Self { raw, entry, debug_utils })
    }

    /// Whether a tool watches the device, such as a debugger or a capture (`vkGetPhysicalDeviceToolProperties`). The
    /// device has Vulkan 1.3.
    pub(super) fn is_watched(&self, physical: vk::PhysicalDevice) -> bool {
        // SAFETY: the physical device belongs to the instance.
        unsafe { self.raw.get_physical_device_tool_properties_len(physical) }.is_ok_and(|tools| tools > 0)
    }
}

impl Drop for VulkanInstance {
    fn drop(&mut self) {
        // SAFETY: the owner destroyed everything that was made from the instance.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn has(extensions: &[vk::ExtensionProperties], name: &CStr) -> bool {
    extensions.iter().any(|extension| extension.extension_name_as_c_str() == Ok(name))
}

/// Whether the validation layer takes VK_EXT_layer_settings. Such layers judge the accesses of shaders only where a setting
/// asks for it.
pub(super) fn layer_takes_settings(entry: &ash::Entry) -> Result<bool, GpuError> {
    // SAFETY: the entry is loaded.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.during("listing layers")?;
    if !layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION_LAYER)) {
        return Err(GpuError::NoValidationLayer);
    }
    // SAFETY: the entry is loaded.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(Some(VALIDATION_LAYER)) };
    Ok(has(&extensions.during("listing extensions of the validation layer")?, ext::layer_settings::NAME))
}

/// A setting of the validation layer that is on.
fn switched_on(name: &'static CStr) -> vk::LayerSettingEXT<'static> {
    static ON: vk::Bool32 = vk::TRUE;
    let mut setting = vk::LayerSettingEXT::default()
        .layer_name(VALIDATION_LAYER)
        .setting_name(name)
        .ty(vk::LayerSettingTypeEXT::BOOL32);
    setting.value_count = 1;
    setting.p_values = std::ptr::from_ref(&ON).cast::<c_void>();
    setting
}

/// The error of a call that the loader answers from its drivers. A driver file that is not JSON ends it with "out of host memory".
fn no_driver(call: &'static str) -> impl Fn(vk::Result) -> GpuError {
    move |result| match result {
        vk::Result::ERROR_INCOMPATIBLE_DRIVER
        | vk::Result::ERROR_INITIALIZATION_FAILED
        | vk::Result::ERROR_OUT_OF_HOST_MEMORY => GpuError::NoDriver { found: drivers::description() },
        result => GpuError::Call { call, result },
    }
}
