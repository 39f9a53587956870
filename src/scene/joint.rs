//! `[[joint]]`: rotations and translations of glTF nodes, and their drives.

use std::path::PathBuf;

use glam::DVec3;

use super::error::SceneError;
use super::file::read_text;
use super::keys;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::{axis, parallel, point};
use crate::environment::joints::{Drive, Guided, JointKind};

/// A `[[joint]]` of the scene, which applies to every glTF node that matches.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRule {
    /// Line of its header, from 1.
    pub(crate) line: usize,
    /// Patterns (`*`, `?`) on names of glTF nodes.
    pub(crate) nodes: Vec<String>,
    pub(crate) motion: JointMotion,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum JointMotion {
    /// One number drives the motion. Vectors are in the node's own frame.
    Guided(Guided),
    Animation {
        name: String,
        /// Whether the animation starts again at its end.
        repeats: bool,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum JointMode {
    Fixed,
    Sun,
    Schedule,
    Animation,
}

/// Names of the modes, with the keys that only some modes read.
const MODES: [(&str, JointMode, &[&str]); 4] = [
    ("fixed", JointMode::Fixed, &["kind", "axis", "origin", "limits_deg", "limits", "angle_deg", "distance"]),
    ("sun", JointMode::Sun, &["kind", "axis", "origin", "limits_deg", "rate_deg", "sun_axis", "offset_deg"]),
    (
        "schedule",
        JointMode::Schedule,
        &["kind", "axis", "origin", "limits_deg", "limits", "rate_deg", "rate", "schedule"],
    ),
    ("animation", JointMode::Animation, &["animation", "repeat"]),
];

/// Keys that only turning joints read, and keys that only sliding joints read.
const TURNING: [&str; 4] = ["limits_deg", "rate_deg", "angle_deg", "origin"];
const SLIDING: [&str; 3] = ["limits", "rate", "distance"];

/// The key names and the unit factor of a turning or sliding joint.
struct Words {
    limits: &'static str,
    rate: &'static str,
    position: &'static str,
    unit: &'static str,
    rate_unit: &'static str,
    factor: f64,
}

impl Words {
    fn of(kind: JointKind) -> Self {
        match kind {
            JointKind::Rotation => Self {
                limits: "limits_deg",
                rate: "rate_deg",
                position: "angle_deg",
                unit: "deg",
                rate_unit: "deg/s",
                factor: 1f64.to_radians(),
            },
            JointKind::Translation => {
                Self { limits: "limits", rate: "rate", position: "distance", unit: "m", rate_unit: "m/s", factor: 1.0 }
            }
        }
    }
}

/// Reads every `[[joint]]`. The file of a schedule joins `files`.
pub(super) fn read(
    sections: &[Section],
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Vec<JointRule>, SceneError> {
    sections.iter().map(|section| joint(section, files, assumptions)).collect()
}

fn joint(section: &Section, files: &mut Vec<PathBuf>, assumptions: &mut Vec<String>) -> Result<JointRule, SceneError> {
    let nodes = section.required("part", section.strings("part")?, "the name of the glTF node that moves")?;
    let title = nodes.join("', '");
    let mode = section.choice("mode", &MODES.map(|(name, mode, _)| (name, (name, mode))))?;
    let (name, mode) = section.required("mode", mode, "'fixed', 'sun', 'schedule' or 'animation'")?;
    let keys_of_mode = MODES.iter().find(|(known, ..)| *known == name).map_or(&[][..], |(.., keys)| *keys);
    for (other, _, keys) in &MODES {
        if let Some(key) = keys.iter().find(|key| section.has(key) && !keys_of_mode.contains(key)) {
            return Err(section.clash(key, &["mode"], format!("belongs to mode = '{other}', and mode is '{name}'")));
        }
    }
    let motion = match mode {
        JointMode::Animation => read_animation(section, assumptions)?,
        _ => read_guided(section, &title, mode, files, assumptions)?,
    };
    Ok(JointRule { line: section.line(), nodes, motion })
}

/// Reads the motion of a joint that plays an animation of the model.
fn read_animation(section: &Section, assumptions: &mut Vec<String>) -> Result<JointMotion, SceneError> {
    let name = section.required("animation", section.name("animation")?, "the name of the glTF animation")?;
    let repeats = section.boolean("repeat")?.unwrap_or_else(|| {
        assumptions.push(format!(
            "After its end the animation '{name}' holds its last pose, before time 0 its first \
             (joint.repeat is absent)."
        ));
        false
    });
    Ok(JointMotion::Animation { name: name.to_owned(), repeats })
}

/// Reads a joint that turns or slides.
fn read_guided(
    section: &Section,
    title: &str,
    mode: JointMode,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<JointMotion, SceneError> {
    let kind = read_kind(section, mode)?;
    let words = Words::of(kind);
    let along = section.required("axis", axis(section, "axis")?, "the axis in the node's own frame")?;
    let origin = match point(section, "origin")? {
        Some(origin) => origin,
        None => DVec3::ZERO,
    };
    let limits = section.numbers::<2>(words.limits, Quantity::any(words.unit))?;
    if let Some([low, high]) = limits.filter(|[low, high]| low > high) {
        let message = format!("must run from low to high, found {low} to {high} {}", words.unit);
        return Err(section.error(words.limits, message));
    }
    let rate = section.number(words.rate, Quantity::positive(words.rate_unit))?;
    if rate.is_none() && mode != JointMode::Fixed {
        let key = words.rate;
        assumptions.push(format!("The joint '{title}' follows without delay (joint.{key} is absent)."));
    }
    if rate.is_some() {
        assumptions.push(format!("The joint '{title}' starts where it is asked to be, and follows at its rate."));
    }
    let drive = read_drive(section, mode, (along, limits), &words, files)?;
    Ok(JointMotion::Guided(Guided {
        kind,
        axis: along,
        origin,
        drive,
        limits: limits.map(|limits| limits.map(|limit| limit * words.factor)),
        rate: rate.map(|rate| rate * words.factor),
    }))
}

fn read_kind(section: &Section, mode: JointMode) -> Result<JointKind, SceneError> {
    let kind = section
        .choice("kind", &[("rotation", JointKind::Rotation), ("translation", JointKind::Translation)])?
        .unwrap_or(JointKind::Rotation);
    let (foreign, needs): (&[&str], _) =
        if kind == JointKind::Rotation { (&SLIDING, "translation") } else { (&TURNING, "rotation") };
    if let Some(key) = foreign.iter().find(|key| section.has(key)) {
        return Err(section.clash(key, &["kind"], format!("belongs to kind = '{needs}'")));
    }
    if kind == JointKind::Translation && mode == JointMode::Sun {
        return Err(section.clash(
            "mode",
            &["kind"],
            "a joint that slides cannot face the Sun: kind must be 'rotation'",
        ));
    }
    Ok(kind)
}

/// Reads the drive of a joint with an axis and with limits in the units of the scene.
fn read_drive(
    section: &Section,
    mode: JointMode,
    (axis_of_joint, limits): (DVec3, Option<[f64; 2]>),
    words: &Words,
    files: &mut Vec<PathBuf>,
) -> Result<Drive, SceneError> {
    let within = |position: f64, key: &str| match limits {
        Some([low, high]) if !(low..=high).contains(&position) => {
            let message = format!("{position} {} is beyond {}, {low} to {high}", words.unit, words.limits);
            Err(section.clash(key, &[words.limits], message))
        }
        _ => Ok(position * words.factor),
    };
    Ok(match mode {
        JointMode::Fixed => {
            let stated = section.number(words.position, Quantity::any(words.unit))?;
            let position = section.required(words.position, stated, "where the joint stands")?;
            Drive::Fixed(within(position, words.position)?)
        }
        JointMode::Schedule => {
            let (times, positions) = schedule(section, words, files)?;
            let positions = positions.into_iter().map(|position| within(position, "schedule"));
            Drive::Schedule { times, positions: positions.collect::<Result<_, _>>()? }
        }
        JointMode::Sun | JointMode::Animation => {
            let stated = axis(section, "sun_axis")?;
            let facing = section.required("sun_axis", stated, "what is to face the Sun, in the node's own frame")?;
            if parallel(facing, axis_of_joint) {
                return Err(section.clash(
                    "sun_axis",
                    &["axis"],
                    "is parallel to 'axis': turning about it changes nothing",
                ));
            }
            let offset = section.number("offset_deg", Quantity::within(-360.0, 360.0, "deg"))?.unwrap_or(0.0);
            Drive::Sun { facing, offset: offset.to_radians() }
        }
    })
}

/// Times [s] and positions of a schedule, in the units of the scene.
fn schedule(section: &Section, words: &Words, files: &mut Vec<PathBuf>) -> Result<(Vec<f64>, Vec<f64>), SceneError> {
    let shape = format!("{{ time = [..], {} = [..] }} or {{ file = \"..\" }}", words.position);
    let table = section.required("schedule", section.table("schedule", keys::SCHEDULE)?, &shape)?;
    let (times, positions) = match table.path("file")? {
        Some(path) => {
            for key in ["time", "angle_deg", "distance"] {
                table.exclusive("file", key)?;
            }
            let schedule = read_file(&path, words, &table).map_err(|message| match message {
                Ok(message) => table.error("file", message),
                Err(error) => table.error("file", error),
            })?;
            files.push(path);
            schedule
        }
        None => {
            let other = if words.position == "distance" { "angle_deg" } else { "distance" };
            if table.has(other) {
                return Err(table.clash(other, &["joint.kind"], format!("this joint has '{}'", words.position)));
            }
            let times = table.required("time", table.list("time", Quantity::any("s"))?, "the times [s]")?;
            (
                times,
                table.required(
                    words.position,
                    table.list(words.position, Quantity::any(words.unit))?,
                    "where the joint stands then",
                )?,
            )
        }
    };
    if times.is_empty() || times.len() != positions.len() {
        let message = format!("has {} times and {} positions", times.len(), positions.len());
        return Err(section.error("schedule", message));
    }
    if let Some(pair) = times.windows(2).find(|pair| pair[0] > pair[1]) {
        return Err(section.error("schedule", format!("its times must not fall, found {} after {}", pair[1], pair[0])));
    }
    Ok((times, positions))
}

/// An error in a schedule's file: a message about its content, or a read error.
type ScheduleFault = Result<String, SceneError>;

/// Reads a CSV file with the columns `time` [s] and `angle_deg` or `distance`.
fn read_file(path: &std::path::Path, words: &Words, table: &Section) -> Result<(Vec<f64>, Vec<f64>), ScheduleFault> {
    let text = read_text(path).map_err(Err)?;
    let name = path.display();
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(|error| Ok(format!("{name}: {error}")))?.clone();
    let column = |wanted: &str| {
        let place = header.iter().position(|cell| cell == wanted);
        place.ok_or_else(|| Ok(format!("{name}: has no column '{wanted}'; a schedule has time and {}", words.position)))
    };
    let columns = [column("time")?, column(words.position)?];
    let (mut times, mut positions) = (Vec::new(), Vec::new());
    for row in reader.records() {
        let row = row.map_err(|error| Ok(format!("{name}: {error}")))?;
        let line = row.position().map_or(0, csv::Position::line);
        let cell = |place: usize, quantity: Quantity| -> Result<f64, ScheduleFault> {
            let text = row.get(place).unwrap_or_default();
            let number = text.parse::<f64>().map_err(|_| Ok(format!("{name}:{line}: '{text}' is not a number")))?;
            let checked = quantity.check(number).map_err(|message| Ok(format!("{name}:{line}: {message}")))?;
            table.tell_small(number, checked, |message| format!("{name}:{line}: {message}"));
            Ok(checked)
        };
        times.push(cell(columns[0], Quantity::any("s"))?);
        positions.push(cell(columns[1], Quantity::any(words.unit))?);
    }
    Ok((times, positions))
}
