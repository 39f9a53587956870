//! Everything about one image in one JSON file: what other formats have no place for.

use glam::{DAffine3, DVec3};
use serde_json::{Map, Value, json};

use super::bop::rows;
use super::craft::Craft;
use super::image::LabelledImage;
use super::key_points::Seen;
use super::text::line;

/// The steps of the maps of an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    /// Of depths [mm].
    pub depth: f64,
    /// Of temperatures [K].
    pub temperature: f64,
}

/// The text of `label/NUMBER.json`. Each key ends with its unit where it has one.
pub fn label(craft: &Craft, image: &LabelledImage, seen: &[Seen], steps: Steps) -> String {
    let turn = image.quaternion();
    let (model, numbers) = image.distortion();
    let pose = |pose: &DAffine3| json!({ "R": rows(pose), "t_m": pose.translation.to_array() });
    let mut body = pose(&image.camera_from_body);
    body["q_wxyz"] = json!([turn.w, turn.x, turn.y, turn.z]);
    let links = craft.links.iter().zip(&image.links).map(|(name, link)| (name.clone(), pose(link)));
    let joint = |joint: &super::image::JointPosition| {
        let unit = if joint.turns { "rad" } else { "m" };
        json!({ "name": joint.name, "position": joint.position, "unit": unit })
    };
    let point = |(point, seen): (&super::key_points::KeyPoint, &Seen)| {
        json!({
            "name": point.name,
            "camera_m": seen.point.to_array(),
            "pixel": seen.pixel.map(|pixel| pixel.to_array()),
            "visibility": seen.visibility as u8,
        })
    };
    let named = |numbers: &[(String, f64)]| {
        Value::Object(numbers.iter().map(|(name, number)| (name.clone(), json!(number))).collect::<Map<_, _>>())
    };
    let direction = |vector: DVec3| json!(vector.to_array());
    let label = json!({
        "sample": image.sample,
        "orbit": image.orbit,
        "image": image.number,
        "split": image.split.name(),
        "time_s": image.time,
        "width": image.width,
        "height": image.height,
        "bits": image.bits,
        "camera": {
            "matrix": image.camera_matrix(),
            "distortion": { "model": model, "numbers": numbers },
            "line_time_s": image.line_time,
        },
        "camera_from_body": body,
        "body_from_link": Value::Object(links.collect()),
        "joints": image.joints.iter().map(joint).collect::<Vec<_>>(),
        "key_points": craft.key_points.iter().zip(seen).map(point).collect::<Vec<_>>(),
        "sun_direction": direction(image.sun),
        "sun_visible": image.lit,
        "planet_direction": direction(image.planet),
        "planet_radius_rad": image.planet_radius,
        "sensor": named(&image.sensor),
        "drawn": named(&image.drawn),
        "depth_step_mm": steps.depth,
        "temperature_step_K": steps.temperature,
    });
    line(label) + "\n"
}
