//! Integration tests, one module a subject.

mod hazards;
mod shaders;
