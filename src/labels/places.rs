//! Which file of a data set lies where. All paths are relative to its folder, with `/` between folders.

use super::image::{LabelledImage, Split};

pub(crate) const CONVENTIONS: &str = "README.txt";
pub(crate) const BOP_CAMERA: &str = "camera.json";
/// The test images, for BOP.
pub(crate) const BOP_TARGETS: &str = "test_targets_bop19.json";
/// Extents of the objects, for BOP.
pub(crate) const MODELS_INFO: &str = "models/models_info.json";
/// The whole craft with its joints as they are in the model's file. Only for a craft with joints.
pub(crate) const CRAFT_MODEL: &str = "models/craft.ply";
/// The card of Hugging Face.
pub(crate) const CARD: &str = "README.md";
pub(crate) const YOLO_DATA: &str = "yolo.yaml";
/// Images that show nothing of the craft.
pub(crate) const NEGATIVES: &str = "negatives.json";
pub(crate) const SPEED_CAMERA: &str = "speed/camera.json";
pub(crate) const SPEED_KEY_POINTS: &str = "speed/keypoints.json";

/// The mesh of a rigid object.
pub(crate) fn model(object: u32) -> String {
    format!("models/obj_{object:06}.ply")
}

pub(crate) fn coco(split: Split) -> String {
    format!("coco/{}.json", split.name())
}

/// The list of YOLO's pictures.
pub(crate) fn yolo(split: Split) -> String {
    format!("yolo_{}.txt", split.name())
}

pub(crate) fn speed(split: Split) -> String {
    format!("speed/{}.json", split.long_name())
}

/// The folder of an orbit, which is a scene of BOP.
pub(crate) fn orbit(split: Split, orbit: u32) -> String {
    format!("{}/{orbit:06}", split.name())
}

/// A file of an image: `gray`, `gray8`, `kitti`, `depth`, `part`, `temperature`, `planet`, `radiance` or `label`, with its ending.
pub(crate) fn of_image(image: &LabelledImage, what: &str, ending: &str) -> String {
    format!("{}/{what}/{:06}.{ending}", orbit(image.identity.split, image.identity.orbit), image.identity.number)
}

/// A mask of an object in an image: `mask` or `mask_visib`. `place` is the place of the object in `scene_gt.json`.
pub(crate) fn of_mask(image: &LabelledImage, what: &str, place: usize) -> String {
    format!("{}/{what}/{:06}_{place:06}.png", orbit(image.identity.split, image.identity.orbit), image.identity.number)
}

/// The file that shows an image to a reader of COCO or SPEED+: its digital numbers, or its radiance where the scene has no sensor.
pub(crate) fn shown(image: &LabelledImage) -> String {
    match image.channels.digital_numbers {
        Some(_) => of_image(image, "gray", "png"),
        None => of_image(image, "radiance", "exr"),
    }
}

/// Key of an image in a WebDataset, as bop_toolkit forms it.
pub(crate) fn key(image: &LabelledImage) -> String {
    format!("{:06}_{:06}", image.identity.orbit, image.identity.number)
}
