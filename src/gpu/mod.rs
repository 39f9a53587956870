//! The Vulkan renderer and thermal solver. All unsafe code of the program is in this module.
//!
//! [`context`] opens a device. [`renderer`] holds a scene on it. [`frame`] puts the passes of its [`effects`] in order.

pub(crate) mod accesses;
pub(crate) mod bindings;
pub(crate) mod blackbody;
pub(crate) mod compile;
pub(crate) mod context;
mod drivers;
pub(crate) mod effects;
pub(crate) mod error;
pub(crate) mod frame;
pub(crate) mod host_heap;
mod instance;
mod kept_pipelines;
pub(crate) mod layout;
pub(crate) mod limits;
pub(crate) mod lists;
pub(crate) mod memory;
mod once;
pub(crate) mod pass;
pub(crate) mod pipeline;
mod pipeline_cache;
pub(crate) mod plan;
mod record;
pub(crate) mod reflect;
pub(crate) mod renderer;
pub(crate) mod request;
pub(crate) mod resource;
pub(crate) mod response;
pub(crate) mod samples;
pub(crate) mod scene_data;
pub(crate) mod scene_frames;
pub(crate) mod shaders;
pub(crate) mod shapes;
mod spirv;
mod store;
pub(crate) mod timing;
mod transfer;
mod validation;
mod witness;
