//! Isotherm renders what a thermal-infrared camera sees of a spacecraft, with a thermal memory.
//!
//! The order of the modules is the order of the data:
//!
//! [`scene`] what the user wrote, checked -> [`model`] triangles, parts and materials of a glTF file ->
//! [`environment`] Sun and planet as the body sees them -> [`thermal`] the mathematics of a node in f64 ->
//! [`gpu`] the same in f32 on Vulkan -> [`simulation`] the loop: step, draw, collect -> [`output`] images, plots, report.
//! [`compare`] runs one scene under three responses, [`paper`] makes the figures of the paper that this follows, and [`bench`]
//! measures speed against error with all of them. [`trace`] shows when what was done.

pub mod bench;
pub mod cli;
pub mod compare;
pub mod environment;
pub mod gpu;
pub mod host;
pub mod model;
pub mod output;
pub mod paper;
pub mod raster;
pub mod scene;
pub mod simulation;
pub mod thermal;
pub mod trace;

/// The program in `docs/library.md` compiles and runs.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
mod library {}
