//! Labels in the format of COCO: boxes, run-length masks and key points (cocodataset.org, "Data format").
//!
//! Category 1 is the craft, with its key points. Category `i + 2` is part `i`, so the categories of the parts are the values of their pixels + 1. A box covers
//! its pixels: x and y are the left and upper border of the first one. A key point is in OpenCV's pixels, like the list of COCO itself, whose places are
//! indices of pixels.

use serde_json::{Value, json};

use super::craft::Craft;
use super::image::{LabelledImage, Split};
use super::key_points::{Seen, Visibility};
use super::mask::{bounds, compressed, runs};
use super::places::shown;
use super::text::{enclosed, line};

/// Category of the craft.
pub const CRAFT: u32 = 1;

/// The entries of one image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The image.
    pub image: String,
    /// What it shows.
    pub annotations: Vec<String>,
}

/// The entries of an image: the craft, and each part that a pixel shows. The numbers follow from that of the sample, so each occurs once in a data set.
pub fn entry(craft: &Craft, image: &LabelledImage, seen: &[Seen]) -> Entry {
    let named = json!({ "id": image.sample, "file_name": shown(image), "width": image.width, "height": image.height });
    let first = image.sample * (craft.parts.len() as u64 + 1) + 1;
    let mut annotations = Vec::new();
    let whole: Vec<bool> = image.part.iter().map(|part| *part != 0).collect();
    if let Some(mut annotation) = annotation(image, &whole, CRAFT, first) {
        let labelled = seen.iter().filter(|seen| seen.visibility != Visibility::Outside).count();
        annotation["keypoints"] = seen.iter().flat_map(key_point).collect();
        annotation["num_keypoints"] = json!(labelled);
        annotations.push(line(annotation));
    }
    let mut shown: Vec<u32> = image.part.iter().copied().filter(|part| *part != 0).collect();
    shown.sort_unstable();
    shown.dedup();
    for part in shown {
        let mask: Vec<bool> = image.part.iter().map(|at| *at == part).collect();
        annotations.extend(annotation(image, &mask, part + CRAFT, first + u64::from(part)).map(line));
    }
    Entry { image: line(named), annotations }
}

/// x, y and visibility, all 0 outside the frame.
fn key_point(seen: &Seen) -> [Value; 3] {
    match (seen.pixel, seen.visibility) {
        (Some(pixel), Visibility::Hidden | Visibility::Visible) => {
            [json!(pixel.x), json!(pixel.y), json!(seen.visibility as u8)]
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
        "image_id": image.sample,
        "iscrowd": 0,
        "segmentation": { "counts": compressed(&runs(mask, [width, height])), "size": [height, width] },
    }))
}

/// The file of a split from the entries of its images, piece by piece.
pub fn file(
    craft: &Craft,
    split: Split,
    images: impl IntoIterator<Item = String>,
    annotations: impl IntoIterator<Item = String>,
) -> impl Iterator<Item = String> {
    let key_points: Vec<&str> = craft.key_points.iter().map(|point| point.name.as_str()).collect();
    let whole = json!({
        "id": CRAFT, "name": craft.name, "supercategory": "craft", "keypoints": key_points, "skeleton": [],
    });
    let part = |(number, name): (usize, &String)| json!({ "id": number + 2, "name": name, "supercategory": "part" });
    let categories: Vec<String> =
        std::iter::once(whole).chain(craft.parts.iter().enumerate().map(part)).map(line).collect();
    let info = line(json!({ "description": format!("{}, {}", craft.name, split.name()), "version": "1.0" }));
    enclosed("{\n\"annotations\": [", annotations, "],\n")
        .chain(enclosed("\"categories\": [", categories, "],\n"))
        .chain(enclosed("\"images\": [", images, "],\n"))
        .chain(std::iter::once(format!("\"info\": {info},\n\"licenses\": []\n}}\n")))
}
