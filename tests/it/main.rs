//! Integration tests, one module a subject.

mod band_radiance;
mod craft;
mod cull;
mod device;
mod hazards;
mod image;
mod model;
mod orbit;
mod pictures;
mod quads;
mod scene;
mod shaders;
mod transitions;
mod twins;
mod validation;
