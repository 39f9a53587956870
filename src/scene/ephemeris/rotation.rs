//! Converts a segment of a CCSDS AEM to quaternions, as its metadata define (CCSDS 504.0-B-1 and -B-2).
//! Conversion comes before interpolation, so the stated form of a rotation does not affect the result.

use std::path::Path;

use glam::{DQuat, DVec3};
use hifitime::TimeScale;

use super::super::choice::list;
use super::super::epoch::time_system;
use super::super::error::SceneError;
use super::span::StatedValue;
use super::stated::{reference_frame, stated_degree};
use super::text::{FileLine, name_of};
use crate::environment::divided_differences::hermite_degree;
use crate::environment::ephemeris::DEFAULT_DEGREE;
use crate::environment::frames::ReferenceFrame;
use crate::environment::rotation_history::{HistoryFrame, RotationInterpolation};

#[derive(Default)]
pub(super) struct Metadata {
    pub(super) line: usize,
    /// Version: 1 or 2.
    pub(super) version: u32,
    /// Line, key and value of each entry.
    pub(super) entries: Vec<(usize, String, String)>,
}

pub(super) struct AttitudeSegment {
    pub(super) line: usize,
    /// Name and identifier of the object.
    pub(super) object: (String, String),
    pub(super) frame: HistoryFrame,
    pub(super) kind: RotationKind,
    /// Whether the rotations take frame vectors into the body. The usual direction is the opposite.
    inverted: bool,
    pub(super) scale: TimeScale,
    pub(super) start: StatedValue,
    pub(super) stop: StatedValue,
    pub(super) usable_start: StatedValue,
    pub(super) usable_stop: StatedValue,
    pub(super) interpolation: RotationInterpolation,
    pub(super) rows: Vec<RotationRow>,
    /// Whether the file ends inside the segment.
    pub(super) torn: bool,
}

pub(super) struct RotationRow {
    pub(super) line: usize,
    pub(super) epoch: String,
    /// The numbers in the order of [`RotationKind::columns`].
    pub(super) numbers: Vec<f64>,
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum RotationForm {
    Quaternion {
        scalar_first: bool,
    },
    /// Turns about these axes (0 is X). Each turn starts from the attitude after the previous one.
    Euler {
        axes: [usize; 3],
    },
    Spin,
}

/// The derivatives that are stated with a rotation.
#[derive(Clone, Copy, PartialEq)]
enum Beside {
    Nothing,
    Derivatives,
    /// Rates of version 1. The standard does not say if they are Euler rates or an angular velocity.
    Rates,
    /// Angular velocity of frame B relative to frame A [deg/s].
    AngularVelocity,
}

pub(super) struct RotationKind {
    /// `ATTITUDE_TYPE`.
    pub(super) name: &'static str,
    pub(super) shape: RotationForm,
    beside: Beside,
    /// Whether the angular velocity has components along the axes of frame B.
    velocity_in_b: bool,
}

const QUATERNION: &str = "QUATERNION";
const EULER: &str = "EULER_ANGLE";
const SPIN: &str = "SPIN";
const KINDS: [(&str, &str, Beside); 9] = [
    (QUATERNION, QUATERNION, Beside::Nothing),
    ("QUATERNION/DERIVATIVE", QUATERNION, Beside::Derivatives),
    ("QUATERNION/RATE", QUATERNION, Beside::Rates),
    ("QUATERNION/ANGVEL", QUATERNION, Beside::AngularVelocity),
    (EULER, EULER, Beside::Nothing),
    ("EULER_ANGLE/DERIVATIVE", EULER, Beside::Derivatives),
    ("EULER_ANGLE/RATE", EULER, Beside::Rates),
    ("EULER_ANGLE/ANGVEL", EULER, Beside::AngularVelocity),
    (SPIN, SPIN, Beside::Nothing),
];

impl RotationKind {
    pub(super) fn columns(&self) -> Vec<&'static str> {
        let (mut columns, derivatives) = match self.shape {
            RotationForm::Quaternion { scalar_first: true } => {
                (vec!["QC", "Q1", "Q2", "Q3"], ["QC_DOT", "Q1_DOT", "Q2_DOT", "Q3_DOT"].as_slice())
            }
            RotationForm::Quaternion { scalar_first: false } => {
                (vec!["Q1", "Q2", "Q3", "QC"], ["Q1_DOT", "Q2_DOT", "Q3_DOT", "QC_DOT"].as_slice())
            }
            RotationForm::Euler { .. } => {
                (vec!["ANGLE_1", "ANGLE_2", "ANGLE_3"], ["ANGLE_1_DOT", "ANGLE_2_DOT", "ANGLE_3_DOT"].as_slice())
            }
            RotationForm::Spin => (vec!["SPIN_ALPHA", "SPIN_DELTA", "SPIN_ANGLE", "SPIN_ANGLE_VEL"], [].as_slice()),
        };
        columns.extend_from_slice(match self.beside {
            Beside::Nothing => &[],
            Beside::Derivatives => derivatives,
            Beside::Rates => &["X_RATE", "Y_RATE", "Z_RATE"],
            Beside::AngularVelocity => &["ANGVEL_X", "ANGVEL_Y", "ANGVEL_Z"],
        });
        columns
    }
}

pub(super) fn unit(column: &str) -> &'static str {
    match column {
        "QC" | "Q1" | "Q2" | "Q3" => "",
        _ if column.starts_with('Q') => "1/s",
        _ if column.ends_with("_DOT") || column.starts_with("ANGVEL") || column.ends_with("_VEL") => "deg/s",
        _ => "deg",
    }
}

pub(super) fn version(at: &FileLine, stated: &str) -> Result<u32, SceneError> {
    match stated.trim().split('.').next() {
        Some("1") => Ok(1),
        Some("2") => Ok(2),
        _ => Err(at.error("CCSDS_AEM_VERS", format!("version '{stated}' is not known; 1.0 and 2.0 are"))),
    }
}

/// The rotation of the body into the frame that a row states, its derivative [1/s], and the rate of a spin [rad/s].
pub(super) fn rotation(segment: &AttitudeSegment, numbers: &[f64]) -> (DQuat, Option<DQuat>, Option<f64>) {
    let (stated, rest) = numbers.split_at(if matches!(segment.kind.shape, RotationForm::Euler { .. }) { 3 } else { 4 });
    let quaternion = |numbers: &[f64], scalar_first: bool| match *numbers {
        [w, x, y, z] if scalar_first => DQuat::from_xyzw(x, y, z, w),
        [x, y, z, w] => DQuat::from_xyzw(x, y, z, w),
        _ => DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0),
    };
    let half_turning = |velocity: DVec3| DQuat::from_vec4((0.5 * velocity).extend(0.0));
    let (turn, derivative) = match segment.kind.shape {
        RotationForm::Quaternion { scalar_first } => {
            let derivative = (segment.kind.beside == Beside::Derivatives).then(|| quaternion(rest, scalar_first));
            (quaternion(stated, scalar_first), derivative)
        }
        RotationForm::Euler { axes } => {
            let turns = [0, 1, 2].map(|i| DQuat::from_axis_angle(DVec3::AXES[axes[i]], stated[i].to_radians()));
            let [first, second, third] = turns;
            let derivative = (segment.kind.beside == Beside::Derivatives).then(|| {
                let rates = [0, 1, 2].map(|i| turns[i] * half_turning(DVec3::AXES[axes[i]] * rest[i].to_radians()));
                rates[0] * second * third + first * rates[1] * third + first * second * rates[2]
            });
            (first * second * third, derivative)
        }
        RotationForm::Spin => {
            // The body's Z is the spin axis. At SPIN_ANGLE 0 the body's X lies in the frame's XY plane, 90 deg ahead of
            // the axis. Orekit uses this convention. The standard leaves it to the parties.
            let (alpha, delta) = (stated[0].to_radians(), stated[1].to_radians());
            let right = std::f64::consts::FRAC_PI_2;
            let turn = DQuat::from_rotation_z(right + alpha)
                * DQuat::from_rotation_x(right - delta)
                * DQuat::from_rotation_z(stated[2].to_radians());
            return (turn, None, Some(stated[3].to_radians()));
        }
    };
    let derivative = derivative.or_else(|| {
        let velocity = (segment.kind.beside == Beside::AngularVelocity)
            .then(|| half_turning(DVec3::from_slice(rest) * 1f64.to_radians()))?;
        Some(if segment.kind.velocity_in_b { turn * velocity } else { velocity * turn })
    });
    // The quaternion that turns axes from A to B takes vector components from B to A.
    let either = |quaternion: DQuat| if segment.inverted { quaternion.conjugate() } else { quaternion };
    (either(turn), derivative.map(either), None)
}

impl Metadata {
    fn get(&self, key: &str) -> Option<(usize, &str)> {
        self.entries.iter().find(|(_, known, _)| known == key).map(|(line, _, value)| (*line, value.as_str()))
    }

    fn owned(&self, key: &str) -> StatedValue {
        self.get(key).map(|(line, value)| (line, value.to_owned()))
    }

    fn required(&self, path: &Path, key: &str) -> Result<(usize, &str), SceneError> {
        let missing = || FileLine { path, line: self.line }.error(key, "is missing in the metadata of this segment");
        self.get(key).ok_or_else(missing)
    }
}

/// Checks the metadata of a segment and interprets them.
pub(super) fn interpret(
    path: &Path,
    metadata: &Metadata,
    assumptions: &mut Vec<String>,
) -> Result<AttitudeSegment, SceneError> {
    let mut assume = |said: String| {
        let said = format!("{}:{}: {said}", name_of(path), metadata.line);
        if !assumptions.contains(&said) {
            assumptions.push(said);
        }
    };
    let (frame, body_is_b) = frames(path, metadata)?;
    let a_to_b = direction(path, metadata, &mut assume)?;
    let mut kind = kind(path, metadata, &mut assume)?;
    let inverted = a_to_b != body_is_b;
    if inverted && kind.shape == RotationForm::Spin {
        let (line, _) = metadata.get("ATTITUDE_DIR").or(metadata.get("REF_FRAME_A")).unwrap_or((metadata.line, ""));
        let message = "the axis of a spin is stated in the outer frame, so the rotation must lead to the body's frame";
        return Err(FileLine { path, line }.error("ATTITUDE_DIR", message));
    }
    let (line, system) = metadata.required(path, "TIME_SYSTEM")?;
    let scale = time_system(system).map_err(|message| FileLine { path, line }.error("TIME_SYSTEM", message))?;
    let interpolation = interpolation(path, metadata, &kind, &mut assume)?;
    if matches!(interpolation, RotationInterpolation::Hermite(_)) && kind.beside == Beside::AngularVelocity {
        kind.velocity_in_b = velocity_in_b(path, metadata)?;
    }
    let missing: Vec<&str> = ["OBJECT_NAME", "OBJECT_ID", "START_TIME", "STOP_TIME"]
        .into_iter()
        .filter(|key| metadata.get(key).is_none())
        .collect();
    if !missing.is_empty() {
        assume(format!("the metadata of this segment lack {}.", missing.join(", ")));
    }
    if kind.shape == RotationForm::Spin {
        assume(
            "SPIN_ANGLE counts from the body's X axis in the XY plane of the reference frame, 90 deg ahead of the spin \
             axis's right ascension, and the spin axis is the body's Z."
                .to_owned(),
        );
    }
    let text = |key: &str| metadata.get(key).map(|(_, value)| value.to_owned()).unwrap_or_default();
    Ok(AttitudeSegment {
        line: metadata.line,
        object: (text("OBJECT_NAME"), text("OBJECT_ID")),
        frame,
        kind,
        inverted,
        scale,
        start: metadata.owned("START_TIME"),
        stop: metadata.owned("STOP_TIME"),
        usable_start: metadata.owned("USEABLE_START_TIME"),
        usable_stop: metadata.owned("USEABLE_STOP_TIME"),
        interpolation,
        rows: Vec::new(),
        torn: false,
    })
}

/// The frame outside the body, and whether the body is frame B.
fn frames(path: &Path, metadata: &Metadata) -> Result<(HistoryFrame, bool), SceneError> {
    let (line_a, a) = metadata.required(path, "REF_FRAME_A")?;
    let (line_b, b) = metadata.required(path, "REF_FRAME_B")?;
    let at = |line: usize| FileLine { path, line };
    let is_body = |name: &str| {
        let name = name.to_ascii_uppercase();
        name.starts_with("SC_") || name.starts_with("SC BODY")
    };
    let (line, outside, body_is_b) = match (is_body(a), is_body(b)) {
        (false, true) => (line_a, a, true),
        (true, false) => (line_b, b, false),
        _ => return Err(at(line_a).error("REF_FRAME_A", "one of the two frames must be the body, SC_BODY_1")),
    };
    if outside.to_ascii_uppercase().starts_with("LVLH") {
        return Ok((HistoryFrame::Orbit, body_is_b));
    }
    match reference_frame(outside) {
        Ok(ReferenceFrame::Inertial) => Ok((HistoryFrame::Inertial, body_is_b)),
        _ => {
            let message = format!("'{outside}' is not one of 'EME2000', 'J2000', 'ICRF', 'GCRF', 'LVLH'");
            Err(at(line).error("REF_FRAME", message))
        }
    }
}

/// Whether the rotations go from frame A to frame B. Version 1 states it. Version 2 always does it.
fn direction(path: &Path, metadata: &Metadata, assume: &mut impl FnMut(String)) -> Result<bool, SceneError> {
    let Some((line, stated)) = metadata.get("ATTITUDE_DIR") else {
        if metadata.version == 1 {
            assume("ATTITUDE_DIR is missing and taken for A2B.".to_owned());
        }
        return Ok(true);
    };
    let at = FileLine { path, line };
    match stated.to_ascii_uppercase().as_str() {
        "A2B" => Ok(true),
        "B2A" if metadata.version == 1 => Ok(false),
        "B2A" => Err(at.error("ATTITUDE_DIR", "B2A belongs to version 1: in version 2 rotations are from A to B")),
        _ => Err(at.error("ATTITUDE_DIR", format!("'{stated}' is not one of 'A2B', 'B2A'"))),
    }
}

fn kind(path: &Path, metadata: &Metadata, assume: &mut impl FnMut(String)) -> Result<RotationKind, SceneError> {
    let (line, stated) = metadata.required(path, "ATTITUDE_TYPE")?;
    let plain = stated.to_ascii_uppercase().replace(' ', "_");
    let Some((name, shape, beside)) = KINDS.iter().find(|(known, ..)| *known == plain) else {
        let known = list(KINDS.map(|(known, ..)| known));
        return Err(FileLine { path, line }
            .error("ATTITUDE_TYPE", format!("'{stated}' is not read; it must be one of {known}")));
    };
    let shape = match *shape {
        QUATERNION => RotationForm::Quaternion { scalar_first: scalar_first(path, metadata, assume)? },
        EULER => RotationForm::Euler { axes: sequence(path, metadata)? },
        _ => RotationForm::Spin,
    };
    if *beside == Beside::Rates {
        assume(format!("the rates of {name} are passed over."));
    }
    Ok(RotationKind { name, shape, beside: *beside, velocity_in_b: true })
}

/// Whether the scalar of a quaternion comes first. Version 1 states it. In version 2 it never does.
fn scalar_first(path: &Path, metadata: &Metadata, assume: &mut impl FnMut(String)) -> Result<bool, SceneError> {
    let Some((line, stated)) = metadata.get("QUATERNION_TYPE") else {
        if metadata.version == 1 {
            assume("QUATERNION_TYPE is missing and taken for LAST.".to_owned());
        }
        return Ok(false);
    };
    let at = FileLine { path, line };
    match stated.to_ascii_uppercase().as_str() {
        "LAST" => Ok(false),
        "FIRST" if metadata.version == 1 => Ok(true),
        "FIRST" => Err(at.error("QUATERNION_TYPE", "FIRST belongs to version 1: in version 2 the scalar is last")),
        _ => Err(at.error("QUATERNION_TYPE", format!("'{stated}' is not one of 'FIRST', 'LAST'"))),
    }
}

/// The axes of `EULER_ROT_SEQ`, first turn first. Digits (1 is X) and letters are accepted in both versions.
fn sequence(path: &Path, metadata: &Metadata) -> Result<[usize; 3], SceneError> {
    let (line, stated) = metadata.required(path, "EULER_ROT_SEQ")?;
    let axis = |letter: char| match letter {
        '1' | 'X' | 'x' => Some(0),
        '2' | 'Y' | 'y' => Some(1),
        '3' | 'Z' | 'z' => Some(2),
        _ => None,
    };
    let axes: Option<Vec<usize>> = stated.chars().map(axis).collect();
    match axes.as_deref() {
        Some([first, second, third]) if first != second && second != third => Ok([*first, *second, *third]),
        _ => {
            let message = format!(
                "'{stated}' is not a sequence of three axes such as 321 or ZYX, each different from the one before"
            );
            Err(FileLine { path, line }.error("EULER_ROT_SEQ", message))
        }
    }
}

/// Whether angular velocities have components along the axes of frame B.
fn velocity_in_b(path: &Path, metadata: &Metadata) -> Result<bool, SceneError> {
    let key = if metadata.get("ANGVEL_FRAME").is_some() { "ANGVEL_FRAME" } else { "RATE_FRAME" };
    let (line, stated) = metadata.get(key).ok_or_else(|| {
        let message = "is missing: HERMITE needs the axes of the angular velocities";
        FileLine { path, line: metadata.line }.error("ANGVEL_FRAME", message)
    })?;
    let frames = ["REF_FRAME_A", "REF_FRAME_B"].map(|frame| (frame, metadata.get(frame).map_or("", |(_, name)| name)));
    let place =
        frames.iter().position(|(frame, name)| stated.eq_ignore_ascii_case(frame) || stated.eq_ignore_ascii_case(name));
    place.map(|place| place == 1).ok_or_else(|| {
        let message = format!("'{stated}' is neither of the two frames, {}", list(frames.map(|(_, name)| name)));
        FileLine { path, line }.error(key, message)
    })
}

/// The interpolation of a segment. A linear method becomes the arc between quaternions.
fn interpolation(
    path: &Path,
    metadata: &Metadata,
    kind: &RotationKind,
    assume: &mut impl FnMut(String),
) -> Result<RotationInterpolation, SceneError> {
    let key = if metadata.get("INTERPOLATION").is_some() { "INTERPOLATION" } else { "INTERPOLATION_METHOD" };
    let degree = metadata.owned("INTERPOLATION_DEGREE").map(|stated| stated_degree(path, &stated)).transpose()?;
    let Some((line, method)) = metadata.get(key) else {
        return Ok(RotationInterpolation::Arc);
    };
    let method = method.to_ascii_uppercase();
    let known = ["LINEAR", "SLERP", "LAGRANGE", "HERMITE"];
    if !known.contains(&method.as_str()) {
        return Err(FileLine { path, line }.error(key, format!("'{method}' is not one of {}", list(known))));
    }
    if kind.shape == RotationForm::Spin || method == "LINEAR" || method == "SLERP" {
        return Ok(RotationInterpolation::Arc);
    }
    let chosen = degree.unwrap_or(DEFAULT_DEGREE);
    if degree.is_none() {
        assume(format!("INTERPOLATION_DEGREE is missing and taken for {chosen}."));
    }
    if method == "LAGRANGE" {
        return Ok(RotationInterpolation::Lagrange(chosen));
    }
    if matches!(kind.beside, Beside::Nothing | Beside::Rates) {
        assume(format!("HERMITE is done as LAGRANGE of degree {chosen}: {} has no derivatives.", kind.name));
        return Ok(RotationInterpolation::Lagrange(chosen));
    }
    let done = hermite_degree(chosen);
    if done != chosen {
        assume(format!("Hermite interpolation of degree {chosen} is done with degree {done}."));
    }
    Ok(RotationInterpolation::Hermite(chosen))
}
