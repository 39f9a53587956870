//! Opening of devices. The silence of the validation layer counts in a process in which it spoke of a missing barrier.

use std::sync::{Arc, Mutex, PoisonError};

use super::bindings::Bindings;
use super::context::Context;
use super::effects::image::resources::BAND_TABLE;
use super::error::GpuError;
use super::lists::{FETCHED, RADIATION_INPUT, RADIATION_OUTPUT, witnessed};
use super::once::Once;
use super::pass::ListEntry;
use super::store::Resources;

/// Nodes of a workgroup.
const NODES: usize = 64;
/// Identifier of the message about a copy that does not wait for the shader.
const HAZARD: &str = "SYNC-HAZARD-READ-AFTER-WRITE";

/// Whether the layer has spoken in this process.
static SPOKE: Mutex<bool> = Mutex::new(false);

impl Context {
    /// Opens the device whose name contains `wanted` (ignoring case), or the best device. With `validate`, the validation
    /// layer checks every call, with synchronisation validation, and its messages are kept. If the device is the CPU, glibc
    /// keeps freed memory in the whole process from then on.
    ///
    /// # Errors
    /// There is no such device, it lacks a feature that isotherm needs, or the validation layer is not installed or mute.
    pub fn open(wanted: Option<&str>, validate: bool) -> Result<Arc<Self>, GpuError> {
        let context = Arc::new(Self::unproven(wanted, validate)?);
        if validate {
            let mut spoke = SPOKE.lock().unwrap_or_else(PoisonError::into_inner);
            if !*spoke && !sees_a_missing_barrier(&context)? {
                return Err(GpuError::MuteValidationLayer);
            }
            *spoke = true;
        }
        Ok(context)
    }
}

/// Whether the layer is silent on a complete list and speaks of the list without the barrier between shader and copy. Its
/// messages about the missing barrier are forgotten.
fn sees_a_missing_barrier(context: &Arc<Context>) -> Result<bool, GpuError> {
    let whole = witnessed();
    let mut without = whole.clone();
    let first_barrier = without.entries.iter().position(|entry| matches!(entry, ListEntry::Barriers(_)));
    without.entries.remove(first_barrier.expect("the list has barriers"));

    let mut once = Once::new(context)?;
    let mut resources = Resources::new(context);
    // At 1 K the shader reads the first elements of the table. Nobody reads what it makes of them.
    resources.make_with(&RADIATION_INPUT, &[1.0f32; NODES])?;
    for resource in [&BAND_TABLE, &RADIATION_OUTPUT, &FETCHED] {
        resources.make(resource, (size_of::<f32>() * NODES) as u64)?;
    }
    let mut bindings = Bindings::plain(context);
    bindings.add(&resources, whole.passes())?;
    let mut said_after = |list| -> Result<Vec<String>, GpuError> {
        once.run([list], &resources, Some(&bindings))?;
        Ok(context.validation_messages())
    };
    let of_the_whole = said_after(&whole)?.len();
    let all = said_after(&without)?;
    if let Some(messages) = &context.messages {
        messages.keep_first(of_the_whole);
    }
    Ok(all[of_the_whole..].iter().any(|message| message.starts_with(HAZARD)))
}
