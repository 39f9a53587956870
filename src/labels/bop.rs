//! Labels in the format of BOP (docs/bop_datasets_format.md of thodan/bop_toolkit): lengths in millimetres, OpenCV's axes and pixels.
//!
//! An object of BOP is rigid. So a craft with joints is several objects: its body, and what hangs on each joint. Without joints it is one.

use glam::DAffine3;
use serde_json::{Value, json};

use super::image::LabelledImage;
use super::silhouette::{Silhouette, Solids};
use super::text::{line, list, object};

/// Share of an object that must be visible for it to be a target of a test, as in BOP.
const TARGET: f64 = 0.1;

/// Rotation of a pose, row by row.
pub(super) fn rows(pose: &DAffine3) -> [f64; 9] {
    pose.matrix3.transpose().to_cols_array()
}

/// The entry of an image in `scene_camera.json`. `depth_scale` is the step of its map of depths [mm].
pub fn camera_of(image: &LabelledImage, depth_scale: f64) -> String {
    let mut entry = json!({ "cam_K": image.camera_matrix(), "depth_scale": depth_scale });
    let (model, numbers) = image.distortion();
    if !numbers.is_empty() {
        // K alone does not take points into this image. bop_toolkit knows no distortion and leaves out the key.
        entry["cam_distortion"] = json!({ "model": model, "numbers": numbers });
    }
    line(entry)
}

/// The entry of an image in `scene_gt.json`.
pub fn poses_of(image: &LabelledImage, solids: &Solids) -> String {
    let pose = |object: &super::craft::Object| {
        let pose = image.camera_from_link(object.link as usize);
        let position = pose.translation * 1e3;
        json!({ "obj_id": object.id, "cam_R_m2c": rows(&pose), "cam_t_m2c": position.to_array() })
    };
    line(Value::Array(solids.objects().iter().map(pose).collect()))
}

/// The entry of an image in `scene_gt_info.json`: counts of pixels, and boxes from the first to the last pixel (scripts/calc_gt_info.py).
pub fn info_of(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    let nowhere = [-1; 4];
    let info = |silhouette: &Silhouette| {
        let visible = silhouette.visible.iter().filter(|set| **set).count() as u64;
        let seen = super::mask::bounds(&silhouette.visible, image.width as usize);
        let valid = silhouette.full.iter().zip(&image.part).filter(|(set, part)| **set && **part != 0).count();
        json!({
            "px_count_all": silhouette.count,
            "px_count_valid": valid,
            "px_count_visib": visible,
            "visib_fract": visible_share(silhouette),
            "bbox_obj": silhouette.bounds.filter(|_| visible > 0).map_or(nowhere, |bounds| bounds.bop()),
            "bbox_visib": seen.map_or(nowhere, |bounds| bounds.bop()),
        })
    };
    line(Value::Array(silhouettes.iter().map(info).collect()))
}

/// Visible share of an object.
fn visible_share(silhouette: &Silhouette) -> f64 {
    let visible = silhouette.visible.iter().filter(|set| **set).count() as f64;
    if silhouette.count == 0 { 0.0 } else { visible / silhouette.count as f64 }
}

/// The lines of an image in `test_targets_bop19.json`: each object of which a tenth is visible.
pub fn targets_of(image: &LabelledImage, solids: &Solids, silhouettes: &[Silhouette]) -> Vec<String> {
    let named = solids.objects().iter().zip(silhouettes);
    let seen = named.filter(|(_, silhouette)| visible_share(silhouette) >= TARGET);
    let target = |(object, _): (&super::craft::Object, _)| {
        line(json!({ "im_id": image.number, "inst_count": 1, "obj_id": object.id, "scene_id": image.orbit }))
    };
    seen.map(target).collect()
}

/// A file of a scene from the entries of its images, each with its number: `scene_camera.json`, `scene_gt.json` or `scene_gt_info.json`.
pub fn scene(entries: impl IntoIterator<Item = (u32, String)>) -> String {
    object(entries)
}

/// `test_targets_bop19.json` from its lines.
pub fn targets(lines: impl IntoIterator<Item = String>) -> String {
    list(lines)
}

/// `camera.json`: the camera of all images. Depths have their scale in `scene_camera.json`.
pub fn camera(image: &LabelledImage) -> String {
    let [fx, _, cx, _, fy, cy, ..] = image.camera_matrix();
    let camera = json!({ "fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": image.width, "height": image.height });
    line(camera) + "\n"
}
