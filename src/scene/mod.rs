//! What the user wrote, checked and in SI: the scene file as plain values.
//!
//! `docs/scene.md` is the reference of the file: every key with its unit, range and default.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DQuat, DVec3};
use hifitime::Epoch;

use crate::environment::rotation_history::RotationHistory;
use crate::environment::trajectory::Trajectory;
use crate::thermal::material::Material;

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
mod values;
mod vector;
mod view;

pub use density::{Density, Edges, PartRule};
pub use error::SceneError;
pub use joint::{JointMotion, JointRule};
pub use load::{file_hash, scene_hash};
pub use mesh_network::{ContactRule, Heater, HeaterThermostat, NetworkSettings, Owners};
pub use shadows::ShadowSettings;
pub use sky_scene::SkyScene;

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

/// Where the craft is.
#[derive(Debug, Clone, PartialEq)]
pub enum Orbit {
    /// On a circle, with the Sun where beta and phase put it.
    Circular(CircularOrbit),
    /// On a real trajectory around the Earth, with the Sun where it is at that time.
    Trajectory(Arc<Trajectory>),
}

/// A circular orbit. Altitude and period are separate inputs; their disagreement is printed.
#[derive(Debug, Clone, PartialEq)]
pub struct CircularOrbit {
    /// Height above the planet radius [m].
    pub altitude: f64,
    /// Period [s].
    pub period: f64,
    /// Angle between the Sun's direction and the orbit plane [rad].
    pub beta: f64,
    /// Angle from orbit noon at time 0, in the direction of motion [rad].
    pub phase: f64,
}

/// Attitude law.
#[derive(Debug, Clone, PartialEq)]
pub enum Attitude {
    /// A body axis to the planet's centre, another towards the velocity (made orthogonal).
    Nadir {
        /// Unit body axis that points to nadir.
        nadir_axis: DVec3,
        /// Unit body axis that points along the velocity.
        forward_axis: DVec3,
    },
    /// Fixed in the orbit's inertial frame.
    Inertial {
        /// Rotates body vectors into the inertial frame.
        inertial_from_body: DQuat,
    },
    /// A body axis to the Sun, another towards the orbit normal (made orthogonal).
    Sun {
        /// Unit body axis that points to the Sun.
        sun_axis: DVec3,
        /// Unit body axis that points towards the orbit normal.
        north_axis: DVec3,
    },
    /// Turning about a body axis that stands still in the inertial frame.
    Spin {
        /// Rotates body vectors into the inertial frame at time 0.
        inertial_from_body: DQuat,
        /// Unit axis in the body.
        axis: DVec3,
        /// Rate about it [rad/s].
        rate: f64,
    },
    /// As a file says.
    History(Arc<RotationHistory>),
}

/// What heats the craft; a `None` is absent and costs nothing.
#[derive(Debug, Clone, PartialEq)]
pub struct Environment {
    /// Solar flux at one astronomical unit [W/m2].
    pub solar_constant: Option<f64>,
    /// Bond albedo of the planet (Lambert).
    pub albedo: Option<f64>,
    /// Infrared exitance of the planet [W/m2].
    pub planet_ir: Option<f64>,
    /// Radius of the planet [m].
    pub planet_radius: f64,
    /// Whether the planet shadows the Sun.
    pub eclipse: bool,
    /// Radiative temperature of space [K]; `None` is 0 K.
    pub background_temperature: Option<f64>,
}

/// Rules in the order of the file; the first that matches a glTF material's name wins.
#[derive(Debug, Clone, Default)]
pub struct MaterialRules {
    /// The rules.
    pub rules: Vec<MaterialRule>,
    /// Used where no rule matches and the glTF material has no `isotherm_` extras of its own.
    pub default: Option<MaterialRule>,
    /// What `extras` are read with when the model is known.
    extras: material::ExtrasContext,
}

/// Patterns and the values that they give.
#[derive(Debug, Clone)]
pub struct MaterialRule {
    /// Wildcard patterns (`*`, `?`) on glTF material names.
    pub patterns: Vec<String>,
    /// Values; `name` is filled in when the rule is applied.
    pub material: Material,
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

/// A rectangular spectral band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Band {
    /// Lower wavelength [m].
    pub lower: f64,
    /// Upper wavelength [m].
    pub upper: f64,
}

/// State at the start (time 0, or the start of the warm-up).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Initial {
    /// Settled at the balance temperature of the first tick's mean load.
    Balance,
    /// Settled at this temperature [K].
    Temperature(f64),
}

/// A point whose nearest node is written to the series.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Column name.
    pub name: String,
    /// Position in the body frame [m].
    pub position: DVec3,
    /// Only nodes of this part, where given.
    pub part: Option<String>,
}
