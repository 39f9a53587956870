//! Integration tests, one module a subject.

mod band_radiance;
mod commands;
mod compare;
mod craft;
mod cull;
mod device;
mod functions;
mod hazards;
mod image;
mod mesh_network;
mod model;
mod network;
mod orbit;
mod paper;
mod pictures;
mod program;
mod properties;
mod quads;
mod response;
mod response_fit;
mod run;
mod scene;
mod shaders;
mod transitions;
mod twins;
mod validation;
