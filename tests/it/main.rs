//! Integration tests, one module a subject.

mod band_radiance;
mod craft;
mod device;
mod hazards;
mod image;
mod model;
mod orbit;
mod pictures;
mod properties;
mod quads;
mod scene;
mod shaders;
mod transitions;
mod twins;
mod validation;
