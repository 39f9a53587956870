//! Thermal networks against exact and published solutions and an independent integrator.

mod closed;
mod cold;
pub mod command;
mod esatan;
mod exact;
mod family;
mod memory;
mod published;
mod random;
mod rendered;
pub mod tmd;
mod trips;
