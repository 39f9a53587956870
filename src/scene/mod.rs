//! What the user wrote, checked and in SI: the scene file as plain values.
//!
//! `docs/scene.md` is the reference of the file: every key with its unit, range and default.

use std::path::PathBuf;

use glam::{DQuat, DVec3};
use hifitime::Epoch;

use crate::environment::{Attitude, Environment, Orbit};
use crate::thermal::planck::Band;

mod attitude;
mod camera;
mod density;
mod environment;
mod ephemeris;
mod epoch;
mod error;
mod extras;
mod file;
mod joint;
mod keys;
mod load;
mod material;
mod mesh_network;
pub mod network;
mod orbit;
mod profile;
mod quantity;
mod section;
mod shadows;
mod sky_scene;
mod table;
pub mod targets;
mod time;
mod value_source;
mod values;
mod vector;
mod view;

pub use density::{Density, Edges, PartRule};
pub use error::SceneError;
pub use joint::{JointMotion, JointRule};
pub use load::{file_hash, scene_hash};
pub use material::{MaterialRule, MaterialRules};
pub use mesh_network::{ContactRule, Heater, HeaterThermostat, NetworkSettings, Owners};
pub use shadows::ShadowSettings;
pub use sky_scene::SkyScene;
pub use view::{Initial, Probe};

/// A checked scene. Nothing in it is a default that the user was not told of: see `assumptions`.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file.
    pub source: PathBuf,
    /// Name for titles: the file's `name` key, or its stem.
    pub name: String,
    /// glTF file, resolved against the scene file's folder.
    pub model_path: PathBuf,
    /// How long and how short the edges of its triangles may be.
    pub density: Density,
    /// Steps and what is drawn of them.
    pub time: Time,
    /// Where the craft is.
    pub orbit: Orbit,
    /// How it is turned.
    pub attitude: Attitude,
    /// What heats it.
    pub environment: Environment,
    /// How it shadows itself; `None` where it does not.
    pub shadows: Option<ShadowSettings>,
    /// What moves.
    pub joints: Vec<JointRule>,
    /// Rules that give every glTF material its values.
    pub materials: MaterialRules,
    /// The camera; a scene that draws nothing may have none ([`Scene::require_camera`]).
    pub camera: Option<Camera>,
    /// Spectral band of the images.
    pub band: Band,
    /// Temperatures at the start.
    pub initial: Initial,
    /// Points whose temperature is written to the series.
    pub probes: Vec<Probe>,
    /// How thermal networks are made and integrated.
    pub network: NetworkSettings,
    /// Contacts between parts or materials of the network.
    pub contacts: Vec<ContactRule>,
    /// Heat in parts of the network.
    pub heaters: Vec<Heater>,
    /// Temperature range of the false-colour pictures [K]; `None` takes it from each run.
    pub colour_range: Option<[f64; 2]>,
    /// Every file that the scene consists of: scene, model, trajectory and attitude, materials table where there is
    /// one, and the tables that response functions were read from; those that glTF `extras` name join when the model is known.
    pub files: Vec<PathBuf>,
    /// Those of `files` that trajectory and attitude were read from.
    pub sky_files: Vec<PathBuf>,
    /// What was assumed because the file is silent, one sentence each.
    pub assumptions: Vec<String>,
}

/// Time steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Time {
    /// Time 0, where the scene states it.
    pub start: Option<Epoch>,
    /// Length of a step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u32,
    /// Orbits stepped before time 0.
    pub warm_up_orbits: f64,
    /// Change over an orbit [K] below which the warm-up ends before its orbits do; `None` steps them all.
    pub periodic: Option<f64>,
    /// Which steps are drawn.
    pub draw: Draw,
}

/// Which steps are drawn; step 0 is the initial state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Draw {
    /// None of them.
    None,
    /// Every n-th, step 0 included.
    Every(u32),
    /// These.
    Steps(Vec<u32>),
}

/// Frame in which the camera's pose is given; its origin is the craft's body origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFrame {
    /// Follows the craft's attitude.
    Body,
    /// X along the velocity, Y against the orbit normal, Z to nadir (CCSDS LVLH).
    Orbit,
    /// Of a circular orbit: X to orbit noon, Z along the orbit normal. Of a trajectory: GCRF.
    Inertial,
}

/// A pinhole camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Focal lengths in pixels (x, y).
    pub focal: [f64; 2],
    /// Principal point in pixels; the centre of the upper left pixel is (0.5, 0.5).
    pub centre: [f64; 2],
    /// Frame of the pose.
    pub frame: CameraFrame,
    /// Position in that frame [m].
    pub position: DVec3,
    /// Rotates camera axes into that frame.
    pub frame_from_camera: DQuat,
    /// Distance of the near plane [m].
    pub near: f64,
}
