//! Integration tests, one module a subject.

mod cull;
mod hazards;
mod model;
mod scene;
mod shaders;
