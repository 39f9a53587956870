//! What the validation layer says, kept for whoever asks.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use ash::{ext, vk};

use super::error::{During as _, GpuError};

/// Warnings and errors of the validation layer, in order.
#[derive(Default)]
pub struct Messages(Mutex<Vec<String>>);

impl Messages {
    /// A copy of all messages.
    pub fn all(&self) -> Vec<String> {
        self.0.lock().map(|messages| messages.clone()).unwrap_or_default()
    }
}

type Messenger = (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT);

/// Installs a messenger that collects warnings and errors. The messages live as long as the returned Arc, which the
/// context keeps until the messenger is destroyed.
pub(super) fn install(entry: &ash::Entry, instance: &ash::Instance) -> Result<(Arc<Messages>, Messenger), GpuError> {
    let messages = Arc::new(Messages::default());
    let functions = ext::debug_utils::Instance::new(entry, instance);
    let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR)
        .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE)
        .pfn_user_callback(Some(collect))
        .user_data(Arc::as_ptr(&messages).cast_mut().cast());
    // SAFETY: the callback's data outlives the messenger, see above.
    let messenger =
        unsafe { functions.create_debug_utils_messenger(&create, None) }.during("installing a messenger")?;
    Ok((messages, (functions, messenger)))
}

/// Called by the layer, on whichever thread the offending call runs.
unsafe extern "system" fn collect(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data for the time of the call, and `user` is the Messages of `install`.
    let (messages, data) = unsafe { (&*user.cast::<Messages>(), &*data) };
    if !data.p_message.is_null() {
        // SAFETY: a non-null message is a C string.
        let text = unsafe { CStr::from_ptr(data.p_message) }.to_string_lossy().into_owned();
        if let Ok(mut list) = messages.0.lock() {
            list.push(text);
        }
    }
    vk::FALSE
}
