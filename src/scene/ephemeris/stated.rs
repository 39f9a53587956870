//! A trajectory as its file states it, and the meaning of the words in the file.

use std::path::Path;

use glam::DVec3;
use hifitime::{Epoch, TimeScale};

use super::super::epoch::parse_epoch;
use super::super::error::SceneError;
use super::span::StatedValue;
use super::text::FileLine;
use crate::environment::divided_differences::HIGHEST_DEGREE;
use crate::environment::frames::ReferenceFrame;
use crate::environment::scene_time::SceneTime;

#[derive(Debug, Clone, Default)]
pub(in crate::scene) struct Options {
    /// The object to read if the file holds several.
    pub(in crate::scene) object: Option<String>,
    pub(in crate::scene) frame: Option<String>,
    pub(in crate::scene) time_system: Option<String>,
    /// `hermite` or `lagrange`, if the file does not state it.
    pub(in crate::scene) interpolation: Option<String>,
    pub(in crate::scene) degree: Option<u32>,
    pub(in crate::scene) start: Option<Epoch>,
    /// Whether the trajectory may begin after time 0.
    pub(in crate::scene) elsewhere: bool,
}

/// A segment in the words of the file.
#[derive(Debug, Clone, Default)]
pub(super) struct Stated {
    pub(super) line: usize,
    pub(super) object_name: String,
    pub(super) object_id: String,
    pub(super) centre: Option<String>,
    pub(super) start: StatedValue,
    pub(super) stop: StatedValue,
    /// Mandatory metadata keys that are missing but not needed.
    pub(super) missing: Vec<&'static str>,
    /// Whether the file ends inside a line of this segment.
    pub(super) torn: bool,
    pub(super) frame: StatedValue,
    pub(super) time_system: StatedValue,
    pub(super) usable_start: StatedValue,
    pub(super) usable_stop: StatedValue,
    pub(super) interpolation: StatedValue,
    pub(super) degree: StatedValue,
    pub(super) lines: Vec<StateLine>,
}

/// One state [m, m/s] in the frame of the file.
#[derive(Debug, Clone)]
pub(super) struct StateLine {
    pub(super) line: usize,
    pub(super) epoch: String,
    pub(super) position: DVec3,
    pub(super) velocity: Option<DVec3>,
}

const FRAMES: [(&str, ReferenceFrame); 7] = [
    ("GCRF", ReferenceFrame::Inertial),
    ("EME2000", ReferenceFrame::Inertial),
    ("J2000", ReferenceFrame::Inertial),
    ("ICRF", ReferenceFrame::Inertial),
    ("TEME", ReferenceFrame::Teme),
    ("TEMEOFDATE", ReferenceFrame::Teme),
    ("GRC", ReferenceFrame::Itrf),
];

/// The frame with this name, or a message that lists the known frames.
pub(super) fn reference_frame(name: &str) -> Result<ReferenceFrame, String> {
    let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    if let Some((_, frame)) = FRAMES.iter().find(|(known, _)| known.eq_ignore_ascii_case(&plain)) {
        return Ok(*frame);
    }
    let upper = plain.to_ascii_uppercase();
    if let Some(rest) = upper.strip_prefix("ITRF").or_else(|| upper.strip_prefix("ICRF"))
        && rest.chars().all(|letter| letter.is_ascii_digit())
    {
        return Ok(if upper.starts_with("ITRF") { ReferenceFrame::Itrf } else { ReferenceFrame::Inertial });
    }
    Err(format!("the frame '{name}' is not one of 'EME2000', 'J2000', 'ICRF', 'GCRF', 'TEME', 'ITRF'"))
}

pub(super) fn stated_degree(path: &Path, (line, text): &(usize, String)) -> Result<usize, SceneError> {
    let degree = text.parse::<usize>().ok().filter(|degree| (1..=HIGHEST_DEGREE).contains(degree));
    degree.ok_or_else(|| {
        let message = format!("must be a whole number from 1 to {HIGHEST_DEGREE}, found '{text}'");
        FileLine { path, line: *line }.error("INTERPOLATION_DEGREE", message)
    })
}

/// Parses a time. In a table it may be seconds after the start of the scene.
pub(super) fn state_epoch(text: &str, scale: TimeScale, options: &Options) -> Result<Epoch, String> {
    match (text.parse::<f64>(), options.start) {
        (Ok(seconds), Some(start)) => {
            let seconds = SceneTime::new(seconds).map_err(|error| error.to_string())?.seconds();
            Ok(start.to_time_scale(TimeScale::TAI) + hifitime::Unit::Second * seconds)
        }
        (Ok(_), None) => Err("times in seconds count from time.start, which is missing".to_owned()),
        _ => parse_epoch(text, scale),
    }
}
