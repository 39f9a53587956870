//! Integration tests, one module a subject.

mod hazards;
mod model;
mod scene;
mod shaders;
