//! The paper's figures, made again: "Real-time rasterization simulation of TIR images", Vural, Martin, Dunstan and
//! Sanchez-Gestido, 2023 (12th Int. Conf. on Guidance, Navigation & Control Systems).
//!
//! [`transitions`] are figures 5 and 6, and [`visible`] is the left half of figure 7; [`scenario`] is what the paper says
//! of its orbit and its insulated faces; [`checks`] hold the paper's numbers against ours, and [`page`] shows all of it.
//! Figures 2 to 4 follow from heat capacity and conduction, which need the thermal network, and are not made here.

pub mod checks;
pub mod folder;
pub mod page;
pub mod scenario;
pub mod transitions;
pub mod visible;

/// What is left out, for those who look for it.
pub const LEFT_OUT: &str =
    "figures 2 to 4 are left out: they follow from heat capacity and conduction, which need the thermal network";
