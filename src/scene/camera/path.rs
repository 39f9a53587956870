//! The path of a camera: a table of poses, or the trajectory and the attitude of the craft that carries it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use hifitime::{Epoch, TimeScale};

use super::super::ephemeris::{
    self, AttitudeOptions, Columns, FileLine, LENGTH_TOLERANCE, Options, number, one_line_end, read_attitude, read_file,
};
use super::super::epoch::parse_epoch;
use super::super::error::SceneError;
use super::super::file::read_text;
use super::super::motion::{CameraPath, Motion};
use super::super::section::Section;
use super::super::vector::{point, quaternion};
use super::super::{Camera, CameraFrame};
use super::pose;
use crate::environment::Orbit;
use crate::environment::pose_path::{NoPose, PathPositions, PathRotations, PosePath};
use crate::environment::position_history::PositionHistory;
use crate::environment::rotation_history::{
    HistoryFrame, RotationHistory, RotationInterpolation, RotationSample, RotationSegment,
};
use crate::environment::scene_time::SceneTime;
use crate::environment::trajectory::seconds_between;

impl Camera {
    /// The camera at a time [s], with the pose that it has then. `image` is the number of an image at its own time.
    ///
    /// # Errors
    /// A path that does not cover the time, or a view without a direction.
    pub fn at(&self, time: f64, image: Option<u32>) -> Result<Self, NoPose> {
        let (position, frame_from_camera) = match &self.motion {
            Motion::Still | Motion::Framed => (self.position, self.frame_from_camera),
            Motion::Path(path) => path.poses.pose(time)?,
            Motion::Listed(poses) => poses[image.unwrap_or(0) as usize],
        };
        Ok(Self { position, frame_from_camera, motion: Motion::Still, ..self.clone() })
    }

    /// Checks that the camera has a pose for all rows of images at some times [s].
    ///
    /// # Errors
    /// The first time without one, with the file and the times that it covers.
    pub(crate) fn check_times(&self, mut times: impl Iterator<Item = f64>) -> Result<(), SceneError> {
        let Motion::Path(path) = &self.motion else { return Ok(()) };
        let half = 0.5 * self.exposure.time;
        let ends = [-half, self.shutter_time() + half];
        let absent = |time: f64| ends.into_iter().find_map(|end| path.poses.pose(time + end).err());
        match times.find_map(absent) {
            Some(fault) => Err(FileLine { path: &path.file, line: 1 }.error("camera.path", fault)),
            None => Ok(()),
        }
    }
}

/// The orbit that a path is relative to, and time 0 where it has a date.
pub(in crate::scene) struct PathOrbit<'a> {
    pub(crate) orbit: &'a Orbit,
    pub(crate) planet_radius: f64,
    pub(crate) start: Option<Epoch>,
}

const OF_THE_ORBIT: [&str; 5] = ["object", "path_relative_to", "orbit.*", "time.start", "environment.planet_radius"];

#[derive(Clone, Copy, PartialEq)]
enum PathOrigin {
    Craft,
    Planet,
}

/// The frame of a path, and the origin of its positions. `None` where the scene states neither.
fn frame_of(section: &Section, stated: Option<CameraFrame>) -> Result<(Option<CameraFrame>, PathOrigin), SceneError> {
    let words =
        [("orbit", (CameraFrame::Orbit, PathOrigin::Craft)), ("inertial", (CameraFrame::Inertial, PathOrigin::Planet))];
    let Some((frame, origin)) = section.choice("path_relative_to", &words)? else {
        return Ok((stated, PathOrigin::Craft));
    };
    if stated.is_some_and(|stated| stated != frame) {
        let name = if frame == CameraFrame::Orbit { "orbit" } else { "inertial" };
        let message = format!("says that the path is in the frame '{name}', and camera.frame is another");
        return Err(section.clash("path_relative_to", &["frame"], message));
    }
    Ok((Some(frame), origin))
}

/// Reads `camera.path`. Returns the frame and the path.
pub(super) fn read(
    section: &Section,
    stated: Option<CameraFrame>,
    around: &PathOrbit<'_>,
    files: &mut Vec<PathBuf>,
    assumptions: &mut Vec<String>,
) -> Result<Option<(Option<CameraFrame>, CameraPath)>, SceneError> {
    let of_path = ["path_relative_to", "attitude", "object", "mount"];
    let Some(path) = section.path("path")? else {
        return match of_path.iter().find(|key| section.has(key)) {
            Some(key) => Err(section.clash(key, &["path"], "belongs to camera.path, which is missing")),
            None => Ok(None),
        };
    };
    section.exclusive("path", "position")?;
    section.exclusive("path", "quaternion")?;
    let (mut frame, origin) = frame_of(section, stated)?;
    let text = read_file(path.clone(), files).map_err(|error| section.error("path", error))?;
    let mut reader = PathReader { section, around, files, assumptions };
    let (places, rotations) = if ephemeris::is_message(&text) {
        if frame.is_some_and(|frame| frame != CameraFrame::Inertial) {
            let message = "is a trajectory round the planet, so camera.frame and path_relative_to are 'inertial'";
            return Err(section.clash("path", &["frame", "path_relative_to"], message));
        }
        frame = Some(CameraFrame::Inertial);
        (reader.chaser(&path, &text)?, None)
    } else {
        let table =
            table(&path, &text, around.start, RowOrder::Rising).and_then(|table| reader.places(&path, table, origin));
        section.blame("path", &OF_THE_ORBIT, table)?
    };
    let turns = reader.turns(rotations, frame.unwrap_or(CameraFrame::Body))?;
    let mount = quaternion(section, "mount", assumptions)?.unwrap_or(DQuat::IDENTITY);
    Ok(Some((frame, CameraPath { file: path, poses: PosePath { places, turns, mount } })))
}

struct PathReader<'a, 'b> {
    section: &'a Section<'a>,
    around: &'a PathOrbit<'a>,
    files: &'b mut Vec<PathBuf>,
    assumptions: &'b mut Vec<String>,
}

impl PathReader<'_, '_> {
    fn object(&self) -> Result<Option<String>, SceneError> {
        Ok(self.section.string("object")?.map(str::to_owned))
    }

    /// The trajectory of the craft that carries the camera.
    fn chaser(&mut self, path: &Path, text: &str) -> Result<PathPositions, SceneError> {
        let Orbit::Trajectory(craft) = self.around.orbit else {
            let message =
                "is a trajectory in GCRF, and the orbit of the scene is circular, without a date: it needs orbit.file";
            return Err(self.section.clash("path", &["orbit.*"], message));
        };
        let options =
            Options { object: self.object()?, start: self.around.start, elsewhere: true, ..Options::default() };
        let trajectory = ephemeris::read(path, text, &options, self.assumptions);
        let trajectory = self.section.blame("path", &OF_THE_ORBIT, trajectory)?;
        Ok(PathPositions::Chaser { trajectory, craft: Arc::clone(craft) })
    }

    /// Positions and rotations of a table. Positions from the planet's centre become those from the craft, before anything is interpolated.
    fn places(
        &mut self,
        path: &Path,
        table: Vec<PathRow>,
        origin: PathOrigin,
    ) -> Result<(PathPositions, Option<Arc<RotationHistory>>), SceneError> {
        let mut samples = Vec::with_capacity(table.len());
        for row in &table {
            let from = match origin {
                PathOrigin::Craft => DVec3::ZERO,
                PathOrigin::Planet => {
                    let craft = self.around.orbit.point(row.time, self.around.planet_radius);
                    let missing = || {
                        let message = format!("{} s: the trajectory of the craft has no position then", row.time);
                        FileLine { path, line: row.line }.error("time", message)
                    };
                    craft.ok_or_else(missing)?.position
                }
            };
            samples.push((row.time, row.position - from));
        }
        let sample = |row: &PathRow| {
            let (derivative, spin) = (None, None);
            row.rotation.map(|rotation| RotationSample { time: row.time, frame_from_body: rotation, derivative, spin })
        };
        let rotations: Vec<RotationSample> = table.iter().filter_map(sample).collect();
        let history = || {
            let usable = (f64::NEG_INFINITY, f64::INFINITY);
            let segment = RotationSegment { samples: rotations, interpolation: RotationInterpolation::Arc, usable };
            // The camera states its own frame, so this one is not read.
            Arc::new(RotationHistory::new(path.display().to_string(), HistoryFrame::Inertial, vec![segment]))
        };
        let rotated = table.iter().any(|row| row.rotation.is_some());
        Ok((PathPositions::Samples(PositionHistory::new(&samples)), rotated.then(history)))
    }

    /// The rotations of a path: of its table, of an attitude file, or towards a point.
    fn turns(
        &mut self,
        of_table: Option<Arc<RotationHistory>>,
        frame: CameraFrame,
    ) -> Result<PathRotations, SceneError> {
        let section = self.section;
        section.exclusive("attitude", "look_at")?;
        if let Some(history) = of_table {
            if let Some(key) = ["attitude", "look_at", "up"].iter().find(|key| section.has(key)) {
                return Err(section.clash(key, &["path"], "cannot be combined with the quaternions of camera.path"));
            }
            return Ok(PathRotations::History(history));
        }
        if let Some(file) = section.path("attitude")? {
            section.exclusive("attitude", "up")?;
            return self.attitude(&file, frame);
        }
        if section.has("mount") {
            return Err(section.clash(
                "mount",
                &["attitude", "path"],
                "turns the camera on its carrier, and the path states no rotations",
            ));
        }
        let what = "the point that the camera looks at, because camera.path states no rotations (or camera.attitude)";
        let target = section.required("look_at", point(section, "look_at")?, what)?;
        Ok(PathRotations::LookAt(target, pose::up(section, frame, self.assumptions)?))
    }

    fn attitude(&mut self, file: &Path, frame: CameraFrame) -> Result<PathRotations, SceneError> {
        let wrong =
            |message: &str| self.section.clash("attitude", &["orbit.*", "frame", "path", "path_relative_to"], message);
        let text = read_file(file.to_path_buf(), self.files).map_err(|error| self.section.error("attitude", error))?;
        if !ephemeris::is_message(&text) {
            return Err(wrong("is no CCSDS AEM; a table has its quaternions in camera.path itself"));
        }
        if frame != CameraFrame::Inertial || self.around.orbit.trajectory().is_none() {
            return Err(wrong("turns from GCRF, so camera.frame must be 'inertial' and the scene needs orbit.file"));
        }
        let options =
            AttitudeOptions { object: self.object()?, start: self.around.start, ..AttitudeOptions::default() };
        let history = read_attitude(file, &text, &options, self.assumptions);
        let history = self.section.blame("attitude", &OF_THE_ORBIT, history)?;
        if history.frame != HistoryFrame::Inertial {
            return Err(wrong("turns from the orbit frame of its own craft; state it in EME2000, ICRF or GCRF"));
        }
        Ok(PathRotations::History(history))
    }
}

struct PathRow {
    line: usize,
    /// Since time 0 [s].
    time: f64,
    position: DVec3,
    rotation: Option<DQuat>,
}

#[derive(Clone, Copy, PartialEq)]
enum RowOrder {
    Rising,
    NotFalling,
}

/// Largest coordinate of a table [m].
const FARTHEST: f64 = 1e13;

fn table(path: &Path, text: &str, start: Option<Epoch>, order: RowOrder) -> Result<Vec<PathRow>, SceneError> {
    let whole_lines = one_line_end(text);
    let text = whole_lines.as_ref();
    let rotation = ["qw", "qx", "qy", "qz"];
    let columns = Columns::read_beside(path, text, &["time", "x", "y", "z"], &rotation, &["image", "file"])?;
    let mut rows: Vec<PathRow> = Vec::with_capacity(columns.rows.len());
    for row in &columns.rows {
        let (time, position, rotation) = columns.cells(path, row)?;
        let at = FileLine { path, line: row.0 };
        let wrong = |message: String| at.error(&format!("time {time}"), message);
        let seconds = match (number(&time), start) {
            (Some(seconds), _) => seconds,
            (None, Some(start)) => {
                let epoch = parse_epoch(&time, TimeScale::UTC).map_err(|message| at.error("time", message))?;
                seconds_between(start, epoch)
            }
            (None, None) => {
                let message = format!("'{time}' is no number of seconds, and for a date the scene needs time.start");
                return Err(at.error("time", message));
            }
        };
        let seconds = SceneTime::new(seconds).map_err(|error| at.error("time", error))?.seconds();
        let before = rows.last().map(|last: &PathRow| last.time);
        if order == RowOrder::Rising && before.is_some_and(|before| before >= seconds) {
            return Err(wrong("does not come after the time of the row above: times must increase".to_owned()));
        }
        if before.is_some_and(|before| before > seconds) {
            return Err(wrong("lies before the time of the row above: times must not decrease".to_owned()));
        }
        if let Some(far) = position.iter().find(|coordinate| coordinate.abs() > FARTHEST) {
            return Err(wrong(format!("a coordinate of {far:e} m is beyond {FARTHEST:e} m")));
        }
        let rotation = rotation.as_deref().map(|q| unit(q).map_err(&wrong)).transpose()?;
        rows.push(PathRow { line: row.0, time: seconds, position: DVec3::from_slice(&position), rotation });
    }
    if rows.is_empty() {
        return Err(FileLine { path, line: 1 }.error("camera.path", "has no rows"));
    }
    Ok(rows)
}

/// The rotation of four numbers, scalar first.
fn unit(q: &[f64]) -> Result<DQuat, String> {
    let rotation = DQuat::from_xyzw(q[1], q[2], q[3], q[0]);
    let length = rotation.length();
    if (length - 1.0).abs() > LENGTH_TOLERANCE || !length.is_finite() {
        return Err(format!("a quaternion has length 1 to within {LENGTH_TOLERANCE}, not {length}"));
    }
    Ok(rotation.normalize())
}

/// Poses of a table, in the order of their times.
pub(crate) struct Poses {
    /// Times of the poses [s], which do not decrease.
    pub(crate) times: Vec<f64>,
    /// Position [m] and rotation of camera axes, in the camera's frame.
    pub(crate) poses: Vec<(DVec3, DQuat)>,
}

/// Reads a table of poses that a command names. The columns are `time,x,y,z,qw,qx,qy,qz`. Times may be equal, and do not decrease.
///
/// # Errors
/// A file that cannot be read, a value that no pose can have, or a time before 0, with file and line.
pub(crate) fn read_poses(path: &Path, start: Option<Epoch>) -> Result<Poses, SceneError> {
    let rows = table(path, &read_text(path)?, start, RowOrder::NotFalling)?;
    let mut all = Poses { times: Vec::new(), poses: Vec::new() };
    for row in rows {
        let at = FileLine { path, line: row.line };
        let Some(rotation) = row.rotation else {
            return Err(at.error("qw", "is missing in the header; a table has time,x,y,z,qw,qx,qy,qz"));
        };
        if row.time < 0.0 {
            return Err(at.error("time", format!("{} s lies before time 0", row.time)));
        }
        all.times.push(row.time);
        all.poses.push((row.position, rotation));
    }
    Ok(all)
}
