//! Where the probes are in the body frame and in an image, and which of them the craft hides.

use glam::{DAffine3, DVec2, DVec3};
use serde::Serialize;

use crate::model::nodes::{GROUP, Nodes};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;

/// A surface lies before a probe if it is nearer by more than this share of the distance, and by more than so many pixels at that distance.
const BEFORE: f64 = 1e-3;
const BEFORE_PIXELS: f64 = 4.0;

/// The place of a probe at the time of an image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct ProbePlace {
    /// In the body frame [m].
    position: [f64; 3],
    /// In the image [px], where the camera has it in front of it.
    pixel: Option<[f64; 2]>,
    /// Whether another surface lies before it.
    hidden: bool,
}

/// The places of probes in an image. Each probe is a vertex of the model.
pub(crate) fn probe_places(prepared: &Prepared, probes: impl Iterator<Item = usize>, image: &Image) -> Vec<ProbePlace> {
    let joints = prepared.loads.joints_at(image.time).1;
    let place = |probe: usize| {
        let slot = prepared.nodes.node_of_vertex[probe] as usize;
        place(image, posed(&prepared.nodes, &joints, slot), prepared.nodes.group_part[slot / GROUP])
    };
    probes.map(place).collect()
}

/// Position of a node in the body frame [m], with the poses of the joints.
pub(crate) fn posed(nodes: &Nodes, joints: &[DAffine3], slot: usize) -> DVec3 {
    let position = nodes.positions[slot].as_dvec3();
    joints.get(nodes.joint(slot) as usize).map_or(position, |pose| pose.transform_point3(position))
}

fn place(image: &Image, position: DVec3, part: u32) -> ProbePlace {
    let at = image.camera_from_body.transform_point3(position);
    let lens = &image.camera.lens;
    let pixel = (at.z > image.camera.near).then(|| lens.project(DVec2::new(at.x, at.y) / at.z));
    let [width, height] = image.size();
    let slack = at.z * (BEFORE_PIXELS / lens.focal[0].min(lens.focal[1])).max(BEFORE);
    let shows = |column: i64, row: i64| {
        let inside = (0..i64::from(width)).contains(&column) && (0..i64::from(height)).contains(&row);
        let pixel = (row * i64::from(width) + column) as usize;
        inside && image.part[pixel] == part + 1 && f64::from(image.depth[pixel]) > at.z - slack
    };
    // A node on the border of its part lies between pixels of which some show the part.
    let near = |pixel: DVec2| {
        let [column, row] = [pixel.x.floor() as i64, pixel.y.floor() as i64];
        (-1..=1).any(|down| (-1..=1).any(|right| shows(column + right, row + down)))
    };
    ProbePlace {
        position: position.to_array(),
        pixel: pixel.map(|pixel| pixel.to_array()),
        hidden: !pixel.is_some_and(near),
    }
}
