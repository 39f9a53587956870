//! Two-line element sets, for SGP4.

use std::path::Path;
use std::sync::Arc;

use hifitime::{Epoch, TimeScale};
use sgp4::chrono::{Datelike, Timelike};

use super::super::error::SceneError;
use super::object::matches;
use super::stated::Options;
use super::text::FileLine;
use crate::environment::orbit::kepler_radius;
use crate::environment::trajectory::{Trajectory, TrajectorySource, seconds_between};
use crate::environment::utc::utc;

/// Age of elements above which the user gets a warning [s]. SGP4 loses 1 to 3 km a day in low orbit.
const OLD: f64 = 3.0 * 86_400.0;
/// Age above which the place along the orbit is unknown [s]: some hundred kilometres of error after weeks, and a whole orbit after months.
const STALE: f64 = 30.0 * 86_400.0;
/// Age above which elements are refused [s].
const LATEST_AGE: f64 = 366.0 * 86_400.0;

/// Whether a text looks like element sets: one of its lines begins like the first or second line of a set.
pub(super) fn is_tle(text: &str) -> bool {
    said(text).take(MOST_LINES).any(|(_, line)| {
        let digits = line
            .get(2..7)
            .is_some_and(|number| number.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b' '));
        (line.starts_with("1 ") || line.starts_with("2 ")) && digits && line.len() > SHORTEST && !line.contains(',')
    })
}

/// Number of lines to search for a set, and the shortest length of a line of a set.
const MOST_LINES: usize = 100;
const SHORTEST: usize = 40;

const CHECKSUM: usize = 68;

fn said(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines()
        .enumerate()
        .map(|(index, line)| (index + 1, line.trim_start_matches('\u{feff}').trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// An element set with its name and the number of its first line.
struct Set<'a> {
    line: usize,
    name: String,
    first: &'a str,
    second: &'a str,
}

fn sets<'a>(path: &Path, text: &'a str) -> Result<Vec<Set<'a>>, SceneError> {
    let mut sets = Vec::new();
    let mut name = String::new();
    let mut lines = said(text);
    while let Some((line, first)) = lines.next() {
        if first.starts_with("2 ") && first.len() > SHORTEST {
            return Err(FileLine { path, line }.error("TLE", "line 2 does not follow a line 1"));
        }
        if !first.starts_with("1 ") {
            name = first.strip_prefix("0 ").unwrap_or(first).trim().to_owned();
            continue;
        }
        let second = match lines.next() {
            Some((_, second)) if second.starts_with("2 ") => second,
            _ => return Err(FileLine { path, line }.error("TLE", "line 1 is not followed by line 2")),
        };
        sets.push(Set { line, name: std::mem::take(&mut name), first, second });
    }
    Ok(sets)
}

/// Refuses elements that no craft around the Earth has. The crate reads `NaN` and `inf` as numbers, and SGP4 propagates them.
fn check_elements(elements: &sgp4::Elements) -> Result<(), String> {
    let fields = [
        ("inclination [deg]", elements.inclination, 0.0..=180.0),
        ("right ascension [deg]", elements.right_ascension, 0.0..=360.0),
        ("eccentricity", elements.eccentricity, 0.0..=0.999_999_9),
        ("argument of perigee [deg]", elements.argument_of_perigee, 0.0..=360.0),
        ("mean anomaly [deg]", elements.mean_anomaly, 0.0..=360.0),
        ("mean motion [revolutions a day]", elements.mean_motion, 1e-3..=20.0),
        ("first derivative of the mean motion", elements.mean_motion_dot, -10.0..=10.0),
        ("second derivative of the mean motion", elements.mean_motion_ddot, -10.0..=10.0),
        ("drag term", elements.drag_term, -10.0..=10.0),
    ];
    match fields.into_iter().find(|(_, value, range)| !range.contains(value)) {
        Some((name, value, range)) => {
            Err(format!("the {name} must be from {} to {}, found {value}", range.start(), range.end()))
        }
        None => Ok(()),
    }
}

/// Reads the wanted element set. A file with several sets needs the scene to name one.
pub(super) fn read(
    path: &Path,
    text: &str,
    file_name: &str,
    options: &Options,
    assumptions: &mut Vec<String>,
) -> Result<Arc<Trajectory>, SceneError> {
    let set = choose_set(path, text, options)?;
    let at = FileLine { path, line: set.line };
    let wrong = |message: String| at.error("TLE", message);
    let elements = read_elements(&set).map_err(&wrong)?;
    let constants = propagator(&elements).map_err(&wrong)?;
    let epoch = epoch_of(&elements).map_err(&wrong)?;
    let start = options.start.unwrap_or_else(|| {
        assumptions.push(format!("Time 0 is the epoch of the elements, {} (time.start is absent).", utc(epoch)));
        epoch
    });
    let age = seconds_between(epoch, start);
    if age.abs() > LATEST_AGE {
        return Err(wrong(format!(
            "the elements are of {} and time 0 is {}, {:.0} days away: SGP4 holds for days to weeks, and is refused beyond a year. State a \
             time.start near their epoch, or elements of that date",
            utc(epoch),
            utc(start),
            age.abs() / 86_400.0
        )));
    }
    if age.abs() > OLD {
        let place = if age.abs() > STALE { ", and the place along the orbit is a guess after a month" } else { "" };
        assumptions.push(format!(
            "The elements are {:.1} days from time 0: in low orbit SGP4 errs by 1 to 3 km for each{place}.",
            age / 86_400.0
        ));
    }
    let description = format!("SGP4 of {} (epoch {}), {file_name}", set.name, utc(epoch));
    let source = TrajectorySource::Elements { constants: Box::new(constants), epoch: -age, reach: apsides(&elements) };
    Trajectory::new(description, start, source).map(Arc::new).map_err(|error| wrong(error.to_string()))
}

/// The only element set of a file, or the only set of the object that the scene names.
fn choose_set<'a>(path: &Path, text: &'a str, options: &Options) -> Result<Set<'a>, SceneError> {
    let mut sets = sets(path, text)?;
    if let Some(wanted) = &options.object {
        sets.retain(|set| {
            let columns = |range: std::ops::Range<usize>| set.first.get(range).unwrap_or_default();
            matches(wanted, &[&set.name, columns(2..7), columns(9..17)])
        });
    }
    match &sets[..] {
        [_] => Ok(sets.remove(0)),
        [] => {
            let wanted = options.object.clone().unwrap_or_default();
            Err(FileLine { path, line: 1 }.error("TLE", format!("no object is called '{wanted}'")))
        }
        [_, second, ..] => {
            let message = format!(
                "holds {} element sets: state the name, catalogue number or international designator of one as orbit.object (one set of it)",
                sets.len()
            );
            Err(FileLine { path, line: second.line }.error("TLE", message))
        }
    }
}

/// Reads the lines of an element set.
fn read_elements(set: &Set) -> Result<sgp4::Elements, String> {
    // The crate subtracts '0' from the last column without a look at it.
    let unchecked = |line: &&str| line.as_bytes().get(CHECKSUM).is_some_and(|byte| !byte.is_ascii_digit());
    if let Some(line) = [set.first, set.second].into_iter().find(unchecked) {
        return Err(format!("the checksum of '{line}' in column {} is no digit", CHECKSUM + 1));
    }
    // The crate cuts the lines at fixed bytes.
    if let Some(line) = [set.first, set.second].into_iter().find(|line| !line.is_ascii()) {
        return Err(format!("'{line}' has letters that element sets do not have"));
    }
    let elements = sgp4::Elements::from_tle(Some(set.name.clone()), set.first.as_bytes(), set.second.as_bytes())
        .map_err(|error| error.to_string())?;
    check_elements(&elements)?;
    Ok(elements)
}

/// SGP4 of an element set. Element sets use the constants of WGS 72 (Vallado et al. 2006, AIAA 2006-6753).
fn propagator(elements: &sgp4::Elements) -> Result<sgp4::Constants, String> {
    let degrees = f64::to_radians;
    sgp4::Orbit::from_kozai_elements(
        &sgp4::WGS72,
        degrees(elements.inclination),
        degrees(elements.right_ascension),
        elements.eccentricity,
        degrees(elements.argument_of_perigee),
        degrees(elements.mean_anomaly),
        elements.mean_motion * (std::f64::consts::PI / 720.0),
    )
    .map_err(|error| error.to_string())
    .and_then(|orbit| {
        sgp4::Constants::new(sgp4::WGS72, sgp4::iau_epoch_to_sidereal_time, elements.epoch(), elements.drag_term, orbit)
            .map_err(|error| error.to_string())
    })
}

/// Distances of perigee and apogee from the Earth's centre [m].
fn apsides(elements: &sgp4::Elements) -> [f64; 2] {
    let axis = kepler_radius(86_400.0 / elements.mean_motion);
    [axis * (1.0 - elements.eccentricity), axis * (1.0 + elements.eccentricity)]
}

fn epoch_of(elements: &sgp4::Elements) -> Result<Epoch, String> {
    let date = elements.datetime;
    Epoch::maybe_from_gregorian(
        date.year(),
        date.month() as u8,
        date.day() as u8,
        date.hour() as u8,
        date.minute() as u8,
        date.second() as u8,
        date.nanosecond(),
        TimeScale::UTC,
    )
    .map_err(|error| error.to_string())
}
