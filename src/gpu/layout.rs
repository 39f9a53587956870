//! Structures shared with GLSL, by what they are for. Their twins are in `glsl/types.glsl`, `glsl/sensor_types.glsl` and
//! `glsl/network_types.glsl`; a test compares both.

mod exchange;
mod image;
mod network;
mod sensor;
mod shadow;
mod shared;
mod step;

pub use exchange::{ExchangePass, ExchangePatch};
pub use image::{Band, Distant, DrawCommand, PlanetView, Reflector, Sampling, Shutter, Surroundings, Tracing, View};
pub use network::{HeaterStep, NetworkStage, NetworkStep};
pub use sensor::Sensor;
pub use shadow::{ShadowBox, ShadowTriangle, SunRay, SunView, rows, shadow_tree};
pub use shared::{Member, Structure};
pub use step::{FUSED_STEPS, HeatPass, Material, Step, Steps};

/// Distance between the joint slices of a uniform buffer [bytes]. Every device accepts it as an offset alignment.
pub const SLICE: usize = 256;

/// Every shared structure.
pub fn structures() -> Vec<Structure> {
    let all = [
        step::structures(),
        image::structures(),
        shadow::structures(),
        sensor::structures(),
        exchange::structures(),
        network::structures(),
    ];
    all.concat()
}
