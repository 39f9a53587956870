//! Isotherm renders thermal-infrared images of spacecraft whose surfaces store heat.
//!
//! [`Simulation`] loads a scene, steps it and takes its images. `docs/library.md` has a program that closes a loop with it.
//!
//! The modules stand in the order of the data:
//!
//! - `scene`: the scene file, checked
//! - `model`: triangles, parts and materials of a glTF file
//! - `environment`: Sun and planet in the body frame
//! - `thermal`: the mathematics of a node in f64
//! - `gpu`: the same in f32 on Vulkan
//! - `simulation`: the loop that steps, draws and collects
//! - `guard`: what is probably wrong in a scene
//! - `output`: images, plots and report
//! - `labels`: what those who train on images want to know of them
//! - `view`: the page of `isotherm view`
//!
//! `server` serves images to simulators in other programs. `compare` runs one scene under three responses. `converge` refines the settings of a scene until they no longer matter. `sensitivity` changes the values of a scene one by one. `fit` finds the values that explain measurements. `paper` makes the figures of Vural et al. 2023. `bench` measures speed and error. `trace`
//! records what host and device did. `text` makes names safe to show, and finds the one that is meant. `lens` tells which ray a pixel sees.

#![cfg_attr(feature = "programs", deny(unreachable_pub))]
// Without the programs much of what they open is not used.
#![cfg_attr(not(feature = "programs"), allow(dead_code, unused_imports, unused_macros))]

#[cfg(feature = "programs")]
mod bench;
#[cfg(feature = "programs")]
mod cli;
mod compare;
mod converge;
#[cfg(feature = "datasets")]
mod dataset;
mod environment;
mod exchange;
mod files;
mod fit;
mod gpu;
mod guard;
mod host;
#[cfg(feature = "programs")]
pub mod internals;
#[cfg(feature = "datasets")]
mod labels;
mod lens;
mod misspelt;
mod model;
mod output;
pub mod package;
#[cfg(feature = "programs")]
mod paper;
mod raster;
mod scene;
mod sensitivity;
#[cfg(feature = "programs")]
mod server;
mod simulation;
mod stop;
mod text;
mod thermal;
mod trace;
#[cfg(feature = "programs")]
mod view;

#[cfg(feature = "programs")]
pub use cli::main;
#[cfg(feature = "datasets")]
pub use dataset::error::DatasetError;
pub use environment::Sky;
pub use environment::placements::PlaceError;
pub use files::Reach;
pub use gpu::error::GpuError;
pub use lens::{Distortion, Lens};
pub use model::ModelError;
pub use scene::{Camera, CameraFrame, Motion, MotionBlur, Scene, SceneError};
pub use simulation::engine::EngineError;
pub use simulation::facade::temperatures::PartTemperature;
pub use simulation::facade::{Placement, Simulation};
pub use simulation::facade_error::SimulationError;
pub use simulation::image::Image;
pub use simulation::pose::{CameraError, Pose};
pub use simulation::prepare_error::PrepareError;
pub use simulation::target::Target;

/// Compiles and runs the program in `docs/library.md`.
#[cfg(doctest)]
#[doc = include_str!("../docs/library.md")]
mod library {}
