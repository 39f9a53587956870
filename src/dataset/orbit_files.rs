//! The files of an orbit: images, labels, the rows of the index and the entries of the lists.

use serde_json::{Map, Value as Json, json};

use super::error::DatasetError;
use super::orbit::Outcome;
use super::row::{file_of, row};
use super::spec::{ImageKind, Spec};
use super::store::OrbitFolder;
use crate::labels::craft::Craft;
use crate::labels::image::LabelledImage;
use crate::output::OutputError;
use crate::output::exr::encode;
use crate::output::frame_maker::FrameMaker;
use crate::output::gray::{png_8, png_16};
use crate::simulation::facade::Simulation;
use crate::simulation::image::Image;

/// The file of an orbit from which the files of the whole set are made.
pub const ORBIT: &str = "orbit.json";

/// Kelvin of a count of a temperature image.
const KELVIN_PER_COUNT: f64 = 0.01;

/// An image with its files, encoded.
pub struct Encoded {
    /// Number in the orbit.
    pub number: u32,
    /// Path in the data set, and bytes.
    pub files: Vec<(String, Vec<u8>)>,
    /// Its row of the index.
    pub row: Map<String, Json>,
}

/// The image files of an image, and its row.
///
/// # Errors
/// An image that can not be encoded.
pub fn encode_image(
    spec: &Spec,
    simulation: &Simulation,
    image: Image,
    labelled: &LabelledImage,
) -> Result<Encoded, DatasetError> {
    let size = [labelled.width, labelled.height];
    let mut files = Vec::new();
    let mut image = Some(image);
    for kind in &spec.images {
        let bytes = match kind {
            ImageKind::Numbers => numbers(labelled)?,
            ImageKind::Temperature => {
                let count = |kelvin: &f32| (f64::from(*kelvin) / KELVIN_PER_COUNT).round().clamp(0.0, 65535.0) as u16;
                let counts: Vec<u16> = labelled.temperature.iter().map(count).collect();
                let scale = json!({"kelvin": "scale x value, 0 without a surface", "scale": KELVIN_PER_COUNT});
                png_16(size, &counts, &[("isotherm", scale.to_string())])?
            }
            ImageKind::Parts => {
                let parts: Vec<u16> = labelled.part.iter().map(|part| (*part).min(65535) as u16).collect();
                png_16(size, &parts, &[("isotherm", json!({"part": "value - 1, none at 0"}).to_string())])?
            }
            ImageKind::Radiance => {
                let Some(image) = image.take() else { continue };
                let prepared = simulation.prepared();
                let step = (image.time / prepared.scene.time.step + 1e-9) as u32;
                let camera = image.camera.clone();
                let maker = FrameMaker::new(prepared, &camera, &simulation.device_name());
                let (frame, header) = maker.frame_of(image, step, Some(labelled.number))?;
                encode(&frame, &header)?
            }
        };
        files.push((file_of(labelled, *kind).1, bytes));
    }
    Ok(Encoded { number: labelled.number, files, row: row(labelled, &spec.images) })
}

/// Digital numbers as PNG: of 8 bits where the sensor has 8, otherwise of 16.
fn numbers(image: &LabelledImage) -> Result<Vec<u8>, OutputError> {
    let size = [image.width, image.height];
    let values = image.digital_numbers.as_deref().unwrap_or_default();
    let text = [("isotherm", json!({"bits": image.bits}).to_string())];
    if image.bits == 8 {
        let values: Vec<u8> = values.iter().map(|value| *value as u8).collect();
        return png_8(size, &values, &text);
    }
    png_16(size, values, &text)
}

/// What the whole set needs of an orbit.
pub fn orbit_json(craft: &Craft, drawn: &Json, outcome: &Outcome, rows: Vec<Map<String, Json>>) -> Json {
    let rejections: Map<String, Json> =
        outcome.rejections.iter().map(|(reason, count)| (reason.words().to_owned(), json!(count))).collect();
    json!({"object": craft.name, "drawn": drawn, "rejected": rejections, "images": rows})
}

/// Writes the files of an orbit.
///
/// # Errors
/// A full disk.
pub fn write(folder: &mut OrbitFolder, images: &[Encoded]) -> Result<(), DatasetError> {
    for (path, bytes) in images.iter().flat_map(|image| &image.files) {
        folder.write(path, bytes)?;
    }
    Ok(())
}
