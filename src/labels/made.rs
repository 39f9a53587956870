//! All labels of one image at once, and the files of a whole data set.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::craft::Craft;
use super::describe::{MapSteps, label};
use super::image::{LabelledImage, Split};
use super::key_points::seen;
use super::silhouette::Solids;
use super::{bop, coco, kitti, maps, places, ply, speed, webdataset, yolo};
use crate::output::OutputError;

/// Bytes of a label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Label {
    /// Path in the folder of the data set. `None` where it only stands in the tar.
    pub(crate) path: Option<String>,
    /// Ending of the member in the tar. `None` where it only stands in the folder.
    pub ending: Option<Cow<'static, str>>,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// The lines of an image in the lists of its orbit and of the data set. The lines are text, so whoever makes an orbit can keep them in a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(expecting = "struct Lines")]
pub struct ImageLines {
    /// Number of the image in its orbit.
    pub(crate) number: u32,
    /// Entry in `scene_camera.json`.
    pub(crate) camera: String,
    /// Entry in `scene_gt.json`.
    pub(crate) poses: String,
    /// Entry in `scene_gt_info.json`.
    pub(crate) info: String,
    /// Lines in `test_targets_bop19.json`, if the image is for tests.
    pub(crate) targets: Vec<String>,
    /// Entry in the list of SPEED+. `None` where nothing of the craft is seen.
    pub(crate) speed: Option<String>,
    /// Line in the list of YOLO, where there are pictures.
    pub(crate) yolo: Option<String>,
    /// The picture, where nothing of the craft is seen.
    pub(crate) negative: Option<String>,
    /// Entries in the list of COCO.
    pub coco: coco::CocoEntry,
}

/// The labels of an image.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ImageLabels {
    /// Files of its own.
    pub labels: Vec<Label>,
    /// Lines in the lists.
    pub lines: ImageLines,
}

/// Makes the labels of an image. The digital numbers are among them, the EXR is not: its path is `places::of_image(image, "radiance", "exr")`, with
/// the ending `radiance.exr` in the tar.
///
/// # Errors
/// A value that a format can not hold.
pub fn made(craft: &Craft, solids: &Solids, image: &LabelledImage) -> Result<ImageLabels, OutputError> {
    let key_points = seen(&craft.key_points, image);
    let silhouettes = solids.silhouettes(image);
    let (depth, temperature) = (maps::depth(image)?, maps::temperature(image)?);
    let is_seen = image.channels.part.iter().any(|part| craft.target_of_pixel(*part).is_some());
    let has_numbers = image.channels.digital_numbers.is_some();
    let lines = ImageLines {
        number: image.identity.number,
        camera: bop::camera_of(image, depth.step),
        poses: bop::poses_of(image, solids),
        info: bop::info_of(image, &silhouettes),
        targets: match image.identity.split {
            Split::Test => bop::targets_of(image, solids, &silhouettes),
            _ => Vec::new(),
        },
        speed: is_seen.then(|| speed::entry(image)),
        yolo: has_numbers.then(|| format!("./{}", places::of_image(image, "gray8", "png"))),
        negative: (!is_seen).then(|| places::shown(image)),
        coco: coco::entry(craft, image, &key_points),
    };
    let text = label(craft, image, &key_points, MapSteps { depth: depth.step, temperature: temperature.step });
    let both = |what: &str, ending: &'static str, bytes: Vec<u8>| {
        let last = ending.rsplit_once('.').map_or(ending, |(_, last)| last);
        Label { path: Some(places::of_image(image, what, last)), ending: Some(ending.into()), bytes }
    };
    let in_tar = |ending: &'static str, text: String| Label {
        path: None,
        ending: Some(ending.into()),
        bytes: text.into_bytes(),
    };
    let mut labels = vec![
        both("depth", "depth.png", depth.png),
        both("temperature", "temperature.png", temperature.png),
        both("part", "part.png", maps::part(image)?),
        both("label", "json", text.into_bytes()),
        in_tar("camera.json", lines.camera.clone()),
        in_tar("gt.json", lines.poses.clone()),
        in_tar("gt_info.json", lines.info.clone()),
        in_tar("mask.json", webdataset::full_masks(image, &silhouettes)),
        in_tar("mask_visib.json", webdataset::visible_masks(image, &silhouettes)),
    ];
    if let Some(planet) = maps::planet(image) {
        labels.push(both("planet", "planet.png", maps::mask(image, &planet)?));
    }
    if !craft.targets.is_empty() {
        labels.push(both("instance", "instance.png", maps::instance(craft, image)?));
    }
    labels.extend(maps::digital_numbers(image)?.map(|png| both("gray", "gray.png", png)));
    labels.extend(maps::upper_bits(image)?.map(|png| both("gray8", "gray8.png", png)));
    let in_folder = |folder: &str, text: String| Label {
        path: Some(places::of_image(image, folder, "txt")),
        ending: None,
        bytes: text.into_bytes(),
    };
    labels.extend(has_numbers.then(|| in_folder("gray8", yolo::label(craft, image, &key_points))));
    labels.push(in_folder("kitti", kitti::label(craft, image)));
    for (place, silhouette) in silhouettes.iter().enumerate() {
        for (what, mask) in [("mask", &silhouette.full), ("mask_visib", &silhouette.visible)] {
            let path = Some(places::of_mask(image, what, place));
            labels.push(Label { path, ending: None, bytes: maps::mask(image, mask)? });
        }
    }
    Ok(ImageLabels { labels, lines })
}

/// The three lists of an orbit for BOP, from the lines of all its images in order: paths and bytes.
pub fn orbit(split: Split, number: u32, lines: &[ImageLines]) -> Vec<(String, Vec<u8>)> {
    let folder = places::orbit(split, number);
    let file = |name: &str, entry: fn(&ImageLines) -> &String| {
        let entries = lines.iter().map(|lines| (lines.number, entry(lines).clone()));
        (format!("{folder}/{name}"), bop::scene(entries).into_bytes())
    };
    vec![
        file("scene_camera.json", |lines| &lines.camera),
        file("scene_gt.json", |lines| &lines.poses),
        file("scene_gt_info.json", |lines| &lines.info),
    ]
}

/// The files of a data set that depend on the craft and its camera alone: paths and bytes. `image` is any image.
pub fn fixed(craft: &Craft, solids: &Solids, image: &LabelledImage) -> Vec<(String, Vec<u8>)> {
    let object = |solid: &super::craft::BopObject| {
        (places::model(solid.id), ply::ply(craft, &craft.triangles_of(solid)).into_bytes())
    };
    let mut files: Vec<(String, Vec<u8>)> = solids.objects().iter().map(object).collect();
    if solids.objects().len() > 1 {
        files.push((places::CRAFT_MODEL.to_owned(), ply::ply(craft, &craft.triangles).into_bytes()));
    }
    let texts = [
        (places::MODELS_INFO, ply::models_info(craft, solids)),
        (places::BOP_CAMERA, bop::camera(image)),
        (places::SPEED_CAMERA, speed::camera(image)),
        (places::SPEED_KEY_POINTS, speed::key_points(craft)),
        (places::CONVENTIONS, super::conventions::text(craft, solids)),
    ];
    files.extend(texts.map(|(path, text)| (path.to_owned(), text.into_bytes())));
    files
}
