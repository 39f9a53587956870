//! The pipelines that a context has made. A driver takes long to compile them, and the next scene has most of them again, so a context keeps them to its end.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

use ash::vk;

use super::error::GpuError;
use super::shaders::Shader;

/// What distinguishes the pipelines of a context.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct PipelineKind {
    pub(super) shaders: Vec<Shader>,
    /// Number and type of each binding.
    pub(super) bindings: Vec<(u32, vk::DescriptorType)>,
    /// Size of the push constants [bytes].
    pub(super) constants: u32,
    /// Depth test, formats of the colours and samples of a draw.
    pub(super) drawn: Option<(vk::CompareOp, Vec<vk::Format>, u32)>,
}

/// A pipeline with its layout and the layout of its descriptor set. They live as long as their context.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Pipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set_layout: vk::DescriptorSetLayout,
    pub(super) bind_point: vk::PipelineBindPoint,
}

impl Pipeline {
    /// Ends a pipeline that nothing uses any more.
    pub(super) fn destroy(&self, device: &ash::Device) {
        // SAFETY: it was never used, or the device is idle. Null handles may be destroyed.
        unsafe {
            device.destroy_pipeline(self.raw, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// The pipelines of all scenes so far.
#[derive(Debug, Default)]
pub(super) struct KeptPipelines(Mutex<BTreeMap<PipelineKind, Pipeline>>);

impl KeptPipelines {
    /// The pipeline of a kind, which is made where there is none.
    pub(super) fn get_or_make(
        &self,
        kind: PipelineKind,
        make: impl FnOnce(&PipelineKind) -> Result<Pipeline, GpuError>,
    ) -> Result<Pipeline, GpuError> {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = kept.get(&kind) {
            return Ok(*known);
        }
        let made = make(&kind)?;
        kept.insert(kind, made);
        Ok(made)
    }

    /// Ends all of them. The device is idle, and nothing uses them any more.
    pub(super) fn close(&self, device: &ash::Device) {
        let kept = std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner));
        kept.values().for_each(|pipeline| pipeline.destroy(device));
    }
}
