//! Thermal networks against exact and published solutions and an independent integrator, and the device against f64.

pub mod barriers;
mod closed;
mod cold;
pub mod command;
mod device;
mod esatan;
mod exact;
mod family;
mod memory;
mod published;
mod random;
mod rendered;
mod sheets;
pub mod tmd;
