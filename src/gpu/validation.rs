//! Collection of the messages of the Vulkan validation layer.

use std::ffi::c_void;
use std::sync::{Arc, Mutex};

use ash::{ext, vk};

use super::error::{During as _, GpuError};

/// Warnings and errors in order. Each begins with its identifier, such as `SYNC-HAZARD-READ-AFTER-WRITE: `.
#[derive(Default)]
pub(crate) struct Messages(Mutex<Vec<String>>);

impl Messages {
    /// A copy of all messages.
    pub(crate) fn all(&self) -> Vec<String> {
        self.0.lock().map(|messages| messages.clone()).unwrap_or_default()
    }

    /// Forgets all but the first `count` messages.
    pub(super) fn keep_first(&self, count: usize) {
        if let Ok(mut list) = self.0.lock() {
            list.truncate(count);
        }
    }
}

type Messenger = (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT);

/// Installs a messenger that collects warnings and errors in the returned `Messages`. The context keeps them until it
/// destroys the messenger.
pub(super) fn install(entry: &ash::Entry, instance: &ash::Instance) -> Result<(Arc<Messages>, Messenger), GpuError> {
    let messages = Arc::new(Messages::default());
    let functions = ext::debug_utils::Instance::new(entry, instance);
    let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
        .pfn_user_callback(Some(collect))
        .user_data(Arc::as_ptr(&messages).cast_mut().cast());
    // SAFETY: the context keeps the callback's data longer than the messenger.
    let messenger =
        unsafe { functions.create_debug_utils_messenger(&create, None) }.during("installing a messenger")?;
    Ok((messages, (functions, messenger)))
}

/// Callback of the layer, on the thread of the offending call.
unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data for the duration of the call, and `user` is the `Messages` of `install`.
    let (messages, data) = unsafe { (&*user.cast::<Messages>(), &*data) };
    // SAFETY: the strings are null or C strings that live through the call.
    let texts = unsafe { [data.message_id_name_as_c_str(), data.message_as_c_str()] };
    let [identifier, text] = texts.map(|text| text.unwrap_or_default().to_string_lossy());
    if let Ok(mut list) = messages.0.lock() {
        list.push(format!("{identifier}: {text}"));
    }
    vk::FALSE
}
