//! Makes frames and their headers from the results of the engine.

use glam::{DAffine3, DMat3, DMat4, DVec2};

use super::OutputError;
use super::frame::{Frame, FrameHeader};
use crate::model::nodes::GROUP;
use crate::scene::Camera;
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;
use crate::simulation::{StepResult, pose_of};

/// Makes the frames of one run, with the metadata that all steps share.
pub struct FrameMaker<'a> {
    prepared: &'a Prepared,
    header: FrameHeader,
}

impl<'a> FrameMaker<'a> {
    /// A maker for the frames of a scene on a device.
    pub fn new(prepared: &'a Prepared, camera: &Camera, device: &str) -> Self {
        let header = FrameHeader {
            scene: prepared.scene.name.clone(),
            scene_sha256: prepared.hashes.all.clone(),
            device: device.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            band: prepared.scene.band,
            camera: camera.clone(),
            camera_from_body: DMat4::IDENTITY,
            camera_from_orbit: None,
            camera_from_inertial: None,
            last_row_from_body: None,
            joints: Vec::new(),
            parts: prepared.parts.clone(),
            materials: prepared.materials.iter().map(|material| material.name.clone()).collect(),
        };
        Self { prepared, header }
    }

    /// The frame of a step. `None` if the step was not drawn.
    ///
    /// # Errors
    /// A number that is not finite, with the step, the pixel, the part and the nearest node.
    pub fn frame(&self, result: StepResult) -> Result<Option<(Frame, FrameHeader)>, OutputError> {
        let (Some(pose), Some(pixels)) = (result.pose, result.delivered.pixels) else { return Ok(None) };
        let image = Image::new(self.header.camera.clone(), pose, result.time, pixels);
        self.frame_of(image, result.step, result.image).map(Some)
    }

    /// The frame of an image in the interval of a step, with its number where it has its own time.
    ///
    /// # Errors
    /// As for `frame`.
    pub(crate) fn frame_of(
        &self,
        image: Image,
        step: u32,
        number: Option<u32>,
    ) -> Result<(Frame, FrameHeader), OutputError> {
        let pose = image.camera_from_body;
        let frame = Frame {
            width: image.camera.width,
            height: image.camera.height,
            step,
            image: number,
            time: image.time,
            radiance: image.radiance,
            temperature: image.temperature,
            depth: image.depth,
            part: image.part,
            material: image.material,
            coverage: image.coverage,
            reflected: self.prepared.scene.surrounded.channels.then_some(image.reflected),
        };
        frame.check_finite_of(|pixel| self.shown(&frame, pixel, &pose))?;
        let header = self.header_at(frame.time, frame.image, &pose);
        Ok((frame, header))
    }

    /// The header of an image at a time [s] from a pose.
    fn header_at(&self, time: f64, image: Option<u32>, pose: &DAffine3) -> FrameHeader {
        let loads = &self.prepared.loads;
        let sky = loads.sky_model().sky(time);
        let turned = |body_from: DMat3| DMat4::from(*pose) * DMat4::from_mat3(body_from);
        let names = loads.joints().joints().iter().map(|joint| joint.name.clone());
        let poses = loads.joints_at(time).1.into_iter().skip(1).map(DMat4::from);
        // A frame was drawn, so the camera has a pose.
        let camera = self.header.camera.at(time, image).unwrap_or_else(|_| self.header.camera.clone());
        let last_row = time + camera.shutter_time();
        FrameHeader {
            camera_from_body: DMat4::from(*pose),
            camera_from_orbit: Some(turned(sky.body_from_orbit)),
            camera_from_inertial: Some(turned(sky.body_from_inertial)),
            last_row_from_body: (camera.line_time > 0.0)
                .then(|| pose_of(self.prepared, last_row, image).map(DMat4::from))
                .flatten(),
            joints: names.zip(poses).collect(),
            camera,
            ..self.header.clone()
        }
    }

    /// The part at a pixel, and the node of this part that is nearest to the point at the pixel. Without a depth the node is the one nearest to the
    /// line of sight.
    fn shown(&self, frame: &Frame, pixel: usize, pose: &DAffine3) -> String {
        let Some(part) = frame.part[pixel].checked_sub(1) else { return "the background".to_owned() };
        let camera = &self.header.camera;
        let place = [pixel % frame.width as usize, pixel / frame.width as usize].map(|place| place as f64 + 0.5);
        let ray = camera.lens.unproject(DVec2::from(place)).unwrap_or_default();
        let depth = f64::from(frame.depth[pixel]);
        let nodes = self.prepared.nodes_at(frame.time);
        let distance = |node: &u32| {
            let in_camera = pose.transform_point3(nodes.positions[*node as usize].as_dvec3());
            let there = ray.extend(1.0) * if depth.is_finite() { depth } else { in_camera.z };
            in_camera.distance(there)
        };
        let of_part = nodes.node_of_vertex.iter().filter(|node| nodes.group_part[**node as usize / GROUP] == part);
        let node = of_part.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let name = self.header.parts.get(part as usize).map_or("", String::as_str);
        format!("part {name}, node {}", node.copied().unwrap_or(0))
    }
}
