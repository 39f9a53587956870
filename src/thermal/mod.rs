//! Thermal mathematics of a node in f64: responses, retarget rules, radiative balance, band radiance.
//!
//! This room does not use Vulkan or files. Every function that also runs on the device has the same name in `glsl/`.

pub mod balance;
pub mod between;
pub mod brightness;
pub mod crinkle;
pub mod emissivity;
pub mod emissivity_table;
pub mod fit;
pub mod function;
pub mod incident;
pub mod least_squares;
pub mod lobe;
pub mod local_step;
pub mod material;
pub mod network;
pub mod planck;
pub mod planet_map;
pub mod radiance;
pub mod radiative;
pub mod received;
pub mod reference;
pub mod sensor;
pub mod shell;
pub mod step_response;
pub mod surroundings;
pub mod transition;

/// Stefan-Boltzmann constant [W m-2 K-4], CODATA 2018 (exact to the digits given).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;
