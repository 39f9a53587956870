//! Vulkan: everything that runs on the device, and the only room with unsafe code.
//!
//! [`context`] opens a device; [`renderer`] holds a scene on it. What happens in a frame stands in [`frame`], in the words of
//! [`pass`].

mod bindings;
pub mod blackbody;
mod buffer_set;
pub mod compile;
pub mod context;
pub mod error;
pub mod frame;
pub mod hazard;
mod host_heap;
pub mod layout;
pub mod limits;
pub mod load;
pub mod memory;
pub mod network;
mod once;
pub mod pass;
pub mod pipeline;
mod record;
pub mod renderer;
pub mod resources;
pub mod response;
pub mod shapes;
pub mod timing;
mod validation;
pub mod variant;
pub mod wide_variant;
