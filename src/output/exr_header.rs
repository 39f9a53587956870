//! The attributes in the header of an EXR file, for writing and reading.

use std::path::Path;

use ::exr::meta::attribute::Text;
use ::exr::prelude::{AttributeValue, LayerAttributes};
use glam::{DMat4, DQuat, DVec3};

use super::OutputError;
use super::frame::{Frame, FrameHeader};
use crate::scene::{Camera, CameraFrame};
use crate::thermal::planck::Band;

const RADIANCE_UNIT: &str = "W.m^-2.sr^-1";

/// The attributes in a readable order. The file has them sorted by name.
pub(super) fn header_attributes(frame: &Frame, header: &FrameHeader) -> Vec<(&'static str, AttributeValue)> {
    let camera = &header.camera;
    let pose = camera.frame_from_camera;
    // OpenEXR stores matrices row after row.
    let camera_from_body = header.camera_from_body.transpose().to_cols_array();
    let frame_name = match camera.frame {
        CameraFrame::Body => "body",
        CameraFrame::Orbit => "orbit",
        CameraFrame::Inertial => "inertial",
    };
    vec![
        ("isotherm_version", string(&header.version)),
        ("isotherm_device", string(&header.device)),
        ("isotherm_scene", string(&header.scene)),
        ("isotherm_scene_sha256", string(&header.scene_sha256)),
        ("isotherm_step", AttributeValue::I32(frame.step.cast_signed())),
        ("isotherm_time_s", AttributeValue::F64(frame.time)),
        ("isotherm_band_um", doubles("v2d", &[micrometres(header.band.lower), micrometres(header.band.upper)])),
        ("emissiveUnits", string(RADIANCE_UNIT)),
        ("isotherm_units_L", string(RADIANCE_UNIT)),
        ("isotherm_units_T", string("K")),
        ("isotherm_units_Z", string("m, along camera +Z")),
        ("isotherm_units_part", string("index into isotherm_parts")),
        ("isotherm_units_material", string("index into isotherm_materials")),
        ("isotherm_background", string("part = 0; there T, Z and material are 0 too, and L is 0 or that of the sky")),
        ("isotherm_parts", names(&header.parts)),
        ("isotherm_materials", names(&header.materials)),
        ("isotherm_camera_model", string("pinhole; +X right, +Y down, +Z forward; first pixel centre at (0.5, 0.5)")),
        ("isotherm_camera_focal_px", doubles("v2d", &camera.focal)),
        ("isotherm_camera_centre_px", doubles("v2d", &camera.centre)),
        ("isotherm_camera_near_m", AttributeValue::F64(camera.near)),
        ("isotherm_camera_frame", string(frame_name)),
        ("isotherm_camera_position_m", doubles("v3d", &camera.position.to_array())),
        // OpenEXR has no type for four doubles, so this is text. The scalar comes first.
        ("isotherm_frame_from_camera_wxyz", string(&format!("{} {} {} {}", pose.w, pose.x, pose.y, pose.z))),
        ("isotherm_camera_from_body", doubles("m44d", &camera_from_body)),
    ]
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

/// An OpenEXR type made of doubles that the exr crate does not support by name.
fn doubles(kind: &str, values: &[f64]) -> AttributeValue {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    AttributeValue::Custom { kind: text(kind), bytes }
}

/// The attributes of a file, and its name for errors.
pub(super) struct Attributes<'a> {
    pub path: &'a Path,
    pub attributes: &'a LayerAttributes,
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

    fn names(&self, name: &str) -> Result<Vec<String>, OutputError> {
        match self.get(name)? {
            AttributeValue::TextVector(list) => {
                Ok(list.iter().skip(1).map(|value| String::from_utf8_lossy(value.as_slice()).into_owned()).collect())
            }
            _ => Err(self.wrong(name)),
        }
    }

    pub fn integer(&self, name: &str) -> Result<u32, OutputError> {
        match self.get(name)? {
            AttributeValue::I32(value) => Ok(value.cast_unsigned()),
            _ => Err(self.wrong(name)),
        }
    }

    pub fn doubles<const N: usize>(&self, name: &str) -> Result<[f64; N], OutputError> {
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

    pub fn header(&self, width: u32, height: u32) -> Result<FrameHeader, OutputError> {
        let [lower, upper] = self.doubles("isotherm_band_um")?.map(|micrometres: f64| micrometres / 1e6);
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
        let rows = self.doubles::<16>("isotherm_camera_from_body")?;
        Ok(FrameHeader {
            scene: self.string("isotherm_scene")?,
            scene_sha256: self.string("isotherm_scene_sha256")?,
            device: self.string("isotherm_device")?,
            version: self.string("isotherm_version")?,
            band: Band { lower, upper },
            camera: Camera {
                width,
                height,
                focal: self.doubles("isotherm_camera_focal_px")?,
                centre: self.doubles("isotherm_camera_centre_px")?,
                frame,
                position: DVec3::from_array(self.doubles("isotherm_camera_position_m")?),
                frame_from_camera,
                near: self.doubles::<1>("isotherm_camera_near_m")?[0],
            },
            camera_from_body: DMat4::from_cols_array(&rows).transpose(),
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
