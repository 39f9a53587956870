//! Reads an attitude file: a CCSDS AEM or a table. The content decides which.

use std::path::Path;
use std::sync::Arc;

use glam::DQuat;
use hifitime::{Epoch, TimeScale};

use super::super::choice::list;
use super::super::epoch::{parse_epoch, time_system};
use super::super::error::SceneError;
use super::object::matches;
use super::rotation::{AttitudeSegment, rotation};
use super::span::{StatedSpan, check_span, usable_times};
use super::stated::{Options, state_epoch};
use super::table::Columns;
use super::text::{FileLine, name_of, number, one_line_end};
use super::{aem, aem_xml};
use crate::environment::rotation_history::{
    HistoryFrame, RotationHistory, RotationInterpolation, RotationSample, RotationSegment,
};
use crate::environment::scene_time::SceneTime;
use crate::environment::trajectory::seconds_between;

#[derive(Debug, Clone, Default)]
pub(crate) struct AttitudeOptions {
    /// The object to read if the file holds several.
    pub(crate) object: Option<String>,
    /// Frame of a table: `inertial` or `orbit`.
    pub(crate) frame: Option<HistoryFrame>,
    pub(crate) time_system: Option<String>,
    /// Time 0 of the scene, if known.
    pub(crate) start: Option<Epoch>,
}

/// Largest error of a quaternion's length. A larger error is a mistake in the file.
pub(in crate::scene) const LENGTH_TOLERANCE: f64 = 1e-2;

/// Turn between two samples above which the user gets a warning [rad]. The reader assumes the shorter arc.
const LARGE_TURN: f64 = 1.57;

pub(crate) fn read_attitude(
    path: &Path,
    text: &str,
    options: &AttitudeOptions,
    assumptions: &mut Vec<String>,
) -> Result<Arc<RotationHistory>, SceneError> {
    let name = name_of(path);
    let whole_lines = one_line_end(text);
    let text = whole_lines.as_ref();
    let first = FileLine { path, line: 1 };
    let head = text.trim_start_matches('\u{feff}').trim_start();
    let is_xml = head.starts_with('<');
    let (frame, segments) = if is_xml || super::kvn::is_message(text) {
        if options.frame.is_some() || options.time_system.is_some() {
            return Err(
                first.error("attitude", "frame and time_system are stated for a table only: an AEM says its own")
            );
        }
        let start = options
            .start
            .ok_or_else(|| first.error("time.start", "is missing: an AEM needs to know when time 0 is"))?;
        let segments =
            if is_xml { aem_xml::parse(path, text, assumptions)? } else { aem::parse(path, text, assumptions)? };
        message(path, segments, start, options, assumptions)?
    } else {
        if options.object.is_some() {
            return Err(first.error("attitude.object", "is stated for an AEM only: a table is of one craft"));
        }
        table(path, text, options)?
    };
    let samples: usize = segments.iter().map(|segment| segment.samples.len()).sum();
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

/// Largest angle [deg], rate [deg/s] or component of a quaternion in a message.
const LARGEST_NUMBER: f64 = 1e9;

/// The AEM segments of the wanted object, as rotations over scene time.
fn message(
    path: &Path,
    mut segments: Vec<AttitudeSegment>,
    start: Epoch,
    options: &AttitudeOptions,
    assumptions: &mut Vec<String>,
) -> Result<(HistoryFrame, Vec<RotationSegment>), SceneError> {
    let first = FileLine { path, line: 1 };
    if let Some(wanted) = &options.object {
        segments.retain(|segment| matches(wanted, &[&segment.object.0, &segment.object.1]));
        if segments.is_empty() {
            return Err(first.error("attitude.object", format!("no object of the file is called '{wanted}'")));
        }
    }
    let Some(AttitudeSegment { object, frame, .. }) = segments.first() else {
        return Err(first.error("attitude", "holds no segments"));
    };
    let (object, frame) = (object.clone(), *frame);
    if let Some(other) = segments.iter().find(|segment| segment.object != object) {
        let names = list([object.0.as_str(), other.object.0.as_str()]);
        let message = format!("is of several objects ({names}, ..): state which as attitude.object");
        return Err(FileLine { path, line: other.line }.error("attitude", message));
    }
    if let Some(other) = segments.iter().find(|segment| segment.frame != frame) {
        return Err(FileLine { path, line: other.line }.error("REF_FRAME", "differs from that of the segment before"));
    }
    let rotations = segments.iter().map(|segment| by_time(path, segment, start, assumptions));
    Ok((frame, rotations.collect::<Result<_, _>>()?))
}

/// Converts a segment to scene time.
fn by_time(
    path: &Path,
    segment: &AttitudeSegment,
    start: Epoch,
    assumptions: &mut Vec<String>,
) -> Result<RotationSegment, SceneError> {
    let scale = segment.scale;
    let mut samples = Vec::with_capacity(segment.rows.len());
    let mut ends: Option<(Epoch, Epoch)> = None;
    for row in &segment.rows {
        let at = FileLine { path, line: row.line };
        let epoch = parse_epoch(&row.epoch, scale).map_err(|message| at.error("epoch", message))?;
        ends = Some((ends.map_or(epoch, |(first, _)| first), epoch));
        if let Some(number) = row.numbers.iter().find(|number| number.abs() > LARGEST_NUMBER) {
            let message = format!("{number:e} is beyond {LARGEST_NUMBER:e}, which no angle or rate reaches");
            return Err(at.error(&format!("epoch {}", row.epoch), message));
        }
        let (quaternion, derivative, spin) = rotation(segment, &row.numbers);
        let sample =
            RotationSample { time: seconds_between(start, epoch), frame_from_body: quaternion, derivative, spin };
        push(&at, &mut samples, &row.epoch, sample)?;
    }
    let span = StatedSpan {
        start: &segment.start,
        stop: &segment.stop,
        usable_start: &segment.usable_start,
        usable_stop: &segment.usable_stop,
        torn: segment.torn.then(|| segment.rows.last().map_or(segment.line, |row| row.line)),
    };
    let usable = usable_times(path, &span, scale, ("rotations", ends))?;
    let mut assume = |said: String| {
        let said = format!("{}:{}: {said}", name_of(path), segment.line);
        if !assumptions.contains(&said) {
            assumptions.push(said);
        }
    };
    if let Some((first, last)) = ends {
        check_span(path, &span, scale, ("rotations", first, last), &mut assume)?;
    }
    let seconds = |epoch: Option<Epoch>, otherwise: f64| epoch.map_or(otherwise, |epoch| seconds_between(start, epoch));
    let usable = (seconds(usable.0, f64::NEG_INFINITY), seconds(usable.1, f64::INFINITY));
    Ok(RotationSegment { samples, interpolation: segment.interpolation, usable })
}

/// Appends a sample. Samples must be in order of time.
fn push(
    at: &FileLine,
    samples: &mut Vec<RotationSample>,
    epoch: &str,
    sample: RotationSample,
) -> Result<(), SceneError> {
    let wrong = |message: String| at.error(&format!("epoch {epoch}"), message);
    let length = sample.frame_from_body.length();
    if (length - 1.0).abs() > LENGTH_TOLERANCE || !length.is_finite() {
        return Err(wrong(format!("a quaternion has length 1, not {length}")));
    }
    if samples.last().is_some_and(|last| sample.time < last.time) {
        return Err(wrong("lies before the epoch of the line above".to_owned()));
    }
    samples.push(RotationSample { frame_from_body: sample.frame_from_body.normalize(), ..sample });
    Ok(())
}

fn table(
    path: &Path,
    text: &str,
    options: &AttitudeOptions,
) -> Result<(HistoryFrame, Vec<RotationSegment>), SceneError> {
    let columns = Columns::read(path, text, &["time", "qw", "qx", "qy", "qz"], &[])?;
    let first = FileLine { path, line: 1 };
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
        let at = FileLine { path, line: row.0 };
        let time = match (number(&epoch), options.start) {
            // Seconds always count from time 0.
            (Some(seconds), _) => SceneTime::new(seconds).map_err(|error| at.error("time", error))?.seconds(),
            (None, Some(start)) => {
                let known = Options { start: Some(start), ..Options::default() };
                let epoch = state_epoch(&epoch, scale, &known).map_err(|message| at.error("time", message))?;
                seconds_between(start, epoch)
            }
            (None, None) => return Err(at.error("time", "is a date, but the scene has no time.start")),
        };
        let frame_from_body = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
        push(&at, &mut samples, &epoch, RotationSample { time, frame_from_body, derivative: None, spin: None })?;
    }
    let usable = (f64::NEG_INFINITY, f64::INFINITY);
    Ok((frame, vec![RotationSegment { samples, interpolation: RotationInterpolation::Arc, usable }]))
}
