//! Reproduces the figures of "Real-time rasterization simulation of TIR images", Vural, Martin, Dunstan and
//! Sanchez-Gestido, 2023 (12th Int. Conf. on Guidance, Navigation & Control Systems).
//!
//! Figures 2 to 4 show a [`cube`] in orbit, solved as a thermal network (`orbits`). `orbit_figures` draws them, and
//! `scenario` compares them with the paper. `transitions` makes figures 5 and 6, and `visible` the left half of
//! figure 7. `checks` compares numbers, and `page` shows everything.

pub(crate) mod checks;
pub mod cube;
pub(crate) mod files;
#[cfg(test)]
mod independent_tests;
pub(crate) mod orbit_figures;
pub(crate) mod orbits;
pub(crate) mod page;
pub(crate) mod scenario;
pub(crate) mod transitions;
pub(crate) mod visible;
