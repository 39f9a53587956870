//! Labels of Ultralytics' YOLO: a text beside each picture, with a line for each target that it shows, and lists of pictures.
//!
//! Numbers are shares of width and height from the upper left corner of the image. A picture without the craft has an empty text.

use std::fmt::Write;

use super::craft::Craft;
use super::image::{LabelledImage, OPENCV_PIXEL, Split};
use super::key_points::{ImageKeyPoint, Visibility, points_of};
use super::mask::bounds;
use super::places;

/// The text beside a picture: for each target class, middle and size of the box, and x, y and visibility of each key point.
pub(crate) fn label(craft: &Craft, image: &LabelledImage, key_points: &[ImageKeyPoint]) -> String {
    (0..craft.target_names().len()).map(|target| line_of(craft, image, key_points, target)).collect()
}

/// Most key points of a target. A target with fewer has zeros in place of the others, because all classes of YOLO have equally many.
fn most_points(craft: &Craft) -> usize {
    let counts = (0..craft.target_names().len()).map(|target| points_of(craft, &craft.key_points, target).count());
    counts.max().unwrap_or(0)
}

fn line_of(craft: &Craft, image: &LabelledImage, key_points: &[ImageKeyPoint], target: usize) -> String {
    let mask = craft.mask_of(target, &image.channels.part);
    let Some(bounds) = bounds(&mask, image.width as usize) else { return String::new() };
    let [width, height] = [image.width, image.height].map(f64::from);
    let [x, y, w, h] = bounds.coco().map(|value| value as f64);
    let mut text =
        format!("{target} {} {} {} {}", (x + 0.5 * w) / width, (y + 0.5 * h) / height, w / width, h / height);
    let mut missing = most_points(craft);
    for point in points_of(craft, key_points, target) {
        missing = missing.saturating_sub(1);
        // A text takes everything that is written to it.
        let _ = match (point.pixel, point.visibility) {
            (Some(pixel), Visibility::Hidden | Visibility::Visible) => {
                let [x, y] = [(pixel.x - OPENCV_PIXEL) / width, (pixel.y - OPENCV_PIXEL) / height];
                write!(text, " {x} {y} {}", point.visibility as u8)
            }
            _ => write!(text, " 0 0 0"),
        };
    }
    text + &" 0 0 0".repeat(missing) + "\n"
}

/// `yolo.yaml`, for the splits that have images. Ultralytics refuses a file without `train` or `val`, so the first split stands in for one without images.
pub(crate) fn data(craft: &Craft, splits: &[Split]) -> String {
    let mut text = "# Ultralytics YOLO. Paths begin in the folder of this file.\n".to_owned();
    for split in Split::ALL {
        let name = split.name();
        let stand_in = splits.first().filter(|_| split != Split::Test);
        let _ = match (splits.contains(&split), stand_in) {
            (true, _) => writeln!(text, "{name}: {}", places::yolo(split)),
            (false, Some(other)) => {
                let other = (other.name(), places::yolo(*other));
                writeln!(text, "# No orbit is in {name}: the images of {} stand in.\n{name}: {}", other.0, other.1)
            }
            (false, None) => Ok(()),
        };
    }
    text += "names:\n";
    for (target, name) in craft.target_names().into_iter().enumerate() {
        // A string of JSON is one of YAML too.
        let _ = writeln!(text, "  {target}: {}", serde_json::Value::from(name));
    }
    text + &format!("kpt_shape: [{}, 3]\n", most_points(craft))
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
        let mut craft = small_craft();
        craft.key_points = vec![craft.key_points[0].clone(), craft.key_points[0].clone()];
        let third = 1.0 / 3.0;
        let expected = format!("0 0.5 {third} 0.5 {} 0.5 0.5 2 0 0 0\n", 2.0 * third);
        assert_eq!(label(&craft, &small(), &[point, outside]), expected);
        let mut empty = small();
        empty.channels.part = vec![0; 12];
        assert_eq!(label(&craft, &empty, &[point, outside]), "");
        let yaml = data(&small_craft(), &[Split::Train, Split::Validation]);
        assert!(yaml.contains("train: yolo_train.txt\nval: yolo_val.txt\nnames:\n  0: "), "{yaml}");
        assert!(yaml.ends_with("kpt_shape: [1, 3]\n"), "{yaml}");
        // `ultralytics/data/utils.py::check_det_dataset` raises where `train` or `val` is missing.
        let yaml = data(&small_craft(), &[Split::Train]);
        let val =
            "train: yolo_train.txt\n# No orbit is in val: the images of train stand in.\nval: yolo_train.txt\nnames:";
        assert!(yaml.contains(val) && !yaml.contains("test"), "{yaml}");
    }
}
