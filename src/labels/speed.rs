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

/// The entry of an image. The file name is a path from the folder of the data set.
pub fn entry(image: &LabelledImage) -> String {
    let turn = image.quaternion();
    line(json!({
        "filename": shown(image),
        "q_vbs2tango_true": [turn.w, turn.x, turn.y, turn.z],
        "r_Vo2To_vbs_true": image.camera_from_body.translation.to_array(),
    }))
}

/// The list of a split from its entries, piece by piece.
pub(crate) fn file(entries: impl IntoIterator<Item = String>) -> impl Iterator<Item = String> {
    enclosed("[", entries, "]\n")
}

/// `camera.json`, with the keys of SPEED+. Where the pitch of the pixels is not known, the lengths `fx`, `fy`, `ppx` and `ppy` in metres are absent.
pub(crate) fn camera(image: &LabelledImage) -> String {
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
pub(crate) fn key_points(craft: &Craft) -> String {
    let points = craft.key_points.iter().map(|point| {
        line(json!({
            "name": point.name,
            "link": craft.links[point.link as usize],
            "position": point.position.to_array(),
        }))
    });
    super::text::list(points)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use serde_json::Value;

    use super::super::image::tests::{small, small_craft};
    use super::*;

    /// `quat2dcm` of spnv2: the transpose of the rotation that its quaternion stands for.
    fn quat2dcm([w, x, y, z]: [f64; 4]) -> [[f64; 3]; 3] {
        [
            [2.0 * w * w - 1.0 + 2.0 * x * x, 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 2.0 * w * w - 1.0 + 2.0 * y * y, 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 2.0 * w * w - 1.0 + 2.0 * z * z],
        ]
    }

    /// `project_keypoints` of spnv2 without distortion.
    fn project(entry: &Value, camera: &Value, point: DVec3, transposed: bool) -> [f64; 2] {
        let numbers = |value: &Value| {
            value.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number")).collect::<Vec<_>>()
        };
        let q: [f64; 4] = numbers(&entry["q_vbs2tango_true"]).try_into().expect("four");
        let (dcm, r) = (quat2dcm(q), numbers(&entry["r_Vo2To_vbs_true"]));
        let at = |row: usize| {
            (0..3).map(|i| if transposed { dcm[i][row] } else { dcm[row][i] } * point[i]).sum::<f64>() + r[row]
        };
        let k: Vec<Vec<f64>> = camera["cameraMatrix"].as_array().expect("rows").iter().map(numbers).collect();
        [k[0][0] * at(0) / at(2) + k[0][2], k[1][1] * at(1) / at(2) + k[1][2]]
    }

    #[test]
    fn the_projection_of_spnv2_finds_the_places_of_points() {
        let mut image = small();
        let turn = glam::DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.3);
        image.camera_from_body.matrix3 = glam::DMat3::from_quat(turn);
        let entry: Value = serde_json::from_str(&entry(&image)).expect("JSON");
        let camera: Value = serde_json::from_str(&camera(&image)).expect("JSON");
        for point in [DVec3::new(0.3, 0.2, -0.4), DVec3::new(-0.5, 0.1, 0.2)] {
            let place = image.project(image.camera_from_body.transform_point3(point)).expect("before the camera");
            let [x, y] = project(&entry, &camera, point, true);
            assert!((place.x - x).abs() < 1e-9 && (place.y - y).abs() < 1e-9, "{place} against {x}, {y}");
            // The quaternion the other way round shows.
            let [x, y] = project(&entry, &camera, point, false);
            assert!((place.x - x).hypot(place.y - y) > 0.5);
        }
        assert_eq!(entry["filename"], "val/000003/gray/000002.png");
        assert_eq!(camera["distCoeffs"], json!([0.0, 0.0, 0.0, 0.0, 0.0]));
        assert_eq!((&camera["Nu"], &camera["Nv"]), (&json!(4), &json!(3)));
    }

    #[test]
    fn key_points_stand_with_their_links() {
        let text = key_points(&small_craft());
        assert_eq!(text, "[\n{\"link\":\"hinge\",\"name\":\"tip\",\"position\":[3.0,1.0,0.0]}\n]\n");
    }
}
