//! Integration tests, one module a subject.

mod hazards;
mod model;
mod response;
mod scene;
mod shaders;
