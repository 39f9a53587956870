//! The lens of a camera: focal lengths, principal point, skew and distortion.

use super::super::error::SceneError;
use super::super::keys::OF_THE_LENS;
use super::super::preset::Preset;
use super::super::quantity::Quantity;
use super::super::section::Section;
use crate::lens::{Distortion, Lens};

/// Place of the principal point, and skew.
const PLACE: Quantity = Quantity::within(-100_000.0, 100_000.0, "px");

/// The lens of an image of this size. A lens that folds the image is refused.
pub(super) fn read(
    section: &Section,
    preset: Option<&Preset>,
    size: [u32; 2],
    assumptions: &mut Vec<String>,
) -> Result<Lens, SceneError> {
    let focal = focal(section, preset, size[0])?;
    let skew = section.number("skew", PLACE)?.unwrap_or(0.0);
    let distortion = distortion(section, assumptions)?;
    let centre = match [section.number("cx", PLACE)?, section.number("cy", PLACE)?] {
        [Some(x), Some(y)] => [x, y],
        [None, None] => {
            if ["fx", "skew", "distortion"].iter().any(|key| section.has(key)) {
                assumptions.push(
                    "The principal point is the centre of the image (camera.cx and camera.cy are absent).".to_owned(),
                );
            }
            size.map(|side| f64::from(side) / 2.0)
        }
        [Some(_), None] => return Err(section.missing("cy", &["cx"], "cx needs it [px]")),
        [None, Some(_)] => return Err(section.missing("cx", &["cy"], "cy needs it [px]")),
    };
    let lens = Lens { focal, centre, skew, distortion };
    if !lens.is_pinhole() {
        let key = if distortion == Distortion::None { "skew" } else { "distortion" };
        lens.field(size).map_err(|error| section.clash(key, OF_THE_LENS, error))?;
    }
    Ok(lens)
}

/// Focal lengths [px]. The file states them in one of four ways.
fn focal(section: &Section, preset: Option<&Preset>, width: u32) -> Result<[f64; 2], SceneError> {
    let ways = ["fov_deg", "focal_length", "focal_px", "fx"];
    for (number, way) in ways.iter().enumerate() {
        ways[number + 1..].iter().try_for_each(|other| section.exclusive(way, other))?;
        if *way != "fx" {
            section.exclusive(way, "fy")?;
        }
    }
    let stated = section.number("pixel_pitch", Quantity::positive("m"))?;
    let pitch = stated.or(preset.and_then(|preset| preset.pitch));
    if let Some(length) = section.number("focal_length", Quantity::positive("m"))? {
        let pitch = section.required("pixel_pitch", pitch, "focal_length needs the distance between pixels [m]")?;
        return Ok([length / pitch; 2]);
    }
    if stated.is_some() {
        return Err(section.clash("pixel_pitch", &["focal_length"], "needs focal_length, which is missing"));
    }
    match ["fx", "fy"].map(|key| section.number(key, Quantity::positive("pixels"))) {
        [Ok(None), Ok(None)] => {}
        [x, y] => {
            let x = section.required("fx", x?, "fy needs the focal length along the rows [px]")?;
            let y = section.required("fy", y?, "fx needs the focal length along the columns [px]")?;
            return Ok([x, y]);
        }
    }
    if let Some(pixels) = section.number("focal_px", Quantity::positive("pixels"))? {
        return Ok([pixels; 2]);
    }
    let fov = section.number("fov_deg", Quantity::between(0.0, 180.0, "deg"))?;
    let fov = fov.or(preset.and_then(|preset| preset.fov_deg));
    let what =
        "the horizontal field of view [deg], or focal_length and pixel_pitch [m], or focal_px, or fx and fy [px]";
    let fov = section.required("fov_deg", fov, what)?;
    Ok([f64::from(width) / 2.0 / (fov.to_radians() / 2.0).tan(); 2])
}

/// How many numbers OpenCV's model may have.
const BROWN_CONRADY: [usize; 4] = [4, 5, 8, 12];
/// Remark for readers of files from before the four numbers were OpenCV's.
const FOUR: &str = "The four numbers of camera.distortion are OpenCV's k1, k2, p1, p2 (camera.distortion_model is absent). A fisheye needs \
                    distortion_model = \"fisheye\"; earlier versions took four numbers as a fisheye's.";

#[derive(Debug, Clone, Copy, PartialEq)]
enum DistortionModel {
    BrownConrady,
    Fisheye,
}

/// The distortion, in OpenCV's order of numbers.
fn distortion(section: &Section, assumptions: &mut Vec<String>) -> Result<Distortion, SceneError> {
    let models = [("brown_conrady", DistortionModel::BrownConrady), ("fisheye", DistortionModel::Fisheye)];
    let model = section.choice("distortion_model", &models)?;
    if section.is_wrong("distortion") {
        return Ok(Distortion::None);
    }
    let Some(numbers) = section.list("distortion", Quantity::within(-1e6, 1e6, ""))? else {
        return match model {
            Some(_) => Err(section.missing("distortion", &["distortion_model"], "distortion_model needs its numbers")),
            None => Ok(Distortion::None),
        };
    };
    match (model, numbers.as_slice()) {
        (Some(DistortionModel::Fisheye), &[k1, k2, k3, k4]) => Ok(Distortion::Fisheye([k1, k2, k3, k4])),
        (None | Some(DistortionModel::BrownConrady), numbers) if BROWN_CONRADY.contains(&numbers.len()) => {
            if model.is_none() && numbers.len() == 4 {
                assumptions.push(FOUR.to_owned());
            }
            let mut all = [0.0; 12];
            all[..numbers.len()].copy_from_slice(numbers);
            Ok(if all == [0.0; 12] { Distortion::None } else { Distortion::BrownConrady(all) })
        }
        (_, numbers) => {
            let expected = match model {
                Some(DistortionModel::Fisheye) => "4 numbers (k1, k2, k3, k4 of a fisheye)",
                Some(DistortionModel::BrownConrady) | None => {
                    "4, 5, 8 or 12 numbers (k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4)"
                }
            };
            Err(section.clash(
                "distortion",
                &["distortion_model"],
                format!("expected {expected}, found {}", numbers.len()),
            ))
        }
    }
}
