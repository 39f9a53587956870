//! Everything about one image in one JSON file, with the values that other formats have no place for.

use glam::{DAffine3, DVec3};
use serde_json::{Map, Value, json};

use super::bop::rows;
use super::craft::Craft;
use super::image::LabelledImage;
use super::key_points::ImageKeyPoint;
use super::text::line;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MapSteps {
    /// Of depths [mm].
    pub(crate) depth: f64,
    /// Of temperatures [K].
    pub(crate) temperature: f64,
}

/// The text of `label/NUMBER.json`. Each key ends with its unit where it has one.
pub(crate) fn label(craft: &Craft, image: &LabelledImage, key_points: &[ImageKeyPoint], steps: MapSteps) -> String {
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
    let point = |(point, in_image): (&super::key_points::KeyPoint, &ImageKeyPoint)| {
        json!({
            "name": point.name,
            "camera_m": in_image.point.to_array(),
            "pixel": in_image.pixel.map(|pixel| pixel.to_array()),
            "visibility": in_image.visibility as u8,
            "visibility_strict": in_image.strict as u8,
        })
    };
    let target = |(target, name): (usize, &super::craft::LabelTarget)| {
        let mask = craft.mask_of(target, &image.channels.part);
        json!({
            "id": target + 1,
            "name": name.name,
            "pixels": mask.iter().filter(|set| **set).count(),
            "bbox": super::mask::bounds(&mask, image.width as usize).map(|bounds| bounds.coco()),
        })
    };
    let named = |numbers: &[(String, f64)]| {
        Value::Object(numbers.iter().map(|(name, number)| (name.clone(), json!(number))).collect::<Map<_, _>>())
    };
    let direction = |vector: DVec3| json!(vector.to_array());
    let mut label = json!({
        "sample": image.identity.sample,
        "orbit": image.identity.orbit,
        "image": image.identity.number,
        "split": image.identity.split.name(),
        "time_s": image.time,
        "width": image.width,
        "height": image.height,
        "bits": image.identity.bits,
        "camera": {
            "matrix": image.camera_matrix(),
            "distortion": { "model": model, "numbers": numbers },
            "line_time_s": image.line_time,
        },
        "camera_from_body": body,
        "body_from_link": Value::Object(links.collect()),
        "joints": image.joints.iter().map(joint).collect::<Vec<_>>(),
        "key_points": craft.key_points.iter().zip(key_points).map(point).collect::<Vec<_>>(),
        "sun_direction": direction(image.sun),
        "sun_visible": image.lit,
        "planet_direction": direction(image.planet),
        "planet_radius_rad": image.planet_radius,
        "sensor": named(&image.identity.sensor),
        "drawn": named(&image.identity.drawn),
        "depth_step_mm": steps.depth,
        "temperature_step_K": steps.temperature,
    });
    if !craft.targets.is_empty() {
        label["targets"] = craft.targets.iter().enumerate().map(target).collect();
    }
    line(label) + "\n"
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::{small, small_craft};
    use super::super::key_points::seen;
    use super::*;

    #[test]
    fn a_label_has_what_other_formats_lack() {
        let (craft, image) = (small_craft(), small());
        let text = label(&craft, &image, &seen(&craft.key_points, &image), MapSteps { depth: 0.1, temperature: 0.01 });
        let computed: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(computed["joints"], json!([{"name": "hinge", "position": 1.0, "unit": "m"}]));
        assert_eq!(computed["sun_direction"], json!([1.0, 0.0, 0.0]));
        assert_eq!(computed["planet_direction"], json!([0.0, -1.0, 0.0]));
        assert_eq!(computed["sensor"], json!({"temperature_K": 293.0}));
        assert_eq!(computed["body_from_link"]["hinge"]["t_m"], json!([0.0, 0.0, 1.0]));
        assert_eq!(computed["temperature_step_K"], 0.01);
        assert_eq!(computed["key_points"][0]["name"], "tip");
        assert_eq!(computed["key_points"][0]["visibility"], 0);
        assert_eq!(computed["camera_from_body"]["t_m"], json!([0.25, 0.0, 2.0]));
        let keys: Vec<&String> = computed.as_object().expect("an object").keys().collect();
        assert!(keys.is_sorted());
    }
}
