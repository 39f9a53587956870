//! Labels in the format of COCO: boxes, run-length masks and key points (cocodataset.org, "Data format").
//!
//! Category 1 is the craft, with its key points, or the first of several targets; each target has a category. The categories of the parts follow: the values of their
//! pixels + the number of targets. A box covers its pixels: x and y are the left and upper border of the first pixel. A key point is in OpenCV's pixels, like the list of COCO itself, whose
//! places are indices of pixels.

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::craft::Craft;
use super::image::{LabelledImage, Split};
use super::key_points::{ImageKeyPoint, Visibility, points_of};
use super::mask::{bounds, compressed, runs};
use super::places::shown;
use super::text::{enclosed, line};

/// The entries of one image.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(expecting = "struct Entry")]
pub struct CocoEntry {
    pub(crate) image: String,
    /// The annotations of the image, each a JSON object.
    pub annotations: Vec<String>,
}

/// The entries of an image: each target, and each part that a pixel shows. The number of an annotation follows from the number of the sample, so each
/// occurs once in a data set.
pub(crate) fn entry(craft: &Craft, image: &LabelledImage, key_points: &[ImageKeyPoint]) -> CocoEntry {
    let named =
        json!({ "id": image.identity.sample, "file_name": shown(image), "width": image.width, "height": image.height });
    let targets = craft.target_names().len();
    let first = image.identity.sample * (craft.parts.len() + targets) as u64 + 1;
    let mut annotations = Vec::new();
    for target in 0..targets {
        let whole = craft.mask_of(target, &image.channels.part);
        if let Some(mut annotation) = annotation(image, &whole, target as u32 + 1, first + target as u64) {
            let here: Vec<&ImageKeyPoint> = points_of(craft, key_points, target).collect();
            let labelled = here.iter().filter(|point| point.visibility != Visibility::Outside).count();
            annotation["keypoints"] = here.iter().flat_map(|point| key_point(point)).collect();
            annotation["keypoints_strict"] = here.iter().map(|point| json!(point.strict as u8)).collect();
            annotation["num_keypoints"] = json!(labelled);
            annotations.push(line(annotation));
        }
    }
    let mut shown: Vec<u32> = image.channels.part.iter().copied().filter(|part| *part != 0).collect();
    shown.sort_unstable();
    shown.dedup();
    for part in shown {
        let mask: Vec<bool> = image.channels.part.iter().map(|at| *at == part).collect();
        let id = first + targets as u64 - 1 + u64::from(part);
        annotations.extend(annotation(image, &mask, part + targets as u32, id).map(line));
    }
    CocoEntry { image: line(named), annotations }
}

/// x, y and visibility, all 0 outside the frame.
fn key_point(point: &ImageKeyPoint) -> [Value; 3] {
    match (point.pixel, point.visibility) {
        (Some(pixel), Visibility::Hidden | Visibility::Visible) => {
            [json!(pixel.x), json!(pixel.y), json!(point.visibility as u8)]
        }
        _ => [json!(0), json!(0), json!(0)],
    }
}

fn annotation(image: &LabelledImage, mask: &[bool], category: u32, id: u64) -> Option<Value> {
    let [width, height] = [image.width as usize, image.height as usize];
    let bounds = bounds(mask, width)?;
    Some(json!({
        "area": mask.iter().filter(|set| **set).count(),
        "bbox": bounds.coco(),
        "category_id": category,
        "id": id,
        "image_id": image.identity.sample,
        "iscrowd": 0,
        "segmentation": { "counts": compressed(&runs(mask, [width, height])), "size": [height, width] },
    }))
}

/// The file of a split from the entries of its images, piece by piece.
pub(crate) fn file(
    craft: &Craft,
    split: Split,
    images: impl IntoIterator<Item = String>,
    annotations: impl IntoIterator<Item = String>,
) -> impl Iterator<Item = String> {
    let targets = craft.target_names();
    let whole = |(target, name): (usize, &&str)| {
        let key_points: Vec<&str> =
            points_of(craft, &craft.key_points, target).map(|point| point.name.as_str()).collect();
        json!({ "id": target + 1, "name": name, "supercategory": "craft", "keypoints": key_points, "skeleton": [] })
    };
    let part = |(number, name): (usize, &String)| json!({ "id": number + 1 + targets.len(), "name": name, "supercategory": "part" });
    let categories: Vec<String> =
        targets.iter().enumerate().map(whole).chain(craft.parts.iter().enumerate().map(part)).map(line).collect();
    let info = line(json!({ "description": format!("{}, {}", craft.name, split.name()), "version": "1.0" }));
    enclosed("{\n\"annotations\": [", annotations, "],\n")
        .chain(enclosed("\"categories\": [", categories, "],\n"))
        .chain(enclosed("\"images\": [", images, "],\n"))
        .chain(std::iter::once(format!("\"info\": {info},\n\"licenses\": []\n}}\n")))
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::super::image::tests::{small, small_craft};
    use super::*;

    fn parsed(text: &str) -> Value {
        serde_json::from_str(text).expect("JSON")
    }

    #[test]
    fn entries_are_those_of_the_format() {
        let seen = ImageKeyPoint {
            point: DVec3::Z,
            pixel: Some(DVec2::new(1.25, 0.5)),
            visibility: Visibility::Hidden,
            strict: Visibility::Hidden,
        };
        let outside =
            ImageKeyPoint { pixel: None, visibility: Visibility::Outside, strict: Visibility::Outside, ..seen };
        let mut craft = small_craft();
        craft.key_points.push(craft.key_points[0].clone());
        let made = entry(&craft, &small(), &[seen, outside]);
        assert_eq!(made.image, r#"{"file_name":"val/000003/gray/000002.png","height":3,"id":7,"width":4}"#);
        // 7 samples of 3 numbers each stand before.
        let expected = [
            concat!(
                r#"{"area":3,"bbox":[1,0,2,2],"category_id":1,"id":22,"image_id":7,"iscrowd":0,"#,
                r#""keypoints":[1.25,0.5,1,0,0,0],"keypoints_strict":[1,0],"num_keypoints":1,"segmentation":{"counts":"41113","size":[3,4]}}"#
            ),
            concat!(
                r#"{"area":2,"bbox":[1,1,2,1],"category_id":2,"id":23,"image_id":7,"iscrowd":0,"#,
                r#""segmentation":{"counts":"41202","size":[3,4]}}"#
            ),
            concat!(
                r#"{"area":1,"bbox":[2,0,1,1],"category_id":3,"id":24,"image_id":7,"iscrowd":0,"#,
                r#""segmentation":{"counts":"615","size":[3,4]}}"#
            ),
        ];
        assert_eq!(made.annotations, expected);
        let mut other = small();
        other.channels.part[5] = 2;
        assert_ne!(entry(&small_craft(), &other, &[]).annotations[1..], expected[1..]);
    }

    #[test]
    fn a_file_names_the_craft_its_key_points_and_its_parts() {
        let text: String = file(&small_craft(), Split::Test, vec!["{}".to_owned()], Vec::new()).collect();
        let file = parsed(&text);
        assert_eq!(file["annotations"], json!([]));
        assert_eq!(file["images"], json!([{}]));
        assert_eq!(
            file["categories"],
            json!([
                {"id": 1, "keypoints": ["tip"], "name": "small", "skeleton": [], "supercategory": "craft"},
                {"id": 2, "name": "hull", "supercategory": "part"},
                {"id": 3, "name": "wing", "supercategory": "part"},
            ])
        );
        assert_eq!(file["info"]["description"], "small, test");
    }
}
