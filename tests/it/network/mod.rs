//! Thermal networks in f64 against exact answers, published ones and an independent integrator.

mod closed;
mod command;
mod esatan;
mod exact;
mod family;
mod published;
mod random;
