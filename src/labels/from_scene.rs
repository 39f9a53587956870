//! Makes the craft of a prepared scene, and labelled images of a simulation.

use super::craft::Craft;
use super::image::{ImageChannels, ImageIdentity, JointPosition, LabelledImage};
use super::text::unique;
use crate::model::nodes::{GROUP, PADDING};
use crate::simulation::image::Image;
use crate::simulation::prepare::Prepared;

/// Name of the link that no joint moves.
pub(crate) const BODY: &str = "body";

/// The craft of a scene, without key points. The mesh is the drawn one.
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
        targets: Vec::new(),
    }
}

/// The labelled image of a scene's image at its time. `prepared` is the simulation's prepared scene at the moment of the image.
pub fn labelled(identity: ImageIdentity, prepared: &Prepared, image: Image) -> LabelledImage {
    let (positions, mut links) = prepared.loads.joints_at(image.time);
    if links.is_empty() {
        links.push(glam::DAffine3::IDENTITY);
    }
    let spreads = prepared.scene.sensor.as_ref().is_some_and(|sensor| sensor.spread.is_some());
    let sky = prepared.loads.sky_model().sky(image.time);
    let turn = image.camera_from_body.matrix3;
    let named = prepared.loads.joints().joints().iter().zip(positions);
    let joint = |(joint, position): (&crate::environment::joints::Joint, f64)| JointPosition {
        name: joint.name.clone(),
        position,
        turns: joint.turns(),
    };
    LabelledImage {
        identity,
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
        channels: ImageChannels {
            digital_numbers: image.digital_numbers,
            radiance: image.radiance,
            temperature: image.temperature,
            depth: image.depth,
            part: image.part,
            material: image.material,
            // The texels of a point spread have no part.
            samples: if spreads { 1 } else { image.camera.samples },
            coverage: image.coverage,
        },
    }
}
