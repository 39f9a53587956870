//! The Vulkan renderer and thermal solver. All unsafe code of the program is in this module.
//!
//! [`context`] opens a device. [`renderer`] holds a scene on it. [`frame`] lists the passes of a frame.

#![allow(unreachable_pub)]

mod bindings;
pub mod blackbody;
pub mod compile;
pub mod context;
mod drivers;
pub mod error;
pub mod exchange;
pub mod exchange_rays;
pub mod exchange_variant;
pub mod frame;
pub mod heat;
mod heat_source;
mod host_heap;
pub mod layout;
pub mod limits;
pub mod lists;
pub mod load;
pub mod memory;
mod once;
pub mod one_pass;
pub mod one_pass_variant;
pub mod pass;
pub mod pipeline;
pub mod radiance_variant;
mod record;
pub mod renderer;
pub mod resource;
pub mod resource_row;
pub mod resources;
pub mod response;
pub mod samples;
pub mod sampling;
pub mod sensor;
pub mod sensor_variant;
pub mod shaders;
pub mod shapes;
mod store;
pub mod timing;
mod transfer;
mod validation;
pub mod variant;
