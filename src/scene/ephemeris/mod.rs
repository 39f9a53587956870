//! Trajectories and attitudes from files: two-line elements, CCSDS OEM and AEM as KVN and XML, and tables.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use hifitime::Epoch;

use super::choice::list;
use super::epoch::time_system;
use super::error::SceneError;
use crate::environment::divided_differences::hermite_degree;
use crate::environment::ephemeris::{DEFAULT_DEGREE, Ephemeris, EphemerisSegment, Interpolation};
use crate::environment::frames::{ReferenceFrame, to_gcrf};
use crate::environment::state::EphemerisSample;
use crate::environment::trajectory::{DISTANCES, Trajectory, TrajectorySource, seconds_between};
use crate::environment::utc::utc;

mod aem;
mod aem_xml;
mod attitude;
mod kvn;
mod object;
mod oem;
mod oem_xml;
mod rotation;
mod span;
mod stated;
mod table;
mod text;
mod tle;
mod xml;

pub(super) use attitude::{AttitudeOptions, LENGTH_TOLERANCE, read_attitude};
use object::matches;
use span::{StatedSpan, check_span, usable_times};
pub(super) use stated::Options;
use stated::{Stated, reference_frame, state_epoch, stated_degree};
pub(super) use table::Columns;
use text::name_of;
pub(super) use text::{FileLine, number, one_line_end, read_file};

/// Whether a text is a message with states or rotations, or two-line elements, and no table.
pub(super) fn is_message(text: &str) -> bool {
    let whole_lines = one_line_end(text);
    let text = whole_lines.as_ref();
    let head = text.trim_start_matches('\u{feff}').trim_start();
    head.starts_with('<') || kvn::is_message(text) || tle::is_tle(text)
}

struct Absolute {
    object: (String, String),
    states: Vec<(Epoch, DVec3, Option<DVec3>)>,
    interpolation: Interpolation,
    usable: (Option<Epoch>, Option<Epoch>),
    frame: ReferenceFrame,
}

/// Reads the trajectory in a file. The content decides the format. A file with several objects needs the scene to name
/// one.
pub(super) fn read(
    path: &Path,
    text: &str,
    options: &Options,
    assumptions: &mut Vec<String>,
) -> Result<Arc<Trajectory>, SceneError> {
    let head = text.trim_start_matches('\u{feff}').trim_start();
    let name = name_of(path);
    let whole_lines = one_line_end(text);
    let text = whole_lines.as_ref();
    let of_table = |kind: &str| {
        let stated = [("frame", options.frame.is_some()), ("time_system", options.time_system.is_some())];
        match stated.iter().find(|(_, stated)| *stated) {
            Some((key, _)) => {
                let message = format!("is stated for a table only: {kind} says its own");
                Err(FileLine { path, line: 1 }.error(&format!("orbit.{key}"), message))
            }
            None => Ok(()),
        }
    };
    if head.is_empty() {
        return Err(FileLine { path, line: 1 }.error("trajectory", "is missing: the file is empty"));
    }
    let stated = if head.starts_with('<') {
        of_table("a CCSDS OEM")?;
        oem_xml::parse(path, text)?
    } else if kvn::is_message(text) {
        of_table("a CCSDS OEM")?;
        oem::parse(path, text)?
    } else if tle::is_tle(text) {
        of_table("a TLE")?;
        return tle::read(path, text, &name, options, assumptions);
    } else {
        table::parse(path, text, options)?
    };
    let segments =
        stated.iter().map(|stated| absolute(path, stated, options, assumptions)).collect::<Result<Vec<_>, _>>()?;
    from_segments(path, &name, segments, options, assumptions)
}

fn from_segments(
    path: &Path,
    name: &str,
    mut segments: Vec<Absolute>,
    options: &Options,
    assumptions: &mut Vec<String>,
) -> Result<Arc<Trajectory>, SceneError> {
    let wrong = |message: String| FileLine { path, line: 1 }.error("trajectory", message);
    segments.retain(|segment| !segment.states.is_empty());
    if let Some(object) = &options.object {
        segments.retain(|segment| matches(object, &[&segment.object.0, &segment.object.1]));
        if segments.is_empty() {
            return Err(wrong(format!("no object of the file is called '{object}'")));
        }
    }
    let Some(first) = segments.first() else {
        return Err(wrong("holds no states".to_owned()));
    };
    let object = first.object.clone();
    if let Some(other) = segments.iter().find(|segment| segment.object != object) {
        let names = list([object.0.as_str(), other.object.0.as_str()]);
        return Err(wrong(format!("holds several objects ({names}, ..): state which as orbit.object")));
    }
    let earliest = |segment: &Absolute| segment.usable.0.unwrap_or(segment.states[0].0).max(segment.states[0].0);
    let start = options.start.unwrap_or_else(|| {
        let start = segments.iter().map(earliest).min().unwrap_or(segments[0].states[0].0);
        assumptions.push(format!("Time 0 is the trajectory's first epoch, {} (time.start is absent).", utc(start)));
        start
    });
    if segments.iter().any(|segment| segment.frame == ReferenceFrame::Itrf) {
        assumptions.push(format!("{name}: polar motion and UT1 - UTC are left out (up to 0.5 km in low orbit)."));
    }
    let parts = segments
        .into_iter()
        .map(|segment| {
            let times = segment.usable;
            let seconds =
                |epoch: Option<Epoch>, otherwise: f64| epoch.map_or(otherwise, |epoch| seconds_between(start, epoch));
            EphemerisSegment {
                samples: segment
                    .states
                    .into_iter()
                    .map(|(epoch, position, velocity)| EphemerisSample {
                        time: seconds_between(start, epoch),
                        position,
                        velocity,
                    })
                    .collect(),
                interpolation: segment.interpolation,
                usable: (seconds(times.0, f64::NEG_INFINITY), seconds(times.1, f64::INFINITY)),
            }
        })
        .collect::<Vec<_>>();
    let (count, states) = (parts.len(), parts.iter().map(|part| part.samples.len()).sum::<usize>());
    let (ephemeris, findings) = Ephemeris::new(parts);
    let remarks = findings.to_string();
    if !remarks.is_empty() {
        assumptions.push(format!("{name}: {remarks}."));
    }
    let called = if object.0.is_empty() { String::new() } else { format!(" of {}", object.0) };
    let description = format!("{states} states{called} in {count} segment(s), {name}");
    if options.elsewhere {
        return Ok(Arc::new(Trajectory::elsewhere(description, start, TrajectorySource::Ephemeris(ephemeris))));
    }
    Trajectory::new(description, start, TrajectorySource::Ephemeris(ephemeris))
        .map(Arc::new)
        .map_err(|error| wrong(error.to_string()))
}

fn absolute(
    path: &Path,
    stated: &Stated,
    options: &Options,
    assumptions: &mut Vec<String>,
) -> Result<Absolute, SceneError> {
    let at = |line: usize| FileLine { path, line };
    let missing = |key: &str| at(stated.line).error(key, "is missing in the metadata of this segment");
    if let Some(centre) = stated.centre.as_ref().filter(|centre| !centre.eq_ignore_ascii_case("EARTH")) {
        return Err(at(stated.line).error("CENTER_NAME", format!("is '{centre}', but only EARTH is understood")));
    }
    let (line, frame) = stated.frame.as_ref().ok_or_else(|| missing("REF_FRAME"))?;
    let frame = reference_frame(frame).map_err(|message| at(*line).error("REF_FRAME", message))?;
    let (line, system) = stated.time_system.as_ref().ok_or_else(|| missing("TIME_SYSTEM"))?;
    let scale = time_system(system).map_err(|message| at(*line).error("TIME_SYSTEM", message))?;
    let interpolation = interpolation(path, stated, options)?;
    let mut assume = |said: String| {
        let said = format!("{}:{}: {said}", name_of(path), stated.line);
        if !assumptions.contains(&said) {
            assumptions.push(said);
        }
    };
    if let Interpolation::Hermite(degree) = interpolation
        && hermite_degree(degree) != degree
    {
        assume(format!("Hermite interpolation of degree {degree} is done with degree {}.", hermite_degree(degree)));
    }
    if !stated.missing.is_empty() {
        let earth = if stated.missing.contains(&"CENTER_NAME") { ": the centre is taken for the Earth" } else { "" };
        assume(format!("the metadata of this segment lack {}{earth}.", stated.missing.join(", ")));
    }
    let mut states: Vec<(Epoch, DVec3, Option<DVec3>)> = Vec::with_capacity(stated.lines.len());
    for state in &stated.lines {
        let wrong = |message: String| at(state.line).error(&format!("epoch {}", state.epoch), message);
        let epoch = state_epoch(&state.epoch, scale, options).map_err(&wrong)?;
        if states.last().is_some_and(|(last, ..)| seconds_between(*last, epoch) < 0.0) {
            return Err(wrong("lies before the epoch of the line above".to_owned()));
        }
        let finite = state.position.is_finite() && state.velocity.is_none_or(DVec3::is_finite);
        let distance = state.position.length();
        if !finite || !DISTANCES.contains(&distance) {
            return Err(wrong(format!(
                "no position of a craft: {distance:.3e} m from the Earth's centre (an OEM states kilometres, a table metres)"
            )));
        }
        if let Some(speed) = state.velocity.map(DVec3::length).filter(|speed| *speed > HIGHEST_SPEED) {
            return Err(wrong(format!("no velocity of a craft: {speed:.3e} m/s (an OEM states km/s, a table m/s)")));
        }
        let (position, velocity) = to_gcrf(frame, epoch, state.position, state.velocity);
        states.push((epoch, position, velocity));
    }
    let ends = states.first().zip(states.last()).map(|((first, ..), (last, ..))| (*first, *last));
    let span = StatedSpan {
        start: &stated.start,
        stop: &stated.stop,
        usable_start: &stated.usable_start,
        usable_stop: &stated.usable_stop,
        torn: stated.torn.then(|| stated.lines.last().map_or(stated.line, |state| state.line)),
    };
    let usable = usable_times(path, &span, scale, ("states", ends))?;
    if let Some((first, last)) = ends {
        check_span(path, &span, scale, ("states", first, last), &mut assume)?;
    }
    Ok(Absolute {
        object: (stated.object_name.clone(), stated.object_id.clone()),
        states,
        interpolation,
        usable,
        frame,
    })
}

/// Highest plausible speed [m/s].
const HIGHEST_SPEED: f64 = 1e5;

fn interpolation(path: &Path, stated: &Stated, options: &Options) -> Result<Interpolation, SceneError> {
    let velocities = stated.lines.iter().all(|state| state.velocity.is_some());
    let default = if velocities { "HERMITE" } else { "LAGRANGE" };
    let method = stated.interpolation.clone().or_else(|| options.interpolation.clone().map(|method| (1, method)));
    let (line, method) = method.unwrap_or((stated.line, default.to_owned()));
    let at = |line: usize| FileLine { path, line };
    let degree = match (&stated.degree, options.degree) {
        (Some(stated), _) => Some(stated_degree(path, stated)?),
        (None, Some(degree)) => Some(degree as usize),
        (None, None) => None,
    };
    match method.to_ascii_uppercase().as_str() {
        "HERMITE" if velocities => Ok(Interpolation::Hermite(degree.unwrap_or(DEFAULT_DEGREE))),
        "HERMITE" => Err(at(line).error("INTERPOLATION", "HERMITE needs velocities, which some states lack")),
        "LAGRANGE" => Ok(Interpolation::Lagrange(degree.unwrap_or(DEFAULT_DEGREE))),
        "LINEAR" => Ok(Interpolation::Lagrange(1)),
        _ => Err(at(line).error("INTERPOLATION", format!("'{method}' is not one of 'HERMITE', 'LAGRANGE', 'LINEAR'"))),
    }
}

#[cfg(test)]
mod tests;
