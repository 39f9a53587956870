//! Radiation between surfaces: view factors with known answers, exchange with closed forms, and the device against its f64 twin.

mod defects;
mod device;
mod floor;
mod joints;
mod layers;
mod mirrors;
mod shapes;
mod step;
mod view_factors;
