//! The scene file, checked and in SI units.
//!
//! `docs/scene.md` describes every key with its unit, range and default.

use std::path::PathBuf;

use glam::{DQuat, DVec3};
use hifitime::Epoch;

use crate::environment::{Attitude, Environment, Orbit};
use crate::files::Reach;
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
mod radiance;
mod section;
mod shadows;
mod sky_scene;
mod table;
pub mod targets;
pub mod texts;
mod time;
mod value_source;
mod values;
mod vector;
mod view;
pub mod work;

pub use density::{Density, Edges, PartRule};
pub use error::SceneError;
pub use joint::{JointMotion, JointRule};
pub use load::{file_hash, scene_hash};
pub use material::{MaterialRule, MaterialRules};
pub use mesh_network::{ContactRule, Heater, HeaterThermostat, NetworkSettings, Owners};
pub use radiance::{Background, Reflections, Surrounded};
pub use shadows::ShadowSettings;
pub use sky_scene::SkyScene;
pub use vector::AXES;
pub use view::{Initial, Probe};

/// A checked scene. `assumptions` lists every default that was used.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The scene file.
    pub source: PathBuf,
    /// The files that the scene and its model may name.
    pub reach: Reach,
    /// Name for titles: the `name` key, or the file stem.
    pub name: String,
    /// Path of the glTF file.
    pub model_path: PathBuf,
    /// The longest and shortest triangle edges.
    pub density: Density,
    /// The steps, and which of them are drawn.
    pub time: Time,
    /// The orbit or trajectory.
    pub orbit: Orbit,
    /// The orientation of the craft.
    pub attitude: Attitude,
    /// Sun, planet and space.
    pub environment: Environment,
    /// Shadows that the craft casts on itself. `None` switches them off.
    pub shadows: Option<ShadowSettings>,
    /// The joints.
    pub joints: Vec<JointRule>,
    /// Rules that assign thermal values to glTF materials.
    pub materials: MaterialRules,
    /// The camera. A scene that draws nothing may have none ([`Scene::require_camera`]).
    pub camera: Option<Camera>,
    /// Spectral band of the images.
    pub band: Band,
    /// What arrives at the camera besides the emission of surfaces.
    pub surrounded: Surrounded,
    /// Temperatures at the start.
    pub initial: Initial,
    /// Points whose temperature the series records.
    pub probes: Vec<Probe>,
    /// How thermal networks are built and integrated.
    pub network: NetworkSettings,
    /// Contacts between parts or materials of the network.
    pub contacts: Vec<ContactRule>,
    /// Heaters of the network.
    pub heaters: Vec<Heater>,
    /// Temperature range of the false-colour pictures [K]. `None` takes the range of the run.
    pub colour_range: Option<[f64; 2]>,
    /// All files of the scene: scene, model, trajectory, attitude, materials table and function tables. Files that glTF
    /// `extras` name join when the model is known.
    pub files: Vec<PathBuf>,
    /// The trajectory and attitude files among `files`.
    pub sky_files: Vec<PathBuf>,
    /// One sentence for each default that was used.
    pub assumptions: Vec<String>,
}

/// Time steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Time {
    /// Date of time 0, if the scene states it.
    pub start: Option<Epoch>,
    /// Length of a step [s].
    pub step: f64,
    /// Number of steps.
    pub steps: u32,
    /// Number of orbits before time 0.
    pub warm_up_orbits: f64,
    /// Change over an orbit [K] below which the warm-up ends early. `None` always runs all orbits.
    pub periodic: Option<f64>,
    /// Which steps are drawn.
    pub draw: Draw,
}

/// Which steps are drawn. Step 0 is the initial state.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Draw {
    /// No step.
    None,
    /// Every n-th step, including step 0.
    Every(u32),
    /// The listed steps.
    Steps(Vec<u32>),
}

/// The frame of the camera's pose. Its origin is the origin of the craft's body frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFrame {
    /// The body frame of the craft.
    Body,
    /// X along the velocity, Y against the orbit normal, Z to nadir (CCSDS LVLH).
    Orbit,
    /// On a circular orbit: X to orbit noon, Z along the orbit normal. On a trajectory: GCRF.
    Inertial,
}

/// A pinhole camera with OpenCV axes: +X right, +Y down, +Z forward.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Focal lengths (x, y) [px].
    pub focal: [f64; 2],
    /// Principal point [px]. The centre of the upper left pixel is (0.5, 0.5).
    pub centre: [f64; 2],
    /// The frame of the pose.
    pub frame: CameraFrame,
    /// Position in that frame [m].
    pub position: DVec3,
    /// Rotates camera axes into that frame.
    pub frame_from_camera: DQuat,
    /// Distance of the near plane [m].
    pub near: f64,
}
