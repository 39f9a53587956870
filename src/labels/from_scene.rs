//! Makes the craft of a prepared scene, and labelled images of a simulation.

use super::craft::Craft;
use super::image::{JointPosition, LabelledImage, Split};
use super::text::unique;
use crate::model::nodes::{GROUP, PADDING};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;

/// Name of the link that no joint moves.
pub const BODY: &str = "body";

/// The craft of a scene, without key points. Its mesh is the one that is drawn.
pub fn craft(prepared: &Prepared) -> Craft {
    let nodes = &prepared.nodes;
    let slots = || nodes.node_of_vertex.iter().map(|slot| *slot as usize);
    let mut link_of_part = vec![0; prepared.parts.len()];
    for slot in slots() {
        link_of_part[nodes.group_part[slot / GROUP] as usize] = nodes.joint(slot);
    }
    let drawn = prepared.triangle_runs.iter().map(|run| run.triangles.0 as usize..run.triangles.1 as usize);
    let of_node = |node: u32| nodes.vertex_of_node[node as usize];
    let triangles = drawn.flat_map(|run| &prepared.triangles[run]).map(|triangle| triangle.map(of_node));
    let joints = prepared.loads.joints().joints().iter().map(|joint| joint.name.clone());
    let links: Vec<String> = std::iter::once(BODY.to_owned()).chain(joints).collect();
    Craft {
        name: prepared.scene.name.clone(),
        parts: unique(&prepared.parts),
        materials: prepared.materials.iter().map(|material| material.name.clone()).collect(),
        links: unique(&links),
        link_of_part,
        positions: slots().map(|slot| nodes.positions[slot].as_dvec3()).collect(),
        normals: slots().map(|slot| nodes.normals[slot]).collect(),
        vertex_part: slots().map(|slot| nodes.group_part[slot / GROUP]).collect(),
        triangles: triangles.filter(|triangle| triangle.iter().all(|vertex| *vertex != PADDING)).collect(),
        key_points: Vec::new(),
        symmetries: Vec::new(),
    }
}

/// What an image is in its data set.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    /// Number of the sample in the data set, from 0.
    pub sample: u64,
    /// Number of the orbit.
    pub orbit: u32,
    /// Number of the image in its orbit, from 0.
    pub number: u32,
    /// What the images of the orbit are for.
    pub split: Split,
    /// Bits of the digital numbers: 8, 14 or 16.
    pub bits: u32,
    /// State and settings of the sensor by name. Each name ends with its unit.
    pub sensor: Vec<(String, f64)>,
    /// What was drawn for this sample by name.
    pub drawn: Vec<(String, f64)>,
}

/// The labelled image of a scene's image at its time. `prepared` is that of the simulation when it took the image.
pub fn labelled(place: Place, prepared: &Prepared, image: Image) -> LabelledImage {
    let (positions, mut links) = prepared.loads.joints_at(image.time);
    if links.is_empty() {
        links.push(glam::DAffine3::IDENTITY);
    }
    let sky = prepared.loads.sky_model().sky(image.time);
    let turn = image.camera_from_body.matrix3;
    let named = prepared.loads.joints().joints().iter().zip(positions);
    let joint = |(joint, position): (&crate::environment::joints::Joint, f64)| JointPosition {
        name: joint.name.clone(),
        position,
        turns: joint.turns(),
    };
    LabelledImage {
        sample: place.sample,
        orbit: place.orbit,
        number: place.number,
        split: place.split,
        width: image.camera.width,
        height: image.camera.height,
        lens: image.camera.lens,
        near: image.camera.near,
        line_time: image.camera.line_time,
        time: image.time,
        camera_from_body: image.camera_from_body,
        links,
        joints: named.map(joint).collect(),
        sun: turn * sky.sun_direction,
        lit: sky.lit_fraction,
        planet: turn * sky.nadir_direction,
        planet_radius: (1.0 / sky.distance_ratio).asin(),
        sensor: place.sensor,
        drawn: place.drawn,
        bits: place.bits,
        digital_numbers: image.digital_numbers,
        radiance: image.radiance,
        temperature: image.temperature,
        depth: image.depth,
        part: image.part,
        material: image.material,
        coverage: image.coverage,
    }
}
