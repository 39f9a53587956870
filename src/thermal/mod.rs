//! Thermal mathematics of a node in f64: responses, retarget rules, radiative balance, band radiance.
//!
//! This room does not use Vulkan or files. Every function that also runs on the device has the same name in `glsl/`.

pub(crate) mod balance;
pub(crate) mod between;
pub(crate) mod brightness;
pub(crate) mod budget;
pub(crate) mod crinkle;
pub(crate) mod emissivity;
pub(crate) mod emissivity_table;
pub(crate) mod fit;
pub(crate) mod function;
pub(crate) mod incident;
pub(crate) mod least_squares;
pub(crate) mod lobe;
pub(crate) mod local_step;
pub(crate) mod material;
pub(crate) mod memory;
pub(crate) mod misfit;
pub(crate) mod network;
pub(crate) mod passband;
pub(crate) mod planck;
pub(crate) mod planet_map;
pub(crate) mod radiance;
pub(crate) mod radiative;
pub(crate) mod ratio;
pub(crate) mod received;
pub(crate) mod reference;
pub(crate) mod sensor;
pub(crate) mod shell;
pub(crate) mod step_response;
pub(crate) mod surroundings;
pub(crate) mod transition;

/// Stefan-Boltzmann constant [W m-2 K-4], CODATA 2018 (exact to the digits given).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;
