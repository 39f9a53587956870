//! The load of a tick as the device reads it: rounded to f32, turned into the frame of every joint.

use glam::DMat3;

use super::layout;
use super::pass::Resource;
use super::record::tick_of;
use super::resources::Resources;
use crate::environment::{MAX_SUN_SAMPLES, TickLoad};

/// Ticks that one dispatch takes at most: TICKS of glsl/thermal_step.comp. Their Sun samples fill 4 of the 16 KiB that
/// every device reads as a uniform, and no driver ends a loop of so few turns (DESIGN.md 5).
pub const FUSED_TICKS: usize = 32;

/// What a tick commands, its length left out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DeviceLoad {
    ticks: Vec<layout::Tick>,
    samples: Vec<[[f32; 4]; MAX_SUN_SAMPLES]>,
    albedo: Option<Vec<f32>>,
}

impl DeviceLoad {
    /// For the body and its joints.
    pub fn new(load: &TickLoad, joints: u32) -> Self {
        let frames: Vec<DMat3> = (0..joints).map(|joint| load.joint_from_body(joint)).collect();
        let samples = |frame: &DMat3| {
            // Samples beyond those of the tick have no flux.
            let mut samples = [[0.0f32; 4]; MAX_SUN_SAMPLES];
            for (sample, value) in samples.iter_mut().zip(&load.sun) {
                let d = *frame * value.direction;
                *sample = [d.x as f32, d.y as f32, d.z as f32, value.flux as f32];
            }
            samples
        };
        Self {
            ticks: frames.iter().map(|frame| tick_of(load, 0.0, *frame)).collect(),
            samples: frames.iter().map(samples).collect(),
            albedo: load.albedo.as_ref().map(|table| table.values.iter().map(|value| *value as f32).collect()),
        }
    }

    /// Writes it for a tick of a length in steps.
    pub fn write(&self, resources: &mut Resources, slot: usize, step: f64) {
        let with_step = |tick: &layout::Tick| layout::Tick { step: step as f32, ..*tick };
        resources.write_slices(Resource::Tick, slot, &self.ticks.iter().map(with_step).collect::<Vec<_>>());
        resources.write_slices(Resource::SunSamples, slot, &self.samples);
        if let Some(values) = &self.albedo {
            resources.write(Resource::AlbedoValues, slot, values);
        }
    }

    /// Writes the loads of a fused dispatch over a craft whose parts stand still, each with its length in steps.
    pub fn write_fused(loads: &[(Self, f64)], resources: &mut Resources, slot: usize) {
        let count = loads.len() as f32;
        let ticks = loads.iter().map(|(load, step)| layout::Tick { step: *step as f32, count, ..load.ticks[0] });
        resources.write(Resource::FusedTicks, slot, &ticks.collect::<Vec<_>>());
        let samples: Vec<_> = loads.iter().map(|(load, _)| load.samples[0]).collect();
        resources.write(Resource::FusedSunSamples, slot, &samples);
        let values: Vec<f32> = loads.iter().flat_map(|(load, _)| load.albedo.iter().flatten().copied()).collect();
        if !values.is_empty() {
            resources.write(Resource::FusedAlbedoValues, slot, &values);
        }
    }
}
