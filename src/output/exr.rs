//! EXR files: a frame without loss, with everything in the header that is needed to use it.
//!
//! Channels: `L` (float, radiance in the band), `T` (float, temperature), `Z` (float, distance along the camera's +Z),
//! `part` and `material` (uint). The header names units with `emissiveUnits` (spectral EXR layout of Fichet et al. 2021) and
//! `isotherm_units_*`; `isotherm_parts` and `isotherm_materials` are string vectors indexed by the pixel value itself.
//! Types are OpenEXR's own (`v2d`, `v3d`, `m44d`, `stringvector`), so that any reader shows them.
//!
//! The same frame gives the same bytes: blocks in increasing order, header attributes sorted by name.

use std::io::Cursor;
use std::path::Path;

use ::exr::meta::attribute::Text;
use ::exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes,
    LineOrder, ReadChannels, ReadLayers, SmallVec, WritableImage,
};
use glam::{DMat4, DQuat, DVec3};

use super::OutputError;
use super::folder::write_bytes;
use super::frame::{Frame, FrameHeader};
use crate::scene::{Band, Camera, CameraFrame};

const RADIANCE_UNIT: &str = "W.m^-2.sr^-1";

/// Writes a frame to `path`, whole or not at all.
///
/// # Errors
/// A channel that does not fill the image, or a file that cannot be written.
pub fn write_exr(path: &Path, frame: &Frame, header: &FrameHeader) -> Result<(), OutputError> {
    let bytes = encode(frame, header).map_err(|error| match error {
        OutputError::Encode { reason, .. } => OutputError::exr(path, reason),
        other => other,
    })?;
    write_bytes(path, &bytes)
}

/// The bytes of the EXR file of a frame.
///
/// # Errors
/// A channel that does not fill the image.
pub fn encode(frame: &Frame, header: &FrameHeader) -> Result<Vec<u8>, OutputError> {
    frame.check()?;
    let channels = SmallVec::from_vec(vec![
        AnyChannel::new("L", FlatSamples::F32(frame.radiance.clone())),
        AnyChannel::new("T", FlatSamples::F32(frame.temperature.clone())),
        AnyChannel::new("Z", FlatSamples::F32(frame.depth.clone())),
        AnyChannel::new("part", FlatSamples::U32(frame.part.clone())),
        AnyChannel::new("material", FlatSamples::U32(frame.material.clone())),
    ]);
    let mut attributes = LayerAttributes::default();
    for (name, value) in header_attributes(frame, header) {
        attributes.other.insert(text(name), value);
    }
    // ZIP is what every reader knows; blocks in increasing order make the bytes independent of the threads.
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (frame.width as usize, frame.height as usize);
    let image = Image::from_layer(Layer::new(size, attributes, encoding, AnyChannels::sort(channels)));

    let mut bytes = Vec::new();
    let failed = |reason: String| OutputError::Encode { what: "EXR image".into(), reason };
    image.write().to_buffered(Cursor::new(&mut bytes)).map_err(|error| failed(error.to_string()))?;
    sort_header(&mut bytes).ok_or_else(|| failed("the encoder's header is not understood".into()))?;
    Ok(bytes)
}

/// Reads a frame that isotherm wrote.
///
/// # Errors
/// The file is absent, is no EXR file, or lacks one of isotherm's channels or attributes.
pub fn read_exr(path: &Path) -> Result<(Frame, FrameHeader), OutputError> {
    let bytes = std::fs::read(path).map_err(|source| OutputError::Read { path: path.to_path_buf(), source })?;
    let image = ::exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(Cursor::new(bytes))
        .map_err(|error| OutputError::exr(path, error))?;
    let layer = image.layer_data;
    let attributes = Attributes { path, attributes: &layer.attributes };
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    let mut channels = layer.channel_data.list;
    let mut take = |name: &str| {
        let found = channels.iter().position(|channel| channel.name.as_slice() == name.as_bytes());
        found
            .map(|index| channels.swap_remove(index).sample_data)
            .ok_or_else(|| OutputError::exr(path, format!("channel {name} is missing: not a frame of isotherm")))
    };
    let mut float = |name: &str| match take(name)? {
        FlatSamples::F32(values) => Ok(values),
        _ => Err(OutputError::exr(path, format!("channel {name} is not 32-bit float"))),
    };
    let (radiance, temperature, depth) = (float("L")?, float("T")?, float("Z")?);
    let mut label = |name: &str| match take(name)? {
        FlatSamples::U32(values) => Ok(values),
        _ => Err(OutputError::exr(path, format!("channel {name} is not 32-bit uint"))),
    };
    let (part, material) = (label("part")?, label("material")?);
    let step = attributes.integer("isotherm_step")?;
    let time = attributes.doubles::<1>("isotherm_time_s")?[0];
    let frame = Frame { width, height, step, time, radiance, temperature, depth, part, material };
    Ok((frame, attributes.header(width, height)?))
}

/// The header in the order of its meaning; the file holds it sorted by name.
fn header_attributes(frame: &Frame, header: &FrameHeader) -> Vec<(&'static str, AttributeValue)> {
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
        ("isotherm_background", string("part = 0; there L, T, Z and material are 0 too")),
        ("isotherm_parts", names(&header.parts)),
        ("isotherm_materials", names(&header.materials)),
        ("isotherm_camera_model", string("pinhole; +X right, +Y down, +Z forward; first pixel centre at (0.5, 0.5)")),
        ("isotherm_camera_focal_px", doubles("v2d", &camera.focal)),
        ("isotherm_camera_centre_px", doubles("v2d", &camera.centre)),
        ("isotherm_camera_near_m", AttributeValue::F64(camera.near)),
        ("isotherm_camera_frame", string(frame_name)),
        ("isotherm_camera_position_m", doubles("v3d", &camera.position.to_array())),
        // Text, because OpenEXR has no type for four doubles; scalar first.
        ("isotherm_frame_from_camera_wxyz", string(&format!("{} {} {} {}", pose.w, pose.x, pose.y, pose.z))),
        ("isotherm_camera_from_body", doubles("m44d", &camera_from_body)),
    ]
}

/// Metres as micrometres, free of the rounding that 14e-6 * 1e6 brings.
fn micrometres(metres: f64) -> f64 {
    (metres * 1e15).round() / 1e9
}

fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

/// Text in UTF-8, as OpenEXR has it.
fn string(value: &str) -> AttributeValue {
    AttributeValue::Text(text(value))
}

/// A string vector whose entry i is the name of pixel value i.
fn names(list: &[String]) -> AttributeValue {
    AttributeValue::TextVector(std::iter::once("background").chain(list.iter().map(String::as_str)).map(text).collect())
}

/// One of OpenEXR's types made of doubles, which the exr crate does not know by name.
fn doubles(kind: &str, values: &[f64]) -> AttributeValue {
    let bytes = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    AttributeValue::Custom { kind: text(kind), bytes }
}

/// Sorts the attributes of the only header in `bytes` by name. The exr crate writes them in the order of a hash map, which
/// changes from run to run; their total size does not, so the block offsets behind them stay valid. `None` where the
/// bytes are not a header.
fn sort_header(bytes: &mut [u8]) -> Option<()> {
    // OpenEXR file layout: magic and version (8 bytes), then name\0 type\0 size(i32) value for each attribute, then \0.
    const START: usize = 8;
    let after_nul = |from: usize| Some(from + bytes.get(from..)?.iter().position(|&byte| byte == 0)? + 1);
    let mut attributes = Vec::new();
    let mut at = START;
    while *bytes.get(at)? != 0 {
        let size_at = after_nul(after_nul(at)?)?;
        let size = i32::from_le_bytes(bytes.get(size_at..size_at + 4)?.try_into().ok()?);
        let end = size_at + 4 + usize::try_from(size).ok()?;
        attributes.push(bytes.get(at..end)?.to_vec());
        at = end;
    }
    // Names end in \0, so whole attributes compare as their names do.
    attributes.sort();
    bytes[START..at].copy_from_slice(&attributes.concat());
    Some(())
}

/// The attributes of a file, and the name of that file for errors.
struct Attributes<'a> {
    path: &'a Path,
    attributes: &'a LayerAttributes,
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

    fn integer(&self, name: &str) -> Result<u32, OutputError> {
        match self.get(name)? {
            AttributeValue::I32(value) => Ok(value.cast_unsigned()),
            _ => Err(self.wrong(name)),
        }
    }

    fn doubles<const N: usize>(&self, name: &str) -> Result<[f64; N], OutputError> {
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

    fn header(&self, width: u32, height: u32) -> Result<FrameHeader, OutputError> {
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
    use crate::output::frame::tests::{header, sphere};

    #[test]
    fn a_frame_and_its_header_come_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let (mut frame, header) = (sphere(65, 37, 7), header(65, 37));
        frame.temperature[3] = f32::INFINITY;
        frame.radiance[4] = 1e-42;
        frame.part[5] = u32::MAX;
        write_exr(&path, &frame, &header).unwrap();
        let (read, read_header) = read_exr(&path).unwrap();
        assert_eq!(read, frame);
        assert_eq!(read_header, header);
        frame.depth[100] = frame.depth[100].next_up();
        assert_ne!(read, frame, "one ulp must show");
    }

    #[test]
    fn nan_survives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut frame = sphere(4, 4, 0);
        frame.temperature[2] = f32::NAN;
        write_exr(&path, &frame, &header(4, 4)).unwrap();
        assert!(read_exr(&path).unwrap().0.temperature[2].is_nan());
    }

    #[test]
    fn the_same_frame_gives_the_same_bytes() {
        let (frame, header) = (sphere(200, 150, 7), header(200, 150));
        let first = encode(&frame, &header).unwrap();
        for _ in 0..5 {
            assert!(encode(&frame, &header).unwrap() == first);
        }
        let mut other = header;
        other.band.upper = 13e-6;
        assert!(encode(&frame, &other).unwrap() != first);
    }

    #[test]
    fn header_attributes_are_sorted_so_that_their_order_is_no_accident() {
        let bytes = encode(&sphere(4, 4, 0), &header(4, 4)).unwrap();
        let position = |name: &str| bytes.windows(name.len()).position(|window| window == name.as_bytes()).unwrap();
        let names = ["channels\0", "emissiveUnits\0", "isotherm_background\0", "isotherm_time_s\0", "lineOrder\0"];
        assert!(names.windows(2).all(|pair| position(pair[0]) < position(pair[1])));
    }

    #[test]
    fn many_long_names_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut header = header(4, 4);
        header.parts = (0..3000).map(|i| format!("{i} {}", "part of a part ".repeat(1 + i % 90))).collect();
        header.materials = vec![];
        write_exr(&path, &sphere(4, 4, 0), &header).unwrap();
        assert_eq!(read_exr(&path).unwrap().1, header);
    }

    #[test]
    fn a_band_in_micrometres_is_the_number_that_a_user_wrote() {
        for um in [1.0, 3.7, 8.0, 10.3, 14.0, 49.0, 50.0] {
            assert_eq!(micrometres(um / 1e6), um);
        }
        assert_eq!(micrometres(14e-6), 14.0);
        assert_ne!(7.3e-6 * 1e6, 7.3, "the naive product rounds");
    }

    #[test]
    fn what_is_no_frame_is_refused_with_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut bytes = encode(&sphere(16, 16, 0), &header(16, 16)).unwrap();
        let cases: [(&str, Vec<u8>); 3] =
            [("empty", vec![]), ("text", b"not an image".to_vec()), ("truncated", bytes[..bytes.len() / 2].to_vec())];
        for (case, content) in cases {
            std::fs::write(&path, content).unwrap();
            let error = read_exr(&path).unwrap_err().to_string();
            assert!(error.contains("a.exr"), "{case}: {error}");
        }
        let name = b"isotherm_time_s\0";
        let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
        bytes[at] = b'I';
        std::fs::write(&path, &bytes).unwrap();
        let error = read_exr(&path).unwrap_err().to_string();
        assert!(error.contains("isotherm_time_s is missing"), "{error}");
        assert!(matches!(read_exr(&folder.path().join("absent.exr")), Err(OutputError::Read { .. })));
    }

    #[test]
    fn a_frame_of_the_wrong_size_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let mut frame = sphere(4, 4, 0);
        frame.part.pop();
        assert!(write_exr(&path, &frame, &header(4, 4)).is_err());
        assert!(!path.exists());
    }
}
