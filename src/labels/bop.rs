//! Labels in the format of BOP (docs/bop_datasets_format.md of thodan/bop_toolkit): lengths in millimetres, OpenCV's axes. The
//! centres of pixels are at +0.5, as the renderers of bop_toolkit have them.
//!
//! An object of BOP is rigid. So a craft with joints is several objects: its body, and for each joint the parts that hang on it. A craft without
//! joints is one object.

use glam::DAffine3;
use serde_json::{Value, json};

use super::image::LabelledImage;
use super::silhouette::{Silhouette, Solids};
use super::text::{line, list, object};
use crate::lens::Lens;

/// Share of an object that must be visible for it to be a target of a test, as in BOP.
const TARGET: f64 = 0.1;

/// Rotation of a pose, row by row.
pub(super) fn rows(pose: &DAffine3) -> [f64; 9] {
    pose.matrix3.transpose().to_cols_array()
}

/// The camera matrix of BOP, row by row. The centre of the upper left pixel is (0.5, 0.5), as for the renderers of bop_toolkit and for pyrender.
fn cam_k(image: &LabelledImage) -> [f64; 9] {
    let Lens { focal: [fx, fy], centre: [cx, cy], skew, .. } = image.lens;
    [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]
}

/// The entry of an image in `scene_camera.json`. `depth_scale` is the step of its map of depths [mm].
pub(crate) fn camera_of(image: &LabelledImage, depth_scale: f64) -> String {
    let mut entry = json!({ "cam_K": cam_k(image), "depth_scale": depth_scale });
    let (model, numbers) = image.distortion();
    if !numbers.is_empty() {
        // K alone does not take points into this image. bop_toolkit knows no distortion and leaves out the key.
        entry["cam_distortion"] = json!({ "model": model, "numbers": numbers });
    }
    line(entry)
}

/// The entry of an image in `scene_gt.json`.
pub(crate) fn poses_of(image: &LabelledImage, solids: &Solids) -> String {
    let pose = |object: &super::craft::BopObject| {
        let pose = image.camera_from_link(object.link as usize);
        let position = pose.translation * 1e3;
        json!({ "obj_id": object.id, "cam_R_m2c": rows(&pose), "cam_t_m2c": position.to_array() })
    };
    line(Value::Array(solids.objects().iter().map(pose).collect()))
}

/// The entry of an image in `scene_gt_info.json`: counts of pixels, and boxes from the first to the last pixel (scripts/calc_gt_info.py).
pub(crate) fn info_of(image: &LabelledImage, silhouettes: &[Silhouette]) -> String {
    let nowhere = [-1; 4];
    let info = |silhouette: &Silhouette| {
        let visible = silhouette.visible.iter().filter(|set| **set).count() as u64;
        let bounds = super::mask::bounds(&silhouette.visible, image.width as usize);
        let valid = silhouette.full.iter().zip(&image.channels.part).filter(|(set, part)| **set && **part != 0).count();
        json!({
            "px_count_all": silhouette.count,
            "px_count_valid": valid,
            "px_count_visib": visible,
            "visib_fract": visible_share(silhouette),
            "bbox_obj": silhouette.bounds.filter(|_| visible > 0).map_or(nowhere, |bounds| bounds.bop()),
            "bbox_visib": bounds.map_or(nowhere, |bounds| bounds.bop()),
        })
    };
    line(Value::Array(silhouettes.iter().map(info).collect()))
}

fn visible_share(silhouette: &Silhouette) -> f64 {
    let visible = silhouette.visible.iter().filter(|set| **set).count() as f64;
    if silhouette.count == 0 { 0.0 } else { visible / silhouette.count as f64 }
}

/// The lines of an image in `test_targets_bop19.json`: each object of which a tenth is visible.
pub(crate) fn targets_of(image: &LabelledImage, solids: &Solids, silhouettes: &[Silhouette]) -> Vec<String> {
    let named = solids.objects().iter().zip(silhouettes);
    let visible = named.filter(|(_, silhouette)| visible_share(silhouette) >= TARGET);
    let target = |(object, _): (&super::craft::BopObject, _)| {
        line(
            json!({ "im_id": image.identity.number, "inst_count": 1, "obj_id": object.id, "scene_id": image.identity.orbit }),
        )
    };
    visible.map(target).collect()
}

/// A file of a scene from the entries of its images, each with its number: `scene_camera.json`, `scene_gt.json` or `scene_gt_info.json`.
pub(crate) fn scene(entries: impl IntoIterator<Item = (u32, String)>) -> String {
    object(entries)
}

/// `test_targets_bop19.json` from its lines.
pub(crate) fn targets(lines: impl IntoIterator<Item = String>) -> String {
    list(lines)
}

/// `camera.json`: the camera of all images. Depths have their scale in `scene_camera.json`.
pub(crate) fn camera(image: &LabelledImage) -> String {
    let [fx, _, cx, _, fy, cy, ..] = cam_k(image);
    let camera = json!({ "fx": fx, "fy": fy, "cx": cx, "cy": cy, "width": image.width, "height": image.height });
    line(camera) + "\n"
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::{small, small_craft};
    use super::*;

    #[test]
    fn entries_are_those_of_the_format() {
        let (craft, mut image) = (small_craft(), small());
        image.camera_from_body.matrix3 = glam::DMat3::from_cols(glam::DVec3::Y, glam::DVec3::NEG_X, glam::DVec3::Z);
        let solids = Solids::new(&craft);
        assert_eq!(camera_of(&image, 0.1), r#"{"cam_K":[10.0,0.0,2.0,0.0,20.0,1.5,0.0,0.0,1.0],"depth_scale":0.1}"#);
        let turn = r#""cam_R_m2c":[0.0,-1.0,0.0,1.0,0.0,0.0,0.0,0.0,1.0]"#;
        assert_eq!(
            poses_of(&image, &solids),
            format!(
                "[{{{turn},\"cam_t_m2c\":[250.0,0.0,2000.0],\"obj_id\":1}},{{{turn},\"cam_t_m2c\":[250.0,0.0,3000.0],\"obj_id\":2}}]"
            )
        );
        // A turn the other way is another matrix.
        image.camera_from_body.matrix3 = image.camera_from_body.matrix3.transpose();
        assert!(!poses_of(&image, &solids).contains(turn));
    }

    #[test]
    fn counts_and_boxes_are_those_of_calc_gt_info() {
        let image = small();
        let at = |places: &[usize]| (0..12).map(|at| places.contains(&at)).collect::<Vec<_>>();
        let hidden = Silhouette {
            full: at(&[2, 6, 8]),
            visible: at(&[2]),
            count: 4,
            bounds: super::super::mask::bounds(&at(&[2, 6, 8]), 4),
        };
        let gone =
            Silhouette { full: at(&[0]), visible: at(&[]), count: 1, bounds: super::super::mask::bounds(&at(&[0]), 4) };
        assert_eq!(
            info_of(&image, &[hidden.clone(), gone.clone()]),
            concat!(
                r#"[{"bbox_obj":[0,0,2,2],"bbox_visib":[2,0,0,0],"px_count_all":4,"px_count_valid":2,"px_count_visib":1,"visib_fract":0.25},"#,
                r#"{"bbox_obj":[-1,-1,-1,-1],"bbox_visib":[-1,-1,-1,-1],"px_count_all":1,"px_count_valid":0,"px_count_visib":0,"visib_fract":0.0}]"#
            )
        );
        let targets = targets_of(&image, &Solids::new(&small_craft()), &[hidden, gone]);
        assert_eq!(targets, [r#"{"im_id":2,"inst_count":1,"obj_id":1,"scene_id":3}"#]);
    }

    #[test]
    fn a_lens_with_distortion_is_told() {
        let mut image = small();
        image.lens.distortion = crate::lens::Distortion::Fisheye([0.1, 0.0, 0.0, 0.0]);
        assert!(
            camera_of(&image, 1.0)
                .contains(r#""cam_distortion":{"model":"opencv_fisheye","numbers":[0.1,0.0,0.0,0.0]}"#)
        );
        assert_eq!(camera(&image), "{\"cx\":2.0,\"cy\":1.5,\"fx\":10.0,\"fy\":20.0,\"height\":3,\"width\":4}\n");
        assert_eq!(scene([(0, "{}".to_owned()), (12, "[]".to_owned())]), "{\n\"0\": {},\n\"12\": []\n}\n");
    }
}
