//! Integration tests, one module a subject.

mod hazards;
mod model;
mod paper;
mod program;
mod response;
mod response_fit;
mod scene;
mod shaders;
