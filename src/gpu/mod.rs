//! The Vulkan renderer and thermal solver. All unsafe code of the program is in this module.
//!
//! [`context`] opens a device. [`renderer`] holds a scene on it. [`frame`] puts the passes of its [`effects`] in order.

#![allow(unreachable_pub)]

pub mod accesses;
mod bindings;
pub mod blackbody;
pub mod compile;
pub mod context;
mod drivers;
pub mod effects;
pub mod error;
pub mod exchange_rays;
pub mod frame;
mod host_heap;
pub mod layout;
pub mod limits;
pub mod lists;
pub mod memory;
mod once;
pub mod pass;
pub mod pipeline;
pub mod plan;
mod record;
pub mod reflect;
pub mod renderer;
pub mod request;
pub mod resource;
pub mod response;
pub mod samples;
pub mod scene_data;
pub mod scene_frames;
pub mod shaders;
pub mod shapes;
mod store;
pub mod timing;
mod transfer;
mod validation;
