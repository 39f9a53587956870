//! `[attitude]`: how the craft is turned.

use std::path::PathBuf;

use glam::DVec3;
use hifitime::Epoch;

use super::choice::list;
use super::ephemeris::{AttitudeOptions, read_attitude, read_file};
use super::error::SceneError;
use super::quantity::Quantity;
use super::section::Section;
use super::vector::{axis, parallel, quaternion};
use crate::environment::Attitude;
use crate::environment::rotation_history::HistoryFrame;

#[derive(Clone, Copy)]
enum AttitudeMode {
    Nadir,
    Inertial,
    Sun,
    Spin,
    Tumble,
    File,
}

/// Names of the modes, with the keys that each mode reads.
const MODES: [(&str, AttitudeMode, &[&str]); 6] = [
    ("nadir", AttitudeMode::Nadir, &["nadir_axis", "forward_axis"]),
    ("inertial", AttitudeMode::Inertial, &["quaternion"]),
    ("sun", AttitudeMode::Sun, &["sun_axis", "north_axis"]),
    ("spin", AttitudeMode::Spin, &["quaternion", "spin_axis", "rate_deg"]),
    ("tumble", AttitudeMode::Tumble, &[]),
    ("file", AttitudeMode::File, &["file", "object", "frame", "time_system"]),
];

pub(super) fn read(
    section: &Section,
    start: Option<Epoch>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Attitude, SceneError> {
    let mode = section.choice("mode", &MODES.map(|(name, mode, _)| (name, (name, mode))))?;
    let (name, mode) = section.required("mode", mode, "'nadir', 'inertial', 'sun', 'spin', 'tumble' or 'file'")?;
    let keys_of_mode = MODES.iter().find(|(known, ..)| *known == name).map_or(&[][..], |(.., keys)| *keys);
    for (other, _, keys) in MODES.iter().filter(|(other, ..)| *other != name) {
        if let Some(key) = keys.iter().find(|key| section.has(key) && !keys_of_mode.contains(key)) {
            return Err(section.clash(key, &["mode"], format!("belongs to mode = '{other}', and mode is '{name}'")));
        }
    }
    match mode {
        AttitudeMode::Nadir => {
            let mut axis_or = |key: &str, default: DVec3, default_name: &str| -> Result<DVec3, SceneError> {
                Ok(axis(section, key)?.unwrap_or_else(|| {
                    assumptions.push(format!("The craft's {key} is {default_name} (attitude.{key} is absent)."));
                    default
                }))
            };
            let nadir_axis = axis_or("nadir_axis", DVec3::Z, "+Z")?;
            let forward_axis = axis_or("forward_axis", DVec3::X, "+X")?;
            check_not_parallel(section, ("nadir_axis", nadir_axis), ("forward_axis", forward_axis))?;
            Ok(Attitude::Nadir { nadir_axis, forward_axis })
        }
        AttitudeMode::Inertial => {
            let inertial_from_body = quaternion(section, "quaternion", assumptions)?;
            let what = "[w, x, y, z], which rotates body vectors into the inertial frame";
            Ok(Attitude::Inertial { inertial_from_body: section.required("quaternion", inertial_from_body, what)? })
        }
        AttitudeMode::Sun => {
            let sun_axis = section.required("sun_axis", axis(section, "sun_axis")?, "the body axis to the Sun")?;
            let north_axis = axis(section, "north_axis")?;
            let north_axis = section.required("north_axis", north_axis, "the body axis towards the orbit normal")?;
            check_not_parallel(section, ("sun_axis", sun_axis), ("north_axis", north_axis))?;
            Ok(Attitude::Sun { sun_axis, north_axis })
        }
        AttitudeMode::Spin => {
            let inertial_from_body = quaternion(section, "quaternion", assumptions)?;
            let what = "[w, x, y, z], which rotates body vectors into the inertial frame at time 0";
            let inertial_from_body = section.required("quaternion", inertial_from_body, what)?;
            let axis = section.required("spin_axis", axis(section, "spin_axis")?, "the body axis it turns about")?;
            let rate = section.number("rate_deg", Quantity::any("deg/s"))?;
            let rate = section.required("rate_deg", rate, "the rate of turning [deg/s]")?.to_radians();
            Ok(Attitude::Spin { inertial_from_body, axis, rate })
        }
        AttitudeMode::Tumble => {
            assumptions.push(
                "Loads are means over all orientations, as on a convex craft (attitude.mode = 'tumble'); images show the body along the inertial axes.".to_owned(),
            );
            Ok(Attitude::Tumble)
        }
        AttitudeMode::File => {
            let path = section.required("file", section.path("file")?, "a CCSDS AEM, or a table of quaternions")?;
            let text = read_file(path.clone(), files).map_err(|error| section.error("file", error))?;
            let frames = [("inertial", HistoryFrame::Inertial), ("orbit", HistoryFrame::Orbit)];
            let options = AttitudeOptions {
                object: section.string("object")?.map(str::to_owned),
                frame: section.choice("frame", &frames)?,
                time_system: section.string("time_system")?.map(str::to_owned),
                start,
            };
            let others = ["object", "frame", "time_system", "time.start", "orbit.*"];
            section.blame("file", &others, read_attitude(&path, &text, &options, assumptions)).map(Attitude::History)
        }
    }
}

fn check_not_parallel(section: &Section, first: (&str, DVec3), second: (&str, DVec3)) -> Result<(), SceneError> {
    if parallel(first.1, second.1) {
        // One of the two keys may be a default. The error must point to the key that the file holds.
        let key = if section.has(second.0) { second.0 } else { first.0 };
        let message =
            format!("{} are parallel and give no attitude", list([first.0, second.0]).replace("', '", "' and '"));
        return Err(section.clash(key, &[first.0, second.0], message));
    }
    Ok(())
}
