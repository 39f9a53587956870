//! Measured images: frames of isotherm as EXR, and PNG of 16 bits whose counts are temperatures.

use std::path::{Path, PathBuf};

use glam::DAffine3;
use hifitime::Epoch;
use wildmatch::WildMatch;

use super::FittingError;
use crate::environment::trajectory::seconds_between;
use crate::files;
use crate::misspelt::suggestion;
use crate::output::apparent::Apparent;
use crate::output::exr::decode_exr;
use crate::output::gray::{GrayImage, read_gray};
use crate::scene::{FitInput, ImageRule};
use crate::thermal::planck::Band;

/// A measured image.
#[derive(Debug, Clone)]
pub(super) struct MeasuredImage {
    pub(super) path: PathBuf,
    pub(super) name: String,
    /// Time of the scene [s].
    pub(super) time: f64,
    /// Pose of the camera in the file, where it has one.
    pub(super) camera_from_body: Option<DAffine3>,
    pub(super) rule: ImageRule,
    pub(super) size: [u32; 2],
    /// Temperature of each pixel [K], 0 where it has none or is masked.
    pub(super) temperatures: Vec<f32>,
}

/// What images share.
pub(super) struct ImageReader<'a> {
    pub(super) input: &'a FitInput,
    pub(super) band: Band,
    pub(super) apparent: &'a Apparent,
    /// Size of the images of the scene's camera.
    pub(super) size: [u32; 2],
    /// Time of the last step [s], and the date of time 0.
    pub(super) end: f64,
    pub(super) start: Option<Epoch>,
}

/// An image as its file has it: size, temperatures [K], time and pose.
struct Pixels {
    size: [u32; 2],
    temperatures: Vec<f32>,
    time: Option<f64>,
    camera_from_body: Option<DAffine3>,
}

fn wrong(path: &Path, reason: impl ToString) -> FittingError {
    FittingError::Measured { path: path.to_path_buf(), reason: reason.to_string() }
}

impl ImageReader<'_> {
    /// Reads images, in the order of their times.
    ///
    /// # Errors
    /// A file that is no image, has no rule, no time, another size or band than the scene, or lies outside the run.
    pub(super) fn read(&self, paths: &[PathBuf]) -> Result<Vec<MeasuredImage>, FittingError> {
        let mut images = paths.iter().map(|path| self.image(path)).collect::<Result<Vec<_>, _>>()?;
        images.sort_by(|a, b| a.time.total_cmp(&b.time));
        if let Some(idle) = self.input.images.iter().find(|rule| !images.iter().any(|image| image.rule == **rule)) {
            let names: Vec<_> =
                paths.iter().filter_map(|path| path.file_name()).map(|name| name.to_string_lossy()).collect();
            let near = suggestion(&idle.pattern, names.iter().map(|name| &**name));
            let message = format!("no measured image has a name like '{}'{near}", idle.pattern);
            return Err(self.input.error(idle.line, "image.file", message).into());
        }
        Ok(images)
    }

    fn image(&self, path: &Path) -> Result<MeasuredImage, FittingError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let rule = self.input.images.iter().find(|rule| WildMatch::new(&rule.pattern).matches(&name));
        let rule = rule.ok_or_else(|| wrong(path, "no [[image]] has a pattern that fits its name"))?;
        let bytes = files::read(path).map_err(|fault| wrong(path, fault))?;
        let pixels = match bytes.starts_with(b"\x89PNG") {
            true => counts(path, &bytes, rule)?,
            false => self.frame(path, &bytes, rule)?,
        };
        if pixels.size != self.size {
            let [[width, height], [w, h]] = [pixels.size, self.size];
            return Err(wrong(
                path,
                format!("is an image of {width} x {height} pixels, and the scene's camera has {w} x {h}"),
            ));
        }
        let time = self.time(path, rule, pixels.time)?;
        let mut temperatures = pixels.temperatures;
        if let Some(mask) = &rule.mask {
            let bytes = files::read(mask).map_err(|fault| wrong(mask, fault))?;
            let GrayImage { size, values, .. } = read_gray(&bytes).map_err(|error| wrong(mask, error))?;
            if size != self.size {
                return Err(wrong(
                    mask,
                    format!(
                        "is a mask of {} x {} pixels, and the images have {} x {}",
                        size[0], size[1], self.size[0], self.size[1]
                    ),
                ));
            }
            temperatures.iter_mut().zip(values).filter(|(_, mask)| *mask == 0).for_each(|(pixel, _)| *pixel = 0.0);
        }
        Ok(MeasuredImage {
            path: path.to_path_buf(),
            name,
            time,
            camera_from_body: pixels.camera_from_body,
            rule: rule.clone(),
            size: pixels.size,
            temperatures,
        })
    }

    fn time(&self, path: &Path, rule: &ImageRule, stated: Option<f64>) -> Result<f64, FittingError> {
        let time = match (rule.time, stated) {
            (Some(Ok(time)), _) | (None, Some(time)) => time,
            (Some(Err(epoch)), _) => {
                let start =
                    self.start.ok_or_else(|| wrong(path, "has a date, for which the scene needs time.start"))?;
                seconds_between(start, epoch)
            }
            (None, None) => return Err(wrong(path, "states no time: give its [[image]] a time or utc")),
        };
        match (0.0..=self.end * (1.0 + 1e-9)).contains(&time) {
            true => Ok(time.min(self.end)),
            false => Err(wrong(
                path,
                format!("its time, {time} s, lies outside the run, which goes from 0 to {} s", self.end),
            )),
        }
    }

    /// A frame of isotherm.
    fn frame(&self, path: &Path, bytes: &[u8], rule: &ImageRule) -> Result<Pixels, FittingError> {
        let (image, header) =
            decode_exr(bytes, path).map_err(|error| wrong(path, format!("is no frame of isotherm ({error})")))?;
        if header.band != self.band && !rule.surface {
            let [[a, b], [c, d]] = [header.band.micrometres(), self.band.micrometres()];
            return Err(wrong(path, format!("shows radiance from {a} to {b} um, and the scene from {c} to {d} um")));
        }
        let temperatures = match rule.surface {
            true => image.temperature,
            false => image.radiance.iter().map(|radiance| self.apparent.temperature(*radiance)).collect(),
        };
        Ok(Pixels {
            size: [image.camera.width, image.camera.height],
            temperatures,
            time: Some(image.time),
            camera_from_body: Some(image.camera_from_body),
        })
    }
}

/// A PNG of 16 bits. The scale stands in the text that isotherm writes, or in the rule.
fn counts(path: &Path, bytes: &[u8], rule: &ImageRule) -> Result<Pixels, FittingError> {
    let GrayImage { size, values, text } = read_gray(bytes).map_err(|error| wrong(path, error))?;
    let told = text.and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok());
    let told = told.filter(|told| told.get("kelvin").is_some()).and_then(|told| told.get("scale")?.as_f64());
    let scale = rule.scale.or(told).filter(|scale| *scale > 0.0);
    let scale =
        scale.ok_or_else(|| wrong(path, "does not say how many kelvins a count is: give its [[image]] a scale"))?;
    let temperatures = values.iter().map(|value| (f64::from(*value) * scale) as f32).collect();
    Ok(Pixels { size, temperatures, time: None, camera_from_body: None })
}
