//! Attitudes from files: CCSDS Attitude Ephemeris Message in keyword-value notation (CCSDS 504.0-B), and tables.

use std::path::Path;
use std::sync::Arc;

use glam::DQuat;
use hifitime::{Epoch, TimeScale};

use super::super::epoch::{parse_epoch, time_system};
use super::super::error::SceneError;
use super::super::section::list;
use super::kvn::{Line, check_version, lines};
use super::table::Columns;
use super::{Options, Place, number, reference_frame, state_epoch};
use crate::environment::frames::ReferenceFrame;
use crate::environment::rotation_history::{HistoryFrame, RotationHistory, RotationSample};
use crate::environment::trajectory::seconds_between;

/// What a scene says of an attitude's file.
#[derive(Debug, Clone, Default)]
pub(crate) struct AttitudeOptions {
    /// Frame of a table, `inertial` or `orbit`.
    pub(crate) frame: Option<HistoryFrame>,
    /// Time system of a table.
    pub(crate) time_system: Option<String>,
    /// Time 0 of the scene, where it is known.
    pub(crate) start: Option<Epoch>,
}

/// A quaternion whose length is further from 1 than this is a slip.
const LENGTH_TOLERANCE: f64 = 1e-2;

/// Turn between two samples beyond which a user should know that nothing but the shorter arc is assumed [rad].
const LARGE_TURN: f64 = 1.57;

/// The attitude in a file.
///
/// # Errors
/// What is wrong with the file, with its line.
pub(crate) fn read_attitude(
    path: &Path,
    text: &str,
    options: &AttitudeOptions,
    assumptions: &mut Vec<String>,
) -> Result<Arc<RotationHistory>, SceneError> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let first = Place { path, line: 1 };
    let head = text.trim_start_matches('\u{feff}').trim_start();
    if head.starts_with('<') {
        return Err(first.error("XML", "attitudes are read from an AEM in KVN or from a table"));
    }
    let (frame, segments) = if head.starts_with("CCSDS_") {
        if options.frame.is_some() || options.time_system.is_some() {
            return Err(
                first.error("attitude", "frame and time_system are stated for a table only: an AEM says its own")
            );
        }
        message(path, text, options)?
    } else {
        table(path, text, options)?
    };
    let samples: usize = segments.iter().map(Vec::len).sum();
    if samples == 0 {
        return Err(first.error("attitude", "holds no rotations"));
    }
    let history = RotationHistory::new(format!("{samples} rotations, {name}"), frame, segments);
    let turn = history.largest_turn();
    if turn > LARGE_TURN {
        assumptions.push(format!(
            "{name}: rotations are up to {:.0} deg apart; between them the shorter way is taken.",
            turn.to_degrees()
        ));
    }
    Ok(Arc::new(history))
}

/// Pushes a sample, in order of time.
fn push(
    at: &Place,
    samples: &mut Vec<RotationSample>,
    epoch: &str,
    time: f64,
    rotation: (DQuat, Option<f64>),
) -> Result<(), SceneError> {
    let wrong = |message: String| at.error(&format!("epoch {epoch}"), message);
    let (quaternion, spin) = rotation;
    let length = quaternion.length();
    if (length - 1.0).abs() > LENGTH_TOLERANCE || !length.is_finite() {
        return Err(wrong(format!("a quaternion has length 1, not {length}")));
    }
    if samples.last().is_some_and(|last| time < last.time) {
        return Err(wrong("lies before the epoch of the line above".to_owned()));
    }
    samples.push(RotationSample { time, frame_from_body: quaternion.normalize(), spin });
    Ok(())
}

fn table(
    path: &Path,
    text: &str,
    options: &AttitudeOptions,
) -> Result<(HistoryFrame, Vec<Vec<RotationSample>>), SceneError> {
    let columns = Columns::read(path, text, &["time", "qw", "qx", "qy", "qz"], &[])?;
    let first = Place { path, line: 1 };
    let frame = options
        .frame
        .ok_or_else(|| first.error("attitude.frame", "is missing: a table needs 'inertial' or 'orbit'"))?;
    let scale = match &options.time_system {
        Some(name) => time_system(name).map_err(|message| first.error("attitude.time_system", message))?,
        None => TimeScale::UTC,
    };
    let mut samples = Vec::new();
    for row in &columns.rows {
        let (epoch, q, _) = columns.cells(path, row)?;
        let at = Place { path, line: row.0 };
        let time = match (number(&epoch), options.start) {
            // Seconds count from time 0, whenever that is.
            (Some(seconds), _) => seconds,
            (None, Some(start)) => {
                let known = Options { start: Some(start), ..Options::default() };
                let epoch = state_epoch(&epoch, scale, &known).map_err(|message| at.error("time", message))?;
                seconds_between(start, epoch)
            }
            (None, None) => return Err(at.error("time", "is a date, but the scene has no time.start")),
        };
        push(&at, &mut samples, &epoch, time, (DQuat::from_xyzw(q[1], q[2], q[3], q[0]), None))?;
    }
    Ok((frame, vec![samples]))
}

/// What the metadata of a segment say.
#[derive(Default)]
struct Metadata {
    line: usize,
    entries: Vec<(usize, String, String)>,
}

impl Metadata {
    fn get(&self, key: &str) -> Option<(usize, &str)> {
        self.entries.iter().find(|(_, known, _)| known == key).map(|(line, _, value)| (*line, value.as_str()))
    }

    fn required(&self, path: &Path, key: &str) -> Result<(usize, &str), SceneError> {
        let missing = || Place { path, line: self.line }.error(key, "is missing in the metadata of this segment");
        self.get(key).ok_or_else(missing)
    }
}

/// How the numbers of a segment become a rotation.
struct Meaning {
    kind: Kind,
    /// Whether they rotate vectors of the frame into the body, rather than the other way.
    inverted: bool,
    scale: TimeScale,
    usable: (Option<Epoch>, Option<Epoch>),
}

#[derive(Clone, Copy)]
enum Kind {
    ScalarFirst,
    ScalarLast,
    Spin,
}

const KINDS: [&str; 6] =
    ["QUATERNION", "QUATERNION/DERIVATIVE", "QUATERNION/RATE", "QUATERNION/ANGVEL", "SPIN", "SPIN/ANGVEL"];

fn message(
    path: &Path,
    text: &str,
    options: &AttitudeOptions,
) -> Result<(HistoryFrame, Vec<Vec<RotationSample>>), SceneError> {
    check_version(path, text, "CCSDS_AEM_VERS")?;
    let start = options.start.ok_or_else(|| {
        let message = "is missing: an AEM needs to know when time 0 is";
        Place { path, line: 1 }.error("time.start", message)
    })?;
    let mut frame = None;
    let mut segments: Vec<Vec<RotationSample>> = Vec::new();
    let mut metadata = Metadata::default();
    let mut in_metadata = false;
    let mut meaning: Option<Meaning> = None;
    for (line, content) in lines(text) {
        let at = Place { path, line };
        match content {
            Line::Mark("META_START") => {
                metadata = Metadata { line, entries: Vec::new() };
                (in_metadata, meaning) = (true, None);
            }
            Line::Mark("META_STOP") => {
                in_metadata = false;
                let (found, of_segment) = interpret(path, &metadata)?;
                if frame.is_some_and(|frame| frame != found) {
                    return Err(at.error("REF_FRAME", "differs from that of the segment before"));
                }
                frame = Some(found);
                meaning = Some(of_segment);
                segments.push(Vec::new());
            }
            Line::Mark("DATA_START" | "DATA_STOP") => {}
            Line::Mark(mark) => return Err(at.error(mark, "does not belong here")),
            Line::Pair(key, value) if in_metadata => {
                metadata.entries.push((line, key.to_owned(), value.to_owned()));
            }
            Line::Pair(..) => {}
            Line::Data(data) => {
                let (Some(meaning), Some(samples)) = (&meaning, segments.last_mut()) else {
                    return Err(at.error("data", "stands before META_STOP"));
                };
                let (epoch, rotation) = rotation(&at, data, meaning)?;
                let absolute = parse_epoch(epoch, meaning.scale).map_err(|message| at.error("epoch", message))?;
                let (from, to) = meaning.usable;
                if from.is_none_or(|from| seconds_between(from, absolute) >= 0.0)
                    && to.is_none_or(|to| seconds_between(absolute, to) >= 0.0)
                {
                    push(&at, samples, epoch, seconds_between(start, absolute), rotation)?;
                }
            }
        }
    }
    let frame = frame.ok_or_else(|| Place { path, line: 1 }.error("META_START", "is missing: there is no segment"))?;
    Ok((frame, segments))
}

fn rotation<'a>(at: &Place, data: &'a str, meaning: &Meaning) -> Result<(&'a str, (DQuat, Option<f64>)), SceneError> {
    let mut cells = data.split_whitespace();
    let epoch = cells.next().unwrap_or_default();
    let numbers: Option<Vec<f64>> = cells.map(number).collect();
    let wrong = |message: &str| at.error(&format!("epoch {epoch}"), message);
    let numbers = numbers.ok_or_else(|| wrong("a rotation is an epoch and numbers; one of them is none"))?;
    let [a, b, c, d, ..] = numbers[..] else {
        return Err(wrong("a rotation has at least four numbers"));
    };
    let (quaternion, spin) = match meaning.kind {
        Kind::ScalarFirst => (DQuat::from_xyzw(b, c, d, a), None),
        Kind::ScalarLast => (DQuat::from_xyzw(a, b, c, d), None),
        Kind::Spin => {
            // Right ascension and declination of the axis, angle about it, and its rate (CCSDS 504.0-B).
            let turn = DQuat::from_rotation_z(a.to_radians())
                * DQuat::from_rotation_y((90.0 - b).to_radians())
                * DQuat::from_rotation_z(c.to_radians());
            (turn, Some(d.to_radians()))
        }
    };
    let inverted = meaning.inverted && spin.is_none();
    Ok((epoch, (if inverted { quaternion.conjugate() } else { quaternion }, spin)))
}

fn interpret(path: &Path, metadata: &Metadata) -> Result<(HistoryFrame, Meaning), SceneError> {
    let at = |line: usize| Place { path, line };
    let (line_a, a) = metadata.required(path, "REF_FRAME_A")?;
    let (line_b, b) = metadata.required(path, "REF_FRAME_B")?;
    let is_body = |name: &str| {
        let name = name.to_ascii_uppercase();
        name.starts_with("SC_") || name.starts_with("SC BODY")
    };
    let (line, outside, body_is_b) = match (is_body(a), is_body(b)) {
        (false, true) => (line_a, a, true),
        (true, false) => (line_b, b, false),
        _ => return Err(at(line_a).error("REF_FRAME_A", "one of the two frames must be the body, SC_BODY_1")),
    };
    let frame = if outside.to_ascii_uppercase().starts_with("LVLH") {
        HistoryFrame::Orbit
    } else {
        match reference_frame(outside) {
            Ok(ReferenceFrame::Inertial) => HistoryFrame::Inertial,
            _ => {
                let message = format!("'{outside}' is not one of 'EME2000', 'J2000', 'ICRF', 'GCRF', 'LVLH'");
                return Err(at(line).error("REF_FRAME", message));
            }
        }
    };
    let a_to_b = match metadata.get("ATTITUDE_DIR") {
        None => true,
        Some((_, direction)) if direction.eq_ignore_ascii_case("A2B") => true,
        Some((_, direction)) if direction.eq_ignore_ascii_case("B2A") => false,
        Some((line, direction)) => {
            return Err(at(line).error("ATTITUDE_DIR", format!("'{direction}' is not one of 'A2B', 'B2A'")));
        }
    };
    let (line, kind) = metadata.required(path, "ATTITUDE_TYPE")?;
    if !KINDS.iter().any(|known| known.eq_ignore_ascii_case(&kind.replace(' ', "_"))) {
        return Err(at(line).error("ATTITUDE_TYPE", format!("'{kind}' is not one of {}", list(KINDS))));
    }
    let kind = if kind.to_ascii_uppercase().starts_with("SPIN") {
        Kind::Spin
    } else {
        match metadata.get("QUATERNION_TYPE") {
            Some((_, "FIRST")) => Kind::ScalarFirst,
            None | Some((_, "LAST")) => Kind::ScalarLast,
            Some((line, other)) => {
                return Err(at(line).error("QUATERNION_TYPE", format!("'{other}' is not one of 'FIRST', 'LAST'")));
            }
        }
    };
    let (line, system) = metadata.required(path, "TIME_SYSTEM")?;
    let scale = time_system(system).map_err(|message| at(line).error("TIME_SYSTEM", message))?;
    let usable = |key: &str| {
        let parse = |(line, text): (usize, &str)| parse_epoch(text, scale).map_err(|m| at(line).error(key, m));
        metadata.get(key).map(parse).transpose()
    };
    if let Some((line, method)) = metadata.get("INTERPOLATION_METHOD") {
        // Any polynomial through quaternions agrees with the arc where samples are dense enough to be of use.
        if !["LINEAR", "HERMITE", "LAGRANGE", "SLERP"].iter().any(|known| known.eq_ignore_ascii_case(method)) {
            return Err(at(line).error("INTERPOLATION_METHOD", format!("'{method}' is not known")));
        }
    }
    // The quaternion of a turn of axes from A to B rotates vectors' components of B into A.
    let meaning = Meaning {
        kind,
        inverted: a_to_b != body_is_b,
        scale,
        usable: (usable("USEABLE_START_TIME")?, usable("USEABLE_STOP_TIME")?),
    };
    Ok((frame, meaning))
}
