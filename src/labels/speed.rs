//! Labels in the style of SPEED+ (Park et al. 2022): one list for each split with the pose of each image, and `camera.json`.
//!
//! `q_vbs2tango_true` is (w, x, y, z). As a rotation matrix (Hamilton's product, the one of scipy and Eigen) it takes vectors of the body into camera axes.
//! `quat2dcm` of tpark94/spnv2 makes the transpose of it, which `project_keypoints` there transposes back. `r_Vo2To_vbs_true` is the body's origin in
//! camera axes [m]. A point p of the body then lies at R(q) p + r.

use serde_json::json;

use super::craft::Craft;
use super::image::LabelledImage;
use super::places::shown;
use super::text::{enclosed, line};

/// The entry of an image. Its file name begins in the folder of the data set.
pub fn entry(image: &LabelledImage) -> String {
    let turn = image.quaternion();
    line(json!({
        "filename": shown(image),
        "q_vbs2tango_true": [turn.w, turn.x, turn.y, turn.z],
        "r_Vo2To_vbs_true": image.camera_from_body.translation.to_array(),
    }))
}

/// The list of a split from its entries, piece by piece.
pub fn file(entries: impl IntoIterator<Item = String>) -> impl Iterator<Item = String> {
    enclosed("[", entries, "]\n")
}

/// `camera.json`, with the keys of SPEED+. Where the pitch of the pixels is not known, the lengths `fx`, `fy`, `ppx` and `ppy` in metres are absent.
pub fn camera(image: &LabelledImage) -> String {
    let k = image.camera_matrix();
    let (model, numbers) = image.distortion();
    let numbers = if numbers.is_empty() { vec![0.0; 5] } else { numbers };
    let camera = json!({
        "Nu": image.width,
        "Nv": image.height,
        "ccx": k[2],
        "ccy": k[5],
        "cameraMatrix": [k[0..3], k[3..6], k[6..9]],
        "distCoeffs": numbers,
        "distModel": if model == "none" { "opencv" } else { model },
    });
    line(camera) + "\n"
}

/// The key points [m], and the link that carries each.
pub fn key_points(craft: &Craft) -> String {
    let points = craft.key_points.iter().map(|point| {
        line(json!({
            "name": point.name,
            "link": craft.links[point.link as usize],
            "position": point.position.to_array(),
        }))
    });
    super::text::list(points)
}
