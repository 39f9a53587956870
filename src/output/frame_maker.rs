//! Makes frames and their headers from the results of the engine.

use glam::DMat4;

use super::frame::{Frame, FrameHeader};
use crate::scene::Camera;
use crate::simulation::StepResult;
use crate::simulation::prepare::Prepared;

/// Makes the frames of one run. It holds the metadata that all steps share.
pub struct FrameMaker {
    header: FrameHeader,
}

impl FrameMaker {
    /// A maker for the frames of a scene on a device.
    pub fn new(prepared: &Prepared, camera: &Camera, device: &str) -> Self {
        let header = FrameHeader {
            scene: prepared.scene.name.clone(),
            scene_sha256: prepared.hash.clone(),
            device: device.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            band: prepared.scene.band,
            camera: camera.clone(),
            camera_from_body: DMat4::IDENTITY,
            parts: prepared.parts.clone(),
            materials: prepared.materials.iter().map(|material| material.name.clone()).collect(),
        };
        Self { header }
    }

    /// The frame of a step. `None` if the step was not drawn.
    pub fn frame(&self, result: StepResult) -> Option<(Frame, FrameHeader)> {
        let (pose, pixels) = (result.pose?, result.delivered.pixels?);
        let channel = |i: usize| pixels.radiance_temperature_depth.iter().map(|pixel| pixel[i]).collect();
        let label = |i: usize| pixels.identity.iter().map(|pixel| pixel[i]).collect();
        let frame = Frame {
            width: self.header.camera.width,
            height: self.header.camera.height,
            step: result.step,
            time: result.time,
            radiance: channel(0),
            temperature: channel(1),
            depth: channel(2),
            part: label(0),
            material: label(1),
        };
        Some((frame, FrameHeader { camera_from_body: DMat4::from(pose), ..self.header.clone() }))
    }
}
