//! Labels of KITTI (object development kit, `readme.txt`): type, truncation, occlusion, alpha, box in the image, and a box in space.
//!
//! KITTI turns objects about the camera's vertical alone. A craft turns freely, so its box in space has the axes of the camera: `rotation_y` is 0, and height, width
//! and length are extents along Y, Z and X. Pose labels stand in the other formats.

use glam::DVec3;

use super::craft::Craft;
use super::image::LabelledImage;
use super::mask::bounds;

/// The text of an image: a line for each target that it shows.
pub(crate) fn label(craft: &Craft, image: &LabelledImage) -> String {
    let names = craft.target_names();
    names.iter().enumerate().map(|(target, name)| line_of(craft, image, target, name)).collect()
}

fn line_of(craft: &Craft, image: &LabelledImage, target: usize, name: &str) -> String {
    let shown = craft.mask_of(target, &image.channels.part);
    let Some(bounds) = bounds(&shown, image.width as usize) else { return String::new() };
    let [left, top, width, height] = bounds.coco().map(|value| value as f64);
    let mut vertices: Vec<u32> = craft.triangles.iter().flatten().copied().collect();
    vertices.retain(|vertex| craft.target_of_vertex(*vertex) == Some(target));
    vertices.sort_unstable();
    vertices.dedup();
    let links: Vec<_> = (0..craft.links.len()).map(|link| image.camera_from_link(link)).collect();
    let place = |vertex: &u32| {
        let link = craft.link_of_vertex(*vertex) as usize;
        links[link].transform_point3(craft.positions[*vertex as usize])
    };
    let (mut low, mut high, mut beyond) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0);
    let frame = [image.width, image.height].map(|side| f64::from(side) - 0.5);
    for place in vertices.iter().map(place) {
        (low, high) = (low.min(place), high.max(place));
        let inside = image
            .project(place)
            .is_some_and(|pixel| (-0.5..frame[0]).contains(&pixel.x) && (-0.5..frame[1]).contains(&pixel.y));
        beyond += usize::from(!inside);
    }
    let truncated = beyond as f64 / vertices.len().max(1) as f64;
    let (size, middle) = (high - low, 0.5 * (low + high));
    let alpha = -middle.x.atan2(middle.z);
    let name = name.split_whitespace().collect::<Vec<_>>().join("_");
    // Pixels are counted from 0, and the box reaches from the first to the last. The place is the middle of the lower face, because Y points down.
    format!(
        "{name} {truncated:.2} 0 {alpha:.4} {left:.2} {top:.2} {:.2} {:.2} {:.4} {:.4} {:.4} {:.4} {:.4} {:.4} 0.00\n",
        left + width - 1.0,
        top + height - 1.0,
        size.y,
        size.z,
        size.x,
        middle.x,
        high.y,
        middle.z,
    )
}

#[cfg(test)]
mod tests {
    use super::super::image::tests::{small, small_craft};
    use super::*;

    #[test]
    fn a_label_has_the_fifteen_fields_of_the_format() {
        let (craft, image) = (small_craft(), small());
        let text = label(&craft, &image);
        let fields: Vec<&str> = text.split_whitespace().collect();
        assert_eq!(fields.len(), 15, "{text}");
        assert_eq!(fields[4..8], ["1.00", "0.00", "2.00", "1.00"], "the first and the last pixel");
        let number = |place: usize| fields[place].parse::<f64>().expect("a number");
        // The hull reaches from x 0 to 2 or so, and the wing hangs 1 m farther away: the box holds every vertex.
        for vertex in craft.triangles.iter().flatten() {
            let link = craft.link_of_vertex(*vertex) as usize;
            let place = image.camera_from_link(link).transform_point3(craft.positions[*vertex as usize]);
            let off = (place - DVec3::new(number(11), number(12) - 0.5 * number(8), number(13))).abs();
            let half = 0.5 * DVec3::new(number(10), number(8), number(9)) + 1e-3;
            assert!(off.cmple(half).all(), "{off} beyond {half}");
        }
        assert!((number(3) + number(11).atan2(number(13))).abs() < 1e-3);
        let mut empty = small();
        empty.channels.part = vec![0; 12];
        assert_eq!(label(&craft, &empty), "");
    }
}
