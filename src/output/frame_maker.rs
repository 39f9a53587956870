//! Makes frames and their headers from the results of the engine.

use glam::{DMat3, DMat4, DVec2};

use super::OutputError;
use super::frame::{FrameHeader, check_finite};
use crate::model::nodes::GROUP;
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
    pub fn new(prepared: &'a Prepared, device: &str) -> Self {
        let header = FrameHeader {
            scene: prepared.scene.name.clone(),
            scene_sha256: prepared.hashes.all.clone(),
            device: device.to_owned(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            band: prepared.scene.band,
            bands: prepared.scene.bands.iter().map(|band| (band.name.clone(), band.passband.band)).collect(),
            step: 0,
            image: None,
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
    pub fn frame(&self, result: StepResult) -> Result<Option<(Image, FrameHeader)>, OutputError> {
        let Some(image) = result.delivered.image else { return Ok(None) };
        let header = self.header(&image, result.step, result.image)?;
        Ok(Some((image, header)))
    }

    /// The header of an image in the interval of a step, with its number where it has its own time.
    ///
    /// # Errors
    /// As for `frame`.
    pub(crate) fn header(&self, image: &Image, step: u32, number: Option<u32>) -> Result<FrameHeader, OutputError> {
        check_finite(image, step, |pixel| self.shown(image, pixel))?;
        let loads = &self.prepared.loads;
        let sky = loads.sky_model().sky(image.time);
        let turned = |body_from: DMat3| DMat4::from(image.camera_from_body) * DMat4::from_mat3(body_from);
        let names = loads.joints().joints().iter().map(|joint| joint.name.clone());
        let poses = loads.joints_at(image.time).1.into_iter().skip(1).map(DMat4::from);
        let last_row = image.time + image.camera.shutter_time();
        Ok(FrameHeader {
            step,
            image: number,
            camera_from_orbit: Some(turned(sky.body_from_orbit)),
            camera_from_inertial: Some(turned(sky.body_from_inertial)),
            last_row_from_body: (image.camera.line_time > 0.0)
                .then(|| pose_of(self.prepared, last_row, number).map(DMat4::from))
                .flatten(),
            joints: names.zip(poses).collect(),
            ..self.header.clone()
        })
    }

    /// The part at a pixel, and the node of this part that is nearest to the point at the pixel. Without a depth the node is the one nearest to the
    /// line of sight.
    fn shown(&self, image: &Image, pixel: usize) -> String {
        let Some(part) = image.part[pixel].checked_sub(1) else { return "the background".to_owned() };
        let place =
            [pixel % image.camera.width as usize, pixel / image.camera.width as usize].map(|place| place as f64 + 0.5);
        let ray = image.camera.lens.unproject(DVec2::from(place)).unwrap_or_default();
        let depth = f64::from(image.depth[pixel]);
        let nodes = self.prepared.nodes_at(image.time);
        let distance = |node: &u32| {
            let in_camera = image.camera_from_body.transform_point3(nodes.positions[*node as usize].as_dvec3());
            let there = ray.extend(1.0) * if depth.is_finite() { depth } else { in_camera.z };
            in_camera.distance(there)
        };
        let of_part = nodes.node_of_vertex.iter().filter(|node| nodes.group_part[**node as usize / GROUP] == part);
        let node = of_part.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let name = self.header.parts.get(part as usize).map_or("", String::as_str);
        format!("part {name}, node {}", node.copied().unwrap_or(0))
    }
}
