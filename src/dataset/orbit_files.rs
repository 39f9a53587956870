//! The files of an orbit: images, labels, the rows of the index and the lines of the lists.

use std::io::{self, Write};

use serde_json::{Map, Value as Json, json};

use super::error::DatasetError;
use super::orbit::{OrbitOutcome, OrbitRun};
use super::orbit_folder::OrbitFolder;
use super::row::{file_of, row};
use super::spec::{ImageKind, Spec};
use super::split::split_of;
use crate::labels::image::LabelledImage;
use crate::labels::made::{ImageLabels, ImageLines, Label, made, orbit};
use crate::labels::maps::numbers_of;
use crate::labels::places;
use crate::labels::silhouette::Solids;
use crate::labels::webdataset::Tar;
use crate::output::exr::encode;
use crate::output::frame_maker::FrameMaker;
use crate::scene::{Scene, SceneBand};
use crate::simulation::facade::Simulation;
use crate::simulation::image::Image;

/// The file of an orbit from which the files of the whole set are made.
pub(crate) const ORBIT: &str = "orbit.json";
pub(crate) const TAR: &str = "webdataset.tar";
/// Ending of the radiance in a WebDataset.
const RADIANCE: &str = "radiance.exr";

/// An image with its labels, encoded.
pub(crate) struct Encoded {
    key: String,
    labels: Vec<Label>,
    lines: ImageLines,
    row: Map<String, Json>,
}

impl Encoded {
    /// Paths in the data set and bytes of its files.
    pub(crate) fn files(&self) -> impl Iterator<Item = (&str, &[u8])> {
        self.labels.iter().filter_map(|label| Some((label.path.as_deref()?, label.bytes.as_slice())))
    }

    /// Writes the files of the image. Bytes that stand in no file of their own are kept.
    ///
    /// # Errors
    /// A full disk.
    pub(crate) fn write(mut self, folder: &mut OrbitFolder) -> Result<Self, DatasetError> {
        for label in &mut self.labels {
            if let Some(path) = &label.path {
                folder.write(path, &std::mem::take(&mut label.bytes))?;
            }
        }
        Ok(self)
    }
}

/// Encodes an image and its labels.
///
/// # Errors
/// An image that can not be encoded.
pub(crate) fn encode_image(
    spec: &Spec,
    run: (&crate::labels::craft::Craft, &Solids, &Simulation),
    image: Image,
    mut labelled: LabelledImage,
) -> Result<Encoded, DatasetError> {
    let (craft, solids, simulation) = run;
    if !spec.images.contains(&ImageKind::Numbers) {
        labelled.channels.digital_numbers = None;
    }
    let ImageLabels { mut labels, lines } = made(craft, solids, &labelled)?;
    if spec.images.contains(&ImageKind::Radiance) {
        let prepared = simulation.prepared();
        let step = (image.time / prepared.scene.time.step + 1e-9) as u32;
        let maker = FrameMaker::new(prepared, &simulation.device_name());
        let header = maker.header(&image, step, Some(labelled.identity.number))?;
        let path = Some(file_of(&labelled, ImageKind::Radiance).1);
        labels.push(Label { path, ending: Some(RADIANCE.into()), bytes: encode(&image, &header)? });
    }
    let mut row = row(&labelled, &spec.images);
    if spec.images.contains(&ImageKind::Numbers) {
        for (band, numbers) in numbers_of_bands(&simulation.prepared().scene, &image) {
            let what = format!("gray_{}", band.name);
            let path = places::of_image(&labelled, &what, "png");
            row.insert(what.clone(), json!(path));
            let bits = band.sensor.as_ref().map_or(16, |sensor| sensor.bits);
            let bytes = numbers_of(&labelled, numbers, bits)?;
            labels.push(Label { path: Some(path), ending: Some(format!("{what}.png").into()), bytes });
        }
    }
    Ok(Encoded { key: places::key(&labelled), labels, lines, row })
}

/// The bands after the first that have a sensor, with its digital numbers.
fn numbers_of_bands<'a>(scene: &'a Scene, image: &'a Image) -> impl Iterator<Item = (&'a SceneBand, &'a [u16])> {
    let bands = scene.bands.iter().zip(&image.bands.images).skip(1);
    bands.filter_map(|(band, seen)| Some((band, seen.digital_numbers.as_deref()?)))
}

/// Writes the files of an orbit whose images wrote theirs.
///
/// # Errors
/// A full disk.
pub(crate) fn write(
    folder: &mut OrbitFolder,
    spec: &Spec,
    run: &OrbitRun,
    outcome: &OrbitOutcome,
    mut images: Vec<Encoded>,
) -> Result<(), DatasetError> {
    images.sort_by_key(|image| image.lines.number);
    if spec.webdataset {
        folder.write_from(TAR, |folder, writer| tar(folder, writer, &images))?;
    }
    let mut rows = Vec::new();
    let mut lines = Vec::new();
    for image in images {
        rows.push(Json::Object(image.row));
        lines.push(image.lines);
    }
    for (path, bytes) in orbit(split_of(spec, run.number()), run.number() as u32, &lines) {
        folder.write(&path, &bytes)?;
    }
    let summary = orbit_json(run, outcome, rows, lines);
    folder.write(ORBIT, format!("{summary}\n").as_bytes())
}

/// The WebDataset of an orbit, from the files of its images and the bytes that they still hold.
fn tar(folder: &OrbitFolder, writer: &mut dyn Write, images: &[Encoded]) -> io::Result<()> {
    let mut tar = Tar::new(writer);
    for image in images {
        let place = |label: &Label| match (&label.path, label.ending.clone()) {
            (_, None) => Ok(None),
            (Some(path), Some(ending)) => folder.read(path).map(|bytes| Some((ending, bytes))),
            (None, Some(ending)) => Ok(Some((ending, label.bytes.clone()))),
        };
        let files = image.labels.iter().filter_map(|label| place(label).transpose()).collect::<io::Result<Vec<_>>>()?;
        tar.add(&image.key, files.iter().map(|(ending, bytes)| (&**ending, bytes.as_slice())))?;
    }
    tar.finish().map(|_| ())
}

/// The values of an orbit that the files of the whole set need.
fn orbit_json(run: &OrbitRun, outcome: &OrbitOutcome, rows: Vec<Json>, lines: Vec<ImageLines>) -> Json {
    let rejections: Map<String, Json> =
        outcome.rejections.iter().map(|(reason, count)| (reason.words().to_owned(), json!(count))).collect();
    let each = lines.into_iter().map(|lines| {
        json!({
            "bop_targets": lines.targets,
            "speed": lines.speed,
            "yolo": lines.yolo,
            "negative": lines.negative,
            "coco_image": lines.coco.image,
            "coco_annotations": lines.coco.annotations,
        })
    });
    json!({"drawn": run.drawn(), "rejected": rejections, "images": rows, "lines": each.collect::<Vec<_>>()})
}
