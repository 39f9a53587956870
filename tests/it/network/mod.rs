//! Thermal networks in f64 against exact answers, published ones and an independent integrator.

mod exact;
mod family;
mod random;
