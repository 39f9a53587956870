//! Integration tests, one module a subject.

mod band_radiance;
mod device;
mod hazards;
mod model;
mod orbit;
mod scene;
mod shaders;
mod transitions;
mod twins;
