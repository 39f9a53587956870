//! The attributes in the header of an EXR file, for writing and reading.

use std::path::Path;

use ::exr::meta::attribute::Text;
use ::exr::prelude::{AttributeValue, LayerAttributes};
use glam::{DAffine3, DMat4, DQuat, DVec3};

use super::OutputError;
use super::frame::{FrameHeader, TEMPERATURE, TEMPERATURE_ERROR};
use crate::lens::{Distortion, Lens};
use crate::scene::{Camera, CameraFrame, Motion, MotionBlur};
use crate::simulation::image::Image;
use crate::thermal::budget::CHANNELS;
use crate::thermal::planck::Band;

const RADIANCE_UNIT: &str = "W.m^-2.sr^-1";
/// Poses that not every file has.
const FROM_ORBIT: &str = "isotherm_camera_from_orbit";
const FROM_INERTIAL: &str = "isotherm_camera_from_inertial";
/// Names of the parameters of the uncertainty.
const CAUSES: &str = "isotherm_causes";
/// Length of an exposure [s], and its sub-frames.
const EXPOSURE: &str = "isotherm_camera_exposure_s";
const SUB_FRAMES: &str = "isotherm_camera_sub_frames";
const LAST_ROW: &str = "isotherm_camera_from_body_last_row";
/// Names of the bands.
const BANDS: &str = "isotherm_bands";
/// Names of the models of distortion, as in a scene.
const BROWN_CONRADY: &str = "brown_conrady";
const FISHEYE: &str = "fisheye";

/// The attributes in a readable order. The file has them sorted by name.
pub(super) fn header_attributes(frame: &Image, header: &FrameHeader) -> Vec<(String, AttributeValue)> {
    let background = if frame.coverage.is_empty() {
        "part = 0; there T, Z and material are 0 too, and L is 0 or that of the sky"
    } else {
        "part = 0; there T, Z and material are 0 too, and L is 0 or that of the sky where coverage is 0"
    };
    let image = header.image.map(|image| ("isotherm_image", AttributeValue::I32(image.cast_signed())));
    let mut all = vec![
        ("isotherm_version", string(&header.version)),
        ("isotherm_device", string(&header.device)),
        ("isotherm_scene", string(&header.scene)),
        ("isotherm_scene_sha256", string(&header.scene_sha256)),
        ("isotherm_step", AttributeValue::I32(header.step.cast_signed())),
        ("isotherm_time_s", AttributeValue::F64(frame.time)),
        ("isotherm_band_um", doubles("v2d", &[micrometres(header.band.lower), micrometres(header.band.upper)])),
        ("emissiveUnits", string(RADIANCE_UNIT)),
        ("isotherm_units_L", string(RADIANCE_UNIT)),
        ("isotherm_units_T", string("K")),
        ("isotherm_units_Z", string("m, along camera +Z")),
        ("isotherm_units_part", string("index into isotherm_parts")),
        ("isotherm_units_material", string("index into isotherm_materials")),
        ("isotherm_background", string(background)),
        ("isotherm_parts", names(&header.parts)),
        ("isotherm_materials", names(&header.materials)),
    ];
    all.extend(image);
    if !frame.coverage.is_empty() {
        let units = "share of the pixel's samples that show a surface; L is the mean of all samples; T, Z, part and material are those of the pixel's centre";
        all.push(("isotherm_units_coverage", string(units)));
    }
    if !frame.error.is_empty() {
        all.push(("isotherm_units_T_error", string("K, one standard deviation of the error of T")));
    }
    if !frame.sigma.cause.is_empty() {
        all.extend([
            ("isotherm_units_T_sigma", string("K, one standard deviation of T by the ranges of isotherm_causes")),
            ("isotherm_units_cause", string("index into isotherm_causes: the parameter that adds most to T_sigma")),
            (CAUSES, names(&frame.sigma.causes)),
        ]);
        if !frame.sigma.radiance.is_empty() {
            let units = "W.m^-2.sr^-1, one standard deviation of L by these ranges";
            all.push(("isotherm_units_L_sigma", string(units)));
        }
    }
    all.extend(camera_attributes(frame, header));
    let mut all: Vec<_> = all.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
    if !frame.budget.is_empty() {
        let unit = |name: &&str| (format!("isotherm_units_{name}"), string("W m-2, gain of the surface"));
        all.extend(CHANNELS.iter().map(unit));
    }
    for (name, band) in &header.bands {
        let ends = [micrometres(band.lower), micrometres(band.upper)];
        all.push((band_attribute(name), doubles("v2d", &ends)));
        all.push((format!("isotherm_units_{name}.L"), string(RADIANCE_UNIT)));
    }
    if frame.bands.ratio.is_some() {
        let units = "K, of a grey body of the ratio of two bands; 0 where the ratio tells none";
        all.push((format!("isotherm_units_{TEMPERATURE}"), string(units)));
        let units = "K, one standard deviation by the noise of both bands";
        all.push((format!("isotherm_units_{TEMPERATURE_ERROR}"), string(units)));
    }
    for (number, (_, pose)) in header.joints.iter().enumerate() {
        all.push((joint_attribute(number), matrix(pose)));
    }
    all
}

/// Name of the ends of a band.
fn band_attribute(name: &str) -> String {
    format!("isotherm_band_um_{name}")
}

/// Name of the pose of a joint.
fn joint_attribute(number: usize) -> String {
    format!("isotherm_body_from_joint_{}", number + 1)
}

/// Lens and poses.
fn camera_attributes(image: &Image, header: &FrameHeader) -> Vec<(&'static str, AttributeValue)> {
    let camera = &image.camera;
    let pose = camera.frame_from_camera;
    let frame_name = match camera.frame {
        CameraFrame::Body => "body",
        CameraFrame::Orbit => "orbit",
        CameraFrame::Inertial => "inertial",
    };
    let Lens { focal, centre, skew, distortion } = camera.lens;
    let (model, numbers): (_, &[f64]) = match &distortion {
        Distortion::None => ("pinhole", &[]),
        Distortion::BrownConrady(numbers) => (BROWN_CONRADY, numbers),
        Distortion::Fisheye(numbers) => (FISHEYE, numbers),
    };
    let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
    // OpenCV has pixel centres at whole numbers.
    let opencv = [focal[0], skew, centre[0] - 0.5, 0.0, focal[1], centre[1] - 0.5, 0.0, 0.0, 1.0];
    let axes = format!("{model}; +X right, +Y down, +Z forward; first pixel centre at (0.5, 0.5)");
    let mut all = vec![
        ("isotherm_camera_model", string(&axes)),
        ("isotherm_camera_focal_px", doubles("v2d", &focal)),
        ("isotherm_camera_centre_px", doubles("v2d", &centre)),
        ("isotherm_camera_skew_px", AttributeValue::F64(skew)),
        ("isotherm_camera_distortion", string(&numbers.join(" "))),
        ("isotherm_camera_opencv_matrix", doubles("m33d", &opencv)),
        ("isotherm_camera_samples", AttributeValue::I32(camera.samples.cast_signed())),
        ("isotherm_camera_line_time_s", AttributeValue::F64(camera.line_time)),
        ("isotherm_camera_near_m", AttributeValue::F64(camera.near)),
        ("isotherm_camera_frame", string(frame_name)),
        ("isotherm_camera_position_m", doubles("v3d", &camera.position.to_array())),
        // OpenEXR has no type for four doubles, so this is text. The scalar comes first.
        ("isotherm_frame_from_camera_wxyz", string(&format!("{} {} {} {}", pose.w, pose.x, pose.y, pose.z))),
        ("isotherm_camera_from_body", matrix(&DMat4::from(image.camera_from_body))),
    ];
    if camera.exposure.is_mean() {
        all.push((EXPOSURE, AttributeValue::F64(camera.exposure.time)));
        all.push((SUB_FRAMES, AttributeValue::I32(camera.exposure.sub_frames.cast_signed())));
    }
    for (name, pose) in [
        (FROM_ORBIT, &header.camera_from_orbit),
        (FROM_INERTIAL, &header.camera_from_inertial),
        (LAST_ROW, &header.last_row_from_body),
    ] {
        all.extend(pose.as_ref().map(|pose| (name, matrix(pose))));
    }
    if !header.bands.is_empty() {
        let names = header.bands.iter().map(|(name, _)| text(name)).collect();
        all.push((BANDS, AttributeValue::TextVector(names)));
    }
    if !header.joints.is_empty() {
        let names = header.joints.iter().map(|(name, _)| text(name)).collect();
        all.push(("isotherm_joints", AttributeValue::TextVector(names)));
    }
    all
}

/// Metres in micrometres, without the rounding error of 14e-6 * 1e6.
fn micrometres(metres: f64) -> f64 {
    (metres * 1e15).round() / 1e9
}

/// Text in UTF-8, as OpenEXR defines it. The exr crate's own conversion assumes Latin-1.
pub(super) fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn string(value: &str) -> AttributeValue {
    AttributeValue::Text(text(value))
}

/// A string vector. Entry i is the name of pixel value i.
fn names(list: &[String]) -> AttributeValue {
    AttributeValue::TextVector(std::iter::once("background").chain(list.iter().map(String::as_str)).map(text).collect())
}

/// A rigid motion. OpenEXR stores matrices row after row.
fn matrix(pose: &DMat4) -> AttributeValue {
    doubles("m44d", &pose.transpose().to_cols_array())
}

/// An OpenEXR type made of doubles that the exr crate does not support by name.
fn doubles(kind: &str, values: &[f64]) -> AttributeValue {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    AttributeValue::Custom { kind: text(kind), bytes }
}

/// The attributes of a file, and its name for errors.
pub(super) struct Attributes<'a> {
    pub(crate) path: &'a Path,
    pub(crate) attributes: &'a LayerAttributes,
}

impl Attributes<'_> {
    fn get(&self, name: &str) -> Result<&AttributeValue, OutputError> {
        let missing = || OutputError::exr(self.path, format!("attribute {name} is missing: not a frame of isotherm"));
        self.attributes.other.get(&text(name)).ok_or_else(missing)
    }

    fn wrong(&self, name: &str) -> OutputError {
        OutputError::exr(self.path, format!("attribute {name} has a type or value that isotherm does not write"))
    }

    fn string(&self, name: &str) -> Result<String, OutputError> {
        match self.get(name)? {
            AttributeValue::Text(value) => Ok(String::from_utf8_lossy(value.as_slice()).into_owned()),
            _ => Err(self.wrong(name)),
        }
    }

    fn has(&self, name: &str) -> bool {
        self.attributes.other.contains_key(&text(name))
    }

    fn texts(&self, name: &str) -> Result<Vec<String>, OutputError> {
        match self.get(name)? {
            AttributeValue::TextVector(list) => {
                Ok(list.iter().map(|value| String::from_utf8_lossy(value.as_slice()).into_owned()).collect())
            }
            _ => Err(self.wrong(name)),
        }
    }

    /// Names of the parameters whose ranges make the image uncertain. Empty without `[uncertainty]`.
    pub(super) fn causes(&self) -> Result<Vec<String>, OutputError> {
        if self.has(CAUSES) { self.names(CAUSES) } else { Ok(Vec::new()) }
    }

    /// Texts without the first, which names the background.
    fn names(&self, name: &str) -> Result<Vec<String>, OutputError> {
        Ok(self.texts(name)?.into_iter().skip(1).collect())
    }

    fn matrix(&self, name: &str) -> Result<DMat4, OutputError> {
        Ok(DMat4::from_cols_array(&self.doubles::<16>(name)?).transpose())
    }

    fn distortion(&self) -> Result<Distortion, OutputError> {
        let name = "isotherm_camera_distortion";
        if !self.has(name) {
            return Ok(Distortion::None);
        }
        let numbers: Result<Vec<f64>, _> = self.string(name)?.split_whitespace().map(str::parse).collect();
        match numbers.as_deref() {
            Ok([]) => Ok(Distortion::None),
            Ok(&[k1, k2, k3, k4]) => Ok(Distortion::Fisheye([k1, k2, k3, k4])),
            Ok(numbers) => match numbers.try_into() {
                Ok(numbers) => Ok(Distortion::BrownConrady(numbers)),
                Err(_) => Err(self.wrong(name)),
            },
            Err(_) => Err(self.wrong(name)),
        }
    }

    pub(crate) fn integer(&self, name: &str) -> Result<u32, OutputError> {
        match self.get(name)? {
            AttributeValue::I32(value) => Ok(value.cast_unsigned()),
            _ => Err(self.wrong(name)),
        }
    }

    /// A number that frames may lack.
    pub(crate) fn optional_integer(&self, name: &str) -> Result<Option<u32>, OutputError> {
        if self.attributes.other.contains_key(&text(name)) { self.integer(name).map(Some) } else { Ok(None) }
    }

    pub(crate) fn doubles<const N: usize>(&self, name: &str) -> Result<[f64; N], OutputError> {
        match self.get(name)? {
            AttributeValue::F64(value) if N == 1 => Ok([*value; N]),
            AttributeValue::Custom { bytes, .. } if bytes.len() == 8 * N => {
                let mut values = [0.0; N];
                for (value, bytes) in values.iter_mut().zip(bytes.as_chunks::<8>().0) {
                    *value = f64::from_le_bytes(*bytes);
                }
                Ok(values)
            }
            _ => Err(self.wrong(name)),
        }
    }

    /// The image without pixels: its time and its camera.
    pub(crate) fn image(&self, width: u32, height: u32) -> Result<Image, OutputError> {
        let quaternion = "isotherm_frame_from_camera_wxyz";
        let numbers: Result<Vec<f64>, _> = self.string(quaternion)?.split(' ').map(str::parse).collect();
        let frame_from_camera = match numbers.as_deref() {
            Ok(&[w, x, y, z]) => DQuat::from_xyzw(x, y, z, w),
            _ => return Err(self.wrong(quaternion)),
        };
        let frame = match self.string("isotherm_camera_frame")?.as_str() {
            "body" => CameraFrame::Body,
            "orbit" => CameraFrame::Orbit,
            "inertial" => CameraFrame::Inertial,
            _ => return Err(self.wrong("isotherm_camera_frame")),
        };
        // Files of earlier versions have a pinhole and one pose.
        let or = |name: &str, absent: f64| {
            if self.has(name) { Ok(self.doubles::<1>(name)?[0]) } else { Ok::<_, OutputError>(absent) }
        };
        let samples = "isotherm_camera_samples";
        let camera = Camera {
            width,
            height,
            lens: Lens {
                focal: self.doubles("isotherm_camera_focal_px")?,
                centre: self.doubles("isotherm_camera_centre_px")?,
                skew: or("isotherm_camera_skew_px", 0.0)?,
                distortion: self.distortion()?,
            },
            samples: if self.has(samples) { self.integer(samples)? } else { 1 },
            line_time: or("isotherm_camera_line_time_s", 0.0)?,
            exposure: MotionBlur {
                time: or(EXPOSURE, 0.0)?,
                sub_frames: if self.has(SUB_FRAMES) { self.integer(SUB_FRAMES)? } else { 1 },
            },
            motion: Motion::Still,
            frame,
            position: DVec3::from_array(self.doubles("isotherm_camera_position_m")?),
            frame_from_camera,
            near: self.doubles::<1>("isotherm_camera_near_m")?[0],
        };
        let pose = DAffine3::from_mat4(self.matrix("isotherm_camera_from_body")?);
        Ok(Image::blank(camera, pose, self.doubles::<1>("isotherm_time_s")?[0]))
    }

    pub(crate) fn header(&self) -> Result<FrameHeader, OutputError> {
        let [lower, upper] = self.doubles("isotherm_band_um")?.map(|micrometres: f64| micrometres / 1e6);
        let joints = if self.has("isotherm_joints") { self.texts("isotherm_joints")? } else { Vec::new() };
        let pose = |(number, name)| Ok((name, self.matrix(&joint_attribute(number))?));
        let joints = joints.into_iter().enumerate().map(pose).collect::<Result<_, OutputError>>()?;
        let bands = if self.has(BANDS) { self.texts(BANDS)? } else { Vec::new() };
        let band = |name: String| {
            let [lower, upper] = self.doubles(&band_attribute(&name))?.map(|micrometres: f64| micrometres / 1e6);
            Ok((name, Band { lower, upper }))
        };
        let bands = bands.into_iter().map(band).collect::<Result<_, OutputError>>()?;
        let pose = |name: &str| self.has(name).then(|| self.matrix(name)).transpose();
        Ok(FrameHeader {
            scene: self.string("isotherm_scene")?,
            scene_sha256: self.string("isotherm_scene_sha256")?,
            device: self.string("isotherm_device")?,
            version: self.string("isotherm_version")?,
            band: Band { lower, upper },
            bands,
            step: self.integer("isotherm_step")?,
            image: self.optional_integer("isotherm_image")?,
            camera_from_orbit: pose(FROM_ORBIT)?,
            camera_from_inertial: pose(FROM_INERTIAL)?,
            last_row_from_body: pose(LAST_ROW)?,
            joints,
            parts: self.names("isotherm_parts")?,
            materials: self.names("isotherm_materials")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_in_micrometres_is_the_number_that_a_user_wrote() {
        for um in [1.0, 3.7, 8.0, 10.3, 14.0, 49.0, 50.0] {
            assert_eq!(micrometres(um / 1e6), um);
        }
        assert_eq!(micrometres(14e-6), 14.0);
        assert_ne!(7.3e-6 * 1e6, 7.3, "the naive product rounds");
    }
}
