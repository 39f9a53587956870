//! Structures shared with GLSL, by what they are for. Their twins are in `glsl/types.glsl`, `glsl/sensor_types.glsl` and
//! `glsl/network_types.glsl`; a test compares both.

mod exchange;
mod image;
mod network;
mod sensor;
mod shadow;
mod shared;
mod step;

pub(crate) use exchange::{ExchangePass, ExchangePatch, ExchangeRow};
pub use image::View;
pub(crate) use image::{
    Band, Distant, DrawCommand, PlanetView, Reflector, Sampling, Shutter, ShutterSky, Surroundings, Tracing,
};
pub(crate) use network::{HeaterStep, NetworkStage, NetworkStep};
pub(crate) use sensor::Sensor;
pub(crate) use shadow::{ShadowBox, ShadowTriangle, rows, shadow_tree};
pub(crate) use shared::Structure;
pub use step::FUSED_STEPS;
pub use step::Material;
pub(crate) use step::{HeatPass, Step, Steps};

/// Alignment of the joint slices of a uniform buffer [bytes]. Every device accepts it for an offset.
const SLICE: usize = 256;

/// Distance between the joint slices of a uniform buffer whose slices hold so many bytes [bytes].
pub(crate) const fn slice_of(bytes: usize) -> usize {
    bytes.next_multiple_of(SLICE)
}

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
