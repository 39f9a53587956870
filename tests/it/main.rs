//! Integration tests, one module a subject.

mod device;
mod hazards;
mod model;
mod scene;
mod shaders;
mod twins;
