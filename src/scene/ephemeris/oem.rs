//! CCSDS Orbit Ephemeris Message in keyword-value notation (CCSDS 502.0-B, section 5).

use std::path::Path;

use glam::DVec3;

use super::super::error::SceneError;
use super::kvn::{KvnLine, check_version, lines};
use super::stated::{StateLine, Stated};
use super::text::{FileLine, number};

#[derive(Clone, Copy, PartialEq)]
enum OemBlock {
    Header,
    Metadata,
    States,
    Covariance,
}

pub(super) fn parse(path: &Path, text: &str) -> Result<Vec<Stated>, SceneError> {
    check_version(path, text, "CCSDS_OEM_VERS")?;
    let mut segments: Vec<Stated> = Vec::new();
    let mut block = OemBlock::Header;
    for (line, content) in lines(text) {
        let at = FileLine { path, line };
        match (content, block) {
            (KvnLine::Mark("META_START"), OemBlock::Header | OemBlock::States) => {
                segments.push(Stated { line, ..Stated::default() });
                block = OemBlock::Metadata;
            }
            (KvnLine::Mark("META_STOP"), OemBlock::Metadata) => block = OemBlock::States,
            (KvnLine::Mark("COVARIANCE_START"), OemBlock::States) => block = OemBlock::Covariance,
            (KvnLine::Mark("COVARIANCE_STOP"), OemBlock::Covariance) => block = OemBlock::States,
            (KvnLine::Mark(mark), _) => return Err(at.error(mark, "does not belong here")),
            (KvnLine::Pair(..), OemBlock::Header) | (_, OemBlock::Covariance) => {}
            (KvnLine::Pair(key, value), OemBlock::Metadata) => {
                if let Some(segment) = segments.last_mut() {
                    metadata(segment, line, key, value);
                }
            }
            (KvnLine::Data(data), OemBlock::States) => {
                let state = state(&at, line, data)?;
                if let Some(segment) = segments.last_mut() {
                    segment.lines.push(state);
                }
            }
            (KvnLine::Pair(key, _), OemBlock::States) => {
                return Err(at.error(key, "stands among the states; metadata belong between META_START and META_STOP"));
            }
            (KvnLine::Data(data), _) => {
                return Err(at.error(data.split_whitespace().next().unwrap_or(data), "is neither KEY = value nor data"));
            }
        }
    }
    match block {
        OemBlock::States => {
            segments.iter_mut().for_each(note_missing);
            if let Some(last) = segments.last_mut() {
                last.torn = !text.ends_with(['\n', '\r']);
            }
            Ok(segments)
        }
        OemBlock::Header => {
            Err(FileLine { path, line: 1 }.error("META_START", "is missing: the message has no segment"))
        }
        OemBlock::Metadata => Err(unfinished(path, text, "META_STOP")),
        OemBlock::Covariance => Err(unfinished(path, text, "COVARIANCE_STOP")),
    }
}

fn unfinished(path: &Path, text: &str, key: &str) -> SceneError {
    FileLine { path, line: text.lines().count() }.error(key, "is missing: the file ends before it")
}

/// Stores the value of a metadata key. Keys that do not affect the trajectory are ignored.
pub(super) fn metadata(segment: &mut Stated, line: usize, key: &str, value: &str) {
    let value = value.to_owned();
    match key {
        "OBJECT_NAME" => segment.object_name = value,
        "OBJECT_ID" => segment.object_id = value,
        "CENTER_NAME" => segment.centre = Some(value),
        "REF_FRAME" => segment.frame = Some((line, value)),
        "TIME_SYSTEM" => segment.time_system = Some((line, value)),
        "START_TIME" => segment.start = Some((line, value)),
        "STOP_TIME" => segment.stop = Some((line, value)),
        "USEABLE_START_TIME" => segment.usable_start = Some((line, value)),
        "USEABLE_STOP_TIME" => segment.usable_stop = Some((line, value)),
        "INTERPOLATION" => segment.interpolation = Some((line, value)),
        "INTERPOLATION_DEGREE" => segment.degree = Some((line, value)),
        _ => {}
    }
}

/// Lists the mandatory keys that are missing but not needed here.
pub(super) fn note_missing(segment: &mut Stated) {
    segment.missing = [
        ("OBJECT_NAME", segment.object_name.is_empty()),
        ("OBJECT_ID", segment.object_id.is_empty()),
        ("CENTER_NAME", segment.centre.is_none()),
        ("START_TIME", segment.start.is_none()),
        ("STOP_TIME", segment.stop.is_none()),
    ]
    .into_iter()
    .filter(|(_, missing)| *missing)
    .map(|(key, _)| key)
    .collect();
}

/// Reads an epoch, a position [km], a velocity [km/s] and an optional acceleration, which is ignored.
fn state(at: &FileLine, line: usize, data: &str) -> Result<StateLine, SceneError> {
    let mut cells = data.split_whitespace();
    let epoch = cells.next().unwrap_or_default().to_owned();
    let numbers: Option<Vec<f64>> = cells.map(number).collect();
    match numbers.as_deref() {
        Some([x, y, z, u, v, w] | [x, y, z, u, v, w, _, _, _]) => Ok(StateLine {
            line,
            epoch,
            position: DVec3::new(*x, *y, *z) * 1e3,
            velocity: Some(DVec3::new(*u, *v, *w) * 1e3),
        }),
        Some(others) => {
            let message = format!("a state has 6 numbers, or 9 with accelerations, not {}", others.len());
            Err(at.error(&format!("epoch {epoch}"), message))
        }
        None => Err(at.error(&format!("epoch {epoch}"), "a state is an epoch and numbers; one of them is none")),
    }
}
