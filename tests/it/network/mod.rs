//! Thermal networks against exact answers, published ones and an independent integrator; the device against f64.

pub mod barriers;
mod closed;
mod cold;
mod command;
mod device;
mod esatan;
mod exact;
mod family;
mod memory;
mod published;
mod random;
mod wide;
