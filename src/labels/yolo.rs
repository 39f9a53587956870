//! Labels of Ultralytics' YOLO: a text beside each picture, with the box of the craft and its key points, and lists of pictures.
//!
//! Numbers are shares of width and height from the upper left corner of the image. A picture without the craft has an empty text.

use std::fmt::Write;

use super::craft::Craft;
use super::image::{LabelledImage, OPENCV_PIXEL, Split};
use super::key_points::{ImageKeyPoint, Visibility};
use super::mask::bounds;
use super::places;

/// The text beside a picture: class, middle and size of the box, and x, y and visibility of each key point.
pub(crate) fn label(image: &LabelledImage, key_points: &[ImageKeyPoint]) -> String {
    let craft: Vec<bool> = image.channels.part.iter().map(|part| *part != 0).collect();
    let Some(bounds) = bounds(&craft, image.width as usize) else { return String::new() };
    let [width, height] = [image.width, image.height].map(f64::from);
    let [x, y, w, h] = bounds.coco().map(|value| value as f64);
    let mut text = format!("0 {} {} {} {}", (x + 0.5 * w) / width, (y + 0.5 * h) / height, w / width, h / height);
    for point in key_points {
        // A text takes everything that is written to it.
        let _ = match (point.pixel, point.visibility) {
            (Some(pixel), Visibility::Hidden | Visibility::Visible) => {
                let [x, y] = [(pixel.x - OPENCV_PIXEL) / width, (pixel.y - OPENCV_PIXEL) / height];
                write!(text, " {x} {y} {}", point.visibility as u8)
            }
            _ => write!(text, " 0 0 0"),
        };
    }
    text + "\n"
}

/// `yolo.yaml`, for the splits that have images.
pub(crate) fn data(craft: &Craft, splits: &[Split]) -> String {
    let mut text = "# Ultralytics YOLO. Paths begin in the folder of this file.\n".to_owned();
    for split in splits {
        let _ = writeln!(text, "{}: {}", split.name(), places::yolo(*split));
    }
    // A string of JSON is one of YAML too.
    let name = serde_json::Value::from(craft.name.as_str());
    text + &format!("names:\n  0: {name}\nkpt_shape: [{}, 3]\n", craft.key_points.len())
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::super::image::tests::{small, small_craft};
    use super::*;

    #[test]
    fn boxes_and_points_are_shares_of_the_image() {
        let visible = Visibility::Visible;
        let point =
            ImageKeyPoint { point: DVec3::Z, pixel: Some(DVec2::new(1.5, 1.0)), visibility: visible, strict: visible };
        let outside = ImageKeyPoint { pixel: None, visibility: Visibility::Outside, ..point };
        // The craft covers columns 1 and 2 of 4, and rows 0 and 1 of 3: as for COCO, x 1, y 0, w 2, h 2.
        let third = 1.0 / 3.0;
        let expected = format!("0 0.5 {third} 0.5 {} 0.5 0.5 2 0 0 0\n", 2.0 * third);
        assert_eq!(label(&small(), &[point, outside]), expected);
        let mut empty = small();
        empty.channels.part = vec![0; 12];
        assert_eq!(label(&empty, &[point]), "");
        let yaml = data(&small_craft(), &[Split::Train, Split::Validation]);
        assert!(yaml.contains("train: yolo_train.txt\nval: yolo_val.txt\nnames:\n  0: "), "{yaml}");
        assert!(yaml.ends_with("kpt_shape: [1, 3]\n"), "{yaml}");
    }
}
