//! The load of a step in the layout of the shaders: rounded to f32 and turned into the frame of each joint.

use glam::{DMat3, DVec3};

use super::{ALBEDO_VALUES, FUSED_ALBEDO_VALUES, FUSED_LOADS, FUSED_SUN_SAMPLES, STEP, SUN_SAMPLES};
use crate::environment::{MAX_SUN_SAMPLES, StepLoad, albedo};
use crate::gpu::error::GpuError;
use crate::gpu::layout::{self, FUSED_STEPS};
use crate::gpu::store::Resources;

/// Load of a step without its length.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct DeviceLoad {
    pub(crate) steps: Vec<layout::Step>,
    pub(crate) samples: Vec<[[f32; 4]; MAX_SUN_SAMPLES]>,
    pub(crate) albedo: Option<Vec<f32>>,
}

impl DeviceLoad {
    /// The load for the body and its joints.
    pub(crate) fn new(load: &StepLoad, joints: u32) -> Self {
        let frames: Vec<DMat3> = (0..joints).map(|joint| load.joint_from_body(joint)).collect();
        let samples = |frame: &DMat3| {
            // Unused samples have no flux.
            let mut samples = [[0.0f32; 4]; MAX_SUN_SAMPLES];
            for (sample, value) in samples.iter_mut().zip(&load.sun) {
                let d = *frame * value.direction;
                *sample = [d.x as f32, d.y as f32, d.z as f32, value.flux as f32];
            }
            samples
        };
        Self {
            steps: frames.iter().map(|frame| step_of(load, 0.0, *frame)).collect(),
            samples: frames.iter().map(samples).collect(),
            albedo: load.albedo.as_ref().map(|table| table.values.iter().map(|value| *value as f32).collect()),
        }
    }

    /// Writes the load for a step whose length is in steps of the scene.
    pub(crate) fn write(&self, resources: &mut Resources, slot: usize, step: f64) -> Result<(), GpuError> {
        let with_step = |one: &layout::Step| layout::Step { length: step as f32, ..*one };
        resources.write_slices(&STEP, slot, &self.steps.iter().map(with_step).collect::<Vec<_>>())?;
        resources.write_slices(&SUN_SAMPLES, slot, &self.samples)?;
        self.albedo.as_ref().map_or(Ok(()), |values| resources.write(&ALBEDO_VALUES, slot, values))
    }

    /// Writes the loads of a fused dispatch, each with its length in steps.
    pub(crate) fn write_fused(loads: &[(Self, f64)], resources: &mut Resources, slot: usize) -> Result<(), GpuError> {
        let count = loads.len() as f32;
        let joints = 0..loads.first().map_or(0, |(load, _)| load.steps.len());
        let step = |joint: usize, (load, length): &(Self, f64)| layout::Step {
            length: *length as f32,
            count,
            ..load.steps[joint]
        };
        let steps = |joint: usize| loads.iter().map(|load| step(joint, load)).collect();
        let samples = |joint: usize| loads.iter().map(|(load, _)| load.samples[joint]).collect();
        let steps: Vec<Vec<_>> = joints.clone().map(steps).collect();
        let samples: Vec<Vec<_>> = joints.map(samples).collect();
        resources.write_runs(&FUSED_LOADS, slot, FUSED_STEPS, &steps)?;
        resources.write_runs(&FUSED_SUN_SAMPLES, slot, FUSED_STEPS, &samples)?;
        let values: Vec<&[f32]> = loads.iter().filter_map(|(load, _)| load.albedo.as_deref()).collect();
        resources.write(&FUSED_ALBEDO_VALUES, slot, &values.concat())
    }
}

/// The load in the frame of one joint.
fn step_of(load: &StepLoad, step: f64, joint_from_body: DMat3) -> layout::Step {
    let planet = load.planet.as_ref();
    let extend = |v: DVec3, w: f64| [v.x as f32, v.y as f32, v.z as f32, w as f32];
    let sine = planet.map_or(0.0, |planet| 1.0 / planet.distance_ratio);
    let cosine = (1.0 - sine * sine).sqrt();
    // A mean over orientations has no directions, and its table is the same for all.
    let planet_axes = planet.filter(|planet| !planet.is_mean());
    let nadir = joint_from_body * planet_axes.map_or(DVec3::Z, |planet| planet.nadir);
    let sunward = joint_from_body * planet_axes.map_or(DVec3::X, |planet| planet.sunward);
    layout::Step {
        nadir: extend(nadir, sine),
        sunward: extend(sunward, cosine),
        across: extend(nadir.cross(sunward), 0.0),
        planet_ir: planet.map_or(0.0, |planet| planet.planet_ir) as f32,
        albedo_flux: planet.map_or(0.0, |planet| planet.albedo_flux) as f32,
        background_temperature_4: load.background_temperature.powi(4) as f32,
        length: step as f32,
        albedo_resolution: albedo::RESOLUTION as f32,
        count: 1.0,
        sun_sine: planet.map_or(0.0, |planet| planet.sun_zenith.sin()) as f32,
        sun_cosine: planet.map_or(1.0, |planet| planet.sun_zenith.cos()) as f32,
    }
}
