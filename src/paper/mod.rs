//! The paper's figures, made again: "Real-time rasterization simulation of TIR images", Vural, Martin, Dunstan and
//! Sanchez-Gestido, 2023 (12th Int. Conf. on Guidance, Navigation & Control Systems).
//!
//! Figures 2, 3 and 4 are a [`cube`] in orbit, solved as a thermal network ([`orbits`]), drawn by [`orbit_figures`] and
//! held against what the paper says of it by [`scenario`]. [`transitions`] are figures 5 and 6, and [`visible`] is the
//! left half of figure 7; [`checks`] hold the paper's numbers against ours, and [`page`] shows all of it.

pub(crate) mod checks;
pub mod cube;
pub(crate) mod files;
#[cfg(test)]
mod independent;
pub(crate) mod orbit_figures;
pub(crate) mod orbits;
pub(crate) mod page;
pub(crate) mod scenario;
pub(crate) mod transitions;
pub(crate) mod visible;
